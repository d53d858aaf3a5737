//! The layer of one function of each component.

use std::sync::Arc;

use super::{Layer, Populated, Through, check_radius};
use crate::neurons::builder::{Components, Keep, Onset, PopulationBuilder};
use crate::neurons::tuning::TuningError;
use crate::sim::{
    AdvanceIo, Fingerprint, InputSpec, Node, NodeFault, OutputSpec, PortDecl, Real, StepCx,
};

/// A function of one number. [`Map`] applies it to each component.
pub type ScalarFunction = Arc<dyn Fn(Real) -> Real + Send + Sync>;

/// A request for one function, applied to each component of a vector.
///
/// In neurons each component has an ensemble of its own, so the function sees no other component.
#[derive(Clone)]
pub struct Map {
    width: usize,
    radius: Real,
    above: Option<Real>,
    size: Real,
    function: ScalarFunction,
}

impl Map {
    /// Requests `function` of each of `width` components (at least 1). The input adds any number of connections.
    ///
    /// Values that are not finite within the radius are a fault when the graph is built with neurons.
    pub fn each(width: usize, function: impl Fn(Real) -> Real + Send + Sync + 'static) -> Self {
        Self { width, radius: 1.0, above: None, size: 1.0, function: Arc::new(function) }
    }

    /// Sets the greatest magnitude of a component. Neurons saturate there; direct mode computes the function of the
    /// component limited to it.
    ///
    /// The default is 1. Anything but a finite number above 0 is a fault when the graph is built.
    pub fn radius(mut self, radius: Real) -> Self {
        self.radius = radius;
        self
    }

    /// States that the function is zero below `least`. No neuron then fires there. Direct mode ignores this.
    ///
    /// In neurons, `least / radius` is limited to the range from -0.99 to 0.9.
    pub fn above(mut self, least: Real) -> Self {
        self.above = Some(least);
        self
    }

    /// Multiplies the number of neurons by `share` (above 0; the default is 1).
    ///
    /// Each ensemble must end up with 1 to 10,000 neurons; anything else is a fault when the graph is built.
    pub fn size(mut self, share: Real) -> Self {
        self.size = share;
        self
    }
}

impl Node for Map {
    fn declare(&self, ports: &mut PortDecl) {
        check_radius(self.radius, ports);
        ports
            .input("in", InputSpec::vector(self.width).sum().at_advance())
            .output("out", OutputSpec::vector(self.width).registered().filtered_only());
    }

    /// Hashes the function's values at evenly spaced points, because the function itself cannot be hashed.
    fn fingerprint(&self, hash: &mut Fingerprint) {
        let half = 128i16;
        let at = |i: i16| self.radius * Real::from(i) / Real::from(half);
        let values: Vec<Real> = (-half..=half).map(|i| (self.function)(at(i))).collect();
        hash.reals(&values);
    }

    fn advance(&self, _cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let input = io.inputs.get(0);
        for (out, value) in io.outputs.get_mut(0).iter_mut().zip(input) {
            *out = (self.function)(value.clamp(-self.radius, self.radius));
        }
        Ok(())
    }
}

impl Layer for Map {
    fn direct(&self) -> Box<dyn Node> {
        Box::new(self.clone())
    }

    fn neural(&self, builder: &PopulationBuilder<'_>) -> Result<Populated, TuningError> {
        let (role, onset) = match self.above {
            None => ("components", Onset::Anywhere),
            Some(least) => ("above", Onset::Above(f64::from(least))),
        };
        let neurons = builder.tuning().per_function as f64 * f64::from(self.size);
        let (radius, keep) = (f64::from(self.radius), Keep::Groups(1));
        let components = Components { width: self.width, neurons, radius, onset, keep };
        let exact = |x: f64| f64::from((self.function)(x as Real));
        let ensembles = builder.components(role, &components, &exact)?;
        Ok(Populated::new(self.direct(), ensembles, Through))
    }
}
