//! Every way in which describing, building or running a graph can fail.

use std::fmt;

use thiserror::Error;

use super::time::SimDuration;

/// A duration or a clock that cannot be used.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ConfigError {
    /// A span that the clock cannot count.
    #[error("{span} is not a whole number of ticks of {tick}; use a multiple of {tick}")]
    Indivisible {
        /// The span asked for.
        span: SimDuration,
        /// The clock's tick.
        tick: SimDuration,
    },
    /// A tick of no length or of more than a second.
    #[error("a tick of {tick} is not usable; choose more than 0 and at most 1 s")]
    BadTick {
        /// The tick asked for.
        tick: SimDuration,
    },
    /// A number that is no span of time.
    #[error("{seconds} s is not a duration; expected a finite number from 0 to 1e12")]
    NotADuration {
        /// The number given.
        seconds: f64,
    },
}

/// One fault in the description of a graph. [`BuildErrors`] collects all of them.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum BuildError {
    /// Two nodes of one path.
    #[error("two nodes are named `{path}`; every path must be unique")]
    DuplicatePath {
        /// The path used twice.
        path: String,
    },
    /// A name with a character that paths and patterns need for themselves.
    #[error(
        "`{name}` (under `{parent}`) cannot be a name; use letters, digits, `_`, `-` and `.`, at least one of them"
    )]
    BadName {
        /// The enclosing path.
        parent: String,
        /// The name given.
        name: String,
    },
    /// A port asked for by a name or kind that the node does not have.
    #[error("`{node}` has no {direction} `{port}` of kind {kind}; it has: {}", list(choices))]
    UnknownPort {
        /// The node's path.
        node: String,
        /// `input` or `output`.
        direction: &'static str,
        /// The name asked for.
        port: String,
        /// The kind asked for.
        kind: String,
        /// The ports it has in that direction.
        choices: Vec<String>,
    },
    /// A handle that belongs to another builder.
    #[error(
        "the {direction} `{port}` was made by another builder; use a handle that this builder gave out"
    )]
    ForeignHandle {
        /// `input` or `output`.
        direction: &'static str,
        /// What the handle calls itself.
        port: String,
    },
    /// Ends of an edge with different numbers of components.
    #[error(
        "`{from}` has width {from_width} but `{to}` takes width {to_width}; inputs of width {from_width}: {}; outputs of width {to_width}: {}",
        list(inputs),
        list(outputs)
    )]
    WidthMismatch {
        /// The source port's path.
        from: String,
        /// Its width.
        from_width: usize,
        /// The target port's path.
        to: String,
        /// Its width.
        to_width: usize,
        /// Unfed inputs that this source would fit.
        inputs: Vec<String>,
        /// Outputs that would fit this target.
        outputs: Vec<String>,
    },
    /// Ends of an edge in different vector spaces.
    #[error(
        "`{from}` lives in {from_space} but `{to}` takes {to_space}; outputs that fit: {}; to cross on purpose, put a node between them that takes the one space and gives the other",
        list(outputs)
    )]
    SpaceMismatch {
        /// The source port's path.
        from: String,
        /// Its space.
        from_space: String,
        /// The target port's path.
        to: String,
        /// Its space.
        to_space: String,
        /// Outputs that would fit this target.
        outputs: Vec<String>,
    },
    /// A second source on an input that takes one.
    #[error(
        "`{to}` takes one source but is fed by {}; keep one of them, or add them with an `Add` node",
        list(sources)
    )]
    TooManySources {
        /// The target port's path.
        to: String,
        /// All its sources.
        sources: Vec<String>,
    },
    /// A required input without a source.
    #[error("`{port}` is not fed; outputs that fit: {}", list(outputs))]
    Unfed {
        /// The port's path.
        port: String,
        /// Outputs of its width and space.
        outputs: Vec<String>,
    },
    /// An output that needs a synapse on every edge, on an edge without one.
    #[error(
        "every edge from `{from}` needs a synapse, but it reaches `{to}` without one; give the edge a low-pass synapse"
    )]
    Unfiltered {
        /// The source port's path.
        from: String,
        /// The target port's path.
        to: String,
    },
    /// A loop in which nothing costs a tick.
    #[error(
        "a loop without a synapse or a registered output: {}; give one of its edges a low-pass synapse", path.join(" -> ")
    )]
    AlgebraicLoop {
        /// The paths along the loop, the first repeated at the end.
        path: Vec<String>,
    },
    /// A synapse that cannot be discretised.
    #[error(
        "the edge `{from}` -> `{to}` has a time constant of zero; use `Synapse::None` or more than 0"
    )]
    BadSynapse {
        /// The source port's path.
        from: String,
        /// The target port's path.
        to: String,
    },
    /// A probe that cannot be recorded.
    #[error("the probe on `{port}`: {reason}")]
    BadProbe {
        /// The probed port's path.
        port: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A node that refuses its own parameters.
    #[error("`{node}`: {reason}")]
    Refused {
        /// The node's path.
        node: String,
        /// The reason, as the node states it.
        reason: String,
    },
    /// A requested layer that cannot become a node, or a part of the plan that fits no layer.
    #[error("`{path}`: {reason}{}", offered(choices))]
    Lowering {
        /// The request's path or the plan's pattern.
        path: String,
        /// What is wrong.
        reason: String,
        /// What could stand there instead.
        choices: Vec<String>,
    },
    /// A second link to a world.
    #[error(
        "`{second}` links to a world but `{first}` does already; a graph has at most one world"
    )]
    SecondWorld {
        /// The first link's path.
        first: String,
        /// The second link's path.
        second: String,
    },
    /// A graph without nodes.
    #[error("the graph has no nodes; add at least one")]
    Empty,
    /// More numbers than the engine addresses.
    #[error("the graph needs {numbers} numbers, more than {limit}")]
    TooLarge {
        /// How many it needs.
        numbers: usize,
        /// How many can be addressed.
        limit: usize,
    },
}

/// The end of a message that offers choices; empty without any.
fn offered(choices: &[String]) -> String {
    if choices.is_empty() { String::new() } else { format!("; valid choices: {}", list(choices)) }
}

/// Names joined for a message. A long list is cut, and the number left out is named.
fn list(items: &[String]) -> String {
    const MAX_SHOWN: usize = 12;
    if items.is_empty() {
        return "none".into();
    }
    let shown =
        items.iter().take(MAX_SHOWN).map(|s| format!("`{s}`")).collect::<Vec<_>>().join(", ");
    if items.len() > MAX_SHOWN {
        format!("{shown} and {} more", items.len() - MAX_SHOWN)
    } else {
        shown
    }
}

/// All faults of a description, reported together.
#[derive(Debug, Clone, PartialEq)]
pub struct BuildErrors(pub Vec<BuildError>);

impl fmt::Display for BuildErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let plural = if self.0.len() == 1 { "fault" } else { "faults" };
        write!(f, "the graph has {} {plural}:", self.0.len())?;
        for fault in &self.0 {
            write!(f, "\n  - {fault}")?;
        }
        Ok(())
    }
}

impl std::error::Error for BuildErrors {}

/// Why a node cannot complete a tick.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{reason}")]
pub struct NodeFault {
    /// The reason, as the node states it.
    pub reason: String,
}

/// Why a world cannot continue.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{reason}")]
pub struct WorldError {
    /// The reason, as the world states it.
    pub reason: String,
}

impl WorldError {
    /// A fault with the given reason.
    pub fn new(reason: impl Into<String>) -> Self {
        Self { reason: reason.into() }
    }
}

/// Why a simulation could not start or continue.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SimError {
    /// A span or clock that does not fit.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A value that is not a number, or infinite.
    #[error("`{path}.{port}` became {value} in tick {tick}")]
    NonFinite {
        /// The node's path.
        path: String,
        /// The port's name.
        port: String,
        /// The value found.
        value: f32,
        /// The tick in which it appeared.
        tick: u64,
    },
    /// A node that could not complete a tick.
    #[error("`{path}` failed in tick {tick}: {source}")]
    Node {
        /// The node's path.
        path: String,
        /// The tick.
        tick: u64,
        /// The node's own report.
        source: NodeFault,
    },
    /// A world that could not continue.
    #[error("the world failed in tick {tick}: {source}")]
    World {
        /// The tick.
        tick: u64,
        /// The world's own report.
        source: WorldError,
    },
    /// The graph has a world link and the run no world, or the reverse.
    #[error("the graph has {} world link but the run gives {} world", if *.linked {"a"} else {"no"}, if *.given {"a"} else {"no"})]
    WorldMissing {
        /// Whether the graph has a link.
        linked: bool,
        /// Whether the run gives a world.
        given: bool,
    },
    /// A world whose numbers of senses or commands differ from the link's.
    #[error("the world has {world} {what} values but the link `{link}` has {graph}")]
    WorldShape {
        /// The link's path.
        link: String,
        /// `sense` or `command`.
        what: &'static str,
        /// The world's number.
        world: usize,
        /// The link's number.
        graph: usize,
    },
    /// A noise scale that is negative or not finite.
    #[error("a noise scale of {scale} is not usable; expected a finite number of at least 0")]
    BadNoise {
        /// The scale given.
        scale: f32,
    },
    /// A checkpoint of a graph with another fingerprint, or of a run with a world where this one has none.
    #[error(
        "the checkpoint was taken from a graph with other nodes, parameters, clock or build seed"
    )]
    ForeignCheckpoint,
    /// A path or port that the graph does not have.
    #[error("the graph has no output `{asked}`; it has: {}", list(choices))]
    UnknownOutput {
        /// What was asked for.
        asked: String,
        /// The outputs that exist.
        choices: Vec<String>,
    },
    /// Storage for a probe that could not be had.
    #[error(
        "no memory for {samples} more samples of probe `{port}`; give it a capacity or a longer period"
    )]
    ProbeStorage {
        /// The probed port's path.
        port: String,
        /// How many samples were to be stored.
        samples: usize,
    },
}
