//! The layer that represents a value, optionally behind a gate.

use super::{Circuit, Items, Layer, Populated, check_radius};
use crate::neurons::builder::{Components, Keep, Onset, PointerDraw, PopulationBuilder};
use crate::neurons::tuning::{TuningError, refuse};
use crate::sim::{
    AdvanceIo, AnyInput, AnyOutput, Fingerprint, InputSpec, Inputs, Kind, Node, NodeFault,
    OutputSpec, PartIo, PortDecl, Real, StepCx,
};

/// A request for a population that represents a scalar, vector or pointer.
///
/// The input adds any number of connections. A neural population saturates at the radius. Direct mode limits values
/// likewise: of a pointer the Euclidean norm, of a vector each component. A pointer that is fed back may have twice the radius there,
/// since its ensembles go on to about that.
///
/// In neurons, a pointer gets ensembles of at most [`Tuning::sub_dimensions`](crate::neurons::Tuning::sub_dimensions)
/// dimensions, and a vector one ensemble per component.
#[derive(Debug, Clone)]
pub struct Represent {
    input: AnyInput,
    output: AnyOutput,
    radius: Real,
    gated: bool,
    inhibition: Real,
    memory: Memory,
}

/// What is asked of the neurons of a pointer beside its radius.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Memory {
    /// Nothing.
    No,
    /// Decoders for a value that is fed back.
    Fed,
    /// Decoders and neurons for a value that is kept.
    Kept,
    /// An ensemble for each component.
    Split,
}

/// Opening below which a gate is closed.
const LEAST_OPENING: Real = 0.1;

/// Norm up to which the neurons of a pointer that is fed back follow it, in units of the radius. Measured at 64 dimensions: 1.6 to 2.3.
const FED_BACK_ROOM: Real = 2.0;

/// Returns the factor of a gate: 0 below the least opening, and at most 1.
fn opening(open: Real) -> Real {
    if open < LEAST_OPENING { 0.0 } else { open.min(1.0) }
}

impl Represent {
    /// Requests a population for pointers with a norm of up to `radius`, or for numbers with a magnitude of up to `radius`
    /// each.
    ///
    /// `radius` must be a finite number above 0; anything else is a fault when the graph is built.
    pub fn new<K: Kind>(input: InputSpec<K>, output: OutputSpec<K>, radius: Real) -> Self {
        Self {
            input: input.sum().at_advance().into(),
            output: output.registered().filtered_only().into(),
            radius,
            gated: false,
            inhibition: 1.0,
            memory: Memory::No,
        }
    }

    /// Adds a gate, the scalar input `open`: the gain of the value. The population represents `open` times its input. Below
    /// 0.1 the gate is closed, in every mode: the population is silent. A value above 1 counts as 1.
    pub fn gated(mut self) -> Self {
        self.gated = true;
        self
    }

    /// Sets the current that closes the gate, as a share (0 to 1) of the default, which silences every neuron for values
    /// of up to the radius. With less, a value far beyond the radius leaks through the closed gate. Direct mode ignores
    /// this: its gates close.
    pub fn inhibition(mut self, share: Real) -> Self {
        self.inhibition = share;
        self
    }

    /// States that the value is fed back to the input, with a weight below 1: it decays. The decoders of a pointer are then
    /// solved from more evaluation points.
    pub fn fed_back(mut self) -> Self {
        self.memory = Memory::Fed;
        self
    }

    /// States that the value is fed back to the input with the weight 1, or nearly so. A memory drifts by the error of its
    /// decoding (Eliasmith and Anderson 2003, section 8.2), so its decoders are then solved with a tenth of the regularisation:
    /// less error, and more noise, which the synapse of the loop averages. Those of a pointer are also solved from more evaluation points, of norms
    /// near the radius, and its neurons come in pairs of opposite encoders; with Hadamard encoders, as [`fed_back`](Self::fed_back).
    pub fn kept(mut self) -> Self {
        self.memory = Memory::Kept;
        self
    }

    /// Gives each component of a pointer an ensemble of its own, which represents magnitudes up to
    /// `5/6 radius / sqrt(width)`. It has [`Tuning::per_function`] neurons, or [`Tuning::per_dimension`] behind a gate.
    ///
    /// Such ensembles decode small values far more exactly, but each component saturates by itself. A radius of three
    /// times the norm leaves room for a random pointer: its components saturate beyond 2.5 standard deviations. Direct
    /// mode limits the norm, as without this.
    ///
    /// [`Tuning::per_dimension`]: crate::neurons::Tuning::per_dimension
    /// [`Tuning::per_function`]: crate::neurons::Tuning::per_function
    pub fn split(mut self) -> Self {
        self.memory = Memory::Split;
        self
    }

    /// The greatest norm in direct mode.
    fn limit(&self) -> Real {
        let fed_back = matches!(self.memory, Memory::Fed | Memory::Kept);
        if fed_back && self.input.is_pointer() { FED_BACK_ROOM * self.radius } else { self.radius }
    }

    /// Number of components that the radius limits together.
    fn together(&self) -> usize {
        if self.input.is_pointer() { self.input.width().max(1) } else { 1 }
    }
}

/// Returns the factor that limits the norm of `value`.
pub(super) fn limiting(value: &[Real], limit: Real) -> Real {
    let square: Real = value.iter().map(|v| v * v).sum();
    if square <= limit * limit {
        return 1.0;
    }
    if square.is_finite() {
        return limit / square.sqrt();
    }
    // The square exceeds single precision.
    let square: f64 = value.iter().map(|v| f64::from(*v).powi(2)).sum();
    (f64::from(limit) / square.sqrt()) as Real
}

impl Node for Represent {
    fn declare(&self, ports: &mut PortDecl) {
        check_radius(self.radius, ports);
        if !(0.0..=1.0).contains(&self.inhibition) {
            let found = self.inhibition;
            ports.fault(format!("the inhibition is {found}; expected a share from 0 to 1"));
        }
        ports.input("in", self.input.clone()).output("out", self.output.clone());
        if self.gated {
            ports.input("open", InputSpec::scalar().sum().at_advance());
        }
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.reals(&[self.radius]).number(u64::from(self.gated));
    }

    fn advance(&self, _cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let open = if self.gated { opening(io.inputs.scalar(1)) } else { 1.0 };
        let together = self.together();
        let values = io.inputs.get(0).chunks_exact(together);
        for (value, out) in values.zip(io.outputs.get_mut(0).chunks_exact_mut(together)) {
            // The value behind the gate is limited.
            let scale = if open > 0.0 { open * limiting(value, self.limit() / open) } else { 0.0 };
            for (out, value) in out.iter_mut().zip(value) {
                *out = value * scale;
            }
        }
        Ok(())
    }
}

impl Layer for Represent {
    fn direct(&self) -> Box<dyn Node> {
        Box::new(self.clone())
    }

    fn neural(&self, builder: &PopulationBuilder<'_>) -> Result<Populated, TuningError> {
        let (width, radius) = (self.input.width(), f64::from(self.radius));
        let tuning = builder.tuning();
        let split = self.memory == Memory::Split;
        let ensembles = if self.input.is_pointer() && !split {
            match self.memory {
                Memory::Fed => builder.pointer_from(width, radius, PointerDraw::FED)?,
                Memory::Kept => builder.pointer_from(width, radius, PointerDraw::MEMORY)?,
                _ => builder.pointer(width, radius)?,
            }
        } else {
            // A gate holds nothing.
            let few = split && self.gated;
            let neurons = if few { tuning.per_dimension } else { tuning.per_function } as f64;
            let radius = match self.input.is_pointer() {
                true => SPLIT_ROOM * radius / (width as f64).sqrt(),
                false => radius,
            };
            let (onset, keep) = (Onset::Anywhere, Keep::Groups(1));
            let components = Components { width, neurons, radius, onset, keep };
            let draw =
                if self.memory == Memory::Kept { PointerDraw::MEMORY } else { PointerDraw::FLOW };
            builder.components_from("components", &components, draw, &|x| x)?
        };
        if self.gated && !ensembles.bank.falls_silent() {
            let expected = "a model whose neurons fall silent at some current, to close a gate";
            return Err(refuse("model", builder.model().name(), expected));
        }
        let dims = ensembles.bank.shape().dims;
        let gate = Gate {
            inhibition: self.gated.then_some(self.inhibition),
            norm: (self.input.is_pointer() && !split).then_some(self.limit()),
        };
        let populated = Populated::new(self.direct(), ensembles, gate);
        Ok(if self.gated { populated.scratch(dims) } else { populated })
    }
}

/// Greatest magnitude of a component of a split pointer, as a share of `radius / sqrt(width)`.
const SPLIT_ROOM: f64 = 5.0 / 6.0;

struct Gate {
    /// The share of the silencing current that closes the gate; `None` without a gate.
    inhibition: Option<Real>,
    /// The greatest norm of a pointer in exact maths. None if each component has an ensemble of its own: of those, some saturate
    /// whenever a memory stores something.
    norm: Option<Real>,
}

impl Circuit for Gate {
    fn advance(&self, items: &Items<'_>, io: &mut PartIo<'_>) {
        let values = &io.inputs.get(0)[items.rows()];
        let Some(inhibition) = self.inhibition else {
            return items.step(0, (values, 1.0), io.state, io.results);
        };
        let open = opening(io.inputs.scalar(1));
        // With less than the whole current a closed gate leaks, so its neurons still get the value.
        let (gain, current) = match open {
            0.0 if inhibition < 1.0 => (1.0, inhibition),
            0.0 => (0.0, 1.0),
            _ => (open, 0.0),
        };
        let scaled = &mut io.scratch.reals[..values.len()];
        scaled.iter_mut().zip(values).for_each(|(scaled, value)| *scaled = gain * value);
        items.step(0, (scaled, 1.0 - current), io.state, io.results);
    }

    fn unlimited(&self, items: &Items<'_>, inputs: Inputs<'_>, values: &mut Vec<Real>) {
        let open = self.inhibition.map_or(1.0, |_| opening(inputs.scalar(1)));
        let given = inputs.get(0);
        // A greater norm is limited in every mode.
        if self.norm.is_some_and(|norm| open > 0.0 && limiting(given, norm / open) == 1.0) {
            values.extend(given[items.rows()].iter().map(|value| open * value));
        }
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.reals(self.inhibition.as_slice());
    }
}
