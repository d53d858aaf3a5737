//! Learning: connections whose weights change while the graph runs, and the rules that change them.
//!
//! A [`Learned`] connection is a node that keeps its weights as state, so snapshots, resets, threads and ranks treat them
//! as they treat voltages. Any number of rules, each a file here or a type of your own ([`LearningRule`]), change them.
//!
//! # Order in a tick
//!
//! The node advances after all populations and reads their activity of the same tick. Its output has the weights that all
//! earlier ticks have left; a change takes effect in the next tick. Filters within a rule follow the activity of the same
//! tick. Weights and the states of rules are double precision; activities and outputs are single.
//!
//! # Rules
//!
//! `a` is the activity of the sources and `b` that of the targets, filtered by the rule and in Hz; `w` has a row per
//! target. Every rule changes the weights once per tick of length `dt`.
//!
//! | rule | change of `w[j][i]` | source |
//! |---|---|---|
//! | [`Pes`] | `-rate dt / n e[j] a[i]`, n sources | MacNeil and Eliasmith 2011 |
//! | [`Rls`] | `-e[j] g[i] / (1 + a.g)` with `g = P a` | Sussillo and Abbott 2009 |
//! | [`Voja`] | `rate dt b[j] (x[i] - w[j][i])` | Voelker, Crawford and Eliasmith 2014 |
//! | [`Oja`] | `rate dt (b[j] a[i] - beta b[j]^2 w[j][i])` | Oja 1982 |
//! | [`Bcm`] | `rate dt b[j] (b[j] - theta[j]) a[i]` | Bienenstock, Cooper and Munro 1982 |

mod bcm;
mod connection;
mod learned;
mod oja;
mod pes;
mod rls;
mod trace;
mod voja;
mod weights;

use std::fmt;
use std::ops::Range;

use super::tuning::TuningError;
use crate::sim::{Fingerprint, Real, Synapse};

pub use bcm::Bcm;
pub use learned::{Learned, LearnedPorts};
pub use oja::Oja;
pub use pes::Pes;
pub use rls::Rls;
pub use voja::Voja;
pub use weights::{Weights, WeightsError};

/// A rule by which the weights of a [`Learned`] connection change. Several rules on one connection see the same weights,
/// and their changes add up.
///
/// A rule of one's own, by which weights decay to zero:
///
/// ```
/// use symbolt::neurons::{Learned, LearningRule, LearningTick, Needs, Stretch, TuningError, WeightShape, Weights};
/// use symbolt::prelude::*;
/// use symbolt::sim::Fingerprint;
///
/// #[derive(Debug)]
/// struct Decay {
///     per_s: f64,
/// }
///
/// impl LearningRule for Decay {
///     fn name(&self) -> &'static str {
///         "decay"
///     }
///     fn needs(&self, _shape: WeightShape) -> Result<Needs, TuningError> {
///         Ok(Needs::default())
///     }
///     fn change(&self, tick: &LearningTick<'_>, _state: &[f64], of: &Stretch<'_>, change: &mut [f64]) {
///         let weights = of.weights.iter();
///         change.iter_mut().zip(weights).for_each(|(change, w)| *change -= self.per_s * tick.dt_s * w);
///     }
///     fn fingerprint(&self, hash: &mut Fingerprint) {
///         hash.real(self.per_s);
///     }
/// }
///
/// let mut graph = GraphBuilder::new();
/// let two = graph.add("two", Constant::vector(&[2.0]));
/// let learned = Learned::new(&two, 1).weights(Weights::rows([[1.0]])).rule(Decay { per_s: 10.0 });
/// let learned = graph.add("learned", learned);
/// let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), SimDuration::from_millis(100))?;
/// assert!((learned.weights(&sim)[[0, 0]] - 0.99f64.powi(100)).abs() < 1e-12);
/// # Ok::<(), symbolt::sim::SimError>(())
/// ```
pub trait LearningRule: fmt::Debug + Send + Sync + 'static {
    /// Returns the name of the rule in messages, such as `pes`.
    fn name(&self) -> &'static str;

    /// Checks the settings, and returns what the rule needs to change weights of this shape.
    ///
    /// # Errors
    /// [`TuningError::Setting`] if a setting is outside its range. The graph is then not built.
    fn needs(&self, shape: WeightShape) -> Result<Needs, TuningError>;

    /// Writes the state at the start of a run. It is zero before.
    fn start(&self, shape: WeightShape, dt_s: f64, state: &mut [f64]) {
        let _ = (shape, dt_s, state);
    }

    /// Updates the state from the activities of a tick. Called once per tick, before [`change`](Self::change), also while
    /// nothing is learned. Must neither allocate, lock nor log.
    fn observe(&self, tick: &LearningTick<'_>, state: &mut [f64]) {
        let _ = (tick, state);
    }

    /// Adds the change of some weights in this tick to `change`, which may hold those of other rules. The connection
    /// multiplies it by [`LearningTick::learning`]. Must neither allocate, lock nor log.
    fn change(&self, tick: &LearningTick<'_>, state: &[f64], of: &Stretch<'_>, change: &mut [f64]);

    /// Returns whether the rule leaves all weights of an output as they are in this tick. Rows that every rule leaves are
    /// not visited.
    fn leaves(&self, tick: &LearningTick<'_>, state: &[f64], row: usize) -> bool {
        let _ = (tick, state, row);
        false
    }

    /// Adds to `hash` every number that affects the results of the rule.
    fn fingerprint(&self, hash: &mut Fingerprint);
}

/// The shape of the weights of a learned connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WeightShape {
    /// Number of outputs: rows.
    pub outputs: usize,
    /// Number of sources: columns.
    pub inputs: usize,
}

/// What a [`LearningRule`] needs.
#[derive(Debug, Clone, Default)]
pub struct Needs {
    /// Name and width of an input that it reads at the end of the tick, such as an error.
    pub signal: Option<(&'static str, usize)>,
    /// Whether it reads the activity of the target neurons.
    pub post: bool,
    /// Whether it reads the output of the connection.
    pub output: bool,
    /// Names and lengths of the parts of its state, one after another. Each can be read and probed by its name.
    pub state: Vec<(&'static str, usize)>,
    /// Parts of its state that are activities behind a synapse. The connection writes them before
    /// [`LearningRule::observe`], also while nothing is learned.
    pub traces: Vec<Trace>,
}

/// Activities behind a synapse, which follow those of the same tick, without the tick of delay that a connection has.
#[derive(Debug, Clone, Copy)]
pub struct Trace {
    /// Name of the part of the state, as long as there are such neurons.
    pub state: &'static str,
    /// The neurons.
    pub of: Side,
    /// Any synapse. With [`Synapse::None`] the trace is a copy.
    pub synapse: Synapse,
}

/// The neurons on a side of a connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// The sources.
    Pre,
    /// The targets.
    Post,
}

/// What a [`LearningRule`] reads in a tick.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct LearningTick<'a> {
    /// Length of the tick, in seconds.
    pub dt_s: f64,
    /// Shape of the weights.
    pub shape: WeightShape,
    /// Activity of the sources in this tick: of neurons in Hz.
    pub pre: &'a [Real],
    /// Activity of the target neurons in this tick, in Hz; empty if the connection does not know them.
    pub post: &'a [Real],
    /// Output of the connection in this tick; empty unless the rule [needs](Needs::output) it.
    pub output: &'a [Real],
    /// The rule's own input; empty if it has none.
    pub signal: &'a [Real],
    /// Factor of all changes: 1 learns, 0 does not.
    pub learning: f64,
}

/// Neighbouring weights of one output.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Stretch<'a> {
    /// The output: a row.
    pub row: usize,
    /// The sources: columns.
    pub columns: Range<usize>,
    /// The weights in this tick.
    pub weights: &'a [f64],
}
