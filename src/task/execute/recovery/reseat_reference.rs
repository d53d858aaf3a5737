//! Takes out the references of what was wanted: they may lie wrongly although their state says otherwise.

use super::plight::Plight;
use super::rung::{Detour, Rung};
use crate::task::event::RecoveryKind;

pub(super) struct ReseatReference {
    /// Whether only where something at the target was the reason.
    pub jammed: bool,
}

impl Rung for ReseatReference {
    fn detours(&self, plight: &Plight<'_>) -> Vec<Detour> {
        let wanted = plight.wanted.iter().filter(|w| w.jammed || !self.jammed);
        let detour = |w: &super::plight::Wanted| {
            let part = w.reference?;
            let why = format!("{}; {} may lie wrongly", w.why, plight.name(part));
            Some(Detour { kind: RecoveryKind::Reseat, part, strict: false, why })
        };
        wanted.filter_map(detour).collect()
    }
}
