//! Recoveries: what the executor does when an action cannot begin or keeps failing, or when the planner is stuck while
//! parts are in no state.
//!
//! The [`LADDER`] is an ordered list. Each rung looks at the [`Plight`] and lists [`Detour`]s, the best first. The first
//! that can begin is carried out, and the next look decides anew: the fallback node of a behaviour tree, whose children
//! are data (Colledanchise and Ögren, "Behavior Trees in Robotics and AI", 2018). [`Attempts`](attempts::Attempts) is
//! the memory that retry nodes have: it bounds how often the same is tried.
//!
//! To add a recovery, write a file with a type that is a [`Rung`], and put it into the ladder. It changes the scene so
//! that a later action can begin. What still carries out the decided action (other parts, grasps, places and orders) is
//! in [`act`](super::act).

pub(super) mod attempts;
mod begin;
mod clear_fact;
mod clear_neighbour;
mod clear_target;
pub(super) mod places;
pub(super) mod plight;
mod reseat;
mod reseat_reference;
mod rung;
mod take_anew;

use plight::Plight;
use rung::{Detour, Rung};

/// The recoveries in the order in which they are tried.
const LADDER: [&dyn Rung; 10] = [
    &clear_fact::ClearFact,
    &reseat::Reseat,
    &reseat_reference::ReseatReference { jammed: true },
    &clear_target::ClearTarget::Jammed,
    &clear_target::ClearTarget::Shared,
    &take_anew::TakeAnew { well: true },
    &clear_target::ClearTarget::Any,
    &clear_neighbour::ClearNeighbour,
    &reseat_reference::ReseatReference { jammed: false },
    &take_anew::TakeAnew { well: false },
];

/// Lists the detours of all rungs, each kind once for each part.
fn detours(plight: &Plight<'_>) -> Vec<Detour> {
    let mut all: Vec<Detour> = Vec::new();
    for detour in LADDER.iter().flat_map(|rung| rung.detours(plight)) {
        let Detour { kind, part, strict, .. } = detour;
        let same = |d: &Detour| (d.kind, d.part, d.strict) == (kind, part, strict);
        if plight.may_lift(part) && !all.iter().any(same) {
            all.push(detour);
        }
    }
    all
}
