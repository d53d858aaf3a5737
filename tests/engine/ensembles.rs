//! Ensembles with settings of their own: neurons, solvers, evaluation points, states; and what is read back.

use ndarray::{Array2, ArrayView2, array};
use rand::RngExt;
use symbolt::neurons::{
    AdaptiveLif, BuiltEnsemble, BuiltLayer, DrawnEncoders, Encoders, Ensemble, Izhikevich, L1, L2,
    LeastSquares, LifRate, LifSpec, Map, NoDecoders, Noisy, NonNegative, PoissonSpiking,
    Population, PopulationPlan, ReadBackError, RectifiedLinear, RegularSpiking, Sigmoid,
    SolvedModel, Solver, SpikingRectifiedLinear, Start, StochasticSpiking, Tanh, Target, Tuning,
    TuningError, Values, own_neurons,
};
use symbolt::sim::{
    Constant, Fingerprint, Graph, GraphBuilder, Ports, ProbeSpec, Ranks, Real, RunConfig, Seed,
    SimDuration, Simulator, Synapse, Threads, Timebase, Vector,
};

use crate::things::{lif, rate};

/// Builds a graph of an ensemble and a constant that feeds it, as wide as it must be: 1, 2, 3 or 8 numbers.
fn build(ensemble: Ensemble, plan: &PopulationPlan) -> Result<Graph, String> {
    let of = |width: usize| {
        let mut graph = GraphBuilder::new();
        let given = graph.add("given", Constant::vector(&[0.0; 8][..width]));
        let a = graph.add("a", ensemble.clone());
        graph.connect(&given, &a.input, Synapse::None);
        let built = graph.build(Timebase::default(), plan, Seed::new(1));
        built.map_err(|errors| errors.to_string())
    };
    of(1).or_else(|error| [2, 3, 8].into_iter().find_map(|width| of(width).ok()).ok_or(error))
}

fn built(ensemble: Ensemble) -> BuiltEnsemble {
    let graph = build(ensemble, &lif()).expect("builds");
    BuiltLayer::of(&graph, "a").expect("neurons").ensemble(0).expect("one")
}

fn refused(ensemble: Ensemble) -> String {
    build(ensemble, &lif()).expect_err("refused")
}

/// Drives an ensemble with a constant; returns the filtered output at the end of a second.
fn held(ensemble: Ensemble, value: &[Real], output: &str, plan: &PopulationPlan) -> Vec<Real> {
    let mut graph = GraphBuilder::new();
    let given = graph.add("given", Constant::vector(value));
    let a = graph.add("a", ensemble);
    graph.connect(&given, &a.input, Synapse::None);
    let spec = ProbeSpec::default().filtered(Synapse::lowpass_ms(50));
    let probe = graph.probe(&a.output(output), spec);
    let sim = graph.run(plan, Seed::new(1), SimDuration::from_millis(1_000)).expect("runs");
    sim.samples(&probe).last().expect("samples").1.to_vec()
}

#[test]
fn what_is_given_is_what_is_read_back() {
    let rows: Vec<Vec<f64>> = (0..100).map(|n| vec![if n < 30 { -2.0 } else { 0.5 }]).collect();
    let intercepts: Vec<f64> = (0..100).map(|n| -0.9 + 0.015 * f64::from(n)).collect();
    let rates: Vec<f64> = (0..100).map(|n| 100.0 + f64::from(n)).collect();
    let ensemble = Ensemble::new(1)
        .radius(2.0)
        .identity("x")
        .encoders(Encoders::given(rows.clone()))
        .intercepts(Values::given(intercepts.clone()))
        .max_rates(Values::given(rates.clone()));
    let read = built(ensemble.clone());
    assert_eq!(read.radius(), 2.0);
    // Encoders are scaled to length 1, unless they are to be kept.
    let sign = |row: &Vec<f64>| row[0].signum();
    assert!(read.encoders().iter().eq(rows.iter().map(sign).collect::<Vec<_>>().iter()));
    let kept = built(ensemble.clone().encoders(Encoders::given(rows.clone()).unscaled()));
    assert!(kept.encoders().iter().eq(rows.iter().flatten()));
    for (n, (c, m)) in read.intercepts().iter().zip(read.max_rates()).enumerate() {
        assert!((c - intercepts[n]).abs() < 1e-9 && (m - rates[n]).abs() < 1e-6, "{n}: {c} {m}");
    }
    // The closed form gives the same neurons from their gains and biases.
    let (gains, biases) = (read.gains().to_vec(), read.biases().to_vec());
    let again = built(
        Ensemble::new(1)
            .radius(2.0)
            .identity("x")
            .encoders(Encoders::given(rows))
            .gains_and_biases(gains, biases),
    );
    assert_eq!(again.decoders("x"), read.decoders("x"));
    let curves = again.tuning_curves(array![[-2.0], [0.0], [2.0]].view()).expect("one column");
    for n in 0..100 {
        let end = if n < 30 { 0 } else { 2 };
        assert!((curves[(end, n)] - rates[n]).abs() < 1e-6, "{n}");
        assert_eq!(curves[(2 - end, n)] > 0.0, intercepts[n] < -1.0);
    }
    let responses = again.response_curves(&[-1.0, 1.0]);
    assert!((0..100).all(|n| (responses[(1, n)] - rates[n]).abs() < 1e-6));
}

#[test]
fn draws_come_from_where_they_are_said_to() {
    let rows = [[3.0, 0.0], [0.0, -2.0]];
    let read = built(
        Ensemble::new(2)
            .identity("x")
            .encoders(Encoders::choice(rows))
            .intercepts(Values::between(0.1, 0.2))
            .max_rates(Values::choice([150.0, 250.0])),
    );
    let encoders = read.encoders();
    let first = encoders.rows().into_iter().filter(|row| row[0] == 1.0 && row[1] == 0.0).count();
    let second = encoders.rows().into_iter().filter(|row| row[0] == 0.0 && row[1] == -1.0).count();
    assert_eq!(first + second, 200);
    assert!((70..130).contains(&first), "{first}");
    assert!(read.intercepts().iter().all(|c| (0.1 - 1e-9..0.2 + 1e-9).contains(c)));
    let slow = read.max_rates().iter().filter(|m| (*m - 150.0).abs() < 1e-6).count();
    let fast = read.max_rates().iter().filter(|m| (*m - 250.0).abs() < 1e-6).count();
    assert_eq!(slow + fast, 200);
    assert!((70..130).contains(&slow), "{slow}");
    // Distributions of one's own, and one setting that leaves the others as they are.
    let up = |_: &mut _, row: &mut [f64]| row.copy_from_slice(&[1.0, 1.0]);
    let own = built(
        Ensemble::new(2)
            .identity("x")
            .encoders(Encoders::drawn(up))
            .intercepts(Values::between(0.1, 0.2))
            .max_rates(Values::choice([150.0, 250.0])),
    );
    assert!(own.encoders().iter().all(|x| (x - 0.5f64.sqrt()).abs() < 1e-12));
    assert_eq!(own.intercepts(), read.intercepts());
    // Uniform directions: the mean is near 0, 4 standard errors.
    let sphere = built(Ensemble::new(3).identity("x").encoders(Encoders::sphere()));
    let encoders = sphere.encoders();
    assert!(encoders.rows().into_iter().all(|row| (row.dot(&row) - 1.0).abs() < 1e-12));
    let mean = encoders.mean_axis(ndarray::Axis(0)).expect("rows");
    assert!(mean.iter().all(|x| x.abs() < 4.0 / 900f64.sqrt()), "{mean}");
}

#[test]
fn evaluation_points_lie_well_within_the_radius_too() {
    let points = built(Ensemble::new(8).radius(2.0).identity("x")).evaluation_points("x");
    let (points, _) = points.expect("points");
    assert_eq!(points.dim(), (1200, 8));
    let norms: Vec<f64> = points.rows().into_iter().map(|row| row.dot(&row).sqrt()).collect();
    assert!(norms.iter().all(|norm| *norm <= 2.0));
    // An eighth of them, 4 standard errors. Evenly in a ball of eight dimensions it would be 5 of 1,200.
    let inner = norms.iter().filter(|norm| **norm < 1.0).count();
    assert!((104..196).contains(&inner), "{inner}");
}

#[test]
fn hadamard_encoders_are_corners_of_a_cube_and_represent_values_as_uniform_ones_do() {
    let ensemble = |encoders| Ensemble::new(16).neurons(800).identity("x").encoders(encoders);
    let read = |encoders, seed| {
        let mut graph = GraphBuilder::new();
        let given = graph.add("given", Constant::vector(&[0.0; 32]));
        let a = graph.add("a", ensemble(encoders).copies(2));
        graph.connect(&given, &a.input, Synapse::None);
        let graph = graph.build(Timebase::default(), &lif(), Seed::new(seed)).expect("builds");
        let layer = BuiltLayer::of(&graph, "a").expect("neurons");
        [0, 1].map(|copy| layer.ensemble(copy).expect("two"))
    };
    let [first, second] = read(Encoders::hadamard(), 1);
    assert_eq!(first.encoders().dim(), (800, 16));
    assert!(first.encoders().iter().all(|x| x.abs() == 0.25));
    let mean = first.encoders().mean_axis(ndarray::Axis(0)).expect("rows");
    assert!(mean.iter().all(|x| x.abs() < 4.0 * 0.25 / 50f64.sqrt()), "{mean}");
    assert_ne!(first.encoders(), second.encoders());
    assert_eq!(first.encoders(), read(Encoders::hadamard(), 1)[0].encoders());
    assert_ne!(first.encoders(), read(Encoders::hadamard(), 2)[0].encoders());
    let [uniform, _] = read(Encoders::sphere(), 1);
    let [error, usual] = [first, uniform].map(|read| read.error("x").expect("decoded"));
    assert!((0.9..1.1).contains(&(error / usual)), "{error} {usual}");
    // What the neurons are stepped with is what decoders were solved for.
    let value: Vec<Real> = (0..16).map(|k| 0.2 * (k as Real).cos()).collect();
    let out = held(ensemble(Encoders::hadamard()), &value, "x", &lif());
    let off = out.iter().zip(&value).map(|(out, x)| (out - x).abs()).fold(0.0, Real::max);
    assert!(off < 0.05, "{off}");
    // A plan sets them, from 16 dimensions on.
    let plan = |encoders| {
        let tuning = Tuning { encoders, ..Tuning::default() };
        PopulationPlan::all(Population::Lif(LifSpec::tuned(tuning)))
    };
    for (dims, encoders, corners) in [
        (16, DrawnEncoders::Hadamard, true),
        (15, DrawnEncoders::Hadamard, false),
        (16, DrawnEncoders::Sphere, false),
    ] {
        let mut graph = GraphBuilder::new();
        let given = graph.add("given", Constant::vector(&vec![0.0; dims]));
        let a = graph.add("a", Ensemble::new(dims).neurons(50).identity("x"));
        graph.connect(&given, &a.input, Synapse::None);
        let graph = graph.build(Timebase::default(), &plan(encoders), Seed::new(1));
        let graph = graph.expect("builds");
        let read = BuiltLayer::of(&graph, "a").expect("neurons").ensemble(0).expect("one");
        let length = 1.0 / (dims as f64).sqrt();
        let all = read.encoders().iter().all(|x| (x.abs() - length).abs() < 1e-12);
        assert_eq!(all, corners, "{dims} {encoders:?}");
    }
    // In one dimension there are two corners; a transform has room for 128.
    let one = built(Ensemble::new(1).identity("x").encoders(Encoders::hadamard())).encoders();
    assert!(one.iter().any(|x| *x == 1.0) && one.iter().any(|x| *x == -1.0));
    let wide = Ensemble::new(129).identity("x").encoders(Encoders::hadamard());
    let mut graph = GraphBuilder::new();
    let given = graph.add("given", Constant::vector(&[0.0; 129]));
    let a = graph.add("a", wide);
    graph.connect(&given, &a.input, Synapse::None);
    let error = graph.build(Timebase::default(), &lif(), Seed::new(1)).expect_err("too wide");
    assert!(error.to_string().contains("Hadamard in 129 dimensions"), "{error}");
    assert!(error.to_string().contains("at most 128"), "{error}");
}

#[test]
fn copies_share_settings_or_have_their_own() {
    let ensemble = Ensemble::new(1).identity("x").copies(3);
    let each: Vec<f64> = (0..300).map(|n| if n < 100 { 100.0 } else { 150.0 }).collect();
    let graph = build(ensemble.clone().max_rates(Values::given(each)), &lif()).expect("builds");
    let layer = BuiltLayer::of(&graph, "a/neurons").expect("neurons");
    assert_eq!((layer.ensembles(), layer.populations()), (3, 1));
    for (copy, rate) in [(0, 100.0), (1, 150.0), (2, 150.0)] {
        let rates = layer.ensemble(copy).expect("three").max_rates();
        assert!(rates.iter().all(|m| (m - rate).abs() < 1e-6), "{copy}");
    }
    let same = ensemble.clone().max_rates(120.0).intercepts(Values::given([0.2; 100]));
    let graph = build(same, &lif()).expect("builds");
    let layer = BuiltLayer::of(&graph, "a").expect("neurons");
    assert!((0..3).all(|copy| {
        let read = layer.ensemble(copy).expect("three");
        read.intercepts().iter().all(|c| (c - 0.2).abs() < 1e-9)
    }));
    let missing = layer.ensemble(3).expect_err("three");
    assert_eq!(missing, ReadBackError::Ensemble { asked: 3, count: 3 });
}

#[test]
fn an_ensemble_without_settings_keeps_its_fingerprint_and_any_setting_changes_it() {
    let plain = || Ensemble::new(2).identity("x");
    let solved = SolvedModel::of(&build(plain(), &lif()).expect("builds"));
    let from = lif().solved(solved);
    assert!(build(plain(), &from).is_ok());
    let square = |x: &[Real], out: &mut [Real]| out.copy_from_slice(x);
    let settings: [Ensemble; 12] = [
        plain().encoders(Encoders::sphere()),
        plain().intercepts(0.5),
        plain().max_rates(Values::between(200.0, 400.0)),
        plain().gains_and_biases(vec![2.0; 200], vec![1.0; 200]),
        plain().evaluation_count(500),
        plain().evaluation_points([[0.0, 0.5], [0.5, 0.0]]),
        plain().model(SpikingRectifiedLinear),
        plain().start("voltages", Start::At(0.0)),
        plain().solver(L2::default()),
        Ensemble::new(2).decode_as("x", Target::function(2, square).solver(NoDecoders)),
        Ensemble::new(2)
            .decode_as("x", Target::function(2, square).evaluation_points([[0.1, 0.2]])),
        plain().intercepts(0.4),
    ];
    let mut all: Vec<SolvedModel> = Vec::new();
    for (index, ensemble) in settings.into_iter().enumerate() {
        let graph = build(ensemble.clone(), &lif()).expect("builds");
        let own = SolvedModel::of(&graph);
        assert!(build(ensemble.clone(), &lif().solved(own.clone())).is_ok(), "{index}");
        assert!(!all.contains(&own), "{index}");
        all.push(own);
        let error = build(ensemble, &from).expect_err("another population");
        assert!(error.contains("another seed"), "{index}: {error}");
    }
    assert_eq!(all.len(), 12);
}

#[test]
fn bad_settings_are_refused_with_what_is_expected() {
    let plain = || Ensemble::new(2).identity("x");
    let f = |x: &[Real], out: &mut [Real]| out[0] = x[0];
    let cases: Vec<(Ensemble, &[&str])> = vec![
        (plain().encoders(Encoders::given([[1.0, 0.0]])), &["`encoders` is 1 long", "200"]),
        (plain().encoders(Encoders::choice([[0.0, 0.0]])), &["[0.0, 0.0]", "not all of them 0"]),
        (plain().encoders(Encoders::choice([[1.0]])), &["[1.0]", "2 finite numbers"]),
        (plain().encoders(Encoders::choice([[f64::NAN, 1.0]])), &["NaN", "finite"]),
        (plain().encoders(Encoders::choice(Vec::<Vec<f64>>::new())), &["at least one row"]),
        (plain().encoders(Encoders::drawn(|_, row| row.fill(0.0))), &["not all of them 0"]),
        (plain().intercepts(1.0), &["`intercept` is 1", "below 1"]),
        (plain().intercepts(Values::between(0.5, 0.1)), &["`intercepts` is 0.5 to 0.1", "rising"]),
        (plain().intercepts(Values::given([0.1; 7])), &["`intercepts` is 7 long", "200"]),
        (plain().max_rates(Values::choice([])), &["`max_rates` is empty"]),
        (plain().max_rates(f64::NAN), &["`max_rates` is NaN"]),
        (plain().max_rates(501.0), &["`max_rate` is 501", "500 Hz"]),
        (plain().gains_and_biases([1.0], [1.0]), &["`gains_and_biases` is 1 long", "200"]),
        (plain().gains_and_biases([f64::INFINITY; 200], [1.0; 200]), &["is inf", "finite"]),
        (plain().gains_and_biases([1.0; 200], [2.0; 200]).intercepts(0.0), &["no intercepts"]),
        (plain().gains_and_biases([1.0; 200], [0.0; 200]), &["no neuron", "fires"]),
        (plain().evaluation_count(0), &["`evaluation_count` is 0"]),
        (plain().evaluation_points([[0.0]]), &["`evaluation_points` is [0.0]", "2 finite"]),
        (plain().evaluation_points(Vec::<Vec<f64>>::new()), &["0 rows"]),
        (plain().start("voltage", Start::At(0.0)), &["`voltage`", "voltages, refractory times"]),
        (plain().start("voltages", Start::At(Real::NAN)), &["`start` is NaN"]),
        (plain().solver(L2 { regularisation: -1.0 }), &["`regularisation` is -1"]),
        (plain().solver(LeastSquares { cutoff: f64::NAN }), &["`cutoff` is NaN"]),
        (plain().solver(Noisy::added(f64::INFINITY)), &["`noise` is inf"]),
        (plain().solver(L1 { sweeps: 0, ..L1::default() }), &["`sweeps` is 0"]),
        (plain().solver(L1 { l1: -1e-3, ..L1::default() }), &["`l1` is -0.001"]),
        (plain().solver(NonNegative { regularisation: f64::NAN }), &["`regularisation` is NaN"]),
        (plain().solver(Wrong), &["`wrong`", "(200, 2)"]),
        (plain().model(Sigmoid { tau_ref_s: 0.003 }), &["`max_rate` is", "333.3"]),
        (
            plain().decode_as("y", Target::samples([[0.0, 0.0]], [[1.0], [2.0]])),
            &["1 points and 2 values"],
        ),
        (plain().decode_as("y", Target::samples([[0.0]], [[1.0]])), &["`samples` is [0.0]"]),
        (
            plain().decode_as("y", Target::samples([[0.0, 0.0]], [[f64::NAN]])),
            &["`samples` is [NaN]"],
        ),
        (plain().decode_as("y", Target::function(0, f)), &["0"]),
        (Ensemble::new(0).identity("x"), &["0"]),
    ];
    let count = cases.len();
    for (ensemble, parts) in cases {
        let error = refused(ensemble);
        assert!(parts.iter().all(|part| error.contains(part)), "{parts:?}: {error}");
        assert!(error.contains("a/neurons"), "{error}");
    }
    assert_eq!(count, 34);
}

/// A solver that returns an array of another shape.
#[derive(Debug)]
struct Wrong;

impl Solver for Wrong {
    fn name(&self) -> &'static str {
        "wrong"
    }
    fn solve(
        &self,
        _rates: ArrayView2<'_, f64>,
        _targets: ArrayView2<'_, f64>,
        _seed: Seed,
    ) -> Result<Array2<f64>, TuningError> {
        Ok(Array2::zeros((1, 1)))
    }
    fn fingerprint(&self, _hash: &mut Fingerprint) {}
}

#[test]
fn intercepts_at_1_are_an_error_and_no_longer_build_a_dead_ensemble() {
    for intercepts in [[0.999_999, 0.999_999_9], [1.0, 1.0]] {
        let spec = LifSpec::tuned(Tuning { intercepts, ..Tuning::default() });
        let plan = PopulationPlan::all(Population::Lif(spec));
        let error = build(Ensemble::new(1).identity("x"), &plan).expect_err("refused");
        assert!(error.contains("fires") || error.contains("below 1"), "{error}");
        let own = Ensemble::new(1).identity("x").intercepts(intercepts[0]);
        let error = refused(own);
        assert!(error.contains("fires") || error.contains("below 1"), "{error}");
    }
    // The neighbour that must be let through: few neurons fire, but some do.
    assert!(build(Ensemble::new(1).identity("x").intercepts(0.97), &lif()).is_ok());
}

/// Builds a layer that maps one number.
fn mapped(function: fn(Real) -> Real) -> Result<Graph, String> {
    struct Mapped(fn(Real) -> Real);
    impl symbolt::sim::Module for Mapped {
        type Ports = Ports<Vector>;
        fn expand(self, scope: &mut symbolt::sim::Scope<'_>) -> Ports<Vector> {
            use symbolt::neurons::Layers;
            scope.map("neurons", Map::each(1, self.0))
        }
    }
    let mut graph = GraphBuilder::new();
    let given = graph.add("given", Constant::vector(&[0.0]));
    let mapped = graph.add("a", Mapped(function));
    graph.connect(&given, &mapped.input, Synapse::None);
    graph.build(Timebase::default(), &lif(), Seed::new(1)).map_err(|e| e.to_string())
}

#[test]
fn a_pole_within_the_radius_is_refused_wherever_it_lies() {
    let poles: [fn(Real) -> Real; 8] = [
        |x| 1.0 / x,
        |x| 1.0 / (x - 0.3),
        |x| 1.0 / (x * x),
        |x| 1.0 / ((x + 0.71) * (x + 0.71)),
        |x| (x * 3.0).tan(),
        |x| x.ln(),
        |x| 1.0 / (1.0 - x),
        |x| 1.0 / (0.512_34 - x).abs().sqrt(),
    ];
    for (index, function) in poles.into_iter().enumerate() {
        let decode = Ensemble::new(1).decode("y", 1, move |x, out| out[0] = function(x[0]));
        for error in [refused(decode), mapped(function).expect_err("refused")] {
            assert!(error.contains("`function` is"), "{index}: {error}");
        }
    }
    let wide = [
        Ensemble::new(2).decode("y", 1, |x, out| out[0] = x[0] / x[1]),
        Ensemble::new(3).decode("y", 1, |x, out| out[0] = 1.0 / (x[0] + x[1] - 0.25)),
        Ensemble::new(2).decode("y", 2, |x, out| out[1] = (x[0] * x[0] + x[1] * x[1]).ln()),
    ];
    for ensemble in wide {
        assert!(refused(ensemble).contains("`function` is"));
    }
}

#[test]
fn functions_that_are_steep_but_finite_are_let_through() {
    let finite: [fn(Real) -> Real; 10] = [
        |x| if x > 0.123 { 1.0 } else { -1.0 },
        |x| (1e6 * (x - 0.2)).tanh(),
        |x| if x > 0.9 { 1.0 } else { 0.0 },
        |x| (40.0 * x).sin(),
        |x| (-(x - 0.001) * (x - 0.001) * 1e6).exp(),
        |x| x * x * x,
        |_| 0.0,
        |x| x.abs().sqrt(),
        |x| 1.0 / (0.05 + x * x),
        |x| (8.0 * x).exp(),
    ];
    for (index, function) in finite.into_iter().enumerate() {
        let decode = Ensemble::new(1).decode("y", 1, move |x, out| out[0] = function(x[0]));
        assert!(build(decode, &lif()).is_ok(), "{index}");
        assert!(mapped(function).is_ok(), "{index}");
    }
    let product = Ensemble::new(2).decode("y", 1, |x, out| out[0] = x[0] * x[1]);
    assert!(build(product, &lif()).is_ok());
    // Points of one's own are checked alone.
    let inverse = |x: &[Real], out: &mut [Real]| out[0] = 1.0 / x[0];
    let points: Vec<[f64; 1]> = (1..=100).map(|i| [0.2 + 0.008 * f64::from(i)]).collect();
    let own = Ensemble::new(1).decode("y", 1, inverse).evaluation_points(points.clone());
    let out = held(own, &[0.5], "y", &lif());
    assert!((out[0] - 2.0).abs() < 0.15, "{out:?}");
    let target = Target::function(1, inverse).evaluation_points(points);
    let out = held(Ensemble::new(1).identity("x").decode_as("y", target), &[0.5], "y", &lif());
    assert!((out[0] - 2.0).abs() < 0.15, "{out:?}");
}

#[test]
fn every_model_represents_a_value_in_spikes_and_in_rates() {
    let models: Vec<(&str, Ensemble, Real)> = {
        let plain = || Ensemble::new(1).identity("x");
        let slow = || Values::between(60.0, 120.0);
        vec![
            (
                "adaptive",
                plain().model(AdaptiveLif { inc_n: 0.001, ..AdaptiveLif::default() }),
                0.1,
            ),
            ("izhikevich", plain().model(Izhikevich::default()).max_rates(slow()), 0.12),
            ("fast", plain().model(Izhikevich::fast_spiking()).max_rates(slow()), 0.12),
            ("rectified", plain().model(RectifiedLinear), 0.02),
            ("spiking rectified", plain().model(SpikingRectifiedLinear), 0.04),
            ("sigmoid", plain().model(Sigmoid::default()), 0.02),
            ("tanh", plain().model(Tanh::default()), 0.02),
            ("regular", plain().model(RegularSpiking::new(Tanh::default())), 0.04),
            ("stochastic", plain().model(StochasticSpiking::new(LifRate::default())), 0.1),
            ("poisson", plain().model(PoissonSpiking::new(LifRate::default())), 0.12),
            ("poisson sigmoid", plain().model(PoissonSpiking::new(Sigmoid::default())), 0.2),
        ]
    };
    for (name, ensemble, bound) in models {
        for value in [-0.7, 0.0, 0.6] {
            let spikes = held(ensemble.clone(), &[value], "x", &lif())[0];
            assert!((spikes - value).abs() < bound, "{name}: {spikes} of {value}");
            let rates = held(ensemble.clone(), &[value], "x", &rate())[0];
            let bound = if name == "adaptive" { 0.1 } else { 0.03 };
            assert!((rates - value).abs() < bound, "{name} in rates: {rates} of {value}");
            let exact = held(ensemble.clone(), &[value], "x", &PopulationPlan::direct())[0];
            assert!((exact - value).abs() < 1e-4, "{name}: {exact}");
        }
    }
}

#[test]
fn a_model_of_its_own_is_used_in_spikes_and_its_rates_in_rate_mode() {
    let ensemble = Ensemble::new(1).identity("x").model(AdaptiveLif::default());
    let of = |plan: &PopulationPlan| {
        let graph = build(ensemble.clone(), plan).expect("builds");
        let read = BuiltLayer::of(&graph, "a").expect("neurons").ensemble(0).expect("one");
        read.model().name()
    };
    assert_eq!(of(&lif()), "adaptive lif");
    assert_eq!(of(&rate()), "adaptive lif rate");
    assert_eq!(of(&PopulationPlan::all(Population::neurons(Tanh::default()))), "adaptive lif");
    let direct = build(ensemble, &PopulationPlan::direct()).expect("builds");
    let error = BuiltLayer::of(&direct, "a").expect_err("direct").to_string();
    assert!(error.contains("`a`"), "{error}");
}

#[test]
fn states_start_where_they_are_set() {
    // All neurons at the same voltage and bias fire in the same ticks: at a constant current of 2 from 0, in tick 14.
    let ensemble = Ensemble::new(1)
        .identity("x")
        .gains_and_biases([0.5; 100], [2.0; 100])
        .encoders(Encoders::given([[1.0]; 100]))
        .start("voltages", Start::At(0.0));
    let mut graph = GraphBuilder::new();
    let a = graph.add("a", ensemble);
    let given = graph.add("given", Constant::vector(&[0.0]));
    graph.connect(&given, &a.input, Synapse::None);
    assert_eq!(a.path(), "a/neurons");
    let spikes = graph.probe_spikes(a.path());
    let sim = graph.run(&lif(), Seed::new(1), SimDuration::from_millis(50)).expect("runs");
    let times: Vec<u64> =
        sim.spikes(&spikes).iter().map(|(time_s, _)| (time_s * 1e3).round() as u64).collect();
    assert_eq!(times.len(), 300);
    assert!(times.iter().all(|tick| [14, 30, 46].contains(tick)), "{times:?}");
}

#[test]
fn functions_as_data_are_decoded_and_looked_up_in_direct_mode() {
    let points: Vec<[f64; 1]> = (0..200).map(|i| [-1.0 + 0.01 * f64::from(i)]).collect();
    let values: Vec<[f64; 1]> = points.iter().map(|x| [x[0] * x[0]]).collect();
    let data = || Ensemble::new(1).decode_as("y", Target::samples(points.clone(), values.clone()));
    for (plan, bound) in [(lif(), 0.06), (rate(), 0.02), (PopulationPlan::direct(), 0.01)] {
        let out = held(data(), &[0.8], "y", &plan)[0];
        assert!((out - 0.64).abs() < bound, "{out}");
    }
    let (found, targets) = built(data()).evaluation_points("y").expect("there");
    assert!(found.iter().zip(&points).all(|(a, b)| (a - b[0]).abs() < 1e-12));
    assert_eq!(targets.len(), 200);
}

#[test]
fn stochastic_runs_have_the_same_bits_in_any_number_of_threads_and_after_a_reset_and_a_restore() {
    let describe = |plan: &PopulationPlan| {
        let mut graph = GraphBuilder::new();
        let given = graph.add("given", Constant::vector(&[0.3; 40]));
        let model = PoissonSpiking::new(LifRate::default());
        let a = graph.add("a", Ensemble::new(1).identity("x").copies(40).model(model));
        graph.connect(&given, &a.input, Synapse::None);
        let probe =
            graph.probe(&a.output("x"), ProbeSpec::default().filtered(Synapse::lowpass_ms(1)));
        let graph = graph.build(Timebase::default(), plan, Seed::new(1)).expect("builds");
        (graph, probe)
    };
    let run = |config: RunConfig| {
        let (graph, probe) = describe(&lif());
        let mut sim = Simulator::new(graph.into(), config).expect("starts");
        let all = |sim: &Simulator| -> Vec<u32> {
            sim.samples(&probe)
                .iter()
                .flat_map(|(_, row)| row.iter().map(|x| x.to_bits()))
                .collect()
        };
        sim.run_for(SimDuration::from_millis(40)).expect("runs");
        let saved = sim.checkpoint().expect("sound");
        sim.run_for(SimDuration::from_millis(40)).expect("runs");
        let (first, last) = (all(&sim), sim.checkpoint().expect("sound"));
        sim.restore(&saved).expect("fits");
        sim.run_for(SimDuration::from_millis(40)).expect("runs");
        assert!(sim.checkpoint().expect("sound") == last);
        sim.reset().expect("resets");
        sim.run_for(SimDuration::from_millis(80)).expect("runs");
        assert!(all(&sim) == first);
        first
    };
    let one = run(RunConfig::default());
    assert!(one.iter().any(|bits| *bits != 0));
    assert!(run(RunConfig::default().with_threads(Threads::Exactly(3))) == one);
    // Two ranks: threads stand for processes.
    let ranked: Vec<Vec<u32>> = std::thread::scope(|scope| {
        let of = |ranks: Ranks| {
            let (graph, probe) = describe(&lif().shared(&ranks));
            assert!(own_neurons(&graph) < 4_000);
            let mut sim = Simulator::new(graph.into(), RunConfig::default()).expect("starts");
            sim.run_for(SimDuration::from_millis(80)).expect("runs");
            sim.samples(&probe)
                .iter()
                .flat_map(|(_, row)| row.iter().map(|x| x.to_bits()))
                .collect()
        };
        let threads: Vec<_> =
            Ranks::in_process(2).into_iter().map(|ranks| scope.spawn(move || of(ranks))).collect();
        threads.into_iter().map(|thread| thread.join().expect("runs")).collect()
    });
    assert!(ranked[0] == one && ranked[1] == one);
    // Another run seed draws other spikes; the neurons are the same.
    assert!(run(RunConfig::seeded(Seed::new(77))) != one);
}

/// Returns the error of a product, without noise, over the evaluation points of an ensemble of so many dimensions.
fn error_of_a_product(ensemble: Ensemble, dims: usize, seed: u64) -> f64 {
    let mut graph = GraphBuilder::new();
    let given = graph.add("given", Constant::vector(&[0.0; 3][..dims]));
    let a = graph.add("a", ensemble.decode("product", 1, |x, out| out[0] = x[0] * x[1]));
    graph.connect(&given, &a.input, Synapse::None);
    let graph = graph.build(Timebase::default(), &lif(), Seed::new(seed)).expect("builds");
    let built = BuiltLayer::of(&graph, "a").and_then(|layer| layer.ensemble(0)).expect("built");
    built.error("product").expect("decoded")
}

#[test]
fn even_neurons_decode_products_better_than_drawn_ones() {
    for (dims, neurons) in [2, 3].into_iter().flat_map(|dims| [100, 300, 1_000].map(|n| (dims, n)))
    {
        let even = Ensemble::new(dims).neurons(neurons);
        let uniform = Values::drawn(|rng| -1.0 + 1.9 * rng.random::<f64>());
        let drawn = even.clone().encoders(Encoders::sphere()).intercepts(uniform);
        let [even, drawn] = [even, drawn].map(|ensemble| {
            (1..=4).map(|seed| error_of_a_product(ensemble.clone(), dims, seed)).sum::<f64>() / 4.0
        });
        println!("{dims} dimensions, {neurons} neurons: {even:.4} even, {drawn:.4} drawn");
        let most = if neurons == 100 { 1.0 } else { 0.9 };
        assert!(even < most * drawn, "{dims} {neurons}: {even} {drawn}");
    }
}

#[test]
fn functions_that_return_arrays_are_those_that_write() {
    let base = Ensemble::new(2).neurons(60);
    let returned = base.clone().function("f", |x| [x[1], x[0] * x[1]]);
    let written = base.decode("f", 2, |x, out| (out[0], out[1]) = (x[1], x[0] * x[1]));
    let decoders = [returned, written].map(|ensemble| {
        let graph = build(ensemble, &lif()).expect("builds");
        let built = BuiltLayer::of(&graph, "a").and_then(|layer| layer.ensemble(0)).expect("built");
        built.decoders("f").expect("decoded")
    });
    assert_eq!(decoders[0].dim(), (60, 2));
    assert_eq!(decoders[0], decoders[1]);
}
