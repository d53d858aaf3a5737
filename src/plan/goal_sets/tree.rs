//! The tree of a search: slots that remember sets of fluents, the operator that led to each, and the slot it came from.
//!
//! The contents of the slots are weights of plastic synapses ([`Synapses`]): a slot has one unit for each of its roles, and a
//! number for each fluent. Two searches use the tree: backward its sets are goals, forward they are states.

use super::retreat::{Distances, compared as compare_heights, heights, retreat};
use super::synapses::{SynapsePorts, Synapses};
use super::tried::Tried;
use super::wiring::{AND, Group, Weight, Wiring, each, gather, replace, spread};
use crate::sim::{Real, Synapse};

/// Units of a slot.
const SLOT_UNITS: usize = 20;
/// Synapses of operators that take as much memory as a unit.
const TRIED_PER_UNIT: usize = 1024;

/// Where a slot keeps what.
///
/// A row of synapses has one column for each fluent of the goal set, one for each height of it ([`Distances`]), one that marks the slot as taken, and the numbers of the operator
/// and of the slot before as places in square grids: a row and a column each, since one synapse for each number takes more.
pub(super) struct Layout {
    fluents: usize,
    heights: usize,
    pub slots: usize,
    operator_side: usize,
    slot_side: usize,
}

impl Layout {
    pub fn new(fluents: usize, operators: usize, slots: usize) -> Self {
        let side = |count: usize| (count as f64).sqrt().ceil() as usize;
        let (operator_side, slot_side) = (side(operators), side(slots));
        Self { fluents, heights: 0, slots, operator_side, slot_side }
    }

    /// Lets slots remember the height of their sets.
    pub fn with_heights(self, heights: usize) -> Self {
        Self { heights, ..self }
    }

    /// Returns about how many units the slots take.
    pub fn units(&self) -> usize {
        // A table of what was tried counts too, where it is large.
        self.slots.saturating_mul(SLOT_UNITS + self.operator_side.pow(2) / TRIED_PER_UNIT)
    }

    /// Returns the columns of the heights.
    pub fn heights(&self) -> std::ops::Range<usize> {
        self.fluents..self.fluents + self.heights
    }

    /// Returns the column that marks a slot as taken.
    pub fn mark(&self) -> usize {
        self.fluents + self.heights
    }

    /// Returns the columns of an operator's number.
    pub fn code(&self, operator: usize) -> [usize; 2] {
        let first = self.mark() + 1;
        [
            first + operator / self.operator_side,
            first + self.operator_side + operator % self.operator_side,
        ]
    }

    /// Returns the columns of a slot's number.
    pub fn pointer(&self, slot: usize) -> [usize; 2] {
        let first = self.mark() + 1 + 2 * self.operator_side;
        [first + slot / self.slot_side, first + self.slot_side + slot % self.slot_side]
    }

    pub fn columns(&self) -> usize {
        self.mark() + 1 + 2 * (self.operator_side + self.slot_side)
    }

    /// Returns the columns of the slots' numbers.
    pub fn pointers(&self) -> std::ops::Range<usize> {
        self.columns() - 2 * self.slot_side..self.columns()
    }
}

/// The phases in which the tree does what, and the signals that it gives, as positions.
pub(super) struct Turns<'a> {
    /// Everything is forgotten, and the first slot is next.
    pub start: usize,
    /// The set after the winner is written to the next slot. In the phase after it, what is written changes.
    pub write: &'a [usize],
    pub written: usize,
    /// The free slot becomes the next one.
    pub check: usize,
    /// The next slot becomes the present one.
    pub shift: &'a [usize],
    /// The slot before the present one becomes the next one.
    pub before: &'a [usize],
    /// The operator of the next slot is shown in these phases, and that of the present one if there are none.
    pub shows: &'a [usize],
    /// The winner is barred until the set changes.
    pub veto: usize,
    pub freed: &'a [usize],
    /// The slot to go on with after a dead end becomes the next one.
    pub back: usize,
    /// Dead ends are forgotten in these phases.
    pub revives: &'a [usize],
    /// The present slot is the first, or the last.
    pub ends: [usize; 2],
    /// Some slot is taken and no dead end, apart from the present one.
    pub left: usize,
    /// The set after the winner was visited.
    pub seen: usize,
}

/// How the set after a winner is compared with those that were visited.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Visited {
    /// It must not be part of one: a state that has no more than another one.
    Within,
    /// None must be part of it: a goal set that asks for no less than another one.
    Around,
}

/// The groups of the tree.
pub(super) struct Tree {
    /// The present slot.
    pub slot: Group,
    /// The slot to move to.
    pub next: Group,
    /// One unit for each operator: the one that led to the slot of which it is shown.
    pub shown: Group,
    /// The set of the next slot.
    pub recalled: Group,
    /// The set after the winner.
    pub child: Group,
    /// One item for each slot: 2 if it came from the present one.
    pub kin: Group,
    /// Operators that lead to a visited set, and those that have been tried in the present slot.
    pub tabu: [Group; 2],
    /// Slots that are dead ends.
    pub dead: Group,
}

/// Adds units that pass a group of slots on in some phases, which do not follow each other.
pub(super) fn gated(
    w: &mut Wiring<'_, '_>,
    name: &str,
    from: &Group,
    phases: &Group,
    now: &[usize],
) -> Group {
    let group = w.both(name, from.count);
    w.link(from, &group, each(from.count, 1.0));
    w.link(phases, &group, now.iter().flat_map(|p| spread(*p, from.count, 1.0)));
    group
}

impl Tree {
    /// Adds the tree. `set` is the present one; `changes` link operators to what they take from it and add to it. With
    /// `distances` the search goes back to the lowest set, and otherwise to the latest.
    pub fn new(
        w: &mut Wiring<'_, '_>,
        layout: &Layout,
        (phases, signals): (&Group, &Group),
        turns: &Turns<'_>,
        (set, winner): (&Group, &Group),
        changes: Vec<Weight>,
        (visited, distances): (Visited, Option<&Distances<'_>>),
    ) -> Self {
        let (fluents, operators, slots) = (set.count, winner.count, layout.slots);

        // The present slot, the one to move to, and the next free one.
        let slot = w.latches("slot", slots);
        let next = w.latches("next", slots);
        let free = w.latches("free", slots);
        let first = (0..slots).map(|k| (turns.start, k, if k == 0 { 1.2 } else { -1.5 }));
        w.link(phases, &next, first.collect::<Vec<_>>());
        w.link(phases, &slot, spread(turns.start, slots, -4.0));
        let count = w.both("count_slot", slots);
        w.link(&next, &count, (1..slots).map(|k| (k - 1, k, 1.0)));
        w.link(phases, &count, turns.write.iter().flat_map(|p| spread(*p, slots, 1.0)));
        let take = gated(w, "take_slot", &free, phases, &[turns.check]);
        let shift = gated(w, "shift_slot", &next, phases, turns.shift);
        replace(w, &count, &free);
        replace(w, &take, &next);
        replace(w, &shift, &slot);
        w.link(&slot, signals, [(0, turns.ends[0], 1.0), (slots - 1, turns.ends[1], 1.0)]);

        // What is stored: the set after the winner, a mark, the winner's number, and the present slot's.
        let columns = layout.columns();
        let child = w.units("child", columns);
        w.link(set, &child, each(fluents, 1.0));
        let numbered = (0..operators).flat_map(|a| layout.code(a).map(|c| (a, c, 1.0)));
        w.link(winner, &child, numbered.chain(changes).collect::<Vec<_>>());
        w.link(&slot, &child, (0..slots).flat_map(|k| layout.pointer(k).map(|c| (k, c, 1.0))));
        let mark = (0..columns).map(|c| Real::from(u8::from(c == layout.mark())));
        w.bias(&child, &mark.collect::<Vec<_>>());
        if let Some(distances) = distances {
            heights(w, distances, &child, layout);
        }
        let write = w.both("write", slots);
        w.link(&next, &write, each(slots, 1.0));
        let now = turns.write.iter().flat_map(|p| spread(*p, slots, 1.0));
        let now = now.chain(spread(turns.written, slots, -3.0));
        w.link(phases, &write, now.collect::<Vec<_>>());

        // Whose number is asked for.
        let asked = w.sum("asked", slots);
        if turns.shows.is_empty() {
            w.link(&slot, &asked, each(slots, 1.0));
        } else {
            let before = gated(w, "ask_before", &slot, phases, turns.before);
            w.link(&before, &asked, each(slots, 1.0));
            // One unit for phases that follow each other: while two are active, they would count twice.
            let shows = w.units("shows", 1);
            w.link(phases, &shows, turns.shows.iter().map(|phase| (*phase, 0, 1.0)));
            let action = w.both("ask_action", slots);
            w.link(&next, &action, each(slots, 1.0));
            w.link(&shows, &action, spread(0, slots, 1.0));
            w.link(&action, &asked, each(slots, 1.0));
        }
        let forgets = w.sum("forgets", 1);
        w.link(phases, &forgets, [(turns.start, 0, 1.0)]);

        // What is compared with all rows: the set after the winner, or what is not in it.
        let compared = match visited {
            Visited::Within => w.sum("compared", fluents),
            Visited::Around => w.tonic("compared", fluents),
        };
        let weight = if visited == Visited::Within { 1.0 } else { -1.3 };
        w.link(&child, &compared, each(fluents, weight));
        let compared = match distances {
            Some(_) => compare_heights(w, (phases, turns.back), &compared, layout),
            None => compared,
        };
        let (kin, set) = (layout.pointers(), layout.mark());
        let within = visited == Visited::Within;
        let synapses = Synapses { slots, columns, set, kin, within };
        let SynapsePorts { recalled, missing, kin, marks, .. } = {
            w.describe("synapses");
            let ports = w.scope.add("synapses", synapses);
            for (from, to) in [
                (&write, &ports.write),
                (&child, &ports.pattern),
                (&forgets, &ports.forget),
                (&next, &ports.sets),
                (&asked, &ports.numbers),
                (&compared, &ports.compared),
            ] {
                w.scope.connect(&from.out, to, Synapse::None);
            }
            ports
        };
        let recalled = w.relay("recalled", &recalled, columns);
        let missing = w.relay("missing", &missing, slots);
        let kin = w.relay("kin", &kin, slots);
        let marks = w.relay("marks", &marks, slots);
        let shown = w.both("shown", operators);
        let numbered = (0..operators).flat_map(|a| layout.code(a).map(|c| (c, a, 1.0)));
        w.link(&recalled, &shown, numbered);
        let before = w.biased("slot_before", slots, 2.0 * AND);
        w.link(&recalled, &before, (0..slots).flat_map(|k| layout.pointer(k).map(|c| (c, k, 1.0))));
        w.link(phases, &before, turns.before.iter().flat_map(|p| spread(*p, slots, 1.0)));
        replace(w, &before, &next);

        // Slots to which the winner leads back, and winners that do.
        let same = w.units("same", slots);
        w.link(&marks, &same, each(slots, 1.0));
        w.link(&missing, &same, each(slots, -1.5));
        w.link(&slot, &same, each(slots, -1.5));
        w.link(&same, signals, gather(slots, turns.seen, 1.0));
        let forbid = gated(w, "forbid", winner, phases, &[turns.veto]);
        let tabu = w.latches("tabu", operators);
        w.link(&forbid, &tabu, each(operators, 1.2));
        w.link(&tabu, winner, each(operators, -4.0));
        w.link(phases, &tabu, turns.freed.iter().flat_map(|p| spread(*p, operators, -5.0)));
        let notes = w.units("notes", 1);
        let noted = turns.write.iter().chain([&turns.veto]).map(|phase| (*phase, 0, 1.0));
        w.link(phases, &notes, noted.chain([(turns.written, 0, -3.0)]).collect::<Vec<_>>());
        let gate = w.sum("note", 1);
        w.link(&notes, &gate, [(0, 0, 1.0)]);
        // An input where `notes` is cut.
        w.bias(&gate, &[0.0]);
        w.describe("tried_synapses");
        let ports = w.scope.add("tried_synapses", Tried { slots, operators });
        for (from, to) in [
            (&slot, &ports.slots),
            (winner, &ports.operators),
            (&gate, &ports.gate),
            (&forgets, &ports.forget),
        ] {
            w.scope.connect(&from.out, to, Synapse::None);
        }
        let tabu = [tabu, w.relay("tried", &ports.tried, operators)];
        let groups = [&slot, &next, &marks, &missing];
        let dead = retreat(w, (phases, signals), turns, groups, distances);
        Self { slot, next, shown, recalled, child, kin, tabu, dead }
    }
}
