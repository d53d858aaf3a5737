//! Which undecided needs are in force: those that can be met, alone and together.

use std::collections::BTreeSet;

use super::moves::Move;
use super::problem::{Problem, ProblemError};
use super::reference_planner::{InForce, Undecided};
use crate::task::domain::{Fact, Situation};

/// Greatest number of situations that each search for needs that hold together generates.
const MOST: usize = 5_000;

impl Problem<'_> {
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
        let count = |state: usize| {
            let objects: BTreeSet<usize> =
                reached.iter().filter(|(_, f)| f.state == state).map(|(i, _)| *i).collect();
            objects.len()
        };
        let can_be_met = |(o, n): &(usize, usize)| {
            let need = &self.domain.operators[*o].needs[*n];
            !need.holds || count(need.condition.state) >= need.least
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

    /// Returns the undecided needs in force that some plan from `now` meets together. Of those that no plan meets together,
    /// as few are left out as a greedy search finds, those with the least evidence first.
    ///
    /// Needs that forbid each other's states can each be met alone: the fork before the knife, and the knife before the
    /// fork. If no plan meets all, a search counts each need that it leaves unmet. Then each of these is taken back, those with the most
    /// evidence first, if there is still a plan. A search that is given up shows nothing, so the needs stay.
    pub(super) fn together(&self, now: &Situation) -> BTreeSet<Undecided> {
        let all = &self.in_force;
        let search = |needs: InForce<'_>| self.search(now, &[], needs, MOST);
        if all.is_empty() || !matches!(search(InForce::Met(all)), Err(ProblemError::NoPlan)) {
            return all.clone();
        }
        let Ok((_, unmet)) = search(InForce::Counted(all)) else { return all.clone() };
        let mut kept: BTreeSet<Undecided> = all.difference(&unmet).copied().collect();
        let evidence = |(o, n): &Undecided| self.domain.operators[*o].needs[*n].of;
        let mut back: Vec<Undecided> = unmet.into_iter().collect();
        back.sort_by_key(|need| (std::cmp::Reverse(evidence(need)), *need));
        for need in back {
            kept.insert(need);
            if search(InForce::Met(&kept)).is_err() {
                kept.remove(&need);
            }
        }
        kept
    }
}
