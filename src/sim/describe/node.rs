//! The node trait.

use std::any::Any;

use super::fingerprint::Fingerprint;
use super::io::{AdvanceIo, EmitIo, Outputs, StateMut, StateRef, StepCx};
use super::parts::Parts;
use super::port::PortDecl;
use crate::sim::error::NodeFault;
use crate::sim::real::Real;

/// The smallest part of a graph: it computes outputs from inputs and state.
///
/// A node is immutable while the graph runs. The engine owns its state and lends it during each tick, so the engine can
/// reset, save and restore every node.
///
/// In each tick the engine first calls [`emit`](Node::emit) on every node that has ordinary (not registered) outputs,
/// in topological order. It then calls [`advance`](Node::advance) on every node that has state, registered outputs or
/// inputs read in advance; last on those with an input read at the end of the tick
/// ([`InputSpec::at_settle`](crate::sim::InputSpec::at_settle)). Neither method may allocate, lock or log.
///
/// This node has an input and an output of three numbers:
///
/// ```
/// use symbolt::sim::{EmitIo, Fingerprint, InputSpec, Node, OutputSpec, PortDecl, StepCx};
///
/// struct Square;
/// impl Node for Square {
///     fn declare(&self, ports: &mut PortDecl) {
///         ports.input("x", InputSpec::vector(3)).output("y", OutputSpec::vector(3));
///     }
///     fn fingerprint(&self, _hash: &mut Fingerprint) {} // no parameters
///     fn emit(&self, _cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
///         let x = io.inputs.get(0);
///         for (y, x) in io.outputs.get_mut(0).iter_mut().zip(x) {
///             *y = x * x;
///         }
///     }
/// }
/// ```
pub trait Node: Any + Send + Sync {
    /// Declares the node's ports, state and scratch memory. The engine may call this method more than once. Every call
    /// must make the same declarations.
    fn declare(&self, ports: &mut PortDecl);

    /// Adds the node's parameters to `hash`: every number that affects the node's results. The engine adds the
    /// declared ports and state itself.
    ///
    /// A graph refuses checkpoints of graphs with another fingerprint. If you leave out a parameter, the graph also
    /// accepts checkpoints that were taken with another value of that parameter.
    fn fingerprint(&self, hash: &mut Fingerprint);

    /// Returns the name of the node's type, which is part of the fingerprint. Do not override this method.
    fn type_name(&self) -> &'static str {
        std::any::type_name::<Self>()
    }

    /// Writes the initial state and registered outputs, which are zero before the call. Called by
    /// [`Simulator::new`](crate::sim::Simulator::new) and [`Simulator::reset`](crate::sim::Simulator::reset).
    ///
    /// The context is that of tick 0, but its random numbers are not those of the first tick.
    fn init(&self, cx: &StepCx<'_>, state: &mut StateMut<'_>, registered: &mut Outputs<'_>) {
        let _ = (cx, state, registered);
    }

    /// Computes the outputs of this tick from inputs and state.
    fn emit(&self, cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
        let _ = (cx, io);
    }

    /// Updates state and registered outputs for the next tick.
    ///
    /// # Errors
    /// A [`NodeFault`] ends the run. The run's error names the node and the tick.
    fn advance(&self, cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let _ = (cx, io);
        Ok(())
    }

    /// Returns the node as one that advances in parts, if it does. Most nodes do not.
    fn parts(&self) -> Option<&dyn Parts> {
        None
    }

    /// Returns the factor by which the node multiplies its input number `input` before it adds it to others, for drawings;
    /// `None` if it does something else with it.
    fn weight(&self, input: usize) -> Option<Real> {
        let _ = input;
        None
    }

    /// Returns the number of units that have events, such as neurons that spike. Most nodes have none. In a node with
    /// parts it is the sum over its parts.
    fn units(&self) -> usize {
        0
    }

    /// Returns whether `unit` had an event in the tick that produced this state. `unit` is less than
    /// [`units`](Node::units).
    fn event(&self, state: &StateRef<'_>, unit: usize) -> bool {
        let _ = (state, unit);
        false
    }
}
