//! What rules learn, beside the closed forms and beside Nengo.
//!
//! The fixture `learning.npz` has the weights after ten seconds, and all parameters of the neurons, which fire by their
//! rates. `tests/conformance/fixtures.py` wrote it.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::path::Path;

use ndarray::{Array2, Ix1, Ix2};
use symbolt::files::npz::NpzReader;
use symbolt::neurons::{
    Bcm, Ensemble, EnsemblePorts, Learned, LearnedPorts, LifRate, Oja, Pes, Rls, Voja, Weights,
};
use symbolt::prelude::*;
use symbolt::sim::{Apply, InputSpec, OutputSpec, Real, Signal, Vector};

use crate::alike::alike;

fn ms(ms: u64) -> SimDuration {
    SimDuration::from_millis(ms)
}

/// Runs a connection from constant activities for a number of ticks.
fn constant(
    pre: &[Real],
    ticks: u64,
    learned: impl FnOnce(&symbolt::sim::Out<Vector>, &mut GraphBuilder) -> LearnedPorts,
) -> (Simulator, LearnedPorts) {
    let mut graph = GraphBuilder::new();
    let pre = graph.add("activity", Constant::vector(pre));
    let learned = learned(&pre, &mut graph);
    let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), ms(ticks)).expect("runs");
    (sim, learned)
}

fn supervised(learned: Learned, graph: &mut GraphBuilder, target: Real) -> LearnedPorts {
    let learned = graph.add("learned", learned);
    let target = graph.add("target", Constant::vector(&[target]));
    graph.route(&target >> &learned.target());
    learned
}

fn close(found: f64, exact: f64, within: f64) {
    assert!((found - exact).abs() <= within * exact.abs(), "{found} instead of {exact}");
}

/// Outputs are single precision, which the errors are made of: hence the tolerance of the closed forms with a target.
const SINGLE: f64 = 1e-6;

#[test]
fn pes_falls_as_its_closed_form() {
    for ticks in [1, 100, 1000] {
        let (sim, learned) = constant(&[100.0, 200.0], ticks, |pre, graph| {
            let rule = Pes::new(1e-4).pre_synapse(Synapse::None).toward_target();
            supervised(Learned::new(pre, 1).rule(rule), graph, 1.0)
        });
        let left = 0.9975f64.powi(ticks as i32);
        let weights = learned.weights(&sim);
        close(weights[[0, 0]] * 100.0 + weights[[0, 1]] * 200.0, 1.0 - left, SINGLE);
        // The output of a tick has the weights that earlier ticks have left.
        let before = 1.0 - 0.9975f64.powi(ticks as i32 - 1);
        assert!((f64::from(sim.value(&learned.output)[0]) - before).abs() < SINGLE);
        assert!((before - (1.0 - left)).abs() > 10.0 * SINGLE, "a tick later would be caught");
        if ticks == 1000 {
            close(weights[[0, 0]], 0.001836343, SINGLE);
            close(weights[[0, 1]], 0.003672686, SINGLE);
        }
    }
}

#[test]
fn rls_falls_as_its_closed_form() {
    for (ticks, left) in [(1, 0.975609756), (10, 0.8), (1000, 0.038461538)] {
        let (sim, learned) = constant(&[100.0, 200.0], ticks, |pre, graph| {
            let rule = Rls::default().pre_synapse(Synapse::None).toward_target();
            supervised(Learned::new(pre, 1).rule(rule), graph, 1.0)
        });
        let weights = learned.weights(&sim);
        let output = weights[[0, 0]] * 100.0 + weights[[0, 1]] * 200.0;
        assert!((output - (1.0 - left)).abs() < SINGLE, "{output}");
        if ticks == 1000 {
            close(weights[[0, 0]], 0.001923077, SINGLE);
            close(weights[[0, 1]], 0.003846154, SINGLE);
            let inverse = learned.state(&sim, "inverse").expect("a state");
            for (found, exact) in
                inverse.iter().zip([4.038462e-7, -1.923077e-7, -1.923077e-7, 1.153846e-7])
            {
                close(*found, exact, SINGLE);
            }
        }
    }
}

/// Rules without an error compute in double precision throughout.
const DOUBLE: f64 = 1e-9;

#[test]
fn unsupervised_rules_follow_their_closed_forms() {
    let post = |graph: &mut GraphBuilder| graph.add("post", Constant::vector(&[100.0]));
    let (sim, learned) = constant(&[50.0], 1000, |pre, graph| {
        let rule = Oja::default().pre_synapse(Synapse::None).post_synapse(Synapse::None);
        let post = post(graph);
        graph.add("learned", Learned::new(pre, 1).post(&post).rule(rule))
    });
    close(learned.weights(&sim)[[0, 0]], 0.004975107877, DOUBLE);
    let (sim, learned) = constant(&[50.0], 1000, |pre, graph| {
        let rule = Bcm::default().pre_synapse(Synapse::None).post_synapse(Synapse::None);
        let post = post(graph);
        graph.add("learned", Learned::new(pre, 1).post(&post).rule(rule))
    });
    close(learned.weights(&sim)[[0, 0]], 3.159023e-4, 1e-6);
    let (sim, learned) = constant(&[0.0, 1.0], 1000, |value, graph| {
        let rule = Voja::default().post_synapse(Synapse::None);
        let (post, start) = (post(graph), Weights::rows([[1.0, 0.0]]));
        let learned = graph.add("learned", Learned::encoders(2, &post).rule(rule).weights(start));
        graph.route(value >> &learned.input());
        learned
    });
    let left = (1.0 - 0.01 * 0.001 * 100.0f64).powi(1000);
    close(learned.weights(&sim)[[0, 0]], left, DOUBLE);
    close(learned.weights(&sim)[[0, 1]], 1.0 - left, DOUBLE);
    assert!((left - 0.367695425).abs() < 1e-9);
    // The output of a tick has the encoders that earlier ticks have left.
    let last = 1.0 - (1.0 - 0.001f64).powi(999);
    assert!((f64::from(sim.value(&learned.output)[0]) - last).abs() < SINGLE);
}

#[test]
fn the_change_in_a_second_does_not_depend_on_the_tick() {
    let run = |micros: u64| {
        let mut graph = GraphBuilder::new();
        let pre = graph.add("activity", Constant::vector(&[100.0, 200.0]));
        let post = graph.add("post", Constant::vector(&[100.0]));
        let rules = [Synapse::None, Synapse::lowpass_ms(5)].map(|synapse| {
            let learned = Learned::new(&pre, 1).post(&post);
            learned.rule(Pes::default().pre_synapse(synapse)).rule(Bcm::new(1e-7))
        });
        let [first, second] = rules;
        let (first, second) = (graph.add("first", first), graph.add("second", second));
        let error = graph.add("error", Constant::vector(&[-1.0]));
        for learned in [&first, &second] {
            graph.route(&error >> &learned.error());
        }
        let time = Timebase::new(SimDuration::from_micros(micros)).expect("a tick");
        let graph = graph.build(time, &PopulationPlan::direct(), Seed::new(1)).expect("builds");
        let mut sim = Simulator::new(graph.into(), RunConfig::default()).expect("starts");
        sim.run_for(SimDuration::from_secs(1)).expect("runs");
        [first, second].map(|learned| learned.weights(&sim)[[0, 1]])
    };
    let [exact, filtered] = run(1000);
    assert!(exact > 0.009 && filtered > 0.009, "{exact} {filtered}");
    for micros in [500, 2000] {
        let found = run(micros);
        close(found[0], exact, 2e-3);
        close(found[1], filtered, 2e-3);
    }
}

struct Fixture(Vec<u8>);

impl Fixture {
    fn new() -> Self {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/conformance");
        Self(std::fs::read(folder.join("learning.npz")).expect("a fixture"))
    }

    fn matrix(&self, name: &str) -> Array2<f64> {
        let mut npz = NpzReader::new(&self.0).expect("an archive");
        npz.read::<f64, Ix2>(name).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    fn vector(&self, name: &str) -> Vec<f64> {
        let mut npz = NpzReader::new(&self.0).expect("an archive");
        npz.read::<f64, Ix1>(name).unwrap_or_else(|error| panic!("{name}: {error}")).to_vec()
    }

    /// Adds an ensemble of neurons with the parameters `name`, driven by `value` through their currents.
    fn cells(
        &self,
        graph: &mut GraphBuilder,
        name: &str,
        value: &symbolt::sim::Out<Vector>,
    ) -> EnsemblePorts {
        let encoders = self.matrix(&format!("{name}_encoders"));
        let [gains, biases] = ["gains", "biases"].map(|of| self.vector(&format!("{name}_{of}")));
        let (count, dims) = encoders.dim();
        let cells = graph.add(name, Ensemble::new(1).neurons(count).expose_neurons());
        let drive = move |x: &[Real], out: &mut [Real]| {
            for (neuron, out) in out.iter_mut().enumerate() {
                let along: f64 = (0..dims).map(|k| encoders[[neuron, k]] * f64::from(x[k])).sum();
                *out = (gains[neuron] * along + biases[neuron]) as Real;
            }
        };
        let (input, output) = (InputSpec::vector(dims), OutputSpec::vector(count));
        let drive = graph.add(&format!("{name}-drive"), Apply::new(input, output, drive));
        graph.route(value >> &drive);
        graph.route(&drive >> &cells.currents());
        cells
    }

    /// Checks numbers, relative to the greatest.
    fn agree<'f>(&self, name: &str, found: impl Iterator<Item = &'f f64>) {
        let mut npz = NpzReader::new(&self.0).expect("an archive");
        let wanted = npz
            .read::<f64, Ix2>(name)
            .map(|array| array.iter().copied().collect::<Vec<f64>>())
            .unwrap_or_else(|_| self.vector(name));
        let found: Vec<f64> = found.copied().collect();
        assert_eq!(found.len(), wanted.len());
        let most = wanted.iter().fold(0.0, |most: f64, w| most.max(w.abs()));
        let off = wanted.iter().zip(&found).fold(0.0, |off: f64, (w, f)| off.max((w - f).abs()));
        println!("{name}: {:.1e} of {most:.3e}", off / most);
        assert!(off <= 1e-4 * most, "{name}: {off} of {most}");
        assert!(most > 0.0);
    }
}

/// The waves of the fixtures, one per component.
fn wave(dims: usize) -> Signal<Vector> {
    Signal::vector(dims, |t, out| {
        for (i, out) in out.iter_mut().enumerate() {
            let phase = std::f64::consts::TAU * 0.7 * (i + 1) as f64 * (t + 0.001);
            *out = (0.8 * (phase + i as f64).sin()) as Real;
        }
    })
}

/// Learns the square of a wave by an error that passes two synapses.
fn decoded(name: &str, rules: impl FnOnce(Learned) -> Learned, inputs: &[&str], state: &str) {
    let (fixture, mut graph) = (Fixture::new(), GraphBuilder::new());
    let given = graph.add("given", wave(1));
    let cells = fixture.cells(&mut graph, name, &given);
    let learned = graph.add("learned", rules(Learned::new(&cells.neurons(), 1)));
    let square = |x: &[Real], out: &mut [Real]| out[0] = -x[0] * x[0];
    let (input, output) = (InputSpec::vector(1), OutputSpec::vector(1));
    let less = graph.add("less", Apply::new(input, output, square));
    graph.route(&given >> &less);
    let error = graph.add("error", Add::vector(1));
    graph.route((&learned >> &error).via(Synapse::lowpass_ms(5)));
    graph.route(&less >> &error);
    for input in inputs {
        graph.route((&error >> &learned.signal(input)).via(Synapse::lowpass_ms(5)));
    }
    let plan = alike(LifRate::default(), 0.0, 0.0);
    let mut sim = graph.run(&plan, Seed::new(1), ms(10_000)).expect("runs");
    fixture.agree(&format!("{name}_weights"), learned.weights(&sim).iter());
    if state.is_empty() {
        return;
    }
    sim.run_for(ms(1)).expect("runs");
    let of = if state == "inverse" { "inv_gamma" } else { state };
    fixture.agree(&format!("{name}_{of}"), learned.state(&sim, state).expect("a state").iter());
}

#[test]
fn decoders_after_ten_seconds_are_nengos() {
    decoded("pes", |l| l.rule(Pes::new(1e-3)), &["error"], "");
    let slow = Synapse::lowpass_ms(30);
    decoded("slow_pes", |l| l.rule(Pes::new(1e-3).pre_synapse(slow)), &["error"], "");
    decoded("rls", |l| l.rule(Rls::new(1e-3)), &["error"], "inverse");
    let both = ["error", "error-2"];
    decoded("both", |l| l.rule(Pes::new(1e-3)).rule(Rls::new(1e-4)), &both, "");
    decoded("both", |l| l.rule(Rls::new(1e-4)).rule(Pes::new(1e-3)), &both, "");
}

#[test]
#[should_panic(expected = "pes_weights")]
fn another_filter_within_the_rule_would_be_caught() {
    let slow = Synapse::lowpass_ms(6);
    decoded("pes", |l| l.rule(Pes::new(1e-3).pre_synapse(slow)), &["error"], "");
}

/// Learns weights between the neurons of two ensembles.
fn between(name: &str, rules: impl FnOnce(Learned) -> Learned, state: &str) {
    let (fixture, mut graph) = (Fixture::new(), GraphBuilder::new());
    let given = graph.add("given", wave(2));
    let [pre, post] =
        ["pre", "post"].map(|end| fixture.cells(&mut graph, &format!("{name}_{end}"), &given));
    let start = fixture.matrix(&format!("{name}_start"));
    let learned = Learned::new(&pre.neurons(), start.nrows()).weights(Weights::matrix(start));
    let learned = graph.add("learned", rules(learned.post(&post.neurons())));
    // Nengo multiplies what reaches bare neurons by their gains.
    let gains = fixture.vector(&format!("{name}_post_gains"));
    let gains = gains.iter().enumerate().map(|(neuron, gain)| (neuron, neuron, *gain as Real));
    let gained = learned.transform_sparse(8, gains.collect::<Vec<_>>());
    graph.route((gained >> &post.currents()).via(Synapse::lowpass_ms(5)));
    let plan = alike(LifRate::default(), 0.0, 0.0);
    let mut sim = graph.run(&plan, Seed::new(1), ms(10_000)).expect("runs");
    fixture.agree(&format!("{name}_weights"), learned.weights(&sim).iter());
    if !state.is_empty() {
        sim.run_for(ms(1)).expect("runs");
        let found = learned.state(&sim, state).expect("a state");
        fixture.agree(&format!("{name}_{state}"), found.iter());
    }
}

#[test]
fn weights_between_neurons_after_ten_seconds_are_nengos() {
    between("oja", |l| l.rule(Oja::new(1e-6).beta(1e3)), "");
    between("bcm", |l| l.rule(Bcm::new(1e-10)), "theta");
    between("mixed", |l| l.rule(Oja::new(1e-6).beta(1e3)).rule(Bcm::new(1e-10)), "");
    between("mixed", |l| l.rule(Bcm::new(1e-10)).rule(Oja::new(1e-6).beta(1e3)), "");
}

#[test]
fn encoders_after_ten_seconds_are_nengos() {
    let (fixture, mut graph) = (Fixture::new(), GraphBuilder::new());
    let given = graph.add("given", wave(2));
    let start = fixture.matrix("voja_encoders");
    let cells = graph.add("cells", Ensemble::new(1).neurons(start.nrows()).expose_neurons());
    let learned = Learned::encoders(2, &cells.neurons()).weights(Weights::matrix(start));
    let learned = graph.add("learned", learned.rule(Voja::new(0.003)).switched());
    graph.route((&given >> &learned.input()).via(Synapse::lowpass_ms(5)));
    graph.route(&learned >> &cells.encoded());
    let learning = |t| if t + 0.001 < 6.0005 { 1.0 } else { 0.0 };
    let learning = graph.add("learning", Signal::scalar(learning));
    graph.route(&learning >> &learned.learning());
    let plan = alike(LifRate::default(), 2.0, 1.0);
    let sim = graph.run(&plan, Seed::new(1), ms(10_000)).expect("runs");
    let scaled = learned.weights(&sim) * 2.0;
    fixture.agree("voja_scaled", scaled.iter());
}
