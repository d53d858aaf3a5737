//! The order of events in a tick, delays of connections, probes, worlds, and when a run stops.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::ops::ControlFlow;
use std::sync::Arc;

use symbolt::neurons::{Ensemble, PopulationPlan};
use symbolt::sim::{
    Add, AdvanceIo, Constant, EmitIo, Fingerprint, Graph, GraphBuilder, In, InputSpec, Node,
    NodeFault, Out, OutputSpec, PortDecl, ProbeId, ProbeSpec, RunConfig, Scalar, ScriptedWorld,
    Seed, SimDuration, SimError, Simulator, StepCx, Stimulus, StopReason, Synapse, Vector,
    WorldLink,
};

use crate::counter::{Counter, MS, build, start};

#[test]
fn an_edge_without_a_synapse_costs_no_tick_and_one_with_a_synapse_or_a_register_one() {
    let mut graph = GraphBuilder::new();
    let counter = graph.node("counter", Counter);
    let step = graph.add("step", Constant::scalar(1.0));
    let plain = graph.add("plain", Add::scalar());
    let filtered = graph.add("filtered", Add::scalar());
    let registered = graph.add("registered", Add::scalar());
    graph.connect(&counter.output("now"), &plain.input, Synapse::None);
    graph.connect(&step, &filtered.input, Synapse::lowpass_ms(5));
    graph.connect(&counter.output("later"), &registered.input, Synapse::None);
    let probes = [&plain.output, &filtered.output, &registered.output]
        .map(|out| graph.probe(out, ProbeSpec::default()));
    let mut sim = start(&build(graph));
    sim.run_for(MS(3)).expect("runs");
    let read =
        |i: usize| -> Vec<f32> { sim.samples(&probes[i]).iter().map(|(_, v)| v[0]).collect() };
    assert_eq!(read(0), [10.0, 11.0, 12.0]);
    // Readers see the initial value in the first tick. They see a value written in a tick one tick later.
    assert_eq!(read(2), [10.0, 11.0, 12.0]);
    let (a, filtered) = ((-0.2f64).exp() as f32, read(1));
    assert_eq!(filtered[0], 0.0);
    assert!((filtered[1] - (1.0 - a)).abs() < 1e-6 && (filtered[2] - (1.0 - a * a)).abs() < 1e-6);
    let times: Vec<f64> = sim.samples(&probes[0]).iter().map(|(t, _)| t).collect();
    assert_eq!(times, [0.001, 0.002, 0.003]);
}

#[test]
fn a_registered_output_behind_a_synapse_costs_one_tick_in_all() {
    // The output and the filter behind it are updated together: the filter takes the value that was just written.
    let mut graph = GraphBuilder::new();
    let counter = graph.node("counter", Counter);
    let sum = graph.add("sum", Add::scalar());
    graph.connect(&counter.output("later"), &sum.input, Synapse::lowpass_ms(5));
    let probe = graph.probe(&sum.output, ProbeSpec::default());
    let mut sim = start(&build(graph));
    sim.run_for(MS(2)).expect("runs");
    let values: Vec<f32> = sim.samples(&probe).iter().map(|(_, v)| v[0]).collect();
    let gain = 1.0 - (-0.2f64).exp() as f32;
    assert_eq!(values[0], 0.0);
    assert!((values[1] - gain * 11.0).abs() < 1e-5, "{values:?}");
}

#[test]
fn several_sources_add_in_the_order_of_their_paths_whatever_the_order_of_adding() {
    let describe = |order: [usize; 3]| {
        let mut graph = GraphBuilder::new();
        let sum = graph.add("sum", Add::scalar());
        // The order matters: in single precision (1e8 + 1) - 1e8 differs from (1e8 - 1e8) + 1.
        let values = [1e8, 1.0, -1e8];
        for i in order {
            let source = graph.add(&format!("s{i}"), Constant::scalar(values[i]));
            graph.connect(&source, &sum.input, Synapse::None);
        }
        let probe = graph.probe(&sum.output, ProbeSpec::default());
        let mut sim = start(&build(graph));
        sim.run_for(MS(1)).expect("runs");
        sim.samples(&probe).last().map(|(_, v)| v[0])
    };
    let first = describe([0, 1, 2]);
    assert_eq!(first, Some(0.0));
    for order in [[0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        assert_eq!(describe(order), first);
    }
}

/// A node without ordinary outputs, which shows its input one tick later.
struct Keeps;
impl Node for Keeps {
    fn declare(&self, ports: &mut PortDecl) {
        ports.input("in", InputSpec::scalar().sum());
        ports.output("kept", OutputSpec::scalar().registered());
    }
    fn fingerprint(&self, _hash: &mut Fingerprint) {}
    fn advance(&self, _cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let sum = io.inputs.scalar(0);
        io.outputs.set(0, sum);
        Ok(())
    }
}

#[test]
fn a_node_without_ordinary_outputs_gets_the_sum_of_all_its_sources() {
    for sources in [1, 2, 3] {
        let mut graph = GraphBuilder::new();
        let node = graph.node("node", Keeps);
        for number in 0..sources {
            let one = graph.add(&format!("one_{number}"), Constant::scalar(1.0));
            graph.connect(&one, &node.input("in"), Synapse::None);
        }
        let mut sim = start(&build(graph));
        sim.run_for(MS(1)).expect("runs");
        assert_eq!(sim.value(&node.output::<Scalar>("kept")), [sources as f32]);
    }
}

#[test]
fn one_description_is_built_in_two_modes() {
    let describe = || {
        let mut graph = GraphBuilder::new();
        let half = graph.add("half", Constant::vector(&[0.5]));
        let square = Ensemble::new(1).decode("square", 1, |x, out| out[0] = x[0] * x[0]);
        let square = graph.add("square", square);
        let sum = graph.add("sum", Add::vector(1));
        graph.connect(&half, &square.input, Synapse::None);
        graph.connect(&square.output("square"), &sum.input, Synapse::lowpass_ms(20));
        let probe = graph.probe(&sum.output, ProbeSpec::default());
        (graph, probe)
    };
    let (exact, spiking) = (PopulationPlan::direct(), PopulationPlan::lif());
    let read = |graph: &GraphBuilder, probe: ProbeId<Vector>, plan: &PopulationPlan| -> Vec<f32> {
        let sim = graph.run(plan, Seed::new(3), MS(200)).expect("runs");
        sim.samples(&probe).iter().map(|(_, value)| value[0]).collect()
    };
    let (both, probe) = describe();
    let found = [&exact, &spiking].map(|plan| read(&both, probe, plan));
    for (found, plan) in found.iter().zip([&exact, &spiking]) {
        let (alone, probe) = describe();
        assert_eq!(*found, read(&alone, probe, plan));
    }
    assert!((found[0][199] - 0.25).abs() < 1e-4, "{}", found[0][199]);
    assert!(found[0] != found[1] && (found[1][199] - 0.25).abs() < 0.1, "{}", found[1][199]);
}

#[test]
fn a_filtered_loop_integrates() {
    let mut graph = GraphBuilder::new();
    let sum = graph.add("sum", Add::scalar());
    let pulse = graph.add("pulse", Stimulus::scalar(1.0).from(MS(10), &[0.0]));
    graph.connect(&sum.output, &sum.input, Synapse::lowpass_ms(100));
    graph.connect(&pulse, &sum.input, Synapse::None);
    let probe = graph.probe(&sum.output, ProbeSpec::default());
    let mut sim = start(&build(graph));
    sim.run_for(MS(1000)).expect("runs");
    let values: Vec<f32> = sim.samples(&probe).iter().map(|(_, v)| v[0]).collect();
    assert_eq!(values.len(), 1000);
    // During the input y' = u / tau, so each tick adds 1 - a.
    let expected = 10.0 * (1.0 - (-0.01f64).exp()) as f32;
    assert!(
        (values[11] - expected).abs() < 1e-5 && (values[999] - expected).abs() < 1e-4,
        "{values:?}"
    );
}

/// A node that fails in a given tick.
struct Breaks {
    at: u64,
    how: &'static str,
}
impl Node for Breaks {
    fn declare(&self, ports: &mut PortDecl) {
        ports.output("out", OutputSpec::scalar()).advances();
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.number(self.at).text(self.how);
    }
    fn emit(&self, cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
        let bad = cx.tick() == self.at && self.how == "nan";
        io.outputs.set(0, if bad { f32::NAN } else { 1.0 });
    }
    fn advance(&self, cx: &StepCx<'_>, _io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        if cx.tick() == self.at && self.how == "fault" {
            return Err(NodeFault { reason: "the coil is hot".into() });
        }
        Ok(())
    }
}

#[test]
fn the_error_for_a_nan_names_path_port_and_tick() {
    let mut graph = GraphBuilder::new();
    graph.node("good", Breaks { at: 99, how: "nan" });
    graph.node("bad", Breaks { at: 3, how: "nan" });
    let error = start(&build(graph)).run_for(MS(10)).expect_err("breaks");
    assert_eq!(error.to_string(), "`bad.out` became NaN in tick 3; expected a finite number");
}

#[test]
fn a_node_that_fails_ends_the_run() {
    let mut graph = GraphBuilder::new();
    graph.node("coil", Breaks { at: 4, how: "fault" });
    let mut sim = start(&build(graph));
    let error = sim.run_for(MS(10)).expect_err("breaks");
    assert_eq!(error.to_string(), "`coil` failed in tick 4: the coil is hot");
    assert_eq!(sim.tick(), 4);
}

#[test]
fn a_run_that_failed_within_a_tick_is_neither_saved_nor_continued() {
    for how in ["fault", "nan"] {
        let mut graph = GraphBuilder::new();
        graph.node("coil", Breaks { at: 4, how });
        graph.node("counter", Counter);
        let mut sim = start(&build(graph));
        sim.run_for(MS(3)).expect("runs");
        let whole = sim.checkpoint().expect("it can be saved");
        let why = sim.run_for(MS(10)).expect_err("breaks").to_string();
        let expected =
            format!("the run was interrupted in tick 4 ({why}); reset it or restore a checkpoint");
        assert_eq!(sim.checkpoint().expect_err("half a tick").to_string(), expected);
        assert_eq!(sim.run_for(MS(1)).expect_err("half a tick").to_string(), expected);
        sim.restore(&whole).expect("it fits");
        assert_eq!(sim.checkpoint().expect("it can be saved"), whole);
        assert_eq!(sim.run_for(MS(10)).expect_err("breaks again").to_string(), why);
        sim.reset().expect("resets");
        sim.run_for(MS(3)).expect("runs");
        assert_eq!(sim.checkpoint().expect("it can be saved"), whole);
    }
}

#[test]
fn run_until_returns_why_it_stopped() {
    let mut graph = GraphBuilder::new();
    let counter = graph.node("counter", Counter);
    let now: Out<Scalar> = counter.output("now");
    let graph = build(graph);
    let mut sim = start(&graph);
    let stop = |limit: f32, now: Out<Scalar>| {
        move |view: symbolt::sim::SimView<'_>| {
            if view.value(&now)[0] >= limit {
                ControlFlow::Break(StopReason::Condition("counted"))
            } else {
                ControlFlow::Continue(())
            }
        }
    };
    let report = sim.run_until(MS(100), stop(14.0, now.clone())).expect("runs");
    assert_eq!(
        (report.reason, report.ticks, report.span),
        (StopReason::Condition("counted"), 5, MS(5))
    );
    let report = sim.run_until(MS(7), stop(1e9, now)).expect("runs");
    assert_eq!((report.reason, report.ticks), (StopReason::TimeUp, 7));
    assert_eq!(sim.tick(), 12);
    let odd = SimDuration::from_micros(1_000_000 / 240);
    assert!(matches!(sim.run_for(odd), Err(SimError::Config(_))));
    assert_eq!(sim.tick(), 12);
}

#[test]
fn probes_sample_by_period_keep_the_last_and_have_filters_of_their_own() {
    let mut graph = GraphBuilder::new();
    let counter = graph.node("counter", Counter);
    let now: Out<Scalar> = counter.output("now");
    let sparse = graph.probe(&now, ProbeSpec::every(MS(4)));
    let ring = graph.probe(&now, ProbeSpec::default().last(3));
    let smooth = graph.probe(&now, ProbeSpec::default().filtered(Synapse::lowpass_ms(10)));
    let mut sim = start(&build(graph));
    sim.run_for(MS(5)).expect("runs");
    sim.run_for(MS(5)).expect("runs");
    let sparse: Vec<(f64, f32)> = sim.samples(&sparse).iter().map(|(t, v)| (t, v[0])).collect();
    assert_eq!(sparse, [(0.004, 13.0), (0.008, 17.0)]);
    let ring: Vec<f32> = sim.samples(&ring).iter().map(|(_, v)| v[0]).collect();
    assert_eq!(ring, [17.0, 18.0, 19.0]);
    let smooth: Vec<f32> = sim.samples(&smooth).iter().map(|(_, v)| v[0]).collect();
    let a = (-0.1f64).exp();
    let expected = (0..10).fold(0.0, |y: f64, k| a * y + (1.0 - a) * (10.0 + f64::from(k)));
    assert_eq!(smooth.len(), 10);
    assert!((f64::from(smooth[9]) - expected).abs() < 1e-5);
}

fn with_world() -> (Arc<Graph>, Out<Vector>, In<Scalar>) {
    let mut graph = GraphBuilder::new();
    let world = graph.world(
        "world",
        WorldLink::new()
            .sense("seen", OutputSpec::vector(2))
            .command("go", InputSpec::scalar())
            .command("idle", InputSpec::vector(2)),
    );
    let counter = graph.node("counter", Counter);
    let go = world.input("go");
    graph.connect(&counter.output("now"), &go, Synapse::None);
    let seen = world.output("seen");
    graph.probe(&seen, ProbeSpec::default());
    (build(graph), seen, go)
}

fn script() -> ScriptedWorld {
    ScriptedWorld::new(MS(4), vec![vec![1.0, 0.0], vec![2.0, 0.5], vec![3.0, 1.0]], 3)
}

#[test]
fn a_world_is_stepped_by_its_period_and_its_senses_are_held_between() {
    let (graph, seen, _) = with_world();
    let mut sim = Simulator::new(graph, RunConfig::default().in_world(script())).expect("starts");
    let mut shown = Vec::new();
    sim.run_until(MS(10), |view| {
        shown.push(view.value(&seen)[0]);
        ControlFlow::Continue(())
    })
    .expect("runs");
    // A tick sees the senses as of the previous tick: the second entry appears after 4 ticks.
    assert_eq!(shown, [1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0, 3.0, 3.0, 3.0]);
}

#[test]
fn a_world_gets_the_command_of_the_tick_in_which_it_is_due() {
    let (graph, ..) = with_world();
    let mut sim = Simulator::new(graph, RunConfig::default().in_world(script())).expect("starts");
    sim.run_for(MS(9)).expect("runs");
    let saved = sim.world().map(|w| w.save().expect("it can be saved")).expect("there is a world");
    let mut copy = script();
    symbolt::sim::World::restore(&mut copy, &saved).expect("its own save");
    // Ticks 3 and 7 are the last of a period. The counter is then at 13 and 17. Unconnected inputs are zero.
    assert_eq!(copy.commands(), [vec![13.0, 0.0, 0.0], vec![17.0, 0.0, 0.0]]);
}

#[test]
fn worlds_that_do_not_fit_are_refused() {
    let (graph, ..) = with_world();
    let refuse = |run: RunConfig| Simulator::new(graph.clone(), run).err().map(|e| e.to_string());
    let none = refuse(RunConfig::default());
    let expected =
        "the graph links to a world but the run has none; add one with `RunConfig::in_world`";
    assert_eq!(none.as_deref(), Some(expected));
    let narrow = ScriptedWorld::new(MS(4), vec![vec![1.0]], 3);
    let text = refuse(RunConfig::default().in_world(narrow)).unwrap_or_default();
    assert_eq!(
        text,
        "the world has 1 sense values but the world link `world` has 2; expected equal numbers"
    );
    let slow = ScriptedWorld::new(SimDuration::from_micros(4_166), vec![vec![1.0, 2.0]], 3);
    let text = refuse(RunConfig::default().in_world(slow)).unwrap_or_default();
    assert!(text.contains("not a whole number of ticks"), "{text}");
    let failing = script().failing_at(1);
    let mut sim = Simulator::new(graph, RunConfig::default().in_world(failing)).expect("starts");
    let error = sim.run_for(MS(20)).expect_err("fails").to_string();
    assert_eq!(error, "the world failed in tick 7: scripted failure at step 1");
}
