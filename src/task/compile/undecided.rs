//! Which undecided needs are in force: those that can be met, alone and together.

use std::collections::BTreeSet;

use super::moves::Move;
use super::problem::{Problem, ProblemError};
use super::reference_planner::{InForce, Undecided};
use crate::task::domain::{Fact, Situation};

/// Greatest number of situations that each search for needs that hold together generates, and all of them.
const MOST: usize = 5_000;
const MOST_IN_ALL: usize = 100_000;
/// Greatest number of choices of one size that are tried.
const MOST_CHOICES: usize = 2_000;

impl Problem<'_> {
    /// Returns the problem with those undecided needs in force that can be met from a situation.
    pub(crate) fn starting_from(&self, start: &Situation) -> Self {
        let mut own = self.clone();
        own.choose_undecided(start);
        own
    }

    /// Puts those undecided needs in force that can be met, judged by reachability without deletions.
    pub(super) fn choose_undecided(&mut self, start: &Situation) {
        let mut reached: BTreeSet<(usize, Fact)> =
            start.iter().enumerate().filter_map(|(i, f)| Some((i, (*f)?))).collect();
        loop {
            let before = reached.len();
            for m in self.relaxed_moves(&reached) {
                let operator = &self.domain.operators[m.operator];
                reached.insert((m.object, m.result(operator)));
                for effect in operator.side_effects.iter().filter(|e| e.begins) {
                    let state = effect.condition.state;
                    let kind = &self.domain.states[state].kind;
                    for i in self.of_kind(kind) {
                        reached.insert((i, Fact { state, place: 0, reference: None }));
                    }
                }
            }
            if reached.len() == before {
                break;
            }
        }
        let can_be_met = |(o, n): &(usize, usize)| {
            let need = &self.domain.operators[*o].needs[*n];
            let counts = |f: &Fact| need.states().any(|state| state == f.state);
            let objects: BTreeSet<usize> =
                reached.iter().filter(|(_, f)| counts(f)).map(|(i, _)| *i).collect();
            let of = |i: &usize| {
                need.states().any(|s| self.domain.states[s].kind == *self.objects[*i].kind)
            };
            let present = (0..self.objects.len()).filter(of).count();
            !need.holds || objects.len() >= need.least_of(present)
        };
        self.in_force = self.undecided().filter(can_be_met).collect();
    }

    /// Returns the moves that are possible if facts only accumulate. Only the state that the object leaves is checked.
    fn relaxed_moves(&self, reached: &BTreeSet<(usize, Fact)>) -> Vec<Move> {
        let mut moves = Vec::new();
        for (o, operator) in self.domain.operators.iter().enumerate() {
            for object in self.of_kind(&self.domain.states[operator.to].kind) {
                let from = |f: &(usize, Fact)| f.0 == object && operator.from.contains(&f.1.state);
                if !reached.iter().any(from) {
                    continue;
                }
                let targets = self.targets(o, Some(object)).into_iter();
                moves.extend(targets.map(|(reference, place)| Move {
                    operator: o,
                    object,
                    reference,
                    place,
                }));
            }
        }
        moves
    }

    /// Returns the undecided needs in force that some plan from `now` meets together. Of those that no plan meets together, as
    /// few as possible are left out, and of several choices those with the least evidence.
    ///
    /// Needs that forbid each other's states can each be met alone: the fork before the knife, and the knife before the
    /// fork. If no plan meets all, a search that counts each unmet need says how many must be left out at most. Then smaller
    /// and weaker choices are tried, in this order. A search that is given up shows nothing, so the needs stay; so does a
    /// choice that takes too long to improve.
    pub(super) fn together(&self, now: &Situation) -> BTreeSet<Undecided> {
        let all = &self.in_force;
        let met = |needs: &BTreeSet<Undecided>, left: &mut usize| {
            let mut most = MOST.min(*left);
            let before = most;
            let found = self.search(now, &[], InForce::Met(needs), &mut most);
            *left -= before - most;
            found.map(|_| ())
        };
        let mut left = MOST_IN_ALL;
        if all.is_empty() || met(all, &mut left) != Err(ProblemError::NoPlan) {
            return all.clone();
        }
        let counted = self.search(now, &[], InForce::Counted(all), &mut { MOST });
        let Ok((_, unmet)) = counted else { return all.clone() };
        let evidence = |(o, n): &Undecided| self.domain.operators[*o].needs[*n].of;
        let without =
            |out: &[Undecided]| all.iter().filter(|n| !out.contains(n)).copied().collect();
        let known = (unmet.len(), unmet.iter().map(evidence).sum::<usize>());
        let mut needs: Vec<Undecided> = all.iter().copied().collect();
        needs.sort_by_key(|need| (evidence(need), *need));
        for size in 1..=unmet.len() {
            let mut choices = choices(&needs, size);
            let weight = |choice: &[Undecided]| choice.iter().map(evidence).sum::<usize>();
            choices.sort_by_key(|choice| weight(choice));
            for choice in choices.iter().filter(|c| (size, weight(c)) < known) {
                let kept = without(choice);
                if met(&kept, &mut left).is_ok() {
                    return kept;
                }
            }
        }
        // What the search left unmet is the best that is known. Some of it may be met after all.
        let mut kept = without(&unmet.iter().copied().collect::<Vec<_>>());
        for need in needs.iter().rev().filter(|need| unmet.contains(need)) {
            kept.insert(*need);
            if met(&kept, &mut left).is_err() {
                kept.remove(need);
            }
        }
        kept
    }
}

/// Returns all choices of so many needs; of more than [`MOST_CHOICES`], none.
fn choices(needs: &[Undecided], size: usize) -> Vec<Vec<Undecided>> {
    let mut all = vec![Vec::new()];
    for _ in 0..size {
        let longer = all.iter().flat_map(|choice: &Vec<Undecided>| {
            let from = choice.last().and_then(|last| needs.iter().position(|n| n == last));
            let rest = &needs[from.map_or(0, |from| from + 1)..];
            rest.iter().map(move |need| choice.iter().chain([need]).copied().collect())
        });
        all = longer.take(MOST_CHOICES + 1).collect();
    }
    if all.len() > MOST_CHOICES { Vec::new() } else { all }
}
