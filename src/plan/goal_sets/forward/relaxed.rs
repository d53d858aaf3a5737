//! The relaxed plan: a wave from the state, the operators that reach each fluent first, and what the goals need of them.

use std::collections::BTreeSet;

use super::control::{Phase, Signal};
use super::graph::Progression;
use crate::neurons::Map;
use crate::plan::goal_sets::costs::{Wave, news, reachable};
use crate::plan::goal_sets::wiring::{AND, Group, Weight, Wiring, behind, each, gather, spread};
use crate::sim::Real;

/// Weight that fifty active inputs do not outweigh.
const NEVER: Real = -60.0;
/// Weight with which an operator and a fluent that is pending become its support, in a few milliseconds.
const SUPPORT: Real = 1.7;

/// Weight with which two active inputs together wake a unit, and one does not.
const TWO: Real = 0.27;
/// Number of operators that need a fluent up to which they are counted.
const CLAIMS: Real = 3.0;

/// The groups of the relaxed plan.
pub(super) struct Relaxed {
    /// Fluents that are not in the state.
    pub absent: Group,
    /// Goals that are not in the state and wait for no other.
    pub wanted: Group,
    /// Fluents that the relaxed plan needs and that are not in the state.
    pub needed: Group,
    /// Operators of the relaxed plan.
    pub used: Group,
    /// Fluents that are the only missing precondition of some operator of the relaxed plan.
    pub last: Group,
    /// How many operators of the relaxed plan need each fluent, at most [`CLAIMS`].
    pub claims: Group,
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
    let absent = w.tonic("absent", fluents);
    w.link(state, &absent, each(fluents, -1.3));

    let [needs, adds] = [rules.needs(1.0), rules.adds(1.0)];
    let resets = (phases, &[Phase::Look as usize, Phase::Start as usize][..]);
    let told = [Signal::Beyond as usize, Signal::News as usize];
    reachable(w, (&needs, &adds), resets, (state, operators), (goal, signals), told);

    // What is reached at which cost.
    let names = ["reached", "pending", "enabled"];
    let wave = Wave::new(w, names, (&needs, &[]), resets, (state, operators));
    wave.tell(w, "unreached", goal, signals, Signal::Unreached as usize);
    let costs = wave.count(w, &needs, resets, rules.levels);
    let Wave { reached, pending, enabled } = &wave;

    // Which operators reach a fluent first: one unit for each operator and fluent that it adds.
    let pairs = rules.supports();
    let count = pairs.len();
    let numbered = || pairs.iter().enumerate();
    let supports = w.biased("supports", count, SUPPORT * AND);
    w.link(enabled, &supports, numbered().map(|(p, (_, a))| (*a, p, SUPPORT)));
    w.link(pending, &supports, numbered().map(|(p, (f, _))| (*f, p, SUPPORT)));
    w.link(&supports, &supports, each(count, 2.0 * SUPPORT));
    // A fluent is reached by what supports it, so that there is always one, however many operators come at once.
    w.link(&supports, reached, numbered().map(|(p, (f, _))| (p, *f, 1.2)));
    w.link(&supports, pending, numbered().map(|(p, (f, _))| (p, *f, -1.3)));
    let forgotten = resets.1.iter().flat_map(|p| spread(*p, count, -8.0));
    w.link(phases, &supports, forgotten);
    // Of those that come at the same time, the first counts: the one that uses up least.
    let later = w.units("later", count);
    let same: Vec<usize> = pairs.chunk_by(|a, b| a.0 == b.0).map(<[_]>::len).collect();
    behind(w, "support_rows", &supports, &later, &same, 1.0);

    // What the goals need. A fluent of the state needs nothing.
    let unmet = w.both("unmet", fluents);
    w.link(goal, &unmet, each(fluents, 1.0));
    w.link(&absent, &unmet, each(fluents, 1.0));
    w.link(&unmet, signals, gather(fluents, Signal::Unmet as usize, 1.0));
    let wanted = w.units("wanted", fluents);
    w.link(&unmet, &wanted, each(fluents, 1.0));
    if let Some(agenda) = waiting(w, &unmet, &costs.levels, &rules.before) {
        w.link(&agenda, &wanted, each(fluents, -1.3));
    }
    let needed = w.units("needed", fluents);
    w.link(&wanted, &needed, each(fluents, 1.0));
    w.link(state, &needed, each(fluents, NEVER));
    let via = w.both("via", count);
    w.link(&supports, &via, each(count, 1.0));
    w.link(&needed, &via, numbered().map(|(p, (f, _))| (*f, p, 1.0)));
    w.link(&later, &via, each(count, -1.3));
    let used = w.units("used", operators);
    w.link(&via, &used, numbered().map(|(p, (_, a))| (p, *a, 1.2)));
    w.link(&used, &needed, turned(rules.needs(1.2)));
    news(w, "newly_needed", &needed, signals, Signal::Grows as usize);
    let claims = Map::each(fluents, |x| x.clamp(0.0, CLAIMS)).radius(2.0 * CLAIMS).above(0.0);
    let claims = w.analog("claims", fluents, claims);
    w.link(&used, &claims, turned(rules.needs(1.0)));
    let far = w.units("far", operators);
    w.link(&absent, &far, rules.needs(TWO));
    let near = w.units("near", operators);
    w.link(&used, &near, each(operators, 1.0));
    w.link(&far, &near, each(operators, -1.5));
    let last = w.units("last", fluents);
    w.link(&near, &last, turned(rules.needs(1.2)));
    w.link(state, &last, each(fluents, NEVER));
    Relaxed { absent, wanted, needed, used, last, claims }
}

/// Adds the goals that wait for others: for those that do not hold, and did not when the wave began. A goal that is broken on the
/// way to another one holds it back only from the next wave on; otherwise it could only be restored at once.
fn waiting(
    w: &mut Wiring<'_, '_>,
    unmet: &Group,
    costs: &Group,
    before: &[[usize; 2]],
) -> Option<Group> {
    let firsts: BTreeSet<usize> = before.iter().map(|[first, _]| *first).collect();
    let firsts: Vec<usize> = firsts.into_iter().collect();
    let count = firsts.len();
    if count == 0 {
        return None;
    }
    let levels = costs.count / unmet.count;
    let numbered = || firsts.iter().enumerate();
    let first = w.both("first_goals", count);
    w.link(unmet, &first, numbered().map(|(i, f)| (*f, i, 1.0)));
    // What does not hold costs a level at least.
    w.link(costs, &first, numbered().map(|(i, f)| (f * levels, i, 1.0)));
    let agenda = w.units("agenda", unmet.count);
    let pairs = before.iter().filter_map(|[a, b]| Some((firsts.binary_search(a).ok()?, *b, 1.0)));
    w.link(&first, &agenda, pairs);
    Some(agenda)
}

/// Turns links round.
fn turned(links: Vec<Weight>) -> impl Iterator<Item = Weight> {
    links.into_iter().map(|(from, to, weight)| (to, from, weight))
}
