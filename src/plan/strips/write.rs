//! Prints domains and problems as PDDL.

use std::fmt::{self, Display, Formatter};

use super::formula::{Condition, Derived, Expression, Operation};
use super::pddl::{Action, Atom, Domain, Fact, Literal, OBJECT, Predicate, Problem, Term, Typed};

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

/// Returns whether a condition names a parameter.
fn mentions(condition: &Condition, position: usize) -> bool {
    let of = |atom: &Atom| atom.arguments.contains(&Term::Parameter(position));
    match condition {
        Condition::Literal(l) => of(&l.atom),
        Condition::Compare(_, left, right) => {
            [left, right].iter().any(|side| side.functions().into_iter().any(of))
        }
        Condition::Not(inner) | Condition::Exists(_, inner) | Condition::Forall(_, inner) => {
            mentions(inner, position)
        }
        Condition::All(parts) | Condition::Any(parts) => {
            parts.iter().any(|part| mentions(part, position))
        }
    }
}

/// Returns variables under names that hide none that is mentioned: as printed, the innermost of a name counts.
fn apart(variables: &[Typed], around: &[&str], mentioned: impl Fn(usize) -> bool) -> Vec<Typed> {
    let mut all = variables.to_vec();
    for at in (0..all.len()).rev() {
        let hides = |all: &[Typed]| {
            let name = all[at].name.as_str();
            around.iter().enumerate().any(|(i, other)| *other == name && mentioned(i))
                || all[at + 1..].iter().any(|v| v.name == name) && mentioned(around.len() + at)
        };
        while hides(&all) {
            all[at].name.push('_');
        }
    }
    all
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
        let names: Vec<&str> = self.parameters.iter().map(|p| p.name.as_str()).collect();
        literal(f, self.literal, &names)
    }
}

fn literal(f: &mut Formatter<'_>, literal: &Literal, names: &[&str]) -> fmt::Result {
    f.write_str(if literal.positive { "" } else { "(not " })?;
    atom(f, &literal.atom, names)?;
    f.write_str(if literal.positive { "" } else { ")" })
}

fn atom(f: &mut Formatter<'_>, atom: &Atom, names: &[&str]) -> fmt::Result {
    write!(f, "({}", atom.predicate)?;
    for term in &atom.arguments {
        match term {
            Term::Constant(name) => write!(f, " {name}")?,
            Term::Parameter(position) => match names.get(*position) {
                Some(name) => write!(f, " {name}")?,
                None => write!(f, " ?{position}")?,
            },
        }
    }
    f.write_str(")")
}

/// A condition with the names of its parameters.
pub(super) struct ShownCondition<'a>(pub &'a Condition, pub &'a [&'a str]);

impl Display for ShownCondition<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self(shown, names) = self;
        match shown {
            Condition::Literal(l) => literal(f, l, names),
            Condition::Compare(comparison, left, right) => {
                write!(f, "({} ", comparison.sign())?;
                expression(f, left, names)?;
                f.write_str(" ")?;
                expression(f, right, names)?;
                f.write_str(")")
            }
            Condition::Not(inner) => write!(f, "(not {})", ShownCondition(inner, names)),
            Condition::All(parts) | Condition::Any(parts) => {
                f.write_str(if matches!(shown, Condition::All(_)) { "(and" } else { "(or" })?;
                parts.iter().try_for_each(|part| write!(f, " {}", ShownCondition(part, names)))?;
                f.write_str(")")
            }
            Condition::Exists(variables, inner) | Condition::Forall(variables, inner) => {
                let variables = apart(variables, names, |position| mentions(inner, position));
                let own = variables.iter().map(|v| v.name.as_str());
                let all: Vec<&str> = names.iter().copied().chain(own).collect();
                let exists = matches!(shown, Condition::Exists(..));
                let word = if exists { "exists" } else { "forall" };
                write!(f, "({word} ({}) {})", TypedList(&variables), ShownCondition(inner, &all))
            }
        }
    }
}

fn expression(f: &mut Formatter<'_>, shown: &Expression, names: &[&str]) -> fmt::Result {
    match shown {
        Expression::Number(number) => write!(f, "{number}"),
        Expression::Function(function) => atom(f, function, names),
        Expression::Binary(operation, left, right) => {
            let sign = match operation {
                Operation::Add => "+",
                Operation::Subtract => "-",
                Operation::Multiply => "*",
                Operation::Divide => "/",
            };
            write!(f, "({sign} ")?;
            expression(f, left, names)?;
            f.write_str(" ")?;
            expression(f, right, names)?;
            f.write_str(")")
        }
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

impl Display for Action {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        comments(f, &self.comments, "  ")?;
        writeln!(f, "  (:action {}", self.name)?;
        writeln!(f, "    :parameters ({})", TypedList(&self.parameters))?;
        let names: Vec<&str> = self.parameters.iter().map(|p| p.name.as_str()).collect();
        f.write_str("    :precondition (and")?;
        for needed in &self.preconditions {
            f.write_str("\n      ")?;
            literal(f, needed, &names)?;
        }
        for condition in &self.conditions {
            write!(f, "\n      {}", ShownCondition(condition, &names))?;
        }
        f.write_str(")\n    :effect (and")?;
        for effect in &self.effects {
            f.write_str("\n      ")?;
            literal(f, effect, &names)?;
        }
        for effect in &self.conditional {
            let variables = apart(&effect.variables, &names, |position| {
                let of = |l: &Literal| l.atom.arguments.contains(&Term::Parameter(position));
                mentions(&effect.condition, position) || effect.effects.iter().any(of)
            });
            let own: Vec<String> = variables.iter().map(|v| v.name.clone()).collect();
            let all: Vec<&str> = names.iter().copied().chain(own.iter().map(|n| &**n)).collect();
            f.write_str("\n      ")?;
            // A list has no name twice, and what says nothing is not written.
            let mut lists: Vec<Vec<Typed>> = Vec::new();
            for variable in variables {
                match lists.last_mut() {
                    Some(list) if list.iter().all(|v| v.name != variable.name) => {
                        list.push(variable);
                    }
                    _ => lists.push(vec![variable]),
                }
            }
            for list in &lists {
                write!(f, "(forall ({}) ", TypedList(list))?;
            }
            let always = matches!(&effect.condition, Condition::All(parts) if parts.is_empty());
            if !always {
                write!(f, "(when {} ", ShownCondition(&effect.condition, &all))?;
            }
            let several = effect.effects.len() != 1;
            f.write_str(if several { "(and" } else { "" })?;
            for effect in &effect.effects {
                f.write_str(if several { " " } else { "" })?;
                literal(f, effect, &all)?;
            }
            let end = lists.len() + usize::from(!always) + usize::from(several);
            f.write_str(&")".repeat(end))?;
        }
        for increase in &self.increases {
            f.write_str("\n      (increase ")?;
            atom(f, &increase.function, &names)?;
            f.write_str(" ")?;
            expression(f, &increase.amount, &names)?;
            f.write_str(")")?;
        }
        f.write_str("))")
    }
}

impl Display for Derived {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let names: Vec<&str> = self.parameters.iter().map(|p| p.name.as_str()).collect();
        let gap = if self.parameters.is_empty() { "" } else { " " };
        write!(f, "  (:derived ({}{gap}{})", self.predicate, TypedList(&self.parameters))?;
        write!(f, "\n    {})", ShownCondition(&self.condition, &names))
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
        let mut declared = self.predicates.iter().filter(|p| !p.of_type);
        declared.try_for_each(|p| write!(f, "\n    {p}"))?;
        f.write_str(")\n")?;
        if !self.functions.is_empty() {
            f.write_str("  (:functions")?;
            for function in &self.functions {
                let gap = if function.parameters.is_empty() { "" } else { " " };
                write!(f, "\n    ({}{gap}{})", function.name, TypedList(&function.parameters))?;
                f.write_str(" - number")?;
            }
            f.write_str(")\n")?;
        }
        Ok(())
    }
}

/// Writes comments, a line each, behind an indentation.
fn comments(f: &mut Formatter<'_>, comments: &[String], gap: &str) -> fmt::Result {
    let line = |comment: &String| comment.replace(char::is_control, " ");
    comments.iter().try_for_each(|comment| writeln!(f, "{gap}; {}", line(comment)))
}

impl Display for Domain {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        comments(f, &self.comments, "")?;
        self.write_head(f)?;
        self.derived.iter().try_for_each(|rule| writeln!(f, "\n{rule}"))?;
        self.actions.iter().try_for_each(|action| writeln!(f, "\n{action}"))?;
        f.write_str(")\n")
    }
}

impl Display for Problem {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        comments(f, &self.comments, "")?;
        writeln!(f, "(define (problem {})\n  (:domain {})", self.name, self.domain)?;
        if !self.requirements.is_empty() {
            writeln!(f, "  (:requirements {})", self.requirements.join(" "))?;
        }
        writeln!(f, "  (:objects {})", TypedList(&self.objects))?;
        f.write_str("  (:init")?;
        self.init.iter().try_for_each(|fact| write!(f, "\n    {fact}"))?;
        for (function, value) in &self.numbers {
            write!(f, "\n    (= {function} {value})")?;
        }
        f.write_str(")\n  (:goal (and")?;
        for (holds, fact) in &self.goal {
            let (begin, end) = if *holds { ("", "") } else { ("(not ", ")") };
            write!(f, "\n    {begin}{fact}{end}")?;
        }
        for condition in &self.conditions {
            write!(f, "\n    {}", ShownCondition(condition, &[]))?;
        }
        f.write_str("))")?;
        if let Some(function) = &self.metric {
            write!(f, "\n  (:metric minimize {function})")?;
        }
        f.write_str(")\n")
    }
}
