//! Processes: nodes that are made when a graph is built.

use super::node::Node;
use super::port::PortDecl;
use crate::sim::seed::Seed;
use crate::sim::time::Timebase;

/// A description that becomes a [`Node`] when the graph is built, for nodes that need the length of a tick or the build
/// seed in advance: filters, tables, signals drawn once. A module adds it with [`Scope::process`](crate::sim::Scope::process).
///
/// ```
/// use symbolt::prelude::*;
/// use symbolt::sim::{EmitIo, Fingerprint, Node, OutputSpec, PortDecl, Process, StepCx};
///
/// /// A clock: the number of ticks in a second, known before the first tick.
/// struct TicksPerSecond;
/// struct Told(f32);
///
/// impl Process for TicksPerSecond {
///     fn declare(&self, ports: &mut PortDecl) {
///         ports.output("out", OutputSpec::scalar());
///     }
///     fn make(&self, time: Timebase, _seed: Seed) -> Result<Box<dyn Node>, String> {
///         Ok(Box::new(Told((1.0 / time.tick().as_secs_f64()) as f32)))
///     }
/// }
/// impl Node for Told {
///     fn declare(&self, ports: &mut PortDecl) {
///         TicksPerSecond.declare(ports);
///     }
///     fn fingerprint(&self, hash: &mut Fingerprint) {
///         hash.reals(&[self.0]);
///     }
///     fn emit(&self, _cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
///         io.outputs.set(0, self.0);
///     }
/// }
/// impl Module for TicksPerSecond {
///     type Ports = Out<Scalar>;
///     fn expand(self, scope: &mut Scope<'_>) -> Out<Scalar> {
///         scope.process(self).output("out")
///     }
/// }
///
/// let mut graph = GraphBuilder::new();
/// let clock = graph.add("clock", TicksPerSecond);
/// let mut sim = graph.start(&PopulationPlan::direct(), Seed::new(1))?;
/// sim.run_for(SimDuration::from_millis(1))?;
/// assert_eq!(sim.value(&clock)[0], 1000.0);
/// # Ok::<(), symbolt::sim::SimError>(())
/// ```
pub trait Process: Send + Sync + 'static {
    /// Declares the ports of the node. State and scratch are ignored; the node declares its own.
    fn declare(&self, ports: &mut PortDecl);

    /// Makes the node, with the same ports. `seed` derives from the build seed and the path of the node.
    ///
    /// # Errors
    /// The reason, in one sentence. `build` reports it with the path of the node.
    fn make(&self, time: Timebase, seed: Seed) -> Result<Box<dyn Node>, String>;
}
