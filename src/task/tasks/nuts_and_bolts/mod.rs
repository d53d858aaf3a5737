//! The nut-and-bolt task: put a nut and a bolt into a jig, then put the bolt through the nut (section II.C of
//! the paper).
//!
//! [`NutsAndBolts`] holds the settings and is the [`Task`](crate::task::tasks::Task).
//! [`SyntheticDemonstrations`] draws recordings of the task without physics.
//!
//! | file | contents |
//! |---|---|
//! | `settings`, `check` | dimensions, places and motors, and the rules that they must meet |
//! | `shapes`, `scene`, `start` | shapes of parts and jig, the scene, and where the parts begin |
//! | `domain` | states and actions by name, [`DomainBuilder::of_the_paper`](crate::task::DomainBuilder::of_the_paper) |
//! | `grasps` | the grasps for nuts and bolts |
//! | `demonstrator`, `judge` | how the task is shown, and when it is solved |
//! | [`synthetic`] | recordings drawn from a seed without physics |

#[cfg(feature = "physics")]
mod check;
#[cfg(feature = "physics")]
mod demonstrator;
mod domain;
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
