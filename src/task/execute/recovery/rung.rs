//! A rung of the ladder of recoveries, and the detours that it lists.

use super::plight::Plight;
use crate::task::event::RecoveryKind;

/// A detour: a kind of recovery with a part.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::task::execute) struct Detour {
    pub kind: RecoveryKind,
    pub part: usize,
    /// Whether the part must lie afterwards as parts of its kind lay when they were found.
    pub strict: bool,
    pub why: String,
}

/// A rung of the ladder.
pub(super) trait Rung: Sync {
    /// Returns what it would do, the best first. What the robot cannot lift away is left out afterwards.
    fn detours(&self, plight: &Plight<'_>) -> Vec<Detour>;
}
