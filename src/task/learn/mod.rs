//! Learning from demonstrations: states from where objects were, operators from how states changed.
//!
//! The steps are those of the paper's sections II.A and II.E. For each kind of object: pairwise
//! [`p_distance`], a [`Dendrogram`] by average linkage, a cut, a robust mean and a 6-D Gaussian for
//! each cluster. Then tries, global states before and after each, and the counts ([`Evidence`])
//! from which preconditions and effects follow. The learner is given poses and, if the recording has them,
//! which object was touched; never names of states or actions, nor how many there are.
//!
//! Beyond the paper: the threshold is found from the data (see [`Settings::threshold_m`]), the
//! manipulated object is inferred where it was not recorded, and tries that failed are told from
//! actions.

mod conclude;
mod gaussian;
mod linkage;
mod names;
mod operators;
mod scene;
mod summary;
mod threshold;
mod tracks;
mod tries;
mod ways;

pub use crate::task::domain::distance::{
    PAPER_EXPONENT, check_exponent, distance_matrix, p_distance,
};
pub use gaussian::{PoseGaussian, robust_mean};
pub use linkage::{Dendrogram, MOST_POINTS, Merge};
pub use operators::{Evidence, GlobalState, Instance};
pub use summary::{Failure, LearnReport, Outcome, StrayPoses, TryReport};
pub use threshold::RESOLUTION;
pub use tries::MOVED_M;

use crate::task::domain::Domain;
use crate::task::domain::Recording;
use crate::task::error::TaskError;
use scene::Scene;

/// How to learn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// The exponent of the distance; the paper uses -2.
    pub p: f64,
    /// The clustering threshold in metres, the same for every kind; the paper uses 0.001169.
    /// `None` finds one for each kind: the coarsest clustering under which the manipulated part
    /// ends nearly every try in another state than it began in, setting aside tries that left a
    /// coordinate the same to a [`RESOLUTION`] of the way that the part went.
    pub threshold_m: Option<f64>,
    /// Kept with the domain; learning itself draws nothing.
    pub seed: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { p: PAPER_EXPONENT, threshold_m: None, seed: 1 }
    }
}

/// What was learned and how.
#[derive(Debug, Clone, PartialEq)]
pub struct Learned {
    /// The domain.
    pub domain: Domain,
    /// Every try, and poses that made no state.
    pub report: LearnReport,
}

/// Learns a domain from a recording.
///
/// ```
/// use symbolt::task::tasks::nuts_and_bolts::SyntheticDemonstrations;
/// use symbolt::task::learn::{Settings, learn};
/// use symbolt::sim::Seed;
///
/// let recording = SyntheticDemonstrations::default().record(Seed::new(1))?.recording;
/// let learned = learn(&recording, &Settings::default())?;
/// assert_eq!(learned.domain.states().len(), 5);
/// assert_eq!(learned.domain.operators().len(), 3);
/// # Ok::<(), symbolt::task::TaskError>(())
/// ```
///
/// # Errors
/// [`TaskError::Setting`] for an exponent or threshold that cannot be used;
/// [`TaskError::NothingToLearn`] if no demonstration has two snapshots or nothing moved;
/// [`TaskError::TooManyPoses`] above [`MOST_POINTS`] poses of one kind.
pub fn learn(recording: &Recording, settings: &Settings) -> Result<Learned, TaskError> {
    learn_watched(recording, settings, &mut |_| {})
}

/// What the learner is about to do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Progress {
    /// Following objects through the snapshots.
    Following {
        /// How many snapshots.
        snapshots: usize,
    },
    /// Clustering the poses of a kind; the part that grows with the square of their number.
    Clustering {
        /// The kind.
        kind: String,
        /// How many poses.
        poses: usize,
    },
    /// Deciding what is a state and counting what actions do.
    Deciding,
}

/// [`learn`], telling `watch` of each step before it is taken.
///
/// # Errors
/// As [`learn`].
pub fn learn_watched(
    recording: &Recording,
    settings: &Settings,
    watch: &mut dyn FnMut(Progress),
) -> Result<Learned, TaskError> {
    check_exponent(settings.p)?;
    if let Some(threshold) = settings.threshold_m
        && !(threshold.is_finite() && threshold > 0.0)
    {
        let expected = "a finite number of metres above 0";
        let value = threshold.to_string();
        return Err(TaskError::Setting { name: "threshold", value, expected });
    }
    let nothing = |reason: &str| TaskError::NothingToLearn { reason: reason.into() };
    if recording.demos.iter().all(|d| d.snapshots.len() < 2) {
        return Err(nothing("no demonstration has two snapshots or more"));
    }
    let mut scene = Scene::observe(recording, settings, watch)?;
    if scene.kinds.is_empty() {
        return Err(nothing("no object moved by more than a millimetre"));
    }
    if scene.tries.is_empty() {
        return Err(nothing("no object was taken up and let go"));
    }
    // Guessing the manipulated objects and clustering depend on each other: go round until nothing
    // changes. Five rounds are more than any recording has needed.
    for _ in 0..5 {
        scene.cluster(settings);
        if !scene.reconsider() {
            break;
        }
    }
    watch(Progress::Deciding);
    scene.conclude(settings)
}
