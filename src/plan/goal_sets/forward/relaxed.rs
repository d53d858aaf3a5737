//! The relaxed plan: a wave from the state, the operators that reach each fluent first, and what the goals need of them.

use super::control::{Phase, Signal};
use super::graph::Progression;
use crate::plan::goal_sets::wiring::{AND, Group, Weight, Wiring, each, gather, spread};
use crate::sim::Real;

/// Weight that fifty active inputs do not outweigh.
const NEVER: Real = -60.0;
/// Weight with which an operator and a fluent that is pending become its support, in a few milliseconds.
const SUPPORT: Real = 1.7;
/// Time constant of what was reached before, in milliseconds. A fluent counts as new for about as long.
const BEFORE_MS: u64 = 20;

/// The groups of the relaxed plan.
pub(super) struct Relaxed {
    /// Fluents that are not in the state.
    pub absent: Group,
    /// Goals that are not in the state and wait for no other.
    pub wanted: Group,
    /// Operators of the relaxed plan.
    pub used: Group,
}

/// Adds the relaxed plan of a state.
pub(super) fn relaxed(
    w: &mut Wiring<'_, '_>,
    rules: &Progression,
    (phases, signals): (&Group, &Group),
    state: &Group,
    goal: &Group,
) -> Relaxed {
    let (fluents, operators) = (rules.fluents(), rules.operators());
    let look = Phase::Look as usize;
    let start = Phase::Start as usize;
    let absent = w.tonic("absent", fluents);
    w.link(state, &absent, each(fluents, -1.3));

    // The wave.
    let reached = w.latches("reached", fluents);
    w.link(state, &reached, each(fluents, 4.0));
    let forgets = || [look, start].into_iter().flat_map(|p| spread(p, fluents, -3.0));
    w.link(phases, &reached, forgets().collect::<Vec<_>>());
    let pending = w.tonic("pending", fluents);
    w.link(&reached, &pending, each(fluents, -1.3));
    let enabled = w.tonic("enabled", operators);
    w.link(&pending, &enabled, rules.needs(-1.3));
    w.link(
        phases,
        &enabled,
        [look, start].into_iter().flat_map(|p| spread(p, operators, -1.3)).collect::<Vec<_>>(),
    );
    let unreached = w.both("unreached", fluents);
    w.link(goal, &unreached, each(fluents, 1.0));
    w.link(&pending, &unreached, each(fluents, 1.0));
    w.link(&unreached, signals, gather(fluents, Signal::Unreached as usize, 1.0));
    news(w, "newly_reached", &reached, signals, Signal::News);

    // Which operators reach a fluent first: one unit for each operator and fluent that it adds.
    let pairs = rules.adds(1.0);
    let count = pairs.len();
    let numbered = || pairs.iter().enumerate();
    let supports = w.biased("supports", count, SUPPORT * AND);
    w.link(&enabled, &supports, numbered().map(|(p, (_, a, _))| (*a, p, SUPPORT)));
    w.link(&pending, &supports, numbered().map(|(p, (f, ..))| (*f, p, SUPPORT)));
    w.link(&supports, &supports, each(count, 2.0 * SUPPORT));
    // A fluent is reached by what supports it, so that there is always one, however many operators come at once.
    w.link(&supports, &reached, numbered().map(|(p, (f, ..))| (p, *f, 1.2)));
    w.link(
        phases,
        &supports,
        [look, start].into_iter().flat_map(|p| spread(p, count, -8.0)).collect::<Vec<_>>(),
    );

    // What the goals need. A fluent of the state needs nothing.
    let unmet = w.both("unmet", fluents);
    w.link(goal, &unmet, each(fluents, 1.0));
    w.link(&absent, &unmet, each(fluents, 1.0));
    w.link(&unmet, signals, gather(fluents, Signal::Unmet as usize, 1.0));
    let wanted = w.units("wanted", fluents);
    let waits = rules.before.iter().map(|[a, b]| (*a, *b, -1.3));
    w.link(&unmet, &wanted, each(fluents, 1.0).chain(waits).collect::<Vec<_>>());
    let needed = w.units("needed", fluents);
    w.link(&wanted, &needed, each(fluents, 1.0));
    w.link(state, &needed, each(fluents, NEVER));
    let via = w.both("via", count);
    w.link(&supports, &via, each(count, 1.0));
    w.link(&needed, &via, numbered().map(|(p, (f, ..))| (*f, p, 1.0)));
    let used = w.units("used", operators);
    w.link(&via, &used, numbered().map(|(p, (_, a, _))| (p, *a, 1.2)));
    let back: Vec<Weight> =
        rules.needs(1.2).into_iter().map(|(f, a, weight)| (a, f, weight)).collect();
    w.link(&used, &needed, back);
    news(w, "newly_needed", &needed, signals, Signal::Grows);
    Relaxed { absent, wanted, used }
}

/// Tells of items that have just become active.
fn news(w: &mut Wiring<'_, '_>, name: &str, group: &Group, signals: &Group, signal: Signal) {
    let count = group.count;
    let before = w.slow(&format!("{name}_before"), group, BEFORE_MS);
    let new = w.units(name, count);
    w.link(group, &new, each(count, 1.2));
    w.link(&before, &new, each(count, -1.3));
    w.link(&new, signals, gather(count, signal as usize, 1.0));
}
