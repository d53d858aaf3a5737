//! Costs: a wave from what holds reaches fluent after fluent, and rows of latches count the time until then.
//!
//! An operator passes the wave on once the clock has counted more levels than its preconditions cost together. So the cost
//! of a fluent is one more than the sum of the costs of those that its cheapest operator needs: the additive costs of Bonet
//! and Geffner, "Planning as heuristic search" (2001).

use super::search::additive;
use super::wiring::{AND, Group, Weight, Wiring, cells, each, gather, spread};
use crate::plan::strips::Grounded;
use crate::sim::{Real, Synapse};

/// Levels of cost that are told apart, if the costs of a problem need no more, and the greatest number of them.
const LEVELS: [usize; 2] = [16, 32];
/// Synapse from one level of the clock to the next, in milliseconds. A level then lasts about as long as the wave takes
/// from a fluent to the next.
const LEVEL_MS: u64 = 5;
/// Input of an operator's `early` unit when the clock has counted as many levels as its preconditions cost. Greater values
/// make costs too high in exact maths, lower ones too low in spikes, where an active latch gives a little more than 1.
const EARLY: Real = 1.12;
/// Time constant of what was active before, in milliseconds. An item counts as new for about as long.
const BEFORE_MS: u64 = 20;
/// Weight with which the last level of the clock lets all operators pass that are still waiting.
const RELEASE: Real = -100.0;

/// Returns how many levels of cost are told apart: the greater number if some fluent costs more than the smaller one from the
/// start of the problem on. Costs O(operators).
pub(super) fn levels(problem: &Grounded) -> usize {
    let [few, most] = LEVELS;
    let operators = problem.operators.iter().map(|o| (&*o.preconditions, &*o.adds));
    let start = problem.start.iter().copied();
    // One round more: whatever costs more has a fluent before it that is reached then.
    let costs = additive(problem.fluents.len(), operators, start, (most, few + 1));
    if costs.iter().any(|cost| cost.is_finite() && *cost > few as f64) { most } else { few }
}

/// What fluents cost, in levels.
pub(super) struct Costs {
    /// A row of latches for each fluent; as many are active as the fluent has levels.
    pub levels: Group,
    /// Their sum for each fluent.
    pub cost: Group,
}

/// Adds the sum of the levels of each fluent. Links from sums are fewer than those from each level.
pub(super) fn summed(w: &mut Wiring<'_, '_>, name: &str, levels: &Group, fluents: usize) -> Group {
    let sum = w.sum(name, fluents);
    let each = levels.count.checked_div(fluents).unwrap_or(0);
    w.link(levels, &sum, cells(fluents, each).map(|(f, _, level)| (level, f, 1.0)));
    sum
}

/// A wave through the operators of a problem.
pub(super) struct Wave {
    /// Fluents that it has reached.
    pub reached: Group,
    /// Those that it has not.
    pub pending: Group,
    /// Operators that it passes.
    pub enabled: Group,
}

impl Wave {
    /// Adds a wave from `holds`, through groups of three names. `needs` are links from fluents to operators, and `adds` from
    /// operators to fluents, if it needs nothing else to reach them. It is forgotten in the phases of `resets`.
    pub fn new(
        w: &mut Wiring<'_, '_>,
        names: [&str; 3],
        (needs, adds): (&[Weight], &[Weight]),
        (phases, resets): (&Group, &[usize]),
        (holds, operators): (&Group, usize),
    ) -> Self {
        let fluents = holds.count;
        let reached = w.latches(names[0], fluents);
        let pending = w.tonic(names[1], fluents);
        w.link(&reached, &pending, each(fluents, -1.3));
        let enabled = w.tonic(names[2], operators);
        w.link(&pending, &enabled, needs.iter().map(|(f, a, weight)| (*f, *a, -1.3 * weight)));
        let reset = |count, weight| resets.iter().flat_map(move |p| spread(*p, count, weight));
        w.link(phases, &enabled, reset(operators, -1.3));
        w.link(holds, &reached, each(fluents, 4.0));
        if !adds.is_empty() {
            w.link(&enabled, &reached, adds.iter().map(|(f, a, weight)| (*a, *f, 1.2 * weight)));
        }
        w.link(phases, &reached, reset(fluents, -3.0));
        Self { reached, pending, enabled }
    }

    /// Tells by a signal that the wave has not reached some goal.
    pub fn tell(
        &self,
        w: &mut Wiring<'_, '_>,
        name: &str,
        goals: &Group,
        signals: &Group,
        signal: usize,
    ) {
        let fluents = goals.count;
        let unreached = w.both(name, fluents);
        w.link(goals, &unreached, each(fluents, 1.0));
        w.link(&self.pending, &unreached, each(fluents, 1.0));
        w.link(&unreached, signals, gather(fluents, signal, 1.0));
    }

    /// Lets operators wait until the clock has counted as many levels as their preconditions cost.
    pub fn count(
        &self,
        w: &mut Wiring<'_, '_>,
        needs: &[Weight],
        (phases, resets): (&Group, &[usize]),
        levels: usize,
    ) -> Costs {
        let (fluents, operators) = (self.pending.count, self.enabled.count);
        let reset = |count, weight| resets.iter().flat_map(move |p| spread(*p, count, weight));
        let (tick, clock) = clock(w, (phases, resets), levels);
        let all = fluents * levels;
        let rows = || cells(fluents, levels);
        let count = w.both("count", all);
        w.link(&self.pending, &count, rows().map(|(f, _, level)| (f, level, 1.0)));
        w.link(&clock, &count, rows().map(|(_, l, level)| (l, level, 1.0)));
        w.link(phases, &count, reset(all, -1.3));
        let latches = w.latches("costs", all);
        w.link(&count, &latches, each(all, 1.2));
        w.link(phases, &latches, reset(all, -5.0));
        let cost = summed(w, "cost", &latches, fluents);

        let early = w.biased("early", operators, EARLY);
        w.link(&cost, &early, needs.iter().copied());
        let ticks = w.sum("ticks", 1);
        let counted = |l| if l + 1 < levels { -1.0 } else { RELEASE };
        w.link(&tick, &ticks, (0..levels).map(|l| (l, 0, counted(l))));
        w.link(&ticks, &early, spread(0, operators, 1.0));
        w.link(&early, &self.enabled, each(operators, -1.3));
        Costs { levels: latches, cost }
    }
}

/// Adds what can be reached at all: a wave that waits for no costs. Signals tell that it has not reached some goal, and that it
/// goes on.
pub(super) fn reachable(
    w: &mut Wiring<'_, '_>,
    links: (&[Weight], &[Weight]),
    resets: (&Group, &[usize]),
    (holds, operators): (&Group, usize),
    (goals, signals): (&Group, &Group),
    [beyond, on]: [usize; 2],
) {
    let names = ["reachable", "out_of_reach", "possible"];
    let wave = Wave::new(w, names, links, resets, (holds, operators));
    wave.tell(w, "beyond", goals, signals, beyond);
    news(w, "newly_reachable", &wave.reached, signals, on);
}

/// Adds a signal of items that have just become active.
pub(super) fn news(
    w: &mut Wiring<'_, '_>,
    name: &str,
    group: &Group,
    signals: &Group,
    signal: usize,
) {
    let count = group.count;
    let before = w.slow(&format!("{name}_before"), group, BEFORE_MS);
    let new = w.units(name, count);
    w.link(group, &new, each(count, 1.2));
    w.link(&before, &new, each(count, -1.3));
    w.link(&new, signals, gather(count, signal, 1.0));
}

/// Adds the clock: a row of latches that become active one after the other from the start of the wave on.
fn clock(
    w: &mut Wiring<'_, '_>,
    (phases, resets): (&Group, &[usize]),
    levels: usize,
) -> (Group, Group) {
    let reset = |weight| resets.iter().flat_map(move |p| spread(*p, levels, weight));
    let tick = w.units("tick", levels);
    let bias: Vec<Real> = (0..levels).map(|l| if l == 0 { 1.0 } else { 1.0 + AND }).collect();
    w.bias(&tick, &bias);
    w.link(phases, &tick, reset(-1.3));
    let clock = w.latches("clock", levels);
    w.link(&tick, &clock, each(levels, 1.2));
    let later = (1..levels).map(|l| (l - 1, l, 1.0));
    w.link_by(&clock, &tick, later, Synapse::lowpass_ms(LEVEL_MS));
    w.link(phases, &clock, reset(-5.0));
    (tick, clock)
}
