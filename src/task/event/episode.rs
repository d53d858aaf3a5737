//! What is told of an episode: decisions, touches, frames, and the report at its end.

use serde::{Deserialize, Serialize};

use super::skill::{SkillOutcome, SkillReport, Touch};
use crate::task::domain::{Obstacle, Pose};

/// One moment of a scene, for pictures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SceneFrame {
    /// Simulated seconds.
    pub t: f64,
    /// The joints' angles, in radians.
    pub angles: [f64; 7],
    /// Each finger's distance from the middle, in metres.
    pub fingers: [f64; 2],
    /// The parts' poses, in the order of the scene's parts.
    pub parts: Vec<Pose>,
}

/// One answer of the planner graph.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Decided {
    /// Simulated seconds when the question was put.
    pub asked_s: f64,
    /// Simulated milliseconds until the answer, to the period of the physics.
    pub took_ms: f64,
    /// The states that held.
    pub holds: Vec<String>,
    /// The action to be done; `None` if the goal was met or nothing can be done.
    pub action: Option<String>,
    /// Whether the robot began to do it: not if something had changed meanwhile, or if there was no way.
    pub begun: bool,
    /// The skill that carried the action out, once it is over.
    #[serde(default)]
    pub skill: Option<SkillReport>,
}

impl Decided {
    /// How the action's skill ended; `None` for a decision that was not carried out to an end.
    pub fn outcome(&self) -> Option<SkillOutcome> {
        self.skill.map(|skill| skill.outcome)
    }
}

/// The fingers and a part came together, or parted.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Touched {
    /// Simulated seconds.
    pub t: f64,
    /// The part's place in the scene.
    pub part: usize,
    /// Whether they came together.
    pub contact: bool,
}

impl Touched {
    /// A touch at a time in simulated seconds.
    pub fn at(t: f64, touch: Touch) -> Self {
        match touch {
            Touch::Contact(part) => Self { t, part, contact: true },
            Touch::Release(part) => Self { t, part, contact: false },
        }
    }
}

/// How an episode ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Ended {
    /// The goal state held.
    GoalMet,
    /// The planner found no way.
    Stuck(Obstacle),
    /// No part could be taken and put as the action wants.
    NoWay {
        /// The action.
        action: String,
    },
    /// Something lies where the action would put a part.
    Occupied {
        /// The action.
        action: String,
    },
    /// Simulated time or skills were used up.
    GaveUp,
}

/// What happened in an episode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EpisodeReport {
    /// How it ended.
    pub ended: Ended,
    /// Whether the task's judge takes it to be solved.
    pub solved: bool,
    /// Every decision, with the skill that followed it.
    pub decisions: Vec<Decided>,
    /// Every touch of the fingers.
    pub touches: Vec<Touched>,
    /// Parts that were in no state when last looked at, or are gone from the table.
    pub in_no_state: usize,
    /// Times that a part was found in no state that had not been so when looked at before.
    pub unexplained: usize,
    /// Whether the perturbation that was asked for was done.
    pub perturbed: bool,
    /// Steps of the physics.
    pub steps: u64,
    /// Simulated seconds.
    pub simulated_s: f64,
}

impl EpisodeReport {
    /// Every skill that is over, in order.
    pub fn skills(&self) -> impl Iterator<Item = &SkillReport> {
        self.decisions.iter().filter_map(|d| d.skill.as_ref())
    }

    /// Times a part left the hand on the way.
    pub fn drops(&self) -> usize {
        self.skills().filter(|s| s.outcome == SkillOutcome::Dropped).count()
    }

    /// Times a part was in the hand.
    pub fn picks(&self) -> usize {
        self.skills().filter(|s| s.picked).count()
    }

    /// What was decided and how the skill that carried it out ended, in order.
    pub fn attempts(&self) -> impl Iterator<Item = (&str, SkillOutcome)> {
        self.decisions.iter().filter_map(|d| Some((d.action.as_deref()?, d.outcome()?)))
    }

    /// Skills that did not put their part where they should: each is followed by a new decision.
    pub fn replans(&self) -> usize {
        self.skills().filter(|s| s.outcome != SkillOutcome::Placed).count()
    }

    /// Whether the goal was taken to be met and is not.
    pub fn false_goal(&self) -> bool {
        self.ended == Ended::GoalMet && !self.solved
    }
}
