//! The reference planner: plain symbolic search that says which answers are right.
//!
//! What is right is defined here once, and the planner graph is tested against it. Let `W` be the states that
//! hold and `g` the goal. A state outside `W` may have several causes ([`Domain::causes`]). An action *can be
//! done* if all its preconditions are in `W` and (where absence is asked for) nothing that holds must be absent.
//!
//! * If `g` is in `W`, the goal is met.
//! * The *derivable* states are the least set of states outside `W` that have a cause which can be done, or
//!   one with some precondition outside `W` and all of those derivable. If `g` is not derivable, the goal is
//!   stuck. Then every obstacle on a way down from `g` through states that are not derivable is right to report:
//!   a state without causes; a cause whose preconditions all hold but which needs the absence of a state that
//!   holds; a state that leads back to itself.
//! * If `g` is derivable, a *proof* of `g` takes one cause for each state needed, without circles. An action is a
//!   right next action if it can be done and belongs to some proof.
//!
//! That is commitment [`Proven`](Commitment::Proven). With [`First`](Commitment::First), the paper's rule, a
//! planner follows one unmet precondition and acts as soon as an action can be done, whatever stands in the way of
//! others. Then every action that can be done and lies on some way down from `g` is right as well.

use std::collections::{BTreeSet, HashSet};

use super::ids::{ActionId, StateId};
use super::verdict::{Commitment, Obstacle, Rules, Verdict};
use super::world::WorldState;
use crate::task::domain::Domain;

/// All that a right planner may answer to one question.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct AcceptableAnswers {
    /// Whether the goal holds already; then nothing else is right.
    pub met: bool,
    /// Actions that are right to do next.
    pub actions: BTreeSet<ActionId>,
    /// Obstacles that are right to report.
    pub obstacles: BTreeSet<Obstacle>,
}

impl AcceptableAnswers {
    /// Whether this answer is among them.
    pub fn accepts(&self, verdict: Verdict) -> bool {
        match verdict {
            Verdict::Met => self.met,
            Verdict::Act(action) => !self.met && self.actions.contains(&action),
            Verdict::Stuck(why) => !self.met && self.obstacles.contains(&why),
        }
    }
}

/// The right answers for `goal` in `world`. Where no states depend on each other in a circle the cost is
/// polynomial in states and actions; circles of alternatives can make it exponential in their size.
///
/// # Panics
/// If `world` does not cover the domain's states, or `goal` is none of them.
pub fn acceptable_answers(
    domain: &Domain,
    world: &WorldState,
    goal: StateId,
    rules: Rules,
) -> AcceptableAnswers {
    assert_eq!(world.states(), domain.states().len(), "a world of this domain");
    assert!(goal.index() < world.states(), "the goal is a state");
    if world.holds(goal) {
        return AcceptableAnswers { met: true, ..AcceptableAnswers::default() };
    }
    let search = Search { domain, world, rules };
    let derivable = search.derivable(&[]);
    let mut found = AcceptableAnswers::default();
    if !derivable.contains(&goal) {
        found.obstacles = search.obstacles(goal, &derivable);
    }
    found.actions = match rules.commitment {
        Commitment::First => search.first_actions(goal),
        Commitment::Proven if derivable.contains(&goal) => search.proven_actions(goal),
        Commitment::Proven => BTreeSet::new(),
    };
    found
}

struct Search<'d> {
    domain: &'d Domain,
    world: &'d WorldState,
    rules: Rules,
}

impl Search<'_> {
    /// The preconditions of an action that do not hold.
    fn unmet(&self, action: ActionId) -> impl Iterator<Item = StateId> + '_ {
        let needed = self.domain[action].preconditions.iter();
        needed.copied().filter(|p| !self.world.holds(*p))
    }

    /// The states that hold and must be absent before an action.
    fn violated(&self, action: ActionId) -> impl Iterator<Item = StateId> + '_ {
        let absent = self.domain[action].absent.iter().filter(|_| self.rules.absent);
        absent.copied().filter(|s| self.world.holds(*s))
    }

    fn can_be_done(&self, action: ActionId) -> bool {
        self.unmet(action).next().is_none() && self.violated(action).next().is_none()
    }

    /// The states that can be brought about without bringing about any of `without`.
    fn derivable(&self, without: &[StateId]) -> BTreeSet<StateId> {
        let mut derivable = BTreeSet::new();
        loop {
            let before = derivable.len();
            for state in self.domain.state_ids() {
                let wanted = !self.world.holds(state) && !without.contains(&state);
                let proves = |action: &ActionId| {
                    let mut unmet = self.unmet(*action).peekable();
                    match unmet.peek() {
                        None => self.can_be_done(*action),
                        Some(_) => unmet.all(|p| derivable.contains(&p)),
                    }
                };
                if wanted && self.domain.causes(state).iter().any(proves) {
                    derivable.insert(state);
                }
            }
            if derivable.len() == before {
                return derivable;
            }
        }
    }

    /// The states that `from` leads to by one or more steps to unmet preconditions, through states that `keep`
    /// takes.
    fn below(&self, from: StateId, keep: &dyn Fn(StateId) -> bool) -> BTreeSet<StateId> {
        let mut below = BTreeSet::new();
        let mut open = vec![from];
        while let Some(state) = open.pop() {
            for action in self.domain.causes(state) {
                for unmet in self.unmet(*action).filter(|s| keep(*s)) {
                    if below.insert(unmet) {
                        open.push(unmet);
                    }
                }
            }
        }
        below
    }

    fn obstacles(&self, goal: StateId, derivable: &BTreeSet<StateId>) -> BTreeSet<Obstacle> {
        let blocked = |state: StateId| !derivable.contains(&state);
        let mut obstacles = BTreeSet::new();
        for state in self.below(goal, &blocked).into_iter().chain([goal]) {
            let causes = self.domain.causes(state);
            if causes.is_empty() {
                obstacles.insert(Obstacle::NothingCauses { state });
            }
            if self.below(state, &blocked).contains(&state) {
                obstacles.insert(Obstacle::NeedsItself { state });
            }
            for action in causes.iter().filter(|a| self.unmet(**a).next().is_none()) {
                for state in self.violated(*action) {
                    obstacles.insert(Obstacle::MustBeAbsent { action: *action, state });
                }
            }
        }
        obstacles
    }

    fn first_actions(&self, goal: StateId) -> BTreeSet<ActionId> {
        let ways = self.below(goal, &|_| true).into_iter().chain([goal]);
        let causes = ways.flat_map(|state| self.domain.causes(state).iter().copied());
        causes.filter(|action| self.can_be_done(*action)).collect()
    }

    fn proven_actions(&self, goal: StateId) -> BTreeSet<ActionId> {
        let below = self.domain.state_ids().map(|s| self.below(s, &|_| true)).collect();
        let mut proofs =
            Proofs { search: self, below, visited: HashSet::new(), actions: BTreeSet::new() };
        proofs.visit(goal, &mut Vec::new());
        proofs.actions
    }
}

/// Walks down from the goal along all proofs.
///
/// A cause belongs to a proof if its unmet preconditions are derivable without the states on the way down to
/// it: proofs have no circles.
struct Proofs<'s, 'd> {
    search: &'s Search<'d>,
    below: Vec<BTreeSet<StateId>>,
    /// States visited, with those states of the way there that they could lead back to: no others matter.
    visited: HashSet<(StateId, Vec<StateId>)>,
    actions: BTreeSet<ActionId>,
}

impl Proofs<'_, '_> {
    fn visit(&mut self, state: StateId, way: &mut Vec<StateId>) {
        let below = &self.below[state.index()];
        let mut matter: Vec<StateId> = way.iter().copied().filter(|s| below.contains(s)).collect();
        matter.sort_unstable();
        if !self.visited.insert((state, matter)) {
            return;
        }
        way.push(state);
        let derivable = self.search.derivable(way);
        for action in self.search.domain.causes(state) {
            let unmet: Vec<StateId> = self.search.unmet(*action).collect();
            if self.search.can_be_done(*action) {
                self.actions.insert(*action);
            } else if unmet.iter().all(|p| derivable.contains(p)) {
                for precondition in unmet {
                    self.visit(precondition, way);
                }
            }
        }
        way.pop();
    }
}
