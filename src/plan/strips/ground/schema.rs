//! Actions with numbers in place of names, and the ways in which their conditions are joined with facts.

use std::collections::HashMap;
use std::rc::Rc;

use super::TooLarge;
use super::lower::{Atom, Base, Fitting, Formula, Lower};
use crate::plan::strips::formula::{Condition, Increase};
use crate::plan::strips::pddl::{self, Action, Literal};

/// Greatest number of variants of one action. Further alternatives are tried after its objects are chosen.
const MAX_VARIANTS: usize = 32;

/// Greatest number of atoms in a condition that is split into variants.
const MAX_SPLIT: usize = 1_000;

/// One way to read the condition of an action: facts that must hold, and what else.
#[derive(Clone, Default)]
pub(super) struct Variant {
    /// The slots that are bound: parameters, and variables of which some objects must exist.
    pub slots: Vec<usize>,
    pub needs: Vec<Atom>,
    pub checks: Vec<Formula>,
}

/// Effects for each choice of objects for slots, under a condition.
pub(super) struct Effect {
    pub slots: Vec<usize>,
    pub holds: Formula,
    pub lacks: Formula,
    /// Atoms, with whether they become true.
    pub effects: Vec<(Atom, bool)>,
}

/// An action with numbers in place of names.
pub(super) struct Schema {
    pub parameters: usize,
    pub fitting: Vec<Rc<Fitting>>,
    pub variants: Vec<Variant>,
    pub effects: Vec<(Atom, bool)>,
    pub conditional: Vec<Effect>,
    /// Costs, with the slots of their parameters.
    pub increases: Vec<Increase>,
}

/// Returns whether reached facts choose objects for a condition. Otherwise all choices would be calls of their own.
fn joined(formula: &Formula, base: &Base<'_>) -> bool {
    match formula {
        Formula::Fact(atom, holds) => *holds && !base.derived[atom.predicate as usize],
        Formula::All(parts) => parts.iter().any(|part| joined(part, base)),
        Formula::Any(parts) => parts.iter().all(|part| joined(part, base)),
        Formula::Each { all, inner, .. } => !all && base.joins && joined(inner, base),
        Formula::Same(..) | Formula::Compare(..) => false,
    }
}

impl Variant {
    /// Splits a condition into variants. What has too many alternatives stays a check.
    fn split(mut self, formula: &Formula, base: &Base<'_>) -> Vec<Self> {
        match formula {
            Formula::Fact(atom, true) if !base.derived[atom.predicate as usize] => {
                self.needs.push(atom.clone());
            }
            Formula::All(parts) => {
                let (plain, rest): (Vec<_>, Vec<_>) =
                    parts.iter().partition(|p| matches!(p, Formula::Fact(..) | Formula::Same(..)));
                let mut all = vec![self];
                for part in plain {
                    let split = all.into_iter().flat_map(|variant| variant.split(part, base));
                    all = split.collect();
                }
                for variant in &mut all {
                    let mut seen: Vec<Atom> = Vec::new();
                    if variant.needs.len() < MAX_SPLIT {
                        variant.needs.retain(|need| {
                            let fresh = !seen.contains(need);
                            seen.push(need.clone());
                            fresh
                        });
                    }
                }
                let mut full = false;
                for part in rest {
                    if let (false, [_]) = (full, all.as_slice()) {
                        all = all.swap_remove(0).split(part, base);
                        continue;
                    }
                    let next = all.iter().flat_map(|variant| variant.clone().split(part, base));
                    let next: Vec<Self> = match full {
                        true => Vec::new(),
                        false => next.take(MAX_VARIANTS + 1).collect(),
                    };
                    full = full || next.len() > MAX_VARIANTS;
                    match full {
                        true => all.iter_mut().for_each(|v| v.checks.push(part.clone())),
                        false => all = next,
                    }
                }
                return all;
            }
            Formula::Any(parts) if parts.len() <= MAX_VARIANTS => {
                let split = parts.iter().flat_map(|part| self.clone().split(part, base));
                let split: Vec<Self> = split.take(MAX_VARIANTS + 1).collect();
                if split.len() <= MAX_VARIANTS {
                    return split;
                }
                self.checks.push(formula.clone());
            }
            Formula::Each { all: false, slots, inner } if base.joins && joined(inner, base) => {
                self.slots.extend(slots);
                return self.split(inner, base);
            }
            other => self.checks.push(other.clone()),
        }
        vec![self]
    }
}

impl Schema {
    /// Lowers an action. `matters` says which predicates some condition names.
    pub fn new(
        action: &Action,
        mut lower: Lower<'_, '_>,
        matters: &[bool],
    ) -> Result<Self, TooLarge> {
        let base = lower.base;
        let mut parts: Vec<Formula> =
            action.preconditions.iter().map(|literal| lower.literal(literal, true)).collect();
        parts.extend(action.conditions.iter().map(|c| lower.condition(c, true)));
        let slots: Vec<usize> = (0..action.parameters.len()).collect();
        let whole = Variant { slots, ..Variant::default() };
        let variants = match parts.iter().map(Formula::size).sum::<usize>() {
            0..=MAX_SPLIT => whole.split(&Formula::All(parts), base),
            // A condition of this size was made by a program.
            _ => vec![parts.into_iter().fold(whole, |mut whole, part| {
                match part {
                    Formula::Fact(atom, true) if !base.derived[atom.predicate as usize] => {
                        whole.needs.push(atom);
                    }
                    other => whole.checks.push(other),
                }
                whole
            })],
        };
        for check in variants.iter().flat_map(|variant| &variant.checks) {
            check_choices(&lower, check, || {
                format!("a condition of the action `{}`", action.name)
            })?;
        }
        let effect = |lower: &Lower<'_, '_>, effect: &Literal| {
            lower.atom(&effect.atom).map(|atom| (atom, effect.positive))
        };
        let effects = action.effects.iter().filter_map(|e| effect(&lower, e)).collect();
        let mut conditional: Vec<Effect> = Vec::new();
        for given in &action.conditional {
            let depth = lower.scope.len();
            let slots = lower.open(&given.variables);
            // Effects under the same condition belong together.
            let mut known: HashMap<Option<&pddl::Atom>, usize> = HashMap::new();
            for literal in &given.effects {
                let Some((atom, positive)) = effect(&lower, literal) else { continue };
                if !matters[atom.predicate as usize] {
                    continue;
                }
                let less = simplified(&given.condition, literal, action);
                let key = less.is_some().then_some(&literal.atom);
                if let Some(at) = known.get(&key) {
                    conditional[*at].effects.push((atom, positive));
                    continue;
                }
                let condition = less.as_ref().unwrap_or(&given.condition);
                let holds = lower.condition(condition, true);
                let lacks = lower.condition(condition, false);
                let each = lower.sizes(&slots).saturating_mul(lower.choices(&holds).max(1));
                refuse_choices(each, || format!("an effect of the action `{}`", action.name))?;
                known.insert(key, conditional.len());
                let effects = vec![(atom, positive)];
                conditional.push(Effect { slots: slots.clone(), holds, lacks, effects });
            }
            lower.scope.truncate(depth);
        }
        Ok(Self {
            parameters: action.parameters.len(),
            fitting: lower.fitting,
            variants,
            effects,
            conditional,
            increases: action.increases.clone(),
        })
    }
}

/// Returns the condition of an effect without what says nothing, if there is such a part: to make false what is false
/// changes nothing, so that it need not have been true.
fn simplified(condition: &Condition, effect: &Literal, action: &Action) -> Option<Condition> {
    let opposite = |part: &Condition| match part {
        Condition::Literal(l) => l.atom == effect.atom && l.positive != effect.positive,
        _ => false,
    };
    let parts = match condition {
        Condition::All(parts) if parts.len() < MAX_SPLIT => parts.as_slice(),
        one => std::slice::from_ref(one),
    };
    if !parts.iter().any(opposite) {
        return None;
    }
    // What is made true and false is true, so that to make it true can change more.
    let conditional = action.conditional.iter().flat_map(|c| &c.effects);
    let other = |e: &Literal| !e.positive && e.atom.predicate == effect.atom.predicate;
    if effect.positive && action.effects.iter().chain(conditional).any(other) {
        return None;
    }
    Some(Condition::All(parts.iter().filter(|part| !opposite(part)).cloned().collect()))
}

/// Greatest number of choices of objects for the quantifiers of one condition.
const MAX_CHOICES: u128 = 1_000_000;

pub(super) fn check_choices(
    lower: &Lower<'_, '_>,
    formula: &Formula,
    what: impl Fn() -> String,
) -> Result<(), TooLarge> {
    refuse_choices(lower.choices(formula), what)
}

fn refuse_choices(choices: u128, what: impl Fn() -> String) -> Result<(), TooLarge> {
    if choices <= MAX_CHOICES {
        return Ok(());
    }
    let count = match choices {
        u128::MAX => "more than 10^38".to_owned(),
        count => count.to_string(),
    };
    let what = format!("choices of objects in {} ({count})", what());
    Err(TooLarge { what, most: MAX_CHOICES as usize })
}
