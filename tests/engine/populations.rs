//! Graphs in neurons: quality, ablation, checkpoints, threads, invalid settings, and the planner.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::sync::Arc;

use symbolt::neurons::{
    Ensemble, GatePorts, Layers, Lif, LifSpec, Map, NeuronSpec, Population, PopulationPlan,
    Represent, SelectRule, SolvedModel, Tuning,
};
use symbolt::sim::Ports;
use symbolt::sim::{
    Constant, GraphBuilder, InputSpec, Module, OutputSpec, Pointer, ProbeId, ProbeSpec, Real,
    RunConfig, Scope, Seed, SimDuration, Simulator, Stimulus, Synapse, Threads, Timebase, Vector,
};
use symbolt::spa::{
    BasalGanglia, Bind, CleanupMemory, GoalBuffer, State, cosine_of_slices as cosine,
};
use symbolt::study::standard::{Model, Standard};
use symbolt::task::planner::{Planner, PlannerSpec, Unbinding};
use symbolt::task::{Domain, DomainBuilder, WorldState, acceptable_answers};

use crate::rectified::Rectified;
use crate::things::{Things, lif, rate, vocabulary};

type Probes = [ProbeId<Pointer<Things>>; 2];

/// Builds a graph that binds A and B and, in another module, cleans up a noisy C.
fn two_modules(plan: &PopulationPlan) -> (Simulator, Probes) {
    let parts = vocabulary(64);
    let mut graph = GraphBuilder::new();
    let bind = graph.add("bind", Bind::new(&parts));
    for (name, port) in [("A", &bind.a), ("B", &bind.b)] {
        let value = parts.get(name).expect("there");
        let given = graph.add(name, Constant::pointer(parts.space(), &value));
        graph.connect(&given, port, Synapse::None);
    }
    let rule = SelectRule::WinnerTakeAll { level: 0.5 };
    let memory = CleanupMemory::new(&parts, ["A", "B", "C"], rule).expect("sound");
    let memory = graph.add("memory", memory);
    let mixed = parts.parse("0.9 * C + 0.3 * A").expect("sound");
    let given = graph.add("mixed", Constant::pointer(parts.space(), &mixed));
    graph.connect(&given, &memory.input, Synapse::None);
    let spec = ProbeSpec::default().filtered(Synapse::lowpass_ms(10));
    let probes = [graph.probe(&bind.output, spec), graph.probe(&memory.output, spec)];
    let graph = graph.build(Timebase::default(), plan, Seed::new(1)).expect("builds");
    (Simulator::new(Arc::new(graph), RunConfig::default()).expect("starts"), probes)
}

fn run(sim: &mut Simulator, ms: u64) {
    sim.run_for(SimDuration::from_millis(ms)).expect("runs");
}

fn all(sim: &Simulator, probe: &ProbeId<Pointer<Things>>) -> Vec<Vec<Real>> {
    sim.samples(probe).iter().map(|(_, v)| v.to_vec()).collect()
}

#[test]
fn binding_and_cleanup_in_neurons_agree_with_exact_computation() {
    let parts = vocabulary(64);
    let bound = parts.parse("A * B").expect("sound");
    let clean = parts.get("C").expect("there").to_vec();
    for (plan, least) in [(lif(), 0.97), (rate(), 0.98)] {
        let (mut sim, probes) = two_modules(&plan);
        run(&mut sim, 300);
        let last = |probe: &ProbeId<Pointer<Things>>| {
            sim.samples(probe).last().expect("recorded").1.to_vec()
        };
        let (bind, memory) = (last(&probes[0]), last(&probes[1]));
        assert!(cosine(&bind, &bound) > least, "{}", cosine(&bind, &bound));
        assert!(cosine(&memory, &clean) > 0.999, "{}", cosine(&memory, &clean));
        let length = memory.iter().map(|v| v * v).sum::<Real>().sqrt();
        assert!((length - 1.0).abs() < 0.15, "{length}");
    }
}

#[test]
fn an_ablation_changes_the_module_that_it_names_and_no_other() {
    let (mut whole, probes) = two_modules(&lif());
    run(&mut whole, 100);
    let exact = "bind/**".parse().expect("a pattern");
    let (mut part, same) = two_modules(&lif().with(exact, Population::Direct));
    run(&mut part, 100);
    assert_eq!(all(&whole, &probes[1]), all(&part, &same[1]));
    assert_ne!(all(&whole, &probes[0]), all(&part, &same[0]));
    let parts = vocabulary(64);
    let bound = parts.parse("A * B").expect("sound");
    let (_, last) = part.samples(&same[0]).last().expect("recorded");
    assert!(cosine(&last, &bound) > 0.9999, "the ablated module is exact");
}

#[test]
fn a_run_resumed_from_a_checkpoint_between_spikes_has_the_same_bits() {
    let (mut whole, probes) = two_modules(&lif());
    run(&mut whole, 37);
    let middle = whole.checkpoint().expect("it can be saved");
    whole.clear_recordings();
    run(&mut whole, 50);
    let expected = all(&whole, &probes[0]);
    assert_eq!(expected.len(), 50);
    assert!(expected.iter().any(|v| v.iter().any(|x| *x != 0.0)));
    let (mut other, same) = two_modules(&lif());
    other.restore(&middle).expect("it fits");
    run(&mut other, 50);
    assert_eq!(all(&other, &same[0]), expected);
}

#[test]
fn two_threads_give_the_bits_of_one() {
    let run = |setting: Threads| {
        // 2 x 4 x 33 ensembles of 100 neurons are enough for threads to share a tick.
        let (sim, probes) = two_modules(&lif());
        let config = RunConfig::default().with_threads(setting);
        let mut sim = Simulator::new(sim.graph().clone(), config).expect("starts");
        run(&mut sim, 60);
        [all(&sim, &probes[0]), all(&sim, &probes[1])]
    };
    let serial = run(Threads::Serial);
    assert!(serial[0].iter().flatten().any(|v| *v != 0.0));
    assert_eq!(serial, run(Threads::Auto));
    for threads in [1, 2, 5] {
        assert_eq!(serial, run(Threads::Exactly(threads)), "{threads} threads");
    }
    // In a pool, whose caller shares the cores already.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("a pool");
    assert_eq!(serial, pool.install(|| run(Threads::Auto)));
}

#[test]
fn a_pointer_is_taken_up_and_held_by_a_recurrent_synapse() {
    let parts = vocabulary(128);
    let value = parts.get("A").expect("there");
    let mut graph = GraphBuilder::new();
    let given = Stimulus::pointer(parts.space(), &value).silent_from(SimDuration::from_millis(100));
    let given = graph.add("given", given);
    let state = graph.add("state", State::new(&parts).recurrent(Synapse::lowpass_ms(100)));
    graph.connect(&given, &state.input, Synapse::None);
    let spec = ProbeSpec::default().filtered(Synapse::lowpass_ms(10));
    let probe = graph.probe(&state.output, spec);
    let graph = graph.build(Timebase::default(), &lif(), Seed::new(1)).expect("builds");
    let mut sim = Simulator::new(Arc::new(graph), RunConfig::default()).expect("starts");
    run(&mut sim, 1_100);
    let at = |ms: usize| sim.samples(&probe).get(ms - 1).expect("recorded").1.to_vec();
    // 200 ms and 1 s after the input ended.
    assert!(cosine(&at(300), &value) > 0.95, "{}", cosine(&at(300), &value));
    assert!(cosine(&at(1_100), &value) > 0.8, "{}", cosine(&at(1_100), &value));
}

#[test]
fn a_goal_buffer_in_neurons_takes_up_and_holds() {
    let parts = vocabulary(128);
    let (a, b) = (parts.get("A").expect("there"), parts.get("B").expect("there"));
    let mut graph = GraphBuilder::new();
    let change = SimDuration::from_millis(150);
    let given = graph.add("given", Stimulus::pointer(parts.space(), &a).from(change, &b));
    let open = graph.add("open", Stimulus::scalar(1.0).from(SimDuration::from_millis(100), &[0.0]));
    let buffer = graph.add("buffer", GoalBuffer::new(&parts));
    graph.connect(&given, &buffer.input, Synapse::None);
    graph.connect(&open, &buffer.open, Synapse::None);
    let probe = graph.probe(&buffer.output, ProbeSpec::default());
    let graph = graph.build(Timebase::default(), &lif(), Seed::new(1)).expect("builds");
    let mut sim = Simulator::new(Arc::new(graph), RunConfig::default()).expect("starts");
    run(&mut sim, 300);
    // The gate closed before the input changed.
    let (_, last) = sim.samples(&probe).last().expect("recorded");
    assert!(cosine(&last, &a) > 0.8, "{}", cosine(&last, &a));
    assert!(cosine(&last, &b) < 0.3, "{}", cosine(&last, &b));
}

#[test]
fn basal_ganglia_choose_the_greatest_utility() {
    for plan in [PopulationPlan::direct(), rate(), lif()] {
        for chosen in [0, 4] {
            let mut utilities = vec![0.3; 5];
            utilities[chosen] = 0.8;
            let mut graph = GraphBuilder::new();
            let given = graph.add("given", Constant::vector(&utilities));
            let choice = graph.add("choice", BasalGanglia::new(5));
            graph.connect(&given, &choice.utilities, Synapse::None);
            let spec = ProbeSpec::default().filtered(Synapse::lowpass_ms(10));
            let probe = graph.probe(&choice.chosen, spec);
            let graph = graph.build(Timebase::default(), &plan, Seed::new(1)).expect("builds");
            let mut sim = Simulator::new(Arc::new(graph), RunConfig::default()).expect("starts");
            run(&mut sim, 300);
            let (_, last) = sim.samples(&probe).last().expect("recorded");
            for (action, value) in last.iter().enumerate() {
                let expected = if action == chosen { 1.0 } else { 0.0 };
                assert!((value - expected).abs() < 0.15, "{plan:?} {chosen}: {last:?}");
            }
        }
    }
}

#[test]
fn invalid_population_settings_are_refused_with_the_layers_path() {
    let refused = |change: fn(&mut LifSpec)| {
        let mut spec = LifSpec::default();
        change(&mut spec);
        let parts = vocabulary(64);
        let mut graph = GraphBuilder::new();
        let state = graph.add("here", State::new(&parts));
        let value = parts.get("A").expect("there");
        let given = graph.add("given", Constant::pointer(parts.space(), &value));
        graph.connect(&given, &state.input, Synapse::None);
        let plan = PopulationPlan::all(Population::Lif(spec));
        match graph.build(Timebase::default(), &plan, Seed::new(1)) {
            Err(errors) => errors.to_string(),
            Ok(_) => "built".into(),
        }
    };
    type Change = fn(&mut LifSpec);
    let cases: [(&str, Change); 13] = [
        ("`neurons` is 0", |s| s.tuning.per_dimension = 0),
        ("`neurons` is", |s| s.tuning.scale = f64::NAN),
        ("`tau_rc_s` is -0.02", |s| s.model = Lif { tau_rc_s: -0.02, ..Lif::default() }),
        ("`tau_ref_s` is NaN", |s| s.model.tau_ref_s = f64::NAN),
        ("refractory limit of 500 Hz", |s| s.tuning.max_rates = [400.0, 600.0]),
        ("`max_rates` is -1 to -1", |s| s.tuning.max_rates = [-1.0, -1.0]),
        ("`amplitude` is 0", |s| s.model.amplitude = 0.0),
        ("`min_voltage` is 0.5", |s| s.model.min_voltage = 0.5),
        ("`tick` is 0.001 s; expected at most 0.25", |s| s.model.tau_rc_s = 0.002),
        ("`intercepts` is -1.5 to 0.9", |s| s.tuning.intercepts = [-1.5, 0.9]),
        ("`intercepts` is -1 to 1", |s| s.tuning.intercepts = [-1.0, 1.0]),
        ("`regularisation` is 0", |s| s.tuning.regularisation = 0.0),
        ("`regularisation` is inf", |s| s.tuning.regularisation = f64::INFINITY),
    ];
    for (message, change) in cases {
        let said = refused(change);
        assert!(said.contains("here/population"), "{message}: {said}");
        assert!(said.contains(message), "{message}: {said}");
    }
}

/// Runs a standard network of usual neurons for 300 ms, and fails if it falls short of its quality.
fn reaches_its_quality(name: &str, model: Model) {
    let population = Population::Lif(LifSpec::default());
    // Nine pairs in 64 dimensions are too many to be told apart.
    let dimensions = if model == Model::Brain { 256 } else { 64 };
    let spec = Standard { dimensions, population, sim_ms: 300, ..Standard::default() };
    let measured = spec.build(model).expect("builds").run().expect("runs");
    let quality =
        |key: &str| measured.quality.iter().find(|(k, _)| *k == key).map_or(f64::NAN, |(_, v)| *v);
    let good = match model {
        Model::Bind | Model::State | Model::Memory | Model::Brain => quality("cosine") > 0.93,
        Model::Select => quality("chosen") > 0.9 && quality("greatest_other") < 0.1,
        Model::Channel => quality("rmse") < 0.02,
        // The time until they are active is measured at 256 dimensions, in the test below.
        Model::Planner | Model::Large => quality("weaker_precondition") > 0.5,
    };
    assert!(good && measured.neurons > 1_000, "{name}: {measured:?}");
}

#[test]
fn every_standard_network_reaches_its_quality() {
    let smaller = Model::ALL.iter().filter(|(_, model)| *model != Model::Brain);
    assert_eq!(smaller.clone().count() + 1, Model::ALL.len());
    smaller.for_each(|(name, model)| reaches_its_quality(name, *model));
    let short = Standard { sim_ms: 200, ..Standard::default() };
    assert!(short.build(Model::State).is_err());
}

/// A test of its own, beside which others run: it takes as long as all other networks together.
#[test]
fn the_brain_reaches_its_quality() {
    reaches_its_quality("brain", Model::Brain);
}

/// Returns the median over seeds of the time until both preconditions are active, in ms.
fn preconditions_ms(unbinding: Unbinding, seeds: u64) -> f64 {
    let mut all: Vec<f64> = (0..seeds)
        .map(|seed| {
            let seed = Seed::new(seed);
            let spec = Standard { unbinding, seed, sim_ms: 300, ..Standard::default() };
            let measured = spec.build(Model::Planner).expect("builds").run().expect("runs");
            let quality = |key: &str| {
                let found = measured.quality.iter().find(|(k, _)| *k == key);
                found.map_or(f64::NAN, |(_, v)| *v)
            };
            assert!(quality("weaker_precondition") > 0.8, "{measured:?}");
            assert!(quality("greatest_other") < 0.1, "{measured:?}");
            quality("preconditions_ms")
        })
        .collect();
    all.sort_by(f64::total_cmp);
    println!("{all:?}");
    all[all.len() / 2]
}

#[test]
#[ignore = "long statistics"]
fn preconditions_are_active_within_65_ms_by_products_and_62_ms_by_a_fixed_map() {
    for (unbinding, mark) in [(Unbinding::Products, 65.0), (Unbinding::Fixed, 62.0)] {
        let ms = preconditions_ms(unbinding, 10);
        println!("{unbinding:?}: {ms} ms in the median of 10 seeds");
        assert!(ms > 10.0 && ms <= mark, "{unbinding:?}: {ms} ms");
    }
}

/// Returns the item activities, at each tick, of a cleanup by independent accumulators. Its input is C with a little of
/// A, and A alone from 200 ms.
fn raced(plan: &PopulationPlan, seed: u64) -> Vec<Vec<Real>> {
    let parts = vocabulary(128);
    let mut graph = GraphBuilder::new();
    let tau = SimDuration::from_millis(50);
    let rule = SelectRule::IndependentAccumulators { level: 0.4, tau };
    let memory = CleanupMemory::new(&parts, ["A", "B", "C"], rule).expect("sound");
    let memory = graph.add("memory", memory);
    let first = parts.parse("0.9 * C + 0.6 * A").expect("sound");
    let then = parts.get("A").expect("there");
    let given = Stimulus::pointer(parts.space(), &first).from(SimDuration::from_millis(200), &then);
    let given = graph.add("given", given);
    graph.connect(&given, &memory.input, Synapse::None);
    let spec = ProbeSpec::default().filtered(Synapse::lowpass_ms(10));
    let probe = graph.probe(&memory.items, spec);
    let graph = graph.build(Timebase::default(), plan, Seed::new(seed)).expect("builds");
    let mut sim = Simulator::new(Arc::new(graph), RunConfig::default()).expect("starts");
    run(&mut sim, 500);
    sim.samples(&probe).iter().map(|(_, v)| v.to_vec()).collect()
}

#[test]
fn accumulators_choose_one_and_change_when_its_evidence_has_drained() {
    let lifs = (1..=10).map(|seed| (lif(), seed));
    for (plan, seed) in [(PopulationPlan::direct(), 1), (rate(), 1)].into_iter().chain(lifs) {
        let items = raced(&plan, seed);
        assert_eq!(items.len(), 500);
        // No item is active before evidence is gathered: a slope of (0.9 - 0.4) / 50 ms reaches 0.8 after 80 ms.
        assert!(items[40].iter().all(|v| *v < 0.1), "{plan:?}: {:?}", items[40]);
        for (at, chosen) in [(199, 2), (499, 0)] {
            for (item, value) in items[at].iter().enumerate() {
                let expected = if item == chosen { 1.0 } else { 0.0 };
                assert!(
                    (value - expected).abs() < 0.15,
                    "{plan:?} {seed} at {at}: {:?}",
                    items[at]
                );
            }
        }
        // Two items are never active at once.
        let both = items.iter().filter(|v| v.iter().filter(|v| **v > 0.5).count() > 1).count();
        assert_eq!(both, 0, "{plan:?} {seed}");
    }
}

#[test]
fn spikes_can_be_seen_from_outside_and_only_spiking_layers_have_them() {
    let things = vocabulary(64);
    let built = |plan: &PopulationPlan| {
        let mut graph = GraphBuilder::new();
        let a = things.get("A").expect("there");
        let cue = graph.add("cue", Constant::pointer(things.space(), &a));
        let state = graph.add("state", State::new(&things));
        graph.connect(&cue, &state.input, Synapse::None);
        let graph = graph.build(Timebase::default(), plan, Seed::new(1)).expect("builds");
        Simulator::new(Arc::new(graph), RunConfig::default()).expect("runs")
    };
    let mut sim = built(&lif());
    let populations: Vec<_> = sim.graph().event_sources().map(|(_, of)| of).collect();
    let neurons: usize = populations.iter().map(|of| of.units).sum();
    assert!(!populations.is_empty() && neurons >= 64 * 50, "{neurons}");
    let count = |sim: &Simulator| -> usize {
        let of = |p: &symbolt::sim::EventSource| (0..p.units).filter(|n| sim.event(*p, *n)).count();
        populations.iter().map(of).sum()
    };
    assert_eq!(count(&sim), 0, "before the first tick");
    let (ticks, mut all) = (500, 0);
    for _ in 0..ticks {
        sim.run_for(SimDuration::from_millis(1)).expect("runs");
        all += count(&sim);
    }
    // Neurons fire at 200 to 400 Hz at the radius of the represented range; most fire less or not at all.
    let mean = all as f64 / neurons as f64 / (f64::from(ticks) / 1e3);
    assert!((10.0..150.0).contains(&mean), "{mean} Hz");
    assert!(!sim.event(populations[0], usize::MAX), "an index beyond the last neuron never fires");
    assert_eq!(built(&rate()).graph().event_sources().count(), 0);
    assert_eq!(built(&PopulationPlan::direct()).graph().event_sources().count(), 0);
}

/// Returns the paper's domain (section II.E).
fn paper_domain() -> Domain {
    DomainBuilder::of_the_paper().build().expect("the paper's domain is sound")
}

/// Decides towards the assembly in all 32 world states. Returns how many decisions the reference planner accepts, and
/// the others as text.
fn decisions(seed: u64, unbinding: Unbinding) -> (usize, Vec<String>) {
    let domain = paper_domain();
    let spec = PlannerSpec { unbinding, ..PlannerSpec::default() };
    let planner = Planner::with_plan(&domain, spec, &lif(), Seed::new(seed)).expect("builds");
    let goal = domain.state("BOLT_ASSEMBLED").expect("there");
    let (mut accepted, mut others) = (0, Vec::new());
    for bits in 0..32u32 {
        let world: WorldState = (0..5).map(|s| bits >> s & 1 == 1).collect();
        let right = acceptable_answers(&domain, &world, goal, planner.spec().rules());
        let said = planner.decide(&world, goal).map(|d| d.verdict);
        if said.as_ref().is_ok_and(|verdict| right.accepts(*verdict)) {
            accepted += 1;
        } else {
            others.push(format!("seed {seed}, {world:?}: {said:?}"));
        }
    }
    (accepted, others)
}

#[test]
fn the_planner_in_neurons_decides_as_the_reference_planner_does() {
    let (accepted, others) = decisions(1, Unbinding::Fixed);
    assert_eq!(accepted, 32, "{others:?}");
}

/// At most 3 of 320 answers may differ. If one in a thousand did, this would fail once in 3,000 runs; if one in twenty did,
/// it would pass once in 14,000.
#[test]
#[ignore = "long statistics"]
fn the_planner_in_neurons_decides_as_the_reference_planner_does_over_10_seeds() {
    for unbinding in [Unbinding::Fixed, Unbinding::Products] {
        let (mut accepted, mut others) = (0, Vec::new());
        for seed in 0..10 {
            let (good, bad) = decisions(seed, unbinding);
            accepted += good;
            others.extend(bad);
        }
        println!("{unbinding:?}: {accepted} of 320 accepted; not: {others:#?}");
        assert!(accepted + others.len() == 320 && accepted >= 317, "{accepted}");
    }
}

/// A module of a single layer.
struct Alone<F>(F);

impl<P, F: FnOnce(&mut Scope<'_>) -> P> Module for Alone<F> {
    type Ports = P;

    fn expand(self, scope: &mut Scope<'_>) -> P {
        (self.0)(scope)
    }
}

/// Runs a layer for 300 ms at a constant input. Returns its filtered output, or why it cannot be built.
fn settled(
    plan: &PopulationPlan,
    input: &[Real],
    layer: impl FnOnce(&mut Scope<'_>) -> Ports<Vector>,
) -> Result<Vec<Real>, String> {
    let mut graph = GraphBuilder::new();
    let given = graph.add("given", Constant::vector(input));
    let layer = graph.add("alone", Alone(layer));
    graph.connect(&given, &layer.input, Synapse::None);
    let spec = ProbeSpec::default().filtered(Synapse::lowpass_ms(20));
    let probe = graph.probe(&layer.output, spec);
    let sim = graph.run(plan, Seed::new(1), SimDuration::from_millis(300));
    let sim = sim.map_err(|error| error.to_string())?;
    Ok(sim.samples(&probe).last().expect("recorded").1.to_vec())
}

#[test]
fn a_vector_is_limited_alike_in_every_mode() {
    let represent = |input: &[Real], radius: Real| {
        let width = input.len();
        [PopulationPlan::direct(), rate(), lif()].map(|plan| {
            settled(&plan, input, |scope| {
                let ports = (InputSpec::vector(width), OutputSpec::vector(width));
                scope.represent("represent", Represent::new(ports.0, ports.1, radius))
            })
            .expect("runs")
        })
    };
    // Each component is within the radius, although their norm is 3.6.
    for found in represent(&[0.9; 16], 1.0) {
        assert!(found.iter().all(|v| (v - 0.9).abs() < 0.06), "{found:?}");
    }
    // A component beyond the radius is cut off, and the others stay as they are.
    for found in represent(&[3.0, -0.2], 1.0) {
        assert!(
            (1.0 - 1e-6..1.8).contains(&found[0]) && (found[1] + 0.2).abs() < 0.06,
            "{found:?}"
        );
    }
}

#[test]
fn a_function_that_is_not_finite_within_the_radius_is_refused() {
    let root =
        |plan: &PopulationPlan, map: Map| settled(plan, &[0.49], |scope| scope.map("root", map));
    for plan in [rate(), lif()] {
        let refused = root(&plan, Map::each(1, Real::sqrt)).expect_err("it has no negative roots");
        assert!(refused.contains("alone/root") && refused.contains("`function` is NaN at -0.99"));
        let found = root(&plan, Map::each(1, Real::sqrt).above(0.0)).expect("it runs above 0");
        assert!((found[0] - 0.7).abs() < 0.06, "{found:?}");
    }
    let exact = root(&PopulationPlan::direct(), Map::each(1, Real::sqrt)).expect("exact maths");
    assert!((exact[0] - 0.7).abs() < 1e-4, "{exact:?}");
}

#[test]
fn the_outputs_of_an_ensemble_are_found_by_path() {
    let mut graph = GraphBuilder::new();
    let square = |x: &[Real], out: &mut [Real]| out[0] = x[0] * x[0];
    let number =
        graph.add("number", Ensemble::new(1).identity("itself").decode("square", 1, square));
    let given = graph.add("given", Constant::vector(&[0.5]));
    graph.connect(&given, &number.input, Synapse::None);
    graph.probe_at::<Vector>("number.square", ProbeSpec::default());
    let plan = PopulationPlan::direct();
    let sim = graph.run(&plan, Seed::new(1), SimDuration::from_millis(5)).expect("runs");
    for (name, value) in [("number.itself", 0.5), ("number.square", 0.25)] {
        let output = sim.graph().output(name).expect("it is there");
        assert_eq!(sim.value_of(output), [value], "{name}");
        let inner = sim.graph().output(&name.replace('.', "/neurons.")).expect("it is there");
        assert_eq!(sim.value_of(inner), [value], "{name}");
    }
}

/// [`Rectified`] is written in a file of its own, and no list names it.
#[test]
fn a_neuron_model_that_the_crate_does_not_know_runs_in_every_layer() {
    let plan = |scale| {
        let tuning = Tuning { scale, ..Tuning::default() };
        PopulationPlan::all(Population::Neurons(NeuronSpec::new(Rectified, tuning)))
    };
    let squared = |plan: &PopulationPlan| {
        settled(plan, &[0.8, -0.3], |scope| scope.map("squares", Map::each(2, |x| x * x)))
            .expect("runs")
    };
    for plan in [PopulationPlan::direct(), rate(), lif(), plan(1.0)] {
        let found = squared(&plan);
        assert!((found[0] - 0.64).abs() < 0.05 && (found[1] - 0.09).abs() < 0.05, "{found:?}");
    }
    let found = squared(&plan(0.03));
    assert!((found[0] - 0.64).abs() > 0.02, "three neurons are too few: {found:?}");
    // Products of pointers, a contest and a memory.
    let (mut sim, probes) = two_modules(&plan(1.0));
    run(&mut sim, 300);
    let parts = vocabulary(64);
    let (bound, clean) = (parts.parse("A * B").expect("sound"), parts.get("C").expect("there"));
    let last =
        |probe: &ProbeId<Pointer<Things>>| sim.samples(probe).last().expect("recorded").1.to_vec();
    assert!(cosine(&last(&probes[0]), &bound) > 0.95, "{}", cosine(&last(&probes[0]), &bound));
    assert!(cosine(&last(&probes[1]), &clean) > 0.99, "{}", cosine(&last(&probes[1]), &clean));
    // Its spikes are seen from outside.
    let sources: Vec<_> = sim.graph().event_sources().map(|(_, of)| of).collect();
    let fired = |of: &symbolt::sim::EventSource| (0..of.units).any(|unit| sim.event(*of, unit));
    assert!(sources.iter().any(fired));
    // Its populations are saved and loaded, and are not those of other neurons.
    let solved = SolvedModel::of(sim.graph());
    let loaded = SolvedModel::decode(&solved.encode().expect("plain data")).expect("sound");
    let (mut again, same) = two_modules(&plan(1.0).solved(loaded.clone()));
    run(&mut again, 300);
    assert_eq!(all(&again, &same[0]), all(&sim, &probes[0]));
    let of_others =
        settled(&lif().solved(loaded), &[0.1], |scope| scope.map("other", Map::each(1, |x| x)));
    assert!(of_others.is_err_and(|error| error.contains("no such layer")));
}

#[test]
fn a_gate_closes_in_neurons_of_another_model() {
    let mut graph = GraphBuilder::new();
    let given = graph.add("given", Constant::vector(&[0.7]));
    let open = Stimulus::scalar(1.0).from(SimDuration::from_millis(200), &[0.0]);
    let open = graph.add("open", open);
    let gate = graph.add(
        "gate",
        Alone(|scope: &mut Scope<'_>| -> GatePorts<Vector> {
            let layer = Represent::new(InputSpec::vector(1), OutputSpec::vector(1), 1.0);
            scope.represent_gated("gate", layer)
        }),
    );
    graph.connect(&given, &gate.input, Synapse::None);
    graph.connect(&open, &gate.open, Synapse::None);
    let probe = graph.probe(&gate.output, ProbeSpec::default().filtered(Synapse::lowpass_ms(20)));
    let plan = PopulationPlan::all(Population::neurons(Rectified));
    let sim = graph.run(&plan, Seed::new(1), SimDuration::from_millis(500)).expect("runs");
    let at = |ms: usize| sim.samples(&probe).get(ms - 1).expect("recorded").1[0];
    assert!((at(200) - 0.7).abs() < 0.05, "{}", at(200));
    assert!(at(500).abs() < 1e-4, "{}", at(500));
}
