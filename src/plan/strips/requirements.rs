//! The requirements of what a domain or a problem uses.

use super::formula::Condition;
use super::pddl::{Action, Domain, EQUAL, Literal, Problem};

impl Domain {
    /// Returns the requirements of the types and actions.
    pub(crate) fn used(&self) -> Vec<String> {
        let mut seen = Seen::default();
        seen.0[0] = !self.types.declared().is_empty();
        self.actions.iter().for_each(|action| seen.action(action));
        seen.requirements()
    }
}

impl Problem {
    /// Returns the requirements of the objects and the goal.
    pub(crate) fn used(&self, domain: &Domain) -> Vec<String> {
        let mut seen = Seen::default();
        seen.0[0] = !domain.types.declared().is_empty();
        seen.0[1] = self.goal.iter().any(|(holds, _)| !holds);
        self.conditions.iter().for_each(|condition| seen.condition(condition));
        seen.requirements()
    }
}

/// What conditions and effects use of PDDL.
#[derive(Default)]
struct Seen([bool; 7]);

impl Seen {
    const ALL: [&'static str; 7] = [
        ":typing",
        ":negative-preconditions",
        ":disjunctive-preconditions",
        ":equality",
        ":existential-preconditions",
        ":universal-preconditions",
        ":conditional-effects",
    ];

    fn literal(&mut self, literal: &Literal) {
        self.0[1] |= !literal.positive;
        self.0[3] |= literal.atom.predicate == EQUAL;
    }

    fn condition(&mut self, condition: &Condition) {
        match condition {
            Condition::Literal(l) => self.literal(l),
            Condition::Compare(..) => {}
            Condition::Not(inner) => {
                self.0[1] = true;
                self.condition(inner);
            }
            Condition::All(parts) => parts.iter().for_each(|part| self.condition(part)),
            Condition::Any(parts) => {
                self.0[2] = true;
                parts.iter().for_each(|part| self.condition(part));
            }
            Condition::Exists(_, inner) | Condition::Forall(_, inner) => {
                self.0[if matches!(condition, Condition::Exists(..)) { 4 } else { 5 }] = true;
                self.condition(inner);
            }
        }
    }

    fn action(&mut self, action: &Action) {
        action.preconditions.iter().for_each(|l| self.literal(l));
        action.conditions.iter().for_each(|c| self.condition(c));
        for effect in &action.conditional {
            self.0[6] = true;
            self.condition(&effect.condition);
        }
    }

    fn requirements(&self) -> Vec<String> {
        let used = Self::ALL.iter().zip(self.0).filter(|(_, used)| *used);
        [":strips"].into_iter().chain(used.map(|(name, _)| *name)).map(str::to_owned).collect()
    }
}
