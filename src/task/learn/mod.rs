//! Learns a domain from demonstrations: states from the poses of objects, operators from the changes between states.
//!
//! [`learn`] takes a [`Recording`] and [`Settings`] and returns a [`Learned`]: the [`Domain`] and a [`LearnReport`].
//! The learner sees the kinds and poses of objects and, if recorded, the events and the touched objects. It is given no
//! names, labels or state count.
//!
//! # Method
//!
//! The method follows sections II.A and II.E of the paper.
//!
//! 1. **Track.** Objects are followed from snapshot to snapshot, even where ids shift because an object is lost.
//! 2. **Cut.** Each demonstration is cut into attempts, from contact to release (II.A). Without events, every two
//!    consecutive snapshots form an attempt.
//! 3. **Cluster.** For each kind of object that moves, positions are compared by a p-norm, by default with p = -2
//!    ([`p_distance`], equation 1), and merged by average linkage ([`Dendrogram`], II.E). Cutting the dendrogram at the
//!    clustering threshold gives the clusters.
//! 4. **Select states.** Clusters become states, except detours ([`Failure::Detour`]) and clusters seen only around
//!    failed attempts.
//! 5. **Model states.** Each state gets a robust mean pose and a Gaussian of position and orientation
//!    ([`PoseGaussian`], II.E).
//! 6. **Build operators.** Each state in which a successful attempt ended gets one action. The attempts that ended in
//!    the state are the [`Instance`]s of the action. [`Evidence`] counts the states before and after them.
//!    Preconditions are the states that held most often before, effects the states that began to hold most often
//!    (II.E, Tables I to III).
//! 7. **Choose the goal.** The goal is the state that most demonstrations reach with their last action.
//!
//! # Beyond the paper
//!
//! * The threshold is found from the data ([`Settings::threshold_m`]).
//! * If the recording does not name the manipulated object, the learner infers it.
//! * Failed attempts are recognised and teach no action.
//! * The goal is chosen from the demonstrations.
//! * An operator also lists the states that were always absent before its action, and the states that the action ends
//!   ([`Operator::absent`], [`Operator::removes`]).
//!
//! [`Operator::absent`]: crate::task::domain::Operator::absent
//! [`Operator::removes`]: crate::task::domain::Operator::removes
//! [`Evidence`]: crate::task::domain::Evidence

mod attempts;
mod gaussian;
mod infer;
mod linkage;
mod names;
mod observations;
mod operators;
mod relational;
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
pub use relational::{RelationallyLearned, learn_relational, learn_relational_observed};
pub use summary::{AttemptOutcome, AttemptReport, Failure, LearnReport, UnexplainedPoses};
pub use threshold::RESOLUTION;

use crate::task::domain::{Domain, Recording};
use crate::task::error::TaskError;
use crate::task::event::{Event, Ignore, LearningStep, Observer};
use observations::Observations;

/// Settings of the learner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Exponent of the p-norm distance: any finite number except 0. The paper uses -2.
    pub p: f64,
    /// Clustering threshold for every kind, in metres, above 0. The paper uses 0.001169.
    ///
    /// With `None`, the learner finds a threshold for each kind: the coarsest clustering in which nearly every attempt
    /// moves its object to another cluster. It ignores attempts whose two poses agree too closely to be different
    /// states, as defined by [`RESOLUTION`].
    pub threshold_m: Option<f64>,
    /// Seed, stored in the domain's provenance. Learning itself uses no random numbers.
    pub seed: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { p: PAPER_EXPONENT, threshold_m: None, seed: 1 }
    }
}

/// The result of learning.
#[derive(Debug, Clone, PartialEq)]
pub struct Learned {
    /// The learned domain.
    pub domain: Domain,
    /// Outcome of every attempt, and the poses that belong to no state.
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
/// * [`TaskError::Setting`] for an invalid exponent or threshold.
/// * [`TaskError::NothingToLearn`] if no demonstration has two snapshots, no object moved, or there was no attempt.
/// * [`TaskError::TooManyPoses`] for more than [`MAX_POINTS`] poses of one kind.
pub fn learn(recording: &Recording, settings: &Settings) -> Result<Learned, TaskError> {
    learn_observed(recording, settings, &mut Ignore)
}

/// Learns a domain, as [`learn`] does, and sends an [`Event::Learning`] to `observer` before each step.
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
        return Err(nothing(
            "every demonstration has fewer than two snapshots; expected at least two",
        ));
    }
    let mut observed = Observations::observe(recording, settings, observer)?;
    if observed.kinds.is_empty() {
        return Err(nothing(
            "no object moved; expected at least one object to move by 1 mm or more",
        ));
    }
    if observed.attempts.is_empty() {
        return Err(nothing("no object was picked up and released; expected at least one attempt"));
    }
    // The clusters depend on the guesses of manipulated objects, and the guesses depend on the clusters. Repeat until
    // nothing changes. No recording has needed five rounds.
    for _ in 0..5 {
        observed.cluster(settings);
        if !observed.reconsider() {
            break;
        }
    }
    observer.observe(&Event::Learning(LearningStep::Deciding));
    observed.infer(settings)
}
