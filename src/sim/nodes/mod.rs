//! The basic modules: constants, stimuli, sums, noise, and closures of one's own.

mod add;
mod closures;
mod constant;
mod noise;
mod stimulus;

pub use add::{Add, AddPorts};
pub use closures::{Apply, ApplyPorts, Signal};
pub use constant::Constant;
pub use noise::{Noise, NoisePorts};
pub use stimulus::Stimulus;
