//! Means: of which of several states one is needed before an action, and which place goes with which.

use std::collections::BTreeSet;

use super::motion::Motion;
use super::operators::{Instance, OTHERS, SURE, scene};
use super::states::States;
use crate::task::domain::{Before, Condition, Need, Role, Situation, Subject};

/// Greatest number of states among which those are sought of which one will do.
const MOST_MEANS: usize = 24;

/// Returns sets of two or three states, with their subjects, of which one held before each instance, although none of them always
/// did.
///
/// Each of the states was brought about in some demonstrations and is missing at the end of others. It was therefore no
/// end in itself: somebody who does in each demonstration one of several things that are not needed later does it for
/// what comes next. So does somebody who does it each time to the object itself before it is moved, such as a bottle that gets a
/// cork or a cap.
pub(super) fn alternatives(
    motion: &Motion<'_>,
    found: &States,
    instances: &[Instance],
) -> Vec<(Subject, Vec<usize>)> {
    let ends: Vec<Situation> = (0..motion.recording.demos.len())
        .filter_map(|d| Some(scene(motion, found, d, motion.last(d)?)))
        .collect();
    let starts: Vec<Situation> =
        instances.iter().map(|i| scene(motion, found, i.attempt.demo, 0)).collect();
    let lasts = |state: usize| ends.iter().all(|e| e.iter().flatten().any(|f| f.state == state));
    let mut sets: Vec<(Subject, Vec<usize>)> = Vec::new();
    let own = [Subject::Is(Role::Origin), Subject::Is(Role::Target)];
    for subject in own.into_iter().chain(OTHERS) {
        // The states that are means, each with the instances before which it held.
        let mut means: Vec<(usize, Vec<bool>)> = Vec::new();
        for state in 0..found.states.len() {
            let condition = Condition { state, subject };
            let held: Vec<bool> =
                instances.iter().map(|i| i.count(&i.before, &condition) > 0).collect();
            let mut all = instances.iter().zip(&starts).zip(&held);
            let brought = all.any(|((i, start), held)| *held && i.count(start, &condition) == 0);
            let known = sets.iter().any(|(_, states)| states.contains(&state));
            let own = subject == Subject::At(Role::Object) && instances.len() >= SURE;
            if brought && !known && (own || !lasts(state)) && held.contains(&false) {
                means.push((state, held));
            }
        }
        if means.len() > MOST_MEANS {
            continue;
        }
        // Where one of them held each time, that is what was meant.
        for (several, size) in [false, true].into_iter().flat_map(|s| [(s, 2), (s, 3)]) {
            while let Some(set) = covering(&means, size, instances.len(), several) {
                means.retain(|(state, _)| !set.contains(state));
                sets.push((subject, set));
            }
        }
    }
    sets
}

/// Returns what has to be at the target before an object is put at each of several places, if one of several states is needed there,
/// and each place was taken with another one: the jaw of a vise stops where the plank in it ends.
pub(super) fn by_means(found: &States, needs: &[Need], instances: &[Instance]) -> Vec<Before> {
    let subject = Subject::At(Role::Target);
    let means = |need: &&Need| !need.or.is_empty() && need.condition.subject == subject;
    let Some(need) = needs.iter().find(means) else { return Vec::new() };
    let places: BTreeSet<usize> = instances.iter().map(|i| i.to.place).collect();
    let of_place = |place: usize| {
        let own: Vec<&Instance> = instances.iter().filter(|i| i.to.place == place).collect();
        let mut held = need.states().filter(|state| {
            let condition = Condition { state: *state, subject };
            own.iter().all(|i| i.count(&i.before, &condition) > 0)
        });
        held.next().filter(|_| held.next().is_none()).map(|state| (place, state))
    };
    let Some(of) = places.iter().map(|place| of_place(*place)).collect::<Option<Vec<_>>>() else {
        return Vec::new();
    };
    let states: BTreeSet<usize> = of.iter().map(|(_, state)| *state).collect();
    if of.len() < 2 || states.len() < of.len() {
        return Vec::new();
    }
    let every = |state: usize| (0..found.states[state].places.len()).map(move |p| (state, p));
    of.into_iter().map(|(place, s)| Before { place, one_of: every(s).collect() }).collect()
}

/// Returns the first so many states of which one held before each of the instances, each state alone before at least one. If
/// `several` may hold, a state can hold beside another.
fn covering(
    means: &[(usize, Vec<bool>)],
    size: usize,
    instances: usize,
    several: bool,
) -> Option<Vec<usize>> {
    let mut open: Vec<Vec<usize>> = vec![Vec::new()];
    while let Some(chosen) = open.pop() {
        let held = |i: usize| chosen.iter().filter(|m| means[**m].1[i]).count();
        if chosen.len() == size {
            let alone = |m: &usize| (0..instances).any(|i| means[*m].1[i] && held(i) == 1);
            let all = (0..instances).all(|i| held(i) == 1 || (several && held(i) > 0));
            if all && chosen.iter().all(alone) {
                return Some(chosen.into_iter().map(|m| means[m].0).collect());
            }
        } else if several || (0..instances).all(|i| held(i) <= 1) {
            let next = chosen.last().map_or(0, |last| last + 1);
            open.extend((next..means.len()).rev().map(|m| [&chosen[..], &[m]].concat()));
        }
    }
    None
}
