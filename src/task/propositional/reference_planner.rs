//! The reference planner: a symbolic search that determines which answers are correct.
//!
//! The planner graph is tested against the reference planner. [`acceptable_answers`] defines which answers are correct.

use std::collections::{BTreeSet, HashSet};

use super::Domain;
use super::ids::{ActionId, StateId};
use super::verdict::{Commitment, Obstacle, Rules, Verdict};
use super::world::WorldState;

/// All correct answers for one goal in one world state.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct AcceptableAnswers {
    /// Whether the goal already holds. If so, the only correct answer is [`Verdict::Met`].
    pub met: bool,
    /// Correct next actions.
    pub actions: BTreeSet<ActionId>,
    /// Correct obstacles to report.
    pub obstacles: BTreeSet<Obstacle>,
}

impl AcceptableAnswers {
    /// Returns whether `verdict` is correct.
    pub fn accepts(&self, verdict: Verdict) -> bool {
        match verdict {
            Verdict::Met => self.met,
            Verdict::Act(action) => !self.met && self.actions.contains(&action),
            Verdict::Stuck(why) => !self.met && self.obstacles.contains(&why),
        }
    }
}

/// Returns all correct answers for `goal` in `world`.
///
/// This is the reference planner, a symbolic search against which the planner graph is tested. It defines correct
/// answers as follows, where `W` is the set of states that hold and `g` is the goal. A precondition is *unmet* if it is
/// not in `W`. An action *can be done* if it has no unmet precondition and, with [`Rules::absent`] set, none of the
/// states that must be absent is in `W`.
///
/// * **Met.** If `g` is in `W`, the only correct answer is that the goal is met.
/// * **Derivable.** A state outside `W` is *derivable* if it has a cause that can be done, or a cause with unmet
///   preconditions that are all derivable. The derivable states are the smallest set with this property.
/// * **Act.** If `g` is derivable, a *proof* of `g` selects one cause for each state that has to be reached, without
///   cycles. An action is correct if it can be done and belongs to a proof.
/// * **Stuck.** If `g` is not derivable, the correct answer is an obstacle. Start at `g` and step from a state to the
///   unmet preconditions of its causes, entering only states that are not derivable. Every obstacle on the way is
///   correct: a state without causes, a state that leads back to itself, or a cause that has no unmet precondition but
///   requires a state in `W` to be absent.
///
/// These rules are for [`Commitment::Proven`]. With [`Commitment::First`], the paper's rule, a planner follows one
/// unmet precondition at a time and commits to the first action that can be done, even if other preconditions cannot
/// be reached. In that case, every action that can be done and is a cause of `g`, or of a state reached from `g`
/// through unmet preconditions, is correct as well.
///
/// # Cost
/// The cost is polynomial in the number of states and actions if no states depend on each other in a cycle. If states
/// with several causes form cycles, the cost can be exponential in the size of the cycles.
///
/// # Panics
/// If `world` does not have as many states as `domain`, or if `goal` is out of range.
pub fn acceptable_answers(
    domain: &Domain,
    world: &WorldState,
    goal: StateId,
    rules: Rules,
) -> AcceptableAnswers {
    assert_eq!(world.states(), domain.states().len(), "a world state of this domain");
    assert!(goal.index() < world.states(), "the goal is a state of this domain");
    if world.holds(goal) {
        return AcceptableAnswers { met: true, ..AcceptableAnswers::default() };
    }
    let search = Search { domain, world, rules };
    let derivable = search.derivable(&[]);
    let obstacles = search.obstacles(goal, &derivable);
    let actions = match rules.commitment {
        Commitment::First => search.first_actions(goal),
        Commitment::Proven if derivable.contains(&goal) => search.proven_actions(goal),
        Commitment::Proven => BTreeSet::new(),
    };
    AcceptableAnswers { obstacles, actions, ..AcceptableAnswers::default() }
}

/// Returns the reasons why a goal cannot be reached, even if no action ended a state. Empty if it can, or holds.
/// [`Rules::commitment`] has no effect.
pub(crate) fn obstacles(
    domain: &Domain,
    world: &WorldState,
    goal: StateId,
    rules: Rules,
) -> BTreeSet<Obstacle> {
    let search = Search { domain, world, rules };
    search.obstacles(goal, &search.derivable(&[]))
}

struct Search<'d> {
    domain: &'d Domain,
    world: &'d WorldState,
    rules: Rules,
}

impl Search<'_> {
    /// Preconditions of `action` that do not hold.
    fn unmet(&self, action: ActionId) -> impl Iterator<Item = StateId> + '_ {
        let needed = self.domain[action].preconditions.iter();
        needed.copied().filter(|p| !self.world.holds(*p))
    }

    /// States that hold and must be absent before `action`.
    fn violated(&self, action: ActionId) -> impl Iterator<Item = StateId> + '_ {
        let absent = self.domain[action].absent.iter().filter(|_| self.rules.absent);
        absent.copied().filter(|s| self.world.holds(*s))
    }

    fn can_be_done(&self, action: ActionId) -> bool {
        self.unmet(action).next().is_none() && self.violated(action).next().is_none()
    }

    /// States that are derivable without deriving any of `without`.
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

    /// States that are reached from `from` in one or more steps, each from a state to an unmet precondition of one of
    /// its causes. Only states that satisfy `keep` are entered.
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
        if self.world.holds(goal) || derivable.contains(&goal) {
            return BTreeSet::new();
        }
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
/// A proof has no cycles. A cause therefore belongs to a proof only if its unmet preconditions are derivable without
/// the states on the path from the goal to the cause.
struct Proofs<'s, 'd> {
    search: &'s Search<'d>,
    below: Vec<BTreeSet<StateId>>,
    /// Visited states, each with the states of its path that it can lead back to. The rest of the path does not matter.
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
