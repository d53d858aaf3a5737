//! The basic modules: constants, stimuli, sums, noise, and closures of one's own.

mod add;
mod closures;
mod constant;
mod noise;
mod stimulus;

pub use add::Add;
pub use closures::{Apply, Signal};
pub use constant::Constant;
pub use noise::Noise;
pub use stimulus::Stimulus;
