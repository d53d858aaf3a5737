//! The reference planner: searches forwards over situations.
//!
//! The search is a greedy best-first search. It expands the situation that lacks the least of the goal, and among
//! equals the one with the fewest moves. Objects of a kind that is nobody's reference are interchangeable, so
//! situations that differ only in their exchange count once.
//!
//! Undecided needs are in force if relaxed reachability shows that they can be met. If no plan exists with them, the
//! planner searches again without any. A search that is given up shows nothing, so the needs stay.

use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap, HashSet};

use super::moves::Move;
use super::problem::{Problem, ProblemError};
use crate::task::domain::{Fact, Situation};

/// A move of a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PlannedMove {
    /// The move.
    pub action: Move,
    /// Whether all undecided needs are met when the move is due.
    pub decided: bool,
}

/// Greatest number of situations that a search generates.
const MOST: usize = 20_000;

struct Node {
    situation: Situation,
    from: Option<(usize, Move)>,
}

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

    /// Returns a plan from `start` to the goal: empty if the goal holds. Objects in `avoid` are moved only if no other object
    /// will do. Undecided needs that are in force are met if there is such a plan.
    ///
    /// # Errors
    /// [`ProblemError::NoPlan`] if there is none; [`ProblemError::GivenUp`] if a search generates too many situations.
    pub fn plan(
        &self,
        start: &Situation,
        avoid: &[usize],
    ) -> Result<Vec<PlannedMove>, ProblemError> {
        let moves = match self.search(start, avoid, true) {
            Err(ProblemError::NoPlan) => self.search(start, avoid, false)?,
            found => found?,
        };
        let mut situation = start.clone();
        let mut plan = Vec::with_capacity(moves.len());
        for action in moves {
            plan.push(PlannedMove { action, decided: self.decided(&action, &situation) });
            situation = self.after(&action, &situation);
        }
        Ok(plan)
    }

    fn search(
        &self,
        start: &Situation,
        avoid: &[usize],
        strict: bool,
    ) -> Result<Vec<Move>, ProblemError> {
        let mut nodes = vec![Node { situation: start.clone(), from: None }];
        let mut visited: HashSet<Vec<Key>> = HashSet::from([self.key(start)]);
        let mut open = BinaryHeap::from([Reverse((self.lacking(start), 0, 0))]);
        while let Some(Reverse((lacking, depth, index))) = open.pop() {
            if lacking == 0 {
                return Ok(self.path(&nodes, index));
            }
            if nodes.len() > MOST {
                return Err(ProblemError::GivenUp { situations: nodes.len() });
            }
            let situation = nodes[index].situation.clone();
            let mut moves = self.moves(&situation);
            if strict {
                moves.retain(|m| self.permitted(m, &situation));
            }
            // Objects to avoid come last, so an exchangeable object comes first.
            moves.sort_by_key(|m| (avoid.contains(&m.object), *m));
            for m in moves {
                let next = self.after(&m, &situation);
                if !visited.insert(self.key(&next)) {
                    continue;
                }
                let lacking = self.lacking(&next);
                nodes.push(Node { situation: next, from: Some((index, m)) });
                open.push(Reverse((lacking, depth + 1, nodes.len() - 1)));
            }
        }
        Err(ProblemError::NoPlan)
    }

    fn path(&self, nodes: &[Node], mut index: usize) -> Vec<Move> {
        let mut moves = Vec::new();
        while let Some((from, m)) = nodes[index].from {
            moves.push(m);
            index = from;
        }
        moves.reverse();
        moves
    }

    /// Returns a key under which situations that differ only by an exchange of like objects are equal.
    fn key(&self, situation: &Situation) -> Vec<Key> {
        let mut keys: Vec<Key> = situation
            .iter()
            .enumerate()
            .map(|(i, fact)| {
                let kind = &self.objects[i].kind;
                let is_reference =
                    self.domain.states.iter().any(|s| s.frame.kind() == Some(&**kind));
                let first = self.of_kind(kind).next().unwrap_or(i);
                (if is_reference { i } else { first }, *fact)
            })
            .collect();
        keys.sort_unstable();
        keys
    }
}

type Key = (usize, Option<Fact>);
