//! Operators: conditions before and after each action, counted over its demonstrated instances.

use std::collections::{BTreeMap, BTreeSet};

use super::frames::SMALLEST_M;
use super::likelihood::{Likelihood, Spread};
use super::means::{alternatives, by_means};
use super::motion::{Came, Motion, Rest};
use super::rows::Rows;
use super::states::{States, least_support};
use crate::task::domain::{
    Condition, Coordinate, Displacement, Fact, Need, NeedVerdict, Origin, Parameters,
    RelationalOperator, Role, SideEffect, Situation, Subject, relative,
};
use crate::task::learn::attempts::Attempt;
use crate::task::learn::summary::Failure;

/// A demonstrated instance of an action.
pub(super) struct Instance {
    pub attempt: Attempt,
    pub object: usize,
    from: Fact,
    pub to: Fact,
    /// The fact of each track before and after.
    pub before: Situation,
    after: Situation,
    /// The tracks that are not seen before or after, although they lie somewhere; none unless objects are missing for a moment.
    unseen: BTreeSet<usize>,
}

/// The outcome of each attempt: the state that its object entered.
pub(super) struct Operators {
    pub operators: Vec<RelationalOperator>,
    /// For each attempt, the index of its operator, or why it failed.
    pub judged: Vec<Result<usize, Failure>>,
}

/// Share of the instances that have to agree about a side effect, which knocks and outliers can disturb.
const AGREE: f64 = 0.9;
/// Number of instances from which what always held of the object, or of what it was taken from, is taken for needed, and not for how things
/// happened to be set up.
pub(super) const SURE: usize = 5;

pub(super) fn find(motion: &Motion<'_>, found: &States) -> Operators {
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
        let rest = motion.ends(&i.attempt).map(|(before, _)| &motion.rests[before]);
        let found = |rest: &Rest| rest.came == Came::Found && motion.is_sure(rest);
        i.attempt.declared && rest.is_some_and(found)
    };
    of_state.retain(|_, instances| {
        let demos: BTreeSet<usize> = instances.iter().map(|i| i.attempt.demo).collect();
        demos.len() >= least || instances.iter().all(shown)
    });
    let all = of_state.values().flatten();
    let (seen, rode, rows) = (
        seen(motion, found),
        rode(motion, all),
        Rows::of(
            found,
            motion.up(),
            |demo| scene(motion, found, demo, 0),
            of_state.values().flatten(),
        ),
    );
    let mut operators = Vec::new();
    let mut index = BTreeMap::new();
    for (state, instances) in &of_state {
        index.insert(*state, operators.len());
        let own = operator(motion, found, *state, instances, [&seen, &rode]);
        let rows = Some(rows.order(*state)).filter(|order| !order.is_empty());
        let order = rows.unwrap_or_else(|| by_means(found, &own.needs, instances));
        operators.push(RelationalOperator { order, ..own });
    }
    let judged = outcomes
        .into_iter()
        .map(|o| o.and_then(|state| index.get(&state).copied().ok_or(Failure::Undone)))
        .collect();
    Operators { operators, judged }
}

/// Returns the labels of all tracks in a snapshot.
pub(super) fn scene(
    motion: &Motion<'_>,
    found: &States,
    demo: usize,
    snapshot: usize,
) -> Situation {
    (0..motion.tracks[demo].len())
        .map(|t| {
            // An object that is missing for a moment keeps its state.
            found.labels[motion.known(demo, t, snapshot)?]
        })
        .collect()
}

fn instance(motion: &Motion<'_>, found: &States, attempt: &Attempt) -> Result<Instance, Failure> {
    let object = attempt.track.ok_or(Failure::NothingMoved)?;
    // An object can be missing for a moment.
    let before = motion.known(attempt.demo, object, attempt.before);
    let (Some(before), Some(after)) = (before, motion.next(attempt.demo, object, attempt.after))
    else {
        return Err(Failure::PartLost);
    };
    let from = found.labels[before].ok_or(Failure::StartUnknown)?;
    let to = found.labels[after].ok_or(Failure::NothingNew)?;
    if from.state == to.state && from.reference == to.reference {
        return Err(Failure::NothingNew);
    }
    // What is not seen in the middle of a rest lies there.
    let hidden = |track: &usize| {
        let at = |snapshot| motion.index_at(attempt.demo, *track, snapshot);
        at(attempt.before).is_none() || at(attempt.after).is_none()
    };
    let tracks = 0..motion.tracks[attempt.demo].len();
    Ok(Instance {
        attempt: *attempt,
        object,
        from,
        to,
        unseen: tracks.filter(|track| motion.flickers && hidden(track)).collect(),
        before: scene(motion, found, attempt.demo, attempt.before),
        after: scene(motion, found, attempt.demo, attempt.after),
    })
}

/// Returns the states in which others were at an object while it was moved, with its kind: such as those of what lies in a drawer.
fn rode<'i>(
    motion: &Motion<'_>,
    instances: impl Iterator<Item = &'i Instance>,
) -> BTreeSet<(usize, String)> {
    let mut rode = BTreeSet::new();
    for instance in instances {
        let kind = &motion.tracks[instance.attempt.demo][instance.object].kind;
        for (before, after) in instance.before.iter().zip(&instance.after) {
            let stays = before.as_ref().filter(|fact| fact.reference == Some(instance.object));
            if let Some(fact) = stays.filter(|fact| after.as_ref() == Some(fact)) {
                rode.insert((fact.state, kind.to_string()));
            }
        }
    }
    rode
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
    pub fn count(&self, scene: &Situation, condition: &Condition) -> usize {
        let counted = condition.counted(&self.parameters());
        counted.map_or(0, |counted| counted.holders(scene).count())
    }

    /// Returns whether a condition that does not seem to hold may hold all the same, by an object that is not seen.
    fn may_hold(&self, motion: &Motion<'_>, found: &States, condition: &Condition) -> bool {
        let tracks = &motion.tracks[self.attempt.demo];
        self.unseen.iter().any(|track| *tracks[*track].kind == *found.states[condition.state].kind)
    }

    /// Counts the objects that could fulfil a condition, whatever their states.
    fn present(&self, motion: &Motion<'_>, found: &States, condition: &Condition) -> usize {
        let kind = &found.states[condition.state].kind;
        let except = condition.counted(&self.parameters()).map_or([None; 3], |c| c.except);
        let tracks = motion.tracks[self.attempt.demo].iter().enumerate();
        tracks.filter(|(i, t)| *t.kind == **kind && !except.contains(&Some(*i))).count()
    }
}

/// The subjects of conditions about objects that are no parameters. What is said of a parameter says more than what is
/// said of any object.
pub(super) const OTHERS: [Subject; 4] =
    [Subject::At(Role::Object), Subject::At(Role::Origin), Subject::At(Role::Target), Subject::Any];

/// Returns all conditions that can be expressed for an action.
fn conditions(states: usize) -> impl Iterator<Item = Condition> {
    let own = [Subject::Is(Role::Origin), Subject::Is(Role::Target)];
    (0..states).flat_map(move |state| {
        own.into_iter().chain(OTHERS).map(move |subject| Condition { state, subject })
    })
}

fn operator(
    motion: &Motion<'_>,
    found: &States,
    to: usize,
    instances: &[Instance],
    [seen, rode]: [&BTreeSet<(usize, String)>; 2],
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
    // States of kinds that were not there each time, of which all were in it when they were.
    let mut at_times = BTreeSet::new();
    for condition in conditions(found.states.len()) {
        let all = held_before(&condition);
        // An instance that does not tell is left out, unless most do not.
        let tells =
            |(i, count): &(&Instance, usize)| *count > 0 || !i.may_hold(motion, found, &condition);
        let told = instances.iter().zip(all.iter().copied()).filter(tells);
        let told: Vec<usize> = told.map(|(_, count)| count).collect();
        let counts = if 2 * told.len() > all.len() { told } else { all };
        let of = counts.len();
        let held = counts.iter().filter(|c| **c > 0).count();
        let least = counts.iter().copied().min().unwrap_or(0).max(1);
        let present = instances.iter().map(|i| i.present(motion, found, &condition));
        let present: Vec<usize> = present.collect();
        // If their number differs and all were there each time, the condition is about all of them.
        let numbers: BTreeSet<usize> = present.iter().copied().collect();
        let some = present.iter().filter(|n| **n > 0).count();
        let placed = found.states[condition.state].origin == Origin::Placed;
        let every = placed && counts == present && numbers.len() > 1 && some > 1;
        let held = if every { of } else { held };
        if every && numbers.contains(&0) {
            at_times.insert(condition.state);
        }
        let need = |verdict, holds, least| {
            let every = every && holds;
            Need { condition, or: Vec::new(), verdict, holds, least, every, held, of }
        };
        let role = match condition.subject {
            Subject::Is(role) | Subject::At(role) => Some(role),
            Subject::Any => None,
        };
        if role.is_some_and(|r| instances.iter().any(|i| i.parameters().get(r).is_none())) {
            continue;
        }
        let of_kind = |all: &BTreeSet<(usize, String)>| {
            role.and_then(kind).is_some_and(|k| all.contains(&(condition.state, k)))
        };
        let possible = of_kind(seen);
        match condition.subject {
            // How it stood with what the object was taken from may be how it was set up.
            Subject::Is(Role::Origin) if held == of && of < SURE => {
                needs.push(need(NeedVerdict::Undecided, true, 1));
            }
            Subject::Is(_) if held == of => needs.push(need(NeedVerdict::Required, true, 1)),
            Subject::At(_) if held == of => {
                needs.push(need(NeedVerdict::Undecided, true, least));
            }
            // What went along when the object was moved otherwise is not in its way.
            Subject::At(Role::Object) if held == 0 && of_kind(rode) => {
                needs.push(need(NeedVerdict::Undecided, false, 1));
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
    for (subject, mut or) in alternatives(motion, found, instances) {
        // Each time one of these did; what there is of another one need not.
        needs.retain(|need| {
            let state = need.condition.state;
            !(need.every && at_times.contains(&state) && or.contains(&state))
        });
        let condition = Condition { state: or.remove(0), subject };
        let (verdict, holds, least, every) = (NeedVerdict::Undecided, true, 1, false);
        needs.push(Need { condition, or, verdict, holds, least, every, held: of, of });
    }
    needs.extend(states_of_parameters(motion, found, instances, &needs));
    needs.extend(cleared(motion, found, to, instances, &needs));
    let never_seen = (0..found.states.len())
        .filter(|s| {
            instances.iter().all(|i| i.before.iter().flatten().all(|label| label.state != *s))
        })
        .collect();
    RelationalOperator {
        name: String::new(),
        from: from.into_iter().map(|(state, _)| state).collect(),
        to,
        needs,
        order: Vec::new(),
        side_effects: side_effects(found, instances),
        displacement: displacement(motion, found, to, instances),
        instances: of,
        never_seen,
    }
}

/// Returns needs that a parameter is in one of several states, in which it was each time, where its kind has others: what is
/// stacked goes onto the plate's block or onto another block, but not onto a block that lies about.
fn states_of_parameters(
    motion: &Motion<'_>,
    found: &States,
    instances: &[Instance],
    known: &[Need],
) -> Vec<Need> {
    let own = |role: Role| {
        let subject = Subject::Is(role);
        if known.iter().any(|need| need.condition.subject == subject && need.is_positive()) {
            return None;
        }
        let fact =
            |i: &Instance| -> Option<usize> { Some(i.before[i.parameters().get(role)?]?.state) };
        let of: Vec<usize> = instances.iter().map(fact).collect::<Option<_>>()?;
        let mut or: Vec<usize> = of.iter().copied().collect::<BTreeSet<_>>().into_iter().collect();
        let track = instances[0].parameters().get(role)?;
        let kind = &motion.tracks[instances[0].attempt.demo][track].kind;
        let others = (0..found.states.len()).filter(|s| *found.states[*s].kind == **kind);
        if or.iter().any(|state| *found.states[*state].kind != **kind) {
            return None;
        }
        let fewer = or.len() < others.count();
        let (of, several) = (of.len(), or.len() > 1 && 2 * or.len() <= of.len());
        let condition = Condition { state: or.remove(0), subject };
        let (verdict, holds, least, every) = (NeedVerdict::Undecided, true, 1, false);
        let need = Need { condition, or, verdict, holds, least, every, held: of, of };
        (fewer && several).then_some(need)
    };
    [Role::Origin, Role::Target].into_iter().filter_map(own).collect()
}

/// Returns needs that no object is left in a state in which objects of its kind were found at the beginning: all had been put
/// somewhere each time, but not all in one state, or in different numbers.
fn cleared(
    motion: &Motion<'_>,
    found: &States,
    to: usize,
    instances: &[Instance],
    known: &[Need],
) -> Vec<Need> {
    let of = instances.len();
    let starts: Vec<Situation> =
        instances.iter().map(|i| scene(motion, found, i.attempt.demo, 0)).collect();
    let own = |state: usize| {
        let model = &found.states[state];
        let of_kind = |s: usize| found.states[s].kind == model.kind;
        let condition = Condition { state, subject: Subject::Any };
        let (mut all, mut numbers) = (instances.iter().zip(&starts), BTreeSet::new());
        let cleared = all.all(|(i, start)| {
            let at_first = i.count(start, &condition);
            let present = i.present(motion, found, &condition);
            numbers.insert(present);
            let hidden = i.may_hold(motion, found, &condition);
            at_first > 0 && i.count(&i.before, &condition) == 0 && !hidden
        });
        let mut about = known.iter().filter(|n| n.is_positive() && of_kind(n.condition.state));
        let told = match numbers.len() {
            1 => about.next().is_some(),
            _ => about.any(|need| need.every),
        };
        let may = model.origin == Origin::Found && !of_kind(to) && of > 1;
        (may && cleared && !told).then(|| {
            let (verdict, holds, least, every) = (NeedVerdict::Undecided, false, 1, false);
            Need { condition, or: Vec::new(), verdict, holds, least, every, held: 0, of }
        })
    };
    (0..found.states.len()).filter_map(own).collect()
}

/// Returns the changes of other objects' states. A change counts only where it was possible.
fn side_effects(found: &States, instances: &[Instance]) -> Vec<SideEffect> {
    let mut effects: Vec<SideEffect> = Vec::new();
    for condition in conditions(found.states.len()) {
        for begins in [true, false] {
            let (mut changed, mut of) = (0, 0);
            for instance in instances {
                // What is not seen before or after may have changed at another time.
                let seen = |scene: &Situation| -> Situation {
                    let own = scene.iter().enumerate();
                    own.map(|(i, fact)| fact.filter(|_| !instance.unseen.contains(&i))).collect()
                };
                let before = instance.count(&seen(&instance.before), &condition) > 0;
                let after = instance.count(&seen(&instance.after), &condition) > 0;
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
            let (before, after) = motion.ends(&i.attempt)?;
            let (before, after) = (motion.rests[before].pose, &motion.rests[after]);
            let frame = match i.to.reference {
                Some(track) => {
                    let span = (after.first, after.first);
                    motion.rests[motion.rest_during(demo, track, span)?].pose
                }
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
