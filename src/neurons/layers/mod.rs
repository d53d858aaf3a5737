//! Layers: what a module can request. A request does not say how the layer is computed.
//!
//! Each kind of layer has a file of its own, with its request, its exact form and its form in neurons. A layer computes
//! at the end of a tick, from the inputs of this tick. Every connection from a layer has a synapse. A layer therefore
//! costs one tick in every mode.

mod ensemble;
mod map;
mod neuron_ports;
mod populated;
mod product;
mod represent;
mod select;
mod settings;
mod target;

use super::builder::PopulationBuilder;
use super::tuning::TuningError;
use crate::sim::{
    In, Kind, LayerRequest, Node, NodePorts, Out, PortDecl, Ports, Real, Scalar, Scope, Vector,
};

pub use ensemble::{Ensemble, EnsemblePorts};
pub use map::{Map, ScalarFunction};
pub use populated::{Circuit, Items, Populated, Through};
pub use product::Product;
pub use represent::Represent;
pub use select::{Select, SelectRule};
pub use settings::{Encoders, Values};
pub use target::Target;

/// A kind of layer: its node in direct mode and its node in neurons. Both have the same ports, those that `direct`
/// declares.
///
/// A layer whose numbers are halved, exactly or in one ensemble for each:
///
/// ```
/// use symbolt::neurons::{
///     Components, Keep, Layer, Layers, LifSpec, Onset, Populated, Population, PopulationBuilder,
///     PopulationPlan, Through, TuningError,
/// };
/// use symbolt::prelude::*;
/// use symbolt::sim::{
///     AdvanceIo, Fingerprint, InputSpec, Node, NodeFault, NodePorts, OutputSpec, PortDecl, StepCx,
///     Vector,
/// };
///
/// #[derive(Clone)]
/// struct Halves(usize);
///
/// impl Node for Halves {
///     fn declare(&self, ports: &mut PortDecl) {
///         ports
///             .input("in", InputSpec::vector(self.0).sum().at_advance())
///             .output("out", OutputSpec::vector(self.0).registered().filtered_only());
///     }
///     fn fingerprint(&self, _hash: &mut Fingerprint) {}
///     fn advance(&self, _cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
///         let values = io.inputs.get(0);
///         io.outputs.get_mut(0).iter_mut().zip(values).for_each(|(out, x)| *out = x / 2.0);
///         Ok(())
///     }
/// }
///
/// impl Layer for Halves {
///     fn direct(&self) -> Box<dyn Node> {
///         Box::new(self.clone())
///     }
///     fn neural(&self, builder: &PopulationBuilder<'_>) -> Result<Populated, TuningError> {
///         let (onset, keep) = (Onset::Anywhere, Keep::Groups(1));
///         let each = Components { width: self.0, neurons: 80.0, radius: 1.0, onset, keep };
///         let ensembles = builder.components("halves", &each, &|x| x / 2.0)?;
///         Ok(Populated::new(self.direct(), ensembles, Through))
///     }
/// }
///
/// struct Halved;
/// impl Module for Halved {
///     type Ports = NodePorts;
///     fn expand(self, scope: &mut Scope<'_>) -> NodePorts {
///         scope.populate("halves", Halves(3))
///     }
/// }
///
/// for mode in [Population::Direct, Population::Lif(LifSpec::default())] {
///     let mut graph = GraphBuilder::new();
///     let given = graph.add("given", Constant::vector(&[0.8, -0.4, 0.0]));
///     let halved = graph.add("halved", Halved);
///     graph.connect(&given, &halved.input::<Vector>("in"), Synapse::None);
///     let spec = ProbeSpec::default().filtered(Synapse::lowpass_ms(20));
///     let probe = graph.probe(&halved.output::<Vector>("out"), spec);
///     let plan = PopulationPlan::all(mode);
///     let sim = graph.run(&plan, Seed::new(1), SimDuration::from_millis(300))?;
///     let (_, last) = sim.samples(&probe).last().expect("one sample per tick");
///     assert!((last[0] - 0.4).abs() < 0.05 && (last[1] + 0.2).abs() < 0.05);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait Layer: Send + Sync + 'static {
    /// Returns the node that computes the layer exactly, with the delays of a population but without its noise.
    fn direct(&self) -> Box<dyn Node>;

    /// Returns why the layer cannot be computed exactly, if it cannot: [`direct`](Self::direct) then only declares its ports.
    fn only_neural(&self) -> Option<&'static str> {
        None
    }

    /// Returns the node that computes the layer in neurons.
    ///
    /// # Errors
    /// [`TuningError`] if the neurons cannot be drawn or solved for.
    fn neural(&self, builder: &PopulationBuilder<'_>) -> Result<Populated, TuningError>;
}

/// A request for a layer, as the engine knows it.
pub(super) struct Request(pub Box<dyn Layer>);

impl LayerRequest for Request {
    fn declare(&self, ports: &mut PortDecl) {
        self.0.direct().declare(ports);
    }
}

fn check_radius(radius: Real, ports: &mut PortDecl) {
    if !radius.is_finite() || radius <= 0.0 {
        ports.fault(format!("the radius is {radius}; expected a finite number above 0"));
    }
}

/// Ports of a layer or module that takes a value and is opened and closed, such as a gated [`Represent`] layer or a
/// [`Gate`](crate::spa::Gate).
pub struct GatePorts<K: Kind> {
    /// Value. The docs of a module say whether it adds any number of connections, as a layer does.
    pub input: In<K>,
    /// 1 opens and 0 closes. Adds any number of connections.
    pub open: In<Scalar>,
    /// Output. Every connection from that of a layer needs a synapse.
    pub output: Out<K>,
}

/// Ports of a bilinear function of two values, such as a [`Product`] layer or [`Bind`](crate::spa::Bind).
pub struct BilinearPorts<A: Kind, B: Kind = A, C: Kind = A> {
    /// First value; takes one connection.
    pub a: In<A>,
    /// Second value; takes one connection.
    pub b: In<B>,
    /// Value of the function. Every connection from that of a layer needs a synapse.
    pub output: Out<C>,
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
    /// Adds a layer of any kind, such as one of your own.
    fn populate(&mut self, name: &str, layer: impl Layer) -> NodePorts;
    /// Adds a population that represents a value.
    fn represent<K: Kind>(&mut self, name: &str, layer: Represent) -> Ports<K>;
    /// Adds a population behind a gate. It represents its input while the gate is open.
    fn represent_gated<K: Kind>(&mut self, name: &str, layer: Represent) -> GatePorts<K>;
    /// Adds a function of each component.
    fn map(&mut self, name: &str, layer: Map) -> Ports<Vector>;
    /// Adds products of pairs of numbers.
    fn product(&mut self, name: &str, layer: Product) -> BilinearPorts<Vector>;
    /// Adds a choice among utilities.
    fn select(&mut self, name: &str, layer: Select) -> SelectPorts;
    /// Adds an ensemble from which functions are decoded.
    fn ensemble(&mut self, name: &str, layer: Ensemble) -> EnsemblePorts;
}

impl Layers for Scope<'_> {
    #[track_caller]
    fn populate(&mut self, name: &str, layer: impl Layer) -> NodePorts {
        self.layer(name, Request(Box::new(layer)))
    }

    #[track_caller]
    fn represent<K: Kind>(&mut self, name: &str, layer: Represent) -> Ports<K> {
        Ports::of(&self.populate(name, layer))
    }

    #[track_caller]
    fn represent_gated<K: Kind>(&mut self, name: &str, layer: Represent) -> GatePorts<K> {
        let node = self.populate(name, layer.gated());
        GatePorts { input: node.input("in"), open: node.input("open"), output: node.output("out") }
    }

    #[track_caller]
    fn map(&mut self, name: &str, layer: Map) -> Ports<Vector> {
        Ports::of(&self.populate(name, layer))
    }

    #[track_caller]
    fn product(&mut self, name: &str, layer: Product) -> BilinearPorts<Vector> {
        let node = self.populate(name, layer);
        BilinearPorts { a: node.input("a"), b: node.input("b"), output: node.output("out") }
    }

    #[track_caller]
    fn select(&mut self, name: &str, layer: Select) -> SelectPorts {
        let node = self.populate(name, layer);
        SelectPorts {
            input: node.input("in"),
            inhibit: node.input("inhibit"),
            output: node.output("out"),
        }
    }

    #[track_caller]
    fn ensemble(&mut self, name: &str, layer: Ensemble) -> EnsemblePorts {
        EnsemblePorts::of(self.populate(name, layer))
    }
}
