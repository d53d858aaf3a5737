//! A bolt through a nut: both are put into a jig, then the bolt through the nut (section II.C of the paper).
//!
//! | file | what is in it |
//! |---|---|
//! | `settings`, `check` | dimensions, places and motors, and which of them make a task that can be done |
//! | `shapes`, `scene`, `start` | parts and jig, and where parts begin |
//! | `grasps` | how to take hold of a part |
//! | `demonstrator`, `judge` | how the task is shown, and when it is solved |
//! | [`synthetic`] | recordings drawn without physics |

#[cfg(feature = "physics")]
mod check;
#[cfg(feature = "physics")]
mod demonstrator;
#[cfg(feature = "physics")]
mod grasps;
#[cfg(feature = "physics")]
mod judge;
#[cfg(feature = "physics")]
mod scene;
#[cfg(feature = "physics")]
mod settings;
#[cfg(feature = "physics")]
mod shapes;
#[cfg(feature = "physics")]
mod start;
pub mod synthetic;
#[cfg(feature = "physics")]
mod task;

#[cfg(feature = "physics")]
pub use judge::Assembly;
#[cfg(feature = "physics")]
pub use settings::{JigSpec, MAX_OF_A_KIND, NutsAndBolts, PartSpec, TableSettings};
pub use synthetic::{Order, SyntheticDemonstrations, SyntheticRecording};
