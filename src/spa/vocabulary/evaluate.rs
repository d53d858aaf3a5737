//! Evaluates expressions over the names of a vocabulary.

use super::{Content, check_vector};
use crate::sim::{Real, nearest_name};
use crate::spa::algebra::Workspace;
use crate::spa::error::VocabError;
use crate::spa::expr::{self, Expr};

impl Content {
    /// Returns the index of a name. `vocabulary` is the name of the vocabulary in an error.
    pub(super) fn position(&self, vocabulary: &str, name: &str) -> Result<usize, VocabError> {
        self.index.get(name).copied().ok_or_else(|| VocabError::Unknown {
            vocabulary: vocabulary.into(),
            name: name.into(),
            nearest: nearest_name(name, self.names.iter().map(String::as_str)),
            choices: self.names.clone(),
        })
    }

    /// Evaluates an expression, as [`Vocabulary::parse`](super::Vocabulary::parse) says.
    pub(super) fn parse(&self, vocabulary: &str, text: &str) -> Result<Vec<Real>, VocabError> {
        let expr = expr::parse(text)?;
        let mut work = self.algebra.scratch(self.dim);
        match self.evaluate(vocabulary, &expr, text, &mut work)? {
            Value::Vector(values) => check_vector(text, values, self.dim),
            Value::Number(0.0) => Ok(vec![0.0; self.dim]),
            Value::Number(_) => Err(VocabError::Syntax {
                text: text.into(),
                at: 0,
                problem: "a number".into(),
                expected: "an expression with at least one name, or 0",
            }),
        }
    }

    fn evaluate(
        &self,
        vocabulary: &str,
        expr: &Expr,
        text: &str,
        work: &mut Workspace,
    ) -> Result<Value, VocabError> {
        let syntax = |at: usize, problem: &str, expected: &'static str| VocabError::Syntax {
            text: text.into(),
            at,
            problem: problem.into(),
            expected,
        };
        Ok(match expr {
            Expr::Number(value) => Value::Number(*value),
            Expr::Name { name, .. } => {
                let index = self.position(vocabulary, name)?;
                Value::Vector(self.row(index).to_vec())
            }
            Expr::Negate(inner) => match self.evaluate(vocabulary, inner, text, work)? {
                Value::Number(value) => Value::Number(-value),
                Value::Vector(mut values) => {
                    values.iter_mut().for_each(|v| *v = -*v);
                    Value::Vector(values)
                }
            },
            Expr::Invert(inner, at) => match self.evaluate(vocabulary, inner, text, work)? {
                Value::Number(_) => return Err(syntax(*at, "`~` before a number", "a pointer")),
                Value::Vector(values) => {
                    let mut inverse = vec![0.0; values.len()];
                    self.algebra.inverse_into(&values, &mut inverse);
                    Value::Vector(inverse)
                }
            },
            Expr::Add(left, right, at) | Expr::Subtract(left, right, at) => {
                let sign = if matches!(expr, Expr::Add(..)) { 1.0 } else { -1.0 };
                match (
                    self.evaluate(vocabulary, left, text, work)?,
                    self.evaluate(vocabulary, right, text, work)?,
                ) {
                    (Value::Number(a), Value::Number(b)) => Value::Number(a + f64::from(sign) * b),
                    (Value::Vector(mut a), Value::Vector(b)) => {
                        a.iter_mut().zip(&b).for_each(|(x, y)| *x += sign * y);
                        Value::Vector(a)
                    }
                    _ => {
                        let problem = "a sum of a number and a pointer";
                        return Err(syntax(*at, problem, "pointers on both sides"));
                    }
                }
            }
            Expr::Times(left, right) => {
                match (
                    self.evaluate(vocabulary, left, text, work)?,
                    self.evaluate(vocabulary, right, text, work)?,
                ) {
                    (Value::Number(a), Value::Number(b)) => Value::Number(a * b),
                    (Value::Number(k), Value::Vector(mut values))
                    | (Value::Vector(mut values), Value::Number(k)) => {
                        values.iter_mut().for_each(|v| *v *= k as Real);
                        Value::Vector(values)
                    }
                    (Value::Vector(a), Value::Vector(b)) => {
                        let mut bound = vec![0.0; a.len()];
                        self.algebra.bind_into(&a, &b, &mut bound, work);
                        Value::Vector(bound)
                    }
                }
            }
        })
    }
}

enum Value {
    Number(f64),
    Vector(Vec<Real>),
}
