//! Prints a learned model as PDDL, with its evidence as comments.

use std::fmt::{self, Display, Formatter};

use super::{LearnedAction, LearnedModel, Precondition, Reason};
use crate::plan::strips::Shown;
use crate::plan::strips::{Literal, Typed};

/// Formats a count with its noun.
fn counted(number: usize, what: &str) -> String {
    if number == 1 { format!("1 {what}") } else { format!("{number} {what}s") }
}

impl Precondition {
    /// Returns the reason in words, with its counts.
    pub fn explanation(&self, parameters: &[Typed]) -> String {
        let show = |literal: &Literal| Shown { literal, parameters }.to_string();
        let shown = |chance: f64| match chance {
            c if c >= 0.001 => format!("is {c:.3}"),
            _ => "is below 0.001".to_owned(),
        };
        match &self.reason {
            Reason::Held => "always held".to_owned(),
            Reason::Changed => "is made false by the action".to_owned(),
            Reason::Refused { steps } => {
                format!("alone did not hold when the action was refused ({})", times(*steps))
            }
            Reason::Chance { chance: 1.0, .. } => {
                "held in every state, whatever the objects".to_owned()
            }
            Reason::Selective { chance, instances } | Reason::Chance { chance, instances } => {
                let seen = counted(*instances, "instance");
                format!("held for {seen}; the probability of that by chance {}", shown(*chance))
            }
            Reason::Follows { from, instances } => {
                format!("follows from {} in all {}", show(from), counted(*instances, "instance"))
            }
            Reason::SameAs { other, instances } => {
                let seen = counted(*instances, "instance");
                format!("is equivalent to {} in all {seen}", show(other))
            }
        }
    }
}

fn times(number: usize) -> String {
    if number == 1 { "once".to_owned() } else { format!("{number} times") }
}

impl LearnedAction {
    fn write(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let seen = counted(self.steps, "step");
        write!(f, "  ; {}: learned from {seen}", self.name)?;
        if self.refused > 0 {
            write!(f, ", {} refused", self.refused)?;
        }
        f.write_str("\n")?;
        if self.unexplained > 0 {
            let changes = counted(self.unexplained, "change");
            writeln!(f, "  ; {changes} concerned other objects and are not in its effects")?;
        }
        for (what, kept) in [("undecided, kept", true), ("left out", false)] {
            let some = self.preconditions.iter().filter(|p| p.kept == kept);
            for precondition in some.filter(|p| !p.reason.is_required()) {
                let literal = &precondition.literal;
                let shown = Shown { literal, parameters: &self.parameters };
                let why = precondition.explanation(&self.parameters);
                writeln!(f, "  ; {what}: {shown} {why}")?;
            }
        }
        writeln!(f, "{}", self.action())
    }
}

impl Display for LearnedModel {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        self.given.write_head(f)?;
        for action in &self.actions {
            f.write_str("\n")?;
            match action.steps {
                0 if action.refused > 0 => {
                    let refused = counted(action.refused, "step");
                    writeln!(f, "  ; {}: never done ({refused} refused), left out", action.name)?;
                }
                0 => writeln!(f, "  ; {}: never done, left out", action.name)?,
                _ => action.write(f)?,
            }
        }
        f.write_str(")\n")
    }
}
