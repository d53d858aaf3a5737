//! What strangers met that did not work, each by its symptom.

use rand::RngExt;
use symbolt::neurons::{
    Block, BuiltLayer, Encoders, Ensemble, Firing, Izhikevich, Learned, Lif, NeuronModel,
    NonNegative, Pes, PoissonSpiking, Population, PopulationPlan, RateOf, RegularSpiking, Rls,
    SelectRule, Start, StochasticSpiking, Values, Variable, Voja, Weights,
};
use symbolt::prelude::*;
use symbolt::sim::{BuildError, BuildErrors, Fingerprint, Module};
use symbolt::spa::{BasalGanglia, GatedMemory, Integrator, Oscillator, Route, Selection, Weigh};

fn lif() -> PopulationPlan {
    PopulationPlan::lif()
}

/// Neurons without a bias: no value within the radius makes them fire, and currents do.
fn unbiased(count: usize) -> Ensemble {
    Ensemble::new(1).neurons(count).gains_and_biases(vec![1.0; count], vec![0.0; count])
}

#[test]
fn bare_neurons_that_no_value_makes_fire_are_built() {
    let mut graph = GraphBuilder::new();
    let given = graph.add("given", Constant::vector(&[2.0; 5]));
    let bare = graph.add("bare", unbiased(5).expose_neurons());
    graph.route(&given >> &bare.currents());
    let spikes = graph.probe_spikes("bare");
    let sim = graph.run(&lif(), Seed::new(1), SimDuration::from_secs(1)).expect("runs");
    let count = sim.spikes(&spikes).iter().count();
    let expected = 5.0 * Lif::default().rate(2.0);
    assert!((count as f64 - expected).abs() <= 5.0, "{count} {expected}");
    // The wrong variant: a value is to be decoded from neurons that do not fire.
    let decoded = graph.add("decoded", unbiased(5).expose_neurons().identity("x"));
    graph.route(&given >> &decoded.currents());
    let error =
        graph.run(&lif(), Seed::new(1), SimDuration::from_millis(1)).err().expect("refused");
    assert!(error.to_string().contains("no neuron of an ensemble fires"), "{error}");
}

#[test]
fn a_function_that_is_0_has_decoders_of_0() {
    let mut graph = GraphBuilder::new();
    let given = graph.add("given", Constant::vector(&[0.5]));
    let both = Ensemble::new(1).neurons(40).identity("x").decode("zero", 1, |_, out| out[0] = 0.0);
    let zero = Ensemble::new(1).neurons(40).decode("zero", 1, |_, out| out[0] = 0.0);
    for (name, ensemble) in
        [("both", both), ("zero", zero.clone()), ("solved", zero.solver(NonNegative::default()))]
    {
        let ensemble = graph.add(name, ensemble);
        graph.route(&given >> &ensemble.input);
    }
    let graph = graph.build(Timebase::default(), &lif(), Seed::new(1)).expect("builds");
    for name in ["both", "zero", "solved"] {
        let built =
            BuiltLayer::of(&graph, name).and_then(|layer| layer.ensemble(0)).expect("built");
        assert!(built.decoders("zero").expect("decoded").iter().all(|decoder| *decoder == 0.0));
        assert_eq!(built.error("zero"), Ok(0.0), "{name}");
    }
    let both = BuiltLayer::of(&graph, "both").and_then(|layer| layer.ensemble(0)).expect("built");
    assert!(both.error("x").expect("decoded") < 0.05);
}

#[test]
fn encoded_values_keep_the_sign_of_gains_and_do_not_count_the_length_of_encoders_twice() {
    let gains: Vec<f64> = (0..40).map(|i| if i % 3 == 0 { -1.5 } else { 2.0 }).collect();
    let cells = || {
        let cells = Ensemble::new(1).neurons(40).gains_and_biases(gains.clone(), vec![1.5; 40]);
        let encoders = Encoders::choice([[3.0]]).unscaled();
        cells.encoders(encoders).expose_neurons().identity("x")
    };
    let mut graph = GraphBuilder::new();
    let value = graph.add("value", Constant::scalar(0.1));
    let [by_value, by_encoded] = ["by-value", "by-encoded"].map(|name| graph.add(name, cells()));
    graph.route(&value >> &by_value.input);
    // What encoders make of the value.
    graph.route(value.transform([[3.0]; 40]) >> &by_encoded.encoded());
    let plan = PopulationPlan::rate();
    let sim = graph.run(&plan, Seed::new(1), SimDuration::from_millis(2)).expect("runs");
    let rates = [by_value, by_encoded].map(|cells| sim.value(&cells.neurons()).to_vec());
    assert_eq!(rates[0].len(), 40);
    assert!(rates[0].iter().any(|hz| *hz > 10.0) && rates[0][0] != rates[0][1]);
    for (a, b) in rates[0].iter().zip(&rates[1]) {
        assert!((a - b).abs() <= 1e-3 * a.abs(), "{a} {b}");
    }
}

#[test]
fn names_for_people_that_cannot_be_shown_are_refused_with_the_path() {
    let refused = |path: &str, name: &str, meaning: &str| {
        let mut graph = GraphBuilder::new();
        graph.add("one", Constant::scalar(1.0));
        graph.describe(path, name, meaning);
        graph.start(&PopulationPlan::direct(), Seed::new(1)).err().map(|error| error.to_string())
    };
    assert_eq!(refused("one", "the unit", "Is always 1."), None);
    for (path, name, meaning, said) in [
        ("oen", "the unit", "", "`oen`: is described and not there; the nearest are: one"),
        ("one", " ", "", "`one`: its name for people is empty"),
        (
            "one",
            "a\u{1b}[31m",
            "",
            "`one`: its name for people or its meaning has control characters",
        ),
        (
            "one",
            "a",
            "\u{202e}",
            "`one`: its name for people or its meaning has control characters",
        ),
    ] {
        let error = refused(path, name, meaning).expect("refused");
        assert!(error.contains(said), "{error}");
    }
}

#[test]
fn a_wrong_setting_is_told_once_without_faults_that_follow_from_it() {
    fn ensemble(ensemble: Ensemble) -> GraphBuilder {
        let mut graph = GraphBuilder::new();
        let given = graph.add("given", Constant::vector(&[0.5]));
        let a = graph.add("wrong", ensemble.identity("x"));
        let b = graph.add("b", Ensemble::new(1).identity("x"));
        graph.route(&given >> &a.input);
        graph.route(&a.output("x") >> &b.input);
        graph
    }
    fn learned(teach: impl FnOnce(&mut GraphBuilder)) -> GraphBuilder {
        let mut graph = GraphBuilder::new();
        teach(&mut graph);
        graph
    }
    fn stimulus(each: u64, rows: &[[f32; 1]]) -> GraphBuilder {
        let mut graph = GraphBuilder::new();
        let rows = Stimulus::vectors(rows, SimDuration::from_millis(each));
        let given = graph.add("wrong", rows);
        let a = graph.add("a", Ensemble::new(1).identity("x"));
        graph.route(&given >> &a.input);
        graph
    }
    fn stimulated(steps: &[(u64, f32)]) -> GraphBuilder {
        let mut graph = GraphBuilder::new();
        let given = graph.add("wrong", Stimulus::steps_ms(steps.iter().copied()));
        let a = graph.add("a", Ensemble::new(1).identity("x"));
        graph.route(&given >> &a.input);
        graph
    }
    let pes = learned(|graph| {
        let pre = graph.add("pre", Constant::vector(&[100.0, 50.0]));
        let error = graph.add("error", Constant::vector(&[1.0, -1.0]));
        let learned = graph.add("wrong", Learned::new(&pre, 2).rule(Pes::new(f64::NAN)));
        graph.route(&error >> &learned.error());
    });
    let rls = learned(|graph| {
        let pre = graph.add("pre", Constant::vector(&[100.0, 50.0]));
        let target = graph.add("target", Constant::vector(&[1.0, -1.0]));
        let rule = Rls::new(f64::INFINITY).toward_target();
        let learned = graph.add("wrong", Learned::new(&pre, 2).rule(rule));
        graph.route(&target >> &learned.target());
    });
    let square = Ensemble::new(1).decode("square", 1, |x, out| out[0] = x[0] * x[0]);
    let faults = |graph: &GraphBuilder, plan: &PopulationPlan| match graph.build(
        Timebase::default(),
        plan,
        Seed::new(1),
    ) {
        Ok(_) => Vec::new(),
        Err(BuildErrors(faults)) => faults,
    };
    fn module(module: impl Module) -> GraphBuilder {
        let mut graph = GraphBuilder::new();
        graph.add("wrong", module);
        graph
    }
    let rule = SelectRule::WinnerTakeAll { level: 0.3 };
    for (graph, said) in [
        (module(BasalGanglia::new(0)), "0 actions; expected at least one"),
        (module(Selection::new(0, rule)), "0 items; expected at least one"),
        (module(GatedMemory::vector(0)), "0 components; expected at least one"),
        (module(Integrator::vector(0)), "0 components; expected at least one"),
        (module(Weigh::vector(0)), "0 components; expected at least one"),
        (module(GatedMemory::scalar().radius(-1.0)), "the radius is -1; expected a finite number"),
        (module(Oscillator::new(20.0)), "the frequency is 20 Hz; expected -8 to 8"),
        (stimulated(&[(0, 1.0), (0, 2.0)]), "the times of a stimulus must increase"),
        (pes, "NaN"),
        (rls, "inf"),
        (stimulus(10, &[]), "no values; give at least one"),
        (stimulus(0, &[[1.0], [2.0]]), "the times of a stimulus must increase"),
        (ensemble(Ensemble::new(0)), "0 dimensions; expected at least 1"),
        (ensemble(Ensemble::new(1).copies(0)), "0 copies; expected at least 1"),
    ] {
        for plan in [PopulationPlan::direct(), lif()] {
            let faults = faults(&graph, &plan);
            let messages: Vec<String> = faults.iter().map(ToString::to_string).collect();
            assert!(messages.len() == 1 && messages[0].contains(said), "{said}: {messages:?}");
            assert!(messages[0].contains("`wrong"), "{messages:?}");
        }
    }
    // Direct mode limits the value, and has no decoders that could be infinite.
    let found = faults(&ensemble(square.radius(1e38)), &lif());
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].to_string().contains("radius"), "{found:?}");
    // The wrong variant: two faults that do not follow from each other are both told.
    let mut graph = ensemble(Ensemble::new(0));
    let apart = graph.add("apart", Ensemble::new(1).identity("x"));
    let two = graph.add("two", Constant::vector(&[1.0, 2.0]));
    graph.route(&two >> &apart.input);
    let found = faults(&graph, &lif());
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(found.iter().any(|fault| matches!(fault, BuildError::WidthMismatch { .. })));
}

#[test]
fn no_synapse_from_an_ensemble_is_refused_and_not_replaced() {
    let built = |route: &dyn Fn(Route) -> Route| {
        let mut graph = GraphBuilder::new();
        let a = graph.add("a", Ensemble::new(1).identity("x"));
        let b = graph.add("b", Ensemble::new(1).identity("x"));
        graph.route(route(&a.output("x") >> &a));
        graph.route(&a.output("x") >> &b);
        graph.build(Timebase::default(), &lif(), Seed::new(1)).map(|_| ())
    };
    built(&|route| route).expect("5 ms");
    built(&|route| route.via(Synapse::lowpass_ms(100))).expect("100 ms");
    let BuildErrors(faults) = built(&|route| route.via(Synapse::None)).expect_err("refused");
    assert!(matches!(&faults[..], [BuildError::Unfiltered { .. }]), "{faults:?}");
    // Sums of a filtered and a bare output, too.
    let mut graph = GraphBuilder::new();
    let given = graph.add("given", Constant::vector(&[0.5]));
    let a = graph.add("a", Ensemble::new(1).identity("x"));
    graph.route((&a.output("x") + 0.1 * &given >> &a).via(Synapse::None));
    assert!(graph.build(Timebase::default(), &lif(), Seed::new(1)).is_err());
}

#[test]
fn ports_of_neurons_that_are_not_exposed_name_the_setting_that_adds_them() {
    for exposed in [true, false] {
        let mut graph = GraphBuilder::new();
        let ensemble = Ensemble::new(1).neurons(20).identity("x");
        let ensemble = if exposed { ensemble.expose_neurons() } else { ensemble };
        let given = graph.add("given", Constant::vector(&[0.5; 20]));
        let a = graph.add("a", ensemble);
        graph.route(&given >> &a.encoded());
        let value = graph.add("value", Constant::vector(&[0.5]));
        graph.route(&value >> &a.input);
        let built = graph.build(Timebase::default(), &lif(), Seed::new(1)).map(|_| ());
        match built {
            Ok(()) => assert!(exposed),
            Err(faults) => {
                let said = faults.to_string();
                assert!(!exposed && said.contains("`encoded`"), "{said}");
                assert!(said.contains("`encoded: vector (with expose_neurons)`"), "{said}");
            }
        }
    }
}

#[test]
fn encoders_to_learn_from_leave_no_gap_for_the_key_that_comes_last() {
    let widest = |rows: Weights| {
        let mut graph = GraphBuilder::new();
        let key = graph.add("key", Constant::vector(&[1.0, 0.0]));
        let cells = graph.add("cells", Ensemble::new(1).neurons(50).expose_neurons());
        let encoders = Learned::encoders(2, &cells.neurons()).weights(rows);
        let encoders = graph.add("encoders", encoders.rule(Voja::new(0.0)));
        graph.route(&key >> &encoders.input());
        graph.route(&encoders >> &cells.encoded());
        let sim = graph.start(&lif(), Seed::new(1)).expect("builds");
        let mut angles: Vec<f64> =
            encoders.weights(&sim).rows().into_iter().map(|row| row[1].atan2(row[0])).collect();
        angles.sort_by(f64::total_cmp);
        angles.push(angles[0] + std::f64::consts::TAU);
        assert_eq!(angles.len(), 51);
        angles.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max)
    };
    let mean = std::f64::consts::TAU / 50.0;
    for seed in 1..=5 {
        assert!(widest(Weights::directions(Seed::new(seed))) < 2.0 * mean);
    }
    // The wrong variant: independent draws, whose widest gap is about the logarithm of 50 times the mean.
    let mut rng = Seed::new(1).rng();
    let drawn = Weights::rows((0..50).map(|_| {
        let angle: f64 = rng.random_range(0.0..std::f64::consts::TAU);
        [angle.cos(), angle.sin()]
    }));
    assert!(widest(drawn) > 2.0 * mean);
}

#[test]
fn few_dimensional_hadamard_ensembles_decode_with_all_their_neurons() {
    // Neurons beyond the last whole group of eight were left out.
    for (dims, neurons) in [(2, 220), (2, 101), (3, 101), (4, 101), (5, 101), (16, 101)] {
        let place =
            [0.6, 0.5, 0.1, -0.2, 0.1, 0.0, 0.1, 0.0, 0.1, 0.0, 0.1, 0.0, 0.1, 0.0, 0.1, 0.0];
        let place = &place[..dims];
        let mut graph = GraphBuilder::new();
        let given = graph.add("given", Constant::vector(place));
        let a = Ensemble::new(dims).neurons(neurons).encoders(Encoders::hadamard());
        let a = graph.add("a", a.function("product", |x| x[0] * x[1]));
        graph.route(&given >> &a.input);
        let probe = ProbeSpec::default().filtered(Synapse::lowpass_ms(1));
        let probe = graph.probe(&a.output("product"), probe);
        let built = graph.build(Timebase::default(), &PopulationPlan::rate(), Seed::new(1));
        let built =
            BuiltLayer::of(&built.expect("builds"), "a").and_then(|layer| layer.ensemble(0));
        let built = built.expect("built");
        let points: Vec<f64> = place.iter().map(|x| f64::from(*x)).collect();
        let points = ndarray::Array2::from_shape_vec((1, dims), points).expect("one row");
        let rates = built.tuning_curves(points.view()).expect("rates");
        let decoded = rates.dot(&built.decoders("product").expect("decoded"))[[0, 0]];
        let sim = graph.run(&PopulationPlan::rate(), Seed::new(1), SimDuration::from_millis(50));
        let sim = sim.expect("runs");
        let (_, ran) = sim.samples(&probe).iter().last().expect("a sample");
        assert!((f64::from(ran[0]) - decoded).abs() < 1e-3, "{dims} {neurons}: {ran:?} {decoded}");
        assert!(decoded.abs() > 0.01, "{decoded}");
    }
}

#[test]
fn rates_of_izhikevich_neurons_are_those_counted_and_are_not_counted_in_each_tick() {
    let mut graph = GraphBuilder::new();
    let given = graph.add("given", Stimulus::steps_ms([(0, -0.8), (1, 0.1), (2, 0.9)]));
    let cells = Ensemble::new(1).neurons(50).max_rates(Values::between(60.0, 200.0));
    let cells = cells.model(RateOf::new(Izhikevich::default())).expose_neurons();
    let cells = graph.add("cells", cells);
    graph.route(&given >> &cells.input);
    let mut sim = graph.start(&lif(), Seed::new(1)).expect("builds");
    let built = graph.build(Timebase::default(), &lif(), Seed::new(1)).expect("builds");
    let built = BuiltLayer::of(&built, "cells").and_then(|layer| layer.ensemble(0)).expect("built");
    let mut firing = 0;
    for value in [-0.8, 0.1, 0.9] {
        sim.run_for(SimDuration::from_millis(1)).expect("runs");
        let counted = built.tuning_curves(ndarray::array![[value]].view()).expect("rates");
        let ran = sim.value(&cells.neurons());
        assert_eq!(ran.len(), 50);
        for (ran, counted) in ran.iter().zip(counted.row(0)) {
            // Counts of a second are whole numbers, between which the table is linear.
            assert!((f64::from(*ran) - counted).abs() <= 1.5, "{value}: {ran} {counted}");
            firing += usize::from(*counted > 5.0);
        }
    }
    assert!(firing > 40, "{firing}");
    // Ten seconds of them; counted, each tick would take a thousand steps of every neuron.
    sim.run_for(SimDuration::from_secs(10)).expect("runs");
}

#[test]
fn spikes_that_would_not_fit_into_ticks_are_refused_and_rates_are_not() {
    let mut graph = GraphBuilder::new();
    let given = graph.add("given", Constant::vector(&[0.9]));
    let cells = graph.add("cells", Ensemble::new(1).identity("x"));
    graph.route(&given >> &cells.input);
    let built = |us, plan: &PopulationPlan| {
        let time = Timebase::new(SimDuration::from_micros(us)).expect("a tick");
        graph.build(time, plan, Seed::new(1)).map(|_| ()).map_err(|faults| faults.to_string())
    };
    // At 5 ms a neuron shows at most 200 Hz; 0.9 would be decoded as 0.6.
    let said = built(5_000, &lif()).expect_err("refused");
    assert!(said.contains("`tick` is 0.005 s; expected at most 0.0025 s"), "{said}");
    assert_eq!(built(2_500, &lif()), Ok(()));
    assert_eq!(built(5_000, &PopulationPlan::rate()), Ok(()));
    let regular = PopulationPlan::all(Population::neurons(RegularSpiking::new(Lif::default())));
    assert_eq!(built(5_000, &regular), Ok(()));
}

#[test]
fn spikes_at_the_rates_of_izhikevich_neurons_do_not_count_them_in_each_tick() {
    fn ran(model: impl NeuronModel + Clone) -> (usize, f32) {
        let mut graph = GraphBuilder::new();
        let given = graph.add("given", Constant::vector(&[0.9]));
        let cells = Ensemble::new(1).neurons(50).max_rates(Values::between(60.0, 200.0));
        let cells = graph.add("cells", cells.model(model).expose_neurons());
        graph.route(&given >> &cells.input);
        let probe = graph.probe(&cells.neurons(), ProbeSpec::default());
        // Ten seconds; counted, each tick would take a thousand steps of every neuron.
        let sim = graph.run(&lif(), Seed::new(1), SimDuration::from_secs(10)).expect("runs");
        let all = sim.samples(&probe);
        let sum: f32 = all.iter().flat_map(|(_, hz)| hz.iter().copied()).sum();
        (all.len(), sum / (all.len() * 50) as f32)
    }
    let rates = ran(RateOf::new(Izhikevich::default()));
    assert!(rates.0 == 10_000 && rates.1 > 20.0, "{rates:?}");
    for (ticks, hz) in [
        ran(RegularSpiking::new(Izhikevich::default())),
        ran(PoissonSpiking::new(Izhikevich::default())),
        ran(StochasticSpiking::new(Izhikevich::default())),
    ] {
        assert_eq!(ticks, 10_000);
        assert!((hz / rates.1 - 1.0).abs() < 0.02, "{hz} {}", rates.1);
    }
}

/// A model of one's own that declares what `declared` says.
#[derive(Debug, Clone)]
struct Own {
    state: Vec<Variable>,
    trace: usize,
}

impl NeuronModel for Own {
    fn name(&self) -> &'static str {
        "own"
    }

    fn rates(&self, currents: &mut [f64]) {
        currents.iter_mut().for_each(|current| *current = 100.0 * current.max(0.0));
    }

    fn firing(&self) -> Firing {
        Firing::Spikes { trace: self.trace, above: 0.0 }
    }

    fn state(&self) -> Vec<Variable> {
        self.state.clone()
    }

    fn step(&self, block: Block<'_>) {
        block.activity.fill(0.0);
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text(self.name());
    }
}

#[test]
fn a_model_of_ones_own_whose_state_has_no_start_or_no_trace_is_refused() {
    let of = |name, start| Variable { name, start };
    let refused = |state: &[Variable], trace| {
        let mut graph = GraphBuilder::new();
        let own = Own { state: state.to_vec(), trace };
        let given = graph.add("given", Constant::vector(&[0.5]));
        let cells = graph.add("cells", Ensemble::new(1).model(own).identity("x"));
        graph.route(&given >> &cells.input);
        graph.probe_spikes("cells");
        let built = graph.build(Timebase::default(), &lif(), Seed::new(1));
        built.map(|_| ()).map_err(|faults| faults.to_string())
    };
    let at = Start::At;
    assert_eq!(refused(&[of("v", at(0.0)), of("u", Start::Between(0.0, 1.0))], 1), Ok(()));
    for (state, trace, said) in [
        (vec![of("v", at(f32::NAN))], 0, "a finite start of `v`"),
        (vec![of("v", Start::Between(1.0, 0.0))], 0, "the lower number first"),
        (vec![of("v", at(0.0)), of("v", at(0.0))], 0, "variables of different names"),
        (vec![of("v", at(0.0))], 99, "the index of one of the 1 variables of the state"),
        (vec![], 0, "the index of one of the 0 variables of the state"),
    ] {
        let faults = refused(&state, trace).expect_err("refused");
        assert!(faults.contains(said), "{faults}");
    }
}
