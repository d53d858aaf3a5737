//! The requirements of what a domain or a problem uses.

use std::collections::BTreeSet;

use super::formula::Condition;
use super::pddl::{Action, Domain, EQUAL, Literal, Problem, Types};

/// Requirements in the order in which they are written.
const ALL: [&str; 8] =
    [STRIPS, TYPING, NEGATIVE, DISJUNCTIVE, EQUALITY, EXISTENTIAL, UNIVERSAL, CONDITIONAL];
const STRIPS: &str = ":strips";
const TYPING: &str = ":typing";
const NEGATIVE: &str = ":negative-preconditions";
const DISJUNCTIVE: &str = ":disjunctive-preconditions";
const EQUALITY: &str = ":equality";
const EXISTENTIAL: &str = ":existential-preconditions";
const UNIVERSAL: &str = ":universal-preconditions";
const CONDITIONAL: &str = ":conditional-effects";

impl Domain {
    /// Returns the requirements of the types and actions.
    pub(crate) fn used(&self) -> Vec<String> {
        let mut used = Used::new(&self.types);
        self.actions.iter().for_each(|action| used.action(action));
        used.requirements()
    }
}

impl Problem {
    /// Returns the requirements of the objects and the goal.
    pub(crate) fn used(&self, domain: &Domain) -> Vec<String> {
        let mut used = Used::new(&domain.types);
        if self.goal.iter().any(|(holds, _)| !holds) {
            used.0.insert(NEGATIVE);
        }
        self.conditions.iter().for_each(|condition| used.condition(condition));
        used.requirements()
    }
}

/// What types, conditions and effects use of PDDL.
struct Used(BTreeSet<&'static str>);

impl Used {
    fn new(types: &Types) -> Self {
        let typing = (!types.declared().is_empty()).then_some(TYPING);
        Self([STRIPS].into_iter().chain(typing).collect())
    }

    fn literal(&mut self, literal: &Literal) {
        self.0.extend((!literal.positive).then_some(NEGATIVE));
        self.0.extend((literal.atom.predicate == EQUAL).then_some(EQUALITY));
    }

    fn condition(&mut self, condition: &Condition) {
        match condition {
            Condition::Literal(l) => self.literal(l),
            Condition::Compare(..) => {}
            Condition::Not(inner) => {
                self.0.insert(NEGATIVE);
                self.condition(inner);
            }
            Condition::All(parts) => parts.iter().for_each(|part| self.condition(part)),
            Condition::Any(parts) => {
                self.0.insert(DISJUNCTIVE);
                parts.iter().for_each(|part| self.condition(part));
            }
            Condition::Exists(_, inner) => {
                self.0.insert(EXISTENTIAL);
                self.condition(inner);
            }
            Condition::Forall(_, inner) => {
                self.0.insert(UNIVERSAL);
                self.condition(inner);
            }
        }
    }

    fn action(&mut self, action: &Action) {
        action.preconditions.iter().for_each(|l| self.literal(l));
        action.conditions.iter().for_each(|c| self.condition(c));
        for effect in &action.conditional {
            self.0.insert(CONDITIONAL);
            self.condition(&effect.condition);
        }
    }

    fn requirements(&self) -> Vec<String> {
        ALL.iter().filter(|name| self.0.contains(*name)).map(|name| (*name).to_owned()).collect()
    }
}
