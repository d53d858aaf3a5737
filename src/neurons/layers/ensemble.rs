//! Ensembles of several dimensions from which several functions are decoded.

mod targets;

use std::ops::Range;

use super::neuron_ports::NeuronPorts;
use super::represent::limiting;
use super::settings::Settings;
use super::{Circuit, Layer, Layers, Populated, Target, check_radius};
use crate::neurons::bank::{Draft, Shape};
use crate::neurons::builder::{self, PopulationBuilder};
use crate::neurons::draw::{EvenPoints, in_ball};
use crate::neurons::models::NeuronModel;
use crate::neurons::solve::{Points, Special};
use crate::neurons::tuning::{MAX_NEURONS, TuningError, refuse};
use crate::sim::{
    AdvanceIo, Fingerprint, In, InputSpec, Module, Node, NodeFault, NodePorts, Numbers, Out,
    OutputSpec, Outputs, PortDecl, Real, Scope, ScratchSpec, Seed, StepCx, Vector, few,
};

/// Greatest number of components of the input and of all outputs.
const MOST_COMPONENTS: usize = 1 << 20;

/// A function that is decoded from an ensemble.
#[derive(Clone)]
pub(super) struct Decoded {
    name: String,
    target: Target,
}

/// A request for one ensemble of several dimensions, from which any functions of the represented vector are decoded.
///
/// All functions read the same neurons: each costs decoders, but no further neurons. It is also a module, which adds
/// the layer as its node `neurons`.
///
/// In neurons, an ensemble has [`Tuning::per_function`](crate::neurons::Tuning::per_function) neurons per dimension
/// times [`size`](Self::size). Direct mode computes the functions exactly, of the vector limited to the radius, because
/// neurons saturate there. Solving costs O(points x neurons^2), about 0.1 s for 1,000 neurons.
///
/// Up to three dimensions neurons and evaluation points are spread evenly, from a random start: chance would leave gaps.
/// In one dimension, encoders are 1 and -1 in turn, the range of intercepts is cut into as many parts as there are pairs
/// of neurons, and points lie evenly apart. In two and three, encoders with intercepts are points of a quasirandom
/// sequence (Roberts 2018), and so are the evaluation points in the ball of the radius. In more dimensions encoders are
/// random directions, and intercepts follow the distribution of one coordinate in the ball, so that neurons fire where
/// values are (Gosmann and Eliasmith 2016). Points are drawn with the norms of a ball of three dimensions: nearly all
/// points of a ball of many dimensions lie at its surface.
///
/// A controlled oscillator: the ensemble represents a point and decodes its motion.
///
/// ```
/// use symbolt::neurons::Ensemble;
/// use symbolt::prelude::*;
/// use symbolt::sim::Signal;
///
/// let mut graph = GraphBuilder::new();
/// let turn = |x: &[f32], out: &mut [f32]| {
///     // The synapse below has 100 ms, and the point turns by 10 rad/s.
///     (out[0], out[1]) = (1.1 * x[0] - x[1], 1.1 * x[1] + x[0]);
///     let scale = 1.0 / (0.3 + x[0] * x[0] + x[1] * x[1]).sqrt();
///     out.iter_mut().for_each(|value| *value *= scale);
/// };
/// let point = graph.add("point", Ensemble::new(2).radius(1.2).decode("turned", 2, turn).identity("point"));
/// let kick = graph.add("kick", Signal::vector(2, |t, out| out[0] = if t < 0.1 { 1.0 } else { 0.0 }));
/// graph.route(&kick >> &point.input);
/// graph.route((&point.output("turned") >> &point.input).via(Synapse::lowpass_ms(100)));
/// # Ok::<(), symbolt::sim::SimError>(())
/// ```
#[derive(Clone)]
pub struct Ensemble {
    dims: usize,
    copies: usize,
    radius: Real,
    size: Real,
    /// Number of neurons in each copy, if it does not follow from the plan.
    neurons: Option<usize>,
    exposed: bool,
    /// Variables of the neurons' state that are outputs.
    states: Vec<String>,
    pub(super) functions: Vec<Decoded>,
    pub(super) settings: Settings,
}

/// Ports of an [`Ensemble`].
#[derive(Debug, Clone)]
pub struct EnsemblePorts {
    /// Value to represent; adds any number of connections.
    pub input: In<Vector>,
    node: NodePorts,
}

impl EnsemblePorts {
    pub(super) fn of(node: NodePorts) -> Self {
        Self { input: node.input("in"), node }
    }

    /// Returns the path of the layer, by which [`BuiltLayer`](crate::neurons::BuiltLayer) reads it back.
    pub fn path(&self) -> &str {
        &self.node.path
    }

    /// Returns the output of the function called `name`. Every connection from it needs a synapse. Using a name that
    /// the ensemble does not have is a fault when the graph is built.
    pub fn output(&self, name: &str) -> Out<Vector> {
        self.node.output(name)
    }

    /// Returns the activity of every neuron in Hz, copy by copy: its rate, or 1 / dt in a tick in which it spikes. Every
    /// connection from it needs a synapse, except to an input read at the end of the tick
    /// ([`InputSpec::at_settle`](crate::sim::InputSpec::at_settle)). Needs [`Ensemble::expose_neurons`], as the next two
    /// ports do; otherwise using it is a fault when the graph is built.
    pub fn neurons(&self) -> Out<Vector> {
        self.node.output("neurons").added_by("expose_neurons")
    }

    /// Returns a variable of every neuron after the tick, copy by copy, to be probed. Needs [`Ensemble::expose_state`].
    pub fn state(&self, variable: &str) -> Out<Vector> {
        self.node.output(variable).added_by("expose_state")
    }

    /// Returns the input of currents into bare neurons: one number per neuron, copy by copy, added after gain and bias.
    /// Adds any number of connections, or none. What reaches `.neurons` in Nengo is multiplied by the neurons' gains:
    /// the input for that is [`encoded`](Self::encoded).
    pub fn currents(&self) -> In<Vector> {
        self.node.input("currents").added_by("expose_neurons")
    }

    /// Returns the input of encoded values: one number per neuron, copy by copy, in the place of the product of its
    /// encoder with the value. The neuron's current gets the number times gain / radius. Adds any number of connections,
    /// or none.
    pub fn encoded(&self) -> In<Vector> {
        self.node.input("encoded").added_by("expose_neurons")
    }
}

impl Ensemble {
    /// Requests an ensemble for vectors of `dims` components (at least 1). The input adds any number of connections.
    pub fn new(dims: usize) -> Self {
        let (functions, settings) = (Vec::new(), Settings::default());
        let (neurons, exposed, states) = (None, false, Vec::new());
        let (radius, size) = (1.0, 1.0);
        Self { dims, copies: 1, radius, size, neurons, exposed, states, functions, settings }
    }

    /// Decodes a function that returns its value: a number, or an array of numbers. As [`decode`](Self::decode)
    /// otherwise.
    ///
    /// ```
    /// use symbolt::neurons::Ensemble;
    /// let pair = Ensemble::new(2).function("product", |x| x[0] * x[1]).function("swapped", |x| [x[1], x[0]]);
    /// # let _ = pair;
    /// ```
    pub fn function<N: Numbers>(
        self,
        name: &str,
        function: impl Fn(&[Real]) -> N + Send + Sync + 'static,
    ) -> Self {
        self.decode(name, N::WIDTH, move |x, out| function(x).write(out))
    }

    /// Decodes a function of the vector. The closure gets `dims` numbers and writes `width` numbers. Values that are
    /// not finite within the radius are a fault when the graph is built with neurons. Besides the evaluation points
    /// these are checked: the center, both ends of each axis, and poles between points where the sign changes (in one
    /// dimension also where magnitudes peak). Points of your own are checked alone.
    pub fn decode(
        self,
        name: &str,
        width: usize,
        function: impl Fn(&[Real], &mut [Real]) + Send + Sync + 'static,
    ) -> Self {
        self.decode_as(name, Target::function(width, function))
    }

    /// Decodes a function that has a solver or points of its own, or values at given points.
    pub fn decode_as(mut self, name: &str, target: Target) -> Self {
        self.functions.push(Decoded { name: name.into(), target });
        self
    }

    /// Decodes the vector itself.
    pub fn identity(self, name: &str) -> Self {
        let dims = self.dims;
        self.decode(name, dims, |x, out| out.copy_from_slice(x))
    }

    /// Makes an ensemble array: `copies` ensembles side by side (at least 1), each with neurons of its own. Input and
    /// outputs are those of the first copy, then of the second, and so on.
    pub fn copies(mut self, copies: usize) -> Self {
        self.copies = copies;
        self
    }

    /// Sets the greatest norm of a vector that neurons represent (default 1). Anything but a finite number above 0 is a
    /// fault when the graph is built.
    pub fn radius(mut self, radius: Real) -> Self {
        self.radius = radius;
        self
    }

    /// Multiplies the number of neurons by `share` (above 0; the default is 1). Each ensemble must end up with 1 to
    /// 10,000 neurons; anything else is a fault when the graph is built.
    pub fn size(mut self, share: Real) -> Self {
        self.size = share;
        self
    }

    /// Sets the number of neurons in each copy (1 to 10,000), whatever the plan's tuning and [`size`](Self::size) say.
    pub fn neurons(mut self, count: usize) -> Self {
        self.neurons = Some(count);
        self
    }

    /// Adds ports for the neurons themselves: the output [`neurons`](EnsemblePorts::neurons), and the inputs
    /// [`currents`](EnsemblePorts::currents) and [`encoded`](EnsemblePorts::encoded). Their widths need
    /// [`neurons`](Self::neurons). The value to represent may then stay unconnected, and no function need be decoded: such
    /// bare neurons need not fire at any value, and nothing is solved. In direct mode there are no neurons, which is a
    /// fault when the graph is built.
    ///
    /// Inhibition: while `stop` is 1, no neuron fires, whatever the value is.
    ///
    /// ```
    /// use symbolt::neurons::Ensemble;
    /// use symbolt::prelude::*;
    ///
    /// let mut graph = GraphBuilder::new();
    /// let channel = Ensemble::new(1).neurons(60).expose_neurons().identity("same");
    /// let channel = graph.add("channel", channel);
    /// let value = graph.add("value", Constant::vector(&[0.8]));
    /// graph.route(&value >> &channel.input);
    /// let stop = graph.add("stop", Stimulus::scalar(0.0).from(SimDuration::from_millis(200), &[1.0]));
    /// graph.route((stop.transform([[-100.0]; 60]) >> &channel.currents()).via(Synapse::lowpass_ms(5)));
    /// let spec = ProbeSpec::default().filtered(Synapse::lowpass_ms(20));
    /// let probe = graph.probe(&channel.output("same"), spec);
    /// let plan = PopulationPlan::lif();
    /// let sim = graph.run(&plan, Seed::new(1), SimDuration::from_millis(400))?;
    /// let at = |ms: usize| sim.samples(&probe).get(ms - 1).map(|(_, value)| value[0]);
    /// assert!(at(200) > Some(0.6) && at(400) < Some(0.01), "{:?} {:?}", at(200), at(400));
    /// # Ok::<(), symbolt::sim::SimError>(())
    /// ```
    pub fn expose_neurons(mut self) -> Self {
        self.exposed = true;
        self
    }

    /// Adds the output [`state`](EnsemblePorts::state) of a variable of the neurons, such as `voltages`, and the ports of
    /// [`expose_neurons`](Self::expose_neurons). A model names its variables ([`NeuronModel::state`]): those of
    /// [`Lif`] are `voltages` and `refractory times`, in seconds. A name that the model does not have is a fault when the
    /// graph is built. Costs a copy of the variable in every tick.
    ///
    /// [`Lif`]: crate::neurons::Lif
    pub fn expose_state(mut self, variable: &str) -> Self {
        self.states.push(variable.into());
        self.expose_neurons()
    }

    /// Number of neurons in a copy whose neurons have ports; 0 without ports.
    fn ports(&self) -> usize {
        if self.exposed { self.neurons.unwrap_or(1).clamp(1, MAX_NEURONS as usize) } else { 0 }
    }

    /// Names of the outputs that have a number per neuron.
    fn neuron_outputs(&self) -> impl Iterator<Item = &str> {
        let activity = self.exposed.then_some("neurons");
        activity.into_iter().chain(self.states.iter().map(String::as_str))
    }

    /// Number of components that are decoded from one copy.
    fn outputs(&self) -> usize {
        self.functions.iter().fold(0, |sum, decoded| sum.saturating_add(decoded.target.width))
    }

    /// Returns a fault if the input or the outputs of all copies have too many components.
    fn too_wide(&self) -> Option<String> {
        let (dims, copies) = (self.dims, self.copies);
        let of_neurons = self.ports().saturating_mul(1 + self.states.len());
        let most = dims.max(self.outputs()).max(of_neurons).saturating_mul(copies);
        (most > MOST_COMPONENTS).then(|| {
            format!(
                "{copies} copies of {dims} dimensions with {} decoded components are too large; expected at most {MOST_COMPONENTS} in all copies",
                self.outputs()
            )
        })
    }

    /// Writes all functions of one vector, one after another.
    fn compute(&self, value: &[Real], out: &mut [Real]) {
        let mut rest = out;
        for Decoded { target, .. } in &self.functions {
            let (own, after) = rest.split_at_mut(target.width);
            target.compute(value, own);
            rest = after;
        }
    }

    /// Distributes what is decoded from some of the copies to the outputs.
    pub(super) fn distribute(
        &self,
        copies: Range<usize>,
        decoded: &[Real],
        outputs: &mut Outputs<'_>,
    ) {
        let mut from = 0;
        for (index, Decoded { target: Target { width, .. }, .. }) in
            self.functions.iter().enumerate()
        {
            let decoded = decoded.chunks_exact(self.outputs());
            let out = &mut outputs.get_mut(index)[copies.start * width..copies.end * width];
            for (out, row) in out.chunks_exact_mut(*width).zip(decoded) {
                out.copy_from_slice(&row[from..from + width]);
            }
            from += width;
        }
    }
}

impl Node for Ensemble {
    fn declare(&self, ports: &mut PortDecl) {
        for (number, of) in [(self.dims, "dimensions"), (self.copies, "copies")] {
            if number == 0 {
                // Ports without a width would each add a fault.
                ports.fault(format!("0 {of}; expected at least 1"));
                return;
            }
        }
        check_radius(self.radius, ports);
        if self.functions.is_empty() && !self.exposed {
            ports.fault("nothing is decoded; expected at least one function");
        }
        if let Some(reason) = self.too_wide() {
            ports.fault(reason);
        }
        let wide = |width: usize| width.saturating_mul(self.copies).min(MOST_COMPONENTS);
        let value = InputSpec::vector(wide(self.dims)).sum().at_advance();
        ports.input("in", if self.exposed { value.optional() } else { value });
        if let Some(wrong) = self.neurons.filter(|n| !(1..=MAX_NEURONS as usize).contains(n)) {
            ports.fault(format!("{wrong} neurons; expected 1 to {MAX_NEURONS}"));
        }
        if self.exposed {
            if self.neurons.is_none() {
                ports.fault("the neurons have ports but no number; expected `neurons(count)`");
            }
            for name in ["currents", "encoded"] {
                let each = InputSpec::vector(wide(self.ports())).sum().optional();
                ports.input(name, each.at_advance());
            }
        }
        let settings = self.settings.check(self.dims);
        let targets = self.functions.iter().map(|decoded| decoded.target.check(self.dims));
        for error in std::iter::once(settings).chain(targets).filter_map(Result::err) {
            ports.fault(error.to_string());
        }
        for Decoded { name, target: Target { width, .. } } in &self.functions {
            let good = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
            // The engine refuses names that are empty or have a point.
            if !name.chars().all(good) {
                ports.fault(format!(
                    "`{name}` is not a valid name of a function; use one or more of the characters a-z, A-Z, 0-9, `_` and `-`"
                ));
            }
            ports.output(name, OutputSpec::vector(wide(*width)).registered().filtered_only());
        }
        for name in self.neuron_outputs() {
            let each = OutputSpec::vector(wide(self.ports())).registered().filtered_only();
            ports.output(name, each);
        }
        let reals = self.outputs().saturating_mul(self.copies).saturating_add(self.dims);
        let reals = reals.min(2 * MOST_COMPONENTS);
        ports.scratch(ScratchSpec { reals, ..ScratchSpec::default() });
    }

    /// Hashes the functions' values at random points, because functions themselves cannot be hashed.
    fn fingerprint(&self, hash: &mut Fingerprint) {
        let mut rng = Seed::new(0).derive("", "fingerprint").rng();
        let (mut point, mut out) = (vec![0.0; self.dims], vec![0.0; self.outputs()]);
        for _ in 0..128 {
            in_ball(&mut rng, &mut point, usize::MAX);
            let value: Vec<Real> = point.iter().map(|v| *v as Real * self.radius).collect();
            self.compute(&value, &mut out);
            hash.reals(&out);
        }
    }

    fn advance(&self, _cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let (decoded, within) = io.scratch.reals.split_at_mut(self.outputs() * self.copies);
        let values = io.inputs.get(0).chunks_exact(self.dims);
        for (value, out) in values.zip(decoded.chunks_exact_mut(self.outputs())) {
            let scale = limiting(value, self.radius);
            within.iter_mut().zip(value).for_each(|(within, value)| *within = scale * value);
            self.compute(within, out);
        }
        self.distribute(0..self.copies, decoded, &mut io.outputs);
        Ok(())
    }
}

impl Module for Ensemble {
    type Ports = EnsemblePorts;

    fn expand(self, scope: &mut Scope<'_>) -> EnsemblePorts {
        let functions = self.functions.iter().map(|decoded| decoded.name.as_str());
        let names: Vec<String> = functions.chain(self.neuron_outputs()).map(Into::into).collect();
        let has_ports = self.exposed;
        let EnsemblePorts { input, node } = scope.ensemble("neurons", self);
        for name in &names {
            scope.output(name, node.output::<Vector>(name));
        }
        for name in ["currents", "encoded"].iter().filter(|_| has_ports) {
            scope.input(name, node.input::<Vector>(name));
        }
        EnsemblePorts { input: scope.input("input", input), node }
    }
}

impl Layer for Ensemble {
    fn direct(&self) -> Box<dyn Node> {
        Box::new(self.clone())
    }

    fn only_neural(&self) -> Option<&'static str> {
        let reason = "its neurons have ports, but the plan gives it none; expected a population with neurons, such as `Population::Lif`";
        self.exposed.then_some(reason)
    }

    fn neural(&self, builder: &PopulationBuilder<'_>) -> Result<Populated, TuningError> {
        if let Some(reason) = self.too_wide() {
            return Err(refuse("copies", reason, "a smaller ensemble"));
        }
        if self.dims == 0 || self.functions.iter().any(|decoded| decoded.target.width == 0) {
            return Err(refuse("width", 0, "at least 1 dimension, and as much in each function"));
        }
        self.settings.check(self.dims)?;
        self.functions.iter().try_for_each(|decoded| decoded.target.check(self.dims))?;
        // A population decodes at least one number.
        let (dims, outputs) = (self.dims, self.outputs().max(1));
        let settings = self.settings.clone();
        let spec = settings.spec(builder.spec, builder.in_rates);
        let builder = &PopulationBuilder { spec: &spec, ..*builder };
        let per = builder.tuning().per_function as f64 * dims as f64 * f64::from(self.size);
        let neurons = match self.neurons {
            Some(count) if !(1..=MAX_NEURONS as usize).contains(&count) => {
                return Err(refuse("neurons", count, format!("1 to {MAX_NEURONS}")));
            }
            Some(count) => count,
            None => builder.tuning().count(per)?,
        };
        settings.check_neurons((neurons, self.copies), builder.model())?;
        let hadamard = settings.are_hadamard(builder.tuning(), dims);
        let shape = Shape { ensembles: self.copies, neurons, dims, outputs, hadamard };
        let radius = f64::from(self.radius);
        // The same points for all copies: their functions are computed, checked and hashed once.
        let values = self.points(neurons, builder.seed);
        let wanted = self.targets(&values)?;
        let special = self.special()?;
        let mut marks: Vec<f64> = wanted.iter().copied().chain([radius]).collect();
        let mut hash = Fingerprint::default();
        settings.fingerprint(&mut hash, dims);
        self.functions.iter().for_each(|decoded| decoded.target.fingerprint(&mut hash));
        if (2..=EvenPoints::MOST_DIMS).contains(&dims) {
            hash.text("even");
        }
        for Special { points, .. } in &special {
            points.iter().for_each(|points| numbers_of(points, &mut hash));
        }
        if hash != Fingerprint::default() {
            // An ensemble without settings keeps the fingerprint, and so the start, that it always had.
            marks.push((hash.value() >> 11) as f64);
        }
        let functions =
            self.functions.iter().map(|decoded| (decoded.name.clone(), decoded.target.width));
        let decoded = builder::Outputs {
            functions: functions.collect(),
            special,
            tuned: settings.draws_rates_by_plan(),
            regularisation: 1.0,
            distinct: usize::MAX,
        };
        let partition = builder.balance.partition(shape, 1);
        let (starts, spec) = (settings.starts.clone(), builder.spec.clone());
        let draft = move |copy, seed: Seed| {
            let neurons = match dims {
                1 if !settings.draws() => spec.scalar(neurons, seed)?,
                _ if dims <= EvenPoints::MOST_DIMS || settings.draws() => {
                    settings.draw(&spec, &shape, (copy, seed))?
                }
                _ => spec.directions(&shape, &mut seed.rng())?,
            };
            let (values, wanted) = (values.clone(), wanted.clone());
            Ok(Draft { neurons, radius, points: Points { values, wanted, outputs } })
        };
        let mut ensembles = builder.bank((shape, partition), "ensemble", &marks, decoded, draft)?;
        starts.iter().for_each(|(name, start)| ensembles.bank.start(name, *start));
        if !self.exposed {
            return Ok(Populated::new(self.direct(), ensembles, self.clone()));
        }
        let gains = ensembles.gains()?;
        let states = self.variables(&*ensembles.bank.model)?;
        let rows = 1 + states.len();
        let circuit = NeuronPorts { ensemble: self.clone(), gains, neurons, outputs, states };
        let populated = Populated::new(self.direct(), ensembles, circuit);
        Ok(populated.unit(1, outputs + rows * neurons).scratch(neurons))
    }
}

/// Adds points and targets to a hash.
fn numbers_of(points: &Points, hash: &mut Fingerprint) {
    super::settings::numbers(super::settings::numbers(hash, &points.values), &points.wanted);
}

impl Ensemble {
    /// Returns the indices of the variables that are outputs.
    fn variables(&self, model: &dyn NeuronModel) -> Result<Vec<usize>, TuningError> {
        let all: Vec<&str> = model.state().iter().map(|variable| variable.name).collect();
        let index = |name: &String| {
            all.iter().position(|own| own == name).ok_or_else(|| {
                let expected = match all.is_empty() {
                    true => format!("none: neurons of the model `{}` have no state", model.name()),
                    false => format!("one of the model `{}`: {}", model.name(), few(&all)),
                };
                refuse("expose_state", format!("`{name}`"), expected)
            })
        };
        self.states.iter().map(index).collect()
    }
}

impl Circuit for Ensemble {
    fn collect(&self, copies: Range<usize>, decoded: &[Real], outputs: &mut Outputs<'_>) {
        self.distribute(copies, decoded, outputs);
    }
}
