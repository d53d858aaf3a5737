//! Threads and ranks: every output and every checkpoint has the bits of a run on one thread.

#![allow(clippy::expect_used)]

use std::sync::Arc;

use rand::RngExt;
use symbolt::neurons::{Ensemble, LifSpec, Population, PopulationPlan, Tuning};
use symbolt::plan::goal_sets::{GoalSetGraph, Regression, StripsWorld, populations};
use symbolt::plan::strips::{Bodies, Domain, Grounded, Problem};
use symbolt::sim::{
    Apply, Constant, Fingerprint, Graph, GraphBuilder, InputSpec, Node, OutputSpec, Outputs,
    PartIo, PartSpec, Parts, PortDecl, Ranks, Real, RunConfig, Scalar, Seed, Signal, SimDuration,
    SimError, Simulator, StateMut, StepCx, Synapse, Threads, Timebase, Vector, WorldLink,
};
use symbolt::study::standard::{Model, Standard};

/// The bits of all outputs in every tick, and of the checkpoint after the last.
type Bits = (u64, String);

fn run(sim: &mut Simulator, ms: u64) -> Bits {
    let graph = sim.graph().clone();
    let outputs: Vec<_> = graph.outputs().map(|name| graph.output(&name).expect("own")).collect();
    let mut hash = Fingerprint::default();
    for _ in 0..ms {
        sim.run_for(SimDuration::from_millis(1)).expect("runs");
        for output in &outputs {
            hash.reals(sim.value_of(*output));
        }
    }
    let checkpoint = sim.checkpoint().expect("it can be saved");
    (hash.value(), serde_json::to_string(&checkpoint).expect("plain data"))
}

/// Runs `each` on so many threads that stand for processes, and returns what it returns, by rank.
fn on_ranks<T: Send>(ranks: usize, each: impl Fn(Ranks) -> T + Sync) -> Vec<T> {
    let each = &each;
    std::thread::scope(|scope| {
        let group = Ranks::in_process(ranks).into_iter();
        let threads: Vec<_> = group.map(|ranks| scope.spawn(move || each(ranks))).collect();
        threads.into_iter().map(|thread| thread.join().expect("no panic")).collect()
    })
}

fn small() -> LifSpec {
    LifSpec::tuned(Tuning { scale: 0.2, distinct_ensembles: 2, ..Tuning::default() })
}

fn standard(model: Model, ranks: Option<Ranks>) -> Arc<Graph> {
    let spec = Standard {
        dimensions: 64,
        population: Population::Lif(small()),
        ranks,
        ..Standard::default()
    };
    spec.build(model).expect("builds").graph().clone()
}

fn start(graph: Arc<Graph>, threads: Threads) -> Simulator {
    Simulator::new(graph, RunConfig::default().with_threads(threads)).expect("starts")
}

#[test]
fn all_standard_networks_have_the_same_bits_on_any_threads_and_ranks() {
    for (name, model) in Model::ALL {
        let graph = standard(model, None);
        let serial = run(&mut start(graph.clone(), Threads::Serial), 40);
        for threads in [1, 2, 3, 7] {
            let other = run(&mut start(graph.clone(), Threads::Exactly(threads)), 40);
            assert!(serial == other, "{name} on {threads} threads");
        }
        for ranks in [2, 3] {
            // Each rank has two threads of its own.
            let each =
                |ranks| run(&mut start(standard(model, Some(ranks)), Threads::Exactly(2)), 40);
            let all = on_ranks(ranks, each);
            assert_eq!(all.len(), ranks);
            assert!(all.iter().all(|bits| *bits == serial), "{name} on {ranks} ranks");
        }
    }
}

/// A planner of goal sets that stacks three blocks, in spikes, with its world.
fn blocks(ranks: Option<&Ranks>) -> Simulator {
    let domain = include_str!("../fixtures/strips/blocks.pddl");
    let domain = Domain::parse(domain.as_bytes(), "domain", Bodies::Read).expect("a domain");
    let problem = "(define (problem p) (:domain blocks) (:objects a b c - block)
        (:init (on c a) (on-table a) (on-table b) (clear c) (clear b) (hand-empty))
        (:goal (and (on b c))))"
        .replace("blocks", &domain.name);
    let problem = Problem::parse(problem.as_bytes(), "problem", &domain).expect("a problem");
    let problem = Grounded::new(&domain, &problem).expect("a small problem");
    let (fluents, operators) = (problem.fluents.len(), problem.operators.len());
    let mut graph = GraphBuilder::new();
    let planner = graph.add("planner", GoalSetGraph::new(Regression::new(&problem).into(), 4));
    let link = WorldLink::new()
        .sense("holds", OutputSpec::vector(fluents))
        .command("actions", InputSpec::vector(operators));
    let node = graph.world("world", link);
    let mut wanted = vec![0.0; fluents];
    problem.goal.iter().for_each(|fluent| wanted[*fluent] = 1.0);
    for (name, values, input) in [
        ("ready", vec![1.0], &planner.ready),
        ("idle", vec![0.0], &planner.busy),
        ("goal", wanted, &planner.goal),
    ] {
        let constant = graph.add(name, Constant::vector(&values));
        graph.connect(&constant, input, Synapse::None);
    }
    graph.connect(&node.output::<Vector>("holds"), &planner.holds, Synapse::None);
    graph.connect(&planner.actions, &node.input::<Vector>("actions"), Synapse::None);
    let plan = populations(&Population::Lif(LifSpec::default())).expect("patterns");
    let plan = ranks.iter().fold(plan, |plan, ranks| plan.shared(ranks));
    let graph = graph.build(Timebase::default(), &plan, Seed::new(3)).expect("builds");
    let world = StripsWorld::new(&problem, SimDuration::from_millis(20));
    let threads = if ranks.is_some() { Threads::Serial } else { Threads::Exactly(3) };
    let config = RunConfig::seeded(Seed::new(3)).in_world(world).with_threads(threads);
    Simulator::new(graph.into(), config).expect("starts")
}

fn begun(sim: &Simulator) -> usize {
    let world: &dyn std::any::Any = sim.world().expect("it has one");
    world.downcast_ref::<StripsWorld>().expect("its type").begun().len()
}

#[test]
fn the_planner_acts_in_its_world_with_the_same_bits_on_threads_and_ranks() {
    let mut threads = blocks(None);
    threads.run_for(SimDuration::from_millis(400)).expect("runs");
    let end = threads.checkpoint().expect("it can be saved");
    assert!(begun(&threads) > 0, "the planner acted");
    let all = on_ranks(2, |ranks| {
        let mut sim = blocks(Some(&ranks));
        sim.run_for(SimDuration::from_millis(400)).expect("runs");
        (sim.checkpoint().expect("it can be saved"), begun(&sim))
    });
    for (checkpoint, begun_here) in all {
        assert!(checkpoint == end);
        assert_eq!(begun_here, begun(&threads));
    }
}

#[test]
fn a_checkpoint_of_three_ranks_resumes_on_one_and_on_two() {
    let mut whole = start(standard(Model::Planner, None), Threads::Serial);
    run(&mut whole, 30);
    let expected = run(&mut whole, 30);
    let saved = on_ranks(3, |ranks| {
        let mut sim = start(standard(Model::Planner, Some(ranks)), Threads::Serial);
        run(&mut sim, 30);
        sim.checkpoint().expect("it can be saved")
    });
    assert!(saved[0] == saved[1] && saved[1] == saved[2], "each has the whole");
    let mut alone = start(standard(Model::Planner, None), Threads::Exactly(2));
    alone.restore(&saved[1]).expect("it fits");
    assert!(run(&mut alone, 30) == expected, "on one");
    let two = on_ranks(2, |ranks| {
        let mut sim = start(standard(Model::Planner, Some(ranks)), Threads::Serial);
        sim.restore(&saved[2]).expect("it fits");
        run(&mut sim, 30)
    });
    assert!(two.iter().all(|bits| *bits == expected), "on two");
}

#[test]
fn recorded_spikes_and_sent_events_are_known_to_every_rank() {
    let build = |ranks: Option<Ranks>| {
        let mut graph = GraphBuilder::new();
        let input = graph.add("input", Constant::vector(&[0.5; 70]));
        let map = symbolt::neurons::Ensemble::new(1).copies(70).identity("same");
        let map = graph.add("map", map);
        graph.connect(&input, &map.input, Synapse::None);
        let spikes = graph.probe_spikes("map/neurons");
        let plan = PopulationPlan::lif();
        let plan = ranks.iter().fold(plan, |plan, ranks| plan.shared(ranks));
        (graph.build(Timebase::default(), &plan, Seed::new(1)).expect("builds"), spikes)
    };
    let spikes = |ranks: Option<Ranks>| {
        let (graph, probe) = build(ranks);
        let mut sim = start(Arc::new(graph), Threads::Exactly(2));
        sim.run_for(SimDuration::from_millis(50)).expect("runs");
        sim.spikes(&probe).iter().map(|(t, n)| ((t * 1e3).round() as u64, n)).collect::<Vec<_>>()
    };
    let expected = spikes(None);
    assert!(expected.len() > 10_000, "{}", expected.len());
    for found in on_ranks(3, |ranks| spikes(Some(ranks))) {
        assert!(found == expected);
    }
    let events = |ranks: Option<Ranks>| {
        let mut sim = start(standard(Model::Bind, ranks), Threads::Serial);
        sim.run_for(SimDuration::from_millis(20)).expect("runs");
        let (_, source) = sim.graph().event_sources().next().expect("a population");
        (0..source.units).filter(|unit| sim.event(source, *unit)).collect::<Vec<_>>()
    };
    let expected = events(None);
    assert!(expected.len() > 10);
    for found in on_ranks(2, |ranks| events(Some(ranks.with_events()))) {
        assert_eq!(found, expected);
    }
    // Unless they are sent, each rank knows only its own.
    let own = on_ranks(2, |ranks| events(Some(ranks)));
    assert!(own.iter().all(|own| !own.is_empty() && own.len() < expected.len()));
    assert_eq!(own.iter().map(Vec::len).sum::<usize>(), expected.len());
}

#[test]
fn each_rank_solves_its_share_and_no_more() {
    // Model::Large has ensembles of all kinds.
    let whole: usize = symbolt::neurons::neurons(&standard(Model::Large, None));
    for ranks in [2, 3, 4] {
        let shares = on_ranks(ranks, |ranks| {
            let graph = standard(Model::Large, Some(ranks));
            assert_eq!(symbolt::neurons::neurons(&graph), whole, "all are counted");
            symbolt::neurons::own_neurons(&graph)
        });
        assert_eq!(shares.iter().sum::<usize>(), whole, "{shares:?}");
        let most = shares.iter().max().expect("ranks");
        assert!(*most as f64 <= 1.1 * whole as f64 / ranks as f64, "{shares:?} of {whole}");
    }
}

/// How [`Fails`] fails.
#[derive(Clone, Copy)]
enum Failure {
    NotFinite,
    Panic,
}

/// A node of two parts. The second fails in tick 5.
struct Fails(Failure);

impl Node for Fails {
    fn declare(&self, ports: &mut PortDecl) {
        ports.input("x", InputSpec::vector(2).at_advance());
        ports.output("y", OutputSpec::vector(2).registered());
    }
    fn fingerprint(&self, _hash: &mut Fingerprint) {}
    fn init(&self, _cx: &StepCx<'_>, state: &mut StateMut<'_>, _registered: &mut Outputs<'_>) {
        state.reals.copy_from_slice(&[10.0, 20.0]);
    }
    fn parts(&self) -> Option<&dyn Parts> {
        Some(self)
    }
}

impl Parts for Fails {
    fn count(&self) -> usize {
        2
    }
    fn part(&self, part: usize) -> PartSpec {
        // There is no rank 7, so the ranks count around.
        PartSpec { state: 1, results: 1, work: 1, rank: 7 * part, ..PartSpec::default() }
    }
    fn advance(&self, cx: &StepCx<'_>, part: usize, io: &mut PartIo<'_>) {
        io.state[0] += io.inputs.get(0)[part];
        io.results[0] = io.state[0];
        if part == 1 && cx.tick() == 5 {
            match self.0 {
                Failure::NotFinite => io.results[0] = Real::NAN,
                Failure::Panic => panic!("a node that panics, as it should here"),
            }
        }
    }
    fn collect(&self, part: usize, results: &[Real], outputs: &mut Outputs<'_>) {
        outputs.get_mut(0)[part] = results[0];
    }
}

#[test]
fn a_simulator_whose_node_panicked_can_be_reset_and_run_again() {
    for threads in [1, 2, 3] {
        let mut graph = GraphBuilder::new();
        let input = graph.add("input", Constant::vector(&[1.0, 2.0]));
        // Shares are filled in turn, so each thread has a node that panics.
        let mut add = |n| graph.node(&format!("node_{n}"), Fails(Failure::Panic));
        let nodes: Vec<_> = (0..3).map(&mut add).collect();
        for node in &nodes {
            graph.connect(&input, &node.input("x"), Synapse::None);
        }
        let graph = graph
            .build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1))
            .expect("builds");
        let mut sim = start(graph.into(), Threads::Exactly(threads));
        for _ in 0..3 {
            sim.run_for(SimDuration::from_millis(5)).expect("runs");
            for node in &nodes {
                assert_eq!(*sim.value(&node.output::<Vector>("y")), [15.0, 30.0]);
            }
            let tick = || sim.run_for(SimDuration::from_millis(1));
            let caught = std::panic::catch_unwind(std::panic::AssertUnwindSafe(tick));
            assert!(caught.is_err(), "it panics on {threads} threads");
            let text = sim.checkpoint().expect_err("half a tick").to_string();
            assert!(text.contains("in tick 5 (a node or the world panicked)"), "{text}");
            sim.reset().expect("resets");
        }
    }
}

#[test]
fn a_restored_simulator_knows_the_last_spikes() {
    let mut graph = GraphBuilder::new();
    let input = graph.add("input", Constant::vector(&[0.5; 70]));
    let map = graph.add("map", Ensemble::new(1).copies(70).identity("same"));
    graph.connect(&input, &map.input, Synapse::None);
    graph.probe_spikes("map/neurons");
    let plan = PopulationPlan::lif();
    let graph = Arc::new(graph.build(Timebase::default(), &plan, Seed::new(1)).expect("builds"));
    for threads in [Threads::Serial, Threads::Exactly(2)] {
        let mut sim = start(graph.clone(), threads);
        sim.run_for(SimDuration::from_millis(20)).expect("runs");
        let (_, source) = graph.event_sources().next().expect("a population");
        let spikes = |sim: &Simulator| -> Vec<bool> {
            (0..source.units).map(|unit| sim.event(source, unit)).collect()
        };
        let mut other = start(graph.clone(), threads);
        other.restore(&sim.checkpoint().expect("saved")).expect("fits");
        assert_eq!(spikes(&sim), spikes(&other));
        assert!(spikes(&sim).iter().filter(|spike| **spike).count() > 100);
    }
}

#[test]
fn a_node_of_ones_own_advances_in_parts() {
    for threads in [Threads::Serial, Threads::Exactly(2)] {
        let mut graph = GraphBuilder::new();
        let input = graph.add("input", Constant::vector(&[1.0, 2.0]));
        let node = graph.node("node", Fails(Failure::NotFinite));
        graph.connect(&input, &node.input("x"), Synapse::None);
        let y = node.output::<Vector>("y");
        let graph = graph
            .build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1))
            .expect("builds");
        let mut sim = start(graph.into(), threads);
        sim.run_for(SimDuration::from_millis(5)).expect("runs");
        assert_eq!(*sim.value(&y), [15.0, 30.0]);
        let error = sim.run_for(SimDuration::from_millis(1)).expect_err("not finite").to_string();
        assert!(error.contains("`node.y` became NaN in tick 5"), "{error}");
        sim.reset().expect("resets");
        sim.run_for(SimDuration::from_millis(5)).expect("runs");
        assert_eq!(*sim.value(&y), [15.0, 30.0]);
    }
}

/// A node of four parts that shows random numbers: those of its start, and those of every tick.
struct Draws;

impl Node for Draws {
    fn declare(&self, ports: &mut PortDecl) {
        ports.output("start", OutputSpec::vector(4).registered());
        ports.output("drawn", OutputSpec::vector(4).registered());
    }
    fn fingerprint(&self, _hash: &mut Fingerprint) {}
    fn init(&self, cx: &StepCx<'_>, state: &mut StateMut<'_>, _registered: &mut Outputs<'_>) {
        assert_eq!((cx.tick(), cx.dt_s(), cx.noise_scale()), (0, 1e-3, 1.0));
        let mut rng = cx.rng();
        state.reals.iter_mut().for_each(|value| *value = rng.random());
    }
    fn parts(&self) -> Option<&dyn Parts> {
        Some(self)
    }
}

impl Parts for Draws {
    fn count(&self) -> usize {
        4
    }
    fn part(&self, part: usize) -> PartSpec {
        PartSpec { state: 1, results: 2, work: 1, rank: part, ..PartSpec::default() }
    }
    fn advance(&self, cx: &StepCx<'_>, _part: usize, io: &mut PartIo<'_>) {
        io.results.copy_from_slice(&[io.state[0], cx.rng().random()]);
    }
    fn collect(&self, part: usize, results: &[Real], outputs: &mut Outputs<'_>) {
        outputs.get_mut(0)[part] = results[0];
        outputs.get_mut(1)[part] = results[1];
    }
}

#[test]
fn every_part_of_a_node_draws_random_numbers_of_its_own() {
    let draw = |seed: u64, ranks: Option<Ranks>, threads| {
        let mut graph = GraphBuilder::new();
        let node = graph.node("node", Draws);
        let plan = PopulationPlan::direct();
        let plan = ranks.into_iter().fold(plan, |plan, ranks| plan.shared(&ranks));
        let graph = graph.build(Timebase::default(), &plan, Seed::new(1)).expect("builds");
        let run = RunConfig::seeded(Seed::new(seed)).with_threads(threads);
        let mut sim = Simulator::new(graph.into(), run).expect("starts");
        let mut all = Vec::new();
        for _ in 0..3 {
            sim.run_for(SimDuration::from_millis(1)).expect("runs");
            all.extend_from_slice(sim.value(&node.output::<Vector>("drawn")));
        }
        all.extend_from_slice(sim.value(&node.output::<Vector>("start")));
        all
    };
    let alone = draw(1, None, Threads::Serial);
    let mut sorted = alone.clone();
    sorted.sort_by(f32::total_cmp);
    sorted.dedup();
    assert_eq!(sorted.len(), 16, "no part, tick or start has the number of another: {alone:?}");
    assert_eq!(draw(1, None, Threads::Exactly(3)), alone);
    assert!(on_ranks(2, |ranks| draw(1, Some(ranks), Threads::Serial)).iter().all(|d| *d == alone));
    assert!(draw(2, None, Threads::Serial).iter().zip(&alone).all(|(a, b)| a != b));
}

#[test]
fn the_end_of_one_rank_is_an_error_of_the_others() {
    let found = on_ranks(3, |ranks| {
        let rank = ranks.rank();
        let mut sim = start(standard(Model::Select, Some(ranks)), Threads::Serial);
        let ms = if rank == 1 { 10 } else { 30 };
        sim.run_for(SimDuration::from_millis(ms)).map(|report| report.ticks)
    });
    assert_eq!(found[1], Ok(10));
    for rank in [0, 2] {
        let error = found[rank].as_ref().expect_err("rank 1 has ended").to_string();
        assert!(error.starts_with("rank 1 has ended"), "{error}");
    }
}

#[test]
fn ranks_with_other_graphs_find_out_before_they_run() {
    let found = on_ranks(2, |ranks| {
        let model = if ranks.rank() == 0 { Model::Select } else { Model::Bind };
        let spec = Standard {
            dimensions: 64,
            population: Population::Lif(small()),
            ranks: Some(ranks),
            ..Standard::default()
        };
        spec.build(model).err().map(|error| error.to_string())
    });
    for error in found {
        let error = error.expect("they differ");
        assert!(error.contains("rank"), "{error}");
    }
    // As many populations, but with another seed: the first tick tells.
    let found = on_ranks(2, |ranks| {
        let seed = Seed::new(ranks.rank() as u64);
        let spec = Standard {
            dimensions: 64,
            population: Population::Lif(small()),
            ranks: Some(ranks),
            seed,
            ..Standard::default()
        };
        let graph = spec.build(Model::Bind).expect("builds").graph().clone();
        let mut sim = start(graph, Threads::Serial);
        sim.run_for(SimDuration::from_millis(1)).expect_err("another graph")
    });
    assert!(
        matches!(&found[0], SimError::Rank { rank: 1, reason } if reason.contains("another graph"))
    );
}

#[test]
fn more_ranks_than_parts_are_of_no_harm() {
    let serial = run(&mut start(standard(Model::Channel, None), Threads::Serial), 10);
    let all = on_ranks(9, |ranks| {
        run(&mut start(standard(Model::Channel, Some(ranks)), Threads::Serial), 10)
    });
    assert!(all.iter().all(|bits| *bits == serial));
}

/// A graph with one population on all ranks, and a node that can differ between them.
fn with_signal(ranks: &Ranks, function: fn(&Ranks, f64) -> Real) -> Simulator {
    let mut graph = GraphBuilder::new();
    let own = ranks.clone();
    let signal = graph.add("signal", Signal::scalar(move |time_s| function(&own, time_s)));
    let map = graph.add("map", Ensemble::new(1).copies(3).identity("same"));
    let input = graph.add("input", Constant::vector(&[0.5; 3]));
    graph.connect(&input, &map.input, Synapse::None);
    let hold = graph.add(
        "hold",
        Apply::<Scalar, Scalar>::new(InputSpec::scalar(), OutputSpec::scalar(), |x, y| y[0] = x[0]),
    );
    graph.connect(&signal, &hold.input, Synapse::lowpass_ms(5));
    let plan = PopulationPlan::lif().shared(ranks);
    let graph = graph.build(Timebase::default(), &plan, Seed::new(1)).expect("builds");
    start(graph.into(), Threads::Serial)
}

fn each_names_the_other(errors: &[String], reason: &str) {
    assert_eq!(errors.len(), 2);
    for (error, other) in errors.iter().zip([1, 0]) {
        assert!(error.starts_with(&format!("rank {other} {reason}")), "{error}");
    }
}

#[test]
fn ranks_with_other_values_stop() {
    let found = on_ranks(2, |ranks| {
        let differs = |ranks: &Ranks, time_s: f64| match ranks.rank() {
            1 if time_s > 0.0195 => 1.0,
            _ => 0.5,
        };
        let mut sim = with_signal(&ranks, differs);
        let limit = SimDuration::from_millis(200);
        let error = sim.run_for(limit).expect_err("they differ");
        // Every value is compared within 64 ticks.
        assert!((21..=85).contains(&sim.tick()), "{}", sim.tick());
        error.to_string()
    });
    each_names_the_other(&found, "has other values than this one in tick ");
}

#[test]
fn ranks_restore_one_checkpoint_or_none() {
    let found = on_ranks(2, |ranks| {
        let mut sim = with_signal(&ranks, |_, time_s| time_s as Real);
        let (early, late) = [10, 10]
            .map(|ms| {
                sim.run_for(SimDuration::from_millis(ms)).expect("runs");
                sim.checkpoint().expect("saved")
            })
            .into();
        sim.restore(&early).expect("the same on both");
        assert_eq!(sim.tick(), 10);
        let error = sim.restore(if ranks.rank() == 0 { &early } else { &late });
        let error = error.expect_err("they differ").to_string();
        // After the error both can go on.
        sim.restore(&late).expect("the same on both");
        sim.run_for(SimDuration::from_millis(5)).expect("runs");
        assert_eq!(sim.tick(), 25);
        error
    });
    each_names_the_other(&found, "restores another checkpoint than this one");
}

#[test]
fn the_reason_why_one_rank_cannot_build_is_known_to_all() {
    let found = on_ranks(3, |ranks| {
        let scale = if ranks.rank() == 2 { -1.0 } else { 0.2 };
        let lif = LifSpec::tuned(Tuning { scale, ..Tuning::default() });
        let spec = Standard {
            dimensions: 64,
            population: Population::Lif(lif),
            ranks: Some(ranks),
            ..Standard::default()
        };
        spec.build(Model::Bind).err().map(|error| error.to_string()).expect("it cannot be built")
    });
    assert!(found[2].contains("-1"), "{}", found[2]);
    for found in &found[..2] {
        assert!(found.contains("rank 2") && found.contains("could not be built"), "{found}");
        assert!(found.contains("-1"), "{found}");
    }
}

#[test]
fn a_rank_that_built_something_else_is_found() {
    let group = Ranks::in_process(3);
    let found: Vec<_> = std::thread::scope(|scope| {
        let ask = |ranks: &Ranks| ranks.differs(if ranks.rank() == 1 { 7 } else { 8 });
        let threads: Vec<_> = group.iter().map(|ranks| scope.spawn(move || ask(ranks))).collect();
        threads.into_iter().map(|t| t.join().expect("no panic")).collect()
    });
    assert_eq!(found, [Ok(Some(1)), Ok(Some(0)), Ok(Some(1))]);
}

#[test]
fn the_end_of_one_is_the_end_of_all() {
    let mut group = Ranks::in_process(2);
    drop(group.pop());
    let fault = group[0].differs(1).expect_err("alone");
    assert_eq!(fault.to_string(), "rank 1 has ended");
}
