//! The order in which the places of something are filled: a row from one end, a stack from below.

use std::collections::{BTreeMap, BTreeSet};

use super::operators::Instance;
use super::states::States;
use crate::task::domain::{Before, Fact, Place, Situation};

/// Number of times that a place has to be filled before its turn says something.
const OFTEN: usize = 4;
/// Number of times that a place that lies lower has to be filled before, where it was filled from the start the other times.
const OFTEN_BELOW: usize = 3;
/// Height from which a place is higher than another, in metres.
const HIGHER_M: f64 = 0.01;

/// Probability up to which it was no chance that the place below another was filled.
const CHANCE: f64 = 0.2;
/// Distance aside up to which a place lies over another, in metres.
const OVER_M: f64 = 0.01;

/// Returns whether a place lies over another: they differ in one coordinate.
fn lies_over(a: &Place, b: &Place) -> bool {
    let (a, b) = (a.pose().position, b.pose().position);
    let mut apart: [f64; 3] = std::array::from_fn(|i| (a[i] - b[i]).abs());
    apart.sort_by(f64::total_cmp);
    apart[0].hypot(apart[1]) <= OVER_M
}

/// A state with the index of one of its places.
type Slot = (usize, usize);

/// The places that are filled, each with those that always were before it. Places of several states that exclude each other
/// are one: a row of bricks has places for red and for blue ones.
pub(super) struct Rows {
    /// The representative of each place.
    own: BTreeMap<Slot, Slot>,
    /// For each representative, the representatives that were filled each time before.
    before: BTreeMap<Slot, BTreeSet<Slot>>,
    /// For each representative, those of them over which it lies, of several that might have been filled as well.
    over: BTreeMap<Slot, BTreeSet<Slot>>,
}

impl Rows {
    /// Finds the order of the places that some instances filled. `start` returns where everything was at the beginning of a
    /// demonstration: what was there already had no turn, so that the order has no circles. Only what lies higher, by the vertical
    /// coordinate `up` of the frames, is also known to come after what was there already some of the times. Costs O(places^2 + instances
    /// x objects).
    pub fn of<'i>(
        found: &States,
        up: Option<usize>,
        start: impl Fn(usize) -> Situation,
        instances: impl Iterator<Item = &'i Instance>,
    ) -> Self {
        let states = found.states.iter().enumerate();
        let slots =
            states.flat_map(|(state, model)| (0..model.places.len()).map(move |p| (state, p)));
        let place = |(state, place): Slot| &found.states[state].places[place];
        let mut own: BTreeMap<Slot, Slot> = BTreeMap::new();
        for slot in slots.filter(|slot| !place(*slot).is_roomy()) {
            let same = own.keys().find(|other| {
                found.states[other.0].frame == found.states[slot.0].frame
                    && place(**other).excludes(place(slot))
            });
            let first = same.map_or(slot, |other| own[other]);
            own.insert(slot, first);
        }
        // Places that are taken at once, such as those of a part and of another one on it, are two.
        let mut shared: BTreeSet<Slot> = BTreeSet::new();
        let mut filled: BTreeMap<Slot, (usize, BTreeSet<Slot>)> = BTreeMap::new();
        // For each place, those that were filled each time before or from the start, with the number of times before.
        let mut stood: BTreeMap<Slot, BTreeMap<Slot, usize>> = BTreeMap::new();
        // For each place and state, the probability that one of the state's places was filled each time by chance.
        let mut chances: BTreeMap<(Slot, usize), f64> = BTreeMap::new();
        for Instance { attempt, object, to, before, .. } in instances {
            let Some(slot) = own.get(&(to.state, to.place)) else { continue };
            let frame = &found.states[to.state].frame;
            let beside = |fact: &&Fact| {
                fact.reference == to.reference && found.states[fact.state].frame == *frame
            };
            let start = start(attempt.demo);
            let others = before.iter().zip(&start).enumerate().filter(|(track, _)| track != object);
            let mut there: BTreeSet<Slot> = BTreeSet::new();
            let mut anyway: BTreeSet<Slot> = BTreeSet::new();
            for (_, (now, first)) in others {
                let fact = now.as_ref().filter(beside);
                let Some(taken) = fact.and_then(|fact| own.get(&(fact.state, fact.place))) else {
                    continue;
                };
                if taken == slot {
                    shared.insert(*slot);
                } else if now != first {
                    there.insert(*taken);
                } else {
                    anyway.insert(*taken);
                }
            }
            let mut of: BTreeMap<usize, usize> = BTreeMap::new();
            there.iter().for_each(|(state, _)| *of.entry(*state).or_default() += 1);
            for (state, count) in of {
                let share = count as f64 / found.states[state].places.len() as f64;
                *chances.entry((*slot, state)).or_insert(1.0) *= share;
            }
            let both = || &there | &anyway;
            let stood =
                stood.entry(*slot).or_insert_with(|| both().into_iter().map(|s| (s, 0)).collect());
            stood.retain(|other, _| there.contains(other) || anyway.contains(other));
            stood
                .iter_mut()
                .for_each(|(other, times)| *times += usize::from(there.contains(other)));
            let (times, always) = filled.entry(*slot).or_insert_with(|| (0, there.clone()));
            *times += 1;
            always.retain(|other| there.contains(other));
        }
        let higher = |a: Slot, b: Slot| {
            let height = |slot: Slot| up.map(|up| place(slot).pose().position[up]);
            height(a).zip(height(b)).is_some_and(|(a, b)| a - b > HIGHER_M)
        };
        for (slot, (_, always)) in filled.iter_mut().filter(|(_, (times, _))| *times >= OFTEN) {
            let below = stood.get(slot).into_iter().flatten();
            let below = below.filter(|(other, n)| **n >= OFTEN_BELOW && higher(*slot, **other));
            always.extend(below.map(|(other, _)| *other));
        }
        own.retain(|_, slot| !shared.contains(slot));
        filled.retain(|slot, _| !shared.contains(slot));
        let often = filled.iter().filter(|(_, (times, _))| *times >= OFTEN);
        let mut known: BTreeSet<Slot> = often.map(|(slot, _)| *slot).collect();
        let earlier = |slot: &Slot, known: &BTreeSet<Slot>| {
            let (_, always) = filled.get(slot)?;
            Some(&(always & known) - &BTreeSet::from([*slot]))
        };
        // A row that is filled from one end has an end that is seldom reached.
        let in_order = |slot: &Slot| earlier(slot, &known).is_some_and(|all| !all.is_empty());
        let rows: BTreeSet<usize> =
            known.iter().filter(|slot| in_order(slot)).map(|(state, _)| *state).collect();
        known.extend(filled.keys().filter(|(state, _)| rows.contains(state)));
        let mut before: BTreeMap<Slot, BTreeSet<Slot>> = BTreeMap::new();
        for slot in &known {
            before.insert(*slot, earlier(slot, &known).unwrap_or_default());
        }
        let over = before.iter().map(|(slot, all)| {
            let meant = |one: &&Slot| {
                let chance = chances.get(&(*slot, one.0)).copied().unwrap_or(1.0);
                chance <= CHANCE && lies_over(place(*slot), place(**one))
            };
            (*slot, all.iter().filter(meant).copied().collect())
        });
        let over = over.collect();
        Self { own, before, over }
    }

    /// Returns what has to be filled before each place of a state. A place that is filled before another one that has to be is
    /// left out. What was filled before all places of the state is no order among them: conditions tell of it.
    pub fn order(&self, state: usize) -> Vec<Before> {
        let own = || self.own.range((state, 0)..=(state, usize::MAX));
        let none = BTreeSet::new();
        let before = |slot: &Slot| self.before.get(slot).unwrap_or(&none);
        let common = own().map(|(_, slot)| before(slot).clone()).reduce(|a, b| &a & &b);
        let common = common.unwrap_or_default();
        let all = own().flat_map(|((_, place), slot)| {
            // Conditions do not tell which of several places has to be filled.
            let over = self.over.get(slot).unwrap_or(&none);
            let all = &(before(slot) - &common) | over;
            let last: Vec<Slot> = all
                .iter()
                .filter(|one| !all.iter().any(|other| before(other).contains(one)))
                .copied()
                .collect();
            last.into_iter().map(|one| {
                let one_of = self.own.iter().filter(|(_, of)| **of == one);
                Before { place: *place, one_of: one_of.map(|(slot, _)| *slot).collect() }
            })
        });
        all.collect()
    }
}
