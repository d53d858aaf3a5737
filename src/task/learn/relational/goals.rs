//! The goal: the terms that some action achieves and that hold at the end of nearly all demonstrations.

use std::collections::BTreeSet;

use statrs::function::gamma::ln_gamma;

use super::motion::Motion;
use super::operators::scene;
use super::states::{States, least_support};
use crate::task::domain::{
    Frame, FrameState, GoalTerm, Need, Origin, Place, Quantity, RelationalOperator, Situation,
    Subject,
};
use crate::task::learn::NoGoal;

/// Share of the demonstrations that have to end with a term fulfilled.
const GOAL: f64 = 0.9;

/// Returns the number of demonstrations that have to end with a term fulfilled.
fn enough(of: usize) -> usize {
    (GOAL * of as f64).ceil().max(1.0) as usize
}

/// Returns the states that an action achieves, but for what serves another action: its object or target has to be in the state, or
/// what was brought there may not be where it came from.
fn final_states(operators: &[RelationalOperator]) -> BTreeSet<usize> {
    let needs = |holds: bool| {
        let all = operators.iter().flat_map(|operator| &operator.needs);
        all.filter(move |need| need.is_positive() == holds)
    };
    let of_parameter = |need: &&Need| matches!(need.condition.subject, Subject::Is(_));
    let needed: BTreeSet<usize> =
        needs(true).filter(of_parameter).flat_map(|need| need.states()).collect();
    let cleared: BTreeSet<usize> = needs(false).flat_map(|need| need.states()).collect();
    let clears = |to: usize| {
        operators.iter().any(|o| o.to == to && o.from.iter().any(|from| cleared.contains(from)))
    };
    let achieved = operators.iter().map(|operator| operator.to);
    achieved.filter(|to| !needed.contains(to) && !clears(*to)).collect()
}

/// Returns whether each of several references got as many objects as the others in each demonstration, and not by chance. `per` are the
/// numbers at the references of each demonstration.
fn were_dealt_out(per: &[Vec<usize>]) -> bool {
    let alike = |counts: &Vec<usize>| counts.len() > 1 && counts.iter().all(|n| *n == counts[0]);
    let ln_factorial = |n: usize| ln_gamma(n as f64 + 1.0);
    let chance = per.iter().map(|counts| {
        let all: usize = counts.iter().sum();
        let ways: f64 = counts.iter().map(|n| ln_factorial(*n)).sum();
        ln_factorial(all) - ways - all as f64 * (counts.len() as f64).ln()
    });
    per.iter().all(alike) && chance.sum::<f64>() <= CHANCE.ln()
}

/// The ends of the demonstrations.
struct Ends<'m, 'r> {
    motion: &'m Motion<'r>,
    found: &'m States,
    /// The demonstrations with snapshots, each with the situation at its end.
    last: Vec<(usize, Situation)>,
    /// Number of demonstrations that have to end with a term fulfilled.
    enough: usize,
    /// States that are one of several by which a condition of an action is met, unless demonstrations end with others of them, too.
    alternatives: BTreeSet<usize>,
    /// States that an action achieves, which serve no other action.
    final_states: BTreeSet<usize>,
    /// For each of the demonstrations, the tracks of which nobody knows where they are at its end.
    unknown: Vec<Vec<usize>>,
    /// The vertical coordinate, if somebody knows it.
    up: Option<usize>,
}

/// Share of the demonstrations that have to bring objects to a state in which the others found them: one in so many.
const BROUGHT: usize = 3;
/// Number of demonstrations that end with several ways to meet a condition from which these are no choice.
const TOGETHER: usize = 2;
/// Probability up to which it was no chance that several references got as many objects each.
const CHANCE: f64 = 0.01;
/// Distance from the middle of a reference, aside, up to which a part that was there once was put into or onto it, in metres.
const ONTO_M: f64 = 0.04;

/// How many demonstrations fulfil a term.
#[derive(Debug, Clone, Copy, Default)]
struct Held {
    /// Number that do.
    held: usize,
    /// Number that may, by an object that is not seen.
    may: usize,
}

/// The goal of the demonstrations, and what is no part of it.
pub(super) struct Goals {
    /// The terms, in the order in which they were completed.
    pub terms: Vec<GoalTerm>,
    /// The states that hold at the end of nearly all demonstrations and that no action achieves.
    pub unachieved: Vec<usize>,
    /// Of kinds that are in no term, the states in which objects were left in most demonstrations, each with the number of these.
    pub missed: Vec<(usize, usize)>,
}

/// Returns the goal.
pub(super) fn goals(
    motion: &Motion<'_>,
    found: &States,
    operators: &[RelationalOperator],
) -> Goals {
    let achieved: BTreeSet<usize> =
        operators.iter().flat_map(RelationalOperator::achieves).collect();
    let end = |d: usize| Some((d, scene(motion, found, d, motion.last(d)?)));
    let last: Vec<_> = (0..motion.recording.demos.len()).filter_map(end).collect();
    let enough = enough(last.len());
    let lost = |d: usize, end: &Situation| -> Vec<usize> {
        let at = motion.last(d).unwrap_or(0);
        // Errors of sensing hide where an object is, too.
        let unsure = motion.flickers || motion.is_noisy();
        // And what fell over was not left so on purpose.
        let fell = |t: usize| motion.index_at(d, t, at).is_some_and(|r| found.fallen.contains(&r));
        let unplaced = |t: &usize| end[*t].is_none() && (unsure || fell(*t));
        (0..end.len()).filter(|t| unplaced(t) || motion.vanished(d, *t, at)).collect()
    };
    let unknown = last.iter().map(|(d, end)| lost(*d, end)).collect();
    let needs = operators.iter().flat_map(|operator| &operator.needs);
    let ends_with = |end: &Situation, state| end.iter().flatten().any(|fact| fact.state == state);
    let alone = |need: &Need, state: usize| {
        let with_another = |end: &Situation| {
            ends_with(end, state) && need.states().any(|s| s != state && ends_with(end, s))
        };
        last.iter().filter(|(_, end)| with_another(end)).count() < TOGETHER
    };
    let either = needs.filter(|need| !need.or.is_empty());
    let alternatives =
        either.flat_map(|need| need.states().filter(|state| alone(need, *state))).collect();
    let up = motion.up();
    let final_states = final_states(operators);
    let ends = Ends { motion, found, last, enough, alternatives, final_states, unknown, up };
    let mut terms: Vec<(f64, GoalTerm)> = Vec::new();
    let mut unachieved = Vec::new();
    for state in 0..found.states.len() {
        let Some((quantity, held, of)) = ends.quantity(state) else { continue };
        if achieved.contains(&state) {
            let term = GoalTerm { state, or: Vec::new(), quantity, reference: None, held, of };
            terms.push((ends.completed(state), term));
        } else {
            unachieved.push(state);
        }
    }
    for (state, or, held) in ends.dealt(&achieved) {
        // Of the terms of its states, this is what they were for; but a number that was the same each time was meant.
        let same = |term: &GoalTerm| {
            let count =
                |end: &Situation| end.iter().flatten().filter(|l| l.state == term.state).count();
            let counts: BTreeSet<usize> = ends.last.iter().map(|(_, end)| count(end)).collect();
            term.quantity != Quantity::EachObject && counts.len() == 1
        };
        terms.retain(|(_, term)| (term.state != state && !or.contains(&term.state)) || same(term));
        let completed = or.iter().map(|s| ends.completed(*s)).fold(ends.completed(state), f64::max);
        let (quantity, of) = (Quantity::EachObject, ends.last.len());
        terms.push((completed, GoalTerm { state, or, quantity, reference: None, held, of }));
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
            let ended = ends.last.iter().enumerate().map(|(index, (_, end))| {
                let count = count(end);
                (count >= least, count + ends.hidden(index, term.state) >= least)
            });
            let ended = Held::of(ended);
            (needed && ends.suffices(ended)).then_some((*within, ended.held))
        });
        if let Some((within, held)) = bound.max_by_key(|(_, held)| *held) {
            (term.reference, term.held) = (Some(within), held);
        }
    }
    let missed = ends.missed(&achieved, terms.iter().map(|(_, term)| term));
    Goals { terms: terms.into_iter().map(|(_, term)| term).collect(), unachieved, missed }
}

/// Returns why there is no goal.
pub(super) fn lacking(
    motion: &Motion<'_>,
    found: &States,
    operators: &[RelationalOperator],
) -> NoGoal {
    if operators.is_empty() {
        return NoGoal::NoAction;
    }
    let demos = (0..motion.recording.demos.len()).filter_map(|d| Some((d, motion.last(d)?)));
    let demos: Vec<(usize, usize)> = demos.collect();
    let count = |d: usize, snapshot: usize, state: usize| {
        let scene = scene(motion, found, d, snapshot);
        scene.iter().flatten().filter(|fact| fact.state == state).count()
    };
    let achieved: BTreeSet<usize> =
        operators.iter().flat_map(RelationalOperator::achieves).collect();
    let gained = achieved.into_iter().map(|state| {
        let more = |(d, last): &&(usize, usize)| count(*d, *last, state) > count(*d, 0, state);
        (found.states[state].name.clone(), demos.iter().filter(more).count())
    });
    let ends: Vec<(String, usize)> = gained.filter(|(_, held)| *held > 0).collect();
    match ends.is_empty() {
        true => NoGoal::NothingNew,
        false => NoGoal::EndsDiffer { ends, of: demos.len() },
    }
}

impl Held {
    /// Counts the demonstrations, given for each whether it fulfils a term and whether it may.
    fn of(ended: impl Iterator<Item = (bool, bool)>) -> Self {
        let mut counts = Self::default();
        for (held, may) in ended {
            counts.held += usize::from(held);
            counts.may += usize::from(may && !held);
        }
        counts
    }
}

impl Ends<'_, '_> {
    /// Returns the number of objects in a state in each snapshot of a demonstration.
    fn counts(&self, state: usize, demo: usize) -> impl DoubleEndedIterator<Item = usize> + '_ {
        (0..self.motion.demo(demo).snapshots.len()).map(move |snapshot| {
            let scene = scene(self.motion, self.found, demo, snapshot);
            scene.iter().flatten().filter(|fact| fact.state == state).count()
        })
    }

    fn of_kind<'s>(&'s self, demo: usize, kind: &'s str) -> impl Iterator<Item = usize> + 's {
        let tracks = self.motion.tracks[demo].iter().enumerate();
        tracks.filter(move |(_, t)| &*t.kind == kind).map(|(i, _)| i)
    }

    /// Returns the number of objects that may be in a state at the end of a demonstration without being seen.
    fn hidden(&self, index: usize, state: usize) -> usize {
        let (demo, kind) = (self.last[index].0, &self.found.states[state].kind);
        let tracks = &self.motion.tracks[demo];
        self.unknown[index].iter().filter(|t| *tracks[**t].kind == **kind).count()
    }

    /// Returns whether nearly all demonstrations fulfil a term, or may.
    fn suffices(&self, ended: Held) -> bool {
        let seen = ended.may == 0 || 2 * ended.held > self.last.len();
        seen && ended.held + ended.may >= self.enough
    }

    /// Returns the number that nearly all demonstrations reach, and how many do, given the number of each and how many
    /// more it may be.
    fn reached(&self, counts: &[(usize, usize)]) -> (usize, usize) {
        let ended = |least: usize| {
            Held::of(counts.iter().map(|(count, more)| (*count >= least, count + more >= least)))
        };
        let most = counts.iter().map(|(count, _)| *count).max().unwrap_or(0);
        let least = (1..=most).rev().find(|least| self.suffices(ended(*least))).unwrap_or(0);
        (least, ended(least).held)
    }

    /// Returns how many objects have to be in a state, how many demonstrations end so, and of how many; `None` if it is no goal.
    fn quantity(&self, state: usize) -> Option<(Quantity, usize, usize)> {
        let of = self.last.len();
        let (quantity, held) = match self.quantity_of_all(state) {
            Some(known) => known,
            // Which of several keys was used depends on which there was. Another one at hand need not be used.
            None if self.alternatives.contains(&state) => return None,
            None => return self.quantity_where_present(state),
        };
        Some((quantity, held, of))
    }

    /// Returns the terms that every object of a kind is in one of several states, as a state, the others, and the number of
    /// demonstrations that end so: different numbers of objects were all put somewhere, and more than once in several states.
    fn dealt(&self, achieved: &BTreeSet<usize>) -> Vec<(usize, Vec<usize>, usize)> {
        let states = &self.found.states;
        let kinds: BTreeSet<&str> = achieved.iter().map(|s| &*states[*s].kind).collect();
        let own = |kind: &str| {
            let ends = self.last.iter().map(|(d, end)| {
                let all: Vec<usize> = self.of_kind(*d, kind).collect();
                let of: Option<Vec<usize>> =
                    all.iter().map(|t| end[*t].as_ref().map(|fact| fact.state)).collect();
                Some((all.len(), of?.into_iter().collect::<BTreeSet<usize>>()))
            });
            let ends: Vec<(usize, BTreeSet<usize>)> = ends.collect::<Option<_>>()?;
            let all: BTreeSet<usize> = ends.iter().flat_map(|(_, of)| of.iter().copied()).collect();
            let put =
                all.iter().all(|s| achieved.contains(s) && states[*s].origin == Origin::Placed);
            let numbers: BTreeSet<usize> = ends.iter().map(|(count, _)| *count).collect();
            let several = ends.iter().filter(|(_, of)| of.len() > 1).count();
            let dealt = put && numbers.len() > 1 && several > 1;
            let mut all = all.into_iter();
            let first = all.next().filter(|_| dealt)?;
            Some((first, all.collect(), ends.len()))
        };
        kinds.into_iter().filter_map(own).collect()
    }

    /// Returns the term that every object of a state's kind is in the state, if the kind is missing from some demonstrations and
    /// all the others end so: what is not always there is put where it belongs when it is. Most must have brought it there; in the
    /// others it may have lain there from the start. What was there once and was put into or
    /// onto something belongs there; elsewhere it may have been in the way.
    fn quantity_where_present(&self, state: usize) -> Option<(Quantity, usize, usize)> {
        let FrameState { kind, origin, frame, places, .. } = &self.found.states[state];
        let (mut of, mut held, mut gained, mut may) = (0, 0, 0, 0);
        for (d, end) in &self.last {
            let present = self.of_kind(*d, kind).count();
            let count = end.iter().flatten().filter(|fact| fact.state == state).count();
            of += usize::from(present > 0);
            held += usize::from(present > 0 && count >= present);
            gained += usize::from(count > 0 && self.counts(state, *d).any(|was| was < count));
            // What lay there from the start left nothing to do.
            may += usize::from(count > 0 && *origin == Origin::Placed);
        }
        let aside = |place: &Place| {
            let at = place.pose().position;
            (0..3)
                .filter(|axis| Some(*axis) != self.up)
                .map(|axis| at[axis] * at[axis])
                .sum::<f64>()
        };
        let onto = *frame != Frame::World && places.iter().all(|p| aside(p) < ONTO_M * ONTO_M);
        let least = if onto { 1 } else { least_support(self.last.len()).max(2) };
        let optional = of < self.last.len() && of >= least;
        let brought = gained >= enough(of) || 2 * gained > of && may >= enough(of);
        let goal = optional && held >= enough(of) && brought;
        goal.then_some((Quantity::EachObject, held, of))
    }

    /// Returns how many objects have to be in a state, and how many of all demonstrations end so; `None` if it is no goal of all.
    fn quantity_of_all(&self, state: usize) -> Option<(Quantity, usize)> {
        let at = |end: &Situation, within: Option<usize>| {
            let own = end.iter().flatten().filter(|l| l.state == state);
            own.filter(|l| within.is_none() || l.reference == within).count()
        };
        let hidden: Vec<usize> = (0..self.last.len()).map(|i| self.hidden(i, state)).collect();
        let counts: Vec<usize> = self.last.iter().map(|(_, end)| at(end, None)).collect();
        let model = &self.found.states[state];
        // A state that held all along was no goal of the demonstrator, unless most reached it and the others had nothing left to do.
        // One that was left and reached again is.
        let gained = self.last.iter().zip(&counts).zip(&hidden).map(|(((d, _), end), hidden)| {
            let gained = *end > 0 && self.counts(state, *d).any(|count| count < *end);
            let done = *end > 0 && model.origin == Origin::Placed;
            (gained, *hidden > 0 || done)
        });
        if !self.suffices(Held::of(gained)) && !self.was_completed(state, &counts) {
            return None;
        }
        let present = self.last.iter().map(|(d, _)| self.of_kind(*d, &model.kind).count());
        let present: Vec<usize> = present.collect();
        let ended = counts.iter().zip(&hidden).zip(&present);
        let all = Held::of(ended.map(|((c, h), present)| (c >= present, c + h >= *present)));
        let every = self.suffices(all);
        // A place with room takes all of them, and so does one that did so for different numbers.
        let several = counts.iter().any(|end| *end > 1);
        let whole = every && several && present.iter().min() < present.iter().max();
        let kind = model.frame.kind();
        let per = self.last.iter().map(|(d, end)| {
            let references = kind.into_iter().flat_map(|kind| self.of_kind(*d, kind));
            references.map(|r| at(end, Some(r))).collect()
        });
        let per: Vec<Vec<usize>> = per.collect();
        if every && model.places.iter().any(Place::is_roomy) && !were_dealt_out(&per) {
            return Some((Quantity::EachObject, all.held));
        }
        if kind.is_some() {
            let least = per.iter().map(|counts| counts.iter().copied().min().unwrap_or(0));
            let least: Vec<(usize, usize)> = least.zip(hidden.iter().copied()).collect();
            let (each, held) = self.reached(&least);
            let more = whole && per.iter().flatten().any(|count| *count > each);
            if each >= 1 && per.iter().any(|counts| counts.len() > 1) && !more {
                return Some((Quantity::EachReference(each), held));
            }
        }
        if whole {
            return Some((Quantity::EachObject, all.held));
        }
        let counts: Vec<(usize, usize)> = counts.into_iter().zip(hidden).collect();
        let (least, held) = self.reached(&counts);
        Some((Quantity::AtLeast(least), held))
    }

    /// Returns whether every demonstration ends in a state that nothing ever left, with as many objects as the others, and several had to
    /// bring some there, which served no other action: what was missing at first was put there each time.
    fn was_completed(&self, state: usize, counts: &[usize]) -> bool {
        let all = counts.first().copied().unwrap_or(0);
        if !self.final_states.contains(&state) || all == 0 || counts.iter().any(|end| *end != all) {
            return false;
        }
        let first = |d: usize| self.counts(state, d).next().unwrap_or(0);
        let brought = self.last.iter().filter(|(d, _)| first(*d) < all).count();
        let several = BROUGHT * brought >= self.last.len() && brought >= 2;
        several && self.last.iter().all(|(d, _)| self.counts(state, *d).is_sorted())
    }

    /// Returns the states of [`Goals::missed`].
    fn missed<'t>(
        &self,
        achieved: &BTreeSet<usize>,
        terms: impl Iterator<Item = &'t GoalTerm>,
    ) -> Vec<(usize, usize)> {
        let states = &self.found.states;
        let kinds: BTreeSet<&str> = terms.map(|term| &*states[term.state].kind).collect();
        let missed = achieved.iter().filter(|s| {
            let FrameState { kind, origin, .. } = &states[**s];
            *origin == Origin::Placed && !kinds.contains(&**kind) && !self.alternatives.contains(s)
        });
        let missed = missed.map(|state| {
            let held = self.last.iter().filter(|(d, end)| {
                let count = end.iter().flatten().filter(|fact| fact.state == *state).count();
                self.counts(*state, *d).next().is_some_and(|was| was < count)
            });
            (*state, held.count())
        });
        missed.filter(|(_, held)| 2 * held > self.last.len()).collect()
    }

    /// Returns the mean share of the demonstration after which the state reached its final count, of those that end in it.
    fn completed(&self, state: usize) -> f64 {
        let shares = self.last.iter().filter_map(|(d, _)| {
            let counts: Vec<usize> = self.counts(state, *d).collect();
            let last = counts.len() - 1;
            let lacked = counts.iter().rposition(|count| *count < counts[last]);
            let share = lacked.map_or(0, |at| at + 1) as f64 / last.max(1) as f64;
            (counts[last] > 0).then_some(share)
        });
        let shares: Vec<f64> = shares.collect();
        shares.iter().sum::<f64>() / shares.len().max(1) as f64
    }
}
