//! Neurons as ports: activities out, currents in, and inputs that are read at the end of a tick.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::sync::Arc;

use symbolt::neurons::{Ensemble, EnsemblePorts, Lif, LifRate, NeuronModel, PopulationPlan};
use symbolt::prelude::*;
use symbolt::sim::{
    AdvanceIo, BuildError, Fingerprint, InputSpec, Node, NodeFault, OutputSpec, PortDecl, Ranks,
    Real, Signal, StateSpec, StepCx, Threads, Vector,
};

use crate::alike::alike;

fn ms(ms: u64) -> SimDuration {
    SimDuration::from_millis(ms)
}

fn lif() -> PopulationPlan {
    PopulationPlan::lif()
}

fn rate() -> PopulationPlan {
    PopulationPlan::rate()
}

fn unbiased(model: impl NeuronModel) -> PopulationPlan {
    alike(model, 0.0, 0.0)
}

/// The currents of `count` neurons: some below the threshold, all different.
fn currents(count: usize) -> Vec<Real> {
    (0..count).map(|neuron| 0.5 + 7.0 * neuron as Real / count as Real).collect()
}

/// Ensembles with ports of every layout: few neurons side by side, one block, several blocks, several dimensions.
fn layouts() -> Vec<(Ensemble, usize)> {
    let all = [(3, 21, 1), (1, 5, 1), (4, 1, 1), (7, 2, 1), (300, 3, 1), (33, 2, 3), (200, 1, 2)];
    let of = |(neurons, copies, dims)| {
        (Ensemble::new(dims).neurons(neurons).copies(copies).expose_neurons(), neurons * copies)
    };
    all.into_iter().map(of).collect()
}

#[test]
fn injected_currents_give_the_rates_of_the_model_in_every_layout() {
    for (ensemble, count) in layouts() {
        for decoded in [false, true] {
            let ensemble = match decoded {
                true => ensemble.clone().decode("two", 2, |_, out| out.fill(0.0)),
                false => ensemble.clone(),
            };
            let mut graph = GraphBuilder::new();
            let given = graph.add("given", Constant::vector(&currents(count)));
            let bare = graph.add("bare", ensemble);
            graph.route(&given >> &bare.currents());
            let sim = graph.run(&unbiased(LifRate::default()), Seed::new(1), ms(1)).expect("runs");
            let hz = sim.value(&bare.neurons());
            assert_eq!(hz.len(), count);
            let mut silent = 0;
            for (hz, current) in hz.iter().zip(currents(count)) {
                let exact = Lif::default().rate(f64::from(current));
                silent += usize::from(exact == 0.0);
                assert!((f64::from(*hz) - exact).abs() <= 1e-5 * exact, "{hz} {exact}");
            }
            assert!(silent < count || count < 5);
        }
    }
}

#[test]
fn spikes_are_those_that_are_recorded_each_one_over_the_tick() {
    for (ensemble, count) in layouts() {
        let mut graph = GraphBuilder::new();
        let given = graph.add("given", Constant::vector(&currents(count)));
        let bare = graph.add("bare", ensemble.decode("zero", 1, |_, out| out[0] = 0.0));
        graph.route(&given >> &bare.currents());
        let (probe, spikes) =
            (graph.probe(&bare.neurons(), ProbeSpec::default()), graph.probe_spikes("bare"));
        let sim = graph.run(&unbiased(Lif::default()), Seed::new(1), ms(100)).expect("runs");
        let recorded: Vec<(f64, usize)> = sim.spikes(&spikes).iter().collect();
        assert_eq!(recorded.is_empty(), count == 1, "{count} neurons");
        let mut told = Vec::new();
        for (time, activity) in sim.samples(&probe).iter() {
            for (neuron, hz) in activity.iter().enumerate().filter(|(_, hz)| **hz != 0.0) {
                assert_eq!(*hz, 1000.0);
                told.push((time, neuron));
            }
        }
        assert_eq!(told, recorded);
    }
}

#[test]
fn an_encoded_value_acts_as_the_value_does() {
    // Encoders alternate in one dimension. The tenth of a radius shows whether it divides.
    let run = |encoded: bool, value: Real| {
        let mut graph = GraphBuilder::new();
        let ensemble = Ensemble::new(1).radius(0.1).neurons(50).expose_neurons().identity("x");
        let ensemble = graph.add("ensemble", ensemble);
        let each = if encoded { value } else { 0.0 };
        let along: Vec<Real> = (0..50).map(|n| if n % 2 == 0 { each } else { -each }).collect();
        let along = graph.add("along", Constant::vector(&along));
        graph.route(&along >> &ensemble.encoded());
        let whole = graph.add("whole", Constant::vector(&[if encoded { 0.0 } else { value }]));
        graph.route(&whole >> &ensemble.input);
        let sim = graph.run(&rate(), Seed::new(3), ms(1)).expect("runs");
        sim.value(&ensemble.neurons()).to_vec()
    };
    for value in [0.03, -0.08] {
        let (wanted, found) = (run(false, value), run(true, value));
        assert!(wanted.iter().any(|hz| *hz > 100.0));
        for (wanted, found) in wanted.iter().zip(&found) {
            assert!((wanted - found).abs() < 1e-3 * wanted.abs().max(1.0), "{wanted} {found}");
        }
    }
}

/// Adds what it reads, to be told apart by the tick in which it arrives.
struct Reader {
    settles: bool,
}

impl Node for Reader {
    fn declare(&self, ports: &mut PortDecl) {
        let input = InputSpec::vector(1).sum();
        let input = if self.settles { input.at_settle() } else { input.at_advance() };
        ports.input("in", input).output("out", OutputSpec::vector(1).registered());
    }
    fn fingerprint(&self, _hash: &mut Fingerprint) {}
    fn advance(&self, _cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let value = io.inputs.scalar(0);
        io.outputs.set(0, value);
        Ok(())
    }
}

/// Counts ticks, in a registered output.
struct Counter;

impl Node for Counter {
    fn declare(&self, ports: &mut PortDecl) {
        ports.output("out", OutputSpec::vector(1).registered().filtered_only());
        ports.state(StateSpec { words: 1, ..StateSpec::default() });
    }
    fn fingerprint(&self, _hash: &mut Fingerprint) {}
    fn advance(&self, _cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        io.state.words[0] += 1;
        let count = io.state.words[0] as Real;
        io.outputs.set(0, count);
        Ok(())
    }
}

#[test]
fn an_input_at_the_end_of_the_tick_reads_what_was_just_written() {
    let mut graph = GraphBuilder::new();
    // The name sorts before that of its sources.
    let reader = graph.node("a-reader", Reader { settles: true });
    let counter = graph.node("counter", Counter);
    let now = graph.add("now", Signal::vector(1, |t, out| out[0] = 1000.0 * t as Real));
    let input = reader.input::<Vector>("in");
    graph.connect(&counter.output::<Vector>("out"), &input, Synapse::None);
    let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), ms(5)).expect("runs");
    assert_eq!(*sim.value(&reader.output::<Vector>("out")), [5.0]);
    // A second source adds, and an output of this tick needs no exception.
    graph.connect(&now, &input, Synapse::None);
    let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), ms(5)).expect("runs");
    assert_eq!(*sim.value(&reader.output::<Vector>("out")), [5.0 + 4.0]);
    // An ordinary input needs a synapse, as ever.
    let other = graph.node("other", Reader { settles: false });
    graph.connect(&counter.output::<Vector>("out"), &other.input("in"), Synapse::None);
    let faults = graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1));
    assert!(matches!(&faults.expect_err("refused").0[..], [BuildError::Unfiltered { .. }]));
}

#[test]
fn nodes_that_settle_reach_each_other_through_a_synapse_only() {
    let mut graph = GraphBuilder::new();
    let counter = graph.node("counter", Counter);
    let [first, second] = ["first", "second"].map(|n| graph.node(n, Reader { settles: true }));
    graph.connect(&counter.output::<Vector>("out"), &first.input("in"), Synapse::None);
    let (from, to) = (first.output::<Vector>("out"), second.input::<Vector>("in"));
    graph.connect(&from, &to, Synapse::None);
    let faults = graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1));
    let said = faults.expect_err("refused").to_string();
    assert!(said.contains("`first.out` is written while `second.in` is read"), "{said}");
    let mut graph = GraphBuilder::new();
    let first = graph.node("first", Reader { settles: true });
    // A loop with itself, with a synapse.
    let from = first.output::<Vector>("out");
    graph.connect(&from, &first.input("in"), Synapse::lowpass_ms(5));
    graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1)).expect("builds");
}

#[test]
fn ports_of_neurons_need_neurons_and_their_number() {
    let refused = |ensemble: Ensemble, plan: &PopulationPlan| {
        let mut graph = GraphBuilder::new();
        graph.add("cells", ensemble);
        let faults = graph.build(Timebase::default(), plan, Seed::new(1)).expect_err("refused");
        faults.to_string()
    };
    let said = refused(Ensemble::new(1).neurons(10).expose_neurons(), &PopulationPlan::direct());
    assert!(said.contains("`cells/neurons`") && said.contains("Population::Lif"), "{said}");
    let said = refused(Ensemble::new(1).expose_neurons(), &lif());
    assert!(said.contains("expected `neurons(count)`"), "{said}");
    for wrong in [0, 10_001] {
        let said = refused(Ensemble::new(1).neurons(wrong).expose_neurons(), &lif());
        assert!(said.contains(&format!("{wrong} neurons; expected 1 to 10000")), "{said}");
    }
    let mut graph = GraphBuilder::new();
    let plain = graph.add("plain", Ensemble::new(1).identity("x"));
    let probe = graph.probe(&plain.neurons(), ProbeSpec::default());
    let said = graph.build(Timebase::default(), &lif(), Seed::new(1)).expect_err("no port");
    assert!(said.to_string().contains("no output `neurons`"), "{said}");
    let _ = probe;
}

/// A reservoir of sparse weights between bare neurons, driven by a wave, with 150 copies for threads and ranks.
fn reservoir() -> (GraphBuilder, EnsemblePorts) {
    let mut graph = GraphBuilder::new();
    let cells = Ensemble::new(1).neurons(60).copies(150).expose_neurons().identity("x");
    let cells = graph.add("cells", cells);
    let wave = graph.add("wave", Signal::vector(150, |t, out| out.fill((9.0 * t).sin() as Real)));
    graph.route(&wave >> &cells.input);
    let weights = (0..9000).map(|to| (to, (to * 7 + 11) % 9000, 1e-2));
    graph.route(
        (cells.neurons().transform_sparse(9000, weights) >> &cells.currents())
            .via(Synapse::lowpass_ms(5)),
    );
    (graph, cells)
}

fn bits(values: &[Real]) -> Vec<u32> {
    values.iter().map(|value| value.to_bits()).collect()
}

#[test]
fn activities_have_the_same_bits_whatever_the_threads_ranks_and_snapshots() {
    let (graph, cells) = reservoir();
    let built = Arc::new(graph.build(Timebase::default(), &lif(), Seed::new(1)).expect("builds"));
    let found = |sim: &Simulator| bits(sim.value(&cells.neurons()));
    let mut sim = Simulator::new(built.clone(), RunConfig::default()).expect("starts");
    sim.run_for(ms(30)).expect("runs");
    let saved = sim.checkpoint().expect("saved");
    sim.run_for(ms(31)).expect("runs");
    let expected = found(&sim);
    assert!(expected.iter().filter(|b| **b != 0).count() > 20, "neurons fire");
    sim.restore(&saved).expect("restored");
    sim.run_for(ms(31)).expect("runs");
    assert_eq!(found(&sim), expected);
    sim.reset().expect("reset");
    sim.run_for(ms(61)).expect("runs");
    assert_eq!(found(&sim), expected);
    for threads in [2, 4] {
        let config = RunConfig::default().with_threads(Threads::Exactly(threads));
        let mut sim = Simulator::new(built.clone(), config).expect("starts");
        sim.run_for(ms(61)).expect("runs");
        assert_eq!(found(&sim), expected, "{threads} threads");
    }
    for count in [2, 3] {
        let of_rank = |ranks: Ranks| {
            let (graph, cells) = reservoir();
            let plan = lif().shared(&ranks);
            let sim = graph.run(&plan, Seed::new(1), ms(61)).expect("runs");
            bits(sim.value(&cells.neurons()))
        };
        let all: Vec<_> = std::thread::scope(|scope| {
            let group = Ranks::in_process(count).into_iter();
            let threads: Vec<_> = group.map(|r| scope.spawn(move || of_rank(r))).collect();
            threads.into_iter().map(|t| t.join().expect("no panic")).collect()
        });
        assert_eq!(all, vec![expected.clone(); count], "{count} ranks");
    }
}
