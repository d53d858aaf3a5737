//! A graph with every kind of memory. Restored and reset runs give the same bits, and so does noise. Other graphs
//! refuse its checkpoints. The graph can be drawn and searched.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::sync::Arc;

use symbolt::neurons::{Layers, LifSpec, Map, Population, PopulationPlan, Tuning};
use symbolt::sim::Ports;
use symbolt::sim::{
    Add, Constant, Graph, GraphBuilder, InputSpec, Module, Noise, OutputSpec, ProbeSpec, Real,
    RunConfig, Scalar, Scope, ScriptedWorld, Seed, SimDuration, SimError, Simulator, Synapse,
    Timebase, Vector, World, WorldError, WorldLink, WorldSave,
};
use symbolt::spa::Linear;

use crate::counter::{Counter, MS, build, start};

/// Builds a graph with every kind of memory: filters, registers, state, noise, probes and a world.
fn everything() -> Arc<Graph> {
    let mut graph = GraphBuilder::new();
    let world = graph.world(
        "world",
        WorldLink::new()
            .sense("seen", OutputSpec::vector(2))
            .command("heard", InputSpec::vector(2)),
    );
    let sum = graph.add("sum", Add::vector(2));
    let noise = graph.add("noise", Noise::vector(2, 0.3));
    graph.connect(&world.output("seen"), &noise.input, Synapse::None);
    graph.connect(&noise.output, &sum.input, Synapse::lowpass_ms(7));
    graph.connect(&sum.output, &sum.input, Synapse::lowpass_ms(20));
    graph.connect(&sum.output, &world.input("heard"), Synapse::None);
    let counter = graph.node("counter", Counter);
    graph.probe::<Scalar>(
        &counter.output("later"),
        ProbeSpec::default().filtered(Synapse::lowpass_ms(3)),
    );
    build(graph)
}

fn in_script(seed: u64) -> RunConfig {
    let senses = (0..50).map(|i| vec![(i as f32).sin(), 1.0]).collect();
    RunConfig::seeded(Seed::new(seed)).in_world(ScriptedWorld::new(MS(2), senses, 2))
}

#[test]
fn a_restored_run_continues_with_the_same_bits() {
    let graph = everything();
    let mut whole = Simulator::new(graph.clone(), in_script(5)).expect("starts");
    whole.run_for(MS(37)).expect("runs");
    let middle = whole.checkpoint().expect("it can be saved");
    whole.run_for(MS(40)).expect("runs");
    let end = whole.checkpoint().expect("it can be saved");

    // The checkpoint is written as text and restored into a run of another seed.
    let text = serde_json::to_string(&middle).expect("it can be written");
    let read = serde_json::from_str(&text).expect("it can be read");
    assert_eq!(middle, read);
    let mut other = Simulator::new(graph, in_script(6)).expect("starts");
    other.run_for(MS(11)).expect("runs");
    other.restore(&read).expect("it fits");
    assert_eq!(other.tick(), 37);
    other.run_for(MS(40)).expect("runs");
    assert_eq!(other.checkpoint().expect("it can be saved"), end);
    assert_ne!(middle, end);
}

#[test]
fn a_reset_run_is_a_fresh_run() {
    let graph = everything();
    let mut sim = Simulator::new(graph.clone(), in_script(5)).expect("starts");
    let fresh = sim.checkpoint().expect("it can be saved");
    sim.run_for(MS(25)).expect("runs");
    let after = sim.checkpoint().expect("it can be saved");
    sim.reset().expect("resets");
    assert_eq!(sim.checkpoint().expect("it can be saved"), fresh);
    sim.run_for(MS(25)).expect("runs");
    assert_eq!(sim.checkpoint().expect("it can be saved"), after);
}

#[test]
fn a_reset_after_a_restore_returns_to_the_seed_and_noise_of_the_run() {
    let graph = everything();
    let mut other = Simulator::new(graph.clone(), in_script(5)).expect("starts");
    other.run_for(MS(9)).expect("runs");
    let foreign = other.checkpoint().expect("it can be saved");
    let quiet = || in_script(6).with_noise(0.5);
    let mut fresh = Simulator::new(graph.clone(), quiet()).expect("starts");
    fresh.run_for(MS(25)).expect("runs");
    let expected = fresh.checkpoint().expect("it can be saved");
    let mut sim = Simulator::new(graph, quiet()).expect("starts");
    sim.restore(&foreign).expect("it fits");
    sim.reset().expect("resets");
    sim.run_for(MS(25)).expect("runs");
    assert_eq!(sim.checkpoint().expect("it can be saved"), expected);
}

#[test]
fn checkpoints_of_other_graphs_are_refused() {
    let mut graph = GraphBuilder::new();
    graph.node("counter", Counter);
    let mut small = start(&build(graph));
    let sim = Simulator::new(everything(), in_script(1)).expect("starts");
    assert_eq!(
        small.restore(&sim.checkpoint().expect("it can be saved")),
        Err(SimError::ForeignCheckpoint)
    );
}

/// Parameters of a graph with a matrix, a layer, a constant and a filter. Each test changes one number.
struct Parameters {
    given: f32,
    matrix: f32,
    slope: f32,
    plan: PopulationPlan,
    seed: u64,
}

fn described(of: &Parameters) -> Arc<Graph> {
    struct Layer(f32);
    impl Module for Layer {
        type Ports = Ports<Vector>;
        fn expand(self, scope: &mut Scope<'_>) -> Ports<Vector> {
            let slope = self.0;
            scope.map("map", Map::each(2, move |x| slope * x))
        }
    }
    let mut graph = GraphBuilder::new();
    let given = graph.add("given", Constant::vector(&[of.given, 0.5]));
    let mixed = graph.add("mixed", Linear::rows(2, vec![1.0, 0.0, of.matrix, 1.0]));
    let layer = graph.add("layer", Layer(of.slope));
    let sum = graph.add("sum", Add::vector(2));
    graph.connect(&given, &mixed.input, Synapse::None);
    graph.connect(&mixed.output, &layer.input, Synapse::None);
    graph.connect(&layer.output, &sum.input, Synapse::lowpass_ms(5));
    Arc::new(graph.build(Timebase::default(), &of.plan, Seed::new(of.seed)).expect("it is sound"))
}

#[test]
fn checkpoints_are_refused_by_a_graph_with_any_other_parameter() {
    let lif = |spec| PopulationPlan::all(Population::Lif(spec));
    let tuning = Tuning { per_function: 20, ..Tuning::default() };
    let usual = LifSpec::tuned(tuning);
    let rate = PopulationPlan::all(Population::Rate(usual));
    let same = |plan: &PopulationPlan| Parameters {
        given: 0.3,
        matrix: 0.1,
        slope: 1.0,
        plan: plan.clone(),
        seed: 1,
    };
    for plan in [PopulationPlan::direct(), rate.clone(), lif(usual)] {
        let mut taken = start(&described(&same(&plan)));
        taken.run_for(MS(20)).expect("runs");
        let checkpoint = taken.checkpoint().expect("it can be saved");
        let mut again = start(&described(&same(&plan)));
        again.restore(&checkpoint).expect("it was built in the same way");
        assert_eq!(again.checkpoint().expect("it can be saved"), checkpoint);
        let mut others = vec![
            Parameters { given: 0.31, ..same(&plan) },
            Parameters { matrix: 0.11, ..same(&plan) },
            Parameters { slope: 0.9, ..same(&plan) },
            Parameters { seed: 2, ..same(&plan) },
        ];
        let faster = LifSpec::tuned(Tuning { max_rates: [201.0, 400.0], ..tuning });
        let plans = [PopulationPlan::direct(), rate.clone(), lif(usual), lif(faster)];
        others.extend(plans.iter().filter(|other| **other != plan).map(same));
        assert!(others.len() >= 7);
        for (at, other) in others.iter().enumerate() {
            let refused = start(&described(other)).restore(&checkpoint);
            assert_eq!(refused, Err(SimError::ForeignCheckpoint), "{plan:?}, number {at}");
        }
    }
}

/// A world that cannot be saved.
struct Unsaved(ScriptedWorld);

impl World for Unsaved {
    fn period(&self) -> SimDuration {
        self.0.period()
    }
    fn sense_width(&self) -> usize {
        self.0.sense_width()
    }
    fn command_width(&self) -> usize {
        self.0.command_width()
    }
    fn sense(&self, out: &mut [Real]) {
        self.0.sense(out);
    }
    fn advance(&mut self, command: &[Real]) -> Result<(), WorldError> {
        self.0.advance(command)
    }
    fn reset(&mut self, seed: Seed) -> Result<(), WorldError> {
        self.0.reset(seed)
    }
    fn save(&self) -> Result<WorldSave, WorldError> {
        Err(WorldError::new("its disk is full"))
    }
    fn restore(&mut self, saved: &WorldSave) -> Result<(), WorldError> {
        self.0.restore(saved)
    }
}

#[test]
fn saving_a_world_that_cannot_be_saved_is_an_error() {
    let mut graph = GraphBuilder::new();
    let link = WorldLink::new().sense("place", OutputSpec::scalar());
    graph.world("world", link);
    let graph = graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1));
    let graph = Arc::new(graph.expect("it is well wired"));
    let script = ScriptedWorld::new(SimDuration::from_millis(2), vec![vec![0.5]; 4], 0);
    let run = RunConfig::default().in_world(Unsaved(script));
    let mut sim = Simulator::new(graph, run).expect("it fits");
    sim.run_for(SimDuration::from_millis(3)).expect("it runs");
    let failed = sim.checkpoint().expect_err("the world cannot be saved").to_string();
    assert_eq!(failed, "the world failed in tick 3: its disk is full");
}

#[test]
fn noise_is_a_function_of_run_seed_path_and_tick() {
    let run = |noise: f32, seed: u64, extra: bool| {
        let mut graph = GraphBuilder::new();
        let one = graph.add("one", Constant::vector(&[1.0, 2.0]));
        let noisy = graph.add("noisy", Noise::vector(2, 0.1));
        graph.connect(&one, &noisy.input, Synapse::None);
        if extra {
            let more = graph.add("a_first_one", Noise::vector(2, 0.1));
            graph.connect(&one, &more.input, Synapse::None);
        }
        let probe = graph.probe(&noisy.output, ProbeSpec::default());
        let run = RunConfig::seeded(Seed::new(seed)).with_noise(noise);
        let mut sim = Simulator::new(build(graph), run).expect("starts");
        sim.run_for(MS(2000)).expect("runs");
        sim.samples(&probe).iter().map(|(_, v)| v[0]).collect::<Vec<f32>>()
    };
    let noisy = run(1.0, 1, false);
    assert_eq!(noisy, run(1.0, 1, false), "the same seed gives the same bits");
    assert_eq!(noisy, run(1.0, 1, true), "another node does not change the noise");
    assert_ne!(noisy, run(1.0, 2, false), "another seed gives other noise");
    assert!(run(0.0, 1, false).iter().all(|v| *v == 1.0), "noise of zero changes nothing");
    // With 2,000 draws, a mean beyond 4.5 sd/sqrt(n) or a deviation beyond 7.5% occurs once in 100,000 seeds.
    let mean = noisy.iter().map(|v| f64::from(*v)).sum::<f64>() / 2000.0;
    let sd = (noisy.iter().map(|v| (f64::from(*v) - mean).powi(2)).sum::<f64>() / 1999.0).sqrt();
    assert!((mean - 1.0).abs() < 4.5 * 0.1 / 2000f64.sqrt() && (sd / 0.1 - 1.0).abs() < 0.075);
    for bad in [-1.0, f32::NAN, f32::INFINITY] {
        let config = RunConfig::default().with_noise(bad);
        assert!(matches!(Simulator::new(everything(), config), Err(SimError::BadNoise { .. })));
    }
}

#[test]
fn the_graph_can_be_drawn_and_searched() {
    let graph = everything();
    let dot = graph.to_dot();
    assert!(dot.starts_with("digraph symbolt {") && dot.trim_end().ends_with('}'));
    assert_eq!(dot.matches("label=\"noise").count(), 1);
    assert_eq!(dot.matches(" -> ").count(), graph.edge_count());
    assert_eq!(dot.matches("[label=").count(), graph.node_count() + graph.edge_count());
    assert_eq!(dot.matches('{').count(), dot.matches('}').count());
    let missing = graph.output("sum.outt").expect_err("no such output").to_string();
    assert!(missing.contains("`sum.out`"), "{missing}");
    let mut sim = Simulator::new(graph.clone(), in_script(1)).expect("starts");
    sim.run_for(MS(4)).expect("runs");
    let sum = graph.output("sum.out").expect("there");
    assert_eq!(sim.value_of(sum).len(), 2);
}
