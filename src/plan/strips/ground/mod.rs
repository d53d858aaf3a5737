//! Grounds a problem: compiles it to facts and operators that can be reached from its initial state.
//!
//! Reachability ignores what actions make false. Facts that no reachable action changes are not fluents: they hold
//! always or never, and preconditions on them are dropped. A condition that a fact does not hold becomes a fluent of its
//! own, the complement of the fact, so that a ground operator has only positive preconditions.
//!
//! Quantifiers stand for all objects of their types, and derived predicates for the conditions that derive them, in as many
//! rounds as they take if they need themselves. A condition that can be met in several ways, or an effect whose condition is
//! not certain, makes several operators of one action with its objects. Where there are too many, facts stand for parts of the condition.
//! A part of the goal that can be met in several ways becomes such a fact as well. Hidden operators make it true, and operators
//! that change what it is about make it false.
//!
//! | file | contents |
//! |---|---|
//! | `lower` | conditions and effects by number |
//! | `schema` | actions by number, with the ways to join their conditions |
//! | `reach` | the calls of actions that can be reached, by joins |
//! | `ways` | the sets of facts in each of which a condition holds |
//! | `stand_ins` | facts that stand for parts of conditions which hold in too many ways |
//! | `operators` | the operators of a call |
//! | `assembly` | fluents and operators from the operators of all calls |

mod assembly;
mod lower;
mod operators;
mod reach;
mod rounds;
mod schema;
mod stand_ins;
mod ways;

use std::collections::{BTreeSet, HashMap};
use std::fmt::{self, Display, Formatter};
use std::rc::Rc;

use thiserror::Error;

use super::formula::Number;
use super::pddl::{Domain, Fact, Literal, Problem};
use super::sexpr::short;
use super::strata::Strata;
use super::write::ShownCondition;
use assembly::Assembly;
use lower::{Base, Fitting, Formula, Ground, Lower, UNBOUND};
use operators::{Compiled, of_call};
use reach::Reach;
use schema::{Schema, check_choices};
use ways::{Known, MAX_WAYS, Part, Rule};

/// Greatest number of reachable facts, and of reachable operators.
const MAX_GROUND: usize = 200_000;

/// Greatest number of steps that grounding takes.
const MAX_TRIED: usize = 50_000_000;

const BINDINGS: &str = "ways to choose objects for its actions";

/// What there is too much of, and how much there may be.
#[derive(Debug)]
struct TooLarge {
    what: String,
    most: usize,
}

/// Greatest number of ways of a condition that are written out, and of a derived fact that may need itself, unless another is
/// given. What leads over others is longer, and soon comes in far more ways.
const WRITTEN_WAYS: [usize; 2] = [300, 64];

/// What there are too many of, where actions have too many choices of objects.
const CALLS: &str = "reachable actions";

/// What there are too many of, where effects with conditions double the operators of an action.
const OPERATORS: &str = "operators of one action";

/// What there are too many of, where nothing says yet of which condition.
const WAYS: &str = "ways in which one condition can hold";

impl TooLarge {
    fn new(what: &str, most: usize) -> Self {
        Self { what: what.to_owned(), most }
    }

    /// Returns whether a condition holds in too many ways, or makes too many operators.
    fn is_of_ways(&self) -> bool {
        self.what == WAYS || self.what.starts_with(OPERATORS)
    }

    /// Says whose condition can hold in too many ways.
    fn of(self, of: impl FnOnce() -> String) -> Self {
        match self.what == WAYS {
            true => {
                Self { what: format!("ways in which one condition of {} can hold", of()), ..self }
            }
            false => self,
        }
    }
}

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
        what: String,
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
    /// Position of the action in the domain. The number of its actions for an operator that is [hidden](Self::is_hidden).
    pub action: usize,
    /// Name as in a plan: `(stack a b)`. Several operators have one name if the action can be done in several ways. Empty
    /// if the operator is [hidden](Self::is_hidden).
    pub name: String,
    /// Fluents that must hold before.
    pub preconditions: Vec<usize>,
    /// Fluents that hold afterwards and may not have held before.
    pub adds: Vec<usize>,
    /// Fluents that do not hold afterwards.
    pub deletes: Vec<usize>,
    /// By how much the operator increases what the problem minimises; 0 if it minimises nothing.
    pub cost: Number,
}

impl GroundOperator {
    /// Returns whether the operator is no action: it makes a fact true that stands for a goal with alternatives. Plans do
    /// not show it.
    pub fn is_hidden(&self) -> bool {
        self.name.is_empty()
    }

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
    /// What was guessed, a sentence each.
    pub warnings: Vec<String>,
}

impl Grounded {
    /// Grounds a problem of its domain.
    ///
    /// Costs O(bindings tried): actions are joined with reachable facts, so preconditions prune early.
    ///
    /// # Errors
    /// [`GroundFault::TooLarge`] beyond 200,000 facts or operators, 50 million steps of joins and comparisons, 1 million choices
    /// of objects for the quantifiers of a condition, 2,048 ways in which a condition can hold, or 2,048 operators of an action
    /// with its objects; [`GroundFault::Unreachable`] for a goal that no plan achieves because no reachable action does.
    pub fn new(domain: &Domain, problem: &Problem) -> Result<Self, GroundFault> {
        Self::written(domain, problem, WRITTEN_WAYS)
    }

    /// Grounds a problem like [`Self::new`], with at most so many ways of a condition written out, up to 2,048. If there are more,
    /// facts stand for its parts. Hidden operators make these facts true, and operators that change what a part is about make them
    /// false.
    ///
    /// # Errors
    /// As for [`Self::new`].
    pub fn with_most_ways(
        domain: &Domain,
        problem: &Problem,
        most: usize,
    ) -> Result<Self, GroundFault> {
        Self::written(domain, problem, [most.min(MAX_WAYS); 2])
    }

    fn written(domain: &Domain, problem: &Problem, most: [usize; 2]) -> Result<Self, GroundFault> {
        let joined = compile(domain, problem, most, true);
        // One call for each choice of objects that must exist may be too many, where one condition can say them all.
        let compiled = match joined {
            Err(fault) if fault.what == CALLS => compile(domain, problem, most, false),
            joined => joined,
        };
        match compiled {
            Ok(grounded) => grounded,
            Err(TooLarge { what, most }) => {
                Err(GroundFault::TooLarge { problem: problem.name.clone(), what, most })
            }
        }
    }

    /// Returns whether all fluents of a set hold in a state.
    pub fn all_hold(state: &BTreeSet<usize>, fluents: &[usize]) -> bool {
        fluents.iter().all(|fluent| state.contains(fluent))
    }

    /// Returns the actions of a plan, a list of positions of operators, without those that are hidden.
    pub fn steps(&self, plan: impl IntoIterator<Item = usize>) -> Vec<&str> {
        let names = plan.into_iter().map(|operator| self.operators[operator].name.as_str());
        names.filter(|name| !name.is_empty()).collect()
    }
}

/// Compiles a problem. Objects that must exist are chosen with those of an action if it `joins` them. The outer error is for its
/// size, the inner for a goal that cannot be reached.
fn compile(
    domain: &Domain,
    problem: &Problem,
    [most_ways, most_recursive]: [usize; 2],
    joins: bool,
) -> Result<Result<Grounded, GroundFault>, TooLarge> {
    let base = Base::new(domain, problem, joins);
    let mut cache: HashMap<Vec<String>, Rc<Fitting>> = HashMap::new();
    let matters = matters(domain, problem);
    let mut schemas = Vec::new();
    for action in &domain.actions {
        let lower = Lower::new(&base, &mut cache, &action.parameters);
        schemas.push(Schema::new(action, lower, &matters)?);
    }
    let mut known = Known::new(&base);
    known.most_ways.set(most_ways);
    known.most_recursive = most_recursive;
    let strata = Strata::new(&domain.derived);
    for rule in &domain.derived {
        let mut lower = Lower::new(&base, &mut cache, &rule.parameters);
        let holds = lower.condition(&rule.condition, true);
        let lacks = lower.condition(&rule.condition, false);
        check_choices(&lower, &holds, || format!("a rule for `{}`", rule.predicate))?;
        let parameters = rule.parameters.len();
        let rule_of = Rule { fitting: lower.fitting, parameters, holds, lacks };
        let place = domain.predicate_of(&rule.predicate, parameters).unwrap_or_default();
        known.rules.entry(place as u32).or_default().push(rule_of);
        let recursive = strata.recursive(&rule.predicate, parameters);
        known.recursive.extend(recursive.map(|stratum| (place as u32, stratum)));
    }
    let mut lower = Lower::new(&base, &mut cache, &[]);
    let goal: Vec<Formula> = problem.conditions.iter().map(|c| lower.condition(c, true)).collect();
    let derived = |fact: &Fact| {
        let place = domain.predicate_of(&fact.predicate, fact.arguments.len());
        place.is_some_and(|place| base.derived[place])
    };
    for formula in &goal {
        check_choices(&lower, formula, || "the goal".to_owned())?;
    }
    let fitting = lower.fitting;
    let mut reach = Reach::new(&schemas, known);
    let calls = reach.explore()?;
    let mut known = reach.known;
    known.settle(&schemas, &calls)?;
    let mut compiled: Vec<Compiled> = Vec::new();
    let mut unpriced = None;
    for (at, call) in calls.iter().enumerate() {
        let (cost, known_all) = cost(&base, problem, &schemas[call.schema], &call.objects);
        if !known_all {
            unpriced = unpriced.or(Some(call));
        }
        let action = || format!("the action `{}`", domain.actions[call.schema].name);
        let schema = &schemas[call.schema];
        let added = known.abridged(|| of_call(&known, schema, at, call, cost, &mut compiled));
        added.map_err(|fault| fault.of(action))?;
        if compiled.len() > MAX_GROUND {
            return Err(TooLarge::new(CALLS, MAX_GROUND));
        }
    }
    let mut of_goal: Vec<(Ground, bool)> = Vec::new();
    let mut parts: Vec<Part> = Vec::new();
    let unreachable = |fluent: &str, why: &str| GroundFault::Unreachable {
        problem: problem.name.clone(),
        fluent: fluent.to_owned(),
        why: why.to_owned(),
    };
    for (formula, condition) in goal.iter().zip(&problem.conditions) {
        let name = short(&ShownCondition(condition, &[]).to_string());
        let found = known
            .abridged(|| known.conjuncts(formula, &fitting, &mut vec![UNBOUND; fitting.len()]));
        let found = found.map_err(|fault| fault.of(|| "the goal".into()))?;
        parts.extend(found.into_iter().map(|ways| (ways, name.clone())));
    }
    for (holds, fact) in &problem.goal {
        let Some(ground) = base.ground(fact) else {
            if *holds {
                let why = "the problem has no such predicate or objects";
                return Ok(Err(unreachable(&fact.to_string(), why)));
            }
            continue;
        };
        if !derived(fact) {
            of_goal.push((ground, *holds));
            continue;
        }
        let found = known.abridged(|| known.derived_ways(ground.clone(), *holds));
        let found = found.map_err(|fault| fault.of(|| "the goal".into()))?;
        parts.push((found.to_vec(), Fluent { fact: fact.clone(), holds: *holds }.to_string()));
    }
    if let Some((_, name)) = parts.iter().find(|(ways, _)| ways.is_empty()) {
        return Ok(Err(unreachable(name, "it holds in no state that the actions can reach")));
    }
    let whole = |(ways, name): &Part| match ways.as_slice() {
        [way] => Some((way.clone(), name.clone())),
        _ => None,
    };
    let named = parts.iter().filter_map(whole).collect();
    known.most_ways.set(MAX_WAYS);
    let parts = match known.parts(parts).map_err(|fault| fault.of(|| "the goal".into()))? {
        Ok(parts) => parts,
        Err(name) => return Ok(Err(unreachable(&name, "it contradicts another part of the goal"))),
    };
    let stood_for = known.parts_stood_for();
    let ways = parts.iter().map(|(ways, _)| ways).chain(&stood_for);
    if compiled.len() + ways.map(Vec::len).sum::<usize>() > MAX_GROUND {
        return Err(TooLarge::new("reachable actions, and ways to meet conditions", MAX_GROUND));
    }
    let mut assembly = Assembly {
        known: &known,
        schemas: &schemas,
        calls: &calls,
        problem,
        compiled,
        stood_for,
        named,
    };
    let mut grounded = assembly.grounded(of_goal, &parts);
    if let (Ok(grounded), Some(call)) = (&mut grounded, unpriced) {
        grounded.warnings.push(format!(
            "the problem gives no value for a part of the cost of `{}`; such parts are counted as 0",
            assembly.name(call)
        ));
    }
    Ok(grounded)
}

/// Returns which predicates some condition, the goal, or an effect without condition names.
fn matters(domain: &Domain, problem: &Problem) -> Vec<bool> {
    let mut matters = vec![false; domain.predicates.len()];
    let mut see = |name: &str, arguments: usize| {
        if let Some(place) = domain.predicate_of(name, arguments) {
            matters[place] = true;
        }
    };
    let mut literal = |l: &Literal| see(&l.atom.predicate, l.atom.arguments.len());
    for action in &domain.actions {
        action.preconditions.iter().chain(&action.effects).for_each(&mut literal);
        let conditional = action.conditional.iter().map(|effect| &effect.condition);
        action.conditions.iter().chain(conditional).for_each(|c| c.literals(&mut literal));
    }
    let rules = domain.derived.iter().map(|rule| &rule.condition);
    rules.chain(&problem.conditions).for_each(|c| c.literals(&mut literal));
    for (_, fact) in &problem.goal {
        see(&fact.predicate, fact.arguments.len());
    }
    matters
}

/// Returns the cost of an action with its objects, and whether the problem gives all parts of it.
fn cost(base: &Base<'_>, problem: &Problem, schema: &Schema, objects: &[u32]) -> (Number, bool) {
    let Some(metric) = &problem.metric else { return (Number::default(), true) };
    let slots: Vec<usize> = (0..schema.parameters).collect();
    let own = |increase: &&super::Increase| {
        let function = &increase.function;
        function.predicate == metric.predicate
            && function.arguments.len() == metric.arguments.len()
            && function.arguments.iter().zip(&metric.arguments).all(|(term, name)| match term {
                super::Term::Constant(own) => own == name,
                super::Term::Parameter(at) => slots
                    .get(*at)
                    .is_some_and(|slot| base.objects[objects[*slot] as usize].name == *name),
            })
    };
    let amounts = schema.increases.iter().filter(own);
    let amounts: Vec<_> = amounts.map(|i| base.value(&i.amount, &slots, objects)).collect();
    let sum = amounts.iter().flatten().map(|amount| amount.value()).sum();
    (Number::new(sum).unwrap_or_default(), amounts.iter().all(Option::is_some))
}
