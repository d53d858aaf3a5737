//! Conditions beyond literals, effects under conditions, and numbers.
//!
//! Variables of quantifiers are [`Term::Parameter`](super::Term::Parameter)s: their positions follow those of the
//! parameters and of the quantifiers around them.

use std::fmt::{self, Display, Formatter};

use super::pddl::{Atom, EQUAL, Literal, Term, Typed};

/// A finite number.
#[derive(Debug, Clone, Copy, Default, PartialEq, PartialOrd)]
pub struct Number(f64);

// Numbers are finite, so each equals itself.
impl Eq for Number {}

impl Number {
    /// Returns the number; `None` if it is infinite or none.
    pub fn new(value: f64) -> Option<Self> {
        // Negative zero is zero.
        value.is_finite().then_some(Self(value + 0.0))
    }

    /// Returns the number as a float.
    pub fn value(self) -> f64 {
        self.0
    }
}

impl Display for Number {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0)
    }
}

/// An operation on two numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operation {
    /// Addition, `+`.
    Add,
    /// Subtraction, `-`.
    Subtract,
    /// Multiplication, `*`.
    Multiply,
    /// Division, `/`.
    Divide,
}

/// A numeric expression.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Expression {
    /// A constant.
    Number(Number),
    /// The value of a function.
    Function(Atom),
    /// An operation on two expressions.
    Binary(Operation, Box<Expression>, Box<Expression>),
}

impl Expression {
    /// Returns the value; `None` if `function` knows no value of a function, or if the value is not finite.
    pub fn value(&self, function: &impl Fn(&Atom) -> Option<Number>) -> Option<Number> {
        match self {
            Self::Number(number) => Some(*number),
            Self::Function(atom) => function(atom),
            Self::Binary(operation, left, right) => {
                let (left, right) = (left.value(function)?.0, right.value(function)?.0);
                Number::new(match operation {
                    Operation::Add => left + right,
                    Operation::Subtract => left - right,
                    Operation::Multiply => left * right,
                    Operation::Divide => left / right,
                })
            }
        }
    }

    /// Returns the number of parts.
    pub(super) fn size(&self) -> usize {
        match self {
            Self::Number(_) | Self::Function(_) => 1,
            Self::Binary(_, left, right) => 1 + left.size() + right.size(),
        }
    }

    /// Returns the functions that are named.
    pub fn functions(&self) -> Vec<&Atom> {
        match self {
            Self::Number(_) => Vec::new(),
            Self::Function(atom) => vec![atom],
            Self::Binary(_, left, right) => [left.functions(), right.functions()].concat(),
        }
    }
}

/// How two numbers are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Comparison {
    /// `<`
    Less,
    /// `<=`
    AtMost,
    /// `=`
    Equal,
    /// `>=`
    AtLeast,
    /// `>`
    Greater,
}

impl Comparison {
    /// Returns the sign, such as `<=`.
    pub(super) fn sign(self) -> &'static str {
        match self {
            Self::Less => "<",
            Self::AtMost => "<=",
            Self::Equal => EQUAL,
            Self::AtLeast => ">=",
            Self::Greater => ">",
        }
    }

    /// Returns the comparison of a sign.
    pub(super) fn of(sign: &str) -> Option<Self> {
        let all = [Self::Less, Self::AtMost, Self::Equal, Self::AtLeast, Self::Greater];
        all.into_iter().find(|comparison| comparison.sign() == sign)
    }

    /// Returns whether two numbers compare so.
    pub fn holds(self, left: Number, right: Number) -> bool {
        match self {
            Self::Less => left < right,
            Self::AtMost => left <= right,
            Self::Equal => left == right,
            Self::AtLeast => left >= right,
            Self::Greater => left > right,
        }
    }
}

/// A condition of any form.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Condition {
    /// A literal.
    Literal(Literal),
    /// A comparison of numbers that no action changes. It does not hold where a value is unknown.
    Compare(Comparison, Expression, Expression),
    /// The condition does not hold.
    Not(Box<Condition>),
    /// All conditions hold.
    All(Vec<Condition>),
    /// One of the conditions holds.
    Any(Vec<Condition>),
    /// The condition holds for some objects.
    Exists(Vec<Typed>, Box<Condition>),
    /// The condition holds for all objects.
    Forall(Vec<Typed>, Box<Condition>),
}

impl Condition {
    /// Returns the number of parts.
    pub(super) fn size(&self) -> usize {
        match self {
            Self::Literal(_) => 1,
            Self::Compare(_, left, right) => left.size() + right.size(),
            Self::Not(inner) => 1 + inner.size(),
            Self::All(parts) | Self::Any(parts) => 1 + parts.iter().map(Self::size).sum::<usize>(),
            Self::Exists(variables, inner) | Self::Forall(variables, inner) => {
                variables.len() + inner.size()
            }
        }
    }

    /// Calls `see` with every literal.
    pub fn literals<'c>(&'c self, see: &mut impl FnMut(&'c Literal)) {
        self.signed_literals(true, &mut |literal, _| see(literal));
    }

    /// Calls `see` with every literal, and with whether the condition needs it as it is written (`sign`) or its opposite.
    pub(super) fn signed_literals<'c>(
        &'c self,
        sign: bool,
        see: &mut impl FnMut(&'c Literal, bool),
    ) {
        match self {
            Self::Literal(literal) => see(literal, sign),
            Self::Compare(..) => {}
            Self::Not(inner) => inner.signed_literals(!sign, see),
            Self::Exists(_, inner) | Self::Forall(_, inner) => inner.signed_literals(sign, see),
            Self::All(parts) | Self::Any(parts) => {
                parts.iter().for_each(|part| part.signed_literals(sign, see));
            }
        }
    }

    /// Calls `change` with every literal.
    pub(crate) fn literals_mut(&mut self, change: &mut impl FnMut(&mut Literal)) {
        match self {
            Self::Literal(literal) => change(literal),
            Self::Compare(..) => {}
            Self::Not(inner) | Self::Exists(_, inner) | Self::Forall(_, inner) => {
                inner.literals_mut(change);
            }
            Self::All(parts) | Self::Any(parts) => {
                parts.iter_mut().for_each(|part| part.literals_mut(change));
            }
        }
    }
}

/// What always holds, and what never does.
pub(crate) const TRUE: Condition = Condition::All(Vec::new());
pub(crate) const FALSE: Condition = Condition::Any(Vec::new());

/// Returns the condition that all of several hold, without what says nothing.
pub(crate) fn all(parts: impl IntoIterator<Item = Condition>) -> Condition {
    joined(parts, true)
}

/// Returns the condition that one of several holds, without what says nothing.
pub(crate) fn any(parts: impl IntoIterator<Item = Condition>) -> Condition {
    joined(parts, false)
}

fn joined(parts: impl IntoIterator<Item = Condition>, every: bool) -> Condition {
    let mut kept: Vec<Condition> = Vec::new();
    for part in parts {
        let own = match (part, every) {
            (Condition::All(inner), true) | (Condition::Any(inner), false) => inner,
            // One that never holds decides about all, and one that always does about any.
            (other, _) if other == if every { FALSE } else { TRUE } => return other,
            (other, _) => vec![other],
        };
        for part in own {
            if !kept.contains(&part) {
                kept.push(part);
            }
        }
    }
    match kept.len() {
        1 => kept.swap_remove(0),
        _ if every => Condition::All(kept),
        _ => Condition::Any(kept),
    }
}

/// Returns the opposite of a condition.
pub(crate) fn not(condition: Condition) -> Condition {
    match condition {
        Condition::Literal(l) => Condition::Literal(Literal { positive: !l.positive, ..l }),
        Condition::Not(inner) => *inner,
        other if other == TRUE => FALSE,
        other if other == FALSE => TRUE,
        other => Condition::Not(other.into()),
    }
}

/// Returns a condition that holds for some objects of variables, or for all, without what says nothing.
pub(crate) fn quantified(exists: bool, mut variables: Vec<Typed>, inner: Condition) -> Condition {
    match (exists, inner) {
        (_, inner) if variables.is_empty() => inner,
        (true, inner) if inner == FALSE => FALSE,
        (false, inner) if inner == TRUE => TRUE,
        (true, Condition::Exists(further, inner)) => {
            variables.extend(further);
            Condition::Exists(variables, inner)
        }
        (false, Condition::Forall(further, inner)) => {
            variables.extend(further);
            Condition::Forall(variables, inner)
        }
        (true, inner) => Condition::Exists(variables, inner.into()),
        (false, inner) => Condition::Forall(variables, inner.into()),
    }
}

/// Returns the condition that two terms are one object.
pub(crate) fn same(left: &Term, right: &Term) -> Condition {
    let atom = Atom { predicate: EQUAL.to_owned(), arguments: vec![left.clone(), right.clone()] };
    Condition::Literal(Literal { positive: true, atom })
}

/// Effects for all objects of quantified variables, where a condition holds before.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConditionalEffect {
    /// Quantified variables. Their positions follow those of the parameters.
    pub variables: Vec<Typed>,
    /// What must hold before the action.
    pub condition: Condition,
    /// What the action makes true or false then.
    pub effects: Vec<Literal>,
}

/// The increase of a function by an action.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Increase {
    /// The function.
    pub function: Atom,
    /// By how much.
    pub amount: Expression,
}

/// A numeric function.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Function {
    /// Name, in lower case.
    pub name: String,
    /// Parameters, in order.
    pub parameters: Vec<Typed>,
    /// Whether an action changes it.
    pub changes: bool,
}

/// A rule that derives a predicate from a condition. A derived atom holds if the condition of one of its rules does.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Derived {
    /// Name of the predicate.
    pub predicate: String,
    /// Parameters, in order. They have the first positions in the condition.
    pub parameters: Vec<Typed>,
    /// The condition.
    pub condition: Condition,
}
