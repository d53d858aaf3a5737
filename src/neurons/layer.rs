//! The four layers that a module can ask for, whatever computes them.
//!
//! A layer computes when the tick commits its state, from the inputs of the tick, and every edge that leaves
//! it has a synapse: it costs one tick in every mode.

use std::sync::Arc;

use crate::sim::{
    AnyInput, AnyOutput, Fingerprint, In, InputSpec, Kind, LayerRequest, NodePorts, Out,
    OutputSpec, PortDecl, Real, Scalar, Scope, SimDuration, Vector,
};

/// Asks for a population that holds a value of any kind.
///
/// Takes any number of sources. As a population saturates, the direct form clamps: a value whose
/// Euclidean norm exceeds `radius` is scaled back to it.
#[derive(Debug, Clone)]
pub struct Represent {
    pub(crate) input: AnyInput,
    pub(crate) output: AnyOutput,
    pub(crate) radius: Real,
    pub(crate) gated: bool,
}

impl Represent {
    /// A population for values of the given ports' kind, of norm up to `radius` (above 0).
    pub fn new<K: Kind>(input: InputSpec<K>, output: OutputSpec<K>, radius: Real) -> Self {
        Self {
            input: input.sum().at_advance().into(),
            output: output.registered().filtered_only().into(),
            radius,
            gated: false,
        }
    }

    /// Adds an input `open`: at 1 the value passes, at 0 the population is silenced.
    pub fn gated(mut self) -> Self {
        self.gated = true;
        self
    }
}

fn check_radius(radius: Real, ports: &mut PortDecl) {
    if !radius.is_finite() || radius <= 0.0 {
        ports.fault(format!("a radius of {radius} is not a finite number above 0"));
    }
}

impl LayerRequest for Represent {
    fn declare(&self, ports: &mut PortDecl) {
        check_radius(self.radius, ports);
        ports.input("in", self.input.clone()).output("out", self.output.clone());
        if self.gated {
            ports.input("open", InputSpec::scalar().sum().at_advance());
        }
    }
}

/// A function of one number, as [`Map`] applies it to each component.
pub type ScalarFunction = Arc<dyn Fn(Real) -> Real + Send + Sync>;

/// Asks for one function of each component of a vector.
#[derive(Clone)]
pub struct Map {
    pub(crate) width: usize,
    pub(crate) radius: Real,
    pub(crate) above: Option<Real>,
    pub(crate) size: Real,
    pub(crate) function: ScalarFunction,
}

impl Map {
    /// `function` applied to each of `width` components on its own.
    pub fn each(width: usize, function: impl Fn(Real) -> Real + Send + Sync + 'static) -> Self {
        Self { width, radius: 1.0, above: None, size: 1.0, function: Arc::new(function) }
    }

    /// The magnitude up to which components are represented (above 0; 1 unless told). The direct form
    /// has no such bound.
    pub fn radius(mut self, radius: Real) -> Self {
        self.radius = radius;
        self
    }
}

impl Map {
    /// Below `least` the function is zero, and so is every neuron's firing. The direct form does not
    /// need to be told.
    pub fn above(mut self, least: Real) -> Self {
        self.above = Some(least);
        self
    }

    /// Multiplies the number of neurons (above 0; 1 unless told).
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

/// Asks for the products of `pairs` pairs of numbers.
#[derive(Debug, Clone)]
pub struct Product {
    pub(crate) pairs: usize,
    pub(crate) radius: Real,
}

impl Product {
    /// `pairs` independent products.
    pub fn new(pairs: usize) -> Self {
        Self { pairs, radius: 1.0 }
    }

    /// The magnitude up to which half of the factors' sum and difference are represented (above 0; 1
    /// unless told). The direct form has no such bound.
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

/// Which items a [`Select`] turns on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SelectRule {
    /// Every item whose utility reaches `level`.
    Threshold {
        /// The least utility that turns an item on.
        level: Real,
    },
    /// The item of greatest utility, if it reaches `level`; of equal ones the first.
    WinnerTakeAll {
        /// The least utility that can win.
        level: Real,
    },
    /// Each item gathers how much its utility exceeds `level`, over `tau`; the first that has gathered 0.8 is
    /// chosen, and empties all others until its own evidence has drained (Gosmann, Voelker and
    /// Eliasmith, "A spiking independent accumulator model for winner-take-all computation", 2017). Slower than
    /// [`WinnerTakeAll`](Self::WinnerTakeAll), and never chooses two items at once.
    IndependentAccumulators {
        /// The utility above which evidence is gathered, and below which it drains.
        level: Real,
        /// The time in which a utility of 1 above the level gathers evidence of 1 (above zero).
        tau: SimDuration,
    },
}

/// The evidence at which an item is chosen.
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

/// Asks for a choice among `items` utilities: 1 for a chosen item, 0 for the others.
#[derive(Debug, Clone)]
pub struct Select {
    pub(crate) items: usize,
    pub(crate) rule: SelectRule,
}

/// How much an inhibition of 1 takes from a utility: enough to silence any similarity.
pub(crate) const INHIBITION: Real = 4.0;

impl Select {
    /// A choice among `items` by `rule`.
    pub fn new(items: usize, rule: SelectRule) -> Self {
        Self { items, rule }
    }
}

impl LayerRequest for Select {
    fn declare(&self, ports: &mut PortDecl) {
        if !self.rule.level().is_finite() {
            ports.fault("the level of a selection must be a finite number");
        }
        if let SelectRule::IndependentAccumulators { tau, .. } = self.rule
            && tau == SimDuration::from_millis(0)
        {
            ports.fault("the time constant of accumulators must be above zero");
        }
        ports
            .input("in", InputSpec::vector(self.items).sum().at_advance())
            .input("inhibit", InputSpec::vector(self.items).sum().optional().at_advance())
            .output("out", OutputSpec::vector(self.items).registered().filtered_only());
    }
}

/// Ports of a layer with one input.
pub struct LayerPorts<K: Kind> {
    /// What goes in; any number of sources.
    pub input: In<K>,
    /// What comes out; every edge from here needs a synapse.
    pub output: Out<K>,
}

/// Ports of a gated [`Represent`] layer.
pub struct GatedPorts<K: Kind> {
    /// What goes in; any number of sources.
    pub input: In<K>,
    /// 1 to let the value pass, 0 to silence it; any number of sources.
    pub open: In<Scalar>,
    /// What comes out; every edge from here needs a synapse.
    pub output: Out<K>,
}

/// Ports of a [`Product`] layer.
#[derive(Debug, Clone)]
pub struct ProductPorts {
    /// The first factors.
    pub a: In<Vector>,
    /// The second factors.
    pub b: In<Vector>,
    /// The products; every edge from here needs a synapse.
    pub output: Out<Vector>,
}

/// Ports of a [`Select`] layer.
#[derive(Debug, Clone)]
pub struct SelectPorts {
    /// The utilities; any number of sources.
    pub input: In<Vector>,
    /// An inhibition of 1 silences an item; may stay unfed.
    pub inhibit: In<Vector>,
    /// 1 for a chosen item; every edge from here needs a synapse.
    pub output: Out<Vector>,
}

/// What a module asks of its scope.
pub trait Layers {
    /// A population that holds a value.
    fn represent<K: Kind>(&mut self, name: &str, layer: Represent) -> LayerPorts<K>;
    /// A population that holds a value while its gate is open.
    fn represent_gated<K: Kind>(&mut self, name: &str, layer: Represent) -> GatedPorts<K>;
    /// A function of each component.
    fn map(&mut self, name: &str, layer: Map) -> LayerPorts<Vector>;
    /// Products of pairs of numbers.
    fn product(&mut self, name: &str, layer: Product) -> ProductPorts;
    /// A choice among utilities.
    fn select(&mut self, name: &str, layer: Select) -> SelectPorts;
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
}

fn ports<K: Kind>(node: &NodePorts) -> LayerPorts<K> {
    LayerPorts { input: node.input("in"), output: node.output("out") }
}
