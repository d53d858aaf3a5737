//! The tree of goal sets.

use super::choice::Choice;
use super::control::{Control, Phase, Signal};
use super::race::BAR;
use super::retreat::Distances;
use super::rules::Regression;
use super::tree::{Layout, Tree, Turns, Visited};
use super::wiring::{Group, Wiring, each};

const fn at(phase: Phase) -> usize {
    phase as usize
}

const TURNS: Turns<'static> = Turns {
    start: at(Phase::Start),
    write: &[at(Phase::Wave), at(Phase::Write)],
    written: at(Phase::Settle),
    check: at(Phase::Check),
    shift: &[at(Phase::Wave), at(Phase::Settle), at(Phase::Next)],
    before: &[at(Phase::Begin), at(Phase::Step)],
    shows: &[],
    veto: at(Phase::Veto),
    freed: &[at(Phase::Start), at(Phase::Write), at(Phase::Read)],
    back: at(Phase::Back),
    revives: &[at(Phase::Start)],
    left: Signal::Left as usize,
    ends: [Signal::First as usize, Signal::Last as usize],
    seen: Signal::Seen as usize,
};

/// Adds the memory. `goals` is the present goal set.
pub(super) fn memory(
    w: &mut Wiring<'_, '_>,
    layout: &Layout,
    rules: &Regression,
    Control { phases, signals, elapsed, .. }: &Control,
    goals: &Group,
    choice: &Choice,
) -> Tree {
    let changes = rules.operators.iter().enumerate().flat_map(|(a, operator)| {
        let adds = operator.adds.iter().map(move |f| (a, *f, -1.5));
        adds.chain(operator.preconditions.iter().map(move |f| (a, *f, 1.7)))
    });
    let moving = (goals, &choice.winner);
    let changes = changes.collect();
    let (sets, most) = (&*rules.heights, layout.heights().len());
    let distances = (most > 0).then_some(Distances { sets, most, elapsed });
    let compared = (Visited::Around, distances.as_ref());
    let tree = Tree::new(w, layout, (phases, signals), &TURNS, moving, changes, compared);
    for tabu in &tree.tabu {
        w.link(tabu, &choice.eligible, each(tabu.count, -1.3));
        w.link(tabu, &choice.utilities, each(tabu.count, BAR));
    }
    tree
}
