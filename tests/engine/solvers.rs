//! Solvers, compared with Nengo and scipy (`tests/conformance/fixtures.py`), and with the conditions that a solution
//! satisfies.

use ndarray::{Array2, Axis, s};
use symbolt::files::npz::NpzReader;
use symbolt::neurons::{
    BuiltLayer, Ensemble, L1, L2, LeastSquares, NoDecoders, Noisy, NonNegative, Solver, Target,
};
use symbolt::sim::{Constant, GraphBuilder, Real, Seed, Synapse, Timebase};

use crate::things::lif;

fn fixture(name: &str) -> Array2<f64> {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/conformance");
    let bytes = std::fs::read(folder.join("solvers.npz")).expect("a fixture");
    NpzReader::new(&bytes).expect("arrays").read(name).expect("a matrix of doubles")
}

fn solve(solver: &dyn Solver) -> Array2<f64> {
    let (rates, targets) = (fixture("rates"), fixture("targets"));
    solver.solve(rates.view(), targets.view(), Seed::new(1)).expect("solvable")
}

fn greatest(array: &Array2<f64>) -> f64 {
    array.iter().fold(0.0, |most: f64, x| most.max(x.abs()))
}

#[test]
fn decoders_are_those_of_nengo_and_scipy() {
    let l2 = L2 { regularisation: 0.01 };
    let non_negative = NonNegative { regularisation: 0.1 };
    let all: [(&str, &dyn Solver); 5] = [
        ("l2", &L2::default()),
        ("l2_weak", &l2),
        ("plain", &LeastSquares::default()),
        ("non_negative", &NonNegative::default()),
        ("non_negative_l2", &non_negative),
    ];
    for (name, solver) in all {
        let (ours, theirs) = (solve(solver), fixture(name));
        assert_eq!(ours.dim(), (24, 2), "{name}");
        let off = greatest(&(&ours - &theirs)) / greatest(&theirs);
        println!("{name}: {off}");
        assert!(off < 1e-8, "{name}: {off}");
    }
    // The wrong variant: another regularisation.
    assert!(greatest(&(solve(&L2 { regularisation: 0.11 }) - fixture("l2"))) > 1e-6);
}

#[test]
fn decoders_that_are_not_negative_leave_no_slope_that_could_be_followed() {
    // Conditions of Kuhn and Tucker: decoders at least 0; the slope is 0 where they are above, and not positive
    // elsewhere.
    let (rates, targets) = (fixture("rates"), fixture("targets"));
    for regularisation in [0.0, 0.02, 0.3] {
        let decoders = solve(&NonNegative { regularisation });
        let noise = (regularisation * greatest(&rates)).powi(2) * 80.0;
        let slope = rates.t().dot(&(&targets - &rates.dot(&decoders))) - noise * &decoders;
        let scale = greatest(&rates.t().dot(&targets));
        let (mut above, mut at) = (0, 0);
        for (decoder, slope) in decoders.iter().zip(&slope) {
            assert!(*decoder >= 0.0);
            if *decoder > 0.0 {
                assert!(slope.abs() < 1e-9 * scale, "{slope}");
                above += 1;
            } else {
                assert!(*slope < 1e-9 * scale, "{slope}");
                at += 1;
            }
        }
        assert!(above > 5 && at > 5, "{above}, {at}");
    }
    // Rates that depend on each other: a neuron twice, and one that never fires.
    let mut twice = rates.clone();
    let first = twice.column(0).to_owned();
    twice.column_mut(1).assign(&first);
    twice.column_mut(2).fill(0.0);
    let solver = NonNegative::default();
    let decoders = solver.solve(twice.view(), targets.view(), Seed::new(1)).expect("solvable");
    assert!(decoders.iter().all(|d| d.is_finite() && *d >= 0.0));
    let slope = twice.t().dot(&(&targets - &twice.dot(&decoders)));
    assert!(slope.iter().all(|slope| *slope < 1e-7 * greatest(&rates.t().dot(&targets))));
}

#[test]
fn the_elastic_net_satisfies_its_conditions_and_decodes_few_neurons() {
    let (rates, targets) = (fixture("rates"), fixture("targets"));
    for (l1, few) in [(1e-4, 44), (2e-3, 20)] {
        let solver = L1 { l1, l2: 1e-6, sweeps: 100_000 };
        let decoders = solve(&solver);
        let (a, b) = (l1 * greatest(&rates), 1e-6 * greatest(&rates).powi(2));
        let slope = rates.t().dot(&(&targets - &rates.dot(&decoders))) / 80.0 - b * &decoders;
        let mut used = 0;
        for (decoder, slope) in decoders.iter().zip(&slope) {
            if *decoder == 0.0 {
                assert!(slope.abs() <= a * (1.0 + 1e-3), "{slope} {a}");
            } else {
                assert!((slope - a * decoder.signum()).abs() < 2e-2 * a, "{slope} {a}");
                used += 1;
            }
        }
        assert!(used > 4 && used <= few, "{l1}: {used}");
    }
    // Without penalties on magnitudes it is least squares with one on squares: m s^2 = m b.
    let ridge = solve(&L1 { l1: 0.0, l2: 0.01, sweeps: 100_000 });
    let l2 = solve(&L2 { regularisation: 0.1 });
    assert!(greatest(&(&ridge - &l2)) < 1e-3 * greatest(&l2));
}

#[test]
fn noise_on_rates_regularises_like_its_variance() {
    // Of the same points many times, the mean square of the noise is all that remains.
    let (rates, targets) = (fixture("rates"), fixture("targets"));
    let many = |array: &Array2<f64>| {
        let views: Vec<_> = (0..400).map(|_| array.view()).collect();
        ndarray::concatenate(Axis(0), &views).expect("equal widths")
    };
    let noisy = Noisy::added(0.1)
        .solve(many(&rates).view(), many(&targets).view(), Seed::new(1))
        .expect("solvable");
    let (l2, none) = (solve(&L2::default()), solve(&L2 { regularisation: 0.0 }));
    let off = greatest(&(&noisy - &l2)) / greatest(&l2);
    assert!(off < 0.05, "{off}");
    assert!(greatest(&(&noisy - &none)) > 0.5 * greatest(&l2));
    // The same seed gives the same bits, another one other noise.
    let of = |seed: u64| {
        Noisy::multiplied(0.1)
            .solve(rates.view(), targets.view(), Seed::new(seed))
            .expect("solvable")
    };
    assert!(of(1) == of(1) && of(1) != of(2));
    let error = greatest(&(rates.dot(&of(1)) - &targets));
    assert!(error < 0.4, "{error}");
    // Multiplied noise leaves a neuron that never fires at 0.
    let mut silent = rates.clone();
    silent.column_mut(3).fill(0.0);
    let decoders = Noisy::multiplied(0.1)
        .solve(silent.view(), targets.view(), Seed::new(1))
        .expect("solvable");
    assert!(decoders.row(3).iter().all(|d| *d == 0.0));
}

#[test]
fn least_squares_has_the_least_error_and_of_equal_neurons_the_shortest_decoders() {
    let (rates, targets) = (fixture("rates"), fixture("targets"));
    let error = |decoders: &Array2<f64>| (rates.dot(decoders) - &targets).mapv(|x| x * x).sum();
    let exact = solve(&LeastSquares { cutoff: 0.0 });
    for other in [solve(&L2::default()), solve(&L2 { regularisation: 1e-3 }), fixture("plain")] {
        assert!(error(&exact) <= error(&other) + 1e-9);
    }
    let mut twice = rates.clone();
    let first = twice.column(0).to_owned();
    twice.column_mut(1).assign(&first);
    let solved = LeastSquares { cutoff: 1e-8 }
        .solve(twice.view(), targets.view(), Seed::new(1))
        .expect("solvable");
    let off = greatest(&(&solved.slice(s![0..1, ..]) - &solved.slice(s![1..2, ..])));
    assert!(off < 1e-9 * greatest(&solved), "{off}");
}

#[test]
fn functions_of_one_ensemble_have_solvers_of_their_own() {
    let square = |x: &[Real], out: &mut [Real]| out[0] = x[0] * x[0];
    let ensemble = Ensemble::new(1)
        .identity("plain")
        .decode_as("positive", Target::function(1, square).solver(NonNegative::default()))
        .decode_as("none", Target::function(2, |_, out| out.fill(1.0)).solver(NoDecoders))
        .decode("square", 1, square);
    let alone = Ensemble::new(1).identity("plain").decode("square", 1, square);
    let read = |ensemble: Ensemble| {
        let mut graph = GraphBuilder::new();
        let given = graph.add("given", Constant::vector(&[0.0]));
        let a = graph.add("a", ensemble);
        graph.connect(&given, &a.input, Synapse::None);
        let graph = graph.build(Timebase::default(), &lif(), Seed::new(1)).expect("builds");
        BuiltLayer::of(&graph, "a").expect("neurons").ensemble(0).expect("one")
    };
    let (read, alone) = (read(ensemble), read(alone));
    assert!(read.functions().eq([("plain", 1), ("positive", 1), ("none", 2), ("square", 1)]));
    let of = |name: &str| read.decoders(name).expect("there");
    assert!(of("positive").iter().all(|d| *d >= 0.0) && greatest(&of("positive")) > 0.0);
    assert_eq!(greatest(&of("none")), 0.0);
    // The others have the decoders that they have alone.
    for name in ["plain", "square"] {
        let other = alone.decoders(name).expect("there");
        let off = greatest(&(of(name) - &other)) / greatest(&other);
        // In single precision, so not to the last digit.
        assert!(off < 5e-3, "{name}: {off}");
    }
    let errors =
        ["plain", "positive", "none", "square"].map(|name| read.error(name).expect("there"));
    assert!(errors[0] < 0.02 && errors[3] < 0.02, "{errors:?}");
    assert!(errors[1] < 0.02 && (errors[2] - 1.0).abs() < 1e-9, "{errors:?}");
    let missing = read.decoders("cube").expect_err("no cube").to_string();
    assert!(missing.contains("`cube`") && missing.contains("plain, positive, none, square"));

    // Full weights give every neuron of the target the current that decoding and encoding give it.
    let weights = read.weights("plain", &alone).expect("one dimension");
    assert_eq!(weights.dim(), (100, 100));
    let point = ndarray::array![[0.4]];
    let rates = read.tuning_curves(point.view()).expect("one column");
    let decoded = rates.dot(&of("plain"))[(0, 0)];
    let currents = weights.dot(&rates.row(0));
    for n in 0..100 {
        let wanted = alone.gains()[n] * alone.encoders()[(n, 0)] * decoded;
        assert!((currents[n] - wanted).abs() < 1e-9 * (1.0 + wanted.abs()), "{n}");
    }
    assert!(read.weights("none", &alone).is_err());
}
