//! Ground problems: a relational problem over the objects of one scene, as a propositional domain for the planner
//! graph.
//!
//! A ground **fact** is a test of a [`Situation`]: at least so many objects, or none, are in some states, relative to
//! some reference. A ground **action** is an operator with its target reference and its place, and with its object if
//! objects of the kind are told apart. Objects of a kind that is nobody's reference are interchangeable, so there is
//! one action for all of them.
//!
//! The preconditions of a ground action are facts: an object that can be moved, a free place, and the needs of the
//! operator. A need that must be absent is the fact that nothing is there. The actions that take an object away cause
//! this fact, so the planner graph moves what is in the way as a subgoal.
//!
//! A fact that asks for several objects is caused by every action that adds one of them. The planner graph is asked
//! again after each move, until the fact holds.
//!
//! Only the facts and actions from which a term of the goal can be reached are part of the ground problem.

use std::collections::BTreeSet;

use super::facts::{GroundAction, Test};
use super::moves::Move;
use super::problem::{Problem, ProblemError};
use crate::task::domain::{RelationalDomain, Situation, is_within};
use crate::task::error::TaskError;
use crate::task::propositional::{ActionId, Composition, Domain, Obstacle, StateId, WorldState};

/// A relational problem over one scene as a propositional domain.
///
/// [`Problem::ground`] builds it.
#[derive(Debug, Clone)]
pub struct GroundProblem {
    pub(super) domain: Domain,
    pub(super) composition: Composition,
    /// Id and name of each object.
    pub(super) objects: Vec<(String, String)>,
    /// Sentences of the facts and of the actions.
    pub(super) fact_words: Vec<String>,
    pub(super) action_words: Vec<String>,
    pub(super) tests: Vec<Test>,
    pub(super) actions: Vec<GroundAction>,
    /// The facts of each term of the goal, in order.
    pub(super) goals: Vec<StateId>,
    pub(super) dropped: BTreeSet<(usize, usize)>,
    /// For each action its preconditions that are undecided needs, with the index of the need.
    pub(super) undecided: Vec<Vec<(StateId, usize)>>,
    pub(super) exclusions: Vec<[StateId; 2]>,
}

impl GroundProblem {
    /// Returns the propositional domain: the ground facts as states, the ground actions as operators.
    pub fn domain(&self) -> &Domain {
        &self.domain
    }

    /// Returns the id and the name of each object of the problem, in their order. The name is for people: `cup 0`, or `the
    /// cup` for the only one of its kind.
    pub fn object_names(&self) -> impl Iterator<Item = (&str, &str)> {
        self.objects.iter().map(|(id, name)| (&**id, &**name))
    }

    /// Returns a fact as a sentence, such as `at least 4 chairs are at table 0`.
    ///
    /// # Panics
    /// If the fact is not a state of [`GroundProblem::domain`].
    pub fn fact_in_words(&self, fact: StateId) -> &str {
        &self.fact_words[fact.index()]
    }

    /// Returns an action as a sentence, such as `put a chair at table 0`.
    ///
    /// # Panics
    /// If the action is not one of [`GroundProblem::domain`].
    pub fn action_in_words(&self, action: ActionId) -> &str {
        &self.action_words[action.index()]
    }

    /// Returns the sentence of the fact or action of this symbol; `None` if it is neither.
    pub fn in_words(&self, symbol: &str) -> Option<&str> {
        let fact = self.domain.states().iter().position(|s| s.name == symbol);
        let action = || self.domain.operators().iter().position(|o| o.name == symbol);
        let words = fact.map(|fact| &self.fact_words[fact]);
        words.or_else(|| Some(&self.action_words[action()?])).map(String::as_str)
    }

    /// Returns whether a fact is one that only the planner needs: about one of the places of a state, such as that it is free, or
    /// about what is in the way. Learned conditions and the facts of the goal are not.
    ///
    /// # Panics
    /// If the fact is not a state of [`GroundProblem::domain`].
    pub fn is_planner_only(&self, fact: StateId) -> bool {
        let test = &self.tests[fact.index()];
        let exact = test.of.iter().any(|(_, place)| place.is_some());
        (exact || test.given) && !self.goals.contains(&fact)
    }

    /// Returns an obstacle in words.
    ///
    /// # Panics
    /// If the obstacle is about a fact or an action of another problem and its id is out of range.
    pub fn obstacle_in_words(&self, obstacle: Obstacle) -> String {
        let quoted = |words: &str| format!("\"{words}\"");
        let fact = |fact| quoted(self.fact_in_words(fact));
        obstacle.in_words(fact, |action| quoted(self.action_in_words(action)))
    }

    /// Returns the move's order in words, such as `put cup 0 in the drawer`.
    pub(crate) fn move_in_words(&self, m: &Move, of: &RelationalDomain) -> String {
        let name = |object: usize| self.objects.get(object).map(|(_, name)| name.as_str());
        of.move_in_words(&of.operators[m.operator], name(m.object), m.reference.and_then(name))
    }

    /// Returns what the pointers of the facts and actions are made of.
    pub fn composition(&self) -> &Composition {
        &self.composition
    }

    /// Returns the undecided needs that the planner graph does without, because they cannot be met or would put the goal
    /// out of reach, as pairs of operator and need.
    pub fn dropped(&self) -> &BTreeSet<(usize, usize)> {
        &self.dropped
    }

    /// Returns pairs of facts that hold together in no situation, reachable or not, because an object is in one state only.
    /// There may be more such pairs.
    pub fn exclusions(&self) -> &[[StateId; 2]] {
        &self.exclusions
    }

    /// Returns the preconditions of an action that are undecided needs of its operator: each as a fact, and the index of the need.
    ///
    /// # Panics
    /// If the action is not one of [`GroundProblem::domain`].
    pub fn undecided(&self, action: ActionId) -> &[(StateId, usize)] {
        &self.undecided[action.index()]
    }

    /// Returns the facts that hold in a situation.
    pub fn present(&self, situation: &Situation) -> WorldState {
        self.tests.iter().map(|test| test.holds(situation)).collect()
    }

    /// Returns whether a fact holds in a situation.
    ///
    /// # Panics
    /// If the fact is not a state of [`GroundProblem::domain`].
    pub fn holds(&self, fact: StateId, situation: &Situation) -> bool {
        self.tests[fact.index()].holds(situation)
    }

    /// Returns the objects that keep a fact from holding, each followed by its reference: they count, and the fact allows
    /// fewer. Empty if the fact holds or asks for objects.
    ///
    /// # Panics
    /// If the fact is not a state of [`GroundProblem::domain`].
    pub fn in_the_way(&self, fact: StateId, situation: &Situation) -> Vec<usize> {
        let test = &self.tests[fact.index()];
        if !test.forbids() || test.holds(situation) {
            return Vec::new();
        }
        test.matching(situation).flat_map(|(i, f)| [Some(i), f.reference]).flatten().collect()
    }

    /// Returns the objects, each followed by its reference, that are in a state of the goal at a reference that is not in
    /// place. Only terms of the goal that do not hold count.
    pub fn misplaced(&self, situation: &Situation) -> Vec<usize> {
        let goals = self.goals.iter().map(|goal| &self.tests[goal.index()]);
        let open = goals.filter(|test| test.within.is_some() && !test.holds(situation));
        let objects = open.flat_map(|test| {
            test.matching(situation)
                .filter(|(_, f)| !is_within(test.within, f.reference, situation))
        });
        objects.flat_map(|(i, f)| [Some(i), f.reference]).flatten().collect()
    }

    /// Returns the facts of the goal, in the order in which they are to be fulfilled.
    pub fn goals(&self) -> &[StateId] {
        &self.goals
    }

    /// Returns the first fact of the goal that does not hold; `None` if the goal is met.
    pub fn goal(&self, situation: &Situation) -> Option<StateId> {
        self.goals.iter().copied().find(|g| !self.tests[g.index()].holds(situation))
    }

    /// Returns the index of the operator that a ground action instantiates.
    ///
    /// # Panics
    /// If the action is not one of [`GroundProblem::domain`].
    pub fn operator(&self, action: ActionId) -> usize {
        self.actions[action.index()].operator
    }

    /// Returns the moves that carry out a ground action, the best first. Moves that also serve the action's purpose,
    /// with other objects or at other places, come last.
    ///
    /// `problem` is the problem that was compiled, or the same problem over later poses.
    pub fn moves_for(
        &self,
        problem: &Problem<'_>,
        action: ActionId,
        situation: &Situation,
    ) -> Vec<Move> {
        let Some(chosen) = self.actions.get(action.index()) else { return Vec::new() };
        let present = self.present(situation);
        let purpose = self.domain[action].to;
        let ready = |id: &ActionId| {
            let operator = &self.domain[*id];
            *id == action
                || (self.actions[id.index()].operator == chosen.operator
                    && operator.effects.contains(&purpose)
                    && operator.preconditions.iter().all(|p| present.holds(*p)))
        };
        let others = self.domain.action_ids().filter(|id| *id != action && ready(id));
        let allowed = problem.moves(situation);
        let mut moves: Vec<Move> = Vec::new();
        for id in [action].into_iter().chain(others) {
            let ground = &self.actions[id.index()];
            let fits = |m: &&Move| {
                m.operator == ground.operator
                    && m.reference == ground.reference
                    && m.place == ground.place
                    && ground.object.is_none_or(|o| o == m.object)
                    && situation[m.object].is_some_and(|f| ground.source.matches(m.object, &f))
            };
            let mut own: Vec<Move> = allowed.iter().filter(fits).copied().collect();
            own.sort_by_key(|m| {
                let lacking = problem.lacking(&problem.after(m, situation));
                (!problem.permitted(m, situation), lacking, *m)
            });
            own.retain(|m| !moves.contains(m));
            moves.extend(own);
        }
        moves
    }

    /// Returns the facts of the goal that cannot be reached from a situation, if facts only accumulate.
    pub fn out_of_reach(&self, now: &Situation) -> Vec<StateId> {
        let mut reached: Vec<bool> = self.present(now).flags().to_vec();
        loop {
            let before = reached.iter().filter(|r| **r).count();
            for operator in self.domain.operators() {
                if operator.preconditions.iter().all(|p| reached[p.index()]) {
                    for effect in &operator.effects {
                        reached[effect.index()] = true;
                    }
                }
            }
            if reached.iter().filter(|r| **r).count() == before {
                break;
            }
        }
        self.goals.iter().copied().filter(|g| !reached[g.index()]).collect()
    }
}

impl From<ProblemError> for TaskError {
    fn from(error: ProblemError) -> Self {
        TaskError::Problem { reason: error.to_string() }
    }
}
