//! Failure memory: what the executor tried, by which means, and how it ended.
//!
//! An attempt that failed the same way twice is not made a third time unchanged. *Unchanged* means: the same action with
//! the same part, reference and place, by the same grasp, from about the same pose. A detour that worked, or another part that
//! has left the target, changes the scene: failures before it no longer count, nor does what another hand spoilt.

use serde::{Deserialize, Serialize};

use super::plight::BESIDE_M;
use crate::robot::Pose;
use crate::robot::SkillOutcome;
use crate::task::event::RecoveryKind;

/// An intent of the executor: an action with its parameters, or a detour with its part.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(in crate::task::execute) struct Intent {
    /// Name of the operator, or of the kind of detour.
    pub action: String,
    /// Index of the part in the scene.
    pub part: usize,
    /// Id of the reference.
    pub reference: Option<String>,
    /// Index of the place.
    pub place: usize,
}

impl Intent {
    /// Returns a detour with a part.
    pub fn detour(kind: RecoveryKind, part: usize) -> Self {
        Self { action: kind.name().into(), part, reference: None, place: 0 }
    }
}

/// The means of an attempt.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(in crate::task::execute) enum Means {
    /// A grasp of the task, by its index.
    Task(usize),
    /// A grasp that the skill library found, by its index.
    Any(usize),
    /// A push, by its index.
    Push(usize),
}

impl Means {
    /// Returns whether both are grasps of the task, both other grasps, or both pushes.
    fn is_like(self, other: Self) -> bool {
        std::mem::discriminant(&self) == std::mem::discriminant(&other)
    }
}

/// How an attempt ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(in crate::task::execute) enum AttemptEnd {
    /// The part is where it was to be.
    Done,
    /// The part was put down, but is not in the state that the action achieves.
    NoEffect,
    /// The skill failed.
    Failed(SkillOutcome),
}

impl AttemptEnd {
    /// Returns how an attempt failed, in words that follow the name of the part.
    pub fn text(self) -> &'static str {
        match self {
            Self::Done | Self::Failed(SkillOutcome::Placed) => "was placed",
            Self::NoEffect => "was put down but did not get into the intended state",
            Self::Failed(SkillOutcome::Dropped) => "was dropped",
            Self::Failed(SkillOutcome::Missed) => "was not in the hand",
            Self::Failed(SkillOutcome::Blocked) => {
                "could not be moved because the arm hit something"
            }
            Self::Failed(SkillOutcome::Occupied) => {
                "could not be put down because its target was occupied"
            }
            Self::Failed(SkillOutcome::Unreachable) => "could not be brought to its target",
            Self::Failed(SkillOutcome::TimedOut) => "took too long",
        }
    }

    /// Returns whether the reason is at the target, so that another grasp or pose of the part does not help.
    pub fn is_about_target(self) -> bool {
        matches!(self, Self::NoEffect | Self::Failed(SkillOutcome::Occupied))
    }

    /// Returns how often an attempt may end in this way before its action is given up with this part, reference and
    /// place, and whether this counts for one family of means alone.
    fn limit(self) -> (usize, bool) {
        match self {
            Self::Done => (usize::MAX, false),
            // A dropped part lies elsewhere afterwards.
            Self::Failed(SkillOutcome::Dropped) => (12, false),
            // The target is raised each time.
            Self::Failed(SkillOutcome::Occupied) => (4, false),
            Self::NoEffect => (2, false),
            // Grasps of another family may work.
            Self::Failed(_) => (3, true),
        }
    }
}

/// What moved while the robot did not hold it, so that an attempt came to nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(in crate::task::execute) enum Meddled {
    /// The part, after the robot had let go of it.
    Part,
    /// The reference, after the robot had begun.
    Target,
}

impl Meddled {
    /// Returns a clause on it.
    pub fn text(self) -> &'static str {
        match self {
            Self::Part => "it moved after the robot had let go",
            Self::Target => "its target had moved meanwhile",
        }
    }
}

/// One attempt.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(in crate::task::execute) struct Attempt {
    pub what: Intent,
    pub means: Means,
    /// Pose of the part at the beginning.
    pub start: Pose,
    /// Where the part was to be put, in metres; `None` for a detour.
    pub at: Option<[f64; 3]>,
    /// Pose of the reference at the beginning; `None` if there is none.
    pub target: Option<Pose>,
    /// Pose in which the skill left the part; `None` while it runs.
    pub left: Option<Pose>,
    /// What moved meanwhile, found at the look after the skill.
    pub meddled: Option<Meddled>,
    /// Outcome of the skill; `None` while it runs.
    pub skill: Option<SkillOutcome>,
    /// How it ended; `None` until the look after the skill.
    pub how: Option<AttemptEnd>,
    /// Whether it is a detour.
    pub detour: bool,
}

impl Attempt {
    pub fn begun(what: Intent, means: Means, start: Pose, detour: bool) -> Self {
        let (at, target, left, meddled) = (None, None, None, None);
        Self { what, means, start, at, target, left, meddled, skill: None, how: None, detour }
    }

    /// Returns what has moved meanwhile, given where the part and the reference are at the look after the skill.
    pub fn meddled(&self, part: Option<&Pose>, target: Option<&Pose>) -> Option<Meddled> {
        let moved = |was: &Option<Pose>, is: Option<&Pose>| {
            was.as_ref().zip(is).is_some_and(|(was, is)| !near(was, is))
        };
        // What was dropped may still roll.
        let placed = self.skill == Some(SkillOutcome::Placed);
        let part = (placed && moved(&self.left, part)).then_some(Meddled::Part);
        part.or_else(|| (placed && moved(&self.target, target)).then_some(Meddled::Target))
    }

    /// Returns how the attempt failed, in words that follow the name of the part; `None` if it did not.
    pub fn failure_in_words(&self) -> Option<String> {
        let how = self.failure()?;
        Some(match (self.meddled, how) {
            (Some(meddled), AttemptEnd::NoEffect) => format!("was put down; {}", meddled.text()),
            (Some(meddled), _) => format!("{}; {}", how.text(), meddled.text()),
            (None, _) => how.text().into(),
        })
    }

    /// Returns whether this took something away that may have been in the way of another attempt at its target: a detour that
    /// did, or whatever moved another part from there. What was dropped on its way is away as well.
    fn clears(&self, failed: &Self) -> bool {
        let away = [RecoveryKind::Reseat, RecoveryKind::Clear].map(RecoveryKind::name);
        let takes_away = self.detour && away.contains(&self.what.action.as_str());
        let lay_there = failed.at.is_some_and(|at| self.start.distance(&Pose::at(at)) < BESIDE_M);
        let gone = self.left.is_some_and(|left| left.distance(&self.start) > AWAY_M);
        let other = self.what.part != failed.what.part;
        let done = self.how == Some(AttemptEnd::Done);
        (takes_away && done) || (other && self.how.is_some() && gone && (takes_away || lay_there))
    }

    /// Returns how the attempt failed; `None` if it did not.
    pub fn failure(&self) -> Option<AttemptEnd> {
        self.how.filter(|how| *how != AttemptEnd::Done)
    }
}

/// All attempts of an episode, in order.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(in crate::task::execute) struct Attempts {
    all: Vec<Attempt>,
}

/// Number of times that an attempt may fail in the same way before it must change.
const SAME: usize = 2;
/// Distance and angle within which two poses count as the same, in metres and radians.
const NEAR: (f64, f64) = (0.008, 0.2);
/// Distance from which a part is no longer where it was in the way, in metres.
const AWAY_M: f64 = 0.05;
/// Number of detours of one kind with one part.
const DETOURS: usize = 3;

/// Returns whether two poses count as the same.
pub(in crate::task::execute) fn near(a: &Pose, b: &Pose) -> bool {
    a.distance(b) < NEAR.0 && a.rotation().angle_to(&b.rotation()) < NEAR.1
}

impl Attempts {
    pub fn begin(&mut self, attempt: Attempt) {
        self.all.push(attempt);
    }

    /// Notes how the skill of the last attempt ended, and where it left the part.
    pub fn end(&mut self, outcome: SkillOutcome, left: impl FnOnce(usize) -> Option<Pose>) {
        if let Some(last) = self.all.last_mut().filter(|a| a.skill.is_none()) {
            (last.skill, last.left) = (Some(outcome), left(last.what.part));
        }
    }

    /// Returns the attempt whose skill is over, and of which it is not known yet how it ended.
    pub fn unsettled(&mut self) -> Option<&mut Attempt> {
        self.all.last_mut().filter(|a| a.skill.is_some() && a.how.is_none())
    }

    /// Notes how the last attempt ended, if its skill is over. `took_effect` says whether a skill that placed its part
    /// did what was intended.
    pub fn settle(&mut self, took_effect: impl FnOnce(&Attempt) -> bool) {
        let Some(last) = self.all.last_mut().filter(|a| a.how.is_none()) else { return };
        let how = match last.skill {
            None => return,
            Some(SkillOutcome::Placed) if took_effect(last) => AttemptEnd::Done,
            Some(SkillOutcome::Placed) => AttemptEnd::NoEffect,
            Some(outcome) => AttemptEnd::Failed(outcome),
        };
        last.how = Some(how);
    }

    /// Returns the last attempt.
    pub fn last(&self) -> Option<&Attempt> {
        self.all.last()
    }

    /// Returns the number of attempts up to the last one that `helps`.
    fn up_to(&self, helps: impl Fn(&Attempt) -> bool) -> usize {
        self.all.iter().rposition(helps).map_or(0, |at| at + 1)
    }

    /// Returns the failed attempts at `what` since something gave it another chance: a detour that worked, or what took something
    /// away from its target. A detour with the part does not help where the target is occupied. What another hand spoilt is
    /// no failure of the attempt.
    fn failed<'a>(&'a self, what: &'a Intent) -> impl Iterator<Item = &'a Attempt> {
        let since = self.up_to(|a| a.detour && a.how == Some(AttemptEnd::Done));
        self.all.iter().enumerate().filter_map(move |(index, attempt)| {
            let cleared = || self.up_to(|a| a.clears(attempt));
            let from = match attempt.failure()? {
                AttemptEnd::Failed(SkillOutcome::Occupied) => cleared(),
                AttemptEnd::NoEffect => cleared().max(since),
                _ => since,
            };
            let own = attempt.what == *what && attempt.meddled.is_none();
            (index >= from && own).then_some(attempt)
        })
    }

    /// Returns the number of attempts at `what`.
    pub fn tries(&self, what: &Intent) -> usize {
        self.all.iter().filter(|a| a.what == *what).count()
    }

    /// Returns the number of attempts to take a part, whatever was to be done with it.
    pub fn taken(&self, part: usize) -> usize {
        let push = |a: &Attempt| matches!(a.means, Means::Push(_));
        self.all.iter().filter(|a| a.what.part == part && !push(a)).count()
    }

    /// Returns the last attempt with a part.
    pub fn last_with(&self, part: usize) -> Option<&Attempt> {
        self.all.iter().rev().find(|a| a.what.part == part)
    }

    /// Returns the number of failed attempts with a part and of all attempts at `what`: the fewer, the sooner it is
    /// tried. An action that was done already and must be done again did not have a lasting effect.
    pub fn weight(&self, what: &Intent) -> usize {
        let failed = |a: &&Attempt| {
            a.what.part == what.part && a.failure().is_some_and(|how| how != AttemptEnd::NoEffect)
        };
        self.all.iter().filter(failed).count() + self.tries(what)
    }

    /// Returns the number of failures of `what` because its target was occupied.
    pub fn occupied(&self, what: &Intent) -> usize {
        let occupied = Some(AttemptEnd::Failed(SkillOutcome::Occupied));
        self.all.iter().filter(|a| a.what == *what && a.how == occupied).count()
    }

    /// Returns why `what` must not be tried again by means of one family: how it failed too often.
    pub fn worn_out(&self, what: &Intent, family: fn(usize) -> Means) -> Option<AttemptEnd> {
        let all = self.all.iter().filter(|a| a.what == *what);
        let mut failures = all.filter_map(Attempt::failure);
        failures.find(|how| {
            let (limit, own) = how.limit();
            let counts = |a: &&Attempt| {
                let like = !own || a.means.is_like(family(0));
                like && a.what == *what && a.failure() == Some(*how)
            };
            // A detour that worked gives it another chance, but not for ever.
            let ever = self.all.iter().filter(counts).count();
            self.failed(what).filter(counts).count() >= limit || ever >= limit.saturating_mul(2)
        })
    }

    /// Orders the indices of `count` means of a family: those that failed least come first. Means that failed the same
    /// way twice from about this pose are left out.
    pub fn usable(
        &self,
        what: &Intent,
        start: &Pose,
        count: usize,
        family: fn(usize) -> Means,
    ) -> Vec<usize> {
        let failures = |index: usize| -> Vec<AttemptEnd> {
            let own =
                self.failed(what).filter(|a| a.means == family(index) && near(&a.start, start));
            own.filter_map(Attempt::failure).collect()
        };
        let fresh = |index: &usize| {
            let failures = failures(*index);
            failures.iter().all(|how| failures.iter().filter(|h| *h == how).count() < SAME)
        };
        let mut usable: Vec<usize> = (0..count).filter(fresh).collect();
        usable.sort_by_key(|index| failures(*index).len());
        usable
    }

    /// Returns whether a detour may be tried from this pose.
    pub fn may_detour(&self, what: &Intent, start: &Pose) -> bool {
        let own = || self.all.iter().filter(|a| a.detour && a.what == *what);
        let same = |how: AttemptEnd| {
            own().filter(|a| a.how == Some(how) && near(&a.start, start)).count() >= SAME
        };
        own().count() < DETOURS && !own().filter_map(Attempt::failure).any(same)
    }

    /// Returns the number of detours.
    pub fn detours(&self) -> usize {
        self.all.iter().filter(|a| a.detour).count()
    }
}

#[cfg(test)]
#[path = "../../../../tests/unit/recovery_attempts.rs"]
mod tests;
