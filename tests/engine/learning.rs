//! Learned connections: bits, switches, slices, files, probes, and settings that are refused.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::sync::Arc;

use ndarray::{Array2, array};
use symbolt::files::Overwrite;
use symbolt::files::npz::NpzWriter;
use symbolt::neurons::{
    Bcm, Ensemble, Learned, LearnedPorts, LearningRule, LearningTick, Needs, Oja, Pes,
    PopulationPlan, Rls, Side, Stretch, Trace, TuningError, Voja, WeightShape, Weights,
    WeightsError,
};
use symbolt::prelude::*;
use symbolt::sim::{Filter, Fingerprint, Out, Ranks, Real, Signal, SimError, Threads, Vector};

fn ms(ms: u64) -> SimDuration {
    SimDuration::from_millis(ms)
}

fn lif() -> PopulationPlan {
    PopulationPlan::lif()
}

/// Everything that learns at once, in spikes: decoders by two rules, weights between neurons, and encoders, with enough
/// neurons for threads and ranks to share.
fn everything() -> (GraphBuilder, [LearnedPorts; 3]) {
    let mut graph = GraphBuilder::new();
    let wave = graph.add("wave", Signal::vector(80, |t, out| out.fill((9.0 * t).sin() as Real)));
    let pre = Ensemble::new(1).neurons(60).copies(80).expose_neurons().identity("x");
    let pre = graph.add("pre", pre);
    graph.route(&wave >> &pre.input);
    let post = graph.add("post", Ensemble::new(2).neurons(50).expose_neurons().identity("x"));
    let decoded = Learned::new(&pre.neurons(), 2).sources(0..120).rule(Pes::default());
    let decoded = graph.add("decoded", decoded.rule(Rls::default()));
    graph.route(&decoded >> &post.input);
    graph.route(&post.output("x") - [0.5, -0.5] >> &decoded.error());
    graph.route(&post.output("x") - [0.5, -0.5] >> &decoded.signal("error-2"));
    let start = Weights::uniform(0.0, 1e-4, Seed::new(3));
    let between = Learned::new(&pre.neurons(), 50).post(&post.neurons()).weights(start);
    let between = graph.add("between", between.rule(Oja::default()).rule(Bcm::default()));
    graph.route(&between >> &post.currents());
    let start = Weights::directions(Seed::new(2));
    let encoders = Learned::encoders(2, &post.neurons()).weights(start);
    let voja = Voja::default().post_synapse(Synapse::alpha_ms(5));
    let encoders = graph.add("encoders", encoders.rule(voja));
    graph.route(&post.output("x") >> &encoders.input());
    graph.route(&encoders >> &post.encoded());
    (graph, [decoded, between, encoders])
}

fn bits(sim: &Simulator, learned: &[LearnedPorts]) -> Vec<u64> {
    let all = learned.iter().flat_map(|ports| ports.weights(sim).into_iter());
    all.map(f64::to_bits).collect()
}

#[test]
fn learning_has_the_same_bits_whatever_the_threads_ranks_snapshots_and_resets() {
    let (graph, learned) = everything();
    let built = Arc::new(graph.build(Timebase::default(), &lif(), Seed::new(1)).expect("builds"));
    let mut sim = Simulator::new(built.clone(), RunConfig::default()).expect("starts");
    let start = bits(&sim, &learned);
    sim.run_for(ms(30)).expect("runs");
    let saved = sim.checkpoint().expect("saved");
    let saved = serde_json::from_str(&serde_json::to_string(&saved).expect("text")).expect("read");
    sim.run_for(ms(31)).expect("runs");
    let expected = bits(&sim, &learned);
    let changed = |which: usize| {
        let of = |bits: &[u64]| {
            let mut sizes = learned.iter().map(|ports| ports.weights(&sim).len());
            let from: usize = sizes.by_ref().take(which).sum();
            bits[from..from + learned[which].weights(&sim).len()].to_vec()
        };
        of(&start) != of(&expected)
    };
    assert!((0..3).all(changed), "every connection learns");
    sim.restore(&saved).expect("restored");
    sim.run_for(ms(31)).expect("runs");
    assert_eq!(bits(&sim, &learned), expected);
    sim.reset().expect("reset");
    assert_eq!(bits(&sim, &learned), start);
    sim.run_for(ms(61)).expect("runs");
    assert_eq!(bits(&sim, &learned), expected);
    for threads in [2, 4] {
        let config = RunConfig::default().with_threads(Threads::Exactly(threads));
        let mut sim = Simulator::new(built.clone(), config).expect("starts");
        sim.run_for(ms(61)).expect("runs");
        assert_eq!(bits(&sim, &learned), expected, "{threads} threads");
    }
    for count in [2, 3] {
        let of_rank = |ranks: Ranks| {
            let (graph, learned) = everything();
            let sim = graph.run(&lif().shared(&ranks), Seed::new(1), ms(61)).expect("runs");
            bits(&sim, &learned)
        };
        let all: Vec<_> = std::thread::scope(|scope| {
            let group = Ranks::in_process(count).into_iter();
            let threads: Vec<_> = group.map(|r| scope.spawn(move || of_rank(r))).collect();
            threads.into_iter().map(|t| t.join().expect("no panic")).collect()
        });
        assert_eq!(all, vec![expected.clone(); count], "{count} ranks");
    }
}

#[test]
fn rules_follow_activities_through_any_synapse() {
    let decay = Synapse::DoubleExponential { rise: ms(2), decay: ms(10) };
    let linear = Synapse::linear(&[1.0], &[2e-4, 0.02, 1.0]);
    let simple = [Synapse::None, Synapse::lowpass_ms(5), Synapse::delay_ms(3)];
    let synapses = [Synapse::alpha_ms(5), Synapse::triangle_ms(10), decay, linear];
    for synapse in synapses.into_iter().chain(simple) {
        let mut graph = GraphBuilder::new();
        let wave = Signal::vector(2, |t, out| {
            (out[0], out[1]) = ((90.0 * t).sin() as Real, if t > 0.02 { 50.0 } else { 0.0 });
        });
        let wave = graph.add("wave", wave);
        let rule = Pes::default().pre_synapse(synapse);
        let learned = graph.add("learned", Learned::new(&wave, 1).rule(rule).expose("pre"));
        let zero = graph.add("zero", Constant::vector(&[0.0]));
        graph.route(&zero >> &learned.error());
        let probes = [&wave, &learned.exposed("pre")];
        let [wave, pre] = probes.map(|out| graph.probe(out, ProbeSpec::default()));
        let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), ms(60)).expect("runs");
        let filter = Filter::new(synapse, Timebase::default()).expect("a filter");
        let mut state = vec![0.0; filter.state_len(2)];
        let (mut count, mut most) = (0, 0.0f32);
        for ((_, given), (_, found)) in sim.samples(&wave).iter().zip(sim.samples(&pre).iter()) {
            let expected = filter.step(given, &mut state);
            for (found, expected) in found.iter().zip(expected) {
                assert!((found - expected).abs() < 1e-4, "{synapse}: {found} {expected}");
                most = most.max(*found);
                count += 1;
            }
        }
        assert!(count == 120 && most > 10.0, "{synapse}: {count} {most}");
    }
}

/// A rule with a trace that has no place.
#[derive(Debug)]
struct Misplaced;

impl LearningRule for Misplaced {
    fn name(&self) -> &'static str {
        "misplaced"
    }
    fn needs(&self, _shape: WeightShape) -> Result<Needs, TuningError> {
        let trace = Trace { state: "pre", of: Side::Pre, synapse: Synapse::None };
        Ok(Needs { state: vec![("pre", 1)], traces: vec![trace], ..Needs::default() })
    }
    fn change(&self, _: &LearningTick<'_>, _: &[f64], _: &Stretch<'_>, _: &mut [f64]) {}
    fn fingerprint(&self, _: &mut Fingerprint) {}
}

/// A connection of two constant sources and one output with an error of 1.
fn simple(change: impl FnOnce(Learned) -> Learned) -> (GraphBuilder, LearnedPorts, Out<Vector>) {
    let mut graph = GraphBuilder::new();
    let pre = graph.add("activity", Constant::vector(&[100.0, 200.0]));
    let learned = graph.add("learned", change(Learned::new(&pre, 1)));
    let one = graph.add("one", Constant::vector(&[1.0]));
    (graph, learned, one)
}

fn run(graph: &GraphBuilder, ticks: u64) -> Simulator {
    graph.run(&PopulationPlan::direct(), Seed::new(1), ms(ticks)).expect("runs")
}

#[test]
fn a_signal_stops_starts_and_reverses_learning_of_every_rule() {
    let pes = || Pes::default().pre_synapse(Synapse::None);
    let (mut graph, learned, one) = simple(|l| l.rule(pes()).switched().expose("delta"));
    graph.route(&one >> &learned.error());
    let signal = Stimulus::scalar(0.0).from(ms(10), &[1.0]).from(ms(20), &[0.0]);
    let signal = graph.add("signal", signal.from(ms(30), &[-1.0]));
    graph.route(&signal >> &learned.learning());
    let probe = graph.probe(&learned.exposed("delta"), ProbeSpec::default());
    let sim = run(&graph, 35);
    let delta: Vec<Real> = sim.samples(&probe).iter().map(|(_, delta)| delta[0]).collect();
    let tick = -1e-4 * 1e-3 / 2.0 * 100.0;
    for (at, delta) in delta.iter().enumerate() {
        let wanted = [0.0, tick, 0.0, -tick][at / 10];
        assert!((delta - wanted).abs() < 1e-6 * tick.abs(), "{at}: {delta} {wanted}");
    }
    let last = learned.weights(&sim)[[0, 0]];
    assert!((last / (5.0 * f64::from(tick)) - 1.0).abs() < 1e-6, "{last:e} {tick:e}");
    // Of recursive least squares the matrix stands still too.
    let (mut graph, learned, one) = simple(|l| l.rule(Rls::default()).switched());
    graph.route(&one >> &learned.error());
    let signal = graph.add("signal", Stimulus::scalar(1.0).from(ms(10), &[0.0]));
    graph.route(&signal >> &learned.learning());
    let mut sim = run(&graph, 10);
    let before = (learned.weights(&sim), learned.state(&sim, "inverse").expect("a state"));
    assert!(before.0[[0, 1]] < 0.0 && before.1[1] < 0.0);
    sim.run_for(ms(10)).expect("runs");
    assert_eq!((learned.weights(&sim), learned.state(&sim, "inverse").expect("a state")), before);
}

#[test]
fn rules_add_up_in_any_order() {
    let (a, b) = (Pes::default(), Rls::new(1e-2));
    let both = |first: bool| {
        let (mut graph, learned, one) = simple(|l| match first {
            true => l.rule(a).rule(b),
            false => l.rule(b).rule(a),
        });
        for input in ["error", "error-2"] {
            graph.route(&one >> &learned.signal(input));
        }
        learned.weights(&run(&graph, 50))
    };
    let alone = |sim: &dyn Fn(Learned) -> Learned| {
        let (mut graph, learned, one) = simple(sim);
        graph.route(&one >> &learned.error());
        learned.weights(&run(&graph, 50))
    };
    let sum = alone(&|l| l.rule(a)) + alone(&|l| l.rule(b));
    for found in [both(true), both(false)] {
        for (found, sum) in found.iter().zip(&sum) {
            assert!((found - sum).abs() < 1e-12 * sum.abs(), "{found} {sum}");
        }
    }
}

#[test]
fn sources_and_targets_can_be_some_of_the_neurons() {
    let mut graph = GraphBuilder::new();
    let pre = graph.add("pre", Constant::vector(&[9.0, 50.0, 9.0]));
    let post = graph.add("post", Constant::vector(&[9.0, 9.0, 100.0]));
    let rule = Oja::default().pre_synapse(Synapse::None).post_synapse(Synapse::None);
    let learned = Learned::new(&pre, 1).post(&post).sources(1..2).targets(2..3).rule(rule);
    let learned = graph.add("learned", learned);
    let found = learned.weights(&run(&graph, 1000));
    assert_eq!(found.dim(), (1, 1));
    assert!((found[[0, 0]] - 0.004975107877).abs() < 1e-11);
}

#[test]
fn weights_and_states_can_be_probed() {
    let names = ["weights", "pre", "error", "gain", "inverse", "delta"];
    let (mut graph, learned, one) = simple(|l| {
        let rule = Rls::default().pre_synapse(Synapse::None);
        names.iter().fold(l.rule(rule), |l, name| l.expose(name))
    });
    graph.route(&one >> &learned.error());
    let probes = names.map(|name| graph.probe(&learned.exposed(name), ProbeSpec::default()));
    let sim = run(&graph, 3);
    for (name, probe) in names.iter().zip(&probes).take(5) {
        let (_, last) = sim.samples(probe).last().expect("recorded");
        let state = learned.state(&sim, name).expect("a state");
        assert_eq!(last.to_vec(), state.iter().map(|v| *v as Real).collect::<Vec<_>>());
        assert!(state.iter().any(|value| *value != 0.0), "{name}");
    }
    let at = |probe: usize, tick: usize| sim.samples(&probes[probe]).get(tick).expect("there").1[0];
    assert!((at(0, 2) - at(0, 1) - at(5, 2)).abs() < 1e-6 * at(5, 2).abs());
    assert_eq!(learned.state(&sim, "no such state"), None);
}

#[test]
fn learned_weights_are_saved_and_loaded() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("weights.npz");
    let (mut graph, learned, one) = simple(|l| l.rule(Pes::default()));
    graph.route(&one >> &learned.error());
    let sim = run(&graph, 20);
    learned.save(&sim, &path, Overwrite::Never).expect("saved");
    assert!(learned.save(&sim, &path, Overwrite::Never).is_err(), "it exists");
    // A run of another graph, though of one that is built alike, has no such weights, and leaves the file alone.
    let (alike, ..) = simple(|l| l);
    let written = std::fs::read(&path).expect("a file");
    let fault = learned.save(&run(&alike, 1), &path, Overwrite::Allowed).expect_err("refused");
    assert!(matches!(fault, WeightsError::AnotherGraph), "{fault}");
    assert_eq!(std::fs::read(&path).expect("a file"), written);
    let weights = Weights::read(&path).expect("read");
    let (graph, again, _) = simple(|l| l.weights(weights.clone()));
    assert_eq!(again.weights(&run(&graph, 1)), learned.weights(&sim));
    assert_ne!(learned.weights(&sim)[[0, 0]], 0.0);
    // Another shape.
    let mut graph = GraphBuilder::new();
    let pre = graph.add("activity", Constant::vector(&[1.0; 3]));
    graph.add("learned", Learned::new(&pre, 1).weights(weights));
    let faults = graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1));
    let said = faults.expect_err("refused").to_string();
    assert!(
        said.contains("`learned`") && said.contains("1 rows and 2 columns; expected"),
        "{said}"
    );
    let write = |name: &str, array: &Array2<f64>| {
        let mut npz = NpzWriter::new();
        npz.add(name, array).expect("added");
        std::fs::write(&path, npz.finish().expect("bytes")).expect("written");
        Weights::read(&path).expect_err("refused").to_string()
    };
    let said = write("weights", &array![[1.0, f64::NAN]]);
    assert!(said.ends_with("row 0 and column 1 is NaN; expected finite numbers"), "{said}");
    let said = write("other", &array![[1.0]]);
    assert!(said.contains("has no array `weights`"), "{said}");
    std::fs::write(&path, b"nothing").expect("written");
    assert!(Weights::read(&path).is_err());
    assert!(Weights::read(&folder.path().join("absent.npz")).is_err());
}

#[test]
fn wrong_settings_are_refused_with_one_sentence() {
    let refused = |change: &dyn Fn(Learned) -> Learned| {
        let (graph, ..) = simple(change);
        let faults = graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1));
        faults.expect_err("refused").to_string()
    };
    let zero = Synapse::lowpass(SimDuration::from_micros(0));
    type Change = fn(Learned) -> Learned;
    let cases: [(Change, &str); 14] = [
        (|l| l.rule(Pes::new(f64::NAN)), "rule `pes`: `rate` is NaN; expected a finite number"),
        (|l| l.rule(Rls::new(-1.0)), "rule `rls`: `rate` is -1"),
        (|l| l.rule(Oja::default()), "rule `oja` needs the activity of 1 target neurons"),
        (|l| l.weights(Weights::rows([[1.0]])), "1 rows and 1 columns; expected 1, one per output"),
        (
            |l| l.weights(Weights::rows([vec![1.0, 2.0], vec![1.0]])),
            "row 1 of the weights has 1 numbers; expected 2",
        ),
        (|l| l.weights(Weights::rows([[1.0, f64::INFINITY]])), "a weight is inf"),
        (|l| l.weights(Weights::uniform(1.0, 0.0, Seed::new(1))), "weights between 1 and 0"),
        (
            |l| l.weights(Weights::uniform(-f64::MAX, f64::MAX, Seed::new(1))),
            "weights between -1.7976931348623157e308 and 1.7976931348623157e308; expected a finite difference",
        ),
        (|l| l.targets(0..1), "`targets` without the activity of target neurons; expected `post`"),
        (|l| l.expose("theta"), "there is no `theta` to expose; expected `delta`, `weights`"),
        (|l| l.sources(1..4), "sources 1..4; expected a range that is not empty, within 0..2"),
        (|l| l.sources(1..1), "sources 1..1"),
        (|l| l.rule(Pes::default()), "`learned.error`"),
        (|l| l.rule(Misplaced), "a trace needs a part `pre` of its state, of 2 numbers"),
    ];
    for (change, expected) in cases {
        let said = refused(&change);
        assert!(said.contains(expected), "{said}");
    }
    let said = refused(&|l| l.rule(Pes::default().pre_synapse(zero)));
    assert!(
        said.contains("rule `pes`: the synapse of `pre` has a time constant of zero"),
        "{said}"
    );
    let mut graph = GraphBuilder::new();
    let pre = graph.add("activity", Constant::vector(&[1.0]));
    graph.add("learned", Learned::new(&pre, 0));
    let faults = graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1));
    let said = faults.expect_err("refused").to_string();
    assert!(said.contains("0 outputs of 1 sources; expected at least one of each"), "{said}");
    // A learned output has no value before the end of the tick.
    let (mut graph, learned, _) = simple(|l| l.rule(Pes::default()));
    graph.connect(&learned.output, &learned.error(), Synapse::None);
    let faults = graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1));
    let said = faults.expect_err("refused").to_string();
    assert!(said.contains("`learned.output` is written while `learned.error` is read"), "{said}");
}

#[test]
fn learning_that_diverges_ends_the_run_with_the_name_of_the_connection() {
    let (mut graph, learned, one) = simple(|l| l.rule(Pes::new(1e3).toward_target()));
    graph.route(&one >> &learned.target());
    let error = graph.run(&PopulationPlan::direct(), Seed::new(1), ms(1000));
    match error.err().expect("it diverges") {
        SimError::NonFinite { path, .. } | SimError::Node { path, .. } => {
            assert_eq!(path, "learned");
        }
        other => panic!("{other}"),
    }
}

#[test]
fn a_checkpoint_of_other_rules_or_weights_is_refused() {
    let of = |rate: f64, first: f64| {
        let (mut graph, learned, one) =
            simple(|l| l.rule(Pes::new(rate)).weights(Weights::rows([[first, 0.0]])));
        graph.route(&one >> &learned.error());
        run(&graph, 3)
    };
    let saved = of(1e-4, 0.0).checkpoint().expect("saved");
    of(1e-4, 0.0).restore(&saved).expect("the same");
    for (rate, first) in [(2e-4, 0.0), (1e-4, 1.0)] {
        assert!(matches!(of(rate, first).restore(&saved), Err(SimError::ForeignCheckpoint)));
    }
}
