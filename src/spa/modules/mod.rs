//! Modules for graphs of semantic pointers.
//!
//! Every module filters the output of its populations with a synapse of 5 ms, unless its docs say otherwise. You can
//! therefore connect its outputs without a synapse. The docs of each module state its delay, which is the same in
//! every mode. How far the answers of a module differ between the modes is bounded: `docs/agreement.md` has the bound of
//! each, with its inputs and changes.

mod basal_ganglia;
mod bilinear;
mod bind;
mod factored;
mod gate;
mod goal_buffer;
mod integrator;
mod linear;
mod maps;
mod memory;
mod pair_decoder;
mod resonator;
mod select;
mod sequence;
mod state;
mod tape;
mod weighted_sum;

pub use basal_ganglia::{BasalGanglia, BasalGangliaPorts};
pub use bilinear::{Compare, Multiply, Weigh, WeighPorts};
pub use bind::{Bind, Unbind, UnbindPorts};
pub use factored::{FactoredSimilarity, FactoredSimilarityPorts, JointMemory, JointMemoryPorts};
pub use gate::{Gate, ValueGate};
pub use goal_buffer::{GatedMemory, GoalBuffer};
pub use integrator::{Integrator, Oscillator, OscillatorPorts};
pub use linear::Linear;
pub(crate) use maps::{Inverse, Rows, Slice, Sparse, Spread, WeightedRows, weighted_rows};
pub use memory::{AssociativeMemory, CleanupMemory, MemoryPorts};
pub use pair_decoder::{DecodePairs, DecodePairsPorts};
pub use resonator::{ResonatorNetwork, ResonatorNetworkPorts};
pub use select::{Selection, SelectionPorts};
pub use sequence::{Sequence, SequencePorts};
pub use state::State;
pub use tape::{Tape, TapePorts};
pub use weighted_sum::{Superpose, SuperposePorts};

use crate::neurons::Represent;
use crate::sim::{InputSpec, OutputSpec, Pointer, Real, Scope, Space, Synapse, VocabTag};

/// Default synapse on the output of a module's populations: a low-pass of 5 ms.
pub const FEED_FORWARD: Synapse = Synapse::lowpass_ms(5);

/// Default recurrent synapse of a memory: a low-pass of 100 ms.
pub const RECURRENT: Synapse = Synapse::lowpass_ms(RECURRENT_MS);

const RECURRENT_MS: u64 = 100;

/// Refuses a module without any of its parts, in one sentence for all nodes in it.
fn refuse_none(scope: &mut Scope<'_>, parts: &str, count: usize) {
    if count == 0 {
        scope.refuse(format!("0 {parts}; expected at least one"));
    }
}

/// Requests a population for pointers of `space` with a norm of up to `radius`.
fn population<V: VocabTag>(space: &Space<V>, radius: Real) -> Represent {
    let (input, output) = (InputSpec::pointer(space), OutputSpec::pointer(space));
    Represent::new::<Pointer<V>>(input, output, radius)
}
