//! Grounds a problem: finds all fluents and operators that can be reached from its initial state.
//!
//! Reachability ignores what actions make false. Facts that no reachable action changes are not fluents: they hold
//! always or never, and preconditions on them are dropped. A condition that a fact does not hold becomes a fluent of its
//! own, the complement of the fact, so that a ground operator has only positive preconditions.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::fmt::{self, Display, Formatter};

use thiserror::Error;

use super::pddl::{Action, Atom, Domain, EQUAL, Fact, Literal, Problem, Term, Typed};

/// Greatest number of reachable facts, and of reachable operators.
const MAX_GROUND: usize = 200_000;

/// Greatest number of bindings of a parameter that are tried.
const MAX_TRIED: usize = 50_000_000;

/// Why a problem cannot be grounded.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum GroundFault {
    /// There are too many facts or operators.
    #[error(
        "the problem `{problem}` is too large: it has more than {most} {what}; use fewer objects, or more precise types"
    )]
    TooLarge {
        /// Name of the problem.
        problem: String,
        /// What there are too many of.
        what: &'static str,
        /// Greatest number.
        most: usize,
    },
    /// No sequence of actions can achieve a part of the goal, even if no action made anything false.
    #[error("the goal {fluent} of the problem `{problem}` cannot be reached; {why}")]
    Unreachable {
        /// Name of the problem.
        problem: String,
        /// The part of the goal.
        fluent: String,
        /// Actions that could achieve it with other objects.
        why: String,
    },
}

/// A fact that can change, or its complement.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Fluent {
    /// The fact.
    pub fact: Fact,
    /// Whether the fluent holds when the fact does (`true`) or when it does not.
    pub holds: bool,
}

/// Displays as in PDDL: `(on a b)` or `(not (on a b))`.
impl Display for Fluent {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self.holds {
            true => write!(f, "{}", self.fact),
            false => write!(f, "(not {})", self.fact),
        }
    }
}

/// An action with its objects. All numbers are positions in [`Grounded::fluents`], in increasing order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GroundOperator {
    /// Position of the action in the domain.
    pub action: usize,
    /// Name as in a plan: `(stack a b)`.
    pub name: String,
    /// Fluents that must hold before.
    pub preconditions: Vec<usize>,
    /// Fluents that hold afterwards and may not have held before.
    pub adds: Vec<usize>,
    /// Fluents that do not hold afterwards.
    pub deletes: Vec<usize>,
}

impl GroundOperator {
    /// Carries the operator out in a state, a set of positions of fluents. Whether its preconditions hold is not looked at.
    pub fn apply(&self, state: &mut BTreeSet<usize>) {
        for fluent in &self.deletes {
            state.remove(fluent);
        }
        state.extend(&self.adds);
    }
}

/// A grounded problem.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Grounded {
    /// Fluents, sorted by fact.
    pub fluents: Vec<Fluent>,
    /// Operators that can be reached and change something, sorted by action and objects.
    pub operators: Vec<GroundOperator>,
    /// Fluents that hold at first, in increasing order.
    pub start: Vec<usize>,
    /// Fluents that must hold at the end, in increasing order. What holds always is left out.
    pub goal: Vec<usize>,
}

/// An action with the objects of its parameters.
type Call = (usize, Vec<usize>);
/// A predicate with objects, both by position.
type Ground = (usize, Vec<usize>);
/// Facts, each with whether it holds.
type Signed = BTreeSet<(Ground, bool)>;
/// A call with its conditions and effects.
type SignedCall = (Call, Signed, Signed);

impl Grounded {
    /// Grounds a problem of its domain.
    ///
    /// Costs O(bindings tried): actions are joined with reachable facts, so preconditions prune early.
    ///
    /// # Errors
    /// [`GroundFault::TooLarge`] beyond 200,000 facts or operators; [`GroundFault::Unreachable`] for a goal that no
    /// plan achieves because no reachable action does.
    pub fn new(domain: &Domain, problem: &Problem) -> Result<Self, GroundFault> {
        let mut reach = Reach::new(domain, problem);
        let calls = reach.explore().map_err(|what| {
            let most = if what == BINDINGS { MAX_TRIED } else { MAX_GROUND };
            GroundFault::TooLarge { problem: problem.name.clone(), what, most }
        })?;
        reach.compile(calls)
    }

    /// Returns whether all fluents of a set hold in a state.
    pub fn all_hold(state: &BTreeSet<usize>, fluents: &[usize]) -> bool {
        fluents.iter().all(|fluent| state.contains(fluent))
    }
}

const BINDINGS: &str = "ways to choose objects for its actions";

/// What has been reached so far.
struct Reach<'a> {
    domain: &'a Domain,
    problem: &'a Problem,
    objects: Vec<&'a Typed>,
    positions: HashMap<&'a str, usize>,
    /// Objects that fit each parameter of each action.
    fitting: Vec<Vec<BTreeSet<usize>>>,
    /// Predicates that some action changes.
    changing: BTreeSet<usize>,
    /// Facts of the initial state.
    start: HashSet<Ground>,
    /// Reached facts, by predicate, in the order in which they were reached.
    reached: Vec<Vec<Vec<usize>>>,
    known: HashSet<Ground>,
    /// Reached facts by predicate, position of an argument, and object there.
    index: HashMap<(usize, usize, usize), Vec<usize>>,
    tried: usize,
}

impl<'a> Reach<'a> {
    fn new(domain: &'a Domain, problem: &'a Problem) -> Self {
        let objects: Vec<&Typed> = domain.constants.iter().chain(&problem.objects).collect();
        let positions = objects.iter().enumerate().map(|(i, o)| (o.name.as_str(), i)).collect();
        let fits = |parameter: &Typed| {
            let fit = |object: &Typed| domain.types.fits(&object.types, &parameter.types);
            (0..objects.len()).filter(|index| fit(objects[*index])).collect()
        };
        let fitting = domain.actions.iter().map(|a| a.parameters.iter().map(fits).collect());
        let fitting = fitting.collect();
        let effects = domain.actions.iter().flat_map(|action| &action.effects);
        let changing = effects.filter_map(|e| domain.predicate(&e.atom.predicate)).collect();
        let mut reach = Self {
            domain,
            problem,
            objects,
            positions,
            fitting,
            changing,
            start: HashSet::new(),
            reached: vec![Vec::new(); domain.predicates.len()],
            known: HashSet::new(),
            index: HashMap::new(),
            tried: 0,
        };
        for fact in &problem.init {
            if let Some(ground) = reach.ground(fact) {
                reach.start.insert(ground.clone());
                reach.insert(ground);
            }
        }
        reach
    }

    fn ground(&self, fact: &Fact) -> Option<Ground> {
        let object = |name: &String| self.positions.get(name.as_str()).copied();
        let arguments = fact.arguments.iter().map(object).collect::<Option<_>>()?;
        Some((self.domain.predicate(&fact.predicate)?, arguments))
    }

    fn insert(&mut self, ground: Ground) -> bool {
        if !self.known.insert(ground.clone()) {
            return false;
        }
        let (predicate, arguments) = ground;
        let at = self.reached[predicate].len();
        for (place, object) in arguments.iter().enumerate() {
            self.index.entry((predicate, place, *object)).or_default().push(at);
        }
        self.reached[predicate].push(arguments);
        true
    }

    /// Returns the object of a term; `None` if the parameter is not bound yet.
    fn object(&self, term: &Term, objects: &[Option<usize>]) -> Option<usize> {
        match term {
            Term::Parameter(position) => *objects.get(*position)?,
            Term::Constant(name) => self.positions.get(name.as_str()).copied(),
        }
    }

    /// Returns the atom with objects for its parameters; `None` if a parameter is not bound yet.
    fn bound(&self, atom: &Atom, objects: &[Option<usize>]) -> Option<Vec<usize>> {
        atom.arguments.iter().map(|term| self.object(term, objects)).collect()
    }

    /// Finds all calls that can be reached. Returns what there is too much of if the problem is too large.
    fn explore(&mut self) -> Result<BTreeSet<Call>, &'static str> {
        let mut calls = BTreeSet::new();
        // Facts before these counts were reached in earlier rounds.
        let mut old = vec![0; self.reached.len()];
        let mut first = true;
        loop {
            let now: Vec<usize> = self.reached.iter().map(Vec::len).collect();
            let mut found = Vec::new();
            for (index, action) in self.domain.actions.iter().enumerate() {
                let needed: Vec<&Atom> = action
                    .preconditions
                    .iter()
                    .filter(|p| p.positive && p.atom.predicate != EQUAL)
                    .map(|p| &p.atom)
                    .collect();
                if first && needed.is_empty() {
                    let objects = vec![None; action.parameters.len()];
                    self.extend(index, action, &[], objects, &now, &mut found)?;
                }
                // In each call that is new, some precondition is a fact of the last round.
                for fresh in 0..needed.len() {
                    let Some(predicate) = self.domain.predicate(&needed[fresh].predicate) else {
                        continue;
                    };
                    let mut order = needed.clone();
                    order.swap(0, fresh);
                    for at in old[predicate]..now[predicate] {
                        let mut objects = vec![None; action.parameters.len()];
                        let fact = self.reached[predicate][at].clone();
                        if self.unify(order[0], &fact, index, &mut objects) {
                            self.extend(index, action, &order[1..], objects, &now, &mut found)?;
                        }
                    }
                }
            }
            (old, first) = (now, false);
            let before = self.known.len();
            for call in found {
                if calls.contains(&call) {
                    continue;
                }
                let objects: Vec<Option<usize>> = call.1.iter().copied().map(Some).collect();
                for effect in &self.domain.actions[call.0].effects {
                    let predicate = self.domain.predicate(&effect.atom.predicate);
                    if let (true, Some(predicate), Some(arguments)) =
                        (effect.positive, predicate, self.bound(&effect.atom, &objects))
                    {
                        self.insert((predicate, arguments));
                    }
                }
                calls.insert(call);
                if calls.len() > MAX_GROUND {
                    return Err("reachable actions");
                }
            }
            if self.known.len() > MAX_GROUND {
                return Err("reachable facts");
            }
            if self.known.len() == before {
                return Ok(calls);
            }
        }
    }

    /// Binds the parameters of an atom so that it is `fact`. Returns whether this is possible.
    fn unify(
        &self,
        atom: &Atom,
        fact: &[usize],
        action: usize,
        objects: &mut [Option<usize>],
    ) -> bool {
        atom.arguments.iter().zip(fact).all(|(term, object)| match term {
            Term::Constant(name) => self.positions.get(name.as_str()) == Some(object),
            Term::Parameter(position) => match objects[*position] {
                Some(bound) => bound == *object,
                None => {
                    objects[*position] = Some(*object);
                    self.fitting[action][*position].contains(object)
                }
            },
        })
    }

    /// Finds the calls that agree with the objects so far and have all of `needed` among the facts before `now`.
    fn extend(
        &mut self,
        index: usize,
        action: &Action,
        needed: &[&Atom],
        objects: Vec<Option<usize>>,
        now: &[usize],
        found: &mut Vec<Call>,
    ) -> Result<(), &'static str> {
        self.tried += 1;
        if self.tried > MAX_TRIED {
            return Err(BINDINGS);
        }
        if found.len() > MAX_GROUND {
            return Err("reachable actions");
        }
        if !self.possible(action, &objects) {
            return Ok(());
        }
        // The atom with the fewest facts that agree comes first.
        let best = (0..needed.len()).min_by_key(|at| self.candidates(needed[*at], &objects).1);
        if let Some(at) = best {
            let mut rest = needed.to_vec();
            let atom = rest.swap_remove(at);
            let Some(predicate) = self.domain.predicate(&atom.predicate) else { return Ok(()) };
            let facts = match self.candidates(atom, &objects).0 {
                Some(key) => self.index.get(&key).cloned().unwrap_or_default(),
                None => (0..now[predicate]).collect(),
            };
            for fact in facts.into_iter().filter(|fact| *fact < now[predicate]) {
                let fact = self.reached[predicate][fact].clone();
                let mut objects = objects.clone();
                if self.unify(atom, &fact, index, &mut objects) {
                    self.extend(index, action, &rest, objects, now, found)?;
                }
            }
            return Ok(());
        }
        match objects.iter().position(Option::is_none) {
            None => found.push((index, objects.into_iter().flatten().collect())),
            Some(free) => {
                for object in self.fitting[index][free].clone() {
                    let mut objects = objects.clone();
                    objects[free] = Some(object);
                    self.extend(index, action, &[], objects, now, found)?;
                }
            }
        }
        Ok(())
    }

    /// Returns the key of the index with the fewest facts that may agree with an atom (`None` for all facts of its
    /// predicate), and their number.
    fn candidates(
        &self,
        atom: &Atom,
        objects: &[Option<usize>],
    ) -> (Option<(usize, usize, usize)>, usize) {
        let Some(predicate) = self.domain.predicate(&atom.predicate) else { return (None, 0) };
        let all = (None, self.reached[predicate].len());
        let bound = atom.arguments.iter().enumerate().filter_map(|(place, term)| {
            let key = (predicate, place, self.object(term, objects)?);
            Some((Some(key), self.index.get(&key).map_or(0, Vec::len)))
        });
        bound.chain([all]).min_by_key(|(_, count)| *count).unwrap_or(all)
    }

    /// Returns whether no condition whose parameters are bound is violated for ever.
    fn possible(&self, action: &Action, objects: &[Option<usize>]) -> bool {
        action.preconditions.iter().all(|condition| {
            let Some(arguments) = self.bound(&condition.atom, objects) else { return true };
            if condition.atom.predicate == EQUAL {
                return (arguments.first() == arguments.get(1)) == condition.positive;
            }
            let Some(predicate) = self.domain.predicate(&condition.atom.predicate) else {
                return false;
            };
            // A negative condition on a fact that never changes must hold at first.
            condition.positive
                || self.changing.contains(&predicate)
                || !self.start.contains(&(predicate, arguments))
        })
    }

    fn fact(&self, ground: &Ground) -> Fact {
        let arguments = ground.1.iter().map(|object| self.objects[*object].name.clone()).collect();
        Fact { predicate: self.domain.predicates[ground.0].name.clone(), arguments }
    }

    /// Turns the reached calls into operators over fluents.
    fn compile(&self, calls: BTreeSet<Call>) -> Result<Grounded, GroundFault> {
        let signed = |call: &Call, effects: bool| -> Signed {
            let objects: Vec<Option<usize>> = call.1.iter().copied().map(Some).collect();
            let action = &self.domain.actions[call.0];
            let literals = if effects { &action.effects } else { &action.preconditions };
            let literals = literals.iter().filter(|literal| literal.atom.predicate != EQUAL);
            let all: Signed = literals
                .filter_map(|literal| {
                    let predicate = self.domain.predicate(&literal.atom.predicate)?;
                    Some(((predicate, self.bound(&literal.atom, &objects)?), literal.positive))
                })
                .collect();
            // What an action makes true and false is true afterwards.
            let keep = |(ground, positive): &(Ground, bool)| {
                !effects || *positive || !all.contains(&(ground.clone(), true))
            };
            all.iter().filter(|pair| keep(pair)).cloned().collect()
        };
        let calls: Vec<SignedCall> = calls
            .into_iter()
            .map(|call| {
                let (conditions, effects) = (signed(&call, false), signed(&call, true));
                (call, conditions, effects)
            })
            .collect();
        let (calls, reached) = self.with_negation(calls);
        // A fact changes if a call makes true what does not hold at first, or makes false what can hold.
        let changes = calls.iter().flat_map(|(_, _, effects)| effects).filter(|(ground, holds)| {
            let at_first = self.start.contains(ground);
            if *holds { !at_first } else { at_first || reached.contains(&(ground.clone(), true)) }
        });
        let changing: BTreeSet<&Ground> = changes.map(|(ground, _)| ground).collect();
        let goal: Vec<(Option<Ground>, bool)> =
            self.problem.goal.iter().map(|(holds, fact)| (self.ground(fact), *holds)).collect();
        let negative = calls.iter().flat_map(|(_, conditions, _)| conditions);
        let of_goal = goal.iter().filter_map(|(ground, holds)| Some((ground.as_ref()?, *holds)));
        let complements: BTreeSet<&Ground> = negative
            .map(|(ground, holds)| (ground, *holds))
            .chain(of_goal)
            .filter(|(ground, holds)| !holds && changing.contains(ground))
            .map(|(ground, _)| ground)
            .collect();
        let mut fluents: Vec<((Ground, bool), Fluent)> = changing
            .iter()
            .map(|ground| ((*ground).clone(), true))
            .chain(complements.into_iter().map(|ground| (ground.clone(), false)))
            .map(|key| {
                let fluent = Fluent { fact: self.fact(&key.0), holds: key.1 };
                (key, fluent)
            })
            .collect();
        fluents.sort_by(|a, b| a.1.cmp(&b.1));
        let positions: BTreeMap<&(Ground, bool), usize> =
            fluents.iter().enumerate().map(|(index, (key, _))| (key, index)).collect();
        let position =
            |ground: &Ground, holds: bool| positions.get(&(ground.clone(), holds)).copied();
        let sorted = |found: BTreeSet<usize>| found.into_iter().collect::<Vec<_>>();
        let mut operators = Vec::new();
        for ((action, objects), conditions, effects) in &calls {
            let preconditions: BTreeSet<usize> =
                conditions.iter().filter_map(|(g, holds)| position(g, *holds)).collect();
            let of = |sign: bool| {
                let own = effects.iter().filter_map(|(g, holds)| position(g, *holds == sign));
                own.collect::<BTreeSet<usize>>()
            };
            let (mut adds, deletes) = (of(true), of(false));
            adds.retain(|fluent| !preconditions.contains(fluent));
            if adds.is_empty() && deletes.is_empty() {
                continue;
            }
            let name = |object: &usize| format!(" {}", self.objects[*object].name);
            let names: String = objects.iter().map(name).collect();
            operators.push(GroundOperator {
                action: *action,
                name: format!("({}{names})", self.domain.actions[*action].name),
                preconditions: sorted(preconditions),
                adds: sorted(adds),
                deletes: sorted(deletes),
            });
        }
        let holds_at_first =
            |(ground, holds): &(Ground, bool)| self.start.contains(ground) == *holds;
        let start = (0..fluents.len()).filter(|index| holds_at_first(&fluents[*index].0)).collect();
        let mut wanted = BTreeSet::new();
        for ((ground, holds), (_, fact)) in goal.iter().zip(&self.problem.goal) {
            let Some(ground) = ground else { continue };
            match position(ground, *holds) {
                Some(fluent) => {
                    wanted.insert(fluent);
                }
                None if self.start.contains(ground) == *holds => {}
                None => return Err(self.unreachable(fact, *holds)),
            }
        }
        let fluents: Vec<Fluent> = fluents.into_iter().map(|(_, fluent)| fluent).collect();
        Ok(Grounded { fluents, operators, start, goal: wanted.into_iter().collect() })
    }

    /// Keeps the calls that can be reached if a fact that holds at first must be made false before a negative condition
    /// on it is met. Returns them, and what their effects reach.
    fn with_negation(&self, mut open: Vec<SignedCall>) -> (Vec<SignedCall>, Signed) {
        let (mut kept, mut reached) = (Vec::new(), Signed::new());
        loop {
            let met = |pair: &(Ground, bool)| {
                reached.contains(pair) || self.start.contains(&pair.0) == pair.1
            };
            let (now, later): (Vec<_>, Vec<_>) =
                open.into_iter().partition(|(_, conditions, _)| conditions.iter().all(met));
            if now.is_empty() {
                break;
            }
            reached.extend(now.iter().flat_map(|(_, _, effects)| effects).cloned());
            kept.extend(now);
            open = later;
        }
        kept.sort_by(|a, b| a.0.cmp(&b.0));
        (kept, reached)
    }

    fn unreachable(&self, fact: &Fact, holds: bool) -> GroundFault {
        let own = |e: &Literal| e.positive == holds && e.atom.predicate == fact.predicate;
        let achieves = |action: &&Action| action.effects.iter().any(own);
        let actions = self.domain.actions.iter().filter(achieves);
        let names: Vec<String> = actions.map(|action| format!("`{}`", action.name)).collect();
        let why = match names.is_empty() {
            true if holds => format!("no action makes `{}` true", fact.predicate),
            true => format!("no action makes `{}` false", fact.predicate),
            false => format!("the preconditions of {} cannot be met for it", names.join(" and ")),
        };
        let fluent = Fluent { fact: fact.clone(), holds }.to_string();
        GroundFault::Unreachable { problem: self.problem.name.clone(), fluent, why }
    }
}
