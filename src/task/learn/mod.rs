//! Learning from demonstrations: states from where objects were, operators from how states changed.
//!
//! The steps follow sections II.A and II.E of the paper. For each kind of object, poses are compared by
//! [`p_distance`] and clustered by average linkage ([`Dendrogram`]); each cluster gets a robust mean and a 6-D
//! Gaussian. Demonstrations are then cut into attempts. What held before and after each attempt is counted
//! ([`Evidence`](crate::task::domain::Evidence)), and preconditions and effects follow from the counts. The learner
//! sees poses and, if they were recorded, the objects touched. It never sees names of states or actions, nor how
//! many there are.
//!
//! Three things go beyond the paper: the threshold is found from the data (see [`Settings::threshold_m`]), the
//! manipulated object is inferred where it was not recorded, and failed attempts are told apart from actions.

mod attempts;
mod gaussian;
mod infer;
mod linkage;
mod names;
mod observations;
mod operators;
mod summary;
mod threshold;
mod tracks;
mod transitions;

pub use crate::task::domain::distance::{
    PAPER_EXPONENT, check_exponent, distance_matrix, p_distance,
};
pub use attempts::MOVED_M;
pub use gaussian::{PoseGaussian, robust_mean};
pub use linkage::{Dendrogram, MAX_POINTS, Merge};
pub use operators::Instance;
pub use summary::{AttemptOutcome, AttemptReport, Failure, LearnReport, UnexplainedPoses};
pub use threshold::RESOLUTION;

use crate::task::domain::{Domain, Recording};
use crate::task::error::TaskError;
use crate::task::event::{Event, Ignore, LearningStep, Observer};
use observations::Observations;

/// How to learn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// The exponent of the distance; the paper uses -2.
    pub p: f64,
    /// The clustering threshold in metres, the same for every kind; the paper uses 0.001169.
    /// `None` finds one for each kind: the coarsest clustering in which nearly every attempt takes its
    /// part to another state. Attempts that left some coordinate unchanged, to a [`RESOLUTION`] of the
    /// distance travelled, are set aside.
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
    /// Every attempt, and poses that made no state.
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
/// [`TaskError::TooManyPoses`] above [`MAX_POINTS`] poses of one kind.
pub fn learn(recording: &Recording, settings: &Settings) -> Result<Learned, TaskError> {
    learn_observed(recording, settings, &mut Ignore)
}

/// [`learn`], telling `observer` of each step before it is taken ([`Event::Learning`]).
///
/// # Errors
/// As [`learn`].
pub fn learn_observed(
    recording: &Recording,
    settings: &Settings,
    observer: &mut dyn Observer,
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
    let mut observed = Observations::observe(recording, settings, observer)?;
    if observed.kinds.is_empty() {
        return Err(nothing("no object moved by more than a millimetre"));
    }
    if observed.attempts.is_empty() {
        return Err(nothing("no object was taken up and let go"));
    }
    // Guessing the manipulated objects and clustering depend on each other: repeat until nothing
    // changes. Five rounds are more than any recording has needed.
    for _ in 0..5 {
        observed.cluster(settings);
        if !observed.reconsider() {
            break;
        }
    }
    observer.observe(&Event::Learning(LearningStep::Deciding));
    observed.infer(settings)
}
