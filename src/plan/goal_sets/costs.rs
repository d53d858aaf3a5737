//! Costs: a wave from what holds reaches fluent after fluent, and rows of latches count the time until then.
//!
//! An operator passes the wave on once the clock has counted more levels than its preconditions cost together. So the cost
//! of a fluent is one more than the sum of the costs of those that its cheapest operator needs: the additive costs of Bonet
//! and Geffner, "Planning as heuristic search" (2001).

use super::control::{Phase, Signal};
use super::rules::Regression;
use super::wiring::{AND, Group, Weight, Wiring, cells, each, gather, spread};
use crate::sim::{Real, Synapse};

/// Levels of cost that are told apart. Greater costs count as this many.
pub(super) const LEVELS: usize = 16;
/// Synapse from one level of the clock to the next, in milliseconds. A level then lasts about as long as the wave takes
/// from a fluent to the next.
const LEVEL_MS: u64 = 5;
/// Input of an operator's `early` unit when the clock has counted as many levels as its preconditions cost. Greater values
/// make costs too high in exact maths, lower ones too low in spikes, where an active latch gives a little more than 1.
const EARLY: Real = 1.12;
/// Weight with which the last level of the clock lets all operators pass that are still waiting.
const RELEASE: Real = -100.0;

/// Returns links from all levels of fluents, in place of links from fluents.
pub(super) fn by_level(links: Vec<Weight>) -> impl Iterator<Item = Weight> {
    let links = links.into_iter();
    links.flat_map(|(f, a, weight)| (0..LEVELS).map(move |l| (f * LEVELS + l, a, weight)))
}

/// Adds the wave. Returns a row of latches for each fluent; as many are active as the fluent has levels.
pub(super) fn costs(
    w: &mut Wiring<'_, '_>,
    rules: &Regression,
    (phases, signals): (&Group, &Group),
    holds: &Group,
    goals: &Group,
) -> Group {
    let (fluents, operators) = (rules.fluents, rules.operators.len());
    let start = Phase::Start as usize;
    let reached = w.latches("reached", fluents);
    let pending = w.tonic("pending", fluents);
    w.link(&reached, &pending, each(fluents, -1.3));
    let enabled = w.tonic("enabled", operators);
    w.link(&pending, &enabled, rules.links(|o| &o.preconditions, -1.3));
    w.link(phases, &enabled, spread(start, operators, -1.3));
    w.link(holds, &reached, each(fluents, 4.0));
    let adds = rules.links(|o| &o.adds, 1.2);
    w.link(&enabled, &reached, adds.into_iter().map(|(f, a, weight)| (a, f, weight)));
    w.link(phases, &reached, spread(start, fluents, -3.0));
    let unreached = w.both("unreached", fluents);
    w.link(goals, &unreached, each(fluents, 1.0));
    w.link(&pending, &unreached, each(fluents, 1.0));
    w.link(&unreached, signals, gather(fluents, Signal::Unreached as usize, 1.0));

    let (tick, clock) = clock(w, phases);
    let levels = fluents * LEVELS;
    let rows = || cells(fluents, LEVELS);
    let count = w.both("count", levels);
    w.link(&pending, &count, rows().map(|(f, _, level)| (f, level, 1.0)));
    w.link(&clock, &count, rows().map(|(_, l, level)| (l, level, 1.0)));
    w.link(phases, &count, spread(start, levels, -1.3));
    let costs = w.latches("costs", levels);
    w.link(&count, &costs, each(levels, 1.2));
    w.link(phases, &costs, spread(start, levels, -5.0));

    let early = w.biased("early", operators, EARLY);
    w.link(&costs, &early, by_level(rules.links(|o| &o.preconditions, 1.0)));
    let counted = |l| if l + 1 < LEVELS { -1.0 } else { RELEASE };
    w.link(&tick, &early, (0..LEVELS).flat_map(|l| spread(l, operators, counted(l))));
    w.link(&early, &enabled, each(operators, -1.3));
    costs
}

/// Adds the clock: a row of latches that become active one after the other from the start of the wave on.
fn clock(w: &mut Wiring<'_, '_>, phases: &Group) -> (Group, Group) {
    let start = Phase::Start as usize;
    let tick = w.units("tick", LEVELS);
    let bias: Vec<Real> = (0..LEVELS).map(|l| if l == 0 { 1.0 } else { 1.0 + AND }).collect();
    w.bias(&tick, &bias);
    w.link(phases, &tick, spread(start, LEVELS, -1.3));
    let clock = w.latches("clock", LEVELS);
    w.link(&tick, &clock, each(LEVELS, 1.2));
    let later = (1..LEVELS).map(|l| (l - 1, l, 1.0));
    w.link_by(&clock, &tick, later, Synapse::lowpass_ms(LEVEL_MS));
    w.link(phases, &clock, spread(start, LEVELS, -5.0));
    (tick, clock)
}
