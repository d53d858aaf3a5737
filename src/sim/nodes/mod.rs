//! The basic modules: constants, stimuli, random processes, sums, noise, and closures of one's own.

mod add;
mod closures;
mod constant;
mod noise;
mod spline;
mod stimulus;
mod white_noise;
mod white_signal;

pub use add::Add;
pub use closures::{Apply, Signal};
pub use constant::Constant;
pub use noise::Noise;
pub use stimulus::{Interpolation, Stimulus};
pub use white_noise::{NoiseDistribution, WhiteNoise};
pub use white_signal::WhiteSignal;
