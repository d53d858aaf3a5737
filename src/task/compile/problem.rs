//! A planning problem: the objects of a scene, a relational domain and a goal.

use std::collections::BTreeSet;

use thiserror::Error;

use super::facts::Test;
use crate::sim::{few, nearest_first};
use crate::task::classify::Layout;
use crate::task::domain::{
    Before, Fact, Frame, GoalTerm, NeedVerdict, Quantity, RelationalDomain, RelationalOperator,
    Role, Situation, Subject,
};
use crate::task::recording::ObjectPose;

/// Why a scene and a domain give no planning problem.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ProblemError {
    /// The domain has no goal.
    #[error("the domain has no goal; name one of its states: {}", few(.states))]
    NoGoal {
        /// Names of the states.
        states: Vec<String>,
    },
    /// No action achieves a term of the goal.
    #[error("no action achieves {state}; the actions achieve: {}", nearest_first(.state, .achieved.iter().map(String::as_str)))]
    NothingAchieves {
        /// Name of the state.
        state: String,
        /// Names of the states that some action achieves.
        achieved: Vec<String>,
    },
    /// The goal is relative to a kind of object that the scene lacks.
    #[error("{state} is a state relative to a `{kind}`, and the scene has none")]
    NoReference {
        /// Name of the state.
        state: String,
        /// Kind of the missing reference.
        kind: String,
    },
    /// The scene has too few objects for the goal.
    #[error(
        "the goal asks for {least} of {state}, and the scene has {present} objects of kind `{kind}`"
    )]
    TooFew {
        /// Name of the state.
        state: String,
        /// Kind of the objects.
        kind: String,
        /// Number of objects that the goal asks for.
        least: usize,
        /// Number of objects in the scene.
        present: usize,
    },
    /// The scene has too many objects for the planner graph.
    #[error(
        "the scene has {objects} objects, and planning in it would take more than {most} {what}"
    )]
    TooLarge {
        /// Number of objects in the scene.
        objects: usize,
        /// What would be too many: `moves`, or `facts and actions`.
        what: &'static str,
        /// Their greatest number.
        most: usize,
    },
    /// The reference planner finds no plan.
    #[error("there is no plan")]
    NoPlan,
    /// The reference planner gave up. There may be a plan.
    #[error("the search for a plan was given up after {situations} situations")]
    GivenUp {
        /// Number of situations that were generated.
        situations: usize,
    },
    /// No action leads to the goal in this scene.
    #[error("no object in the scene can be moved towards the goal: {}", few(.states))]
    Nothing {
        /// Names of the goal's states.
        states: Vec<String>,
    },
    /// The ground domain is not valid.
    #[error("the problem cannot be compiled for the planner graph: {reason}")]
    Invalid {
        /// What is wrong with the domain.
        reason: String,
    },
}

/// A planning problem over one scene.
#[derive(Debug, Clone)]
pub struct Problem<'d> {
    pub(super) domain: &'d RelationalDomain,
    pub(super) objects: Vec<ObjectPose>,
    pub(super) goals: Vec<GoalTerm>,
    goal_tests: Vec<Test>,
    /// Undecided needs that are in force, as (operator, need).
    pub(super) in_force: BTreeSet<(usize, usize)>,
    /// Pairs of places that exclude each other, as ((state, place), (state, place)).
    pub(super) conflicts: BTreeSet<((usize, usize), (usize, usize))>,
}

/// Greatest number of moves of all objects in a scene, possible or not.
const MOST_MOVES: usize = 300_000;

impl<'d> Problem<'d> {
    /// Sets up the problem of reaching the domain's goal in a scene.
    ///
    /// # Errors
    /// [`ProblemError`] if the goal cannot be asked for in this scene.
    pub fn new(domain: &'d RelationalDomain, layout: &Layout) -> Result<Self, ProblemError> {
        if domain.goals.is_empty() {
            let states = domain.states.iter().map(|s| s.name.clone()).collect();
            return Err(ProblemError::NoGoal { states });
        }
        Self::with_goals(domain, layout, domain.goals.clone())
    }

    /// Sets up the problem of reaching other goals.
    ///
    /// # Errors
    /// As [`Problem::new`].
    pub fn with_goals(
        domain: &'d RelationalDomain,
        layout: &Layout,
        goals: Vec<GoalTerm>,
    ) -> Result<Self, ProblemError> {
        let mut conflicts = BTreeSet::new();
        for (a, x) in domain.states.iter().enumerate() {
            for (b, y) in domain.states.iter().enumerate().filter(|(_, y)| y.frame == x.frame) {
                for (i, p) in x.places.iter().enumerate() {
                    for (j, q) in y.places.iter().enumerate() {
                        if p.excludes(q) {
                            conflicts.insert(((a, i), (b, j)));
                        }
                    }
                }
            }
        }
        // An object that needs another one in a place shares the place with it.
        let together = |a: usize, b: usize| {
            domain.operators.iter().filter(|o| o.to == a).any(|operator| {
                operator.needs.iter().any(|need| {
                    let there =
                        matches!(need.condition.subject, Subject::At(Role::Target) | Subject::Any);
                    need.is_positive() && there && need.states().any(|state| state == b)
                })
            })
        };
        // Places of one row are taken by one object each, whatever its kind.
        let in_turn = |a: usize, b: usize| {
            let mut rows = domain.operators.iter().flat_map(|o| &o.order);
            let has = |row: &Before, s: usize| row.one_of.iter().any(|(state, _)| *state == s);
            rows.any(|row| has(row, a) && has(row, b))
        };
        conflicts.retain(|((a, _), (b, _))| a == b || !together(*a, *b) || in_turn(*a, *b));
        let mut problem = Self {
            domain,
            objects: layout.objects.clone(),
            goals,
            goal_tests: Vec::new(),
            in_force: BTreeSet::new(),
            conflicts,
        };
        problem.goal_tests = problem.goals.iter().flat_map(|g| problem.tests_of(g)).collect();
        problem.check_goals(&layout.situation())?;
        problem.check_size()?;
        problem.choose_undecided(&layout.situation());
        Ok(problem)
    }

    /// Returns the domain.
    pub fn domain(&self) -> &'d RelationalDomain {
        self.domain
    }

    /// Returns the objects of the scene.
    pub fn objects(&self) -> &[ObjectPose] {
        &self.objects
    }

    /// Returns the terms of the goal.
    pub fn goals(&self) -> &[GoalTerm] {
        &self.goals
    }

    /// Returns all undecided needs, as pairs of operator and need.
    pub(crate) fn undecided(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.domain.operators.iter().enumerate().flat_map(|(o, operator)| {
            let needs = operator.needs.iter().enumerate();
            needs.filter(|(_, n)| n.verdict == NeedVerdict::Undecided).map(move |(n, _)| (o, n))
        })
    }

    /// Refuses a scene with so many pairs of objects that listing all moves would take many seconds.
    fn check_size(&self) -> Result<(), ProblemError> {
        let moves = self.domain.operators.iter().map(|operator| {
            let to = &self.domain.states[operator.to];
            let references = self.references(&to.frame, None).len();
            self.of_kind(&to.kind).count() * references * to.places.len()
        });
        match moves.sum::<usize>() {
            0..=MOST_MOVES => Ok(()),
            _ => {
                let (objects, what) = (self.objects.len(), "moves");
                Err(ProblemError::TooLarge { objects, what, most: MOST_MOVES })
            }
        }
    }

    /// Refuses a goal that cannot be reached, unless it holds already.
    fn check_goals(&self, now: &Situation) -> Result<(), ProblemError> {
        let achieved: BTreeSet<usize> =
            self.domain.operators.iter().flat_map(RelationalOperator::achieves).collect();
        let held = |goal: &&GoalTerm| {
            matches!(goal.quantity, Quantity::AtLeast(_))
                && self.tests_of(goal).iter().all(|test| test.holds(now))
        };
        // A term about all objects of a kind says nothing where there are none, unless nothing else is asked for.
        let idle = |goal: &&GoalTerm| {
            let every = goal.quantity == Quantity::EachObject;
            every && self.tests_of(goal).is_empty() && !self.goal_tests.is_empty()
        };
        for goal in self.goals.iter().filter(|goal| !held(goal) && !idle(goal)) {
            let state = &self.domain.states[goal.state];
            let name = || state.name.clone();
            if !goal.states().any(|state| achieved.contains(&state)) {
                let achieved =
                    achieved.iter().map(|s| self.domain.states[*s].name.clone()).collect();
                return Err(ProblemError::NothingAchieves { state: name(), achieved });
            }
            let references = self.references(&state.frame, None).len();
            if references == 0 && goal.or.is_empty() {
                let kind = state.frame.name().to_owned();
                return Err(ProblemError::NoReference { state: name(), kind });
            }
            let present = self.of_kind(&state.kind).count();
            let (least, lacks) = match goal.quantity {
                Quantity::AtLeast(n) => (n, present == 0),
                Quantity::EachObject => (1, present == 0),
                Quantity::EachReference(n) => (n * references, present < n * references),
            };
            if lacks {
                let kind = state.kind.clone();
                return Err(ProblemError::TooFew { state: name(), kind, least, present });
            }
        }
        Ok(())
    }

    pub(super) fn of_kind<'s>(&'s self, kind: &'s str) -> impl Iterator<Item = usize> + 's {
        let objects = self.objects.iter().enumerate();
        objects.filter(move |(_, o)| *o.kind == *kind).map(|(i, _)| i)
    }

    /// Returns the references that an object can have in a frame: each other object of the frame's kind, or `None` in the
    /// world. Without an object, all of them.
    pub(crate) fn references(&self, frame: &Frame, object: Option<usize>) -> Vec<Option<usize>> {
        match frame.kind() {
            None => vec![None],
            Some(kind) => self.of_kind(kind).map(Some).filter(|r| *r != object).collect(),
        }
    }

    /// Returns the references and places to which an operator can bring an object.
    pub(super) fn targets(
        &self,
        operator: usize,
        object: Option<usize>,
    ) -> Vec<(Option<usize>, usize)> {
        let to = &self.domain.states[self.domain.operators[operator].to];
        let references = self.references(&to.frame, object).into_iter();
        references.flat_map(|r| (0..to.places.len()).map(move |place| (r, place))).collect()
    }

    /// Returns the facts that an object can have: every place of every state of its kind, at every reference.
    pub(super) fn facts_of(&self, object: usize) -> Vec<Fact> {
        let states = self.domain.states.iter().enumerate();
        let own = states.filter(|(_, state)| *state.kind == *self.objects[object].kind);
        let all = own.flat_map(|(state, described)| {
            let references = self.references(&described.frame, Some(object));
            (0..described.places.len()).flat_map(move |place| {
                let references = references.clone().into_iter();
                references.map(move |reference| Fact { state, place, reference })
            })
        });
        all.collect()
    }

    /// Returns the number of objects, or references, that the goal still lacks.
    pub fn lacking(&self, situation: &Situation) -> usize {
        self.goal_tests.iter().map(|test| test.lacking(situation)).sum()
    }

    /// Returns the tests of a term of the goal.
    pub(super) fn tests_of(&self, goal: &GoalTerm) -> Vec<Test> {
        let state = &self.domain.states[goal.state];
        let one = Test::of(goal.states());
        let present = self.of_kind(&state.kind).count();
        match goal.quantity {
            Quantity::AtLeast(0) | Quantity::EachReference(0) => Vec::new(),
            Quantity::AtLeast(least) => {
                let least = least.min(present.max(1));
                vec![Test { least, within: goal.reference, ..one }]
            }
            Quantity::EachReference(least) => {
                let each = self.of_kind(state.frame.kind().unwrap_or_default());
                each.map(|r| Test { reference: Some(Some(r)), least, ..one.clone() }).collect()
            }
            Quantity::EachObject => match present {
                0 => Vec::new(),
                least => vec![Test { least, ..one }],
            },
        }
    }

    /// Returns whether objects of this kind are told apart: some state has the kind as its frame.
    pub(super) fn told_apart(&self, kind: &str) -> bool {
        self.domain.states.iter().any(|s| s.frame.kind() == Some(kind))
    }

    /// Returns the pairs of state and place where no other object may be, with the same reference, before one is put at a
    /// place of a state. Empty if the place has room for several.
    pub(crate) fn excluded_by(&self, state: usize, place: usize) -> Vec<(usize, usize)> {
        let own = (state, place);
        let pairs = self.conflicts.range((own, (0, 0))..=(own, (usize::MAX, usize::MAX)));
        pairs.map(|(_, other)| *other).collect()
    }
}
