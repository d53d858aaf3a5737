//! Stepping allocates nothing: one process-wide count, in a test binary of its own.

use std::alloc::{GlobalAlloc, Layout, System};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use symbolt::neurons::{PopulationPlan, SelectRule};
use symbolt::sim::{
    AdvanceIo, Constant, EmitIo, GraphBuilder, InputSpec, Node, NodeFault, Noise, OutputSpec,
    PortDecl, ProbeSpec, RunConfig, Scalar, Seed, SimDuration, Simulator, StateSpec, StepCx,
    Synapse, Timebase, Vector, VocabTag,
};
use symbolt::spa::{
    AssociativeMemory, Bind, CleanupMemory, Gate, GoalBuffer, Superpose, Unbind, UnbindFixed,
    VocabularyBuilder,
};
use symbolt::task::SymbolicDomain;
use symbolt::task::planner::{Planner, PlannerSpec, Unbinding};

struct Counting;

static ALLOCATIONS: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call is handed on to the system's allocator unchanged; counting touches no memory that
// is allocated here.
#[allow(unsafe_code)]
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        unsafe { System.dealloc(at, layout) }
    }
    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        unsafe { System.realloc(at, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Allocations while a simulator runs for `ms`, looked at after every tick.
fn allocations(sim: &mut Simulator, ms: u64) -> usize {
    let span = SimDuration::from_millis(ms);
    // Once to warm up: the first block reserves the probes' storage.
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

struct Things;
impl VocabTag for Things {
    const NAME: &'static str = "things";
}

/// A bank of leaky integrate-and-fire neurons, thrown away after showing that the node trait carries one:
/// event-driven decoding to one number, spike times corrected within the step.
struct Bank {
    neurons: usize,
}

impl Node for Bank {
    fn declare(&self, ports: &mut PortDecl) {
        ports
            .input("drive", InputSpec::scalar())
            .output("decoded", OutputSpec::scalar().registered())
            // Voltages, then remaining refractory times.
            .state(StateSpec { reals: 2 * self.neurons, ..StateSpec::default() });
    }
    fn advance(&self, cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let dt = cx.dt_s() as f32;
        let decay = -(-dt / 0.02).exp_m1();
        let drive = io.inputs.scalar(0);
        let (voltage, rest) = io.state.reals.split_at_mut(self.neurons);
        let mut decoded = 0.0;
        for (i, (v, r)) in voltage.iter_mut().zip(rest).enumerate() {
            let current = 1.0 + drive * (1.0 + (i % 97) as f32 * 0.02);
            *r -= dt;
            let share = (-*r / dt).clamp(0.0, 1.0);
            *v += (current - *v) * decay * share;
            if *v > 1.0 {
                *r = 0.002 - dt * (*v - 1.0) / (current - 1.0).max(1e-6);
                *v = 0.0;
                decoded += 0.01;
            }
        }
        io.outputs.set(0, decoded);
        Ok(())
    }
    fn emit(&self, _cx: &StepCx<'_>, _io: &mut EmitIo<'_>) {}
}

#[test]
fn nothing_allocates_in_a_tick() {
    let mut counts = Vec::new();

    // Every module of the algebra, with noise and probes of every kind.
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
    let fixed = graph.add("fixed", UnbindFixed::new(&vocabulary, "ROLE").expect("there"));
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
    graph.probe(&buffer.output, ProbeSpec::default().filtered(Synapse::lowpass_ms(10)));
    graph.probe(&cleanup.items, ProbeSpec::every(SimDuration::from_millis(7)).last(5));
    let graph = graph
        .build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1))
        .unwrap_or_else(|e| panic!("{e}"));
    let mut sim = Simulator::new(Arc::new(graph), RunConfig::default()).expect("starts");
    counts.push(("modules", allocations(&mut sim, 200)));

    // The planner graph, deciding.
    let domain = SymbolicDomain::new()
        .action("PUT_NUT", ["NUT_FREE"], ["NUT_IN"])
        .action("PUT_BOLT", ["BOLT_FREE"], ["BOLT_IN"])
        .action_unless("JOIN", ["NUT_IN", "BOLT_IN"], ["JOINED"], ["JOINED"])
        .build()
        .expect("sound");
    for unbinding in [Unbinding::Fixed, Unbinding::Products] {
        let spec = PlannerSpec { unbinding, absent: true, ..PlannerSpec::default() };
        let planner = Planner::new(&domain, spec, Seed::new(1)).expect("builds");
        let world = [true, false, true, false, false];
        let mut sim = planner.simulator(&world, "JOINED").expect("starts");
        counts.push(("planner", allocations(&mut sim, 200)));
    }

    // A bank of neurons behind the node trait.
    let mut graph = GraphBuilder::new();
    let drive = graph.add("drive", Constant::scalar(1.0));
    let bank = graph.node("bank", Bank { neurons: 10_000 });
    graph.connect(&drive, &bank.input("drive"), Synapse::None);
    let spikes = graph.probe::<Scalar>(&bank.output("decoded"), ProbeSpec::default());
    let graph = graph
        .build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1))
        .unwrap_or_else(|e| panic!("{e}"));
    let mut sim = Simulator::new(Arc::new(graph), RunConfig::default()).expect("starts");
    counts.push(("bank", allocations(&mut sim, 100)));
    // It fires: at a drive of 1 the closed form 1 / (tau_ref + tau ln(J / (J - 1))) gives 60 to 160 Hz.
    let total: f32 = sim.samples(&spikes).iter().map(|(_, v)| v[0] / 0.01).sum();
    let rate = total / 0.1 / 10_000.0;
    assert!((60.0..160.0).contains(&rate), "{rate} Hz");

    // A probe that keeps everything reserves between blocks of ticks, not within them.
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

    // The count can count: a vector is seen.
    let before = ALLOCATIONS.load(Ordering::Relaxed);
    std::hint::black_box(vec![1u8; 100]);
    assert_eq!(ALLOCATIONS.load(Ordering::Relaxed) - before, 1);
    assert_eq!(counts.len(), 4);
    assert!(counts.iter().all(|(_, count)| *count == 0), "{counts:?}");
}
