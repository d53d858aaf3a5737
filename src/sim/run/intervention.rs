//! What can be changed in a run between two ticks, and how places in a graph are named.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use thiserror::Error;

use crate::sim::build::graph::Graph;
use crate::sim::describe::handle::{Out, PortRef};
use crate::sim::describe::kind::Kind;
use crate::sim::error::list;
use crate::sim::path::is_within;
use crate::sim::real::Real;
use crate::sim::words::{cut, nearest};

/// A change of a run between two ticks. It holds from the next tick on.
///
/// An output is named as in [`Graph::output`]: by node and port (`bind/back.out`), or as a module around it calls it
/// (`bind.output`). A node or a module is named by its path (`bind/back`, `bind`).
///
/// In JSON an intervention is an object with one key, its name:
///
/// ```
/// use symbolt::sim::Intervention;
/// let clamp = Intervention::Clamp { output: "goal.out".into(), values: vec![0.5, -1.0] };
/// let text = r#"{"clamp":{"output":"goal.out","values":[0.5,-1.0]}}"#;
/// assert_eq!(serde_json::to_string(&clamp)?, text);
/// assert_eq!(serde_json::from_str::<Intervention>(text)?, clamp);
/// # Ok::<(), serde_json::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
#[non_exhaustive]
pub enum Intervention {
    /// Holds an output at `values`, whatever its node computes, until it is released.
    Clamp {
        /// The output.
        output: String,
        /// Finite values, as many as the output is wide.
        values: Vec<Real>,
    },
    /// Holds one output, or all outputs of a node or module, at zero until they are released. Nobody sees spikes of the
    /// neurons of a silenced node or module either: they count as not fired, in recordings too. What goes on inside
    /// a node goes on, as in neurons whose axons are cut: after the release its outputs are its own at once.
    Silence {
        /// Output, node or module.
        at: String,
    },
    /// Ends every clamp and silence of an output, node or module.
    Release {
        /// Output, node or module.
        at: String,
    },
    /// Lets a source show `values` from now on, such as another goal. A source is an output of a node without inputs, or
    /// of the link to the world. A clamp hides the values until its release; another `Set` replaces them.
    Set {
        /// Output of a source.
        output: String,
        /// Finite values, as many as the output is wide.
        values: Vec<Real>,
    },
    /// Sets the factor of noise amplitudes. Noise stays a function of run seed, path and tick.
    Noise {
        /// Node or module, whose factor multiplies that of the run; the run without it. Nodes that draw no noise
        /// stay as they are.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        at: Option<String>,
        /// Factor, finite and at least 0.
        scale: Real,
    },
    /// Changes the world ([`World::intervene`](crate::sim::World::intervene)), such as `{"world":{"remove":{"object":"part_0"}}}`.
    /// What can be asked for is the world's own affair.
    World(Value),
}

/// Why an intervention is not possible. The run has not changed.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum InterventionError {
    /// A place that the graph does not have.
    #[error("the graph has no {what} `{asked}`; the most similar: {}", list(choices))]
    UnknownPlace {
        /// `output`, `output, node or module`, or `node or module`.
        what: &'static str,
        /// The name asked for.
        asked: String,
        /// Places of the graph, the most similar first, at most 10.
        choices: Vec<String>,
    },
    /// Another number of values than the output has.
    #[error("`{output}` takes {expected} values, not {given}")]
    Width {
        /// The output.
        output: String,
        /// Width of the output.
        expected: usize,
        /// Number of values given.
        given: usize,
    },
    /// A value that is infinite or not a number.
    #[error("value {index} for `{output}` is {value}; expected finite numbers")]
    NotFinite {
        /// The output.
        output: String,
        /// Index of the value, counted from 0.
        index: usize,
        /// The value.
        value: Real,
    },
    /// A factor that is negative or not finite.
    #[error("a noise scale of {scale} is not usable; expected a finite number of at least 0")]
    BadNoise {
        /// The factor given.
        scale: Real,
    },
    /// Values for an output that its node computes from inputs.
    #[error(
        "`{output}` is computed from inputs, so it can be clamped but not set; sources are: {}",
        list(choices)
    )]
    NotASource {
        /// The output.
        output: String,
        /// Outputs of sources, the most similar first, at most 10.
        choices: Vec<String>,
    },
    /// A release where nothing is clamped or silenced.
    #[error("nothing is clamped or silenced at `{at}`; held are: {}", list(held))]
    NothingHeld {
        /// The place.
        at: String,
        /// Outputs that are clamped or silenced, the most similar first, at most 10.
        held: Vec<String>,
    },
    /// A change that the world refuses, or a change of the world in a run without one.
    #[error("{reason}")]
    World {
        /// The reason.
        reason: String,
    },
    /// An intervention for which the log of a live run has no room.
    #[error(
        "the log is full: it holds at most {most} interventions, with {most_values} values in all"
    )]
    LogFull {
        /// Greatest number of interventions.
        most: usize,
        /// Greatest number of their values.
        most_values: usize,
    },
}

impl Intervention {
    /// Returns the number of its values; of a change of the world the length of its text.
    pub(crate) fn values(&self) -> usize {
        match self {
            Self::Clamp { values, .. } | Self::Set { values, .. } => values.len(),
            Self::World(wish) => wish.to_string().len(),
            Self::Silence { .. } | Self::Release { .. } | Self::Noise { .. } => 0,
        }
    }
}

/// Greatest number of characters of a name in a message.
const LONGEST: usize = 300;

/// An output by the indices of its node and port, or all nodes at or below a path.
pub(crate) enum Place {
    Output(usize, usize),
    Nodes(Vec<usize>),
}

impl Graph {
    /// Returns the name of an output, as [`output`](Self::output) and interventions take it. `None` for a handle of
    /// another graph.
    pub fn name_of<K: Kind>(&self, out: &Out<K>) -> Option<String> {
        let PortRef::Known { builder, node, port, .. } = &out.port else { return None };
        let node = *self.handles.get(*node).filter(|_| *builder == self.builder)?;
        (*port < self.nodes[node].outs.len()).then(|| self.output_name(node, *port))
    }

    pub(crate) fn output_name(&self, node: usize, output: usize) -> String {
        let node = &self.nodes[node];
        format!("{}.{}", node.path, node.ports.outputs[output].name)
    }

    /// Returns the nodes at or below a path.
    fn nodes_at(&self, path: &str) -> Vec<usize> {
        (0..self.nodes.len()).filter(|node| is_within(&self.nodes[*node].path, path)).collect()
    }

    pub(crate) fn output_at(&self, name: &str) -> Result<(usize, usize), InterventionError> {
        self.find_output(name).ok_or_else(|| {
            let choices = nearest(name, self.outputs().chain(self.exposed()));
            InterventionError::UnknownPlace {
                what: "output",
                asked: cut(name, LONGEST).into(),
                choices,
            }
        })
    }

    pub(crate) fn modules_at(&self, path: &str) -> Result<Vec<usize>, InterventionError> {
        let nodes = self.nodes_at(path);
        if !nodes.is_empty() {
            return Ok(nodes);
        }
        let (what, asked) = ("node or module", cut(path, LONGEST).into());
        Err(InterventionError::UnknownPlace { what, asked, choices: nearest(path, self.modules()) })
    }

    pub(crate) fn place(&self, at: &str) -> Result<Place, InterventionError> {
        if let Some((node, output)) = self.find_output(at) {
            return Ok(Place::Output(node, output));
        }
        let nodes = self.nodes_at(at);
        if !nodes.is_empty() {
            return Ok(Place::Nodes(nodes));
        }
        let all = self.outputs().chain(self.exposed()).chain(self.modules());
        let (what, choices) = ("output, node or module", nearest(at, all));
        Err(InterventionError::UnknownPlace { what, asked: cut(at, LONGEST).into(), choices })
    }

    /// Returns whether a node shows values that it does not compute from inputs.
    pub(crate) fn is_source(&self, node: usize) -> bool {
        let linked = self.world.is_some_and(|world| world.node == node);
        linked || self.nodes[node].ports.inputs.is_empty()
    }

    /// Returns the names that modules give to outputs.
    fn exposed(&self) -> impl Iterator<Item = String> + '_ {
        let outputs = self.nodes.iter().flat_map(|node| &node.ports.outputs);
        outputs.flat_map(|o| o.exposed.iter().chain(&o.inner)).map(|name| name.to_string())
    }

    /// Returns the paths of all nodes and modules, modules as often as they have nodes.
    fn modules(&self) -> impl Iterator<Item = String> + '_ {
        self.paths().flat_map(|path| {
            let modules = path.match_indices('/').map(|(end, _)| path[..end].to_owned());
            modules.chain([path.to_owned()])
        })
    }
}
