//! The layer that represents a value, optionally behind a gate.

use super::{Circuit, Items, Layer, Populated, check_radius};
use crate::neurons::builder::{Components, Keep, Onset, PopulationBuilder};
use crate::neurons::tuning::{TuningError, refuse};
use crate::sim::{
    AdvanceIo, AnyInput, AnyOutput, Fingerprint, InputSpec, Kind, Node, NodeFault, OutputSpec,
    PartIo, PortDecl, Real, StepCx,
};

/// A request for a population that represents a scalar, vector or pointer.
///
/// The input adds any number of connections. A neural population saturates at the radius. Direct mode limits values
/// likewise: of a pointer the Euclidean norm, of a vector each component.
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
        }
    }

    /// Adds a gate, the scalar input `open`. At 1 the value passes; at 0 the population is silent. A value below 0
    /// counts as 0, and a value above 1 as 1.
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

    /// Number of components that the radius limits together.
    fn together(&self) -> usize {
        if self.input.is_pointer() { self.input.width().max(1) } else { 1 }
    }
}

/// Returns the factor that limits the norm of `value`.
fn limiting(value: &[Real], limit: Real) -> Real {
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
        let open = if self.gated { io.inputs.scalar(1).clamp(0.0, 1.0) } else { 1.0 };
        let together = self.together();
        let values = io.inputs.get(0).chunks_exact(together);
        for (value, out) in values.zip(io.outputs.get_mut(0).chunks_exact_mut(together)) {
            let scale = open * limiting(value, self.radius);
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
        let ensembles = if self.input.is_pointer() {
            builder.pointer(width, radius)?
        } else {
            let neurons = builder.tuning().per_function as f64;
            let (onset, keep) = (Onset::Anywhere, Keep::Groups(1));
            let components = Components { width, neurons, radius, onset, keep };
            builder.components("components", &components, &|x| x)?
        };
        if self.gated && !ensembles.bank.falls_silent() {
            let expected = "a model whose neurons fall silent at some current, to close a gate";
            return Err(refuse("model", builder.model().name(), expected));
        }
        let gate = Gate(self.gated.then_some(self.inhibition));
        Ok(Populated::new(self.direct(), ensembles, gate))
    }
}

/// The share of the silencing current that closes the gate; `None` without a gate.
struct Gate(Option<Real>);

impl Circuit for Gate {
    fn advance(&self, items: &Items<'_>, io: &mut PartIo<'_>) {
        let open = match self.0 {
            Some(1.0) => io.inputs.scalar(1),
            Some(inhibition) => 1.0 - inhibition * (1.0 - io.inputs.scalar(1).clamp(0.0, 1.0)),
            None => 1.0,
        };
        items.step(0, (&io.inputs.get(0)[items.rows()], open), io.state, io.results);
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.reals(self.0.as_slice());
    }
}
