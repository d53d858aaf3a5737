//! Learns a relational domain: states in frames, operators with parameters, and a goal.
//!
//! [`learn_relational`] takes a recording and returns a [`RelationalDomain`] and a [`LearnReport`]. It is given no
//! names, labels, state count, frames or thresholds.
//!
//! # Method
//!
//! 1. **Rests.** Objects are followed by position and id. Each time for which an object rests gives one pose, the
//!    median of its snapshots. The noise of the poses is the lower quartile of the differences between
//!    consecutive snapshots, because most objects rest. Poses that disagree
//!    with their neighbours are outliers.
//! 2. **States.** The rests of each kind are clustered. Each cluster has its own frame: the world, or the nearest
//!    object of some kind. Clusters merge while the marginal likelihood under a Chinese-restaurant prior rises. The
//!    variance of each coordinate is integrated out, and a coordinate may be open. Rigid motions preserve volume, so
//!    the frame in which the placements are tight wins. Clusters in one frame with the same sources and sinks become
//!    one state with several places.
//! 3. **Operators.** The parameters are the object, the reference of its old state (origin) and of its new state
//!    (target). Conditions are counted over the demonstrated instances. A state in which a parameter itself always was
//!    is *required*. A condition about another object that always held, or never, is *undecided*: it may be a
//!    coincidence. The planner meets undecided conditions where it can. What never rested on the moved object must be
//!    *absent*. A condition that was false once is dismissed, as in safe action model learning (Juba, Le and Stern,
//!    "Safe learning of lifted action models", KR 2021).
//! 4. **Goal.** The goal is the conjunction of the terms that some action achieves and that hold at the end of at least
//!    nine in ten demonstrations.
//!
//! A single demonstration cannot show which coordinates vary. From one demonstration, [`learn`](super::learn) of the
//! paper infers the states, and its result is converted. The goal is then the conjunction of all states that some action
//! achieves and that hold at the end for more objects than before.

mod cluster;
mod frames;
mod likelihood;
mod models;
mod motion;
mod operators;
mod places;
mod single;
mod states;

use super::summary::{AttemptOutcome, AttemptReport, LearnReport, UnexplainedPoses};
use super::{Settings, check_exponent};
use crate::task::domain::{ActionId, Pose, Provenance, Recording};
use crate::task::error::TaskError;
use crate::task::event::{Event, Ignore, LearningStep, Observer};
use crate::task::learn::PoseGaussian;
use crate::task::relational::RelationalDomain;
use motion::Motion;

/// The result of relational learning.
#[derive(Debug, Clone, PartialEq)]
pub struct RelationallyLearned {
    /// The learned domain.
    pub domain: RelationalDomain,
    /// Outcome of every attempt, and the poses that belong to no state.
    pub report: LearnReport,
    /// Number of single poses that disagreed with the rest of their object.
    pub outliers: usize,
    /// Names of states that nearly all demonstrations reached and that no action achieves. They are not part of the
    /// goal.
    pub unachieved: Vec<String>,
}

/// Learns a relational domain from a recording.
///
/// # Errors
/// * [`TaskError::Setting`] for an invalid exponent; for an invalid threshold if there is only one demonstration.
/// * [`TaskError::NothingToLearn`] if no demonstration has two snapshots, no object moved, or there was no attempt.
pub fn learn_relational(
    recording: &Recording,
    settings: &Settings,
) -> Result<RelationallyLearned, TaskError> {
    learn_relational_observed(recording, settings, &mut Ignore)
}

/// Learns a relational domain, as [`learn_relational`] does, and sends an [`Event::Learning`] to `observer` before each
/// step.
///
/// # Errors
/// As [`learn_relational`].
pub fn learn_relational_observed(
    recording: &Recording,
    settings: &Settings,
    observer: &mut dyn Observer,
) -> Result<RelationallyLearned, TaskError> {
    check_exponent(settings.p)?;
    if recording.demos.len() < 2 {
        let learned = single::learn(recording, settings, observer)?;
        let mut domain = RelationalDomain::from_domain(&learned.domain)?;
        let noise = motion::noise(recording);
        (domain.noise_m, domain.noise_rad) = (noise.position_m, noise.angle_rad);
        domain.goals = single::goals(&domain, recording);
        let (report, unachieved) = (learned.report, Vec::new());
        return Ok(RelationallyLearned { domain, report, outliers: 0, unachieved });
    }
    let nothing = |reason: &str| TaskError::NothingToLearn { reason: reason.into() };
    if recording.demos.iter().all(|d| d.snapshots.len() < 2) {
        return Err(nothing(
            "every demonstration has fewer than two snapshots; expected at least two",
        ));
    }
    let snapshots = recording.snapshot_count();
    observer.observe(&Event::Learning(LearningStep::Following { snapshots }));
    let motion = Motion::of(recording, settings.p);
    if motion.attempts.iter().all(|a| a.track.is_none()) {
        let moved = motion.rests.iter().any(|r| r.came != motion::Came::Found);
        return Err(nothing(if moved {
            "no object was picked up and released; expected at least one attempt"
        } else {
            "no object moved; expected at least one object to move by 1 mm or more"
        }));
    }
    let mut found = states::find(&motion);
    observer.observe(&Event::Learning(LearningStep::Deciding));
    let built = operators::find(&motion, &mut found);
    let (goals, unachieved) = operators::goals(&motion, &found, &built.operators);
    let unachieved: Vec<String> =
        unachieved.into_iter().map(|state| found.states[state].name.clone()).collect();
    for state in &unachieved {
        let warning = format!(
            "`{state}` held at the end of the demonstrations, but no action that achieves it was learned; it is not part \
             of the goal"
        );
        observer.observe(&Event::Warned(&warning));
    }
    let report = report(&motion, &found, &built);
    let domain = RelationalDomain {
        states: found.states,
        operators: built.operators,
        goals,
        noise_m: motion.noise.position_m,
        noise_rad: motion.noise.angle_rad,
        provenance: Provenance {
            symbolt: env!("CARGO_PKG_VERSION").into(),
            seed: settings.seed,
            p: settings.p,
            threshold_m: None,
            demonstrations: recording.demos.len(),
            snapshots,
            clusters: Vec::new(),
        },
    };
    domain.check()?;
    Ok(RelationallyLearned { domain, report, outliers: motion.outliers, unachieved })
}

fn report(
    motion: &Motion<'_>,
    found: &states::States,
    built: &operators::Operators,
) -> LearnReport {
    let attempts = motion.attempts.iter().zip(&built.judged).map(|(attempt, judged)| {
        let demo = motion.demo(attempt.demo);
        AttemptReport {
            demo: demo.number,
            before: demo.snapshots[attempt.before].number,
            after: demo.snapshots[attempt.after].number,
            object: attempt
                .track
                .and_then(|t| motion.tracks[attempt.demo][t].id(demo, attempt.before))
                .map(str::to_owned),
            inferred: !attempt.declared,
            outcome: match judged {
                Ok(operator) => AttemptOutcome::Action(ActionId::new(*operator)),
                Err(failure) => AttemptOutcome::Failed(*failure),
            },
        }
    });
    let unexplained = found.unexplained.iter().filter_map(|u| {
        let poses: Vec<Pose> = u.rests.iter().map(|r| motion.rests[*r].pose).collect();
        let seen = u.rests.iter().map(|r| {
            let rest = &motion.rests[*r];
            let demo = motion.demo(rest.demo);
            (demo.number, demo.snapshots[rest.first].number)
        });
        Some(UnexplainedPoses {
            kind: u.kind.clone(),
            count: poses.len(),
            mean: PoseGaussian::fit(&poses)?.mean,
            seen: seen.collect(),
        })
    });
    LearnReport {
        attempts: attempts.collect(),
        unexplained: unexplained.collect(),
        fixed_kinds: found.fixed.clone(),
    }
}
