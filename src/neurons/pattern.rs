//! Patterns of paths.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

/// A pattern that matches paths: `*` stands for any part of one name, `**` for any number of names, including none.
///
/// ```
/// use symbolt::neurons::PathPattern;
/// let pattern: PathPattern = "planner/**/product*".parse()?;
/// assert!(pattern.matches("planner/unbind/products"));
/// assert!(pattern.matches("planner/products"));
/// assert!(!pattern.matches("planner/unbind/gather"));
/// # Ok::<(), symbolt::neurons::PatternError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PathPattern {
    text: String,
    parts: Vec<String>,
}

/// The error for text that is not a path pattern.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error(
    "`{pattern}` is not a path pattern; expected names joined by `/`, \
     where `*` stands for any characters of a name and `**` for any names"
)]
pub struct PatternError {
    /// Text that was given.
    pub pattern: String,
}

impl FromStr for PathPattern {
    type Err = PatternError;

    fn from_str(text: &str) -> Result<Self, PatternError> {
        let parts: Vec<String> = text.split('/').map(str::to_owned).collect();
        let good = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.' | '*');
        let valid = parts
            .iter()
            .all(|p| !p.is_empty() && p.chars().all(good) && (p == "**" || !p.contains("**")));
        if valid {
            Ok(Self { text: text.into(), parts })
        } else {
            Err(PatternError { pattern: text.into() })
        }
    }
}

impl fmt::Display for PathPattern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl PathPattern {
    /// Returns whether the pattern matches all of `path`. Costs at most O(length of pattern x length of path).
    pub fn matches(&self, path: &str) -> bool {
        let names: Vec<&str> = path.split('/').collect();
        // reach[i] says whether the parts so far can match the first i names.
        let mut reach = vec![false; names.len() + 1];
        reach[0] = true;
        for part in &self.parts {
            if part == "**" {
                let mut open = false;
                for slot in &mut reach {
                    open |= *slot;
                    *slot = open;
                }
            } else {
                for i in (0..names.len()).rev() {
                    reach[i + 1] = reach[i] && name_matches(part, names[i]);
                }
                reach[0] = false;
            }
        }
        reach[names.len()]
    }
}

/// Returns whether `name` matches `part`, in which `*` stands for any characters.
fn name_matches(part: &str, name: &str) -> bool {
    let pieces: Vec<&str> = part.split('*').collect();
    let [first, middle @ .., last] = pieces.as_slice() else { return part == name };
    let Some(mut rest) = name.strip_prefix(first) else { return false };
    for piece in middle {
        match rest.find(piece) {
            Some(at) => rest = &rest[at + piece.len()..],
            None => return false,
        }
    }
    rest.ends_with(last)
}
