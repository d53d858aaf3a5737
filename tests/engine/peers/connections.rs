//! Connections, solvers and arrays of ensembles.

use symbolt::neurons::{
    BuiltLayer, Encoders, Ensemble, L1, L2, LeastSquares, NoDecoders, Noisy, NonNegative, Target,
    Values,
};
use symbolt::prelude::*;
use symbolt::sim::{Real, Signal, Vector, WhiteSignal};

use super::{lif, mean, near, rms, run, samples, sines, smooth};

fn fast() -> Synapse {
    Synapse::lowpass_ms(5)
}

/// A sine of one radian per second.
fn sine() -> Signal<Vector> {
    Signal::vector(1, |t, out| out[0] = t.sin() as Real)
}

#[test]
fn a_value_inhibits_neurons() {
    let mut graph = GraphBuilder::new();
    let a = graph.add("a", Ensemble::new(1).neurons(50).expose_neurons().identity("x"));
    let (given, stop) = (graph.add("given", sine()), Stimulus::scalar(0.0));
    let stop = graph.add("stop", stop.from(super::ms(500), &[1.0]));
    graph.route((&given >> &a.input).via(fast()));
    graph.route((stop.transform([[-5.0]; 50]) >> &a.encoded()).via(fast()));
    let probe = graph.probe(&a.output("x"), smooth(100));
    let sim = run(&graph, &lif(), 1000);
    let before = mean(&sim, &probe, 490, 500)[0];
    assert!((0.2..0.5).contains(&before), "{before}");
    near(&mean(&sim, &probe, 990, 1000), &[0.0], 0.1);
}

#[test]
fn an_ensemble_and_its_neurons_inhibit_neurons() {
    for by_neurons in [false, true] {
        let mut graph = GraphBuilder::new();
        let a = graph.add("a", Ensemble::new(1).neurons(40).expose_neurons().identity("x"));
        let inhibitor = Ensemble::new(1).neurons(40).expose_neurons().identity("x");
        let up = inhibitor.clone().encoders(Encoders::given([[1.0]; 40]));
        let up = up.intercepts(Values::between(0.1, 0.9));
        let inhibitor = graph.add("inhibitor", if by_neurons { up } else { inhibitor });
        let given = graph.add("given", sine());
        let stop = Stimulus::vector(&[0.0]).from(super::ms(500), &[1.0]);
        let stop = graph.add("stop", stop);
        graph.route((&given >> &a.input).via(fast()));
        graph.route((&stop >> &inhibitor.input).via(fast()));
        let route = match by_neurons {
            true => inhibitor.neurons().transform(vec![vec![-0.01; 40]; 40]) >> &a.currents(),
            false => inhibitor.output("x").transform([[-10.0]; 40]) >> &a.encoded(),
        };
        graph.route(route.via(fast()));
        let probes = [&a, &inhibitor].map(|of| graph.probe(&of.output("x"), smooth(50)));
        let sim = run(&graph, &lif(), 1000);
        assert!(mean(&sim, &probes[0], 450, 500)[0] > 0.25);
        near(&mean(&sim, &probes[0], 990, 1000), &[0.0], 0.1);
        near(&mean(&sim, &probes[1], 990, 1000), &[1.0], 0.15);
    }
}

#[test]
fn a_function_is_transformed_after_it_is_decoded() {
    let mut graph = GraphBuilder::new();
    let u = graph.add("u", sine());
    let square = |x: &[Real], out: &mut [Real]| out[0] = x[0] * x[0];
    let a = graph.add("a", Ensemble::new(1).neurons(100).decode("square", 1, square));
    let b = graph.add("b", Ensemble::new(2).neurons(200).identity("x"));
    graph.route((&u >> &a.input).via(fast()));
    graph.route((a.output("square").transform([[1.0], [-1.0]]) >> &b.input).via(fast()));
    let probe = graph.probe(&b.output("x"), smooth(30));
    let sim = run(&graph, &lif(), 1000);
    for (tick, value) in samples(&sim, &probe).iter().enumerate().skip(300) {
        let wanted = (1e-3 * tick as Real - 0.04).sin().powi(2);
        near(value, &[wanted, -wanted], 0.12);
    }
}

#[test]
fn slices_and_repeated_indices_reach_what_they_name() {
    let mut graph = GraphBuilder::new();
    let u = graph.add("u", Constant::vector(&[-1.0, 1.0, 0.5]));
    let (one, two) = (u.component(0), u.component(1));
    let add = |graph: &mut GraphBuilder, name: &str, dims: usize, radius: Real| {
        graph.add(name, Ensemble::new(dims).neurons(60 * dims).radius(radius).identity("x"))
    };
    let a = add(&mut graph, "a", 1, 1.0);
    graph.route(one.clone() >> &a.input);
    graph.route(two.clone() >> &a.input);
    let b = add(&mut graph, "b", 1, 2.2);
    graph.route(two.clone() >> &b.input);
    graph.route(two.clone() >> &b.input);
    let c = add(&mut graph, "c", 2, 1.3);
    graph.route(two.clone().embed(0, 2) >> &c.input);
    graph.route(one.embed(1, 2) >> &c.input);
    // Of three components, two from one place to another.
    let d = add(&mut graph, "d", 3, 1.3);
    graph.route(u.slice(1..3).embed(0, 3) >> &d.input);
    // Of a function, the second of its values.
    let e = |x: &[Real], out: &mut [Real]| (out[0], out[1]) = (x[0], -x[0] / 2.0);
    let e = graph.add("e", Ensemble::new(1).neurons(60).decode("both", 2, e));
    graph.route(two >> &e.input);
    let f = add(&mut graph, "f", 2, 1.0);
    graph.route((e.output("both").component(1).embed(1, 2) >> &f.input).via(fast()));
    let all: [(&symbolt::neurons::EnsemblePorts, &[Real]); 5] = [
        (&a, &[0.0]),
        (&b, &[2.0]),
        (&c, &[1.0, -1.0]),
        (&d, &[1.0, 0.5, 0.0]),
        (&f, &[0.0, -0.5]),
    ];
    let probes = all.map(|(of, wanted)| (graph.probe(&of.output("x"), smooth(30)), wanted));
    let sim = run(&graph, &lif(), 400);
    for (probe, wanted) in &probes {
        near(&mean(&sim, probe, 300, 400), wanted, 0.1);
    }
}

#[test]
fn full_weights_act_as_decoders_and_encoders_do() {
    // The weights are read from one graph, which has decoders, and wired between bare neurons in another.
    let graph = |weights: Option<&ndarray::Array2<f64>>| {
        let mut graph = GraphBuilder::new();
        let u = graph.add("u", sines(2));
        let a = graph.add("a", Ensemble::new(2).neurons(50).expose_neurons().identity("x"));
        let b = graph.add("b", Ensemble::new(2).neurons(60).expose_neurons().identity("x"));
        graph.route(0.6 * &u >> &a.input);
        let route = match weights {
            None => &a.output("x") >> &b.input,
            Some(weights) => {
                let row =
                    |row: ndarray::ArrayView1<'_, f64>| row.iter().map(|w| *w as Real).collect();
                let rows: Vec<Vec<Real>> = weights.rows().into_iter().map(row).collect();
                a.neurons().transform(rows) >> &b.currents()
            }
        };
        graph.route(route.via(fast()));
        let probe = graph.probe(&b.output("x"), smooth(20));
        let sim = run(&graph, &lif(), 500);
        (samples(&sim, &probe), sim)
    };
    let (decoded, sim) = graph(None);
    let of =
        |path: &str| BuiltLayer::of(sim.graph(), path).expect("neurons").ensemble(0).expect("one");
    let weights = of("a").weights("x", &of("b")).expect("as wide");
    assert_eq!(weights.dim(), (60, 50));
    let (weighted, _) = graph(Some(&weights));
    let off = rms(decoded.iter().flatten().zip(weighted.iter().flatten()).map(|(d, w)| d - w));
    assert!(off < 0.02 && rms(decoded.concat()) > 0.3, "{off}");
    let (twice, _) = graph(Some(&(2.0 * &weights)));
    let off = rms(decoded.iter().flatten().zip(twice.iter().flatten()).map(|(d, w)| d - w));
    assert!(off > 0.1, "other weights differ: {off}");
}

#[test]
fn a_function_given_by_points_is_decoded() {
    let points: Vec<[f64; 1]> = (0..1000).map(|k| [-1.0 + 0.002 * f64::from(k)]).collect();
    let values: Vec<[f64; 1]> = points.iter().map(|[x]| [-x]).collect();
    let mut graph = GraphBuilder::new();
    let u = graph.add("u", WhiteSignal::vector(1, super::ms(1000), 9.0).rms(0.3));
    let a = Ensemble::new(1).neurons(100).decode_as("negative", Target::samples(points, values));
    let a = graph.add("a", a);
    graph.route(&u >> &a.input);
    let alpha = ProbeSpec::default().filtered(Synapse::alpha_ms(10));
    let probes = [graph.probe(&u, alpha), graph.probe(&a.output("negative"), alpha)];
    let sim = run(&graph, &lif(), 1000);
    let [given, found] = probes.map(|probe| samples(&sim, &probe).concat());
    // The neurons take one tick.
    let off = given[50..999].iter().zip(&found[51..]).map(|(g, f)| g + f);
    let most = off.fold(0.0, |most: Real, off| most.max(off.abs()));
    assert!(most < 0.08 && rms(given) > 0.1, "{most}");
}

#[test]
fn a_sparse_transform_is_the_dense_one() {
    let entries = [(0, 1, 0.5), (2, 0, -1.0), (2, 1, 0.25), (0, 1, 0.5)];
    let dense = [[0.0, 1.0], [0.0, 0.0], [-1.0, 0.25]];
    let mut graph = GraphBuilder::new();
    let u = graph.add("u", sines(2));
    let a = graph.add("a", Ensemble::new(2).neurons(100).identity("x"));
    graph.route(0.7 * &u >> &a.input);
    let x = a.output("x");
    let both = [("sparse", x.transform_sparse(3, entries)), ("dense", x.transform(dense))];
    let probes = both.map(|(name, flow)| {
        let exact = graph.add(&format!("{name}-exact"), Add::vector(3));
        graph.route((flow.clone() >> &exact).via(fast()));
        let b = graph.add(name, Ensemble::new(3).neurons(150).identity("x"));
        graph.route((flow >> &b.input).via(fast()));
        [graph.probe(&exact.output, ProbeSpec::default()), graph.probe(&b.output("x"), smooth(20))]
    });
    let sim = run(&graph, &lif(), 500);
    let [sparse, dense] = probes.map(|pair| pair.map(|probe| samples(&sim, &probe).concat()));
    let off = |which: usize| rms(sparse[which].iter().zip(&dense[which]).map(|(s, d)| s - d));
    assert!(off(0) < 1e-6 && rms(dense[0].iter().copied()) > 0.3);
    assert!(off(1) < 0.1 && rms(dense[1].iter().copied()) > 0.3, "{}", off(1));
}

#[test]
fn decoders_that_are_not_negative_fit_a_square() {
    let square = |x: &[Real], out: &mut [Real]| out[0] = x[0] * x[0];
    let by = |target: Target| {
        let mut graph = GraphBuilder::new();
        let ensemble = Ensemble::new(1).neurons(100).evaluation_count(500);
        let a = graph.add("a", ensemble.decode_as("square", target));
        let zero = graph.add("zero", Constant::vector(&[0.0]));
        graph.route(&zero >> &a.input);
        let sim = run(&graph, &lif(), 1);
        let read = BuiltLayer::of(sim.graph(), "a").expect("neurons").ensemble(0).expect("one");
        (read.decoders("square").expect("there"), read.error("square").expect("there"))
    };
    let new = || Target::function(1, square);
    for regularisation in [0.0, 0.01] {
        let (decoders, error) = by(new().solver(NonNegative { regularisation }));
        assert!(decoders.iter().all(|d| *d >= 0.0) && decoders.iter().any(|d| *d > 0.0));
        // The root mean square of the square is 0.447.
        assert!(error < 0.03 * 0.447, "{error}");
    }
    assert!(by(new()).0.iter().any(|d| *d < 0.0), "without the constraint some are negative");
    // Without a solver there is nothing to decode.
    let (none, error) = by(new().solver(NoDecoders));
    assert!(none.iter().all(|d| *d == 0.0) && error > 0.4);
}

#[test]
fn all_solvers_decode_a_ramp_in_spikes() {
    let target = || Target::function(1, |x, out| out[0] = x[0]);
    let l1 = L1 { sweeps: 5000, ..L1::default() };
    let ensemble = Ensemble::new(1)
        .neurons(70)
        .decode_as("l2", target().solver(L2::default()))
        .decode_as("plain", target().solver(LeastSquares::default()))
        .decode_as("added", target().solver(Noisy::added(0.1)))
        .decode_as("multiplied", target().solver(Noisy::multiplied(0.1)))
        .decode_as("l1", target().solver(l1))
        .decode_as("non-negative", target().solver(NonNegative::default()));
    let mut graph = GraphBuilder::new();
    let ramp = |t: f64, out: &mut [Real]| out[0] = (2.0 * (t - 0.6)).clamp(-1.0, 1.0) as Real;
    let u = graph.add("u", Signal::vector(1, ramp));
    let a = graph.add("a", ensemble);
    graph.route(&u >> &a.input);
    let alpha = ProbeSpec::default().filtered(Synapse::alpha_ms(20));
    let wanted = graph.probe(&u, alpha);
    let names = ["l2", "plain", "added", "multiplied", "l1"];
    let probes = names.map(|name| graph.probe(&a.output(name), alpha));
    let sim = run(&graph, &lif(), 1200);
    let wanted = samples(&sim, &wanted).concat();
    for (name, probe) in names.iter().zip(&probes) {
        let found = samples(&sim, probe).concat();
        let off = wanted[150..].iter().zip(&found[150..]).map(|(w, f)| w - f);
        let most = off.fold(0.0, |most: Real, off| most.max(off.abs()));
        assert!(most < 0.1, "{name}: {most}");
    }
    let few = BuiltLayer::of(sim.graph(), "a").expect("neurons").ensemble(0).expect("one");
    let used =
        |name: &str| few.decoders(name).expect("there").iter().filter(|d| **d != 0.0).count();
    assert!(used("l1") < used("l2") && used("l1") > 3, "{}", used("l1"));
}

#[test]
fn an_array_of_ensembles_has_functions_and_inhibition() {
    let given = [0.5, -0.3, 0.6];
    let mut graph = GraphBuilder::new();
    let u = graph.add("u", Constant::vector(&given));
    // The same functions of every component.
    let both = |x: &[Real], out: &mut [Real]| (out[0], out[1]) = (-x[0], 0.5 * x[0]);
    let array = Ensemble::new(1).copies(3).neurons(60).identity("x").decode("both", 2, both);
    let array = graph.add("array", array);
    graph.route(&u >> &array.input);
    // And a function of its own for each.
    type F = fn(&[Real], &mut [Real]);
    let own: [(usize, F); 3] = [
        (1, |x, out| out[0] = 2.0 * x[0]),
        (2, |x, out| (out[0], out[1]) = (-x[0], -2.0 * x[0])),
        (1, |x, out| out[0] = 0.5 * x[0]),
    ];
    let all = graph.add("all", Add::vector(4));
    let mut at = 0;
    for (index, (width, function)) in own.into_iter().enumerate() {
        let name = format!("own{index}");
        let one = graph.add(&name, Ensemble::new(1).neurons(60).decode("f", width, function));
        graph.route(u.component(index) >> &one.input);
        graph.route((one.output("f").embed(at, 4) >> &all).via(fast()));
        at += width;
    }
    let silent = Ensemble::new(1).copies(2).neurons(10).expose_neurons().identity("x");
    let silent = graph.add("silent", silent);
    let stop = graph.add("stop", Constant::vector(&[-10.0; 20]));
    graph.route(&stop >> &silent.encoded());
    let probes = [array.output("x"), array.output("both"), all.output.clone(), silent.output("x")];
    let probes = probes.map(|out| graph.probe(&out, smooth(30)));
    let sim = run(&graph, &lif(), 400);
    let of = |which: usize| mean(&sim, &probes[which], 300, 400);
    near(&of(0), &given, 0.06);
    near(&of(1), &[-0.5, 0.25, 0.3, -0.15, -0.6, 0.3], 0.06);
    near(&of(2), &[1.0, 0.3, 0.6, 0.3], 0.1);
    near(&of(3), &[0.0, 0.0], 1e-2);
}
