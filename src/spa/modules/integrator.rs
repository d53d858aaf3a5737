//! Integrators and oscillators: recurrent populations of numbers and vectors.

use super::weighted_sum::Superpose;
use super::{FEED_FORWARD, RECURRENT, RECURRENT_MS, refuse_none};
use crate::neurons::{Ensemble, Layers, Represent};
use crate::sim::{Add, Constant, In, Module, Out, Ports, Real, Scalar, Scope, Synapse, Vector};
use crate::spa::flow::{FlowExt, FlowKind, Routes};

/// An integrator of a number or a vector: the output is the integral of the input over time, in units of seconds. Its
/// input adds any number of connections.
///
/// Value and input pass through a recurrent synapse (100 ms), the input times its time constant (Eliasmith and Anderson,
/// "Neural Engineering", 2003, section 8.2). The output comes one synapse (5 ms) later and saturates at the radius in
/// every mode. [`State::recurrent`](super::State::recurrent) is an integrator of pointers.
///
/// ```
/// use symbolt::prelude::*;
/// use symbolt::sim::Signal;
/// use symbolt::spa::Integrator;
///
/// let mut graph = GraphBuilder::new();
/// let speed = graph.add("speed", Signal::scalar(|t| if t < 0.5 { 1.2 } else { 0.0 }));
/// let place = graph.add("place", Integrator::scalar());
/// graph.route(&speed >> &place);
/// let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), SimDuration::from_millis(1000))?;
/// assert!((sim.value(&place.output)[0] - 0.6).abs() < 0.01);
/// # Ok::<(), symbolt::sim::SimError>(())
/// ```
pub struct Integrator<K: FlowKind> {
    shape: K::Shape,
    radius: Real,
    retention: Real,
}

impl Integrator<Scalar> {
    /// Makes an integrator of a number.
    pub fn scalar() -> Self {
        Self { shape: (), radius: 1.0, retention: 1.0 }
    }
}

impl Integrator<Vector> {
    /// Makes an integrator of vectors of `width` components, each in an ensemble of its own.
    pub fn vector(width: usize) -> Self {
        Self { shape: width, radius: 1.0, retention: 1.0 }
    }
}

impl<K: FlowKind> Integrator<K> {
    /// Sets the greatest magnitude of a component of the integral (default 1). Anything but a finite number above 0 is a
    /// fault when the graph is built.
    pub fn radius(mut self, radius: Real) -> Self {
        self.radius = radius;
        self
    }

    /// Replaces the weight of the recurrent connection (default 1). Below 1 the integral leaks with the time constant
    /// `0.1 s / (1 - weight)`. A weight that is not finite is a fault when the graph is built.
    pub fn retention(mut self, weight: Real) -> Self {
        self.retention = weight;
        self
    }
}

/// Time constant of [`RECURRENT`].
const RECURRENT_TAU_S: Real = RECURRENT_MS as Real / 1e3;

impl<K: FlowKind> Module for Integrator<K> {
    type Ports = Ports<K>;

    fn expand(self, scope: &mut Scope<'_>) -> Ports<K> {
        let specs = || K::specs(&self.shape);
        refuse_none(scope, "components", K::width(&self.shape));
        let scaled = |weight| Superpose {
            specs: specs(),
            weights: vec![weight],
            constant: vec![0.0; K::width(&self.shape)],
        };
        let held = Represent::new::<K>(specs().0, specs().1, self.radius).kept();
        let held: Ports<K> = scope.represent("held", held);
        let [input, output] =
            ["sum", "output"].map(|name| scope.add(name, Add::of(specs().0, specs().1)));
        let step = scope.add("step", scaled(RECURRENT_TAU_S));
        let kept = scope.add("kept", scaled(self.retention));
        scope.connect(&input.output, &step.inputs[0], Synapse::None);
        scope.connect(&step.output, &held.input, RECURRENT);
        scope.connect(&held.output, &kept.inputs[0], RECURRENT);
        scope.connect(&kept.output, &held.input, Synapse::None);
        scope.connect(&held.output, &output.input, FEED_FORWARD);
        Ports {
            input: scope.input("input", input.input),
            output: scope.output("output", output.output),
        }
    }
}

/// A controlled oscillator: a point that turns on the unit circle.
///
/// One ensemble represents the point and its speed, and decodes the motion (Eliasmith and Anderson 2003, section 8.5).
/// The circle attracts: a kick ends on it within a few periods, and the amplitude stays within 15% of 1. Without a kick
/// the point rests at the origin in direct mode; the noise of neurons is a kick. A kick that lasts whole turns cancels.
///
/// ```
/// use symbolt::prelude::*;
/// use symbolt::sim::Signal;
/// use symbolt::spa::Oscillator;
///
/// let mut graph = GraphBuilder::new();
/// let kick = graph.add("kick", Signal::vector(2, |t, out| out[0] = if t < 0.1 { 1.0 } else { 0.0 }));
/// let clock = graph.add("clock", Oscillator::new(2.0));
/// graph.route(&kick >> &clock.input);
/// let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), SimDuration::from_millis(1000))?;
/// let point = sim.value(&clock.output);
/// assert!((point[0].hypot(point[1]) - 1.0).abs() < 0.15);
/// # Ok::<(), symbolt::sim::SimError>(())
/// ```
pub struct Oscillator {
    hz: Real,
}

/// Ports of an [`Oscillator`].
pub struct OscillatorPorts {
    /// Kick: added to the point through the recurrent synapse (100 ms). Two components; adds any number of connections.
    pub input: In<Vector>,
    /// Change of the speed, from -2 to 0 times the frequency: -1 stands still and -2 turns backwards. Adds any number of
    /// connections, or none.
    pub speed: In<Scalar>,
    /// The point: two components.
    pub output: Out<Vector>,
}

crate::spa::flow::flow_ports!(OscillatorPorts, output: Vector, input: Vector);

/// Greatest frequency. Spikes keep the circle up to here; at 10 Hz some seeds stay at the origin.
const MOST_HZ: Real = 8.0;

/// Share of its error in radius by which the point moves to the circle in one time constant of the synapse.
const PULL: Real = 0.4;

impl Oscillator {
    /// Makes an oscillator of `hz` turns per second, counter-clockwise, or clockwise below 0. More than 8 are a fault when the
    /// graph is built: in one time constant of the recurrent synapse the point may then turn so far that spikes lose it.
    pub fn new(hz: Real) -> Self {
        Self { hz }
    }
}

impl Module for Oscillator {
    type Ports = OscillatorPorts;

    fn expand(self, scope: &mut Scope<'_>) -> OscillatorPorts {
        let possible = self.hz.abs() <= MOST_HZ;
        if !possible {
            let found = self.hz;
            scope.refuse(format!("the frequency is {found} Hz; expected -{MOST_HZ} to {MOST_HZ}"));
        }
        let turn = if possible { self.hz } else { 0.0 };
        let turn = std::f32::consts::TAU as Real * turn * RECURRENT_TAU_S;
        let turned = move |x: &[Real], out: &mut [Real]| {
            let keep = 1.0 + PULL * (1.0 - x[0] * x[0] - x[1] * x[1]).max(-1.0);
            out[0] = keep * x[0] - turn * x[2] * x[1];
            out[1] = keep * x[1] + turn * x[2] * x[0];
        };
        let point = Ensemble::new(3).radius(1.6).size(1.5).decode("turned", 2, turned);
        let point = point.decode("point", 2, |x, out| out.copy_from_slice(&x[..2]));
        let point = scope.ensemble("point", point);
        let [input, output] = ["kick", "output"].map(|name| scope.add(name, Add::vector(2)));
        let speed = scope.add("speed", Add::scalar());
        let one = scope.add("one", Constant::scalar(1.0));
        let plane = [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]];
        scope.connect(&one, &speed.input, Synapse::None);
        scope.route((input.output.transform(plane) >> &point.input).via(RECURRENT));
        let turned = point.output("turned");
        scope.route((turned.transform(plane) >> &point.input).via(RECURRENT));
        scope.route(speed.output.transform([[0.0], [0.0], [1.0]]) >> &point.input);
        scope.connect(&point.output("point"), &output.input, FEED_FORWARD);
        OscillatorPorts {
            input: scope.input("input", input.input),
            speed: scope.input("speed", speed.input),
            output: scope.output("output", output.output),
        }
    }
}
