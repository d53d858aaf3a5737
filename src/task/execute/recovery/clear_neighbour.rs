//! Moves away the parts beside one that could not be taken, so that the hand has room.

use super::plight::{BESIDE_M, Plight};
use super::rung::{Detour, Rung};
use crate::task::event::RecoveryKind;

pub(super) struct ClearNeighbour;

impl Rung for ClearNeighbour {
    fn detours(&self, plight: &Plight<'_>) -> Vec<Detour> {
        let handled = plight.handled();
        let except: Vec<usize> = handled.iter().map(|(part, _)| *part).collect();
        let mut all = Vec::new();
        for part in &except {
            let Some(at) = plight.at(*part) else { continue };
            for other in plight.near(at, BESIDE_M, &except) {
                let name = plight.name(*part);
                let why = format!("it lies beside {name}, which could not be taken");
                all.push(Detour { kind: RecoveryKind::Clear, part: other, strict: false, why });
            }
        }
        all
    }
}
