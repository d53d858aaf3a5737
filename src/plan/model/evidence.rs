//! Weighs the literals that held before every step of an action: required, undecided, or redundant.
//!
//! Let a literal have held before every step. Three observations speak for it:
//!
//! 1. The action makes it false.
//! 2. A refused step would have been allowed without it: all other literals held.
//! 3. It would not have held by chance. Let *p* be the share of all atoms of its kind, over all states, for which the
//!    literal is true, and *n* the number of different objects that it held for before a step. Then it would have held
//!    each time with probability *p^n*, if the action did not ask for it.
//!
//! A literal that follows from another literal of the action says nothing more, whatever the numbers are. It *follows*
//! if no state has a counterexample and at least [`MIN_INSTANCES`] different objects were seen that could have been one.
//! Leaving it out does not change which of the observed calls are allowed. So these are left out:
//!
//! - A permutation of another literal's arguments, if both follow from each other (a symmetric relation). The literal
//!   stays whose arguments come in the order of the action's parameters.
//! - A positive literal that follows from another one but not the reverse, if its predicate changes over time and the
//!   action changes no atom of that predicate. Such a literal is an invariant of the domain.
//! - The same for a relation that never changes, if the action also asks for that relation between other arguments.
//!   Otherwise such a relation stays, because it is usually meant to restrict the arguments.
//! - A negative literal that follows from a positive one (mutual exclusion), or that could have held by chance: most
//!   atoms are false most of the time.
//!
//! Everything else that always held stays, because a plan must not do what was never seen to work (B. Juba, H. S. Le and
//! R. Stern, "Safe learning of lifted action models", 2021).

use std::collections::{BTreeMap, BTreeSet};

use super::effects::Effects;
use super::vocabulary::{Bound, Slot};
use super::{Precondition, Reason, Seen};
use crate::plan::strips::{Action, Domain, GroundAtom, Literal, Trajectory, Typed};

/// Number of different objects for which an implication must have held to be believed. An exception that concerns one
/// object in seven would have shown among so many with a probability of 95%.
const MIN_INSTANCES: usize = 20;

/// Greatest number of pairs of literals that are compared. Beyond it, none is found redundant.
const MAX_PAIRS: usize = 200_000;

/// Probability up to which a literal is not believed to have held by chance.
const MAX_CHANCE: f64 = 0.05;

/// A literal as a position in the vocabulary of its action.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Candidate {
    pub positive: bool,
    pub index: usize,
}

impl Candidate {
    /// Returns the literal with names.
    pub fn literal(self, domain: &Domain, vocabulary: &[Bound]) -> Literal {
        Literal { positive: self.positive, atom: vocabulary[self.index].atom(domain) }
    }
}

/// A state of a trajectory.
struct State<'a> {
    trajectory: usize,
    facts: &'a BTreeSet<GroundAtom>,
    by_predicate: BTreeMap<usize, Vec<&'a GroundAtom>>,
}

impl State<'_> {
    fn of(&self, predicate: usize) -> &[&GroundAtom] {
        self.by_predicate.get(&predicate).map_or(&[], Vec::as_slice)
    }
}

/// For each trajectory and parameter of an action, whether each object is of the parameter's type.
pub(super) struct Fitting(Vec<Vec<Vec<bool>>>);

impl Fitting {
    /// Returns whether an object of a trajectory can stand for a slot of the action.
    fn fits(&self, trajectory: usize, slot: Slot, object: usize) -> bool {
        match slot {
            Slot::Constant(constant) => constant == object,
            Slot::Parameter(position) => self.0[trajectory][position][object],
        }
    }

    /// Returns whether all objects of a fact can stand for the slots of `bound`.
    fn all_fit(&self, trajectory: usize, bound: &Bound, fact: &GroundAtom) -> bool {
        let mut pairs = bound.slots.iter().zip(&fact.arguments);
        pairs.all(|(slot, object)| self.fits(trajectory, *slot, *object))
    }

    /// Returns whether two facts agree in the objects that they share and the others are different and fit.
    fn agree(
        &self,
        trajectory: usize,
        (source, target): (&GroundAtom, &GroundAtom),
        (slots, shared): (&[Slot], &[Option<usize>]),
    ) -> bool {
        let mut places = target.arguments.iter().zip(shared).zip(slots);
        places.all(|((object, at), slot)| match at {
            Some(at) => source.arguments[*at] == *object,
            None => !source.arguments.contains(object) && self.fits(trajectory, *slot, *object),
        })
    }
}

/// All states of all trajectories.
pub(super) struct Observed<'a> {
    domain: &'a Domain,
    trajectories: &'a [Trajectory],
    states: Vec<State<'a>>,
    /// For each predicate, whether any step changed one of its atoms.
    changes: Vec<bool>,
}

impl<'a> Observed<'a> {
    pub fn new(domain: &'a Domain, trajectories: &'a [Trajectory]) -> Self {
        let mut states = Vec::new();
        let mut changes = vec![false; domain.predicates.len()];
        for (index, trajectory) in trajectories.iter().enumerate() {
            for pair in trajectory.states.windows(2) {
                for fact in pair[0].symmetric_difference(&pair[1]) {
                    changes[fact.predicate] = true;
                }
            }
            for (at, state) in trajectory.states.iter().enumerate() {
                // A state that equals the one before it is no new evidence.
                if at > 0 && trajectory.states[at - 1] == *state {
                    continue;
                }
                let mut by_predicate: BTreeMap<usize, Vec<&GroundAtom>> = BTreeMap::new();
                for fact in state {
                    by_predicate.entry(fact.predicate).or_default().push(fact);
                }
                states.push(State { trajectory: index, facts: state, by_predicate });
            }
        }
        Self { domain, trajectories, states, changes }
    }

    /// Returns which objects can stand for the parameters of an action.
    pub fn fitting(&self, action: &Action) -> Fitting {
        let one = |trajectory: &Trajectory| {
            let fits = |wanted: &Typed| {
                let objects = 0..trajectory.objects.len();
                objects.map(|o| trajectory.object_is(self.domain, o, &wanted.types)).collect()
            };
            action.parameters.iter().map(fits).collect()
        };
        Fitting(self.trajectories.iter().map(one).collect())
    }

    /// Returns the share of atoms of this kind that are true, over all states.
    fn share(&self, fitting: &Fitting, bound: &Bound) -> f64 {
        let (mut facts, mut all) = (0.0, 0.0);
        let mut sizes = BTreeMap::new();
        for state in &self.states {
            all += *sizes.entry(state.trajectory).or_insert_with(|| {
                let objects = 0..self.trajectories[state.trajectory].objects.len();
                let number = |slot: &Slot| {
                    let fits = |o: &usize| fitting.fits(state.trajectory, *slot, *o);
                    objects.clone().filter(fits).count() as f64
                };
                bound.slots.iter().map(number).product::<f64>()
            });
            let fits = |fact: &&&GroundAtom| fitting.all_fit(state.trajectory, bound, fact);
            facts += state.of(bound.predicate).iter().filter(fits).count() as f64;
        }
        if all > 0.0 { (facts / all).min(1.0) } else { 0.0 }
    }

    /// Returns for how many different objects it was seen that `from` implies `to` (or excludes it, if `positive` is
    /// false), or `None` if there is a counterexample. Parameters of `to` alone stand for any other object.
    fn follows(
        &self,
        fitting: &Fitting,
        from: &Bound,
        to: &Bound,
        positive: bool,
    ) -> Option<usize> {
        let bound_by = |slot: &Slot| from.slots.iter().position(|s| s == slot);
        let shared: Vec<Option<usize>> = to.slots.iter().map(bound_by).collect();
        if positive && shared.iter().any(Option::is_none) {
            return None;
        }
        let whole: Option<Vec<usize>> = shared.iter().copied().collect();
        let mut instances = BTreeSet::new();
        for state in &self.states {
            for source in state.of(from.predicate) {
                if !fitting.all_fit(state.trajectory, from, source) {
                    continue;
                }
                let found = match &whole {
                    Some(places) => {
                        let arguments = places.iter().map(|at| source.arguments[*at]).collect();
                        state.facts.contains(&GroundAtom { predicate: to.predicate, arguments })
                    }
                    None => state.of(to.predicate).iter().any(|target| {
                        fitting.agree(state.trajectory, (source, target), (&to.slots, &shared))
                    }),
                };
                if found != positive {
                    return None;
                }
                instances.insert((state.trajectory, &source.arguments));
            }
        }
        Some(instances.len())
    }
}

/// The evidence on one action.
pub(super) struct Weighing<'a> {
    pub observed: &'a Observed<'a>,
    pub fitting: Fitting,
    pub vocabulary: &'a [Bound],
    pub seen: &'a [Seen<'a>],
    pub refused: &'a [Seen<'a>],
    pub effects: &'a Effects,
}

impl Weighing<'_> {
    /// Weighs the literals that held before every step.
    pub fn weigh(&self, held: &[Candidate]) -> Vec<Precondition> {
        let mut out: BTreeSet<Candidate> = BTreeSet::new();
        let mut weighed = Vec::new();
        for candidate in held {
            let (kept, reason) = self.one(*candidate, held, &out);
            if !kept {
                out.insert(*candidate);
            }
            weighed.push(Precondition { literal: self.literal(*candidate), kept, reason });
        }
        weighed
    }

    fn literal(&self, candidate: Candidate) -> Literal {
        candidate.literal(self.observed.domain, self.vocabulary)
    }

    fn one(
        &self,
        literal: Candidate,
        held: &[Candidate],
        out: &BTreeSet<Candidate>,
    ) -> (bool, Reason) {
        let refusals = self.refusals(literal, held);
        if refusals > 0 {
            return (true, Reason::Refused { steps: refusals });
        }
        if literal.positive && self.effects.delete.contains(&literal.index) {
            return (true, Reason::Changed);
        }
        if let Some((other, reason)) = self.redundant(literal, held, out) {
            let kept = match reason {
                _ if !literal.positive => false,
                Reason::SameAs { .. } => self.predicate(other) != self.predicate(literal),
                _ => !self.is_invariant(literal, held, out),
            };
            return (kept, reason);
        }
        let (chance, instances) = self.chance(literal);
        match chance <= MAX_CHANCE {
            true => (true, Reason::Selective { chance, instances }),
            false => (literal.positive, Reason::Chance { chance, instances }),
        }
    }

    /// Returns the number of refused steps before which this literal alone did not hold.
    fn refusals(&self, literal: Candidate, held: &[Candidate]) -> usize {
        let false_in =
            |step: &Seen<'_>, c: &Candidate| !step.holds(&self.vocabulary[c.index], c.positive);
        let alone = |step: &&Seen<'_>| {
            let mut wrong = held.iter().filter(|c| false_in(step, c));
            wrong.next() == Some(&literal) && wrong.next().is_none()
        };
        self.refused.iter().filter(alone).count()
    }

    fn predicate(&self, literal: Candidate) -> usize {
        self.vocabulary[literal.index].predicate
    }

    /// Returns whether a literal that follows from another one is an invariant and no condition of this action.
    fn is_invariant(
        &self,
        literal: Candidate,
        held: &[Candidate],
        out: &BTreeSet<Candidate>,
    ) -> bool {
        let predicate = self.predicate(literal);
        if self.observed.changes[predicate] {
            let mut effects = self.effects.add.iter().chain(&self.effects.delete);
            return effects.all(|index| self.vocabulary[*index].predicate != predicate);
        }
        let mut others = held.iter().filter(|c| c.positive && **c != literal && !out.contains(c));
        others.any(|c| self.predicate(*c) == predicate && self.redundant(*c, held, out).is_none())
    }

    /// Returns a positive literal that was not left out before and says as much as a literal, and why: the literal follows
    /// from that one, or both follow from each other. Of the same predicate with other arguments, only the later one is redundant.
    fn redundant(
        &self,
        literal: Candidate,
        held: &[Candidate],
        out: &BTreeSet<Candidate>,
    ) -> Option<(Candidate, Reason)> {
        let to = &self.vocabulary[literal.index];
        let positive = held.iter().filter(|c| c.positive).count();
        if held.len() * positive > MAX_PAIRS {
            return None;
        }
        let mut best = None;
        let same = |other: Candidate, instances| {
            (other, Reason::SameAs { other: self.literal(other), instances })
        };
        for other in held.iter().filter(|c| c.positive && **c != literal && !out.contains(c)) {
            let from = &self.vocabulary[other.index];
            let found = self.observed.follows(&self.fitting, from, to, literal.positive);
            let Some(instances) = found.filter(|n| *n >= MIN_INSTANCES) else { continue };
            let back =
                literal.positive && self.observed.follows(&self.fitting, to, from, true).is_some();
            if !back {
                let from = || Reason::Follows { from: self.literal(*other), instances };
                best.get_or_insert_with(|| (*other, from()));
            } else if from.predicate != to.predicate {
                best.get_or_insert_with(|| same(*other, instances));
            } else if from.slots < to.slots {
                return Some(same(*other, instances));
            }
        }
        best
    }

    /// Returns the probability that the literal held before every step by chance, and the number of different objects
    /// for which it held.
    fn chance(&self, literal: Candidate) -> (f64, usize) {
        let bound = &self.vocabulary[literal.index];
        let share = self.observed.share(&self.fitting, bound);
        let share = if literal.positive { share } else { 1.0 - share };
        // An atom without arguments has no other objects: each step counts.
        let instances = match bound.parameters().next() {
            None => self.seen.len(),
            Some(_) => {
                let ground = |s: &Seen<'_>| (s.trajectory, bound.ground(s.arguments));
                self.seen.iter().map(ground).collect::<BTreeSet<_>>().len()
            }
        };
        (share.powi(i32::try_from(instances).unwrap_or(i32::MAX)), instances)
    }
}
