//! Helpers that build and start a graph, and a node that counts ticks.

use std::sync::Arc;

use symbolt::neurons::PopulationPlan;
use symbolt::sim::{
    AdvanceIo, EmitIo, Fingerprint, Graph, GraphBuilder, Node, NodeFault, OutputSpec, Outputs,
    PortDecl, RunConfig, Seed, SimDuration, Simulator, StateMut, StateSpec, StepCx, Timebase,
};

/// Builds the graph in direct mode.
pub fn build(graph: GraphBuilder) -> Arc<Graph> {
    match graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1)) {
        Ok(graph) => Arc::new(graph),
        Err(error) => panic!("{error}"),
    }
}

/// Starts a run of a graph.
pub fn start(graph: &Arc<Graph>) -> Simulator {
    Simulator::new(graph.clone(), RunConfig::default()).expect("starts")
}

/// Makes a duration from milliseconds.
pub const MS: fn(u64) -> SimDuration = SimDuration::from_millis;

/// A node that counts ticks from 10. The output `now` shows the count in the same tick; `later` is registered.
pub struct Counter;
impl Node for Counter {
    fn declare(&self, ports: &mut PortDecl) {
        ports
            .output("now", OutputSpec::scalar())
            .output("later", OutputSpec::scalar().registered())
            .state(StateSpec { words: 1, ..StateSpec::default() });
    }

    fn fingerprint(&self, _hash: &mut Fingerprint) {}
    fn init(&self, _cx: &StepCx<'_>, state: &mut StateMut<'_>, registered: &mut Outputs<'_>) {
        state.words[0] = 10;
        registered.set(1, 10.0);
    }
    fn emit(&self, _cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
        let count = io.state.words[0];
        io.outputs.set(0, count as f32);
    }
    fn advance(&self, _cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        io.state.words[0] += 1;
        let count = io.state.words[0];
        io.outputs.set(1, count as f32);
        Ok(())
    }
}
