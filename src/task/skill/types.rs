//! What skills report.

use serde::{Deserialize, Serialize};

/// How a skill ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SkillOutcome {
    /// The part was let go at its target.
    Placed,
    /// The part left the hand on the way.
    Dropped,
    /// The hand closed and lifted, and the part was not in it.
    Missed,
    /// The arm ran into something and gave way.
    Blocked,
    /// Another part had come to where it was to be put; it was put back.
    Occupied,
    /// There is no way to take the part and put it there.
    Unreachable,
    /// A wait took longer than it may.
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

/// What a recorder wants to know.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Touch {
    /// Both pads press on the part.
    Contact(usize),
    /// The part has been free of the pads for a tenth of a second.
    Release(usize),
}

/// What a skill did.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SkillReport {
    /// The part's place in the scene.
    pub part: usize,
    /// How it ended.
    pub outcome: SkillOutcome,
    /// Whether the part was in the hand at some time.
    pub picked: bool,
    /// How far the part had moved in the hand between lifting and letting go, in metres.
    pub slip_m: f64,
}

/// What one step brought.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Stepped {
    /// A touch to be recorded.
    pub touch: Option<Touch>,
    /// The skill's report, in the step in which it ended.
    pub ended: Option<SkillReport>,
}
