//! Population plans: the mode of each layer, as a default for the graph and exceptions by path.

use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use thiserror::Error;

use super::model::Lif;
use super::solved::SolvedModel;
use crate::sim::Ranks;

/// The number and tuning of the neurons of a layer. The standard networks of `symbolt bench` use the defaults.
///
/// Ranges are checked when the graph is built. A fault names the path of the layer. Besides the ranges below, an
/// ensemble must have 1 to 10,000 neurons. The tick must be at most a quarter of the membrane time constant and, in
/// spiking mode, at most the refractory period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LifSpec {
    /// Neuron model: the time constants.
    pub model: Lif,
    /// Range of maximum rates, in Hz: above 0 and below `1 / tau_ref`. Each neuron draws its rate uniformly. Default:
    /// 200 to 400.
    pub max_rates: [f64; 2],
    /// Range of intercepts for neurons of one dimension: at least -1 and below 1. Each neuron draws its intercept
    /// uniformly. Default: -1 to 0.9.
    ///
    /// Selections and [`Map::above`](super::Map::above) draw intercepts above their level. Pointers draw them from the
    /// distribution of cosines between random directions (Gosmann and Eliasmith, "Optimizing semantic pointer
    /// representations for symbol-like processing in spiking neural networks", 2016).
    pub intercepts: [f64; 2],
    /// Number of neurons per dimension of a pointer. Default: 50.
    pub per_dimension: usize,
    /// Greatest number of dimensions in one ensemble of a pointer. Each ensemble gets the greatest divisor of the
    /// width of the pointer up to this number. Default: 16.
    pub sub_dimensions: usize,
    /// Number of neurons per component of a function or of a represented vector. Default: 100.
    pub per_function: usize,
    /// Number of neurons per product. Each of its two squares gets half of them. Default: 200.
    pub per_product: usize,
    /// Number of neurons per item of a selection. Default: 50. [`few_per_item`](Self::few_per_item) tunes 1 to 4.
    pub per_item: usize,
    /// Mean distance of the intercepts of a selection from its level, as a fraction of the range of utilities (at least
    /// 0, finite). Default: 0.1. With 0 all neurons of an item begin to fire at the level, as few neurons must.
    pub item_spread: f64,
    /// Regularisation of the decoder solve, as a fraction of the greatest rate (above 0, finite). Default: 0.1.
    ///
    /// Decoders are `(A^T A + m s^2 I)^-1 A^T F`. A holds the rates and F the target values at m evaluation points; s
    /// is this number times the greatest rate (Eliasmith and Anderson 2003, chapter 2; `reg` of Nengo's `LstsqL2`).
    pub regularisation: f64,
    /// Factor on all numbers of neurons (above 0). Default: 1.
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
            item_spread: 0.1,
            regularisation: 0.1,
            scale: 1.0,
        }
    }
}

impl LifSpec {
    /// Returns the default tuning with few neurons per item of a selection: a single neuron is a threshold. Meant for 1 to
    /// 4, which are also stepped faster; 0 is a fault when the graph is built. The maximum rates hold for every layer
    /// with this tuning, so a plan should give it to the selections of a memory alone, by their path.
    ///
    /// All neurons begin to fire at the level, and their maximum rate of 480 Hz is near the refractory limit:
    /// soon above the level they have nearly the same rate. The output of an item then fluctuates little around 1 behind
    /// a synapse of 5 ms.
    pub fn few_per_item(per_item: usize) -> Self {
        Self { per_item, item_spread: 0.0, max_rates: [480.0, 480.0], ..Self::default() }
    }
}

/// How a layer is computed: its mode, and the neurons if it has any.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub enum Population {
    /// Direct mode: the exact function, with the delays of a population.
    #[default]
    Direct,
    /// Rate mode: the output of a neuron is its firing rate. Such neurons have the tuning and decoding error of a
    /// population but no spikes.
    Rate(LifSpec),
    /// Spiking mode: leaky integrate-and-fire neurons.
    Lif(LifSpec),
}

impl Population {
    /// Names of the modes, as [`FromStr`] reads them. Parsed modes have the default [`LifSpec`].
    pub const NAMES: &'static [&'static str] = &["direct", "rate", "lif"];
}

/// The error for a mode that does not exist.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("there is no mode `{asked}`; the modes are: {}", Population::NAMES.join(", "))]
pub struct UnknownMode {
    /// Name that was given.
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

/// The mode of every layer of a graph: a default, and exceptions by path. If several patterns match a path, the last
/// one added decides.
///
/// A pattern that matches no layer is a fault when the graph is built, so a misspelt ablation cannot go unnoticed.
///
/// ```
/// use symbolt::neurons::{LifSpec, Population, PopulationPlan};
///
/// // Spiking neurons everywhere, except exact arithmetic in every module called `bind`.
/// let plan = PopulationPlan::all(Population::Lif(LifSpec::default()))
///     .with("**/bind/**".parse()?, Population::Direct);
/// assert_eq!(plan.population("planner/bind/products"), Population::Direct);
/// assert_ne!(plan.population("planner/goal"), Population::Direct);
/// # Ok::<(), symbolt::neurons::PatternError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PopulationPlan {
    pub(crate) default: Population,
    pub(crate) overrides: Vec<(PathPattern, Population)>,
    pub(crate) solved: Option<Arc<SolvedModel>>,
    pub(crate) ranks: Option<Ranks>,
}

impl PopulationPlan {
    /// Makes a plan of direct mode everywhere.
    pub fn direct() -> Self {
        Self::all(Population::Direct)
    }

    /// Makes a plan of one mode everywhere.
    pub fn all(default: Population) -> Self {
        Self { default, overrides: Vec::new(), solved: None, ranks: None }
    }

    /// Adds an exception: the layers whose path matches `pattern` get `population`.
    pub fn with(mut self, pattern: PathPattern, population: Population) -> Self {
        self.overrides.push((pattern, population));
        self
    }

    /// Takes the populations of all neural layers from `solved` instead of solving for them.
    ///
    /// Building the graph then fails if `solved` lacks a layer, or if the layer was solved from another seed, tick,
    /// tuning, size or function.
    pub fn solved(mut self, solved: impl Into<Arc<SolvedModel>>) -> Self {
        self.solved = Some(solved.into());
        self
    }

    /// Shares the neurons among several processes. Each solves and advances its own part of the ensembles; see [`Ranks`].
    /// All processes must build the graph at the same time.
    ///
    /// ```
    /// use symbolt::neurons::{LifSpec, Population, PopulationPlan};
    /// use symbolt::prelude::*;
    /// use symbolt::sim::{LayerRequest, Ranks, Vector};
    /// # use symbolt::neurons::{LayerPorts, Layers, Map};
    /// # use symbolt::sim::{Module, Scope};
    /// # struct Squares;
    /// # impl Module for Squares {
    /// #     type Ports = LayerPorts<Vector>;
    /// #     fn expand(self, scope: &mut Scope<'_>) -> LayerPorts<Vector> {
    /// #         scope.map("neurons", Map::each(40, |x| x * x))
    /// #     }
    /// # }
    /// // Two threads stand for two processes.
    /// let run = |ranks: Ranks| {
    ///     let plan = PopulationPlan::all(Population::Lif(LifSpec::default())).shared(&ranks);
    ///     let mut graph = GraphBuilder::new();
    ///     let input = graph.add("input", Constant::vector(&[0.5; 40]));
    ///     let squares = graph.add("squares", Squares);
    ///     graph.connect(&input, &squares.input, Synapse::None);
    ///     let graph = graph.build(Timebase::default(), &plan, Seed::new(1))?;
    ///     let mut sim = Simulator::new(graph.into(), RunConfig::default())?;
    ///     sim.run_for(SimDuration::from_millis(100))?;
    ///     Ok::<_, symbolt::sim::SimError>(sim.value(&squares.output).to_vec())
    /// };
    /// let values: Vec<_> = std::thread::scope(|scope| {
    ///     let group = Ranks::in_process(2).into_iter();
    ///     let threads: Vec<_> = group.map(|ranks| scope.spawn(move || run(ranks))).collect();
    ///     threads.into_iter().filter_map(|thread| thread.join().ok()).collect()
    /// });
    /// assert_eq!(values[0], values[1], "both know all values");
    /// ```
    pub fn shared(mut self, ranks: &Ranks) -> Self {
        self.ranks = Some(ranks.clone());
        self
    }

    /// Returns the mode of the layer at `path`.
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
