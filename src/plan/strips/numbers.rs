//! Reads numeric expressions, comparisons of numbers, and what changes them.

use std::collections::{HashMap, HashSet};

use super::conditions::{MAX_COPIED, Scope};
use super::formula::{Comparison, Condition, Expression, Function, Increase, Number, Operation};
use super::lists::tail;
use super::pddl::{Action, Atom, Domain};
use super::sexpr::{Node, PddlFault, Place, Source, short};

/// Greatest number of arguments that a sum or a product may have.
const MAX_OPERANDS: usize = 32;

/// The functions that conditions compare and that actions change.
#[derive(Debug, Default)]
pub(super) struct Numbers {
    /// With the place of the first comparison.
    compared: HashMap<String, Place>,
    changed: Vec<(Place, String)>,
}

impl Numbers {
    /// Marks the functions that change. Refuses a comparison of one, because it is not known at grounding.
    pub fn finish(self, source: Source<'_>, domain: &mut Domain) -> Result<(), PddlFault> {
        let mut known = HashSet::new();
        for (place, name) in self.changed.iter().filter(|(_, name)| known.insert(name)) {
            match domain.functions.iter_mut().find(|f| f.name == *name) {
                Some(function) => function.changes = true,
                // Only a cost may be undeclared.
                None => domain.functions.push(Function {
                    name: name.clone(),
                    parameters: Vec::new(),
                    changes: true,
                }),
            }
            if let Some(place) = self.compared.get(name) {
                return Err(source.numeric(*place, name));
            }
            if name != TOTAL_COST {
                let what = format!(
                    "changes of the number `{}` decide nothing and are ignored",
                    short(name)
                );
                source.warn(*place, what);
            }
        }
        Ok(())
    }
}

/// Name of the function that is the cost of a plan.
pub(super) const TOTAL_COST: &str = "total-cost";

impl Source<'_> {
    /// Refuses a condition on a number that actions change.
    fn numeric(&self, place: Place, name: &str) -> PddlFault {
        let problem = format!(
            "the condition depends on the numeric fluent `{}`, which actions change; of those only costs are read",
            short(name)
        );
        self.fault(place, problem, "a condition on predicates")
    }
}

impl Scope<'_> {
    /// Reads the change of a number. `alone` says that it is neither under a condition nor for all objects of a type.
    pub fn change(
        &mut self,
        node: &Node,
        [function, amount]: [&Node; 2],
        alone: bool,
        action: &mut Action,
    ) -> Result<(), PddlFault> {
        let head = node.head().unwrap_or_default();
        let cost = function.head() == Some(TOTAL_COST) && tail(function).is_empty()
            || function.word() == Some(TOTAL_COST);
        let declared = self.domain.functions.iter().any(|f| f.name == TOTAL_COST);
        let atom = if cost && !declared {
            self.source.warn(function.place, "`total-cost` is not declared in :functions");
            Atom { predicate: TOTAL_COST.into(), arguments: Vec::new() }
        } else {
            self.function(function)?
        };
        self.numbers.borrow_mut().changed.push((node.place, atom.predicate.clone()));
        if head != "increase" || !alone {
            if cost {
                let what = format!(
                    "`({head} ...)` of the cost under a condition, or other than by `increase`, is not counted"
                );
                self.source.warn(node.place, what);
            }
            return Ok(());
        }
        // What is not a cost is ignored, whatever the amount.
        match self.expression(amount) {
            Ok(amount) => action.increases.push(Increase { function: atom, amount }),
            Err(fault) if cost || self.copied > MAX_COPIED => return Err(fault),
            Err(_) => {}
        }
        Ok(())
    }

    pub fn compare(
        &mut self,
        comparison: Comparison,
        left: &Node,
        right: &Node,
    ) -> Result<Condition, PddlFault> {
        let mut sides = Vec::new();
        for node in [left, right] {
            let side = self.expression(node)?;
            for atom in side.functions() {
                let known = self.domain.functions.iter().find(|f| f.name == atom.predicate);
                if known.is_some_and(|function| function.changes) {
                    return Err(self.source.numeric(node.place, &atom.predicate));
                }
                let compared = &mut self.numbers.borrow_mut().compared;
                compared.entry(atom.predicate.clone()).or_insert(node.place);
            }
            sides.push(side);
        }
        let right = sides.pop().unwrap_or(Expression::Number(Number::default()));
        let left = sides.pop().unwrap_or(Expression::Number(Number::default()));
        Ok(Condition::Compare(comparison, left, right))
    }

    /// Reads a numeric expression.
    pub fn expression(&mut self, node: &Node) -> Result<Expression, PddlFault> {
        if let Some(word) = node.word() {
            if word == "?duration"
                && let Some(duration) = self.duration.clone()
            {
                self.copy(node, duration.size(), "the durations are too large")?;
                return Ok(Expression::clone(&duration));
            }
            let number = word.parse().ok().and_then(Number::new);
            if let Some(number) = number {
                return Ok(Expression::Number(number));
            }
        }
        let operation = match node.head() {
            Some("+") => Operation::Add,
            Some("-") => Operation::Subtract,
            Some("*") => Operation::Multiply,
            Some("/") => Operation::Divide,
            _ => return Ok(Expression::Function(self.function(node)?)),
        };
        let binary = |left, right| Expression::Binary(operation, Box::new(left), Box::new(right));
        match tail(node) {
            [only] if operation == Operation::Subtract => {
                Ok(binary(Expression::Number(Number::default()), self.expression(only)?))
            }
            [first, rest @ ..] if !rest.is_empty() && rest.len() < MAX_OPERANDS => {
                let mut all = self.expression(first)?;
                for next in rest {
                    all = binary(all, self.expression(next)?);
                }
                Ok(all)
            }
            _ => Err(self.source.unexpected(node, "complete sum or product", "two numbers")),
        }
    }

    fn function(&self, node: &Node) -> Result<Atom, PddlFault> {
        let alone = |name: &str| {
            self.domain.functions.iter().any(|f| f.name == name && f.parameters.is_empty())
        };
        if let Some(name) = node.word().filter(|word| alone(word)) {
            self.source.warn(node.place, format!("`{}` has no parentheses", short(name)));
            return Ok(Atom { predicate: name.to_owned(), arguments: Vec::new() });
        }
        if node.head().is_none() {
            let expected = "a number, (FUNCTION ...) or (+ ...) (object fluents are not read)";
            return Err(self.source.unexpected(node, "numeric expression", expected));
        }
        let known = self.domain.functions.iter().map(|f| (f.name.as_str(), f.parameters.len()));
        let index = self.source.applied_to(node, "function", known)?;
        let function = &self.domain.functions[index];
        let arguments = self.terms(tail(node), Some(&function.parameters))?;
        Ok(Atom { predicate: function.name.clone(), arguments })
    }
}
