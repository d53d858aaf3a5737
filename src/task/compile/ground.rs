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

use super::compiler::Compiler;
use super::exclusion::exclusions;
use super::facts::{GroundAction, Test};
use super::moves::Move;
use super::problem::{Problem, ProblemError};
use super::symbols::Symbols;
use crate::task::domain::{Quantity, Situation, is_within};
use crate::task::error::TaskError;
use crate::task::propositional::{
    ActionId, Composition, Domain, Operator, State, StateId, WorldState,
};

/// A relational problem over one scene as a propositional domain.
///
/// [`Problem::ground`] builds it.
#[derive(Debug, Clone)]
pub struct GroundProblem {
    domain: Domain,
    composition: Composition,
    tests: Vec<Test>,
    actions: Vec<GroundAction>,
    /// The facts of each term of the goal, in order.
    goals: Vec<StateId>,
    dropped: BTreeSet<(usize, usize)>,
    exclusions: Vec<[StateId; 2]>,
}

/// Greatest number of facts and actions of a ground problem.
const MOST: usize = 2_000;

impl Problem<'_> {
    /// Compiles the problem into a propositional domain for the planner graph, with `now` as the present situation.
    ///
    /// Undecided needs in force that put the goal out of reach from `now` are dropped
    /// ([`GroundProblem::dropped`]). As few needs are dropped as possible, those found first.
    ///
    /// # Errors
    /// [`ProblemError::TooLarge`] if the scene has too many objects; [`ProblemError::Nothing`] if no action leads to
    /// the goal.
    pub fn ground(&self, now: &Situation) -> Result<GroundProblem, ProblemError> {
        let mut ground = self.ground_needed(now)?;
        ground.exclusions = exclusions(self, &ground.tests);
        Ok(ground)
    }

    fn ground_needed(&self, now: &Situation) -> Result<GroundProblem, ProblemError> {
        let all = self.in_force.clone();
        let whole = self.ground_with(&all)?;
        let lost = whole.out_of_reach(now);
        if lost.is_empty() || all.is_empty() {
            return Ok(whole);
        }
        let mut kept = BTreeSet::new();
        let mut best = self.ground_with(&kept)?;
        let least = best.out_of_reach(now);
        if least == lost {
            return Ok(whole);
        }
        for need in all {
            kept.insert(need);
            let with = self.ground_with(&kept)?;
            if with.out_of_reach(now) == least {
                best = with;
            } else {
                kept.remove(&need);
            }
        }
        Ok(best)
    }

    fn ground_with(
        &self,
        in_force: &BTreeSet<(usize, usize)>,
    ) -> Result<GroundProblem, ProblemError> {
        let goals: Vec<Test> = self.goal_tests();
        let compiled = Compiler::new(self, in_force).compile(&goals, MOST)?;
        if compiled.actions.is_empty() {
            let states = self.goals.iter().map(|g| self.domain.states[g.state].name.clone());
            return Err(ProblemError::Nothing { states: states.collect() });
        }
        let mut symbols = Symbols::new(self);
        for test in &compiled.tests {
            symbols.fact(test);
        }
        for action in &compiled.actions {
            symbols.action(action);
        }
        let states = compiled.tests.iter().zip(&symbols.facts).map(|(test, name)| State {
            name: name.clone(),
            kind: test
                .of
                .first()
                .map_or_else(String::new, |(s, _)| self.domain.states[*s].kind.clone()),
        });
        let operators = (0..compiled.actions.len()).map(|a| {
            let effects: Vec<StateId> =
                compiled.effects[a].iter().map(|f| StateId::new(*f)).collect();
            Operator {
                name: symbols.actions[a].clone(),
                from: compiled.needs[a].first().map(|f| StateId::new(*f)),
                to: effects.first().copied().unwrap_or(StateId::new(0)),
                preconditions: compiled.needs[a].iter().map(|f| StateId::new(*f)).collect(),
                effects,
                absent: Vec::new(),
                removes: compiled.removes[a].iter().map(|f| StateId::new(*f)).collect(),
            }
        });
        let domain = Domain::new(states.collect(), operators.collect())
            .map_err(|error| ProblemError::Invalid { reason: error.to_string() })?;
        let goals = goals.iter().filter_map(|g| compiled.tests.iter().position(|t| t == g));
        let goals = goals.map(StateId::new).collect();
        let dropped = self.undecided().filter(|need| !in_force.contains(need)).collect();
        let composition = symbols.composition();
        let (tests, actions) = (compiled.tests, compiled.actions);
        let exclusions = Vec::new();
        Ok(GroundProblem { domain, composition, tests, actions, goals, dropped, exclusions })
    }

    /// Returns the tests of the goal, in the order in which they are to be fulfilled.
    fn goal_tests(&self) -> Vec<Test> {
        let mut tests: Vec<Test> = Vec::new();
        for goal in &self.goals {
            let state = &self.domain.states[goal.state];
            let one = Test::of([goal.state]);
            match goal.quantity {
                Quantity::AtLeast(0) | Quantity::EachReference(0) => {}
                Quantity::AtLeast(least) => {
                    tests.push(Test { least, within: goal.reference, ..one });
                }
                Quantity::EachReference(least) => {
                    let kind = state.frame.kind().unwrap_or_default();
                    let each = self.of_kind(kind);
                    tests.extend(each.map(|r| Test {
                        reference: Some(Some(r)),
                        least,
                        ..one.clone()
                    }));
                }
                Quantity::EachObject => match self.of_kind(&state.kind).count() {
                    0 => {}
                    least => tests.push(Test { least, ..one }),
                },
            }
        }
        let mut seen = BTreeSet::new();
        tests.retain(|t| seen.insert(t.clone()));
        tests
    }

    /// Returns whether objects of this kind are told apart: some state has the kind as its frame.
    pub(super) fn told_apart(&self, kind: &str) -> bool {
        self.domain.states.iter().any(|s| s.frame.kind() == Some(kind))
    }
}

impl GroundProblem {
    /// Returns the propositional domain: the ground facts as states, the ground actions as operators.
    pub fn domain(&self) -> &Domain {
        &self.domain
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
