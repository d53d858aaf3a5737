//! Prints domains and problems as PDDL.

use std::fmt::{self, Display, Formatter};

use super::pddl::{Action, Domain, Fact, Literal, OBJECT, Predicate, Problem, Term, Typed};

/// Prints typed names: `a b - t c - (either t u)`. Names of type `object` stand without a type if all do.
struct TypedList<'a>(&'a [Typed]);

impl Display for TypedList<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let plain = self.0.iter().all(|t| t.types == [OBJECT]);
        for (index, typed) in self.0.iter().enumerate() {
            let gap = if index == 0 { "" } else { " " };
            write!(f, "{gap}{}", typed.name)?;
            let next = self.0.get(index + 1);
            if plain || next.is_some_and(|next| next.types == typed.types) {
                continue;
            }
            match typed.types.as_slice() {
                [one] => write!(f, " - {one}")?,
                several => write!(f, " - (either {})", several.join(" "))?,
            }
        }
        Ok(())
    }
}

/// A literal of an action, with the names of its parameters.
pub struct Shown<'a> {
    /// The literal.
    pub literal: &'a Literal,
    /// Parameters of the action.
    pub parameters: &'a [Typed],
}

impl Display for Shown<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let atom = &self.literal.atom;
        f.write_str(if self.literal.positive { "(" } else { "(not (" })?;
        f.write_str(&atom.predicate)?;
        for term in &atom.arguments {
            match term {
                Term::Constant(name) => write!(f, " {name}")?,
                Term::Parameter(position) => match self.parameters.get(*position) {
                    Some(parameter) => write!(f, " {}", parameter.name)?,
                    None => write!(f, " ?{position}")?,
                },
            }
        }
        f.write_str(if self.literal.positive { ")" } else { "))" })
    }
}

impl Display for Predicate {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let gap = if self.parameters.is_empty() { "" } else { " " };
        write!(f, "({}{gap}{})", self.name, TypedList(&self.parameters))
    }
}

impl Display for Fact {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "({}", self.predicate)?;
        self.arguments.iter().try_for_each(|argument| write!(f, " {argument}"))?;
        f.write_str(")")
    }
}

/// Writes `(and ...)` with one literal per line.
fn conjunction(f: &mut Formatter<'_>, literals: &[Literal], parameters: &[Typed]) -> fmt::Result {
    f.write_str("(and")?;
    for literal in literals {
        write!(f, "\n      {}", Shown { literal, parameters })?;
    }
    f.write_str(")")
}

impl Display for Action {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        writeln!(f, "  (:action {}", self.name)?;
        writeln!(f, "    :parameters ({})", TypedList(&self.parameters))?;
        f.write_str("    :precondition ")?;
        conjunction(f, &self.preconditions, &self.parameters)?;
        f.write_str("\n    :effect ")?;
        conjunction(f, &self.effects, &self.parameters)?;
        f.write_str(")")
    }
}

impl Domain {
    /// Writes everything before the actions: the definition, requirements, types, constants and predicates.
    pub(crate) fn write_head(&self, f: &mut Formatter<'_>) -> fmt::Result {
        writeln!(f, "(define (domain {})", self.name)?;
        if !self.requirements.is_empty() {
            writeln!(f, "  (:requirements {})", self.requirements.join(" "))?;
        }
        if !self.types.declared().is_empty() {
            writeln!(f, "  (:types {})", TypedList(self.types.declared()))?;
        }
        if !self.constants.is_empty() {
            writeln!(f, "  (:constants {})", TypedList(&self.constants))?;
        }
        f.write_str("  (:predicates")?;
        self.predicates.iter().try_for_each(|p| write!(f, "\n    {p}"))?;
        f.write_str(")\n")
    }
}

impl Display for Domain {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        self.write_head(f)?;
        self.actions.iter().try_for_each(|action| writeln!(f, "\n{action}"))?;
        f.write_str(")\n")
    }
}

impl Display for Problem {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        writeln!(f, "(define (problem {})\n  (:domain {})", self.name, self.domain)?;
        writeln!(f, "  (:objects {})", TypedList(&self.objects))?;
        f.write_str("  (:init")?;
        self.init.iter().try_for_each(|fact| write!(f, "\n    {fact}"))?;
        f.write_str(")\n  (:goal (and")?;
        for (holds, fact) in &self.goal {
            let (begin, end) = if *holds { ("", "") } else { ("(not ", ")") };
            write!(f, "\n    {begin}{fact}{end}")?;
        }
        f.write_str(")))\n")
    }
}
