//! Vector-symbolic algebra, vocabularies, and the modules that semantic pointers flow through.
//!
//! Nothing here knows tasks or robots.

mod algebra;
mod error;
mod expr;
mod item_memory;
mod modules;
mod pairs;
mod pointer;
mod vocabulary;

pub use crate::sim::PointerRef;
pub use algebra::{
    Algebra, Hrr, LinearMap, ProductForm, Workspace, cosine, cosine_of_slices, dot, norm, normalize,
};
pub use error::VocabError;
pub(crate) use error::nearest_name;
pub(crate) use item_memory::dots;
pub use item_memory::{ItemMemory, Match};
pub use modules::{
    AssociativeMemory, BasalGanglia, BasalGangliaPorts, Bind, BindPorts, CleanupMemory,
    FEED_FORWARD, Gate, GatePorts, GoalBuffer, GoalBufferPorts, Linear, LinearPorts, MemoryPorts,
    RECURRENT, Reinterpret, ReinterpretPorts, Selection, SelectionPorts, State, StatePorts,
    Superpose, SuperposePorts, Unbind, UnbindFixed, UnbindFixedPorts, UnbindPorts,
};
pub use pairs::{Filler, PairDecoder};
pub use pointer::PointerValue;
pub(crate) use vocabulary::draw_pointer;
pub use vocabulary::{Vocabulary, VocabularyBuilder, random_pointer};
