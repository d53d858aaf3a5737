//! Errors of graph descriptions and runs.

use std::fmt;

use thiserror::Error;

use super::time::ConfigError;
use super::words::{cut, few};

/// One fault in the description of a graph. [`BuildErrors`] collects all of them.
///
/// Faults name a port as `module.port` if its module exposes the port (see
/// [`Scope::input`](super::Scope::input)), and otherwise as `node.port`.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum BuildError {
    /// Two modules or nodes with the same path.
    #[error("`{path}` is added twice, at {first} and at {second}; give one of them another name")]
    DuplicatePath {
        /// The path used twice.
        path: String,
        /// File and line of the earlier addition.
        first: String,
        /// File and line of the later addition.
        second: String,
    },
    /// A name that is empty or contains a character reserved for paths and patterns.
    #[error(
        "`{name}`{} is not a valid name; use one or more of the characters a-z, A-Z, 0-9, `_`, `-` and `.`",
        inside(parent)
    )]
    BadName {
        /// The path of the enclosing module, empty at the root.
        parent: String,
        /// The name given.
        name: String,
    },
    /// A port whose name is empty or contains a character reserved for paths, so that it could not be found by name.
    #[error(
        "`{node}` has a port named `{port}`; use one or more characters other than `.` and `/`"
    )]
    BadPortName {
        /// The path of the node or module.
        node: String,
        /// The port's name.
        port: String,
    },
    /// A port looked up by a name or kind that the node does not have.
    #[error(
        "the node `{node}` has no {direction} `{port}` of kind {kind}; its {direction}s are: {}",
        list(choices)
    )]
    UnknownPort {
        /// The node's path.
        node: String,
        /// `input` or `output`.
        direction: &'static str,
        /// The name asked for.
        port: String,
        /// The kind asked for.
        kind: String,
        /// The node's ports in that direction, as `name: kind`.
        choices: Vec<String>,
    },
    /// A probe on an output that the description does not have, or has with another kind.
    #[error("there is no output `{asked}` of kind {kind}; the outputs are: {}", list(choices))]
    UnknownOutput {
        /// The name asked for.
        asked: String,
        /// The kind asked for.
        kind: String,
        /// Outputs as `name: kind`, the most similar names first.
        choices: Vec<String>,
    },
    /// A probe of spikes on something that is not a layer.
    #[error("there is no layer `{asked}`; the layers are: {}", list(choices))]
    UnknownLayer {
        /// The path asked for.
        asked: String,
        /// Paths of layers, the most similar ones first, at most 10.
        choices: Vec<String>,
    },
    /// A handle that another builder returned.
    #[error(
        "the {direction} `{port}` belongs to another `GraphBuilder`; use a handle that this builder returned"
    )]
    ForeignHandle {
        /// `input` or `output`.
        direction: &'static str,
        /// The port's name in the other builder.
        port: String,
    },
    /// A connection between ports of different widths.
    #[error(
        "`{from}` has width {from_width} but `{to}` takes width {to_width}; \
         outputs of width {to_width}: {}; free inputs of width {from_width}: {}",
        list(outputs),
        list(inputs)
    )]
    WidthMismatch {
        /// The source port.
        from: String,
        /// The width of the source port.
        from_width: usize,
        /// The target port.
        to: String,
        /// The width of the target port.
        to_width: usize,
        /// Free inputs that fit the source port.
        inputs: Vec<String>,
        /// Outputs that fit the target port.
        outputs: Vec<String>,
    },
    /// A connection between pointers of different vocabularies.
    #[error(
        "`{from}` carries pointers of {from_space} but `{to}` takes pointers of {to_space}; \
         outputs that fit: {}; to convert, put a node between them that takes pointers of the first \
         and returns pointers of the second",
        list(outputs)
    )]
    SpaceMismatch {
        /// The source port.
        from: String,
        /// The space of the source port.
        from_space: String,
        /// The target port.
        to: String,
        /// The space of the target port.
        to_space: String,
        /// Outputs that fit the target port.
        outputs: Vec<String>,
    },
    /// A connection without a synapse between two nodes that both advance at the end of the tick.
    #[error(
        "`{from}` is written while `{to}` is read, at the end of the tick; put a synapse on the connection"
    )]
    BothSettle {
        /// The source port.
        from: String,
        /// The target port.
        to: String,
    },
    /// More than one connection to an input that takes one.
    #[error(
        "`{to}` takes one connection but has {}: from {}; keep one, or sum the sources with an `Add` module",
        sources.len(),
        list(sources)
    )]
    TooManySources {
        /// The target port.
        to: String,
        /// All sources connected to it.
        sources: Vec<String>,
    },
    /// A required input without a connection.
    #[error("the input `{port}` is not connected; outputs that fit: {}", list(outputs))]
    Unfed {
        /// The input.
        port: String,
        /// Up to ten outputs of the same kind, width and space.
        outputs: Vec<String>,
    },
    /// A connection without a synapse from an output that requires one.
    #[error(
        "`{from}` is connected to `{to}` without a synapse, \
         but every connection from `{from}` needs one; use `Synapse::lowpass_ms(5)`, for example"
    )]
    Unfiltered {
        /// The source port.
        from: String,
        /// The target port.
        to: String,
    },
    /// A loop of nodes that need each other's outputs in the same tick.
    #[error(
        "these nodes form a loop without delay: {}; give one of the connections between them a low-pass synapse",
        arrows(path)
    )]
    AlgebraicLoop {
        /// Nodes along the loop. The last node repeats the first.
        path: Vec<String>,
    },
    /// A synapse that cannot be made.
    #[error("the connection from `{from}` to `{to}` has {reason}")]
    BadSynapse {
        /// The source port.
        from: String,
        /// The target port.
        to: String,
        /// What is wrong with the synapse.
        reason: SynapseError,
    },
    /// A probe that cannot record.
    #[error("the probe on `{port}` cannot record: {reason}")]
    BadProbe {
        /// The probed port.
        port: String,
        /// Why the probe cannot record.
        reason: String,
    },
    /// A module or node that rejects its own parameters.
    #[error("`{node}`: {reason}")]
    Refused {
        /// The path of the module or node.
        node: String,
        /// The reason given by the module or node.
        reason: String,
    },
    /// A requested layer that cannot become a node, or an entry of the plan that matches no layer.
    #[error("`{path}`: {reason}{}", offered(choices))]
    Lowering {
        /// The path of the layer, or the pattern of the plan.
        path: String,
        /// Reason for the fault.
        reason: String,
        /// Valid choices.
        choices: Vec<String>,
    },
    /// A second link to a world.
    #[error(
        "`{first}` and `{second}` both link to a world; a graph has at most one world, so remove one of them"
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
    /// More values than the engine can address.
    #[error(
        "the graph needs room for {numbers} values of one type, more than {limit}; use fewer or narrower nodes"
    )]
    TooLarge {
        /// Values needed.
        numbers: usize,
        /// Values that can be addressed.
        limit: usize,
    },
}

/// ` (in `parent`)`, empty at the root.
fn inside(parent: &str) -> String {
    if parent.is_empty() { String::new() } else { format!(" (in `{parent}`)") }
}

/// The nodes of a loop, joined by arrows.
fn arrows(path: &[String]) -> String {
    path.iter().map(|node| format!("`{node}`")).collect::<Vec<_>>().join(" -> ")
}

/// The end of a message that lists valid choices. Empty if there are no choices.
fn offered(choices: &[String]) -> String {
    if choices.is_empty() { String::new() } else { format!("; valid choices: {}", list(choices)) }
}

/// Names joined for a message.
pub(in crate::sim) fn list(items: &[String]) -> String {
    if items.is_empty() { "none".into() } else { few(items.iter().map(|name| format!("`{name}`"))) }
}

/// All faults of one description. A message has the first of them, and how many more there are; with `{:#}` it has all.
#[derive(Clone, PartialEq)]
pub struct BuildErrors(pub Vec<BuildError>);

/// Greatest number of faults in a message, and of characters of a fault and of all of them.
const SHOWN: [usize; 3] = [8, 600, 800];

impl fmt::Display for BuildErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let plural = if self.0.len() == 1 { "fault" } else { "faults" };
        write!(f, "the graph has {} {plural}:", self.0.len())?;
        let mut length = 0;
        for (index, fault) in self.0.iter().enumerate() {
            let fault = fault.to_string();
            length += fault.len().min(SHOWN[1]);
            if f.alternate() {
                write!(f, "\n  - {fault}")?;
                continue;
            }
            if index > 0 && (index == SHOWN[0] || length > SHOWN[2]) {
                return write!(f, "\n  and {} more", self.0.len() - index);
            }
            write!(f, "\n  - {}", cut(&fault, SHOWN[1]))?;
        }
        Ok(())
    }
}

/// As the message: a thousand faults help nobody who unwraps a result.
impl fmt::Debug for BuildErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl std::error::Error for BuildErrors {}

/// Why a synapse cannot be made discrete. Messages continue `the connection has`.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SynapseError {
    /// A time constant, length or delay of zero.
    #[error("a time constant of zero; use a longer one, or `Synapse::None`")]
    ZeroTime,
    /// A delay that is not a whole number of ticks.
    #[error("a delay that is not a number of ticks: {0}")]
    Delay(#[from] ConfigError),
    /// A delay or triangle over too many ticks.
    #[error("a synapse of {ticks} ticks; use at most {most}")]
    TooLong {
        /// Ticks asked for.
        ticks: u64,
        /// Most ticks.
        most: u64,
    },
    /// A linear filter of too high an order.
    #[error("a linear filter of order {order}; use an order of at most {most}")]
    Order {
        /// The order given.
        order: usize,
        /// The greatest order.
        most: usize,
    },
    /// A linear filter whose output would depend on derivatives of its input.
    #[error(
        "a linear filter with a numerator of order {numerator} above a denominator of order {denominator}; \
         use a numerator of at most the same order"
    )]
    Improper {
        /// Order of the numerator.
        numerator: usize,
        /// Order of the denominator.
        denominator: usize,
    },
    /// A linear filter without a coefficient other than zero.
    #[error("a linear filter whose {what} has only zeros; give at least one other coefficient")]
    Zero {
        /// `numerator` or `denominator`.
        what: &'static str,
    },
    /// A linear filter with coefficients that are not finite, or that grows without bound within a tick.
    #[error(
        "a linear filter that is not finite for this length of a tick; use smaller, finite coefficients"
    )]
    NotFinite,
}

/// Why a node cannot complete a tick.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{reason}")]
pub struct NodeFault {
    /// The reason given by the node.
    pub reason: String,
}

/// Why a world cannot continue.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{reason}")]
pub struct WorldError {
    /// The reason given by the world.
    pub reason: String,
}

impl WorldError {
    /// Creates an error with the given reason.
    pub fn new(reason: impl Into<String>) -> Self {
        Self { reason: reason.into() }
    }
}

/// Why a simulation could not start or continue.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SimError {
    /// Faults of the graph's description.
    #[error(transparent)]
    Build(#[from] BuildErrors),
    /// A duration that does not fit the clock.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// An output value that is infinite or not a number.
    #[error("`{path}.{port}` became {value} in tick {tick}; expected a finite number")]
    NonFinite {
        /// The node's path.
        path: String,
        /// The port's name.
        port: String,
        /// The value.
        value: f32,
        /// The tick in which the value appeared.
        tick: u64,
    },
    /// A node that failed during a tick.
    #[error("`{path}` failed in tick {tick}: {source}")]
    Node {
        /// The node's path.
        path: String,
        /// The tick.
        tick: u64,
        /// The node's error.
        source: NodeFault,
    },
    /// A world that failed.
    #[error("the world failed in tick {tick}: {source}")]
    World {
        /// The tick.
        tick: u64,
        /// The world's error.
        source: WorldError,
    },
    /// A graph with a world link in a run without a world, or the reverse.
    #[error("{}", if *.linked { "the graph links to a world but the run has none; add one with `RunConfig::in_world`" } else { "the run has a world but the graph has no link to one; add a link with `GraphBuilder::world`" })]
    WorldMissing {
        /// Whether the graph has a link.
        linked: bool,
        /// Whether the run has a world.
        given: bool,
    },
    /// A world and a link with different numbers of sense or command values.
    #[error(
        "the world has {world} {what} values but the world link `{link}` has {graph}; expected equal numbers"
    )]
    WorldShape {
        /// The link's path.
        link: String,
        /// `sense` or `command`.
        what: &'static str,
        /// Number of values of the world.
        world: usize,
        /// Number of values of the link.
        graph: usize,
    },
    /// A noise scale that is negative or not finite.
    #[error("a noise scale of {scale} is not usable; expected a finite number of at least 0")]
    BadNoise {
        /// The scale given.
        scale: f32,
    },
    /// A checkpoint from a graph with another fingerprint, or a world in only one of the two runs.
    #[error(
        "the checkpoint belongs to another graph or run; \
         nodes, parameters, connections, probes, length of a tick, build seed and presence of a world must be the same"
    )]
    ForeignCheckpoint,
    /// A run that failed within a tick, so that its values belong to no tick.
    #[error("the run was interrupted in tick {tick} ({reason}); reset it or restore a checkpoint")]
    Interrupted {
        /// The tick.
        tick: u64,
        /// Why the tick was not completed.
        reason: String,
    },
    /// An output that the graph does not have.
    #[error("the graph has no output `{asked}`; it has: {}", list(choices))]
    UnknownOutput {
        /// The name asked for.
        asked: String,
        /// All outputs of the graph.
        choices: Vec<String>,
    },
    /// Another process of the run that ended, failed, or runs another graph.
    #[error("rank {rank} {reason}")]
    Rank {
        /// The process, counted from 0.
        rank: usize,
        /// What happened to it.
        reason: String,
    },
    /// More results of parts than ranks can exchange.
    #[error("the ranks would exchange {values} values in a tick; expected at most {}", i32::MAX)]
    TooMuchToExchange {
        /// Number of values.
        values: usize,
    },
    /// Too little memory for the samples of a probe.
    #[error(
        "too little memory for {samples} more samples of the probe on `{port}`; \
         limit its capacity or use a longer period"
    )]
    ProbeStorage {
        /// The probed port.
        port: String,
        /// Number of samples to be stored.
        samples: usize,
    },
}
