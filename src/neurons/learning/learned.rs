//! Learned connections: weights that rules change while the graph runs.

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use ndarray::Array2;

use super::connection::{Connection, Described, Placed, Shown};
use super::weights::{Weights, WeightsError, save};
use super::{LearningRule, Side, Trace, WeightShape};
use crate::files::Overwrite;
use crate::sim::{In, Module, NodePorts, Out, Scalar, Scope, Simulator, Synapse, Vector};

/// Greatest number of weights.
const MOST_WEIGHTS: usize = 1 << 26;

/// A connection whose weights are learned: its output is the product of a matrix, with a row per output and a column per
/// source, and the activity of the sources.
///
/// The weights are state of the graph. They start as [`weights`](Self::weights) says, and the [rules](Self::rule) change
/// them; see the module [`learning`](super) for the order within a tick. Costs two operations per weight and
/// tick, or per weight of an active source if at most a quarter of them are, and what the rules cost.
///
/// - From the neurons of an ensemble to a value: [`new`](Self::new), with as many outputs as the value has components. The
///   output adds to what else reaches an input; to start from the decoders of a function, connect this function too.
/// - From neurons to neurons: the same, with as many outputs as there are target neurons, into their
///   [`currents`](crate::neurons::EnsemblePorts::currents). These weights do not include the targets' gains.
/// - From a value to neurons: [`encoders`](Self::encoders).
///
/// A channel that is learned from its error:
///
/// ```
/// use symbolt::neurons::{Ensemble, Learned, Pes};
/// use symbolt::prelude::*;
///
/// let mut graph = GraphBuilder::new();
/// let given = graph.add("given", Constant::vector(&[0.5]));
/// let pre = graph.add("pre", Ensemble::new(1).neurons(60).expose_neurons().identity("x"));
/// let post = graph.add("post", Ensemble::new(1).neurons(60).identity("x"));
/// let learned = graph.add("learned", Learned::new(&pre.neurons(), 1).rule(Pes::new(1e-3)));
/// graph.route(&given >> &pre.input);
/// graph.route(&learned >> &post.input);
/// graph.route(&post.output("x") - &pre.output("x") >> &learned.error());
/// let probe = graph.probe(&post.output("x"), ProbeSpec::default().filtered(Synapse::lowpass_ms(20)));
/// let plan = PopulationPlan::lif();
/// let sim = graph.run(&plan, Seed::new(1), SimDuration::from_millis(500))?;
/// assert!(sim.samples(&probe).last().is_some_and(|(_, x)| (x[0] - 0.5).abs() < 0.1));
/// assert_eq!(learned.weights(&sim).dim(), (1, 60));
/// # Ok::<(), symbolt::sim::SimError>(())
/// ```
#[derive(Debug)]
pub struct Learned {
    /// The activity of the sources; `None` for the value of [`Learned::encoders`].
    pre: Option<Out<Vector>>,
    /// The width of a value.
    dims: usize,
    /// The number of outputs; the number of target neurons if it is not given.
    outputs: Option<usize>,
    post: Option<Out<Vector>>,
    sources: Option<Range<usize>>,
    targets: Option<Range<usize>>,
    rules: Vec<Arc<dyn LearningRule>>,
    weights: Weights,
    switched: bool,
    exposed: Vec<String>,
}

impl Learned {
    /// Requests a connection from activities, such as [`EnsemblePorts::neurons`](crate::neurons::EnsemblePorts::neurons),
    /// to so many outputs. Every connection from the output needs a synapse. The weights start at 0.
    pub fn new(pre: &Out<Vector>, outputs: usize) -> Self {
        Self {
            pre: Some(pre.clone()),
            dims: 0,
            outputs: Some(outputs),
            post: None,
            sources: None,
            targets: None,
            rules: Vec::new(),
            weights: Weights::zero(),
            switched: false,
            exposed: Vec::new(),
        }
    }

    /// Requests encoders that are learned: a connection from a value of `dims` components, its input
    /// [`input`](LearnedPorts::input), to the neurons whose activity is `post`. Its output belongs into their port
    /// [`encoded`](crate::neurons::EnsemblePorts::encoded) and needs no synapse: it is computed before the neurons advance.
    /// The ensemble's own encoders have no part in it. [`Weights::directions`] draws encoders to start from.
    pub fn encoders(dims: usize, post: &Out<Vector>) -> Self {
        Self { pre: None, dims, outputs: None, ..Self::new(post, 0) }.post(post)
    }

    /// Tells the connection the activity of its target neurons, which some rules need: one number per output.
    pub fn post(mut self, post: &Out<Vector>) -> Self {
        self.post = Some(post.clone());
        self
    }

    /// Takes only the sources in a range.
    pub fn sources(mut self, range: Range<usize>) -> Self {
        self.sources = Some(range);
        self
    }

    /// Takes only the target neurons in a range. Needs [`post`](Self::post).
    pub fn targets(mut self, range: Range<usize>) -> Self {
        self.targets = Some(range);
        self
    }

    /// Adds a rule. Rules may be added in any order: their changes add up. If several have an input or a state of the
    /// same name, those of the second end in `-2`, and so on.
    pub fn rule(mut self, rule: impl LearningRule) -> Self {
        self.rules.push(Arc::new(rule));
        self
    }

    /// Sets the weights to start from.
    pub fn weights(mut self, weights: Weights) -> Self {
        self.weights = weights;
        self
    }

    /// Adds the input [`learning`](LearnedPorts::learning), a factor of all changes: 1 learns and 0 does not. A factor
    /// below 0 undoes.
    pub fn switched(mut self) -> Self {
        self.switched = true;
        self
    }

    /// Adds the output `name`, to be probed: `weights`, or a state of a rule, row by row; or `delta`, the change of the
    /// weights in this tick. It costs a copy in every tick. [`LearnedPorts::weights`] and [`LearnedPorts::state`] read
    /// the same from a run without.
    pub fn expose(mut self, name: &str) -> Self {
        self.exposed.push(name.into());
        self
    }
}

/// Ports of a [`Learned`] connection, and its weights in a run.
#[derive(Debug, Clone)]
pub struct LearnedPorts {
    /// Output.
    pub output: Out<Vector>,
    node: NodePorts,
    shape: WeightShape,
    layout: Arc<[(String, Range<usize>)]>,
}

impl LearnedPorts {
    /// Returns the input of the value, of [`Learned::encoders`]. Adds any number of connections.
    pub fn input(&self) -> In<Vector> {
        self.node.input("input")
    }

    /// Returns the input of a rule, such as `error`, or `error-2` of the second rule that has one. It is read at the end
    /// of the tick and adds any number of connections.
    pub fn signal(&self, name: &str) -> In<Vector> {
        self.node.input(name)
    }

    /// Returns the input `error`: what is, minus what should be, one number per output.
    pub fn error(&self) -> In<Vector> {
        self.signal("error")
    }

    /// Returns the input `target`: what should be, one number per output.
    pub fn target(&self) -> In<Vector> {
        self.signal("target")
    }

    /// Returns the input that starts and stops learning, of [`Learned::switched`].
    pub fn learning(&self) -> In<Scalar> {
        self.node.input("learning")
    }

    /// Returns an output that [`Learned::expose`] has added.
    pub fn exposed(&self, name: &str) -> Out<Vector> {
        self.node.output(name)
    }

    /// Returns the weights that the next tick of a run will use: a row per output, a column per source. Empty for a run of
    /// another graph.
    pub fn weights(&self, sim: &Simulator) -> Array2<f64> {
        let values = self.state(sim, "weights").unwrap_or_default();
        let shape = (self.shape.outputs, self.shape.inputs);
        Array2::from_shape_vec(shape, values).unwrap_or_default()
    }

    /// Returns the state of a rule in a run by its name, such as `theta`; `None` for a name that no rule has, and for a
    /// run of another graph.
    pub fn state(&self, sim: &Simulator, name: &str) -> Option<Vec<f64>> {
        let (_, range) = self.layout.iter().find(|(own, _)| own == name)?;
        let all: &[f64] = bytemuck::cast_slice(sim.state(&self.node)?.longs);
        all.get(range.clone()).map(<[f64]>::to_vec)
    }

    /// Writes the weights to a file of numpy (`.npz`), which [`Weights::read`] reads: the array `weights`, in double
    /// precision.
    ///
    /// # Errors
    /// [`WeightsError::File`] if the file cannot be written; [`WeightsError::AnotherGraph`] for a run of another graph, which
    /// leaves the file as it was.
    pub fn save(
        &self,
        sim: &Simulator,
        path: &Path,
        overwrite: Overwrite,
    ) -> Result<(), WeightsError> {
        if self.state(sim, "weights").is_none() {
            return Err(WeightsError::AnotherGraph);
        }
        save(&self.weights(sim), path, overwrite)
    }
}

/// Returns a name that is not taken: `name`, `name-2`, and so on.
fn free<'n>(name: &str, mut taken: impl Iterator<Item = &'n str> + Clone) -> String {
    let numbered = (2..).map(|n| format!("{name}-{n}"));
    let mut all = std::iter::once(name.to_owned()).chain(numbered);
    all.find(|name| !taken.clone().any(|other| other == name)).unwrap_or_else(|| {
        // There are endless names.
        taken.next().map_or_else(String::new, Into::into)
    })
}

impl Learned {
    /// Returns the connection and everything that is wrong with it. `pre` and `post` are the widths of these ports.
    fn placed(&self, pre: usize, post: Option<usize>) -> (Connection, Vec<String>) {
        let mut wrong = Vec::new();
        let mut within = |what: &str, range: &Option<Range<usize>>, width: usize| match range {
            Some(range) if range.is_empty() || range.end > width => {
                wrong.push(format!(
                    "{what} {}..{}; expected a range that is not empty, within 0..{width}",
                    range.start, range.end
                ));
                0..width
            }
            Some(range) => range.clone(),
            None => 0..width,
        };
        let sources = within("sources", &self.sources, pre);
        let post = post.map(|width| (width, within("targets", &self.targets, width)));
        if self.targets.is_some() && post.is_none() {
            wrong.push("`targets` without the activity of target neurons; expected `post`".into());
        }
        let targets = post.as_ref().map(|(_, range)| range.len());
        let (outputs, inputs) = (self.outputs.or(targets).unwrap_or(0), sources.len());
        let mut shape = WeightShape { outputs, inputs };
        if !(1..=MOST_WEIGHTS).contains(&outputs.saturating_mul(inputs)) {
            wrong.push(format!(
                "{outputs} outputs of {inputs} sources; expected at least one of each, and at most {MOST_WEIGHTS} weights"
            ));
            shape = WeightShape { outputs: 1, inputs: 1 };
        }
        let mut layout = vec![("weights".to_owned(), 0..shape.outputs * shape.inputs)];
        let mut rules: Vec<Placed> = Vec::new();
        let mut inputs_so_far = 1 + usize::from(post.is_some()) + usize::from(self.switched);
        for rule in &self.rules {
            let needs = match rule.needs(shape) {
                Ok(needs) => needs,
                Err(error) => {
                    wrong.push(format!("rule `{}`: {error}", rule.name()));
                    continue;
                }
            };
            let follows = |side: Side| needs.traces.iter().any(|trace| trace.of == side);
            for Trace { state, of, .. } in &needs.traces {
                let wide = if *of == Side::Pre { shape.inputs } else { shape.outputs };
                if !needs.state.contains(&(*state, wide)) {
                    let reason = format!("a part `{state}` of its state, of {wide} numbers");
                    wrong.push(format!("rule `{}`: a trace needs {reason}", rule.name()));
                }
            }
            if (needs.post || follows(Side::Post)) && targets != Some(shape.outputs) {
                let found = targets.map_or("none".to_owned(), |count| count.to_string());
                wrong.push(format!(
                    "rule `{}` needs the activity of {} target neurons; expected `post` with as many, found {found}",
                    rule.name(),
                    shape.outputs
                ));
            }
            let signal = needs.signal.map(|(name, _)| {
                let taken = rules.iter().filter_map(|rule| rule.signal.as_ref());
                let fixed = ["pre", "input", "post", "learning"];
                let name = free(name, taken.map(|(name, _)| name.as_str()).chain(fixed));
                inputs_so_far += 1;
                (name, inputs_so_far - 1)
            });
            let from = layout.last().map_or(0, |(_, range)| range.end);
            for (name, length) in &needs.state {
                let name = free(name, layout.iter().map(|(name, _)| name.as_str()));
                let start = layout.last().map_or(0, |(_, range)| range.end);
                layout.push((name, start..start.saturating_add(*length)));
            }
            let state = from..layout.last().map_or(0, |(_, range)| range.end);
            rules.push(Placed { rule: rule.clone(), needs, signal, state });
        }
        let start = self.weights.of(shape).unwrap_or_else(|reason| {
            wrong.push(reason);
            vec![0.0; shape.outputs * shape.inputs]
        });
        let mut shown: Vec<(String, Shown)> = Vec::new();
        for name in &self.exposed {
            let known = layout.iter().find(|(own, _)| own == name);
            match known {
                Some((_, range)) => shown.push((name.clone(), Shown::State(range.clone()))),
                None if name == "delta" => shown.push((name.clone(), Shown::Delta)),
                None => {
                    let names: Vec<&str> = layout.iter().map(|(name, _)| name.as_str()).collect();
                    wrong.push(format!(
                        "there is no `{name}` to expose; expected `delta`, `{}`",
                        names.join("`, `")
                    ));
                }
            }
        }
        let connection = Connection {
            shape,
            emits: self.pre.is_none(),
            pre: (pre, sources),
            post,
            switched: self.switched,
            rules,
            start,
            layout: layout.into(),
            shown,
        };
        (connection, wrong)
    }
}

impl Module for Learned {
    type Ports = LearnedPorts;

    fn expand(self, scope: &mut Scope<'_>) -> LearnedPorts {
        // A faulty handle is reported where it is connected.
        let width = |out: &Out<Vector>| scope.width_of(out).unwrap_or(1);
        let pre = self.pre.as_ref().map_or(self.dims, width);
        let post = self.post.as_ref().map(width);
        let (connection, wrong) = self.placed(pre, post);
        for reason in wrong {
            scope.refuse(reason);
        }
        let (shape, layout) = (connection.shape, connection.layout.clone());
        let node = scope.process(Described(Arc::new(connection)));
        for (name, out) in [("pre", &self.pre), ("post", &self.post)] {
            if let Some(out) = out {
                scope.connect(out, &node.input(name), Synapse::None);
            }
        }
        LearnedPorts { output: node.output("output"), node, shape, layout }
    }
}
