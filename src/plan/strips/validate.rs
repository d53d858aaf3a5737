//! Checks plans: carries out a plan by the action schemas and says where it fails.
//!
//! This does not use the grounded problem, and judges conditions by their meaning, so that it can find faults of the
//! compilation and of the grounding as well as of planners.

use std::collections::{BTreeMap, BTreeSet};

use thiserror::Error;

use super::formula::Condition;
use super::ground::Fluent;
use super::pddl::{Domain, Fact, Problem, Typed};
use super::sexpr::short;
use super::truth::{State, World};
use super::write::ShownCondition;
use crate::sim::{meant, nearest_first};

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
    #[error("after the last step, {} of the goal {}", few(.missing), if .missing.len() == 1 { "does not hold" } else { "do not hold" })]
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
    let world = World::new(domain, problem);
    let objects: BTreeMap<&str, &Typed> =
        world.objects.iter().map(|o| (o.name.as_str(), *o)).collect();
    let mut state = State::new(problem.init.iter().cloned().collect());
    for (index, call) in plan.into_iter().enumerate() {
        let step = index + 1;
        let no = |reason: String| PlanFault::NoAction { step, action: call.into(), reason };
        let inner = call.trim().strip_prefix('(').and_then(|rest| rest.strip_suffix(')'));
        let words = inner.unwrap_or_default().to_lowercase();
        let mut words = words.split_whitespace();
        let name = words.next().ok_or_else(|| no("expected (ACTION OBJECT ...)".into()))?;
        let Some(action) = domain.actions.iter().find(|action| action.name == name) else {
            let names = domain.actions.iter().map(|a| a.name.as_str());
            let (near, names) = (meant(name, names.clone()), nearest_first(name, names));
            return Err(no(format!("expected one of: {names}{near}")));
        };
        let arguments: Vec<&str> = words.collect();
        let (given, wanted) = (arguments.len(), action.parameters.len());
        if given != wanted {
            return Err(no(format!("it has {given} objects; expected {wanted}")));
        }
        for (argument, parameter) in arguments.iter().zip(&action.parameters) {
            match objects.get(argument) {
                None => return Err(no(format!("`{argument}` is no object"))),
                Some(object) if !domain.types.may_be(&object.types, &parameter.types) => {
                    let kinds = (object.types.join(" or "), parameter.types.join(" or "));
                    let reason =
                        format!("`{argument}` is of type {}; expected {}", kinds.0, kinds.1);
                    return Err(no(reason));
                }
                Some(_) => {}
            }
        }
        let names: Vec<&str> = action.parameters.iter().map(|p| p.name.as_str()).collect();
        for condition in &action.preconditions {
            if !world.literal(condition, &arguments, &mut state) {
                let fact = World::fact(&condition.atom, &arguments);
                let condition = Fluent { fact, holds: condition.positive }.to_string();
                return Err(PlanFault::Unmet { step, action: call.into(), condition });
            }
        }
        for condition in &action.conditions {
            if !world.holds(condition, &mut arguments.clone(), &mut state) {
                let condition = short(&ShownCondition(condition, &names).to_string());
                return Err(PlanFault::Unmet { step, action: call.into(), condition });
            }
        }
        world.apply(action, &arguments, &mut state);
    }
    let mut missing = Vec::new();
    for (holds, fact) in &problem.goal {
        let atom = super::Atom {
            predicate: fact.predicate.clone(),
            arguments: fact.arguments.iter().cloned().map(super::Term::Constant).collect(),
        };
        if !world.literal(&super::Literal { positive: *holds, atom }, &[], &mut state) {
            missing.push(Fluent { fact: fact.clone(), holds: *holds }.to_string());
        }
    }
    let of_goal = |condition: &Condition| short(&ShownCondition(condition, &[]).to_string());
    for condition in &problem.conditions {
        if !world.holds(condition, &mut Vec::new(), &mut state) {
            missing.push(of_goal(condition));
        }
    }
    if missing.is_empty() { Ok(state.facts) } else { Err(PlanFault::Goal { missing }) }
}

/// Greatest number of parts of a goal that a sentence names.
const FEW: usize = 3;

/// Joins the first parts of a goal, and says how many more there are.
fn few(parts: &[String]) -> String {
    match parts.len().saturating_sub(FEW) {
        0 => parts.join(" and "),
        more => format!("{} and {more} more", parts[..FEW].join(", ")),
    }
}
