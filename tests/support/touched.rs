//! Random graphs with every kind of memory, and random interventions in them.

use std::sync::Arc;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use symbolt::neurons::{Ensemble, Learned, LifSpec, Pes, Population, PopulationPlan, Tuning};
use symbolt::prelude::*;
use symbolt::sim::{
    Graph, In, InputSpec, Intervention, Out, OutputSpec, ProbeId, Scalar, ScriptedWorld,
    SpikeProbe, Threads, Vector, WhiteNoise, WhiteSignal, WorldLink,
};

use crate::counter::Counter;

/// A graph with its probes.
pub struct Touched {
    pub graph: Arc<Graph>,
    pub probes: Vec<ProbeId<Vector>>,
    pub counted: ProbeId<Scalar>,
    pub spikes: SpikeProbe,
}

/// A module of a sum and, by its kind, noise or neurons behind it.
struct Knot {
    kind: usize,
}

impl Module for Knot {
    type Ports = (In<Vector>, Out<Vector>);

    fn expand(self, scope: &mut Scope<'_>) -> Self::Ports {
        let sum = scope.add("sum", Add::vector(2));
        let output = match self.kind {
            0 => sum.output,
            1 => {
                let noise = scope.add("noise", Noise::vector(2, 0.1));
                scope.connect(&sum.output, &noise.input, Synapse::None);
                noise.output
            }
            _ => {
                let cells = scope.add("cells", Ensemble::new(2).neurons(40).identity("x"));
                scope.connect(&sum.output, &cells.input, Synapse::None);
                cells.output("x")
            }
        };
        (scope.input("input", sum.input), scope.output("output", output))
    }
}

/// `exact`, `rate` or `spiking`: learned connections are between neurons in all of them.
pub fn plan(mode: &str) -> PopulationPlan {
    let spec = LifSpec::tuned(Tuning { scale: 0.3, ..Tuning::default() });
    let plan = match mode {
        "exact" => PopulationPlan::direct(),
        "rate" => PopulationPlan::all(Population::Rate(spec)),
        _ => PopulationPlan::all(Population::Lif(spec)),
    };
    let of = if mode == "rate" { Population::Rate(spec) } else { Population::Lif(spec) };
    plan.with("cells/neurons".parse().unwrap(), of.clone())
        .with("post/neurons".parse().unwrap(), of)
}

impl Touched {
    pub fn new(seed: u64, mode: &str) -> Self {
        let rng = &mut Seed::new(seed).rng();
        let mut graph = GraphBuilder::new();
        let link = WorldLink::new()
            .sense("seen", OutputSpec::vector(2))
            .command("heard", InputSpec::vector(2));
        let world = graph.world("world", link);
        let hiss = graph.add("hiss", WhiteNoise::vector(2).filtered(Synapse::lowpass_ms(5)));
        let wave = graph.add("wave", WhiteSignal::vector(2, SimDuration::from_millis(60), 80.0));
        let goal = graph.add("goal", Constant::vector(&[0.4, -0.3]));
        let counter = graph.node("counter", Counter);
        let mut outs: Vec<Out<Vector>> = vec![world.output("seen"), hiss, wave, goal];
        let mut sums = Vec::new();
        for index in 0..rng.random_range(3..6) {
            let kind = rng.random_range(0..3);
            let (input, output) = graph.add(&format!("m{index}"), Knot { kind });
            sums.push(input);
            outs.push(output);
        }
        let synapse = |rng: &mut ChaCha8Rng| match rng.random_range(0..3) {
            0 => Synapse::delay_ms(rng.random_range(1..5)),
            1 => Synapse::alpha_ms(rng.random_range(2..9)),
            _ => Synapse::lowpass_ms(rng.random_range(2..20)),
        };
        for sum in &sums {
            for _ in 0..2 {
                let from = &outs[rng.random_range(0..outs.len())];
                let via = synapse(rng);
                graph.route((0.5 * from >> sum).via(via));
            }
        }
        let cells = Ensemble::new(2).neurons(120).expose_neurons().identity("x");
        let cells = graph.add("cells", cells);
        let last = outs[outs.len() - 1].clone();
        let both = graph.add("both", Add::vector(2));
        for from in [&last, &outs[1]] {
            graph.route((from >> &both.input).via(synapse(rng)));
        }
        graph.route(&both.output >> &cells);
        let post = graph.add("post", Ensemble::new(2).neurons(40).identity("x"));
        let decoded = Learned::new(&cells.neurons(), 2).rule(Pes::default());
        let decoded = graph.add("decoded", decoded);
        graph.route(&decoded >> &post.input);
        graph.route(post.output("x") - [0.5, -0.5] >> &decoded.error());
        graph.connect(&last, &world.input("heard"), Synapse::lowpass_ms(4));
        let mut probes: Vec<_> =
            outs.iter().map(|out| graph.probe(out, ProbeSpec::default())).collect();
        let spec = ProbeSpec::every(SimDuration::from_millis(3)).last(5);
        probes.push(graph.probe(&post.output("x"), spec.filtered(Synapse::lowpass_ms(10))));
        let counted = graph.probe(&counter.output("later"), ProbeSpec::default());
        let spikes = graph.probe_spikes("cells");
        let graph = graph
            .build(Timebase::default(), &plan(mode), Seed::new(seed))
            .unwrap_or_else(|error| panic!("{error}"));
        Self { graph: Arc::new(graph), probes, counted, spikes }
    }

    pub fn config(&self, threads: usize) -> RunConfig {
        let senses = (0..50).map(|i| vec![(i as f32).sin(), 0.5]).collect();
        let world = ScriptedWorld::new(SimDuration::from_millis(3), senses, 2);
        let threads = Threads::Exactly(threads);
        RunConfig::seeded(Seed::new(9)).with_threads(threads).in_world(world)
    }

    pub fn start(&self, threads: usize) -> Simulator {
        Simulator::new(self.graph.clone(), self.config(threads)).unwrap()
    }

    /// The bits of all that was recorded, but for the probe that keeps only the last samples, and of the state.
    pub fn bits(&self, sim: &Simulator) -> (Vec<u64>, Vec<(u64, usize)>, String) {
        let all = &self.probes[..self.probes.len() - 1];
        let values = all.iter().flat_map(|probe| {
            let samples = sim.samples(probe);
            let all: Vec<_> = samples.iter().map(|(t, v)| (t, v.to_vec())).collect();
            all.into_iter().flat_map(|(time, values)| {
                let values = values.into_iter().map(|v| u64::from(v.to_bits()));
                [time.to_bits()].into_iter().chain(values).collect::<Vec<_>>()
            })
        });
        let counted = sim.samples(&self.counted).iter().map(|(_, v)| u64::from(v[0].to_bits()));
        let spikes = sim.spikes(&self.spikes).iter().map(|(t, neuron)| (t.to_bits(), neuron));
        let state = serde_json::to_string(&sim.checkpoint().unwrap()).unwrap();
        (values.chain(counted).collect(), spikes.collect(), state)
    }

    /// A random intervention; releases may be refused.
    pub fn intervention(&self, rng: &mut ChaCha8Rng) -> Intervention {
        let outputs: Vec<String> = self.graph.outputs().collect();
        let value = |rng: &mut ChaCha8Rng| rng.random_range(-1.0..1.0f32);
        let paths: Vec<&str> = self.graph.paths().collect();
        let path = |rng: &mut ChaCha8Rng| -> String {
            let path = paths[rng.random_range(0..paths.len())];
            let module = path.split('/').next().unwrap();
            [path, module][rng.random_range(0..2)].into()
        };
        let at = |rng: &mut ChaCha8Rng| match rng.random_range(0..3) {
            0 => outputs[rng.random_range(0..outputs.len())].clone(),
            _ => path(rng),
        };
        match rng.random_range(0..6) {
            0 => {
                let output = outputs[rng.random_range(0..outputs.len())].clone();
                let width = self.width(&output);
                Intervention::Clamp { output, values: (0..width).map(|_| value(rng)).collect() }
            }
            1 => Intervention::Silence { at: at(rng) },
            2 => Intervention::Set {
                output: ["goal.out", "world.seen"][rng.random_range(0..2)].into(),
                values: vec![value(rng), value(rng)],
            },
            3 => {
                let scale = [0.0, 0.5, 1.0, 3.0][rng.random_range(0..4)];
                let at = (rng.random_range(0..3) > 0).then(|| path(rng));
                Intervention::Noise { at, scale }
            }
            _ => Intervention::Release { at: at(rng) },
        }
    }

    pub fn width(&self, output: &str) -> usize {
        let sim = self.start(1);
        sim.value_of(self.graph.output(output).unwrap()).len()
    }
}
