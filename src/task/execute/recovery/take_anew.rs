//! Puts a part down elsewhere to take it anew, or pushes it.

use super::plight::Plight;
use super::rung::{Detour, Rung};
use crate::task::event::RecoveryKind;

pub(super) struct TakeAnew {
    /// Whether the part must lie afterwards as parts of its kind lay when they were found. Then only a part that lies
    /// otherwise is pushed.
    pub well: bool,
}

impl Rung for TakeAnew {
    fn detours(&self, plight: &Plight<'_>) -> Vec<Detour> {
        let mut all = Vec::new();
        for (part, why) in plight.handled() {
            let (kind, strict) = (RecoveryKind::Regrasp, self.well);
            all.push(Detour { kind, part, strict, why: why.clone() });
            if !self.well || plight.lies_ill(part) {
                all.push(Detour { kind: RecoveryKind::Push, part, strict: false, why });
            }
        }
        all
    }
}
