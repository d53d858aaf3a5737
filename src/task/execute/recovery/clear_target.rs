//! Moves away the parts that lie around targets.

use super::plight::{BESIDE_M, Plight, Wanted};
use super::rung::{Detour, Rung};
use crate::task::event::RecoveryKind;

/// The targets that are cleared.
pub(super) enum ClearTarget {
    /// Those where something at the target was the reason.
    Jammed,
    /// All, if none of several parts can be put there: the reason is probably near the target.
    Shared,
    /// All.
    Any,
}

impl Rung for ClearTarget {
    fn detours(&self, plight: &Plight<'_>) -> Vec<Detour> {
        let applies = |w: &&Wanted| match self {
            Self::Jammed => w.jammed,
            Self::Shared => plight.wanted_parts().len() > 1,
            Self::Any => true,
        };
        let wanted: Vec<&Wanted> = plight.wanted.iter().filter(applies).collect();
        let targets: Vec<usize> =
            wanted.iter().flat_map(|w| [Some(w.part), w.reference]).flatten().collect();
        let mut all = Vec::new();
        for w in wanted {
            for part in plight.near(w.at, BESIDE_M, &targets) {
                let name = plight.name(w.part);
                let why = format!("it lies where {name} is to be put; {}", w.why);
                all.push(Detour { kind: RecoveryKind::Clear, part, strict: false, why });
            }
        }
        all
    }
}
