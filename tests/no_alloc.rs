//! A tick allocates no memory. The count covers the whole process, so this test has its own binary, and no test harness:
//! the harness's own thread allocates while the test runs.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

#[path = "support/bank.rs"]
mod bank;

use bank::Bank;
use symbolt::neurons::{
    Bcm, Ensemble, Learned, LifSpec, Oja, Pes, Population, PopulationPlan, Rls, SelectRule, Tuning,
    Voja,
};
use symbolt::sim::{
    Add, Constant, GraphBuilder, Interpolation, Intervention, Live, LiveOptions, Noise, ProbeSpec,
    RunConfig, Scalar, Seed, SimDuration, Simulator, Stimulus, Synapse, Threads, Timebase, Vector,
    VocabTag, WhiteNoise, WhiteSignal,
};
use symbolt::spa::{
    AssociativeMemory, Bind, CleanupMemory, Compare, FlowExt, Gate, GoalBuffer, Linear, Routes,
    Rules, Superpose, Unbind, VocabularyBuilder,
};
use symbolt::task::DomainBuilder;
use symbolt::task::planner::{Planner, PlannerSpec, Unbinding};

struct Counting;

static ALLOCATIONS: AtomicUsize = AtomicUsize::new(0);
/// Bytes in use.
static BYTES: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call is passed unchanged to the system's allocator. Counting does not access the allocated memory.
#[allow(unsafe_code)]
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        BYTES.fetch_add(layout.size(), Ordering::Relaxed);
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        BYTES.fetch_sub(layout.size(), Ordering::Relaxed);
        unsafe { System.dealloc(at, layout) }
    }
    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        BYTES.fetch_add(size, Ordering::Relaxed);
        BYTES.fetch_sub(layout.size(), Ordering::Relaxed);
        unsafe { System.realloc(at, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Counts allocations while a simulator runs for `ms`. A probe is read after every tick.
fn allocations(sim: &mut Simulator, ms: u64) -> usize {
    let span = SimDuration::from_millis(ms);
    // The first block reserves the probes' storage, so it is not counted.
    sim.run_for(span).expect("runs");
    sim.clear_recordings();
    let before = ALLOCATIONS.load(Ordering::Relaxed);
    let mut looked = 0u64;
    sim.run_until(span, |view| {
        looked += view.tick().min(1);
        ControlFlow::Continue(())
    })
    .expect("runs");
    let after = ALLOCATIONS.load(Ordering::Relaxed);
    assert_eq!(looked, ms, "every tick was run");
    after - before
}

/// Counts allocations in one tick. Memory for samples is there.
fn first_tick(sim: &mut Simulator) -> usize {
    sim.clear_recordings();
    let before = ALLOCATIONS.load(Ordering::Relaxed);
    sim.run_for(SimDuration::from_millis(1)).expect("runs");
    ALLOCATIONS.load(Ordering::Relaxed) - before
}

fn checkpoints_take_the_memory_that_they_say() {
    let mut graph = GraphBuilder::new();
    let drive = graph.add("drive", Constant::vector(&[0.5, 0.2]));
    let cells = graph.add("cells", Ensemble::new(2).neurons(200).expose_neurons().identity("x"));
    graph.route(&drive >> &cells);
    let plan = PopulationPlan::lif();
    let sim = graph.start(&plan, Seed::new(1)).expect("starts");
    let options = LiveOptions { memory_bytes: 100_000, spacing_ticks: 2 };
    let mut live = Live::new(sim, options).expect("starts");
    let before = BYTES.load(Ordering::Relaxed) - live.memory_bytes();
    live.intervene(Intervention::Silence { at: "cells".into() }).expect("possible");
    for _ in 0..300 {
        live.step(1).expect("runs");
        assert!(live.memory_bytes() <= 100_000);
    }
    let said = live.memory_bytes();
    let taken = BYTES.load(Ordering::Relaxed) - before;
    assert!(said > 60_000, "{said}");
    assert!(taken.abs_diff(said) < 5_000, "{taken} bytes, said to be {said}");
}

struct Things;
impl VocabTag for Things {
    const NAME: &'static str = "things";
}

fn main() {
    nothing_allocates_in_a_tick();
    println!("test nothing_allocates_in_a_tick ... ok");
}

fn nothing_allocates_in_a_tick() {
    // The threads of the build allocate in their first steps.
    rayon::broadcast(|_| ());
    let small = LifSpec::tuned(Tuning { scale: 0.2, ..Tuning::default() });
    let mut counts = Vec::new();
    for population in [Population::Direct, Population::Rate(small), Population::Lif(small)] {
        graphs(&PopulationPlan::all(population), &mut counts);
    }

    // Connections that learn by every rule.
    let mut graph = GraphBuilder::new();
    let drive = graph.add("drive", Constant::vector(&[0.5, 0.2]));
    let cells = graph.add("cells", Ensemble::new(2).neurons(60).expose_neurons().identity("x"));
    graph.route(&drive >> &cells);
    let of = || Learned::new(&cells.neurons(), 60).post(&cells.neurons()).switched();
    let between = of().rule(Pes::default().toward_target()).rule(Oja::default()).expose("delta");
    let between = graph.add("between", between.rule(Bcm::default()).rule(Rls::default()));
    let target = graph.add("target", Constant::vector(&[1.0; 60]));
    graph.route(&target >> &between.target());
    graph.route(&between >> &cells.currents());
    graph.route(0.1 * &between >> &between.error());
    let encoders = Learned::encoders(2, &cells.neurons()).rule(Voja::default());
    let encoders = graph.add("encoders", encoders);
    graph.route(&drive >> &encoders.input());
    graph.route(&encoders >> &cells.encoded());
    let on = graph.add("on", Constant::scalar(1.0));
    graph.route(&on >> &between.learning());
    let plan = PopulationPlan::all(Population::Lif(small));
    let mut sim = graph.start(&plan, Seed::new(1)).unwrap_or_else(|e| panic!("{e}"));
    counts.push(("learning", allocations(&mut sim, 50)));

    // A bank of neurons as a single node.
    let mut graph = GraphBuilder::new();
    let drive = graph.add("drive", Constant::scalar(1.0));
    let bank = graph.node("bank", Bank::new(10_000));
    graph.connect(&drive, &bank.input("drive"), Synapse::None);
    let spikes = graph.probe::<Scalar>(&bank.output("spikes"), ProbeSpec::default());
    let graph = graph
        .build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1))
        .unwrap_or_else(|e| panic!("{e}"));
    let mut sim = Simulator::new(Arc::new(graph), RunConfig::default()).expect("starts");
    counts.push(("bank", allocations(&mut sim, 100)));
    // The bank fires at the closed-form rate 1 / (tau_ref + tau ln(J / (J - 1))), averaged over its neurons.
    let spikes: f32 = sim.samples(&spikes).iter().map(|(_, v)| v[0]).sum();
    let rate = f64::from(spikes) / 0.1 / 10_000.0;
    let expected = bank::mean_rate_hz(10_000, 1.0);
    assert!((rate / expected - 1.0).abs() < 0.05, "{rate} Hz, expected {expected} Hz");

    // A probe that keeps all samples reserves memory between blocks of ticks, not within them.
    let mut graph = GraphBuilder::new();
    let one = graph.add("one", Constant::vector(&[1.0; 8]));
    graph.probe::<Vector>(&one, ProbeSpec::default());
    let graph = graph
        .build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1))
        .unwrap_or_else(|e| panic!("{e}"));
    let mut sim = Simulator::new(Arc::new(graph), RunConfig::default()).expect("starts");
    let before = ALLOCATIONS.load(Ordering::Relaxed);
    sim.run_for(SimDuration::from_millis(4096 * 3)).expect("runs");
    let blocks = ALLOCATIONS.load(Ordering::Relaxed) - before;
    assert!((1..=6).contains(&blocks), "{blocks} allocations for three blocks");

    // The counter works: it notices a new vector.
    let before = ALLOCATIONS.load(Ordering::Relaxed);
    std::hint::black_box(vec![1u8; 100]);
    assert_eq!(ALLOCATIONS.load(Ordering::Relaxed) - before, 1);
    checkpoints_take_the_memory_that_they_say();
    assert_eq!(counts.len(), 14 + 3 * 7);
    assert!(counts.iter().all(|(_, count)| *count == 0), "{counts:?}");
}

fn graphs(plan: &PopulationPlan, counts: &mut Vec<(&'static str, usize)>) {
    // A graph with every module of the algebra, noise, and probes of every kind.
    let vocabulary = VocabularyBuilder::<Things>::new(64, Seed::new(1))
        .any_similarity()
        .pointers(["A", "B", "C"])
        .unitary("ROLE")
        .build()
        .expect("sound");
    let space = vocabulary.space();
    let mut graph = GraphBuilder::new();
    let a = graph.add("a", Constant::pointer(space, &vocabulary.get("A").expect("there")));
    let open = graph.add("open", Constant::scalar(1.0));
    let noise = graph.add("noise", Noise::pointer(space, 0.2));
    let bind = graph.add("bind", Bind::new(&vocabulary));
    let unbind = graph.add("unbind", Unbind::new(&vocabulary));
    let fixed = graph.add("fixed", Linear::unbind(&vocabulary, "ROLE").expect("there"));
    let sum = graph.add("sum", Superpose::new(&vocabulary, &[1.0, 0.5]));
    let winner = SelectRule::WinnerTakeAll { level: 0.3 };
    let cleanup = graph
        .add("cleanup", CleanupMemory::new(&vocabulary, ["A", "B", "C"], winner).expect("there"));
    let pairs = [("A", "B"), ("B", "C * ROLE")];
    let memory = graph.add(
        "memory",
        AssociativeMemory::new(&vocabulary, &vocabulary, pairs, winner).expect("there"),
    );
    let gate = graph.add("gate", Gate::new(&vocabulary));
    let buffer = graph.add("buffer", GoalBuffer::new(&vocabulary));
    let none = Synapse::None;
    graph.connect(&a, &noise.input, none);
    graph.connect(&noise.output, &bind.a, none);
    graph.connect(&a, &bind.b, none);
    graph.connect(&bind.output, &unbind.bound, none);
    graph.connect(&a, &unbind.role, none);
    graph.connect(&unbind.output, &fixed.input, Synapse::lowpass_ms(5));
    graph.connect(&fixed.output, &sum.inputs[0], none);
    graph.connect(&noise.output, &sum.inputs[1], none);
    graph.connect(&sum.output, &cleanup.input, none);
    graph.connect(&cleanup.output, &memory.input, none);
    graph.connect(&memory.output, &gate.input, none);
    graph.connect(&open, &gate.open, none);
    graph.connect(&gate.output, &buffer.input, none);
    graph.connect(&open, &buffer.open, none);
    let ensemble = graph.add(
        "ensemble",
        Ensemble::new(2).decode("product", 1, |x, out| out[0] = x[0] * x[1]).identity("same"),
    );
    let compare = graph.add("compare", Compare::new(&vocabulary));
    graph.route(noise.slice(0..2) >> &ensemble);
    graph.route(&a >> &compare.a);
    graph.route(&noise >> &compare.b);
    let rules = Rules::new()
        .rule("both", &compare * ensemble.output("product").component(0), [2.0 >> &buffer.open])
        .otherwise("wait", 0.5, []);
    graph.add("rules", rules);
    graph.probe_spikes("ensemble/neurons");
    // Every synapse and process.
    let wave = graph.add("wave", WhiteSignal::vector(3, SimDuration::from_millis(50), 100.0));
    let white = graph.add("white", WhiteNoise::vector(3));
    let drift = graph.add("drift", WhiteNoise::vector(3).integrated());
    let shown = Stimulus::vector(&[0.0; 3]).from(SimDuration::from_millis(9), &[1.0; 3]);
    let shown = shown.interpolate(Interpolation::Linear).repeat(SimDuration::from_millis(10));
    let shown = graph.add("shown", shown);
    let all = graph.add("all", Add::vector(3));
    let pair = [SimDuration::from_millis(2), SimDuration::from_millis(20)];
    graph.route((&wave >> &all).via(Synapse::alpha_ms(5)));
    graph.route((&white >> &all).via(Synapse::triangle_ms(8)));
    graph.route((&drift >> &all).via(Synapse::delay_ms(4)));
    graph.route((&shown >> &all).via(Synapse::DoubleExponential { rise: pair[0], decay: pair[1] }));
    let lead = Synapse::linear(&[0.01, 1.0], &[0.02, 1.0]);
    graph.probe(&all.output, ProbeSpec::default().filtered(lead));
    graph.probe(&buffer.output, ProbeSpec::default().filtered(Synapse::lowpass_ms(10)));
    graph.probe(&cleanup.items, ProbeSpec::every(SimDuration::from_millis(7)).last(5));
    let graph =
        graph.build(Timebase::default(), plan, Seed::new(1)).unwrap_or_else(|e| panic!("{e}"));
    let graph = Arc::new(graph);
    let mut sim = Simulator::new(graph.clone(), RunConfig::default()).expect("starts");
    counts.push(("modules", allocations(&mut sim, 200)));
    let threads = RunConfig::default().with_threads(Threads::Exactly(3));
    let mut sim = Simulator::new(graph, threads).expect("starts");
    counts.push(("modules on threads", allocations(&mut sim, 200)));
    // Every intervention. The first tick after one takes over what is silent.
    for what in [
        Intervention::Silence { at: "ensemble".into() },
        Intervention::Clamp { output: "open.out".into(), values: vec![0.5] },
        Intervention::Silence { at: "gate".into() },
        Intervention::Set { output: "shown.out".into(), values: vec![1.0; 3] },
        Intervention::Noise { at: Some("white".into()), scale: 0.5 },
    ] {
        sim.intervene(&what).expect("possible");
        counts.push(("interventions", first_tick(&mut sim)));
    }
    sim.intervene(&Intervention::Release { at: "ensemble".into() }).expect("held");
    counts.push(("a release", first_tick(&mut sim)));
    counts.push(("modules with interventions", allocations(&mut sim, 200)));

    // The planner graph during a decision.
    let domain = DomainBuilder::new()
        .action("PUT_NUT", ["NUT_FREE"], ["NUT_IN"])
        .action("PUT_BOLT", ["BOLT_FREE"], ["BOLT_IN"])
        .action_unless("JOIN", ["NUT_IN", "BOLT_IN"], ["JOINED"], ["JOINED"])
        .build()
        .expect("sound");
    for unbinding in [Unbinding::Fixed, Unbinding::Products] {
        let spec = PlannerSpec { unbinding, absent: true, ..PlannerSpec::default() };
        let planner = Planner::with_plan(&domain, spec, plan, Seed::new(1)).expect("builds");
        let world = domain.world(["NUT_FREE", "BOLT_FREE"]).expect("states");
        let goal = domain.state("JOINED").expect("a state");
        let mut sim = planner.simulator(&world, goal).expect("starts");
        counts.push(("planner", allocations(&mut sim, 200)));
    }
}
