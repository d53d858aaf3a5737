//! The guide `docs/own_module.md` as a program.
//!
//! `cargo run --example guide_own_module`

use std::error::Error;

use symbolt::neurons::{Layers, Map};
use symbolt::prelude::*;
use symbolt::sim::{
    AdvanceIo, Fingerprint, InputSpec, Node, NodeFault, OutputSpec, PortDecl, Real, StateSpec,
    StepCx, World, WorldError, WorldLink, WorldSave,
};
use symbolt::spa::{FEED_FORWARD, Linear, VocabError};

struct Parts;
impl VocabTag for Parts {
    const NAME: &'static str = "parts";
}

struct Novelty<V: VocabTag> {
    memory: CleanupMemory<V>,
    items: usize,
}

impl<V: VocabTag> Novelty<V> {
    fn new(known: &Vocabulary<V>, names: &[&str]) -> Result<Self, VocabError> {
        let every = SelectRule::Threshold { level: 0.5 };
        let memory = CleanupMemory::new(known, names.iter().copied(), every)?;
        Ok(Self { memory, items: names.len() })
    }
}

impl<V: VocabTag> Module for Novelty<V> {
    type Ports = Ports<Pointer<V>, Vector>;

    fn expand(self, scope: &mut Scope<'_>) -> Self::Ports {
        let memory = scope.add("memory", self.memory);
        let known = scope.add("known", Linear::rows(self.items, vec![1.0; self.items]));
        // A layer: the population plan decides how it is computed.
        let not = scope.map("not", Map::each(1, |known| 1.0 - known));
        let output = scope.add("output", Add::vector(1));
        scope.connect(&memory.items, &known.input, Synapse::None);
        scope.connect(&known.output, &not.input, Synapse::None);
        scope.connect(&not.output, &output.input, FEED_FORWARD);
        Ports {
            input: scope.input("input", memory.input),
            output: scope.output("output", output.output),
        }
    }
}

fn module() -> Result<(), Box<dyn Error>> {
    let parts = VocabularyBuilder::<Parts>::new(256, Seed::new(1));
    let parts = parts.pointers(["NUT", "BOLT", "CAT"]).build()?;
    for mode in [Population::Direct, Population::Lif(LifSpec::default())] {
        let mut graph = GraphBuilder::new();
        let seen = Stimulus::pointer(parts.space(), &parts.get("CAT")?)
            .from(SimDuration::from_millis(100), &parts.get("NUT")?);
        let seen = graph.add("seen", seen);
        let novelty = graph.add("novelty", Novelty::new(&parts, &["NUT", "BOLT"])?);
        graph.connect(&seen, &novelty.input, Synapse::None);
        // Spikes are noisy: the probe filters what it records.
        let probe = ProbeSpec::default().filtered(Synapse::lowpass_ms(20));
        let shown = graph.probe(&novelty.output, probe);

        let plan = PopulationPlan::all(mode.clone());
        let graph = graph.build(Timebase::default(), &plan, Seed::new(1))?;
        let mut sim = Simulator::new(graph.into(), RunConfig::default())?;
        sim.run_for(SimDuration::from_millis(200))?;
        for (name, ms) in [("cat", 100), ("nut", 200)] {
            if let Some((_, novelty)) = sim.samples(&shown).get(ms - 1) {
                println!("{mode}: at {ms} ms the {name} has novelty {:.1}", novelty[0]);
            }
        }
    }
    Ok(())
}

fn faults() -> Result<(), Box<dyn Error>> {
    let parts = VocabularyBuilder::<Parts>::new(64, Seed::new(1)).pointer("NUT").build()?;
    let mut graph = GraphBuilder::new();
    graph.add("bind", Bind::new(&parts)); // nothing is connected to it
    let built = graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1));
    if let Err(faults) = built {
        println!("{faults}");
    }
    Ok(())
}

struct Stopwatch {
    level: Real,
}

impl Node for Stopwatch {
    fn declare(&self, ports: &mut PortDecl) {
        ports
            .input("value", InputSpec::scalar().at_advance())
            .output("ticks", OutputSpec::scalar().registered())
            .state(StateSpec { words: 1, ..StateSpec::default() });
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.reals(&[self.level]);
    }

    fn advance(&self, _cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let ticks = &mut io.state.words[0];
        *ticks = if io.inputs.scalar(0) > self.level { *ticks + 1 } else { 0 };
        io.outputs.set(0, *ticks as Real);
        Ok(())
    }
}

fn node() -> Result<(), Box<dyn Error>> {
    let mut graph = GraphBuilder::new();
    let value = Stimulus::scalar(0.0).from(SimDuration::from_millis(20), &[1.0]);
    let value = graph.add("value", value);
    let watch = graph.node("watch", Stopwatch { level: 0.5 });
    graph.connect(&value, &watch.input::<Scalar>("value"), Synapse::lowpass_ms(5));
    let ticks = watch.output::<Scalar>("ticks");

    let graph = graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1))?;
    let mut sim = Simulator::new(graph.into(), RunConfig::default())?;
    sim.run_for(SimDuration::from_millis(50))?;
    println!("the stopwatch shows {} ticks", sim.value(&ticks)[0]);
    Ok(())
}

struct Kettle {
    celsius: Real,
}

impl World for Kettle {
    fn period(&self) -> SimDuration {
        SimDuration::from_millis(10)
    }
    fn sense_width(&self) -> usize {
        1
    }
    fn command_width(&self) -> usize {
        1
    }
    fn sense(&self, out: &mut [Real]) {
        out[0] = self.celsius;
    }
    fn advance(&mut self, command: &[Real]) -> Result<(), WorldError> {
        self.celsius += 0.01 * (command[0] - 0.5 * (self.celsius - 20.0));
        Ok(())
    }
    fn reset(&mut self, _seed: Seed) -> Result<(), WorldError> {
        self.celsius = 20.0;
        Ok(())
    }
    fn save(&self) -> Result<WorldSave, WorldError> {
        Ok(WorldSave(self.celsius.to_le_bytes().to_vec()))
    }
    fn restore(&mut self, saved: &WorldSave) -> Result<(), WorldError> {
        let bytes = saved.0.as_slice().try_into();
        let bytes = bytes.map_err(|_| WorldError::new("not a kettle's save"))?;
        self.celsius = Real::from_le_bytes(bytes);
        Ok(())
    }
}

fn world() -> Result<(), Box<dyn Error>> {
    let mut graph = GraphBuilder::new();
    let link = WorldLink::new();
    let link = link.sense("celsius", OutputSpec::scalar()).command("power", InputSpec::scalar());
    let kettle = graph.world("kettle", link);
    let celsius = kettle.output::<Scalar>("celsius");
    let power = graph.add("power", Constant::scalar(30.0));
    graph.connect(&power, &kettle.input("power"), Synapse::None);

    let graph = graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1))?;
    let config = RunConfig::default().in_world(Kettle { celsius: 20.0 });
    let mut sim = Simulator::new(graph.into(), config)?;
    sim.run_for(SimDuration::from_secs(20))?;
    println!("the water has {:.1} degrees", sim.value(&celsius)[0]);
    Ok(())
}

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    module()?;
    faults()?;
    node()?;
    world()
}
