//! The layers that a module can request, except for [`Ensemble`]. A request does not say how the layer is computed.
//!
//! A layer computes at the end of a tick, from the inputs of this tick. Every connection from a layer has a synapse. A
//! layer therefore costs one tick in every mode.

use std::sync::Arc;

use super::ensemble::{Ensemble, EnsemblePorts};
use crate::sim::{
    AnyInput, AnyOutput, Fingerprint, In, InputSpec, Kind, LayerRequest, NodePorts, Out,
    OutputSpec, PortDecl, Real, Scalar, Scope, SimDuration, Vector,
};

/// A request for a population that represents a scalar, vector or pointer.
///
/// The input adds any number of connections. In direct mode a value whose Euclidean norm exceeds `radius` is scaled
/// back to `radius`, because a neural population would saturate there.
///
/// In neurons, a pointer gets ensembles of at most [`LifSpec::sub_dimensions`](super::LifSpec::sub_dimensions)
/// dimensions. A vector gets one ensemble per component, and `radius` then limits each component.
#[derive(Debug, Clone)]
pub struct Represent {
    pub(crate) input: AnyInput,
    pub(crate) output: AnyOutput,
    pub(crate) radius: Real,
    pub(crate) gated: bool,
    pub(crate) inhibition: Real,
}

impl Represent {
    /// Requests a population for values of the ports' kind with a norm of up to `radius`.
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
}

pub(super) fn check_radius(radius: Real, ports: &mut PortDecl) {
    if !radius.is_finite() || radius <= 0.0 {
        ports.fault(format!("the radius is {radius}; expected a finite number above 0"));
    }
}

impl LayerRequest for Represent {
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
}

/// A function of one number. [`Map`] applies it to each component.
pub type ScalarFunction = Arc<dyn Fn(Real) -> Real + Send + Sync>;

/// A request for one function, applied to each component of a vector.
///
/// In neurons each component has an ensemble of its own, so the function sees no other component.
#[derive(Clone)]
pub struct Map {
    pub(crate) width: usize,
    pub(crate) radius: Real,
    pub(crate) above: Option<Real>,
    pub(crate) size: Real,
    pub(crate) function: ScalarFunction,
}

impl Map {
    /// Requests `function` of each of `width` components (at least 1). The input adds any number of connections.
    pub fn each(width: usize, function: impl Fn(Real) -> Real + Send + Sync + 'static) -> Self {
        Self { width, radius: 1.0, above: None, size: 1.0, function: Arc::new(function) }
    }

    /// Sets the greatest magnitude of a component that neurons represent. Direct mode has no such limit.
    ///
    /// The default is 1. Anything but a finite number above 0 is a fault when the graph is built.
    pub fn radius(mut self, radius: Real) -> Self {
        self.radius = radius;
        self
    }
}

impl Map {
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

impl LayerRequest for Map {
    fn declare(&self, ports: &mut PortDecl) {
        check_radius(self.radius, ports);
        ports
            .input("in", InputSpec::vector(self.width).sum().at_advance())
            .output("out", OutputSpec::vector(self.width).registered().filtered_only());
    }
}

/// A request for the products of pairs of numbers: `out[i] = a[i] b[i]`.
///
/// In neurons each product is the difference of two squares,
/// `a b = ((a + b) / 2)^2 - ((a - b) / 2)^2` (Gosmann, "Precise multiplications with the NEF", 2015).
#[derive(Debug, Clone)]
pub struct Product {
    pub(crate) pairs: usize,
    pub(crate) radius: Real,
}

impl Product {
    /// Requests `pairs` independent products (at least 1). Each input takes one connection.
    pub fn new(pairs: usize) -> Self {
        Self { pairs, radius: 1.0 }
    }

    /// Sets the greatest magnitude of `(a + b) / 2` and `(a - b) / 2` that neurons represent. Direct mode has no
    /// such limit.
    ///
    /// The default is 1, enough for factors between -1 and 1. Anything but a finite number above 0 is a fault when
    /// the graph is built.
    pub fn radius(mut self, radius: Real) -> Self {
        self.radius = radius;
        self
    }
}

impl LayerRequest for Product {
    fn declare(&self, ports: &mut PortDecl) {
        check_radius(self.radius, ports);
        ports
            .input("a", InputSpec::vector(self.pairs).at_advance())
            .input("b", InputSpec::vector(self.pairs).at_advance())
            .output("out", OutputSpec::vector(self.pairs).registered().filtered_only());
    }
}

/// The rule by which a [`Select`] chooses items from their utilities.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SelectRule {
    /// Chooses every item whose utility is at least `level`.
    Threshold {
        /// Least utility of a chosen item (finite).
        level: Real,
    },
    /// Chooses the item of greatest utility if this utility is at least `level`. In direct mode the first of equal
    /// items wins.
    WinnerTakeAll {
        /// Least utility of a chosen item (finite).
        level: Real,
    },
    /// Chooses the first item that has gathered enough evidence.
    ///
    /// Each item integrates the excess of its utility over `level` as evidence; `tau` sets the speed. The first item
    /// whose evidence reaches 0.8 is chosen. It holds the evidence of all others at zero until its own evidence has
    /// drained (Gosmann, Voelker and Eliasmith, "A spiking independent accumulator model for winner-take-all
    /// computation", 2017). This is slower than [`WinnerTakeAll`](Self::WinnerTakeAll) but never chooses two items at
    /// once.
    IndependentAccumulators {
        /// Level of utility, a finite number. Evidence grows while the utility is above the level and drains while it
        /// is below.
        level: Real,
        /// Time in which an excess of 1 over the level gathers evidence of 1. Must be above zero.
        tau: SimDuration,
    },
}

/// Evidence at which an item is chosen.
pub(crate) const EVIDENCE_THRESHOLD: Real = 0.8;

impl SelectRule {
    pub(crate) fn fingerprint(self, hash: &mut Fingerprint) {
        hash.reals(&[self.level()]);
        match self {
            Self::Threshold { .. } => hash.text("threshold"),
            Self::WinnerTakeAll { .. } => hash.text("winner"),
            Self::IndependentAccumulators { tau, .. } => {
                hash.text("accumulators").number(tau.as_micros())
            }
        };
    }

    pub(crate) fn level(self) -> Real {
        match self {
            Self::Threshold { level }
            | Self::WinnerTakeAll { level }
            | Self::IndependentAccumulators { level, .. } => level,
        }
    }
}

/// A request for a choice among utilities. The output is 1 for a chosen item and 0 for the others.
#[derive(Debug, Clone)]
pub struct Select {
    pub(crate) items: usize,
    pub(crate) rule: SelectRule,
}

/// Amount that an inhibition of 1 subtracts from a utility. It is enough to silence any similarity.
pub(crate) const INHIBITION: Real = 4.0;

impl Select {
    /// Requests a choice among `items` utilities (at least 1) by `rule`.
    ///
    /// A level that is not finite, or an accumulator time constant of zero, is a fault when the graph is built.
    pub fn new(items: usize, rule: SelectRule) -> Self {
        Self { items, rule }
    }
}

impl LayerRequest for Select {
    fn declare(&self, ports: &mut PortDecl) {
        if !self.rule.level().is_finite() {
            let level = self.rule.level();
            ports.fault(format!("the selection level is {level}; expected a finite number"));
        }
        if let SelectRule::IndependentAccumulators { tau, .. } = self.rule
            && tau == SimDuration::from_millis(0)
        {
            ports.fault("the accumulators' time constant `tau` is 0; expected a time above 0");
        }
        ports
            .input("in", InputSpec::vector(self.items).sum().at_advance())
            .input("inhibit", InputSpec::vector(self.items).sum().optional().at_advance())
            .output("out", OutputSpec::vector(self.items).registered().filtered_only());
    }
}

/// Ports of a layer with one input.
pub struct LayerPorts<K: Kind> {
    /// Input of the layer; adds any number of connections.
    pub input: In<K>,
    /// Output of the layer. Every connection from it needs a synapse.
    pub output: Out<K>,
}

/// Ports of a gated [`Represent`] layer.
pub struct GatedPorts<K: Kind> {
    /// Value to represent; adds any number of connections.
    pub input: In<K>,
    /// Gate: 1 lets the value pass, 0 silences it. Adds any number of connections.
    pub open: In<Scalar>,
    /// Represented value. Every connection from it needs a synapse.
    pub output: Out<K>,
}

/// Ports of a [`Product`] layer.
#[derive(Debug, Clone)]
pub struct ProductPorts {
    /// First factors, one per pair; takes one connection.
    pub a: In<Vector>,
    /// Second factors, one per pair; takes one connection.
    pub b: In<Vector>,
    /// Products, one per pair. Every connection from it needs a synapse.
    pub output: Out<Vector>,
}

/// Ports of a [`Select`] layer.
#[derive(Debug, Clone)]
pub struct SelectPorts {
    /// Utilities, one per item; adds any number of connections.
    pub input: In<Vector>,
    /// Inhibition, one number per item: 1 silences the item. Adds any number of connections, or none.
    pub inhibit: In<Vector>,
    /// Activity, one number per item: 1 if chosen, else 0. Every connection from it needs a synapse.
    pub output: Out<Vector>,
}

/// Adds neural layers to a [`Scope`], the place to which a module adds its parts.
///
/// `name` becomes the last part of the layer's path. It must be unique in its scope; [`PopulationPlan`] patterns
/// match the whole path. All settings are checked when the graph is built.
///
/// [`PopulationPlan`]: super::PopulationPlan
pub trait Layers {
    /// Adds a population that represents a value.
    fn represent<K: Kind>(&mut self, name: &str, layer: Represent) -> LayerPorts<K>;
    /// Adds a population behind a gate. It represents its input while the gate is open.
    fn represent_gated<K: Kind>(&mut self, name: &str, layer: Represent) -> GatedPorts<K>;
    /// Adds a function of each component.
    fn map(&mut self, name: &str, layer: Map) -> LayerPorts<Vector>;
    /// Adds products of pairs of numbers.
    fn product(&mut self, name: &str, layer: Product) -> ProductPorts;
    /// Adds a choice among utilities.
    fn select(&mut self, name: &str, layer: Select) -> SelectPorts;
    /// Adds an ensemble from which functions are decoded.
    fn ensemble(&mut self, name: &str, layer: Ensemble) -> EnsemblePorts;
}

impl Layers for Scope<'_> {
    #[track_caller]
    fn represent<K: Kind>(&mut self, name: &str, layer: Represent) -> LayerPorts<K> {
        ports(&self.layer(name, layer))
    }

    #[track_caller]
    fn represent_gated<K: Kind>(&mut self, name: &str, layer: Represent) -> GatedPorts<K> {
        let node = self.layer(name, layer.gated());
        GatedPorts { input: node.input("in"), open: node.input("open"), output: node.output("out") }
    }

    #[track_caller]
    fn map(&mut self, name: &str, layer: Map) -> LayerPorts<Vector> {
        ports(&self.layer(name, layer))
    }

    #[track_caller]
    fn product(&mut self, name: &str, layer: Product) -> ProductPorts {
        let node = self.layer(name, layer);
        ProductPorts { a: node.input("a"), b: node.input("b"), output: node.output("out") }
    }

    #[track_caller]
    fn select(&mut self, name: &str, layer: Select) -> SelectPorts {
        let node = self.layer(name, layer);
        SelectPorts {
            input: node.input("in"),
            inhibit: node.input("inhibit"),
            output: node.output("out"),
        }
    }

    #[track_caller]
    fn ensemble(&mut self, name: &str, layer: Ensemble) -> EnsemblePorts {
        EnsemblePorts::of(self.layer(name, layer))
    }
}

fn ports<K: Kind>(node: &NodePorts) -> LayerPorts<K> {
    LayerPorts { input: node.input("in"), output: node.output("out") }
}
