//! The reference planner: searches forwards over situations.
//!
//! The search is a greedy best-first search. It expands the situation that lacks the least of the goal, and among
//! equals the one with the fewest moves. Objects of a kind that is nobody's reference are interchangeable, so
//! situations that differ only in their exchange count once.
//!
//! If no plan meets the undecided needs that are in force, the planner searches again for one that leaves few of them
//! unmet. A search that is given up shows nothing, so the needs stay.

use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap, HashSet};
use std::rc::Rc;

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

/// An undecided need: operator and need.
pub(super) type Undecided = (usize, usize);

struct Node {
    situation: Situation,
    from: Option<(usize, Move)>,
    /// The needs in force that the moves so far left unmet.
    unmet: Rc<BTreeSet<Undecided>>,
}

/// How a search treats the undecided needs that are in force.
#[derive(Clone, Copy)]
pub(super) enum InForce<'n> {
    /// Every move meets these.
    Met(&'n BTreeSet<Undecided>),
    /// Each of these that some move leaves unmet counts as much as one object that the goal lacks.
    Counted(&'n BTreeSet<Undecided>),
}

impl Problem<'_> {
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
        let needs = &self.in_force;
        let moves = match self.search(start, avoid, InForce::Met(needs), &mut { MOST }) {
            Err(ProblemError::NoPlan) => {
                self.search(start, avoid, InForce::Counted(needs), &mut { MOST })?.0
            }
            found => found?.0,
        };
        let mut situation = start.clone();
        let mut plan = Vec::with_capacity(moves.len());
        for action in moves {
            plan.push(PlannedMove { action, decided: self.decided(&action, &situation) });
            situation = self.after(&action, &situation);
        }
        Ok(plan)
    }

    /// Searches for a plan, and returns it with the needs that it leaves unmet. Generates at most `left` situations, and
    /// leaves there how many are left.
    pub(super) fn search(
        &self,
        start: &Situation,
        avoid: &[usize],
        needs: InForce<'_>,
        left: &mut usize,
    ) -> Result<(Vec<Move>, BTreeSet<Undecided>), ProblemError> {
        let evidence = |unmet: &BTreeSet<Undecided>| -> usize {
            unmet.iter().map(|(o, n)| self.domain.operators[*o].needs[*n].of).sum()
        };
        let first = Node { situation: start.clone(), from: None, unmet: Rc::default() };
        let mut nodes = vec![first];
        let mut visited: HashSet<Vec<Key>> = HashSet::from([self.key(start)]);
        let lacking = self.lacking(start);
        let mut open = BinaryHeap::from([Reverse((lacking, 0, lacking, 0, 0))]);
        while let Some(Reverse((.., lacking, depth, index))) = open.pop() {
            if lacking == 0 {
                return Ok((self.path(&nodes, index), nodes[index].unmet.as_ref().clone()));
            }
            if *left == 0 {
                return Err(ProblemError::GivenUp { situations: nodes.len() });
            }
            let situation = nodes[index].situation.clone();
            let mut moves = self.moves(&situation);
            match needs {
                InForce::Met(needs) => {
                    moves.retain(|m| self.unmet(m, &situation, needs).next().is_none());
                }
                // Another way to the same situation may leave fewer unmet, so it is closed when its best way is known.
                InForce::Counted(_) if index > 0 && !visited.insert(self.key(&situation)) => {
                    continue;
                }
                InForce::Counted(_) => {}
            }
            // Objects to avoid come last, so an exchangeable object comes first.
            moves.sort_by_key(|m| (avoid.contains(&m.object), *m));
            for m in moves {
                let next = self.after(&m, &situation);
                let known = match needs {
                    InForce::Met(_) => !visited.insert(self.key(&next)),
                    InForce::Counted(_) => visited.contains(&self.key(&next)),
                };
                if known {
                    continue;
                }
                let mut unmet = nodes[index].unmet.clone();
                if let InForce::Counted(needs) = needs {
                    for need in self.unmet(&m, &situation, needs) {
                        if !unmet.contains(&need) {
                            Rc::make_mut(&mut unmet).insert(need);
                        }
                    }
                }
                let lacking = self.lacking(&next);
                let rank =
                    (lacking + unmet.len(), evidence(&unmet), lacking, depth + 1, nodes.len());
                nodes.push(Node { situation: next, from: Some((index, m)), unmet });
                *left = left.saturating_sub(1);
                open.push(Reverse(rank));
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
    pub(crate) fn key(&self, situation: &Situation) -> Vec<Key> {
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

pub(crate) type Key = (usize, Option<Fact>);
