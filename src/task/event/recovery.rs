//! Recoveries: what the executor changes after an action failed or could not begin.

use serde::{Deserialize, Serialize};

/// The kind of a recovery. The first five still carry out the decided action; the others change the scene first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum RecoveryKind {
    /// The action as before, after it failed once or the part came to lie elsewhere.
    Again,
    /// The action with another part.
    Part,
    /// The action with another grasp.
    Grasp,
    /// The action at another place, height or reference.
    Place,
    /// Another action, because the decided one cannot be carried out now.
    Order,
    /// The part is put down at a free place, to be taken anew.
    Regrasp,
    /// A part that lies wrongly at a target is taken out.
    Reseat,
    /// A part that is in the way is moved to a free place.
    Clear,
    /// A part is pushed.
    Push,
}

impl RecoveryKind {
    /// Returns the kind's name, as it stands in `trace.jsonl`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Again => "again",
            Self::Part => "part",
            Self::Grasp => "grasp",
            Self::Place => "place",
            Self::Order => "order",
            Self::Regrasp => "regrasp",
            Self::Reseat => "reseat",
            Self::Clear => "clear",
            Self::Push => "push",
        }
    }

    /// Returns whether the skill is not the decided action, but changes the scene so that a later action can begin.
    pub fn is_detour(self) -> bool {
        matches!(self, Self::Regrasp | Self::Reseat | Self::Clear | Self::Push)
    }

    /// Returns what the robot does, in words, such as "lays nut_0 at a free place, to take it anew".
    pub fn describe(self, object: &str) -> String {
        match self {
            Self::Again => format!("takes {object} again"),
            Self::Part => format!("takes {object} this time"),
            Self::Grasp => format!("takes {object} by another grasp"),
            Self::Place => format!("puts {object} at another place than before"),
            Self::Order => format!("takes {object} first"),
            Self::Regrasp => format!("lays {object} at a free place, to take it anew"),
            Self::Reseat => {
                format!("takes {object} from where it lies, and lays it at a free place")
            }
            Self::Clear => format!("moves {object} out of the way"),
            Self::Push => format!("pushes {object}"),
        }
    }
}

/// A recovery: what the executor changed, and why.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Recovery {
    /// Kind of the change.
    pub kind: RecoveryKind,
    /// Id of the object that the robot handles.
    pub object: String,
    /// Its name for people; empty in older traces.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// Reason, in words.
    pub why: String,
    /// Number of times that the robot has taken the object or tried to, this one included; of a detour, number of detours of this kind
    /// with the object.
    pub attempt: usize,
}

impl Recovery {
    /// Returns the object's name for people; its id if it has none.
    pub fn name(&self) -> &str {
        if self.name.is_empty() { &self.object } else { &self.name }
    }

    /// Returns what the robot does and why, and how often it had taken the object before, as one sentence without a full stop.
    pub fn text(&self) -> String {
        let Self { kind, why, attempt, .. } = self;
        let does = format!("{}: {why}", kind.describe(self.name()));
        match attempt.saturating_sub(1) {
            0 => does,
            _ if kind.is_detour() => does,
            1 => format!("{does}; {} had been taken once before", self.name()),
            2 => format!("{does}; {} had been taken twice before", self.name()),
            times => format!("{does}; {} had been taken {times} times before", self.name()),
        }
    }
}
