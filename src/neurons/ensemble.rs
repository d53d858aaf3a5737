//! Ensembles of several dimensions from which several functions are decoded.

use std::ops::Range;
use std::sync::Arc;

use rand::{Rng, RngExt};

use super::bank::{Draft, Shape};
use super::decode::Points;
use super::layer::check_radius;
use super::model::refuse;
use super::parted::Parted;
use super::population::{Maker, Refusal, count, rows};
use super::solved::Kept;
use super::tuning::{Neurons, cosine, on_sphere};
use crate::sim::{
    AdvanceIo, Fingerprint, In, InputSpec, LayerRequest, Module, Node, NodeFault, NodePorts, Out,
    OutputSpec, Outputs, PartIo, PartSpec, Parts, PortDecl, Real, Scope, ScratchSpec, Seed,
    StateMut, StepCx, Vector,
};

/// Greatest number of components of the input and of all outputs.
const MOST_COMPONENTS: usize = 1 << 20;

type Function = Arc<dyn Fn(&[Real], &mut [Real]) + Send + Sync>;

/// A function that is decoded from an ensemble.
#[derive(Clone)]
struct Decoded {
    name: String,
    width: usize,
    function: Function,
}

/// A request for one ensemble of several dimensions, from which any functions of the represented vector are decoded.
///
/// All functions read the same neurons: each costs decoders, but no further neurons. It is also a module, which adds
/// the layer as its node `neurons`.
///
/// In neurons, an ensemble has [`LifSpec::per_function`](super::LifSpec::per_function) neurons per dimension times
/// [`size`](Self::size). Encoders are random directions. Evaluation points are drawn evenly from the ball of the
/// radius, and intercepts from the distribution of one of its coordinates, so that neurons fire where values are
/// (Gosmann and Eliasmith 2016). Direct mode computes the functions exactly, without a radius. Solving costs
/// O(points x neurons^2), about 0.1 s for 1,000 neurons.
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
    functions: Vec<Decoded>,
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

    /// Returns the output of the function called `name`. Every connection from it needs a synapse. Using a name that
    /// the ensemble does not have is a fault when the graph is built.
    pub fn output(&self, name: &str) -> Out<Vector> {
        self.node.output(name)
    }
}

impl Ensemble {
    /// Requests an ensemble for vectors of `dims` components (at least 1). The input adds any number of connections.
    pub fn new(dims: usize) -> Self {
        Self { dims, copies: 1, radius: 1.0, size: 1.0, functions: Vec::new() }
    }

    /// Decodes a function of the vector. The closure gets `dims` numbers and writes `width` numbers. Values that are not
    /// finite within the radius are a fault when the graph is built with neurons.
    pub fn decode(
        mut self,
        name: &str,
        width: usize,
        function: impl Fn(&[Real], &mut [Real]) + Send + Sync + 'static,
    ) -> Self {
        self.functions.push(Decoded { name: name.into(), width, function: Arc::new(function) });
        self
    }

    /// Decodes the vector itself.
    pub fn identity(self, name: &str) -> Self {
        let dims = self.dims;
        self.decode(name, dims, |x, out| out.copy_from_slice(x))
    }

    /// Makes `copies` ensembles side by side (at least 1), each with neurons of its own. Input and outputs are those of
    /// the first copy, then of the second, and so on.
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

    /// Multiplies the number of neurons by `share` (above 0; the default is 1). Each ensemble must end up with 1 to 10,000
    /// neurons; anything else is a fault when the graph is built.
    pub fn size(mut self, share: Real) -> Self {
        self.size = share;
        self
    }

    /// Number of components that are decoded from one copy.
    fn outputs(&self) -> usize {
        self.functions.iter().fold(0, |sum, decoded| sum.saturating_add(decoded.width))
    }

    /// Returns a fault if the input or the outputs of all copies have too many components.
    fn too_wide(&self) -> Option<String> {
        let (dims, copies) = (self.dims, self.copies);
        let most = dims.max(self.outputs()).saturating_mul(copies);
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
        for Decoded { width, function, .. } in &self.functions {
            let (own, after) = rest.split_at_mut(*width);
            // A function may write some components only.
            own.fill(0.0);
            function(value, own);
            rest = after;
        }
    }

    /// Distributes what is decoded from some of the copies to the outputs.
    fn distribute(&self, copies: Range<usize>, decoded: &[Real], outputs: &mut Outputs<'_>) {
        let mut from = 0;
        for (index, Decoded { width, .. }) in self.functions.iter().enumerate() {
            let decoded = decoded.chunks_exact(self.outputs());
            let out = &mut outputs.get_mut(index)[rows(copies.clone(), *width)];
            for (out, row) in out.chunks_exact_mut(*width).zip(decoded) {
                out.copy_from_slice(&row[from..from + width]);
            }
            from += width;
        }
    }
}

impl LayerRequest for Ensemble {
    fn declare(&self, ports: &mut PortDecl) {
        check_radius(self.radius, ports);
        if self.functions.is_empty() {
            ports.fault("nothing is decoded; expected at least one function");
        }
        if let Some(reason) = self.too_wide() {
            ports.fault(reason);
        }
        let wide = |width: usize| width.saturating_mul(self.copies).min(MOST_COMPONENTS);
        ports.input("in", InputSpec::vector(wide(self.dims)).sum().at_advance());
        for Decoded { name, width, .. } in &self.functions {
            let good = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
            if !name.chars().all(good) {
                ports.fault(format!(
                    "`{name}` is not a valid name of a function; use one or more of the characters a-z, A-Z, 0-9, `_` and `-`"
                ));
            }
            ports.output(name, OutputSpec::vector(wide(*width)).registered().filtered_only());
        }
    }
}

impl Module for Ensemble {
    type Ports = EnsemblePorts;

    fn expand(self, scope: &mut Scope<'_>) -> EnsemblePorts {
        let names: Vec<String> = self.functions.iter().map(|own| own.name.clone()).collect();
        let node = scope.layer("neurons", self);
        scope.input("input", node.input::<Vector>("in"));
        for name in names {
            scope.output(&name, node.output::<Vector>(&name));
        }
        EnsemblePorts::of(node)
    }
}

/// Draws a vector evenly from the unit ball.
fn in_ball<R: Rng>(rng: &mut R, out: &mut [f64]) {
    on_sphere(rng, out);
    let length = rng.random::<f64>().powf(1.0 / out.len() as f64);
    out.iter_mut().for_each(|value| *value *= length);
}

/// The node of exact functions.
pub(super) struct DirectEnsemble(pub Ensemble);

impl Node for DirectEnsemble {
    fn declare(&self, ports: &mut PortDecl) {
        self.0.declare(ports);
        let reals = self.0.outputs().saturating_mul(self.0.copies).min(MOST_COMPONENTS);
        ports.scratch(ScratchSpec { reals, ..ScratchSpec::default() });
    }

    /// Hashes the functions' values at random points, because functions themselves cannot be hashed.
    fn fingerprint(&self, hash: &mut Fingerprint) {
        let mut rng = Seed::new(0).derive("", "fingerprint").rng();
        let (mut point, mut out) = (vec![0.0; self.0.dims], vec![0.0; self.0.outputs()]);
        for _ in 0..128 {
            in_ball(&mut rng, &mut point);
            let value: Vec<Real> = point.iter().map(|v| *v as Real * self.0.radius).collect();
            self.0.compute(&value, &mut out);
            hash.reals(&out);
        }
    }

    fn advance(&self, _cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let decoded = &mut io.scratch.reals[..self.0.outputs() * self.0.copies];
        let values = io.inputs.get(0).chunks_exact(self.0.dims);
        for (value, out) in values.zip(decoded.chunks_exact_mut(self.0.outputs())) {
            self.0.compute(value, out);
        }
        self.0.distribute(0..self.0.copies, decoded, &mut io.outputs);
        Ok(())
    }
}

/// The node of ensembles of neurons: one bank.
pub(super) struct NeuralEnsemble {
    layer: Ensemble,
    bank: Parted,
}

impl NeuralEnsemble {
    pub fn kept(&self) -> Vec<Kept> {
        vec![self.bank.kept.clone()]
    }
}

impl Node for NeuralEnsemble {
    fn declare(&self, ports: &mut PortDecl) {
        self.layer.declare(ports);
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.number(self.bank.kept.fingerprint);
    }

    fn init(&self, _cx: &StepCx<'_>, state: &mut StateMut<'_>, _registered: &mut Outputs<'_>) {
        self.bank.init(state.reals);
    }

    fn parts(&self) -> Option<&dyn Parts> {
        Some(self)
    }

    fn units(&self) -> usize {
        self.bank.bank().spiking()
    }
}

impl Parts for NeuralEnsemble {
    fn count(&self) -> usize {
        self.bank.count()
    }

    fn part(&self, part: usize) -> PartSpec {
        self.bank.spec(part, self.layer.outputs())
    }

    fn advance(&self, _cx: &StepCx<'_>, part: usize, io: &mut PartIo<'_>) {
        let own = rows(self.bank.ensembles(part), self.layer.dims);
        self.bank.step(part, (&io.inputs.get(0)[own], 1.0), io.state, io.results);
    }

    fn collect(&self, part: usize, results: &[Real], outputs: &mut Outputs<'_>) {
        self.layer.distribute(self.bank.ensembles(part), results, outputs);
    }

    fn event(&self, _part: usize, state: &[Real], neuron: usize) -> bool {
        self.bank.bank().spiked(state, neuron)
    }
}

impl Maker<'_> {
    pub(super) fn ensemble(&self, layer: &Ensemble) -> Result<NeuralEnsemble, Refusal> {
        if let Some(reason) = layer.too_wide() {
            return Err(refuse("copies", reason, "a smaller ensemble").into());
        }
        let (dims, outputs) = (layer.dims, layer.outputs());
        let per = self.spec.per_function as f64 * dims as f64 * f64::from(layer.size);
        let neurons = count(per, self.spec.scale)?;
        let shape = Shape { ensembles: layer.copies, neurons, dims, outputs };
        let points = (neurons * 3 / 2).clamp(500, 3_000);
        let radius = f64::from(layer.radius);
        // The same points for all copies: their functions are computed, checked and hashed once.
        let mut rng = self.seed.derive("", "points").rng();
        let mut values = vec![0.0; points * dims];
        let mut wanted = Vec::with_capacity(points * outputs);
        let (mut argument, mut out) = (vec![0.0; dims], vec![0.0 as Real; outputs]);
        for value in values.chunks_exact_mut(dims) {
            in_ball(&mut rng, value);
            for (to, from) in argument.iter_mut().zip(&*value) {
                *to = (from * radius) as Real;
            }
            layer.compute(&argument, &mut out);
            if let Some(wrong) = out.iter().find(|value| !value.is_finite()) {
                let given = format!("{wrong} at {argument:?}");
                return Err(refuse("function", given, "finite values within the radius").into());
            }
            wanted.extend(out.iter().map(|value| f64::from(*value)));
        }
        let marks: Vec<f64> = wanted.iter().copied().chain([radius]).collect();
        let bank = self.bank((shape, self.deal.cut(shape, 1)), "ensemble", &marks, |_, seed| {
            let drawn = match dims {
                1 => self.scalar(neurons, seed)?,
                _ => Neurons::draw(
                    &self.spec.model,
                    (neurons, dims),
                    self.max_rates(),
                    &mut seed.rng(),
                    on_sphere,
                    |rng| cosine(rng, dims + 2),
                )?,
            };
            let (values, wanted) = (values.clone(), wanted.clone());
            Ok(Draft { neurons: drawn, radius, points: Points { values, wanted, outputs } })
        })?;
        Ok(NeuralEnsemble { layer: layer.clone(), bank })
    }
}
