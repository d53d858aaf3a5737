//! What the recoveries know: the scene as it is sensed, the parts in no state, and what could not be done.

use super::attempts::{AttemptEnd, Attempts};
use super::places;
use crate::robot::Pose;
use crate::robot::scene::Sensed;
use crate::task::execute::model::{Choice, Seen};

/// What the executor wanted to do and could not: a part, and where it was to be put.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub(in crate::task::execute) struct Wanted {
    pub part: usize,
    /// Part that the part was to be put onto, into or beside.
    pub reference: Option<usize>,
    /// Position of the target, in metres.
    pub at: [f64; 3],
    /// Why it was not possible, in words.
    pub why: String,
    /// Whether something at the target is the reason.
    pub jammed: bool,
}

impl Wanted {
    pub fn of(choice: &Choice, why: String, jammed: bool) -> Self {
        let Choice { part, reference, target, .. } = choice;
        Self { part: *part, reference: *reference, at: target.position, why, jammed }
    }
}

/// What the ladder knows.
#[derive(Clone, Copy)]
pub(in crate::task::execute) struct Plight<'v> {
    pub sensed: Sensed<'v>,
    pub seen: &'v Seen,
    /// For each part, whether it is in no state.
    pub in_no_state: &'v [bool],
    /// For each part, whether it is in a state in which parts were found.
    pub as_found: &'v [bool],
    /// What was tried with the parts.
    pub attempts: &'v Attempts,
    /// For each part, the pose in which it was first seen.
    pub homes: &'v [Option<Pose>],
    /// What could not be done. It can be wrong if the planner is stuck for another reason.
    pub wanted: &'v [Wanted],
    /// The parts whose states forbid a fact that no action causes, each with the name of the fact.
    pub in_the_way: &'v [(usize, String)],
    /// Whether parts in no state are dealt with even if no action wants them.
    pub stuck: bool,
}

/// Horizontal distance within which a part lies at a target, in metres.
const AT_M: f64 = 0.035;
/// Horizontal distance within which a part is beside another one, so that the hand may lack room, in metres.
pub(super) const BESIDE_M: f64 = 0.075;
/// Horizontal distance within which, and height above which, a part rests on another one, in metres.
const ON_TOP_M: (f64, f64) = (0.02, 0.008);
/// Height difference up to which a part lies at a target, in metres.
const LEVEL_M: f64 = 0.08;

impl Plight<'_> {
    /// Returns the wanted parts, each with the reason why it could not be used.
    pub fn wanted_parts(&self) -> Vec<(usize, String)> {
        let mut all: Vec<(usize, String)> = Vec::new();
        for w in self.wanted {
            if !all.iter().any(|(part, _)| *part == w.part) {
                all.push((w.part, w.why.clone()));
            }
        }
        all
    }

    /// Returns the parts to be dealt with, each with the reason: the wanted ones, then those in no state.
    pub fn handled(&self) -> Vec<(usize, String)> {
        let mut all = self.wanted_parts();
        for (part, _) in self.parts().filter(|(part, _)| self.stuck && self.loose(*part)) {
            if !all.iter().any(|(own, _)| *own == part) {
                all.push((part, "it is in no state that an action can use".into()));
            }
        }
        all
    }

    /// Returns whether the robot can lift a seen part away: it is on no guide, and nothing rests on it.
    pub fn may_lift(&self, part: usize) -> bool {
        self.at(part).is_some() && !self.bears(part) && self.free(part)
    }

    /// Returns the seen parts with their positions.
    fn parts(&self) -> impl Iterator<Item = (usize, [f64; 3])> + '_ {
        let all = self.seen.snapshot.objects.iter().zip(&self.seen.parts);
        all.filter_map(|(object, part)| Some(((*part)?, object.pose.position)))
    }

    /// Returns the position of a seen part.
    pub fn at(&self, part: usize) -> Option<[f64; 3]> {
        self.parts().find(|(own, _)| *own == part).map(|(_, at)| at)
    }

    /// Returns the name of a part, for people.
    pub fn name(&self, part: usize) -> String {
        places::name(&self.sensed, part)
    }

    /// Returns whether a part lies otherwise than parts of its kind lay when they were found, such as on its edge.
    pub fn lies_ill(&self, part: usize) -> bool {
        let pose = self.sensed.part(part);
        pose.is_some_and(|pose| !places::lies_well(&self.sensed, part, &pose, self.homes))
    }

    fn loose(&self, part: usize) -> bool {
        self.in_no_state.get(part).copied().unwrap_or(false)
    }

    /// Returns whether a part lies as parts were found, but neither where it was found itself nor where the robot put it on purpose: it
    /// fell there, or another hand left it.
    fn strewn(&self, part: usize) -> bool {
        let Some(at) = self.at(part).map(Pose::at) else { return false };
        let away = |from: &Pose| at.distance(from) > AT_M;
        let home = self.homes.get(part).copied().flatten();
        let last = self.attempts.last_with(part).filter(|a| a.how == Some(AttemptEnd::Done));
        let put = last.and_then(|a| a.left);
        let as_found = self.as_found.get(part).copied().unwrap_or(false);
        as_found && [home, put].iter().flatten().all(away)
    }

    /// Returns whether the robot can lift a part away.
    fn free(&self, part: usize) -> bool {
        self.sensed.slider(part).is_none()
    }

    /// Returns whether another part rests on a part.
    fn bears(&self, part: usize) -> bool {
        let Some(at) = self.at(part) else { return false };
        self.parts().any(|(other, own)| {
            let above = own[2] - at[2] > ON_TOP_M.1;
            other != part && above && (own[0] - at[0]).hypot(own[1] - at[1]) < ON_TOP_M.0
        })
    }

    /// Returns the other parts near a position, the nearest first.
    pub fn near(&self, at: [f64; 3], within_m: f64, except: &[usize]) -> Vec<usize> {
        let mut near: Vec<(f64, usize)> = self
            .parts()
            .filter(|(part, _)| !except.contains(part) && self.free(*part))
            .filter(|(_, own)| (own[2] - at[2]).abs() < LEVEL_M)
            .map(|(part, own)| ((own[0] - at[0]).hypot(own[1] - at[1]), part))
            .filter(|(far, _)| *far < within_m)
            .collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        near.into_iter().map(|(_, part)| part).collect()
    }

    /// Returns the parts in no state that lie at a target; with `wide`, also those beside it. At a target that was occupied, those
    /// that nobody put there on purpose count as well.
    pub fn wrongly_at(&self, wanted: &Wanted, wide: bool) -> Vec<usize> {
        let except: Vec<usize> = [wanted.part].into_iter().chain(wanted.reference).collect();
        let within = |within_m: f64| self.near(wanted.at, within_m, &except);
        let at = within(AT_M);
        let mut near = if wide { within(BESIDE_M) } else { at.clone() };
        let strewn = |part: &usize| wanted.jammed && at.contains(part) && self.strewn(*part);
        near.retain(|part| self.loose(*part) || strewn(part));
        near
    }
}
