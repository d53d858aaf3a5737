//! Random processes: white noise, and what a synapse makes of it.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use crate::sim::describe::builder::{Module, Scope};
use crate::sim::describe::filter::Filter;
use crate::sim::describe::fingerprint::Fingerprint;
use crate::sim::describe::handle::Out;
use crate::sim::describe::io::{AdvanceIo, EmitIo, Outputs, StateMut, StepCx};
use crate::sim::describe::kind::{Kind, Pointer, Scalar, Space, Vector, VocabTag};
use crate::sim::describe::node::Node;
use crate::sim::describe::port::{AnyOutput, OutputSpec, PortDecl, ScratchSpec, StateSpec};
use crate::sim::describe::process::Process;
use crate::sim::describe::synapse::Synapse;
use crate::sim::error::NodeFault;
use crate::sim::real::Real;
use crate::sim::seed::Seed;
use crate::sim::time::Timebase;

/// The distribution of each number of [`WhiteNoise`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum NoiseDistribution {
    /// A normal distribution.
    Gaussian {
        /// Mean.
        mean: Real,
        /// Standard deviation, at least 0.
        sd: Real,
    },
    /// A uniform distribution.
    Uniform {
        /// Least value.
        low: Real,
        /// Greatest value, at least `low`.
        high: Real,
    },
}

impl NoiseDistribution {
    /// Returns the mean, and the factor of the deviation that [`deviation`](Self::deviation) draws.
    fn mean_and_spread(self) -> (Real, Real) {
        match self {
            Self::Gaussian { mean, sd } => (mean, sd),
            Self::Uniform { low, high } => (0.5 * low + 0.5 * high, high - low),
        }
    }

    fn deviation(self, rng: &mut ChaCha8Rng) -> Real {
        match self {
            Self::Gaussian { .. } => rng.sample(StandardNormal),
            Self::Uniform { .. } => rng.random::<Real>() - 0.5,
        }
    }
}

/// An output of independent random numbers in every tick and component: white noise; behind a synapse filtered noise, and
/// integrated Brownian motion. To add noise to a signal, see also [`Noise`](crate::sim::Noise).
///
/// The default is Gaussian with mean 0 and standard deviation 1, divided by the square root of the tick in seconds, so
/// that the noise behind a filter does not depend on the length of a tick (Gillespie 1996): its power density is 1 and the
/// standard deviation of a number is 31.6 at ticks of 1 ms.
///
/// The numbers depend only on run seed, path and tick. The run multiplies their deviations from the mean by its noise scale
/// ([`RunConfig::noise`](crate::sim::RunConfig::noise)). Adding it to a graph returns the handle of the output. A standard
/// deviation that is negative, a `high` below `low`, numbers that are not finite and a synapse that cannot be made are faults
/// when the graph is built. Costs about 10 ns per component and tick.
///
/// ```
/// use symbolt::prelude::*;
/// use symbolt::sim::WhiteNoise;
///
/// let mut graph = GraphBuilder::new();
/// let white = graph.add("white", WhiteNoise::scalar());
/// let filtered = graph.add("filtered", WhiteNoise::vector(3).filtered(Synapse::lowpass_ms(5)));
/// let brown = graph.add("brown", WhiteNoise::scalar().integrated());
/// let point = graph.add("point", Add::vector(3));
/// graph.route(&filtered >> &point);
/// let probe = graph.probe(&filtered, ProbeSpec::default());
/// let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), SimDuration::from_secs(10))?;
/// let all = sim.samples(&probe);
/// let variance = all.iter().map(|(_, v)| v[0] * v[0]).sum::<f32>() / all.len() as f32;
/// assert!((variance / 99.67 - 1.0).abs() < 0.2, "{variance}");
/// # Ok::<(), symbolt::sim::SimError>(())
/// ```
#[doc(alias = "FilteredNoise")]
#[doc(alias = "BrownNoise")]
pub struct WhiteNoise<K: Kind> {
    spec: OutputSpec<K>,
    rule: Rule,
}

#[derive(Debug, Clone, Copy)]
struct Rule {
    distribution: NoiseDistribution,
    per_tick: bool,
    synapse: Synapse,
}

impl WhiteNoise<Scalar> {
    /// Creates noise of one number.
    pub fn scalar() -> Self {
        Self::of(OutputSpec::scalar())
    }
}

impl WhiteNoise<Vector> {
    /// Creates noise of `width` independent numbers.
    pub fn vector(width: usize) -> Self {
        Self::of(OutputSpec::vector(width))
    }
}

impl<V: VocabTag> WhiteNoise<Pointer<V>> {
    /// Creates noise of independent components for pointers of `space`.
    pub fn pointer(space: &Space<V>) -> Self {
        Self::of(OutputSpec::pointer(space))
    }
}

impl<K: Kind> WhiteNoise<K> {
    fn of(spec: OutputSpec<K>) -> Self {
        let distribution = NoiseDistribution::Gaussian { mean: 0.0, sd: 1.0 };
        Self { spec, rule: Rule { distribution, per_tick: false, synapse: Synapse::None } }
    }

    /// Draws the numbers from `distribution`.
    pub fn distribution(mut self, distribution: NoiseDistribution) -> Self {
        self.rule.distribution = distribution;
        self
    }

    /// Does not divide by the square root of the tick: the distribution is that of the output in every tick.
    pub fn unscaled(mut self) -> Self {
        self.rule.per_tick = true;
        self
    }

    /// Filters the noise, within the tick. Behind a low-pass with decay `a`, the variance of the default is
    /// `(1 - a) / ((1 + a) dt)`, close to `1 / (2 tau)`.
    pub fn filtered(mut self, synapse: Synapse) -> Self {
        self.rule.synapse = synapse;
        self
    }

    /// Integrates the noise over time: Brownian motion. After `T` seconds the variance of the default is `T`.
    pub fn integrated(self) -> Self {
        self.filtered(Synapse::linear(&[1.0], &[1.0, 0.0]))
    }
}

impl<K: Kind> Process for WhiteNoise<K> {
    fn declare(&self, ports: &mut PortDecl) {
        let (mean, spread) = self.rule.distribution.mean_and_spread();
        if !mean.is_finite() || !spread.is_finite() || spread < 0.0 {
            ports.fault(format!(
                "the distribution {:?} cannot be drawn from; use finite numbers, a standard deviation of at least 0, and \
                 the lower bound first",
                self.rule.distribution
            ));
        }
        ports.output("out", self.spec.clone());
    }

    fn make(&self, time: Timebase, _seed: Seed) -> Result<Box<dyn Node>, String> {
        let rule = self.rule;
        let made = Filter::new(rule.synapse, time);
        let filter = made.map_err(|wrong| format!("its noise has {wrong}"))?;
        let filter = (rule.synapse != Synapse::None).then_some(filter);
        let factor = if rule.per_tick { 1.0 } else { (1.0 / time.dt_s().sqrt()) as Real };
        Ok(Box::new(Drawn { spec: self.spec.clone().into(), rule, factor, filter }))
    }
}

impl<K: Kind> Module for WhiteNoise<K> {
    type Ports = Out<K>;

    fn expand(self, scope: &mut Scope<'_>) -> Out<K> {
        scope.process(self).output("out")
    }
}

/// The node. With a filter, its state is that after the draws of the coming tick, and begins with the output.
struct Drawn {
    spec: AnyOutput,
    rule: Rule,
    factor: Real,
    filter: Option<Filter>,
}

impl Drawn {
    fn draw(&self, cx: &StepCx<'_>, out: &mut [Real]) {
        let distribution = self.rule.distribution;
        let (mean, spread) = distribution.mean_and_spread();
        let (mean, spread) = (mean * self.factor, spread * self.factor * cx.noise_scale());
        if spread == 0.0 {
            return out.fill(mean);
        }
        let mut rng = cx.rng();
        out.iter_mut().for_each(|v| *v = mean + spread * distribution.deviation(&mut rng));
    }
}

impl Node for Drawn {
    fn declare(&self, ports: &mut PortDecl) {
        let width = self.spec.width();
        ports.output("out", self.spec.clone());
        if let Some(filter) = &self.filter {
            ports.state(StateSpec { reals: filter.state_len(width), ..StateSpec::default() });
            ports.scratch(ScratchSpec { reals: width, ..ScratchSpec::default() });
        }
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text(&format!("{:?}", self.rule)).reals(&[self.factor]);
    }

    fn init(&self, cx: &StepCx<'_>, state: &mut StateMut<'_>, _registered: &mut Outputs<'_>) {
        if let Some(filter) = &self.filter {
            let mut drawn = vec![0.0; self.spec.width()];
            self.draw(cx, &mut drawn);
            filter.step(&drawn, state.reals);
        }
    }

    fn emit(&self, cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
        let out = io.outputs.get_mut(0);
        match &self.filter {
            Some(_) => out.copy_from_slice(&io.state.reals[..self.spec.width()]),
            None => self.draw(cx, out),
        }
    }

    fn advance(&self, cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        if let Some(filter) = &self.filter {
            self.draw(&StepCx { tick: cx.tick + 1, ..*cx }, io.scratch.reals);
            filter.step(io.scratch.reals, io.state.reals);
        }
        Ok(())
    }
}
