//! Skill events: contacts and releases while a skill runs, and the report at its end.

use serde::{Deserialize, Serialize};

/// How a skill ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SkillOutcome {
    /// The part was released at its target.
    Placed,
    /// The part was lost while it was carried.
    Dropped,
    /// The part was not in the hand after the fingers closed or after lifting.
    Missed,
    /// The arm hit something and stopped.
    Blocked,
    /// Another part was in the way at the target; the held part was put back.
    Occupied,
    /// The robot found no combination of grasp and collision-free path that brings the part to its target.
    Unreachable,
    /// The skill exceeded its time limit.
    #[serde(rename = "timed out")]
    TimedOut,
}

impl std::fmt::Display for SkillOutcome {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Placed => "placed",
            Self::Dropped => "dropped",
            Self::Missed => "missed",
            Self::Blocked => "blocked",
            Self::Occupied => "occupied",
            Self::Unreachable => "unreachable",
            Self::TimedOut => "timed out",
        })
    }
}

/// A change of contact between fingers and part, at which a snapshot is recorded. The number is the part's index in
/// the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Touch {
    /// Both finger pads press on the part.
    Contact(usize),
    /// Neither pad has touched the part for 0.1 s.
    Release(usize),
}

/// The result of one skill.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SkillReport {
    /// Index of the part in the scene.
    pub part: usize,
    /// How the skill ended.
    pub outcome: SkillOutcome,
    /// Whether the part was grasped at any time.
    pub picked: bool,
    /// Distance that the part slipped in the hand between lifting and release, in metres.
    pub slip_m: f64,
}
