//! The tree of states: slots that remember each state, the operator that led to it, and the slot it came from.

use super::super::memory::Layout;
use super::super::synapses::Synapses;
use super::super::wiring::{AND, Group, Wiring, each, gather, replace, spread};
use super::control::{Phase, Signal};
use super::graph::Progression;
use crate::sim::{Real, Synapse};

/// The groups of the memory.
pub(super) struct Memory {
    /// The present slot.
    pub slot: Group,
    /// One unit for each operator: the one that led to the next slot.
    pub shown: Group,
    /// The state of the next slot.
    pub recalled: Group,
    /// The state after the winner.
    pub child: Group,
}

impl Memory {
    /// Adds the memory. `state` is the present one.
    pub fn new(
        w: &mut Wiring<'_, '_>,
        layout: &Layout,
        rules: &Progression,
        (phases, signals): (&Group, &Group),
        state: &Group,
        winner: &Group,
    ) -> Self {
        let (fluents, slots) = (rules.fluents(), layout.slots);
        let when = |phases: &[Phase]| {
            let weights = phases.iter().flat_map(|p| spread(*p as usize, slots, 1.0));
            weights.collect::<Vec<_>>()
        };
        let gated = |w: &mut Wiring<'_, '_>, name: &str, from: &Group, now: &[Phase]| {
            let group = w.both(name, slots);
            w.link(from, &group, each(slots, 1.0));
            w.link(phases, &group, when(now));
            group
        };

        // The present slot, the one to move to, and the next free one.
        let slot = w.latches("slot", slots);
        let next = w.latches("next", slots);
        let free = w.latches("free", slots);
        let start = Phase::Start as usize;
        w.link(phases, &next, (0..slots).map(|k| (start, k, if k == 0 { 1.2 } else { -1.5 })));
        w.link(phases, &slot, spread(start, slots, -4.0));
        let count = w.both("count_slot", slots);
        w.link(&next, &count, (1..slots).map(|k| (k - 1, k, 1.0)));
        w.link(phases, &count, when(&[Phase::Write]));
        let take = gated(w, "take_slot", &free, &[Phase::Check]);
        let shift = gated(w, "shift_slot", &next, &[Phase::Settle, Phase::Up, Phase::Next]);
        replace(w, &count, &free);
        replace(w, &take, &next);
        replace(w, &shift, &slot);
        let ends = [(0, Signal::First as usize, 1.0), (slots - 1, Signal::Last as usize, 1.0)];
        w.link(&slot, signals, ends);

        // What is stored: the state after the winner, a mark, the winner's number, and the present slot's.
        let columns = layout.columns();
        let child = w.units("child", columns);
        w.link(state, &child, each(fluents, 1.0));
        let numbered = (0..rules.operators()).flat_map(|a| layout.code(a).map(|c| (a, c, 1.0)));
        let changes = rules.deletes(-1.5).into_iter().chain(rules.adds(1.7));
        let changes = changes.map(|(f, a, weight)| (a, f, weight));
        w.link(winner, &child, numbered.chain(changes).collect::<Vec<_>>());
        w.link(&slot, &child, (0..slots).flat_map(|k| layout.pointer(k).map(|c| (k, c, 1.0))));
        let mark: Vec<Real> = (0..columns).map(|c| Real::from(u8::from(c == fluents))).collect();
        w.bias(&child, &mark);

        let write = w.both("write", slots);
        w.link(&next, &write, each(slots, 1.0));
        // What is written changes as soon as the next phase begins.
        let settle = Phase::Settle as usize;
        let now = spread(Phase::Write as usize, slots, 1.0).chain(spread(settle, slots, -3.0));
        w.link(phases, &write, now.collect::<Vec<_>>());
        let before_last = gated(w, "ask_before", &slot, &[Phase::Mark]);
        // One unit for two phases that follow each other: while both are active, they would count twice.
        let acting = w.units("shows", 1);
        let shows = [Phase::Fetch, Phase::Show].map(|phase| (phase as usize, 0, 1.0));
        w.link(phases, &acting, shows);
        let ask_action = w.both("ask_action", slots);
        w.link(&next, &ask_action, each(slots, 1.0));
        w.link(&acting, &ask_action, spread(0, slots, 1.0));
        let asked = w.sum("asked", slots);
        w.link(&before_last, &asked, each(slots, 1.0));
        w.link(&ask_action, &asked, each(slots, 1.0));
        let forgets = w.sum("forgets", 1);
        w.link(phases, &forgets, [(start, 0, 1.0)]);
        let pointers = layout.pointers();
        let ports = w.scope.add(
            "synapses",
            Synapses { slots, columns, set: fluents, kin: pointers, within: true },
        );
        let successor = w.sum("successor", fluents);
        w.link(&child, &successor, each(fluents, 1.0));
        for (from, to) in [
            (&write, &ports.write),
            (&child, &ports.pattern),
            (&forgets, &ports.forget),
            (&next, &ports.sets),
            (&asked, &ports.numbers),
            (&successor, &ports.compared),
        ] {
            w.scope.connect(&from.out, to, Synapse::None);
        }
        let recalled = w.relay("recalled", &ports.recalled, columns);
        let missing = w.relay("missing", &ports.missing, slots);
        let kin = w.relay("kin", &ports.kin, slots);
        let marks = w.relay("marks", &ports.marks, slots);

        let shown = w.both("shown", rules.operators());
        let numbered = (0..rules.operators()).flat_map(|a| layout.code(a).map(|c| (c, a, 1.0)));
        w.link(&recalled, &shown, numbered);
        let before = w.biased("slot_before", slots, 2.0 * AND);
        w.link(&recalled, &before, (0..slots).flat_map(|k| layout.pointer(k).map(|c| (c, k, 1.0))));
        w.link(phases, &before, when(&[Phase::Mark]));
        replace(w, &before, &next);

        // States that the one after the winner is part of.
        let same = w.units("same", slots);
        w.link(&marks, &same, each(slots, 1.0));
        w.link(&missing, &same, each(slots, -1.5));
        w.link(&slot, &same, each(slots, -1.5));
        w.link(&same, signals, gather(slots, Signal::Seen as usize, 1.0));

        // The way from the goal back to the first slot, and forth.
        let path = w.latches("path", slots);
        let marking = gated(w, "mark_path", &slot, &[Phase::Mark]);
        w.link(&marking, &path, each(slots, 1.2));
        w.link(phases, &path, spread(start, slots, -5.0));
        let off = w.tonic("off_path", slots);
        w.link(&path, &off, each(slots, -1.3));
        let child_of = w.biased("child_of_slot", slots, 1.3 * AND);
        w.link(&kin, &child_of, each(slots, 1.0));
        w.link(&off, &child_of, each(slots, -4.0));
        w.link(&slot, &child_of, each(slots, -4.0));
        let follow = gated(w, "follow", &child_of, &[Phase::Step]);
        replace(w, &follow, &next);
        w.link(&follow, signals, gather(slots, Signal::Follows as usize, 1.0));

        retreat(w, (phases, signals), &slot, &next, &marks);
        Self { slot, shown, recalled, child }
    }
}

/// Moves to the latest slot that is no dead end, in [`Phase::Back`]. The present one is.
fn retreat(
    w: &mut Wiring<'_, '_>,
    (phases, signals): (&Group, &Group),
    slot: &Group,
    next: &Group,
    marks: &Group,
) {
    let slots = slot.count;
    let back = || spread(Phase::Back as usize, slots, 1.0);
    let leave = w.both("leave_slot", slots);
    w.link(slot, &leave, each(slots, 1.0));
    w.link(phases, &leave, back());
    let dead = w.latches("dead", slots);
    w.link(&leave, &dead, each(slots, 1.2));
    w.link(phases, &dead, spread(Phase::Start as usize, slots, -5.0));
    let left = w.units("left", slots);
    w.link(marks, &left, each(slots, 1.0));
    w.link(&dead, &left, each(slots, -1.3));
    w.link(slot, &left, each(slots, -1.3));
    w.link(&left, signals, gather(slots, Signal::Left as usize, 1.0));
    // Slots are summed in rows, so that the weights are as many as slots times the root of their number.
    let side = slots.isqrt().max(1);
    let count = slots.div_ceil(side);
    let rows = w.sum("left_rows", count);
    w.link(&left, &rows, (0..slots).map(|k| (k, k / side, 1.0)));
    let retreat = w.both("retreat", slots);
    let later = (0..slots).flat_map(|k| (k / side + 1..count).map(move |row| (row, k, -1.5)));
    w.link(&rows, &retreat, later);
    let beside = (0..slots).flat_map(|k| (k + 1..slots.min((k / side + 1) * side)).map(move |j| (j, k, -1.5)));
    w.link(&left, &retreat, each(slots, 1.0).chain(beside).collect::<Vec<_>>());
    w.link(phases, &retreat, back());
    replace(w, &retreat, next);
}
