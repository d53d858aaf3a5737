//! The compiler of ground problems: finds the facts and actions from which a goal can be reached.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

use super::counted::counted;
use super::exclusion::exclusions;
use super::facts::{GroundAction, Test};
use super::ground::GroundProblem;
use super::problem::{Problem, ProblemError};
use super::symbols::{Name, Symbols};
use crate::task::domain::{Frame, Need, NeedVerdict, Parameters, Role, Situation, Subject};
use crate::task::propositional::{Domain, Operator, State, StateId};

/// Greatest number of facts and actions of a ground problem.
const MOST: usize = 2_000;

impl Problem<'_> {
    /// Compiles the problem into a propositional domain for the planner graph, with `now` as the present situation.
    ///
    /// Undecided needs in force that put the goal out of reach from `now`, alone or together, are dropped
    /// ([`GroundProblem::dropped`]). As few needs are dropped as possible, those with the least evidence first.
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
        let all = self.together(now);
        let whole = self.compile(&all)?;
        let lost = whole.out_of_reach(now);
        if lost.is_empty() || all.is_empty() {
            return Ok(whole);
        }
        let mut kept = BTreeSet::new();
        let mut best = self.compile(&kept)?;
        let least = best.out_of_reach(now);
        if least == lost {
            return Ok(whole);
        }
        let evidence = |(o, n): &(usize, usize)| self.domain.operators[*o].needs[*n].of;
        let mut all: Vec<(usize, usize)> = all.into_iter().collect();
        all.sort_by_key(|need| (Reverse(evidence(need)), *need));
        for need in all {
            kept.insert(need);
            let with = self.compile(&kept)?;
            if with.out_of_reach(now) == least {
                best = with;
            } else {
                kept.remove(&need);
            }
        }
        Ok(best)
    }

    /// Compiles the problem with these undecided needs in force. What is left of objects is counted unless that makes it too large.
    fn compile(&self, in_force: &BTreeSet<(usize, usize)>) -> Result<GroundProblem, ProblemError> {
        let counted = counted(self, in_force);
        let plain = || Compiler::new(self, in_force, BTreeSet::new()).compile();
        if counted.is_empty() {
            return plain();
        }
        match Compiler::new(self, in_force, counted).compile() {
            Err(ProblemError::TooLarge { .. }) => plain(),
            compiled => compiled,
        }
    }
}

pub(super) struct Compiler<'p> {
    pub(super) problem: &'p Problem<'p>,
    pub(super) in_force: &'p BTreeSet<(usize, usize)>,
    /// The states of which conditions count what is left.
    pub(super) counted: BTreeSet<usize>,
    /// The facts. Their ids are the indices.
    tests: Vec<Test>,
    index: BTreeMap<Test, StateId>,
    /// Actions. The first precondition of each is that an object can be moved.
    actions: BTreeMap<GroundAction, Found>,
    /// The words of goals of one fact: those of their term.
    goal_words: BTreeMap<StateId, String>,
}

/// What is found about an action.
struct Found {
    preconditions: Vec<StateId>,
    /// The preconditions that are undecided needs, with the index of the need.
    undecided: Vec<(StateId, usize)>,
    /// The fact for which it was found.
    to: StateId,
}

impl<'p> Compiler<'p> {
    fn new(
        problem: &'p Problem<'p>,
        in_force: &'p BTreeSet<(usize, usize)>,
        counted: BTreeSet<usize>,
    ) -> Self {
        Self {
            problem,
            in_force,
            counted,
            tests: Vec::new(),
            index: BTreeMap::new(),
            actions: BTreeMap::new(),
            goal_words: BTreeMap::new(),
        }
    }

    /// Walks backwards from the goal.
    fn compile(mut self) -> Result<GroundProblem, ProblemError> {
        let mut goals: Vec<StateId> = Vec::new();
        let problem = self.problem;
        for term in &problem.goals {
            let tests = problem.tests_of(term);
            let alone = tests.len() == 1;
            for test in tests {
                let goal = self.fact(test);
                if alone {
                    let words = || problem.domain.goal_in_words(term);
                    self.goal_words.entry(goal).or_insert_with(words);
                }
                if !goals.contains(&goal) {
                    goals.push(goal);
                }
            }
        }
        let mut next = 0;
        while next < self.tests.len() {
            let test = self.tests[next].clone();
            if !test.given {
                for action in self.causes(&test) {
                    if !self.actions.contains_key(&action) {
                        let found = self.found(&action, StateId::new(next));
                        self.actions.insert(action, found);
                        self.check_size()?;
                    }
                }
            }
            next += 1;
            self.check_size()?;
        }
        self.finish(goals)
    }

    fn check_size(&self) -> Result<(), ProblemError> {
        match self.tests.len() + self.actions.len() {
            0..=MOST => Ok(()),
            _ => {
                let (objects, what) = (self.problem.objects.len(), "facts and actions");
                Err(ProblemError::TooLarge { objects, what, most: MOST })
            }
        }
    }

    /// Names the facts and actions, and lists the actions in order of preference, with all their effects.
    fn finish(self, goals: Vec<StateId>) -> Result<GroundProblem, ProblemError> {
        let known = &self.problem.domain;
        if self.actions.is_empty() {
            let states = self.problem.goals.iter().flat_map(|goal| goal.states());
            let states = states.map(|state| known.states[state].name.clone());
            return Err(ProblemError::Nothing { states: states.collect() });
        }
        // An action is harmless if it puts nothing where something else must be clear.
        let harm = |action: &GroundAction| {
            self.tests.iter().filter(|t| t.forbids() && self.enters(action, t)).count()
        };
        let instances = |action: &GroundAction| known.operators[action.operator].instances;
        let mut actions: Vec<&GroundAction> = self.actions.keys().collect();
        actions.sort_by_cached_key(|a| (harm(a), Reverse(instances(a)), Reverse(a.among), *a));
        let mut symbols = Symbols::new(self.problem);
        let mut fact_words = Vec::with_capacity(self.tests.len());
        let states = self.tests.iter().map(|test| {
            let told = self.goal_words.get(&StateId::new(fact_words.len()));
            let Name { symbol: name, words } = symbols.fact(test, told);
            fact_words.push(words);
            let kind = test.of.first().map(|(s, _)| known.states[*s].kind.clone());
            State { name, kind: kind.unwrap_or_default() }
        });
        let states: Vec<State> = states.collect();
        let mut action_words = Vec::with_capacity(actions.len());
        let operators = actions.iter().map(|action| {
            let Found { preconditions, to, .. } = &self.actions[*action];
            let facts = || (0..self.tests.len()).map(StateId::new);
            let adds = |f: &StateId| {
                let test = &self.tests[f.index()];
                f != to && self.contributes(action, test)
            };
            let effects: Vec<StateId> = std::iter::once(*to).chain(facts().filter(adds)).collect();
            let ends = |f: &StateId| self.ends(action, &self.tests[f.index()]);
            let Name { symbol: name, words } = symbols.action(action);
            action_words.push(words);
            Operator {
                name,
                from: preconditions.first().copied(),
                to: *to,
                preconditions: preconditions.clone(),
                removes: facts().filter(|f| ends(f) && !effects.contains(f)).collect(),
                effects,
                absent: Vec::new(),
            }
        });
        let operators: Vec<Operator> = operators.collect();
        let domain = Domain::new(states, operators)
            .map_err(|error| ProblemError::Invalid { reason: error.to_string() })?;
        let dropped = self.problem.undecided().filter(|need| !self.in_force.contains(need));
        let (objects, composition) = symbols.finish();
        Ok(GroundProblem {
            domain,
            composition,
            objects,
            fact_words,
            action_words,
            dropped: dropped.collect(),
            undecided: actions.iter().map(|a| self.actions[*a].undecided.clone()).collect(),
            actions: actions.into_iter().cloned().collect(),
            tests: self.tests,
            goals,
            exclusions: Vec::new(),
        })
    }

    /// Adds a fact and returns its id.
    fn fact(&mut self, mut test: Test) -> StateId {
        test.of.sort_unstable();
        test.of.dedup();
        // States in the world frame have no reference to tell apart.
        let worldly = |(s, _): &(usize, _)| self.problem.domain.states[*s].frame == Frame::World;
        if test.of.iter().all(worldly) {
            test.reference = None;
        }
        // Objects of other kinds are never counted.
        let kinds: BTreeSet<&str> =
            test.of.iter().map(|(s, _)| &*self.problem.domain.states[*s].kind).collect();
        test.except
            .retain(|i| test.object.is_none() && kinds.contains(&*self.problem.objects[*i].kind));
        test.except.sort_unstable();
        test.except.dedup();
        if let Some(id) = self.index.get(&test) {
            return *id;
        }
        let id = StateId::new(self.tests.len());
        self.tests.push(test.clone());
        self.index.insert(test, id);
        id
    }

    /// Adds the preconditions of an action that was found for the fact `to`.
    fn found(&mut self, action: &GroundAction, to: StateId) -> Found {
        let mut found = Found { preconditions: Vec::new(), undecided: Vec::new(), to };
        for (test, undecided) in self.needs(action) {
            let fact = self.fact(test);
            // What is left of a need and of a source can be one fact.
            if !found.preconditions.contains(&fact) {
                found.preconditions.push(fact);
            }
            found.undecided.extend(undecided.map(|need| (fact, need)));
        }
        found
    }

    /// Returns the preconditions of an action, undecided needs with their index. The first is that an object can be moved.
    fn needs(&self, action: &GroundAction) -> Vec<(Test, Option<usize>)> {
        let operator = &self.problem.domain.operators[action.operator];
        let mut needs = vec![(action.source.clone(), None)];
        let more = |among: &Test| among.least > action.source.least;
        needs.extend(action.among_test().filter(more).map(|among| (among, None)));
        let of = self.problem.excluded_by(operator.to, action.place);
        if !of.is_empty() {
            // An object that is turned in place, or put back, is not in its own way.
            let source = &action.source;
            let own = action.object.is_none()
                && source.reference.is_none_or(|r| r == action.reference)
                && of.iter().any(|(s, p)| {
                    source.of.iter().any(|(x, q)| x == s && q.is_none_or(|q| q == *p))
                });
            let free = Test {
                of: of.into_iter().map(|(s, p)| (s, Some(p))).collect(),
                reference: Some(action.reference),
                except: action.object.into_iter().collect(),
                most: Some(usize::from(own)),
                ..Test::of([]).none()
            };
            needs.push((free, None));
        }
        let own = (action.operator, action.place, action.reference, action.object);
        let before = self.problem.before(own);
        needs.extend(before.map(|test| (test, None)));
        if let (Some(object), Some(reference)) = (action.object, action.reference) {
            let kinds = [object, reference].map(|i| &*self.problem.objects[i].kind);
            let states = self.problem.domain.states.iter().enumerate();
            let on = states.filter(|(_, s)| s.frame.kind() == Some(kinds[0]) && s.kind == kinds[1]);
            let of = Test::of(on.map(|(s, _)| s));
            if !of.of.is_empty() {
                let at = Some(Some(object));
                needs.push((Test { object: Some(reference), reference: at, ..of.none() }, None));
            }
        }
        for (n, need) in operator.needs.iter().enumerate() {
            if self.counts(action.operator, n) {
                let undecided = (need.verdict == NeedVerdict::Undecided).then_some(n);
                needs.extend(self.need(action, need).map(|test| (test, undecided)));
            }
        }
        // A need that asks for what the source says already would cost a fact.
        let mut seen = BTreeSet::new();
        needs.retain(|(test, _)| seen.insert(test.clone()));
        needs
    }

    /// Returns a need as a test; `None` if the need is about a parameter that the action does not have.
    fn need(&self, action: &GroundAction, need: &Need) -> Option<Test> {
        // The source says what state the object itself is in.
        if need.condition.subject == Subject::Is(Role::Object) {
            return None;
        }
        let parameters = Parameters::new(action.object, action.origin(), action.reference);
        let counted = need.counted(&parameters)?;
        let all = Test {
            object: counted.object,
            reference: counted.reference.map(Some),
            except: counted.except.into_iter().flatten().collect(),
            ..Test::of(counted.states())
        };
        let domain = self.problem.domain;
        let kind = &*domain.states[domain.operators[action.operator].to].kind;
        let any = action.object.is_none().then_some(kind);
        let mut test = match need.is_positive() {
            true => Test { least: self.problem.least(need, &counted, any), ..all },
            false => all.none(),
        };
        // The moved object does not count. If it cannot be excepted by its index, there must be one more.
        let own = |s: &(usize, Option<usize>)| match action.source.reference {
            Some(reference) => test.counts(None, s.0, 0, reference),
            None => test.reference.is_none() && counted.states().any(|state| state == s.0),
        };
        if action.object.is_none() && test.object.is_none() && action.source.of.iter().any(own) {
            match test.most {
                None => test.least += 1,
                Some(_) => test.most = Some(1),
            }
        }
        Some(test)
    }
}
