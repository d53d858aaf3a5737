//! The slot to go on with after a dead end: the latest that is no dead end, or the lowest, if it is known how far sets are from what
//! holds at first.

use super::tree::{Layout, Turns};
use super::wiring::{AND, Group, Wiring, cells, each, gather, replace, spread};
use crate::sim::{Real, Synapse};

/// Time constant with which the phase is held until the lowest slots are found, in milliseconds.
const HOLD_MS: u64 = 32;
/// Weight with which a slot that may not be gone on with is kept from being low. It must outweigh all heights.
const GONE: Real = -12.0;

/// How far sets of fluents are from what holds at first, in heights.
pub(super) struct Distances<'a> {
    /// Sets of one to three fluents, with the height from which on each set that contains them is.
    pub sets: &'a [(Vec<usize>, usize)],
    /// The greatest height.
    pub most: usize,
    /// Phases that have lasted for their time.
    pub elapsed: &'a Group,
}

/// Adds the height of the set after the winner to what is written: as many columns as it is high.
pub(super) fn heights(
    w: &mut Wiring<'_, '_>,
    distances: &Distances<'_>,
    child: &Group,
    layout: &Layout,
) {
    let sets = distances.sets;
    let far = w.units("far_sets", sets.len());
    let numbered = || sets.iter().enumerate();
    let parts = numbered().flat_map(|(i, (set, _))| set.iter().map(move |f| (*f, i, 1.0)));
    w.link(child, &far, parts);
    let bias = sets.iter().map(|(set, _)| AND * (set.len() - 1) as Real);
    w.bias(&far, &bias.collect::<Vec<_>>());
    let height = w.units("height", distances.most);
    let reach = numbered().flat_map(|(i, (_, height))| (0..*height).map(move |h| (i, h, 1.2)));
    w.link(&far, &height, reach);
    // An input where the sets are cut.
    w.bias(&height, &vec![0.0; distances.most]);
    let columns = layout.heights().enumerate();
    w.link(&height, child, columns.map(|(h, column)| (h, column, 1.0)).collect::<Vec<_>>());
}

/// Adds what is compared with the rows of all slots: `sets`; in the phase `back`, all heights instead.
pub(super) fn compared(
    w: &mut Wiring<'_, '_>,
    (phases, back): (&Group, usize),
    sets: &Group,
    layout: &Layout,
) -> Group {
    w.link(phases, sets, spread(back, sets.count, -1.5));
    let rows = w.sum("rows_compared", layout.mark());
    w.link(sets, &rows, each(sets.count, 1.0));
    let going = w.units("going_back", 1);
    w.link(phases, &going, [(back, 0, 1.0)]);
    w.link(&going, &rows, layout.heights().map(|column| (0, column, 1.0)));
    rows
}

/// Moves to the latest slot that is no dead end, or the latest of the lowest ones. The present one is a dead end. Returns the dead ends.
pub(super) fn retreat(
    w: &mut Wiring<'_, '_>,
    (phases, signals): (&Group, &Group),
    turns: &Turns<'_>,
    [slot, next, marks, missing]: [&Group; 4],
    distances: Option<&Distances<'_>>,
) -> Group {
    let slots = slot.count;
    let back = || spread(turns.back, slots, 1.0);
    let leave = w.both("leave_slot", slots);
    w.link(slot, &leave, each(slots, 1.0));
    w.link(phases, &leave, back());
    let dead = w.latches("dead", slots);
    w.link(&leave, &dead, each(slots, 1.2));
    w.link(phases, &dead, turns.revives.iter().flat_map(|p| spread(*p, slots, -5.0)));
    let left = w.units("left", slots);
    w.link(marks, &left, each(slots, 1.0));
    w.link(&dead, &left, each(slots, -1.3));
    w.link(slot, &left, each(slots, -1.3));
    w.link(&left, signals, gather(slots, turns.left, 1.0));
    let left = match distances {
        Some(distances) => lowest(w, (phases, signals), turns, (&left, missing), distances),
        None => left,
    };
    // Slots are summed in rows, so that the weights are as many as slots times the root of their number.
    let side = slots.isqrt().max(1);
    let count = slots.div_ceil(side);
    let rows = w.sum("left_rows", count);
    w.link(&left, &rows, (0..slots).map(|k| (k, k / side, 1.0)));
    if distances.is_some() {
        // An input where the lowest slots are cut.
        w.bias(&rows, &vec![0.0; count]);
    }
    let retreat = w.both("retreat", slots);
    let later = (0..slots).flat_map(|k| (k / side + 1..count).map(move |row| (row, k, -1.5)));
    w.link(&rows, &retreat, later);
    let beside = (0..slots)
        .flat_map(|k| (k + 1..slots.min((k / side + 1) * side)).map(move |j| (j, k, -1.5)));
    w.link(&left, &retreat, each(slots, 1.0).chain(beside).collect::<Vec<_>>());
    w.link(phases, &retreat, back());
    replace(w, &retreat, next);
    dead
}

/// Adds the lowest of the slots that are left, and holds the phase until they are found. `heights` are those of all slots.
///
/// For each height there are units for the slots that are left and no higher. If one of them is active, slots that are higher are not low.
fn lowest(
    w: &mut Wiring<'_, '_>,
    (phases, signals): (&Group, &Group),
    turns: &Turns<'_>,
    (left, heights): (&Group, &Group),
    distances: &Distances<'_>,
) -> Group {
    let (slots, most) = (left.count, distances.most);
    let gone = w.tonic("gone", slots);
    w.link(left, &gone, each(slots, -1.3));
    let rows = || cells(most, slots);
    // All heights together are a little more than their number, since the phase is.
    let within = w.units("within_height", most * slots);
    let bias: Vec<Real> = rows().map(|(height, ..)| 0.85 + height as Real).collect();
    w.bias(&within, &bias);
    w.link(heights, &within, rows().map(|(_, slot, cell)| (slot, cell, -0.93)));
    w.link(&gone, &within, rows().map(|(_, slot, cell)| (slot, cell, GONE)));
    let some = w.units("some_within_height", most);
    w.link(&within, &some, rows().map(|(height, _, cell)| (cell, height, 1.2)));
    // An input where `within` is cut.
    w.bias(&some, &vec![0.0; most]);
    let above = w.units("above_height", most * slots);
    w.link(&some, &above, rows().map(|(height, _, cell)| (height, cell, 1.0)));
    w.link(&within, &above, each(most * slots, -2.0));
    let low = w.units("low", slots);
    w.link(left, &low, each(slots, 1.0));
    w.link(&above, &low, rows().map(|(_, slot, cell)| (cell, slot, -1.5)));

    let found = w.units("found", 1);
    w.link_by(phases, &found, [(turns.back, 0, 1.0)], Synapse::lowpass_ms(HOLD_MS));
    let seeks = w.both("seeks", 1);
    w.link(signals, &seeks, [(turns.left, 0, 1.0)]);
    w.link(phases, &seeks, [(turns.back, 0, 1.0)]);
    w.link(&found, &seeks, [(0, 0, -2.0)]);
    w.link(&seeks, distances.elapsed, [(0, turns.back, -4.0)]);
    low
}
