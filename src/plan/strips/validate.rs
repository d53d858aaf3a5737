//! Checks plans: carries out a plan by the action schemas and says where it fails.
//!
//! This does not use the grounded problem, so that it can find faults of the grounding as well as of planners.

use std::collections::{BTreeMap, BTreeSet};

use thiserror::Error;

use super::ground::Fluent;
use super::pddl::{Domain, EQUAL, Fact, Problem, Term, Typed};

/// Why a plan is not valid.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum PlanFault {
    /// A step is not an action of the domain with objects of the problem.
    #[error("step {step}, `{action}`, is no action of the domain: {reason}")]
    NoAction {
        /// Number of the step, counted from 1.
        step: usize,
        /// The step.
        action: String,
        /// What is wrong.
        reason: String,
    },
    /// A precondition does not hold.
    #[error("step {step}, `{action}`, needs {condition}, which does not hold")]
    Unmet {
        /// Number of the step, counted from 1.
        step: usize,
        /// The step.
        action: String,
        /// The precondition.
        condition: String,
    },
    /// The goal does not hold after the last step.
    #[error("after the last step, {} of the goal does not hold", .missing.join(" and "))]
    Goal {
        /// The parts of the goal that do not hold.
        missing: Vec<String>,
    },
}

/// Carries out a plan, a list of calls such as `(stack a b)`. Returns the facts that hold after it.
///
/// # Errors
/// [`PlanFault`] for the first step that cannot be carried out, or for a goal that does not hold at the end.
pub fn validate<'s>(
    domain: &Domain,
    problem: &Problem,
    plan: impl IntoIterator<Item = &'s str>,
) -> Result<BTreeSet<Fact>, PlanFault> {
    let objects: BTreeMap<&str, &Typed> =
        domain.constants.iter().chain(&problem.objects).map(|o| (o.name.as_str(), o)).collect();
    let mut state: BTreeSet<Fact> = problem.init.iter().cloned().collect();
    for (index, call) in plan.into_iter().enumerate() {
        let step = index + 1;
        let no = |reason: String| PlanFault::NoAction { step, action: call.into(), reason };
        let inner = call.trim().strip_prefix('(').and_then(|rest| rest.strip_suffix(')'));
        let words = inner.unwrap_or_default().to_lowercase();
        let mut words = words.split_whitespace();
        let name = words.next().ok_or_else(|| no("expected (ACTION OBJECT ...)".into()))?;
        let Some(action) = domain.actions.iter().find(|action| action.name == name) else {
            let names: Vec<&str> = domain.actions.iter().map(|a| a.name.as_str()).collect();
            return Err(no(format!("expected one of: {}", names.join(", "))));
        };
        let arguments: Vec<&str> = words.collect();
        let (given, wanted) = (arguments.len(), action.parameters.len());
        if given != wanted {
            return Err(no(format!("it has {given} objects; expected {wanted}")));
        }
        for (argument, parameter) in arguments.iter().zip(&action.parameters) {
            match objects.get(argument) {
                None => return Err(no(format!("`{argument}` is no object"))),
                Some(object) if !domain.types.fits(&object.types, &parameter.types) => {
                    let kinds = (object.types.join(" or "), parameter.types.join(" or "));
                    let reason =
                        format!("`{argument}` is of type {}; expected {}", kinds.0, kinds.1);
                    return Err(no(reason));
                }
                Some(_) => {}
            }
        }
        let word = |term: &Term| match term {
            Term::Parameter(position) => {
                arguments.get(*position).copied().unwrap_or_default().to_owned()
            }
            Term::Constant(name) => name.clone(),
        };
        let fact = |atom: &super::pddl::Atom| Fact {
            predicate: atom.predicate.clone(),
            arguments: atom.arguments.iter().map(word).collect(),
        };
        for condition in &action.preconditions {
            let fact = fact(&condition.atom);
            let holds = match fact.predicate == EQUAL {
                true => fact.arguments.first() == fact.arguments.get(1),
                false => state.contains(&fact),
            };
            if holds != condition.positive {
                let condition = Fluent { fact, holds: condition.positive }.to_string();
                return Err(PlanFault::Unmet { step, action: call.into(), condition });
            }
        }
        for effect in action.effects.iter().filter(|effect| !effect.positive) {
            state.remove(&fact(&effect.atom));
        }
        for effect in action.effects.iter().filter(|effect| effect.positive) {
            state.insert(fact(&effect.atom));
        }
    }
    let unmet = problem.goal.iter().filter(|(holds, fact)| state.contains(fact) != *holds);
    let show = |(holds, fact): &(bool, Fact)| Fluent { fact: fact.clone(), holds: *holds };
    let missing: Vec<String> = unmet.map(|goal| show(goal).to_string()).collect();
    if missing.is_empty() { Ok(state) } else { Err(PlanFault::Goal { missing }) }
}
