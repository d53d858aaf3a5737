//! Episode events: decisions, contacts, frames, and the report at the end.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::recovery::Recovery;
use crate::robot::{Pose, SkillOutcome, SkillReport, Touch};
use crate::task::classify::Offset;
use crate::task::propositional::Obstacle;

/// One decision of the planner graph, with the skill that followed it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Decided {
    /// Simulated time of the request to the planner, in seconds.
    pub asked_s: f64,
    /// Simulated time from the request to the decision, in milliseconds: a whole number of physics steps.
    pub took_ms: f64,
    /// Names of the states that held when the planner was asked.
    pub holds: Vec<String>,
    /// Name of the next action; `None` if the goal was met or the planner was stuck.
    pub action: Option<String>,
    /// The action as a sentence, with the object that the robot takes, such as `put cup 0 in the drawer`; `None` if there is no
    /// action, and in older traces.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub words: Option<String>,
    /// Whether the robot began the action or a recovery. It does not begin if the world state changed before the
    /// decision, if neither the action nor a recovery is possible, or if the episode has reached its limit of skills.
    pub begun: bool,
    /// Report of the skill that executed the action or the recovery; `None` until the skill ends.
    #[serde(default)]
    pub skill: Option<SkillReport>,
    /// Object, reference and target pose; `None` if the robot did not begin, or if the domain is not relational.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chosen: Option<Chosen>,
    /// Recovery that the robot carried out; `None` if it carried out the action as decided, or did not begin.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recovery: Option<Recovery>,
    /// The parts that were in no state when the planner was asked.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub in_no_state: Vec<InNoState>,
    /// Names of the facts of the goal that did not hold when the planner was asked: why it acts.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub unmet: Vec<String>,
    /// Names of the action's preconditions.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub needs: Vec<String>,
    /// Those of the preconditions that are undecided: they held before the demonstrated moves, perhaps by chance.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub undecided: Vec<Undecided>,
    /// Names of the action's effects: what holds after it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub gives: Vec<String>,
    /// Where the part was at the look after the skill; `None` before that look, for a recovery that is not the decided action, and
    /// in older traces.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub landed: Option<Landed>,
}

/// A precondition that is an undecided need.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Undecided {
    /// Name of the fact.
    pub fact: String,
    /// Number of demonstrated moves before which it held.
    pub held: usize,
    /// Number of these moves.
    pub of: usize,
}

/// Where a part was at the look after the skill that moved it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Landed {
    /// Whether the part is in the state that the action leads to, at the chosen reference.
    pub as_planned: bool,
    /// Name of the state in which the part is; `None` if it is in none.
    pub state: Option<String>,
    /// Where the part is: a statement such as `cup 0 is in the drawer`, or which state it nearly is in. If it is not as planned,
    /// also what moved while the robot did not hold it.
    pub words: String,
    /// Distance from the target, in millimetres; `None` if the part is out of sight.
    pub off_mm: Option<f64>,
}

impl fmt::Display for Landed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.off_mm {
            Some(off_mm) => write!(f, "{}; {off_mm:.1} mm from its target", self.words),
            None => f.write_str(&self.words),
        }
    }
}

/// A part in no state, and the nearest state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct InNoState {
    /// Id of the part.
    pub object: String,
    /// Name of the nearest state.
    pub nearest: String,
    /// Distance from the nearest place of this state, in millimetres.
    pub off_mm: f64,
    /// Tilt, or the angle by which the orientation differs, in degrees.
    pub off_deg: f64,
    /// Distance and angle in words, such as `2.6 mm too high and tilted by 10 degrees`.
    pub off: String,
    /// The statement that the part is nearest to, such as `cup 0 is in the drawer`; empty in older traces.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub words: String,
}

impl InNoState {
    /// Describes a part that misses a state by an offset. `words` is the statement that it is in this state.
    pub fn new(object: &str, nearest: &str, offset: &Offset, words: String) -> Self {
        Self {
            object: object.into(),
            nearest: nearest.into(),
            off_mm: 1e3 * offset.off_m,
            off_deg: offset.off_rad.to_degrees(),
            off: offset.in_words(),
            words,
        }
    }
}

impl fmt::Display for InNoState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { object, nearest, off, words, .. } = self;
        match words.is_empty() {
            true => write!(f, "{object} is in no state: nearest {nearest}, {off}"),
            false => write!(f, "in no state, nearest to \"{words}\": {off}"),
        }
    }
}

/// The move that carries out an action of a relational domain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Chosen {
    /// Name of the operator.
    pub operator: String,
    /// Id of the object that moves.
    pub object: String,
    /// Id of the object that it is put onto, into or beside; `None` in the world frame.
    pub reference: Option<String>,
    /// Index of the place in the operator's new state.
    pub place: usize,
    /// Target pose in the world.
    pub target: Pose,
    /// How much of the target's orientation matters: `free`, `axis` or `full`.
    pub turn: String,
    /// Name of the ground fact of the goal that the planner was asked for.
    pub goal: String,
}

impl Decided {
    /// Returns how the action's skill ended; `None` if no skill was begun or finished for this decision.
    pub fn outcome(&self) -> Option<SkillOutcome> {
        self.skill.map(|skill| skill.outcome)
    }

    /// Returns what came of the skill in a few words: `placed`, `off its place` for a part that is not where the action was to
    /// bring it, or why the skill failed, with `but in place` for a part that is there all the same; `not begun` or `cut short`
    /// for a skill that did not end. `None` if there was nothing to do.
    pub fn came_in_words(&self) -> Option<String> {
        let as_planned = self.landed.as_ref().map(|landed| landed.as_planned);
        match (self.outcome(), as_planned) {
            (None, _) if self.begun => Some("cut short".into()),
            (None, _) => self.done_in_words().map(|_| "not begun".into()),
            (Some(SkillOutcome::Placed), Some(false)) => Some("off its place".into()),
            (Some(outcome @ SkillOutcome::Placed), _) => Some(outcome.to_string()),
            (Some(outcome), None | Some(false)) => Some(outcome.to_string()),
            (Some(outcome), Some(true)) => Some(format!("{outcome}, but in place")),
        }
    }

    /// Returns in words what the robot does: the action, or the recovery that it carries out instead; `None` if neither is
    /// known.
    pub fn done_in_words(&self) -> Option<String> {
        let detour = self.recovery.as_ref().filter(|recovery| recovery.kind.is_detour());
        let done = detour.map(|r| r.kind.describe(r.name()));
        done.or_else(|| self.words.clone()).or_else(|| self.action.clone())
    }

    /// Returns whether the skill was a recovery that is not the decided action.
    pub fn is_detour(&self) -> bool {
        self.recovery.as_ref().is_some_and(|recovery| recovery.kind.is_detour())
    }
}

/// The fingers made contact with a part or released it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Touched {
    /// Simulated time, in seconds.
    pub t: f64,
    /// Index of the part in the scene.
    pub part: usize,
    /// `true` for contact, `false` for release.
    pub contact: bool,
}

impl Touched {
    /// Returns the event for `touch` at simulated time `t`, in seconds.
    pub fn at(t: f64, touch: Touch) -> Self {
        match touch {
            Touch::Contact(part) => Self { t, part, contact: true },
            Touch::Release(part) => Self { t, part, contact: false },
        }
    }
}

/// A body of the scene that another hand than the robot's moved or took away.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Displaced {
    /// Simulated time, in seconds.
    pub t: f64,
    /// Id of the part, or name of the movable fixture.
    pub object: String,
    /// What happened, as a sentence without a full stop.
    pub words: String,
    /// Pose before.
    pub from: Pose,
    /// Pose afterwards; `None` if the part was taken away.
    pub to: Option<Pose>,
}

impl Displaced {
    /// Describes that a body, called `name` by people, was moved at time `t`, or taken away.
    pub fn new(t: f64, object: &str, name: &str, from: Pose, to: Option<Pose>) -> Self {
        // Adding 0 leaves no minus before a zero.
        let at = |pose: &Pose| {
            pose.position.map(|m| format!("{:.0}", (1e3 * m).round() + 0.0)).join(", ")
        };
        let turned = |to: &Pose| {
            let degrees = from.rotation().angle_to(&to.rotation()).to_degrees().round();
            if degrees < 1.0 {
                String::new()
            } else {
                format!(
                    " and turned it by {degrees} degree{}",
                    if degrees == 1.0 { "" } else { "s" }
                )
            }
        };
        let what = match &to {
            Some(to) => {
                format!("moved {name} from ({}) to ({}) mm{}", at(&from), at(to), turned(to))
            }
            None => format!("took {name} away from ({}) mm", at(&from)),
        };
        let words = format!("another hand, not the robot, {what}");
        Self { t, object: object.into(), words, from, to }
    }
}

/// How an episode ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Ended {
    /// The goal state held.
    GoalMet,
    /// The planner was stuck.
    Stuck(Obstacle),
    /// The robot found no part that it could grasp and move to the action's target.
    NoWay {
        /// Name of the action.
        action: String,
    },
    /// Another part of the same kind lies at the action's target.
    Occupied {
        /// Name of the action.
        action: String,
    },
    /// Parts fell off the table, and the goal cannot be reached without them.
    Lost {
        /// Ids of the lost parts.
        objects: Vec<String>,
    },
    /// The episode reached its limit of simulated time or of skills.
    GaveUp,
    /// The goal cannot be asked for in what the robot sees, or the problem cannot be compiled.
    NoProblem {
        /// Why.
        why: String,
    },
}

/// The report of one episode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EpisodeReport {
    /// How the episode ended.
    pub ended: Ended,
    /// How the episode ended, as a part of a sentence.
    #[serde(default)]
    pub ended_words: String,
    /// Whether the task's judge finds the task solved.
    pub solved: bool,
    /// All decisions, each with the skill that followed it.
    pub decisions: Vec<Decided>,
    /// All contacts and releases.
    pub touches: Vec<Touched>,
    /// Number of parts in no state at the last look, including parts that fell off the table.
    pub in_no_state: usize,
    /// Number of times that a look newly found a part in no state.
    pub unexplained: usize,
    /// Ids of the parts that fell off the table.
    #[serde(default)]
    pub lost: Vec<String>,
    /// What another hand moved or took away.
    #[serde(default)]
    pub displaced: Vec<Displaced>,
    /// Number of physics steps.
    pub steps: u64,
    /// Simulated duration, in seconds.
    pub simulated_s: f64,
}

impl EpisodeReport {
    /// Returns the report of an episode that ended before the robot moved, because its problem cannot be compiled.
    pub fn without_problem(why: String) -> Self {
        Self {
            ended_words: why.clone(),
            ended: Ended::NoProblem { why },
            solved: false,
            decisions: Vec::new(),
            touches: Vec::new(),
            in_no_state: 0,
            unexplained: 0,
            lost: Vec::new(),
            displaced: Vec::new(),
            steps: 0,
            simulated_s: 0.0,
        }
    }

    /// Returns the reports of all finished skills, in order.
    pub fn skills(&self) -> impl Iterator<Item = &SkillReport> {
        self.decisions.iter().filter_map(|d| d.skill.as_ref())
    }

    /// Returns whether another hand has changed the scene.
    pub fn perturbed(&self) -> bool {
        !self.displaced.is_empty()
    }

    /// Returns the number of drops: skills that lost their part while carrying it.
    pub fn drops(&self) -> usize {
        self.skills().filter(|s| s.outcome == SkillOutcome::Dropped).count()
    }

    /// Returns the number of skills that grasped their part.
    pub fn picks(&self) -> usize {
        self.skills().filter(|s| s.picked).count()
    }

    /// Returns the learned action and the outcome of every finished skill that carried out its decided action, in order. A
    /// decision without a learned action counts by the planner's.
    pub fn attempts(&self) -> impl Iterator<Item = (&str, SkillOutcome)> {
        let decided = self.decisions.iter().filter(|d| !d.is_detour());
        decided.filter_map(|d| {
            let learned = d.chosen.as_ref().map(|chosen| &chosen.operator);
            Some((learned.or(d.action.as_ref())?.as_str(), d.outcome()?))
        })
    }

    /// Returns the recoveries that were begun, in order.
    pub fn recoveries(&self) -> impl Iterator<Item = &Recovery> {
        self.decisions.iter().filter_map(|d| d.recovery.as_ref())
    }

    /// Returns the number of re-plans: skills that did not place their part, each followed by a new decision.
    pub fn replans(&self) -> usize {
        self.skills().filter(|s| s.outcome != SkillOutcome::Placed).count()
    }

    /// Returns whether the robot ended the episode because its goal was met, and the judge finds the task solved.
    pub fn succeeded(&self) -> bool {
        self.ended == Ended::GoalMet && self.solved
    }

    /// Returns whether the planner reported the goal as met although the judge finds the task unsolved.
    pub fn false_goal(&self) -> bool {
        self.ended == Ended::GoalMet && !self.solved
    }

    /// Returns whether the judge finds the task solved although the robot ended the episode for another reason.
    pub fn unclaimed(&self) -> bool {
        self.ended != Ended::GoalMet && self.solved
    }
}
