//! Ticks of a graph with many small nodes, and of a graph with one large node.

#![allow(clippy::unwrap_used, clippy::expect_used)]
#![allow(missing_docs)]

#[path = "../tests/support/bank.rs"]
mod bank;

use std::sync::Arc;

use bank::Bank;
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use symbolt::neurons::PopulationPlan;
use symbolt::sim::{
    AdvanceIo, Constant, EmitIo, Fingerprint, Graph, GraphBuilder, InputSpec, Node, NodeFault,
    OutputSpec, PortDecl, RunConfig, Scalar, Seed, SimDuration, Simulator, StateSpec, StepCx,
    Synapse, Timebase,
};

fn build(graph: GraphBuilder) -> Arc<Graph> {
    match graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1)) {
        Ok(graph) => Arc::new(graph),
        Err(error) => panic!("{error}"),
    }
}

/// A node that passes a number on within the tick.
struct Pass;
impl Node for Pass {
    fn declare(&self, ports: &mut PortDecl) {
        ports.input("in", InputSpec::scalar()).output("out", OutputSpec::scalar());
    }

    fn fingerprint(&self, _hash: &mut Fingerprint) {}
    fn emit(&self, _cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
        let value = io.inputs.scalar(0);
        io.outputs.set(0, value + 1.0);
    }
}

/// A node that passes a number on in the next tick.
struct Hold;
impl Node for Hold {
    fn declare(&self, ports: &mut PortDecl) {
        ports
            .input("in", InputSpec::scalar().at_advance())
            .output("out", OutputSpec::scalar())
            .state(StateSpec { reals: 1, ..StateSpec::default() });
    }

    fn fingerprint(&self, _hash: &mut Fingerprint) {}
    fn emit(&self, _cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
        let value = io.state.reals[0];
        io.outputs.set(0, value);
    }
    fn advance(&self, _cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        io.state.reals[0] = io.inputs.scalar(0);
        Ok(())
    }
}

fn chain<N: Node + 'static>(nodes: usize, node: fn() -> N, via: Synapse) -> GraphBuilder {
    let mut graph = GraphBuilder::new();
    let mut last = graph.add("source", Constant::scalar(1.0));
    for i in 0..nodes {
        let ports = graph.node(&format!("n{i:04}"), node());
        graph.connect(&last, &ports.input::<Scalar>("in"), via);
        last = ports.output("out");
    }
    graph
}

fn graph(c: &mut Criterion) {
    let mut group = c.benchmark_group("graph");
    let ticks = 200;
    let nodes = 1_000;
    let cases = [
        ("tick_pass", chain(nodes, || Pass, Synapse::None)),
        ("tick_hold", chain(nodes, || Hold, Synapse::None)),
        ("tick_pass_filtered", chain(nodes, || Pass, Synapse::lowpass_ms(5))),
    ];
    // Each measurement runs many ticks. Throughput is in ticks.
    group.throughput(Throughput::Elements(ticks));
    for (name, described) in cases {
        let mut sim = Simulator::new(build(described), RunConfig::default()).expect("starts");
        group.bench_function(BenchmarkId::new(name, nodes), |b| {
            b.iter(|| sim.run_for(SimDuration::from_millis(ticks)).expect("runs"));
        });
    }
    group.bench_function(BenchmarkId::new("build", nodes), |b| {
        b.iter(|| build(chain(nodes, || Pass, Synapse::None)));
    });

    // Throughput is in neurons times ticks.
    let neurons = 100_000;
    let mut described = GraphBuilder::new();
    let drive = described.add("drive", Constant::scalar(0.5));
    let ports = described.node("bank", Bank::new(neurons));
    described.connect(&drive, &ports.input("drive"), Synapse::None);
    let mut sim = Simulator::new(build(described), RunConfig::default()).expect("starts");
    group.throughput(Throughput::Elements(neurons as u64 * 10));
    group.bench_function(BenchmarkId::new("lif_bank", neurons), |b| {
        b.iter(|| sim.run_for(SimDuration::from_millis(10)).expect("runs"));
    });
    group.finish();
}

criterion_group!(benches, graph);
criterion_main!(benches);
