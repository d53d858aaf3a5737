//! The built graph as data: nodes with their outputs, and connections, for pictures.

use std::collections::BTreeMap;

use serde::Serialize;

use super::graph::Graph;
use crate::sim::describe::draft::Note;
use crate::sim::describe::synapse::Synapse;
use crate::sim::real::Real;

/// A graph as data. Nodes stand in the order in which they emit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GraphOutline {
    /// The nodes.
    pub nodes: Vec<NodeOutline>,
    /// The connections, in the order in which they were made.
    pub edges: Vec<EdgeOutline>,
    /// Length of a tick, in seconds.
    pub dt_s: f64,
    /// What paths are called for people, and what is there.
    pub notes: BTreeMap<String, Note>,
}

/// A node of a [`GraphOutline`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NodeOutline {
    /// Path of the node, such as `memory/state`.
    pub path: String,
    /// Number of spiking neurons.
    pub neurons: usize,
    /// Whether interventions can set its outputs.
    pub source: bool,
    /// Its outputs.
    pub outputs: Vec<OutputOutline>,
}

/// An output of a [`NodeOutline`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OutputOutline {
    /// Name, as [`Graph::output`] takes it. If a module around the node has a name for the output, it is that of the outermost.
    pub name: String,
    /// Number of values.
    pub width: usize,
}

/// A connection of a [`GraphOutline`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EdgeOutline {
    /// Index of the node that it leaves.
    pub from: usize,
    /// Index of the output that it leaves.
    pub output: usize,
    /// Index of the node that it enters.
    pub to: usize,
    /// Name of the input that it enters.
    pub input: String,
    /// Its synapse, such as `5 ms`; empty for none.
    pub synapse: String,
    /// The number by which what it carries is multiplied, if the node that it enters has one for this input.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weight: Option<Real>,
}

impl Graph {
    /// Returns the graph as data.
    ///
    /// ```
    /// use symbolt::prelude::*;
    /// let mut graph = GraphBuilder::new();
    /// let one = graph.add("one", Constant::scalar(1.0));
    /// let sum = graph.add("sum", Add::scalar());
    /// graph.connect(&one, &sum.input, Synapse::lowpass_ms(10));
    /// let sim = graph.start(&PopulationPlan::direct(), Seed::new(1))?;
    /// let outline = sim.graph().outline();
    /// assert_eq!(outline.nodes[0].path, "one");
    /// assert!(outline.nodes[0].source && outline.nodes[0].outputs[0].width == 1);
    /// assert_eq!((outline.edges[0].to, &*outline.edges[0].synapse), (1, "10 ms"));
    /// # Ok::<(), symbolt::sim::SimError>(())
    /// ```
    pub fn outline(&self) -> GraphOutline {
        let nodes = self.nodes.iter().zip(&self.bodies).enumerate().map(|(index, (node, body))| {
            let outputs = node.ports.outputs.iter().map(|output| {
                let full = || format!("{}.{}", node.path, output.name);
                let name = output.exposed.as_deref().map_or_else(full, str::to_owned);
                OutputOutline { name, width: output.width() }
            });
            NodeOutline {
                path: node.path.clone(),
                neurons: body.units(),
                source: self.is_source(index),
                outputs: outputs.collect(),
            }
        });
        let edges = self.edges.iter().map(|edge| EdgeOutline {
            from: edge.from.0,
            output: edge.from.1,
            to: edge.to.0,
            input: self.nodes[edge.to.0].ports.inputs[edge.to.1].name.clone(),
            synapse: match edge.via {
                Synapse::None => String::new(),
                via => via.to_string(),
            },
            weight: self.bodies[edge.to.0].weight(edge.to.1),
        });
        GraphOutline {
            nodes: nodes.collect(),
            edges: edges.collect(),
            dt_s: self.time.dt_s(),
            notes: self.notes.clone(),
        }
    }
}
