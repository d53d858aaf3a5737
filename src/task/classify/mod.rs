//! Classification: finds the state, the place and the reference of each object in a scene.
//!
//! [`Classifier`] compares the poses of a scene with the states of a learned domain. It returns a [`Layout`].

mod classifier;
mod layout;
mod places;
mod tolerance;
mod upright;

pub use classifier::{Classifier, ClassifierRule};
pub use layout::{Layout, Located, Miss};
pub use tolerance::Offset;
