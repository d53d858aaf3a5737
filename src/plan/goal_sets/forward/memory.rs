//! The tree of states; the way from the goal back to the first, and forth again.

use super::control::{Phase, Signal};
use super::graph::Progression;
use crate::plan::goal_sets::tree::{Layout, Tree, Turns, Visited, gated};
use crate::plan::goal_sets::wiring::{AND, Group, Wiring, each, gather, replace, spread};
use crate::sim::Real;

/// Weight with which dead ends make the search weary: about forty of them do.
///
/// A search in the order of depth can stay among dead ends for long. To begin anew, with other choices, costs little. (Gomes,
/// Selman and Kautz, "Boosting combinatorial search through randomization", 1998.)
const TIRES: Real = 0.011;

const fn at(phase: Phase) -> usize {
    phase as usize
}

const TURNS: Turns<'static> = Turns {
    start: at(Phase::Start),
    write: &[at(Phase::Write)],
    written: at(Phase::Settle),
    check: at(Phase::Check),
    shift: &[at(Phase::Settle), at(Phase::Up), at(Phase::Next)],
    before: &[at(Phase::Mark)],
    shows: &[at(Phase::Fetch), at(Phase::Show)],
    veto: at(Phase::Veto),
    freed: &[at(Phase::Start), at(Phase::Write), at(Phase::Read)],
    back: at(Phase::Back),
    revives: &[at(Phase::Start), at(Phase::Widen)],
    left: Signal::Left as usize,
    ends: [Signal::First as usize, Signal::Last as usize],
    seen: Signal::Seen as usize,
};

/// Adds the memory. `state` is the present one.
pub(super) fn memory(
    w: &mut Wiring<'_, '_>,
    layout: &Layout,
    rules: &Progression,
    (phases, signals): (&Group, &Group),
    state: &Group,
    winner: &Group,
) -> Tree {
    let changes = rules.deletes(-1.5).into_iter().chain(rules.adds(1.7));
    let changes = changes.map(|(f, a, weight)| (a, f, weight)).collect();
    let moving = (state, winner);
    let compared = (Visited::Within, None);
    let tree = Tree::new(w, layout, (phases, signals), &TURNS, moving, changes, compared);
    let (slot, slots) = (&tree.slot, layout.slots);

    w.link(&tree.dead, signals, gather(slots, Signal::Weary as usize, TIRES));

    let path = w.latches("path", slots);
    let marking = gated(w, "mark_path", slot, phases, &[at(Phase::Mark)]);
    w.link(&marking, &path, each(slots, 1.2));
    w.link(phases, &path, spread(at(Phase::Start), slots, -5.0));
    let off = w.tonic("off_path", slots);
    w.link(&path, &off, each(slots, -1.3));
    let child_of = w.biased("child_of_slot", slots, 1.3 * AND);
    w.link(&tree.kin, &child_of, each(slots, 1.0));
    w.link(&off, &child_of, each(slots, -4.0));
    w.link(slot, &child_of, each(slots, -4.0));
    let follow = gated(w, "follow", &child_of, phases, &[at(Phase::Step)]);
    replace(w, &follow, &tree.next);
    w.link(&follow, signals, gather(slots, Signal::Follows as usize, 1.0));
    tree
}
