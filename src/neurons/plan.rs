//! Which population computes which layer: a mode for the whole graph and exceptions by path.

use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use thiserror::Error;

use super::model::Lif;
use super::solved::SolvedModel;

/// How many neurons a layer gets, and what they are like. The defaults are those of the standard
/// networks of `symbolt bench`.
///
/// A number outside its range is a fault of the build, with the path of the layer: an ensemble can have 1
/// to 10,000 neurons, and the tick must not be longer than the refractory period or a quarter of the
/// membrane time constant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LifSpec {
    /// Time constants.
    pub model: Lif,
    /// Least and greatest rate at the end of a neuron's range, in Hz (above 0, below one a
    /// refractory period); drawn evenly.
    pub max_rates: [f64; 2],
    /// Least and greatest intercept (-1 up to, not including, 1) of neurons of one dimension; drawn evenly.
    pub intercepts: [f64; 2],
    /// Neurons a dimension of a pointer.
    pub per_dimension: usize,
    /// Greatest number of dimensions of one ensemble of a pointer.
    pub sub_dimensions: usize,
    /// Neurons of a function or representation of one number.
    pub per_function: usize,
    /// Neurons of a product, half in each of its squares.
    pub per_product: usize,
    /// Neurons of an item of a selection.
    pub per_item: usize,
    /// Regularisation of the decoders, in units of the greatest rate (above 0, finite).
    pub regularisation: f64,
    /// A factor on all these numbers of neurons (above 0).
    pub scale: f64,
}

impl Default for LifSpec {
    fn default() -> Self {
        Self {
            model: Lif::default(),
            max_rates: [200.0, 400.0],
            intercepts: [-1.0, 0.9],
            per_dimension: 50,
            sub_dimensions: 16,
            per_function: 100,
            per_product: 200,
            per_item: 50,
            regularisation: 0.1,
            scale: 1.0,
        }
    }
}

/// How a layer is computed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub enum Population {
    /// The exact function, with the delays of a population.
    #[default]
    Direct,
    /// Neurons whose output is their firing rate: a population's tuning and distortion without its spikes.
    Rate(LifSpec),
    /// Leaky integrate-and-fire neurons that spike.
    Lif(LifSpec),
}

impl Population {
    /// The modes that exist, by the names that [`FromStr`] takes.
    pub const NAMES: &'static [&'static str] = &["direct", "rate", "lif"];
}

/// A mode that does not exist.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("there is no mode `{asked}`; the modes are: {}", Population::NAMES.join(", "))]
pub struct UnknownMode {
    /// What was asked for.
    pub asked: String,
}

impl FromStr for Population {
    type Err = UnknownMode;

    fn from_str(name: &str) -> Result<Self, UnknownMode> {
        match name {
            "direct" => Ok(Self::Direct),
            "rate" => Ok(Self::Rate(LifSpec::default())),
            "lif" => Ok(Self::Lif(LifSpec::default())),
            _ => Err(UnknownMode { asked: name.into() }),
        }
    }
}

impl fmt::Display for Population {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Direct => f.write_str("direct"),
            Self::Rate(_) => f.write_str("rate"),
            Self::Lif(_) => f.write_str("lif"),
        }
    }
}

/// A set of paths: `*` stands for any part of one name, `**` for any number of names.
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

/// A pattern that cannot match any path.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error(
    "`{pattern}` is not a path pattern; expected names joined by `/`, each with `*` for any letters, or `**` for any names"
)]
pub struct PatternError {
    /// The pattern given.
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
    /// Whether `path` belongs to the set. Costs O(pattern x path) at worst.
    pub fn matches(&self, path: &str) -> bool {
        let names: Vec<&str> = path.split('/').collect();
        // reach[i]: the parts so far can match the first i names.
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

/// Whether `name` matches `part`, in which `*` stands for any letters.
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

/// The mode of every layer of a graph: a default, and exceptions of which the last match counts.
///
/// A pattern that matches no layer is a fault of the build: a misspelt ablation must not pass.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PopulationPlan {
    pub(crate) default: Population,
    pub(crate) overrides: Vec<(PathPattern, Population)>,
    pub(crate) solved: Option<Arc<SolvedModel>>,
}

impl PopulationPlan {
    /// The direct mode everywhere.
    pub fn direct() -> Self {
        Self::all(Population::Direct)
    }

    /// One mode everywhere.
    pub fn all(default: Population) -> Self {
        Self { default, overrides: Vec::new(), solved: None }
    }

    /// Another mode for the layers whose path matches `pattern`.
    pub fn with(mut self, pattern: PathPattern, population: Population) -> Self {
        self.overrides.push((pattern, population));
        self
    }

    /// Takes the populations of all neural layers from `solved` instead of solving for them. A layer that
    /// it does not have, or that was solved from anything else, is a fault of the build.
    pub fn solved(mut self, solved: impl Into<Arc<SolvedModel>>) -> Self {
        self.solved = Some(solved.into());
        self
    }

    /// The mode of the layer at `path`.
    pub fn population(&self, path: &str) -> Population {
        self.overrides
            .iter()
            .rev()
            .find(|(pattern, _)| pattern.matches(path))
            .map_or(self.default, |(_, population)| *population)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_match_as_documented() -> Result<(), PatternError> {
        let cases = [
            ("a/b", "a/b", true),
            ("a/b", "a/bc", false),
            ("a/*", "a/b", true),
            ("a/*", "a/b/c", false),
            ("**", "a/b/c", true),
            ("**/c", "a/b/c", true),
            ("**/c", "c", true),
            ("a/**", "a", true),
            ("a/**/d", "a/b/c/d", true),
            ("a/**/d", "a/b/c", false),
            ("*b*", "abc", true),
            ("a*a", "a", false),
            ("a*a", "aa", true),
            ("a*bc*d", "abbcbd", true),
        ];
        for (pattern, path, expected) in cases {
            let parsed: PathPattern = pattern.parse()?;
            assert_eq!(parsed.matches(path), expected, "{pattern} on {path}");
        }
        Ok(())
    }

    #[test]
    fn broken_patterns_are_refused() {
        for bad in ["", "a//b", "a/", "a b", "a**b", "***"] {
            assert!(bad.parse::<PathPattern>().is_err(), "{bad}");
        }
    }

    #[test]
    fn an_unknown_mode_names_those_that_exist() {
        let error = "lif2".parse::<Population>().map_err(|e| e.to_string());
        assert_eq!(error, Err("there is no mode `lif2`; the modes are: direct, rate, lif".into()));
    }
}
