//! Takes out parts in no state that lie at a target.

use super::plight::Plight;
use super::rung::{Detour, Rung};
use crate::task::event::RecoveryKind;

pub(super) struct Reseat;

impl Rung for Reseat {
    fn detours(&self, plight: &Plight<'_>) -> Vec<Detour> {
        let of = plight.wanted.iter();
        let lie =
            of.flat_map(|w| plight.wrongly_at(w, true).into_iter().map(move |part| (w, part)));
        lie.map(|(wanted, part)| {
            let name = plight.name(wanted.part);
            let lies = if plight.in_no_state[part] { "is in no state and lies" } else { "lies" };
            let why = format!("it {lies} where {name} is to be put");
            Detour { kind: RecoveryKind::Reseat, part, strict: false, why }
        })
        .collect()
    }
}
