//! Operators and goals: conditions before and after each action, counted over its demonstrated instances.

use std::collections::{BTreeMap, BTreeSet};

use super::frames::SMALLEST_M;
use super::likelihood::{Likelihood, Spread};
use super::motion::{Came, Motion};
use super::states::{States, least_support};
use crate::task::domain::{
    Condition, Coordinate, Displacement, Fact, GoalTerm, Need, NeedVerdict, Parameters, Place,
    Quantity, RelationalOperator, Role, SideEffect, Situation, Subject, relative,
};
use crate::task::learn::attempts::Attempt;
use crate::task::learn::names::action_name;
use crate::task::learn::summary::Failure;

/// A demonstrated instance of an action.
struct Instance {
    attempt: Attempt,
    object: usize,
    from: Fact,
    to: Fact,
    /// The fact of each track before and after.
    before: Situation,
    after: Situation,
}

/// The outcome of each attempt: the state that its object entered.
pub(super) struct Operators {
    pub operators: Vec<RelationalOperator>,
    /// For each attempt, the index of its operator, or why it failed.
    pub judged: Vec<Result<usize, Failure>>,
}

/// Share of the instances that have to agree about a side effect, which knocks and outliers can disturb.
const AGREE: f64 = 0.9;

pub(super) fn find(motion: &Motion<'_>, found: &mut States) -> Operators {
    let mut of_state: BTreeMap<usize, Vec<Instance>> = BTreeMap::new();
    let mut outcomes = Vec::new();
    for attempt in &motion.attempts {
        let outcome = instance(motion, found, attempt);
        outcomes.push(outcome.as_ref().map(|i| i.to.state).map_err(|f| *f));
        if let Ok(instance) = outcome {
            of_state.entry(instance.to.state).or_default().push(instance);
        }
    }
    // What happened in few demonstrations is taken for an accident, unless it was the way out of a state in which
    // an object was found.
    let least = least_support(motion.recording.demos.len());
    let shown = |i: &Instance| {
        let rest = motion.rest_at(i.attempt.demo, i.object, i.attempt.before);
        i.attempt.declared && rest.is_some_and(|rest| rest.came == Came::Found)
    };
    let sure = !motion.is_noisy() && !motion.flickers;
    of_state.retain(|_, instances| {
        let demos: BTreeSet<usize> = instances.iter().map(|i| i.attempt.demo).collect();
        demos.len() >= least || sure && instances.iter().all(shown)
    });
    let seen = seen(motion, found);
    let mut operators = Vec::new();
    let mut index = BTreeMap::new();
    for (state, instances) in &of_state {
        index.insert(*state, operators.len());
        let name = found.names.take(&action_name(&found.states[*state].name));
        operators.push(operator(motion, found, name, *state, instances, &seen));
    }
    let judged = outcomes
        .into_iter()
        .map(|o| o.and_then(|state| index.get(&state).copied().ok_or(Failure::Undone)))
        .collect();
    Operators { operators, judged }
}

/// Returns the labels of all tracks in a snapshot.
fn scene(motion: &Motion<'_>, found: &States, demo: usize, snapshot: usize) -> Situation {
    (0..motion.tracks[demo].len())
        .map(|t| {
            // An object that is missing for a moment keeps its state.
            let last = (0..=snapshot).rev().find_map(|s| motion.index_at(demo, t, s))?;
            found.labels[last]
        })
        .collect()
}

fn instance(motion: &Motion<'_>, found: &States, attempt: &Attempt) -> Result<Instance, Failure> {
    let object = attempt.track.ok_or(Failure::NothingMoved)?;
    let at = |s| motion.index_at(attempt.demo, object, s);
    // An object can be missing for a moment.
    let last = motion.demo(attempt.demo).snapshots.len() - 1;
    let before = (0..=attempt.before).rev().find_map(at);
    let (Some(before), Some(after)) = (before, (attempt.after..=last).find_map(at)) else {
        return Err(Failure::PartLost);
    };
    let label = |rest: usize| found.labels[rest].ok_or(Failure::NothingNew);
    let (from, to) = (label(before)?, label(after)?);
    if from.state == to.state && from.reference == to.reference {
        return Err(Failure::NothingNew);
    }
    Ok(Instance {
        attempt: *attempt,
        object,
        from,
        to,
        before: scene(motion, found, attempt.demo, attempt.before),
        after: scene(motion, found, attempt.demo, attempt.after),
    })
}

/// Returns the conditions that occur anywhere in the recording: states of other objects, with the kind of their
/// reference.
fn seen(motion: &Motion<'_>, found: &States) -> BTreeSet<(usize, String)> {
    let mut seen = BTreeSet::new();
    for (rest, label) in motion.rests.iter().zip(&found.labels) {
        if let Some(Fact { state, reference: Some(track), .. }) = label {
            seen.insert((*state, motion.tracks[rest.demo][*track].kind.to_string()));
        }
    }
    seen
}

impl Instance {
    /// Returns the tracks that the parameters of the action stand for.
    fn parameters(&self) -> Parameters {
        Parameters::new(Some(self.object), self.from.reference, self.to.reference)
    }

    /// Counts the objects that fulfil a condition.
    fn count(&self, scene: &Situation, condition: &Condition) -> usize {
        let counted = condition.counted(&self.parameters());
        counted.map_or(0, |counted| counted.holders(scene).count())
    }
}

/// Returns all conditions that can be expressed for an action.
fn conditions(states: usize) -> impl Iterator<Item = Condition> {
    let subjects = [
        Subject::Is(Role::Origin),
        Subject::Is(Role::Target),
        Subject::At(Role::Object),
        Subject::At(Role::Origin),
        Subject::At(Role::Target),
        Subject::Any,
    ];
    (0..states).flat_map(move |state| subjects.map(|subject| Condition { state, subject }))
}

fn operator(
    motion: &Motion<'_>,
    found: &States,
    name: String,
    to: usize,
    instances: &[Instance],
    seen: &BTreeSet<(usize, String)>,
) -> RelationalOperator {
    let mut from: BTreeMap<usize, usize> = BTreeMap::new();
    for instance in instances {
        *from.entry(instance.from.state).or_default() += 1;
    }
    let mut from: Vec<(usize, usize)> = from.into_iter().collect();
    from.sort_by_key(|(state, count)| (usize::MAX - count, *state));
    let of = instances.len();
    let held_before =
        |c: &Condition| -> Vec<usize> { instances.iter().map(|i| i.count(&i.before, c)).collect() };
    let kind = |role: Role| -> Option<String> {
        let first = &instances[0];
        let track = first.parameters().get(role)?;
        Some(motion.tracks[first.attempt.demo][track].kind.to_string())
    };
    let mut needs: Vec<Need> = Vec::new();
    for condition in conditions(found.states.len()) {
        let counts = held_before(&condition);
        let held = counts.iter().filter(|c| **c > 0).count();
        let least = counts.iter().copied().min().unwrap_or(0);
        let need = |verdict, holds, least| Need { condition, verdict, holds, least, held, of };
        let role = match condition.subject {
            Subject::Is(role) | Subject::At(role) => Some(role),
            Subject::Any => None,
        };
        if role.is_some_and(|r| instances.iter().any(|i| i.parameters().get(r).is_none())) {
            continue;
        }
        let possible = role.and_then(kind).is_some_and(|k| seen.contains(&(condition.state, k)));
        match condition.subject {
            Subject::Is(_) if held == of => needs.push(need(NeedVerdict::Required, true, 1)),
            Subject::At(_) if held == of => {
                needs.push(need(NeedVerdict::Undecided, true, least));
            }
            Subject::At(Role::Object) if held == 0 && possible => {
                needs.push(need(NeedVerdict::Absent, false, 1));
            }
            Subject::At(Role::Target) if held == 0 && possible && condition.state != to => {
                needs.push(need(NeedVerdict::Undecided, false, 1));
            }
            // The same state at a parameter says more.
            Subject::Any
                if held == of
                    && !needs.iter().any(|n| n.condition.state == condition.state && n.holds) =>
            {
                needs.push(need(NeedVerdict::Undecided, true, least));
            }
            _ => {}
        }
    }
    let never_seen = (0..found.states.len())
        .filter(|s| {
            instances.iter().all(|i| i.before.iter().flatten().all(|label| label.state != *s))
        })
        .collect();
    RelationalOperator {
        name,
        from: from.into_iter().map(|(state, _)| state).collect(),
        to,
        needs,
        side_effects: side_effects(found, instances),
        displacement: displacement(motion, found, to, instances),
        instances: of,
        never_seen,
    }
}

/// Returns the changes of other objects' states. A change counts only where it was possible.
fn side_effects(found: &States, instances: &[Instance]) -> Vec<SideEffect> {
    let mut effects: Vec<SideEffect> = Vec::new();
    for condition in conditions(found.states.len()) {
        for begins in [true, false] {
            let (mut changed, mut of) = (0, 0);
            for instance in instances {
                let before = instance.count(&instance.before, &condition) > 0;
                let after = instance.count(&instance.after, &condition) > 0;
                if before != begins {
                    of += 1;
                    changed += usize::from(after == begins);
                }
            }
            let bound =
                effects.iter().any(|e| e.condition.state == condition.state && e.begins == begins);
            if changed >= 1 && changed as f64 >= AGREE * of as f64 && !bound {
                effects.push(SideEffect { condition, begins, changed, of });
            }
        }
    }
    effects
}

/// Returns the displacement in the coordinates that the new place leaves open, if it is the same each time.
fn displacement(
    motion: &Motion<'_>,
    found: &States,
    to: usize,
    instances: &[Instance],
) -> Option<Displacement> {
    let state = &found.states[to];
    let open: Vec<usize> =
        (0..3).filter(|i| state.places.iter().any(|p| p.coordinates[*i].is_open())).collect();
    if open.is_empty() || instances.len() < 2 {
        return None;
    }
    let moved: Vec<[f64; 3]> = instances
        .iter()
        .filter_map(|i| {
            let demo = i.attempt.demo;
            let before = motion.rest_at(demo, i.object, i.attempt.before)?.pose;
            let after = motion.rest_at(demo, i.object, i.attempt.after)?;
            let frame = match i.to.reference {
                Some(track) => motion.rest_at(demo, track, after.first)?.pose,
                None => crate::robot::Pose::at([0.0; 3]),
            };
            let (a, b) = (relative(&frame, &before), relative(&frame, &after.pose));
            Some(std::array::from_fn(|k| b.position[k] - a.position[k]))
        })
        .collect();
    let n = moved.len();
    let likelihood = Likelihood::of_displacing(&motion.noise, n);
    let mean: [f64; 3] =
        std::array::from_fn(|i| moved.iter().map(|m| m[i]).sum::<f64>() / n.max(1) as f64);
    let mut worst = 0.0f64;
    for i in &open {
        let range = state.places.iter().filter_map(|p| match p.coordinates[*i] {
            Coordinate::Open { low, high } => Some(high - low),
            Coordinate::Tight { .. } => None,
        });
        let extent = 2.0 * range.fold(0.0, f64::max).max(SMALLEST_M);
        let spread = Spread::over(moved.iter().map(|m| m[*i]))?;
        if !likelihood.is_careful(n, &spread, extent) {
            return None;
        }
        let squares: f64 = moved.iter().map(|m| (m[*i] - mean[*i]).powi(2)).sum();
        worst = worst.max((squares / n.saturating_sub(1).max(1) as f64).sqrt());
    }
    Some(Displacement { mean, sd: worst })
}

/// Share of the demonstrations that have to end with a term fulfilled.
const GOAL: f64 = 0.9;

/// Returns the terms that some action achieves and that hold at the end of nearly all demonstrations, in the order in
/// which they were completed. Returns also the states that hold at the end of these demonstrations and that no action
/// achieves.
pub(super) fn goals(
    motion: &Motion<'_>,
    found: &States,
    operators: &[RelationalOperator],
) -> (Vec<GoalTerm>, Vec<usize>) {
    let demos: Vec<usize> = (0..motion.recording.demos.len())
        .filter(|d| !motion.demo(*d).snapshots.is_empty())
        .collect();
    let achieved: BTreeSet<usize> =
        operators.iter().flat_map(RelationalOperator::achieves).collect();
    let ends: Vec<(Situation, Situation)> = demos
        .iter()
        .map(|d| {
            let last = motion.demo(*d).snapshots.len() - 1;
            (scene(motion, found, *d, 0), scene(motion, found, *d, last))
        })
        .collect();
    // Errors of sensing, and objects that are not seen for a moment, can hide a term at the end of one demonstration.
    let share = GOAL * demos.len() as f64;
    let unsure = motion.is_noisy() || motion.flickers;
    let enough = if unsure { share.floor() } else { share.ceil() }.max(1.0) as usize;
    let mut terms: Vec<(f64, GoalTerm)> = Vec::new();
    let mut unachieved = Vec::new();
    for state in 0..found.states.len() {
        let Some((quantity, held)) = quantity(motion, found, state, &demos, &ends, enough) else {
            continue;
        };
        if !achieved.contains(&state) {
            unachieved.push(state);
            continue;
        }
        let rank = completed(motion, found, state, &demos);
        let reference = None;
        terms.push((rank, GoalTerm { state, quantity, reference, held, of: demos.len() }));
    }
    terms.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.state.cmp(&b.1.state)));
    let goals: Vec<usize> = terms.iter().map(|(_, term)| term.state).collect();
    for (index, (_, term)) in terms.iter_mut().enumerate() {
        let Quantity::AtLeast(least) = term.quantity else { continue };
        let own: Vec<_> = operators.iter().filter(|o| o.to == term.state).collect();
        let bound = goals[..index].iter().filter_map(|within| {
            let needed = !own.is_empty() && own.iter().all(|o| o.needs_of_target(*within));
            let count = |end: &Situation| {
                let of = |r: Option<usize>| Some(end.get(r?)?.as_ref()?.state);
                let own = end.iter().flatten().filter(|l| l.state == term.state);
                own.filter(|l| of(l.reference) == Some(*within)).count()
            };
            let held = ends.iter().filter(|(_, end)| count(end) >= least).count();
            (needed && held >= enough).then_some((*within, held))
        });
        if let Some((within, held)) = bound.max_by_key(|(_, held)| *held) {
            (term.reference, term.held) = (Some(within), held);
        }
    }
    (terms.into_iter().map(|(_, term)| term).collect(), unachieved)
}

fn quantity(
    motion: &Motion<'_>,
    found: &States,
    state: usize,
    demos: &[usize],
    ends: &[(Situation, Situation)],
    enough: usize,
) -> Option<(Quantity, usize)> {
    let count = |scene: &Situation| scene.iter().flatten().filter(|l| l.state == state).count();
    let counts: Vec<(usize, usize)> = ends.iter().map(|(a, b)| (count(a), count(b))).collect();
    // A state that held all along was no goal of the demonstrator. One that was left and reached again is.
    let gained = demos
        .iter()
        .zip(&counts)
        .filter(|(d, (_, end))| {
            let length = motion.demo(**d).snapshots.len();
            *end > 0 && (0..length).any(|s| count(&scene(motion, found, **d, s)) < *end)
        })
        .count();
    if gained < enough {
        return None;
    }
    let model = &found.states[state];
    let of_kind = |demo: usize, kind: &str| -> Vec<usize> {
        let tracks = motion.tracks[demo].iter().enumerate();
        tracks.filter(|(_, t)| &*t.kind == kind).map(|(i, _)| i).collect()
    };
    // The count that nearly all demonstrations reach.
    let mut sorted: Vec<usize> = counts.iter().map(|(_, end)| *end).collect();
    sorted.sort_unstable_by(|a, b| b.cmp(a));
    let least = sorted[enough - 1].max(1);
    let all = demos
        .iter()
        .zip(&counts)
        .filter(|(d, (_, end))| *end >= of_kind(**d, &model.kind).len())
        .count();
    let several = counts.iter().any(|(_, end)| *end > 1);
    if model.places.iter().any(Place::is_roomy) && several && all >= enough {
        return Some((Quantity::EachObject, all));
    }
    if let Some(kind) = model.frame.kind() {
        let per: Vec<Vec<usize>> = demos
            .iter()
            .zip(ends)
            .map(|(d, (_, end))| {
                let at = |r: usize| {
                    let labels = end.iter().flatten();
                    labels.filter(|l| l.state == state && l.reference == Some(r)).count()
                };
                of_kind(*d, kind).into_iter().map(at).collect()
            })
            .collect();
        let least_each = per.iter().map(|c| c.iter().copied().min().unwrap_or(0));
        let mut least_each: Vec<usize> = least_each.collect();
        least_each.sort_unstable_by(|a, b| b.cmp(a));
        let (each, several) = (least_each[enough - 1], per.iter().any(|c| c.len() > 1));
        if each >= 1 && several {
            let held = least_each.iter().filter(|c| **c >= each).count();
            return Some((Quantity::EachReference(each), held));
        }
    }
    let held = counts.iter().filter(|(_, end)| *end >= least).count();
    Some((Quantity::AtLeast(least), held))
}

/// Returns the mean share of the demonstration after which the state reached its final count.
fn completed(motion: &Motion<'_>, found: &States, state: usize, demos: &[usize]) -> f64 {
    let mut total = 0.0;
    for d in demos {
        let last = motion.demo(*d).snapshots.len() - 1;
        let count = |s: usize| {
            scene(motion, found, *d, s).iter().flatten().filter(|l| l.state == state).count()
        };
        let end = count(last);
        let mut at = last;
        while at > 0 && count(at - 1) >= end {
            at -= 1;
        }
        total += at as f64 / last.max(1) as f64;
    }
    total / demos.len().max(1) as f64
}
