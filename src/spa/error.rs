//! Every way in which vocabularies, expressions and modules can be used wrongly.

use thiserror::Error;

/// A vocabulary, expression or memory that cannot be made.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum VocabError {
    /// A dimension that the algebra cannot use.
    #[error("{dim} dimensions cannot be used; choose from {min} to {max}")]
    Dimension {
        /// The dimension asked for.
        dim: usize,
        /// The smallest that can be used.
        min: usize,
        /// The largest that can be used.
        max: usize,
    },
    /// A ceiling on similarity outside its range.
    #[error("a similarity ceiling of {ceiling} cannot be used; choose more than 0 and at most 1")]
    Ceiling {
        /// The ceiling asked for.
        ceiling: f32,
    },
    /// A name that expressions could not read.
    #[error(
        "`{name}` cannot name a pointer; use an upper-case letter, then letters, digits and `_`"
    )]
    BadName {
        /// The name given.
        name: String,
    },
    /// A name given twice.
    #[error("`{name}` is in the vocabulary already")]
    Duplicate {
        /// The name given.
        name: String,
    },
    /// Vectors that cannot be drawn far enough apart.
    #[error(
        "no vector of {dim} dimensions for `{name}` stays within a similarity of {ceiling} to all {others} others: the best of {attempts} tries has {best:.3} to `{nearest}`; use more dimensions or a higher ceiling"
    )]
    TooSimilar {
        /// The pointer that could not be placed.
        name: String,
        /// The dimension.
        dim: usize,
        /// The ceiling to be kept.
        ceiling: f32,
        /// How many pointers there were already.
        others: usize,
        /// How many vectors were tried.
        attempts: usize,
        /// The greatest similarity (in magnitude) of the best of them.
        best: f32,
        /// To which pointer.
        nearest: String,
    },
    /// A name that the vocabulary does not have.
    #[error("the vocabulary `{vocabulary}` has no `{name}`{}; it has: {}", near(.nearest), .choices.join(", "))]
    Unknown {
        /// The vocabulary's name.
        vocabulary: String,
        /// The name asked for.
        name: String,
        /// The most similar name, if one is close.
        nearest: Option<String>,
        /// All names.
        choices: Vec<String>,
    },
    /// An expression that cannot be read.
    #[error("cannot read the expression at character {at}: {problem}, expected {expected}\n  {text}\n  {:>width$}", "^", width = at + 1)]
    Syntax {
        /// The expression.
        text: String,
        /// The place, counted in characters from 0.
        at: usize,
        /// What stands there.
        problem: String,
        /// What could stand there.
        expected: &'static str,
    },
    /// A vector of another length, or with a value that is no finite number.
    #[error("`{name}`: {reason}")]
    BadVector {
        /// Whose vector.
        name: String,
        /// What is wrong with it.
        reason: String,
    },
}

fn near(nearest: &Option<String>) -> String {
    nearest.as_ref().map_or_else(String::new, |name| format!(" (did you mean `{name}`?)"))
}

/// The name in `choices` that differs from `name` by the fewest edits, if that is few enough to be
/// a slip.
pub(crate) fn nearest_name<'a>(
    name: &str,
    choices: impl Iterator<Item = &'a str>,
) -> Option<String> {
    choices
        .map(|choice| (edits(name, choice), choice))
        .min_by_key(|(distance, _)| *distance)
        .filter(|(distance, _)| *distance <= 2.max(name.chars().count() / 4))
        .map(|(_, choice)| choice.to_owned())
}

/// Levenshtein distance.
fn edits(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut corner = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let cost = corner + usize::from(x != *y);
            corner = row[j + 1];
            row[j + 1] = cost.min(row[j] + 1).min(row[j + 1] + 1);
        }
    }
    row[b.len()]
}
