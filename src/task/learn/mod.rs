//! Learns a domain from demonstrations: states from the poses of objects, operators from the changes between states.
//!
//! [`learn`] takes a [`Recording`] and [`Settings`] and returns a [`Learned`]: the [`RelationalDomain`] and a
//! [`LearnReport`]. The learner sees the kinds and poses of objects and, if recorded, the events and the touched objects. It
//! is given no names, labels or state count.
//!
//! There are two methods ([`Method`]). The default finds states in the frames of objects and operators with parameters; the
//! method of the paper finds states in the world frame. Both give the same kind of domain.
//!
//! # The default
//!
//! 1. **Rests.** Objects are followed by position and id. Each time for which an object rests gives one pose, the
//!    median of its snapshots. The noise of the poses is the lower quartile of the differences between
//!    consecutive snapshots, because most objects rest. Poses that disagree
//!    with their neighbours are outliers.
//! 2. **States.** The rests of each kind are clustered. Each cluster has its own frame: the world, or the nearest
//!    object of some kind. Clusters merge while the marginal likelihood under a Chinese-restaurant prior rises. The
//!    variance of each coordinate is integrated out, and a coordinate may be open. Rigid motions preserve volume, so
//!    the frame in which the placements are tight wins. Objects may look alike from two, three, four or six sides, or lie along a line with either
//!    end ahead. Fixtures that
//!    always stood level are taken to be level where noise tilts them. Clusters in one frame with the same sources and sinks become
//!    one state with several places.
//! 3. **Operators.** The parameters are the object, the reference of its old state (origin) and of its new state
//!    (target). Conditions are counted over the demonstrated instances. A state in which a parameter itself always was
//!    is *required*. A condition about another object that always held, or never, is *undecided*: it may be a
//!    coincidence. The planner meets undecided conditions where it can. What never rested on the moved object must be
//!    *absent*. A condition that was false once is dismissed, as in safe action model learning (Juba, Le and Stern,
//!    "Safe learning of lifted action models", KR 2021). If one of several states held each time, and each of them is
//!    brought about in some demonstrations only, any of them fulfils one *undecided* condition.
//! 4. **Goal.** The goal is the conjunction of the terms that some action achieves and that hold at the end of at least
//!    nine in ten demonstrations.
//!
//! Objects may have attributes ([`learn_attributed`]). A kind is divided by one where what is done to its objects differs by it.
//!
//! A single demonstration cannot show which coordinates vary. From one demonstration, the states are those of the paper's
//! method. The goal is then the conjunction of all states that some action achieves and that hold at the end for more
//! objects than before.
//!
//! # The method of the paper
//!
//! It follows sections II.A and II.E of the paper.
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
//! 6. **Build operators.** Each state in which a successful attempt ended gets one action. Its instances are the attempts
//!    that ended in the state. Preconditions are the states that held most often before them (II.E, Tables I to III).
//! 7. **Choose the goal.** The goal is the state that most demonstrations reach with their last action.
//!
//! Beyond the paper, the threshold is found from the data ([`Settings::threshold_m`]), the manipulated object is inferred
//! where the recording does not name it, failed attempts teach no action, and the goal is chosen from the demonstrations.

mod attempts;
mod attributes;
mod gaussian;
mod infer;
mod linkage;
mod observations;
mod operators;
mod paper;
mod relational;
mod remark;
mod summary;
mod threshold;
mod tracks;
mod transitions;

pub use crate::task::domain::distance::{
    PAPER_EXPONENT, check_exponent, distance_matrix, p_distance,
};
pub use attempts::MOVED_M;
pub use attributes::divide;
pub use gaussian::{PoseGaussian, robust_mean};
pub use linkage::{Dendrogram, MAX_POINTS, Merge};
pub use remark::{NoGoal, Remark};
pub use summary::{AttemptOutcome, AttemptReport, Failure, LearnReport, UnexplainedPoses};
pub use threshold::RESOLUTION;

use attributes::Family;

use crate::task::domain::{Provenance, RelationalDomain, SubKinds};
use crate::task::error::TaskError;
use crate::task::event::{Ignore, Observer};
use crate::task::recording::{Attributes, Recording};

/// How states and operators are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// States in the frames of objects, and operators with parameters.
    #[default]
    Relational,
    /// States in the world frame, as in the paper.
    Paper,
}

/// Settings of the learner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// The method. The exponent and the threshold belong to the method of the paper; the other takes them for a single
    /// demonstration alone.
    pub method: Method,
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
        Self { method: Method::default(), p: PAPER_EXPONENT, threshold_m: None, seed: 1 }
    }
}

impl Settings {
    /// Returns the settings of the paper's method, with a threshold found from the data.
    pub fn paper() -> Self {
        Self { method: Method::Paper, ..Self::default() }
    }

    /// Returns the provenance of a domain that is learned without a threshold.
    fn provenance(&self, recording: &Recording) -> Provenance {
        Provenance {
            symbolt: env!("CARGO_PKG_VERSION").into(),
            seed: self.seed,
            p: self.p,
            threshold_m: None,
            demonstrations: recording.demos.len(),
            snapshots: recording.snapshot_count(),
            clusters: Vec::new(),
        }
    }

    fn check(&self) -> Result<(), TaskError> {
        check_exponent(self.p)?;
        match self.threshold_m {
            Some(threshold) if !(threshold.is_finite() && threshold > 0.0) => {
                let expected = "a finite number of metres above 0";
                let value = threshold.to_string();
                Err(TaskError::Setting { name: "threshold", value, expected })
            }
            _ => Ok(()),
        }
    }
}

/// Returns the error of a recording from which nothing can be learned, for this reason.
fn nothing(reason: &str) -> TaskError {
    TaskError::NothingToLearn { reason: reason.into() }
}

/// The result of learning.
#[derive(Debug, Clone, PartialEq)]
pub struct Learned {
    /// The learned domain.
    pub domain: RelationalDomain,
    /// Outcome of every attempt, and the poses that belong to no state.
    pub report: LearnReport,
    /// Number of single poses that disagreed with the rest of their object.
    pub outliers: usize,
    /// Names of states that nearly all demonstrations reached and that no action achieves. They are not part of the
    /// goal.
    pub unachieved: Vec<String>,
    /// Names of states, each with the kind of object beside which their objects came to lie. The states were learned in
    /// the world, and may be places beside these objects instead: a single demonstration does not tell.
    pub unsure_frames: Vec<(String, String)>,
    /// What else a person should know.
    pub remarks: Vec<Remark>,
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
/// assert_eq!(learned.domain.states.len(), 5);
/// assert_eq!(learned.domain.operators.len(), 3);
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

/// Learns a domain from a recording whose objects have attributes. Kinds are divided by an attribute first, where what is done to
/// their objects differs by it ([`divide`]); `recording` then has the parts as kinds.
///
/// # Errors
/// As [`learn`].
pub fn learn_attributed(
    recording: &mut Recording,
    attributes: &Attributes,
    settings: &Settings,
    observer: &mut dyn Observer,
) -> Result<Learned, TaskError> {
    let divided = attributes::divisions(recording, attributes);
    SubKinds::apply(&divided.kinds, recording, attributes);
    let mut learned = learn_families(recording, &divided.families, settings, observer)?;
    learned.domain.sub_kinds = divided.kinds;
    learned.remarks.extend(divided.remarks);
    Ok(learned)
}

/// Learns a domain, as [`learn`] does, and sends an [`Event::Learning`](super::event::Event::Learning) to `observer` before
/// each step.
///
/// # Errors
/// As [`learn`].
pub fn learn_observed(
    recording: &Recording,
    settings: &Settings,
    observer: &mut dyn Observer,
) -> Result<Learned, TaskError> {
    learn_families(recording, &[], settings, observer)
}

/// Learns a domain. What is done to the kinds of a family is the same, but for where they go.
fn learn_families(
    recording: &Recording,
    families: &[Family],
    settings: &Settings,
    observer: &mut dyn Observer,
) -> Result<Learned, TaskError> {
    settings.check()?;
    if recording.demos.iter().all(|d| d.snapshots.len() < 2) {
        let reason = "every demonstration has fewer than two snapshots; expected at least two";
        return Err(nothing(reason));
    }
    match settings.method {
        Method::Relational => relational::learn(recording, families, settings, observer),
        Method::Paper => paper::learn(recording, settings, observer),
    }
}
