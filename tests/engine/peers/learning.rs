//! Learning rules.

use symbolt::neurons::{
    BuiltLayer, Encoders, Ensemble, Learned, LearningRule, LearningTick, Needs, Stretch,
    TuningError, Values, WeightShape, Weights,
};
use symbolt::prelude::*;
use symbolt::sim::{Fingerprint, Real, WhiteSignal};

use super::{count, lif, mean, ms, near, rate, rms, run, samples, smooth};

fn fast() -> Synapse {
    Synapse::lowpass_ms(5)
}

#[test]
fn pes_learns_a_vector_from_zero_decoders() {
    let target = [-0.5, 0.5];
    let mut graph = GraphBuilder::new();
    let u = graph.add("u", Constant::vector(&[0.5, -0.5]));
    let pre = graph.add("pre", Ensemble::new(2).neurons(100).expose_neurons());
    let post = graph.add("post", Ensemble::new(2).neurons(100).identity("x"));
    let learned = Learned::new(&pre.neurons(), 2).rule(Pes::new(3e-4)).expose("weights");
    let learned = graph.add("learned", learned);
    graph.route(&u >> &pre.input);
    graph.route((&learned >> &post.input).via(fast()));
    graph.route((post.output("x") - target >> &learned.error()).via(fast()));
    let probe = graph.probe(&post.output("x"), smooth(30));
    let weights = graph.probe(&learned.exposed("weights"), ProbeSpec::default());
    let sim = run(&graph, &lif(), 500);
    near(&mean(&sim, &probe, 0, 5), &[0.0; 2], 0.1);
    near(&mean(&sim, &probe, 450, 500), &target, 0.05);
    let all = samples(&sim, &weights);
    let most = |tick: usize| all[tick].iter().fold(0.0, |most: Real, w| most.max(w.abs()));
    assert!(most(0) < 1e-2 * most(499) && most(499) > 1e-5, "{} {}", most(0), most(499));
}

#[test]
fn pes_learns_weights_between_neurons() {
    let encoders: Vec<[f64; 1]> = (0..60).map(|n| [if n % 2 == 0 { 1.0 } else { -1.0 }]).collect();
    let rows: Vec<[Real; 1]> = encoders.iter().map(|[e]| [*e as Real]).collect();
    for wanted in [0.6, -0.4] {
        let mut graph = GraphBuilder::new();
        let u = graph.add("u", Constant::vector(&[0.5]));
        let pre = graph.add("pre", Ensemble::new(1).neurons(50).expose_neurons());
        let post = Ensemble::new(1).neurons(60).expose_neurons().identity("x");
        let post = graph.add("post", post.encoders(Encoders::given(encoders.clone())));
        let start = Weights::uniform(0.0, 1e-5, Seed::new(2));
        let learned = Learned::new(&pre.neurons(), 60).weights(start).rule(Pes::new(3e-4));
        let learned = graph.add("learned", learned);
        graph.route(&u >> &pre.input);
        graph.route((&learned >> &post.encoded()).via(fast()));
        let error = (post.output("x") - [wanted; 1]).transform(rows.clone());
        graph.route((error >> &learned.error()).via(fast()));
        let probe = graph.probe(&post.output("x"), smooth(30));
        let sim = run(&graph, &lif(), 600);
        near(&mean(&sim, &probe, 500, 600), &[wanted], 0.1);
        assert_eq!(learned.weights(&sim).dim(), (60, 50));
    }
}

#[test]
fn pes_learns_one_component_of_a_recurrent_ensemble() {
    let mut graph = GraphBuilder::new();
    let post = Ensemble::new(2).neurons(50).radius(2.0).expose_neurons().identity("x");
    let post = graph.add("post", post);
    let learned = Learned::new(&post.neurons(), 1).rule(Pes::new(5e-4));
    let learned = graph.add("learned", learned);
    graph.route((learned.embed(1, 2) >> &post.input).via(fast()));
    let error = graph.add("error", Constant::vector(&[-1.0]));
    graph.route(&error >> &learned.error());
    let probe = graph.probe(&post.output("x"), smooth(25));
    let sim = run(&graph, &lif(), 200);
    let last = mean(&sim, &probe, 190, 200);
    assert!(last[0].abs() < 0.2 && last[1] > 0.8, "{last:?}");
    // Two components, each with an error from a place of its own.
    let mut graph = GraphBuilder::new();
    let a = graph.add("a", Ensemble::new(1).neurons(50).expose_neurons());
    let b = graph.add("b", Ensemble::new(2).neurons(60).identity("x"));
    let learned = graph.add("learned", Learned::new(&a.neurons(), 2).rule(Pes::default()));
    let one = graph.add("one", Constant::vector(&[1.0]));
    graph.route(&one >> &a.input);
    graph.route((&learned >> &b.input).via(fast()));
    let x = b.output("x");
    let errors = [(x.slice(0..1) - [0.75], 0), (x.slice(1..2) + [0.5], 1)];
    for (error, at) in errors {
        graph.route((error.embed(at, 2) >> &learned.error()).via(fast()));
    }
    let probe = graph.probe(&x, smooth(30));
    let sim = run(&graph, &lif(), 1000);
    near(&mean(&sim, &probe, 800, 1000), &[0.75, -0.5], 0.15);
}

#[test]
fn oja_and_bcm_change_weights_alone_and_together() {
    type Rules = fn(Learned) -> Learned;
    let all: [Rules; 4] = [
        |l| l,
        |l| l.rule(Oja::default()),
        |l| l.rule(Bcm::default()),
        |l| l.rule(Oja::default()).rule(Bcm::default()),
    ];
    for solved in [false, true] {
        let changes = all.map(|rules| {
            let mut graph = GraphBuilder::new();
            let u = graph.add("u", WhiteSignal::vector(2, ms(500), 10.0));
            let a = Ensemble::new(2).neurons(60).expose_neurons().identity("x");
            let b = Ensemble::new(2).neurons(61).expose_neurons().identity("x");
            let (a, b) = (graph.add("a", a), graph.add("b", b));
            graph.route(&u >> &a.input);
            let start = if solved {
                let built = graph.build(Timebase::default(), &lif(), Seed::new(1)).expect("builds");
                let of = |path: &str| {
                    BuiltLayer::of(&built, path).expect("neurons").ensemble(0).expect("one")
                };
                Weights::matrix(of("a").weights("x", &of("b")).expect("as wide"))
            } else {
                Weights::uniform(0.0, 1e-3, Seed::new(2))
            };
            let learned = Learned::new(&a.neurons(), 61).post(&b.neurons()).weights(start);
            let learned = graph.add("learned", rules(learned));
            graph.route((&learned >> &b.currents()).via(fast()));
            let mut sim = graph.start(&lif(), Seed::new(1)).expect("starts");
            let before = learned.weights(&sim);
            sim.run_for(ms(300)).expect("runs");
            (learned.weights(&sim) - before).mapv(f64::abs).sum()
        });
        assert_eq!(changes[0], 0.0);
        assert!(changes[1..].iter().all(|change| *change > 1e-6), "{changes:?}");
    }
}

/// Learns encoders for a second: half of the neurons always fire, the others never. Returns encoders before and after.
fn voja(radius: Real) -> [ndarray::Array2<f64>; 2] {
    let length = (0.3f64 * 0.3 + 0.4 * 0.4 + 0.6 * 0.6).sqrt();
    let vector = [0.3, -0.4, 0.6].map(|v: f64| v / length);
    let mut graph = GraphBuilder::new();
    let start: Vec<Vec<f64>> = (0..200)
        .map(|n| match n {
            0..100 => {
                let angle = f64::from(n);
                vec![angle.sin(), angle.cos() * 0.6, angle.cos() * 0.8]
            }
            _ => vector.iter().map(|v| -v).collect(),
        })
        .collect();
    let intercepts: Vec<f64> = (0..200).map(|n| if n < 100 { -1.0 } else { 0.99 }).collect();
    let x = Ensemble::new(3).neurons(200).radius(radius).expose_neurons();
    let x = x.intercepts(Values::given(intercepts)).max_rates(Values::between(300.0, 400.0));
    let x = graph.add("x", x);
    let learned = Learned::encoders(3, &x.neurons()).weights(Weights::rows(start));
    let learned = graph.add("learned", learned.rule(Voja::new(0.1).radius(radius.into())));
    let shown = vector.map(|v| v as Real * radius);
    let u = graph.add("u", Constant::vector(&shown));
    graph.route(&u >> &learned.input());
    graph.route(&learned >> &x.encoded());
    let mut sim = graph.start(&lif(), Seed::new(1)).expect("starts");
    let before = learned.weights(&sim);
    sim.run_for(ms(1000)).expect("runs");
    let after = learned.weights(&sim);
    for row in after.rows().into_iter().take(100) {
        assert!(row.iter().zip(vector).all(|(e, v)| (e - v).abs() < 0.01), "{radius}: {row}");
    }
    [before, after]
}

#[test]
fn voja_moves_the_encoders_of_active_neurons_to_the_input() {
    for radius in [1.0, 2.0] {
        let [before, after] = voja(radius);
        let moved = |n: usize| (&before.row(n) - &after.row(n)).mapv(f64::abs).sum();
        assert!((0..100).filter(|n| moved(*n) > 0.1).count() > 90);
        assert!((100..200).all(|n| moved(n) == 0.0));
    }
}

#[test]
fn voja_stops_when_told() {
    let mut graph = GraphBuilder::new();
    let x = graph.add("x", Ensemble::new(1).neurons(50).expose_neurons());
    let rule = Voja::default().post_synapse(Synapse::None);
    let learned = Learned::encoders(1, &x.neurons()).weights(Weights::directions(Seed::new(1)));
    let learned = graph.add("learned", learned.rule(rule).switched().expose("weights"));
    let u = graph.add("u", Constant::vector(&[0.5]));
    graph.route(&u >> &learned.input());
    graph.route(&learned >> &x.encoded());
    let signal = graph.add("signal", Stimulus::scalar(1.0).from(ms(300), &[0.0]));
    graph.route(&signal >> &learned.learning());
    let probe = graph.probe(&learned.exposed("weights"), ProbeSpec::default());
    let sim = run(&graph, &lif(), 600);
    let all = samples(&sim, &probe);
    let moved = |from: usize, to: usize| rms(all[from].iter().zip(&all[to]).map(|(a, b)| a - b));
    assert!(moved(0, 299) > 0.01, "{}", moved(0, 299));
    assert!((300..600).all(|tick| moved(301, tick.max(301)) == 0.0));
}

#[test]
fn rls_learns_vectors_from_rates_and_spikes() {
    // Both networks of the suite: rates with a rate so high that the error vanishes, and spikes.
    for (dims, plan, rate, bound) in
        [(1, rate(), 100.0, 0.02), (3, rate(), 100.0, 0.05), (1, lif(), 0.05, 0.1)]
    {
        let mut graph = GraphBuilder::new();
        let u = graph.add("u", WhiteSignal::vector(dims, ms(1000), 3.0).rms(0.35));
        let pre = Ensemble::new(dims).neurons(80 * dims).expose_neurons();
        let pre = graph.add("pre", pre.radius((dims as Real).sqrt()).identity("x"));
        graph.route(&u >> &pre.input);
        // The error of spikes passes a filter, as the activity does.
        let (rule, slow) = (Rls::new(rate), Synapse::lowpass_ms(10));
        let spiking = rate < 1.0;
        let rule = if spiking { rule.pre_synapse(slow) } else { rule.toward_target() };
        let learned = graph.add("learned", Learned::new(&pre.neurons(), dims).rule(rule));
        if spiking {
            graph.route((&learned - &u >> &learned.error()).via(slow));
        } else {
            graph.route(&u >> &learned.target());
        }
        let outs = [u, learned.output, pre.output("x")];
        let probes = outs.map(|out| graph.probe(&out, smooth(20)));
        let sim = run(&graph, &plan, 2000);
        let [wanted, found, solved] = probes.map(|probe| samples(&sim, &probe)[1000..].concat());
        let share = |found: &[Real]| {
            let off = wanted.iter().zip(found).map(|(w, f)| w - f);
            rms(off) / rms(wanted.iter().copied())
        };
        let (learned, solved) = (share(&found), share(&solved));
        println!("{dims} {rate}: {learned} {solved}");
        assert!(learned < bound && (spiking || learned < solved), "{dims}: {learned} {solved}");
    }
}

/// Adds its signal, of three numbers, to the first three weights of every output.
#[derive(Debug)]
struct AddSignal;

impl LearningRule for AddSignal {
    fn name(&self) -> &'static str {
        "add-signal"
    }
    fn needs(&self, _shape: WeightShape) -> Result<Needs, TuningError> {
        Ok(Needs { signal: Some(("error", 3)), ..Needs::default() })
    }
    fn change(
        &self,
        tick: &LearningTick<'_>,
        _state: &[f64],
        of: &Stretch<'_>,
        change: &mut [f64],
    ) {
        for (column, change) in of.columns.clone().zip(change).filter(|(column, _)| *column < 3) {
            *change += f64::from(tick.signal[column]);
        }
    }
    fn fingerprint(&self, _hash: &mut Fingerprint) {}
}

#[test]
fn a_rule_of_ones_own_may_have_any_signal() {
    let mut graph = GraphBuilder::new();
    let a = graph.add("a", Ensemble::new(1).neurons(10).expose_neurons());
    let learned = Learned::new(&a.neurons(), 1).rule(AddSignal).expose("weights");
    let learned = graph.add("learned", learned);
    let signal = graph.add("signal", Constant::vector(&[1.0, 2.0, 3.0]));
    graph.route(&signal >> &learned.signal("error"));
    let probe = graph.probe(&learned.exposed("weights"), ProbeSpec::default());
    let sim = run(&graph, &lif(), 5);
    let last = learned.weights(&sim);
    assert_eq!(last.row(0).to_vec()[..4], [5.0, 10.0, 15.0, 0.0]);
    let all = samples(&sim, &probe);
    for pair in all.windows(2) {
        assert_eq!([0, 1, 2].map(|at| pair[1][at] - pair[0][at]), [1.0, 2.0, 3.0]);
        assert!(pair[1][3..].iter().all(|w| *w == 0.0));
    }
}

#[test]
fn states_of_rules_are_probed_and_reset() {
    let mut graph = GraphBuilder::new();
    let u = graph.add("u", Constant::vector(&[0.6]));
    let a = graph.add("a", Ensemble::new(1).neurons(20).expose_neurons().identity("x"));
    let b = graph.add("b", Ensemble::new(1).neurons(20).expose_neurons().identity("x"));
    graph.route(&u >> &a.input);
    graph.route((&a.output("x") >> &b.input).via(fast()));
    let new = |outputs: usize| Learned::new(&a.neurons(), outputs);
    let uniform = || Weights::uniform(0.0, 1e-4, Seed::new(3));
    let all: [(&str, Learned, &[&str]); 5] = [
        ("pes", new(1).rule(Pes::default()), &["pre", "error", "weights", "delta"]),
        ("rls", new(1).rule(Rls::default()), &["pre", "error", "inverse", "delta"]),
        (
            "bcm",
            new(20).post(&b.neurons()).weights(uniform()).rule(Bcm::default()),
            &["pre", "post", "theta", "delta"],
        ),
        (
            "oja",
            new(20).post(&b.neurons()).weights(uniform()).rule(Oja::default()),
            &["pre", "post", "weights", "delta"],
        ),
        (
            "voja",
            Learned::encoders(1, &b.neurons()).rule(Voja::default()),
            &["post", "weights", "delta"],
        ),
    ];
    let (mut probes, mut learned) = (Vec::new(), Vec::new());
    for (name, connection, states) in all {
        let connection = states.iter().fold(connection, |c, state| c.expose(state));
        let ports = graph.add(name, connection);
        if states.contains(&"error") {
            graph.route((&b.output("x") - [0.9] >> &ports.error()).via(fast()));
        }
        if name == "voja" {
            graph.route((&a.output("x") >> &ports.input()).via(fast()));
        }
        for state in states {
            probes.push((
                format!("{name} {state}"),
                graph.probe(&ports.exposed(state), ProbeSpec::default()),
            ));
        }
        learned.push(ports);
    }
    let mut sim = graph.start(&lif(), Seed::new(1)).expect("starts");
    let start: Vec<_> = learned.iter().map(|ports| ports.weights(&sim)).collect();
    sim.run_for(ms(200)).expect("runs");
    let first: Vec<_> = probes.iter().map(|(_, probe)| samples(&sim, probe)).collect();
    let ends: Vec<_> = learned.iter().map(|ports| ports.weights(&sim)).collect();
    for ((name, probe), values) in probes.iter().zip(&first) {
        assert_eq!(count(&sim, probe), 200);
        assert!(values.iter().flatten().any(|value| *value != 0.0), "{name}");
    }
    assert!(start.iter().zip(&ends).all(|(start, end)| start != end), "all learn");
    sim.reset().expect("reset");
    assert!(learned.iter().zip(&start).all(|(ports, start)| ports.weights(&sim) == *start));
    sim.run_for(ms(200)).expect("runs");
    let again: Vec<_> = probes.iter().map(|(_, probe)| samples(&sim, probe)).collect();
    assert!(first == again && first.len() == 19);
}
