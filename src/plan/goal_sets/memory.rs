//! The tree of goal sets: slots that remember each goal set, the operator that led to it, and the slot it came from.

use super::choice::{BAR, Choice};
use super::control::{Phase, Signal};
use super::costs::LEVELS;
use super::retreat::retreat;
use super::rules::Regression;
use super::wiring::{AND, Group, Weight, Wiring, cells, each, spread};
use crate::sim::Real;

/// Where a slot keeps what.
///
/// A row has one column for each fluent of the goal set, one that marks the slot as taken, and the numbers of the operator
/// and of the slot before as places in square grids: a row and a column each, since one unit for each number takes more.
pub(super) struct Layout {
    fluents: usize,
    operators: usize,
    pub slots: usize,
    operator_side: usize,
    slot_side: usize,
}

impl Layout {
    pub fn new(fluents: usize, operators: usize, slots: usize) -> Self {
        let side = |count: usize| (count as f64).sqrt().ceil() as usize;
        Self { fluents, operators, slots, operator_side: side(operators), slot_side: side(slots) }
    }

    /// Returns about how many units the planner has.
    pub fn units(&self) -> usize {
        let row = self.columns().saturating_mul(3).saturating_add(self.fluents + self.operators);
        let rules = self.fluents.saturating_mul(3 * LEVELS + 16);
        // Pairs of fluents are kept as a table while the planner is built.
        let table = self.fluents.saturating_mul(self.fluents) / 256;
        let fixed = rules.saturating_add(self.operators.saturating_mul(15)).saturating_add(table);
        self.slots.saturating_mul(row.saturating_add(4 * LEVELS + 5)).saturating_add(fixed)
    }

    fn mark(&self) -> usize {
        self.fluents
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

    fn cells(&self) -> usize {
        self.slots * self.columns()
    }

    /// Returns the slot, the column and the cell of all cells in a range of columns.
    fn grid(
        &self,
        columns: std::ops::Range<usize>,
    ) -> impl Iterator<Item = (usize, usize, usize)> + use<> {
        cells(self.slots, self.columns()).filter(move |(_, x, _)| columns.contains(x))
    }

    fn all(&self) -> impl Iterator<Item = (usize, usize, usize)> + use<> {
        self.grid(0..self.columns())
    }
}

/// The groups of the memory.
pub(super) struct Memory {
    /// The present slot.
    pub slot: Group,
    /// One unit for each operator: the one that led to the present slot.
    pub shown: Group,
    /// The goal set of the next slot.
    pub recalled: Group,
    /// The goal set before the winner.
    pub child: Group,
}

/// Weights that move the one active unit of a group.
fn replace(count: usize) -> impl Iterator<Item = Weight> {
    let pairs = (0..count).flat_map(move |a| (0..count).map(move |b| (a, b)));
    pairs.map(|(a, b)| (a, b, if a == b { 1.2 } else { -1.5 }))
}

impl Memory {
    /// Adds the memory. `goals` is the present goal set.
    pub fn new(
        w: &mut Wiring<'_, '_>,
        layout: &Layout,
        rules: &Regression,
        (phases, signals): (&Group, &Group),
        goals: &Group,
        choice: &Choice,
    ) -> Self {
        let (fluents, slots) = (layout.fluents, layout.slots);
        let when = |phases: &[Phase]| {
            let weights = phases.iter().flat_map(|p| spread(*p as usize, slots, 1.0));
            weights.collect::<Vec<_>>()
        };

        // The present slot, the one to move to, and the next free one.
        let slot = w.latches("slot", slots);
        let next = w.latches("next", slots);
        let free = w.latches("free", slots);
        let start = Phase::Start as usize;
        w.link(phases, &next, (0..slots).map(|k| (start, k, if k == 0 { 1.2 } else { -1.5 })));
        let count = w.both("count_slot", slots);
        w.link(&next, &count, (1..slots).map(|k| (k - 1, k, 1.0)));
        w.link(phases, &count, when(&[Phase::Wave, Phase::Write]));
        let take = w.both("take_slot", slots);
        w.link(&free, &take, each(slots, 1.0));
        w.link(phases, &take, when(&[Phase::Check]));
        let shift = w.both("shift_slot", slots);
        w.link(&next, &shift, each(slots, 1.0));
        w.link(phases, &shift, when(&[Phase::Wave, Phase::Settle, Phase::Next]));
        w.link(&count, &free, replace(slots));
        w.link(&take, &next, replace(slots));
        w.link(&shift, &slot, replace(slots));
        let ends = [(0, Signal::First as usize, 1.0), (slots - 1, Signal::Last as usize, 1.0)];
        w.link(&slot, signals, ends);

        // What is stored: the goal set before the winner, a mark, the winner's number, and the present slot's.
        let (columns, cells) = (layout.columns(), layout.cells());
        let child = w.units("child", columns);
        w.link(goals, &child, each(fluents, 1.0));
        let numbered = (0..layout.operators).flat_map(|a| layout.code(a).map(|c| (a, c, 1.0)));
        let changes = rules.operators.iter().enumerate().flat_map(|(a, operator)| {
            let adds = operator.adds.iter().map(move |f| (a, *f, -1.5));
            adds.chain(operator.preconditions.iter().map(move |f| (a, *f, 1.7)))
        });
        w.link(&choice.winner, &child, numbered.chain(changes));
        w.link(&slot, &child, (0..slots).flat_map(|k| layout.pointer(k).map(|c| (k, c, 1.0))));
        let mark: Vec<Real> = (0..columns).map(|c| Real::from(u8::from(c == fluents))).collect();
        w.bias(&child, &mark);

        let write = w.both("write", slots);
        w.link(&next, &write, each(slots, 1.0));
        w.link(phases, &write, when(&[Phase::Wave, Phase::Write]));
        let store = w.both("store", cells);
        w.link(&child, &store, layout.all().map(|(_, x, cell)| (x, cell, 1.0)));
        w.link(&write, &store, layout.all().map(|(k, _, cell)| (k, cell, 1.0)));
        let memory = w.latches("memory", cells);
        w.link(&store, &memory, each(cells, 3.3));
        w.link(&write, &memory, layout.all().map(|(k, _, cell)| (k, cell, -2.0)));
        w.link(phases, &memory, spread(start, cells, -3.0));

        // What is read: the goal set of the next slot, and the numbers of the present one.
        let read = w.both("read", cells);
        w.link(&memory, &read, each(cells, 1.0));
        let sets = layout.grid(0..fluents);
        w.link(&next, &read, sets.map(|(k, _, cell)| (k, cell, 1.0)));
        let numbers = layout.grid(fluents + 1..columns);
        w.link(&slot, &read, numbers.map(|(k, _, cell)| (k, cell, 1.0)));
        let recalled = w.sum("recalled", columns);
        w.link(&read, &recalled, layout.all().map(|(_, x, cell)| (cell, x, 1.0)));
        let shown = w.both("shown", layout.operators);
        let numbered = (0..layout.operators).flat_map(|a| layout.code(a).map(|c| (c, a, 1.0)));
        w.link(&recalled, &shown, numbered);
        let before = w.biased("slot_before", slots, 2.0 * AND);
        w.link(&recalled, &before, (0..slots).flat_map(|k| layout.pointer(k).map(|c| (c, k, 1.0))));
        w.link(phases, &before, when(&[Phase::Begin, Phase::Step]));
        w.link(&before, &next, replace(slots));

        let marks = w.sum("marks", slots);
        let marked = layout.grid(fluents..fluents + 1);
        w.link(&memory, &marks, marked.map(|(k, _, cell)| (cell, k, 1.0)));
        let retreat = retreat(w, (phases, signals), &slot, &choice.gains, &marks);
        w.link(&retreat, &next, replace(slots));

        visited(w, layout, rules, &memory, goals, choice);
        Self { slot, shown, recalled, child }
    }
}

/// Vetoes the operators whose goal set contains one that was visited.
///
/// A remembered goal set V is part of G - adds + preconditions unless a fluent of V is missing there: it is not in G and no
/// precondition, or it is added and no precondition. One unit for each slot and operator sums the reasons. Reasons that
/// do not count are taken off again, spike by spike, so that their noise cancels.
fn visited(
    w: &mut Wiring<'_, '_>,
    layout: &Layout,
    rules: &Regression,
    memory: &Group,
    goals: &Group,
    choice: &Choice,
) {
    const REASON: Real = -1.5;
    let (fluents, slots, operators) = (layout.fluents, layout.slots, layout.operators);
    let gone = w.units("gone", slots * fluents);
    let sets = || layout.grid(0..fluents);
    w.link(memory, &gone, sets().map(|(k, f, cell)| (cell, k * fluents + f, 1.0)));
    w.link(goals, &gone, sets().map(|(k, f, _)| (f, k * fluents + f, -1.3)));
    let visited = w.units("visited", slots * operators);
    let pairs = || cells(slots, operators);
    let reasons = w.sum("reasons", slots);
    w.link(&gone, &reasons, sets().map(|(k, f, _)| (k * fluents + f, k, 1.0)));
    w.link(&reasons, &visited, pairs().map(|(k, _, pair)| (k, pair, REASON)));
    let kept = pairs().flat_map(|(k, a, pair)| {
        rules.operators[a].preconditions.iter().map(move |f| (k * fluents + f, pair, -REASON))
    });
    w.link(&gone, &visited, kept);
    let marks = layout.grid(fluents..fluents + 1);
    let marks: Vec<usize> = marks.map(|(_, _, cell)| cell).collect();
    let added = pairs().flat_map(|(k, a, pair)| {
        let operator = &rules.operators[a];
        let added = operator.adds.iter().filter(|f| !operator.preconditions.contains(f));
        let cells = layout.columns() * k;
        let reasons = added.map(move |f| (cells + f, pair, REASON));
        reasons.chain([(marks[k], pair, 1.0)])
    });
    w.link(memory, &visited, added);
    w.link(&visited, &choice.eligible, pairs().map(|(_, a, pair)| (pair, a, -1.3)));
    w.link(&visited, &choice.utilities, pairs().map(|(_, a, pair)| (pair, a, BAR)));
}
