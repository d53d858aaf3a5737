//! The modules that semantic pointers flow through.
//!
//! One convention holds for all: a module filters the output of its own populations (5 ms unless it
//! says otherwise), so whatever it hands out may be connected without a synapse. A module's delay is
//! therefore stated in its own doc, and is the same whatever computes its layers.

mod basal_ganglia;
mod bind;
mod gate;
mod goal_buffer;
mod linear;
mod memory;
mod select;
mod state;

pub use basal_ganglia::{BasalGanglia, BasalGangliaPorts};
pub use bind::{Bind, BindPorts, Unbind, UnbindFixed, UnbindFixedPorts, UnbindPorts};
pub use gate::{Gate, GatePorts};
pub use goal_buffer::{GoalBuffer, GoalBufferPorts};
pub use linear::{Linear, LinearPorts, Reinterpret, ReinterpretPorts, Superpose, SuperposePorts};
pub use memory::{AssociativeMemory, CleanupMemory, MemoryPorts};
pub use select::{Selection, SelectionPorts};
pub use state::{State, StatePorts};

use crate::neurons::Represent;
use crate::sim::{InputSpec, OutputSpec, Pointer, Real, Space, Synapse, VocabTag};

/// The synapse on the output of a module's populations unless the module is told otherwise.
pub const FEED_FORWARD: Synapse = Synapse::lowpass_ms(5);

/// The synapse by which a memory holds its value unless it is told otherwise.
pub const RECURRENT: Synapse = Synapse::lowpass_ms(100);

/// A request for a population of pointers of `space` of norm up to `radius`.
fn population<V: VocabTag>(space: &Space<V>, radius: Real) -> Represent {
    let (input, output) = (InputSpec::pointer(space), OutputSpec::pointer(space));
    Represent::new::<Pointer<V>>(input, output, radius)
}
