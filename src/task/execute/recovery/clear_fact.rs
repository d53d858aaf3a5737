//! Moves away parts whose states forbid a fact that no action causes.

use super::plight::Plight;
use super::rung::{Detour, Rung};
use crate::task::event::RecoveryKind;

pub(super) struct ClearFact;

impl Rung for ClearFact {
    fn detours(&self, plight: &Plight<'_>) -> Vec<Detour> {
        let each = |strict| {
            plight.in_the_way.iter().map(move |(part, fact)| Detour {
                kind: RecoveryKind::Clear,
                part: *part,
                strict,
                why: format!("{fact} does not hold, and no action causes it"),
            })
        };
        [true, false].into_iter().flat_map(each).collect()
    }
}
