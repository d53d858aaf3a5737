//! Errors of vocabularies, expressions and memories.

use thiserror::Error;

use crate::sim::{nearest_first, question};

/// An error in making or using a vocabulary, expression or memory.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum VocabError {
    /// A number of dimensions that the algebra cannot use.
    #[error("{dim} dimensions cannot be used; choose from {min} to {max}")]
    Dimension {
        /// Number of dimensions that was given.
        dim: usize,
        /// Least number of dimensions.
        min: usize,
        /// Greatest number of dimensions.
        max: usize,
    },
    /// A number of dimensions that is not a square, for an algebra of square matrices.
    #[error("{dim} dimensions cannot be used; choose a square number, such as {below} or {above}")]
    NotSquare {
        /// Number of dimensions that was given.
        dim: usize,
        /// Greatest square number below it.
        below: usize,
        /// Least square number above it.
        above: usize,
    },
    /// A power that an algebra does not have.
    #[error("the exponent {exponent} cannot be used: {reason}")]
    Exponent {
        /// Exponent that was given.
        exponent: f64,
        /// Description of the exponents that can be used.
        reason: String,
    },
    /// A similarity ceiling outside its range.
    #[error("a similarity ceiling of {ceiling} cannot be used; choose more than 0 and at most 1")]
    Ceiling {
        /// Ceiling that was given.
        ceiling: f32,
    },
    /// A name that cannot stand in an expression.
    #[error(
        "`{name}` cannot name a pointer; use an upper-case letter, then letters, digits and `_`"
    )]
    BadName {
        /// Name that was given.
        name: String,
    },
    /// A name that was given twice.
    #[error("the vocabulary already has `{name}`; choose another name")]
    Duplicate {
        /// Name that was given.
        name: String,
    },
    /// Random vectors that all exceed the similarity ceiling.
    #[error(
        "none of {attempts} random vectors of {dim} dimensions for `{name}` keeps its similarity to the {others} others \
         within {ceiling}; the best reaches {best:.3} to `{nearest}`; about {room} random pointers can; \
         use more dimensions or a higher ceiling (`max_similarity`), the best of some draws (`or_best_of`), or no \
         ceiling (`any_similarity`)"
    )]
    TooSimilar {
        /// Name of the pointer that could not be drawn.
        name: String,
        /// Number of dimensions.
        dim: usize,
        /// Similarity ceiling.
        ceiling: f32,
        /// About how many random pointers of so many dimensions keep the ceiling.
        room: usize,
        /// Number of pointers that the vocabulary already had.
        others: usize,
        /// Number of vectors that were drawn.
        attempts: usize,
        /// Greatest magnitude of the similarity between the best vector and another pointer.
        best: f32,
        /// Name of the other pointer with this similarity.
        nearest: String,
    },
    /// A name that the vocabulary does not have.
    #[error("the vocabulary `{vocabulary}` has no `{name}`{}; it has: {}", question(.nearest.as_deref()), nearest_first(.name, .choices.iter().map(String::as_str)))]
    Unknown {
        /// Name of the vocabulary.
        vocabulary: String,
        /// Name that was asked for.
        name: String,
        /// Most similar name, if one is close.
        nearest: Option<String>,
        /// All names of the vocabulary.
        choices: Vec<String>,
    },
    /// An expression that cannot be parsed.
    #[error("cannot read the expression at character {at}: found {problem}, expected {expected}\n{}", around(.text, *.at))]
    Syntax {
        /// Text of the expression.
        text: String,
        /// Position of the error, in characters from 0.
        at: usize,
        /// Description of the text at that position.
        problem: String,
        /// Description of the text that was expected.
        expected: &'static str,
    },
    /// A vector that has the wrong length or a component that is not finite; or a memory without items.
    #[error("`{name}`: {reason}")]
    BadVector {
        /// Name of the vector or memory.
        name: String,
        /// Description of the error.
        reason: String,
    },
}

/// Checks that `rows`, row-major, are whole vectors of at least one dimension, and that all numbers are finite. `what` is
/// the word for one of them.
pub(super) fn check_rows(
    name: &str,
    what: &str,
    rows: &[f32],
    dim: usize,
) -> Result<(), VocabError> {
    let bad = |reason| Err(VocabError::BadVector { name: name.into(), reason });
    if dim == 0 || !rows.len().is_multiple_of(dim) {
        return bad(format!(
            "{} numbers for {what}s of {dim} dimensions; expected whole vectors of at least 1 dimension",
            rows.len()
        ));
    }
    match rows.iter().position(|v| !v.is_finite()) {
        Some(at) => bad(format!(
            "component {} of {what} {} is {}; expected a finite number",
            at % dim,
            at / dim,
            rows[at]
        )),
        None => Ok(()),
    }
}

/// Returns the text around a position, with a mark below it.
fn around(text: &str, at: usize) -> String {
    let first = at.saturating_sub(60);
    let shown: String = text.chars().skip(first).take(100).collect();
    let (before, after) = (first > 0, text.chars().nth(first + 100).is_some());
    let [left, right] = [before, after].map(|cut| if cut { "..." } else { "" });
    let mark = at - first + left.len();
    format!("  {left}{shown}{right}\n  {:>width$}", "^", width = mark + 1)
}
