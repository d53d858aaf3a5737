//! Learns an action model from trajectories.
//!
//! States are observed completely and without noise. The domain gives types, predicates, and the names and parameters of
//! the actions. Its preconditions and effects are not used.
//!
//! Both rules start from safe action model learning (B. Juba, H. S. Le and R. Stern, "Safe learning of lifted action
//! models", KR 2021): a literal over an action's parameters and the domain's constants can be a precondition only if it
//! held before every step, and it is an effect if some step changed it. [`Rule::Evidence`] also learns from steps that
//! name one object twice, leaves out preconditions that say nothing, and tells which of the others are supported.
//! The domain's requirements decide whether negative preconditions are learned.

mod effects;
mod evidence;
mod report;
mod vocabulary;

use std::collections::BTreeSet;

use thiserror::Error;

use crate::plan::strips::{Action, Domain, GroundAtom, Literal, Trajectory, Typed};

use effects::{from_all_steps, from_safe_steps};
use evidence::{Candidate, Observed, Weighing};
use vocabulary::{Bound, vocabulary};

/// How preconditions and effects are chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Rule {
    /// Weighs the evidence for every literal.
    #[default]
    Evidence,
    /// Safe action model learning: every literal that always held is a precondition. Steps that change nothing or name
    /// one object twice are not used.
    Safe,
}

/// Trajectories from which nothing can be learned.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum LearnError {
    /// No trajectory has a step that was done.
    #[error(
        "the trajectories have no step that was done; expected at least one action between two states"
    )]
    NoStep,
    /// An action has too many parameters for the arguments of the predicates.
    #[error(
        "the action `{action}` has more than {} atoms over its parameters; expected fewer parameters or arguments",
        vocabulary::MAX_ATOMS
    )]
    TooManyAtoms {
        /// Name of the action.
        action: String,
    },
}

/// Why a precondition is required, undecided or left out.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Reason {
    /// The literal always held before the action. Rule [`Rule::Safe`] asks for nothing more.
    Held,
    /// The action makes the literal false.
    Changed,
    /// The action was refused where only this literal did not hold.
    Refused {
        /// Number of such steps.
        steps: usize,
    },
    /// The literal would hardly have held each time by chance.
    Selective {
        /// Probability that it would have.
        chance: f64,
        /// Number of different objects for which it held.
        instances: usize,
    },
    /// The literal could have held each time by chance.
    Chance {
        /// Probability that it would have.
        chance: f64,
        /// Number of different objects for which it held.
        instances: usize,
    },
    /// The literal follows from another literal of the action.
    Follows {
        /// The other literal.
        from: Literal,
        /// Number of different objects for which this was seen.
        instances: usize,
    },
    /// The literal and another one with the same arguments in another order follow from each other.
    SameAs {
        /// The other literal.
        other: Literal,
        /// Number of different objects for which this was seen.
        instances: usize,
    },
}

impl Reason {
    /// Returns whether the reason is evidence that the literal is a precondition.
    pub fn is_required(&self) -> bool {
        matches!(self, Self::Held | Self::Changed | Self::Refused { .. } | Self::Selective { .. })
    }
}

/// A literal that held before every step of an action.
#[derive(Debug, Clone, PartialEq)]
pub struct Precondition {
    /// The literal.
    pub literal: Literal,
    /// Whether it is a precondition of the learned action.
    pub kept: bool,
    /// Why it is required, undecided or left out.
    pub reason: Reason,
}

/// What was learned about one action.
#[derive(Debug, Clone, PartialEq)]
pub struct LearnedAction {
    /// Name.
    pub name: String,
    /// Parameters, in order.
    pub parameters: Vec<Typed>,
    /// Literals that always held: required, undecided, or left out. Empty if the action was never done.
    pub preconditions: Vec<Precondition>,
    /// Atoms that the action makes true.
    pub add: Vec<Literal>,
    /// Atoms that the action makes false, as negative literals.
    pub delete: Vec<Literal>,
    /// Number of steps that were used.
    pub steps: usize,
    /// Number of steps that were refused.
    pub refused: usize,
    /// Number of changes that no atom over the action's parameters explains.
    pub unexplained: usize,
    /// Number of changes that several such atoms explain.
    pub ambiguous: usize,
}

impl LearnedAction {
    /// Returns the action schema.
    pub fn action(&self) -> Action {
        let kept = self.preconditions.iter().filter(|p| p.kept);
        Action {
            name: self.name.clone(),
            parameters: self.parameters.clone(),
            preconditions: kept.map(|p| p.literal.clone()).collect(),
            effects: self.add.iter().chain(&self.delete).cloned().collect(),
            ..Action::default()
        }
    }
}

/// A learned action model. Its `Display` is PDDL with comments.
#[derive(Debug, Clone, PartialEq)]
pub struct LearnedModel {
    /// The given domain, with its own actions.
    given: Domain,
    /// The actions, in the order of the given domain.
    pub actions: Vec<LearnedAction>,
    /// Number of trajectories.
    pub trajectories: usize,
}

impl LearnedModel {
    /// Returns the learned domain. It has only the actions that were done.
    pub fn domain(&self) -> Domain {
        let done = self.actions.iter().filter(|a| a.steps > 0);
        Domain { actions: done.map(LearnedAction::action).collect(), ..self.given.clone() }
    }
}

/// A step with the states before and after it.
#[derive(Debug, Clone, Copy)]
struct Seen<'a> {
    trajectory: usize,
    arguments: &'a [usize],
    before: &'a BTreeSet<GroundAtom>,
    after: &'a BTreeSet<GroundAtom>,
}

impl Seen<'_> {
    fn added(&self) -> Vec<GroundAtom> {
        self.after.difference(self.before).cloned().collect()
    }

    fn deleted(&self) -> Vec<GroundAtom> {
        self.before.difference(self.after).cloned().collect()
    }

    /// Returns whether a literal held before the step.
    fn holds(&self, bound: &Bound, positive: bool) -> bool {
        self.before.contains(&bound.ground(self.arguments)) == positive
    }

    /// Returns whether safe action model learning can use the step.
    fn is_safe(&self) -> bool {
        let distinct: BTreeSet<&usize> = self.arguments.iter().collect();
        distinct.len() == self.arguments.len() && self.before != self.after
    }
}

/// Learns the actions of a domain from trajectories.
///
/// The cost grows with the number of states, and for [`Rule::Evidence`] with the square of the number of literals that
/// always held before an action.
///
/// # Errors
/// [`LearnError`] if no step was done or an action has too many literals.
pub fn learn(
    domain: &Domain,
    trajectories: &[Trajectory],
    rule: Rule,
) -> Result<LearnedModel, LearnError> {
    if trajectories.iter().flat_map(|t| &t.steps).all(|step| !step.succeeded) {
        return Err(LearnError::NoStep);
    }
    let observed = Observed::new(domain, trajectories);
    let actions = domain
        .actions
        .iter()
        .enumerate()
        .map(|(index, action)| learn_action(&observed, domain, trajectories, (index, action), rule))
        .collect::<Result<_, _>>()?;
    Ok(LearnedModel { given: domain.clone(), actions, trajectories: trajectories.len() })
}

fn learn_action(
    observed: &Observed<'_>,
    domain: &Domain,
    trajectories: &[Trajectory],
    (index, action): (usize, &Action),
    rule: Rule,
) -> Result<LearnedAction, LearnError> {
    let (mut seen, mut refused) = (Vec::new(), Vec::new());
    for (number, trajectory) in trajectories.iter().enumerate() {
        for (at, step) in trajectory.steps.iter().enumerate().filter(|(_, s)| s.action == index) {
            let entry = Seen {
                trajectory: number,
                arguments: &step.arguments,
                before: &trajectory.states[at],
                after: &trajectory.states[at + 1],
            };
            match step.succeeded {
                true => seen.push(entry),
                false => refused.push(entry),
            }
        }
    }
    if rule == Rule::Safe {
        seen.retain(Seen::is_safe);
    }
    let vocabulary = if seen.is_empty() { Vec::new() } else { vocabulary(domain, action)? };
    let held = held(domain, &vocabulary, &seen);
    let literal = |candidate: &Candidate| candidate.literal(domain, &vocabulary);
    let (effects, preconditions) = match rule {
        Rule::Safe => {
            let effects = from_safe_steps(&vocabulary, &seen);
            let safe = |candidate: &Candidate| Precondition {
                literal: literal(candidate),
                kept: true,
                reason: Reason::Held,
            };
            (effects, held.iter().map(safe).collect())
        }
        Rule::Evidence => {
            let before = held.iter().filter(|c| c.positive).map(|c| c.index).collect();
            let effects = from_all_steps(&vocabulary, &seen, &before);
            let weighing = Weighing {
                observed,
                fitting: observed.fitting(action),
                vocabulary: &vocabulary,
                seen: &seen,
                refused: &refused,
                effects: &effects,
            };
            let weighed = weighing.weigh(&held);
            (effects, weighed)
        }
    };
    let named = |effects: &BTreeSet<usize>, positive: bool| {
        effects.iter().map(|index| literal(&Candidate { positive, index: *index })).collect()
    };
    Ok(LearnedAction {
        name: action.name.clone(),
        parameters: action.parameters.clone(),
        preconditions,
        add: named(&effects.add, true),
        delete: named(&effects.delete, false),
        steps: seen.len(),
        refused: refused.len(),
        unexplained: effects.unexplained,
        ambiguous: effects.ambiguous,
    })
}

/// Returns the literals that held before every step. Negative literals need a domain that allows them.
fn held(domain: &Domain, vocabulary: &[Bound], seen: &[Seen<'_>]) -> Vec<Candidate> {
    let signs: &[bool] =
        if domain.allows_negative_preconditions() { &[true, false] } else { &[true] };
    let always = |c: &Candidate| seen.iter().all(|s| s.holds(&vocabulary[c.index], c.positive));
    let all = signs.iter().flat_map(|positive| {
        (0..vocabulary.len()).map(|index| Candidate { positive: *positive, index })
    });
    all.filter(always).collect()
}
