//! Costs: a wave from what holds reaches fluent after fluent, and rows of latches count the time until then.

use super::control::{Phase, Signal};
use super::rules::Regression;
use super::wiring::{AND, Group, Wiring, each, gather, spread};
use crate::sim::{Real, Synapse};

/// Levels of cost that are told apart.
pub(super) const LEVELS: usize = 16;
/// Synapse from one level of cost to the next, in milliseconds. A level then lasts about as long as a step of the wave.
const LEVEL_MS: u64 = 5;

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
    let pending = w.units("pending", fluents);
    w.bias_all(&pending, 1.0);
    w.link(&reached, &pending, each(fluents, -1.3));
    let enabled = w.units("enabled", operators);
    w.bias_all(&enabled, 1.0);
    w.link(&pending, &enabled, rules.links(|o| &o.preconditions, -1.3));
    w.link(phases, &enabled, spread(start, operators, -1.3));
    w.link(holds, &reached, each(fluents, 4.0));
    let adds = rules.links(|o| &o.adds, 1.2);
    w.link(&enabled, &reached, adds.into_iter().map(|(f, a, weight)| (a, f, weight)));
    w.link(phases, &reached, spread(start, fluents, -3.0));
    let unreached = w.units("unreached", fluents);
    w.link(goals, &unreached, each(fluents, 1.0));
    w.link(&pending, &unreached, each(fluents, 1.0));
    w.bias_all(&unreached, AND);
    w.link(&unreached, signals, gather(fluents, Signal::Unreached as usize, 1.0));

    let levels = fluents * LEVELS;
    let rows = || (0..fluents).flat_map(|f| (0..LEVELS).map(move |l| (f, l, f * LEVELS + l)));
    let count = w.units("count", levels);
    let biases = rows().map(|(_, l, _)| if l == 0 { 0.0 } else { AND });
    w.bias(&count, &biases.collect::<Vec<Real>>());
    w.link(&pending, &count, rows().map(|(f, _, level)| (f, level, 1.0)));
    w.link(phases, &count, spread(start, levels, -1.3));
    let costs = w.latches("costs", levels);
    w.link(&count, &costs, each(levels, 1.2));
    let later = rows().filter(|(_, l, _)| *l > 0).map(|(_, _, level)| (level - 1, level, 1.0));
    w.link_by(&costs, &count, later, Synapse::lowpass_ms(LEVEL_MS));
    w.link(phases, &costs, spread(start, levels, -5.0));
    costs
}
