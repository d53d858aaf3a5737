//! Neuron models: what a neuron does with its current. Each model has a file of its own.

/// Takes tuning, rates and rest from another model.
macro_rules! tuned_as {
    ($this:ident => $of:expr) => {
        fn gain_bias(&self, max_rate: f64, intercept: f64) -> Result<(f64, f64), TuningError> {
            let $this = self;
            $of.gain_bias(max_rate, intercept)
        }

        fn onset(&self) -> f64 {
            let $this = self;
            $of.onset()
        }

        fn rates(&self, currents: &mut [f64]) {
            let $this = self;
            $of.rates(currents);
        }

        fn rates_single(&self, currents: &mut [f32]) {
            let $this = self;
            $of.rates_single(currents);
        }

        fn rest_below(&self) -> f64 {
            let $this = self;
            $of.rest_below()
        }
    };
}

/// Makes the rates of a model, in single precision, its activity.
macro_rules! fires_its_rates {
    () => {
        fn firing(&self) -> Firing {
            Firing::Rates
        }

        #[inline(always)]
        fn step(&self, block: Block<'_>) {
            block.activity.copy_from_slice(block.currents);
            self.rates_single(block.activity);
        }
    };
}

/// Declares neurons that fire at the rates of a model, by a function that turns rates in `Block::activity` into spikes.
/// The last variable of their state is the number of spikes in the tick.
macro_rules! spikes_from_rates {
    ($(#[$doc:meta])* $model:ident, $name:literal, $state:expr, $spikes:path) => {
        $(#[$doc])*
        #[derive(Debug, Clone)]
        pub struct $model(super::RateOf);

        impl $model {
            /// Makes neurons that fire at the rates of `model`, as [`RateOf`](super::RateOf) steps them. Its state has
            /// no part in it.
            pub fn new(model: impl NeuronModel) -> Self {
                Self(super::RateOf::new(model))
            }
        }

        impl NeuronModel for $model {
            fn name(&self) -> &'static str {
                $name
            }

            tuned_as!(this => this.0);

            fn check(&self, dt_s: f64) -> Result<(), TuningError> {
                self.0.check(dt_s)
            }

            fn firing(&self) -> Firing {
                Firing::Spikes { trace: $state.len() - 1, above: 0.0 }
            }

            fn state(&self) -> Vec<Variable> {
                $state.to_vec()
            }

            #[inline(always)]
            fn step(&self, block: Block<'_>) {
                let Block { dt_s, currents, draws, .. } = block;
                let activity = &mut *block.activity;
                self.0.step(Block { dt_s, currents, state: &mut [], activity, draws });
                $spikes(block);
            }

            fn fingerprint(&self, hash: &mut Fingerprint) {
                self.0.of().fingerprint(hash.text(self.name()));
            }
        }
    };
}

mod adaptive_lif;
mod draws;
mod izhikevich;
mod lif;
mod lif_rate;
mod poisson_spiking;
mod rate_of;
mod rectified_linear;
mod regular_spiking;
pub(super) mod series;
mod sigmoid;
mod stochastic_spiking;
mod tanh;

use std::fmt;
use std::sync::Arc;

use rand::{Rng, RngExt};

use super::bank::work::Work;
use super::tuning::{TuningError, refuse};
use crate::sim::{Fingerprint, Real};

pub use adaptive_lif::{AdaptiveLif, AdaptiveLifRate};
pub use draws::Draws;
pub use izhikevich::Izhikevich;
pub use lif::Lif;
pub use lif_rate::LifRate;
pub use poisson_spiking::PoissonSpiking;
pub use rate_of::RateOf;
pub use rectified_linear::{RectifiedLinear, SpikingRectifiedLinear};
pub use regular_spiking::RegularSpiking;
pub use sigmoid::Sigmoid;
pub use stochastic_spiking::StochasticSpiking;
pub use tanh::Tanh;

/// A neuron model: the tuning of a neuron, its rate at a constant current, and its step of one tick.
///
/// Neurons of any model are encoded, decoded, saved and shared among threads in the same way. A model says what
/// happens between a current and the activity. [`Population::neurons`](super::Population::neurons) makes populations
/// of a model.
pub trait NeuronModel: fmt::Debug + Send + Sync + 'static {
    /// Returns the name of the model in messages, such as `lif`.
    fn name(&self) -> &'static str;

    /// Checks the parameters, for ticks of `dt_s` seconds.
    ///
    /// # Errors
    /// [`TuningError::Setting`] if a parameter or the tick is outside its range. The default accepts all.
    fn check(&self, dt_s: f64) -> Result<(), TuningError> {
        let _ = dt_s;
        Ok(())
    }

    /// Returns the gain and bias of a neuron with the given maximum rate (Hz) and intercept.
    ///
    /// Let x be the represented value along the encoder of the neuron, in units of the radius. The current is
    /// `gain x + bias`. The neuron begins to fire at x = `intercept` and fires at `max_rate` at x = 1.
    ///
    /// The default searches for the current of the rate by bisection on [`rates`](Self::rates), which costs about a
    /// hundred calls, and takes the current of the intercept from [`onset`](Self::onset).
    ///
    /// # Errors
    /// [`TuningError::Setting`] if no neuron of this model has this rate and intercept.
    fn gain_bias(&self, max_rate: f64, intercept: f64) -> Result<(f64, f64), TuningError> {
        if !(max_rate > 0.0 && max_rate.is_finite()) {
            return Err(refuse("max_rate", max_rate, "a finite rate above 0"));
        }
        let found = least_current(|current| rate_at(self, current) >= max_rate, 1e-12);
        let most = found.ok_or_else(|| {
            let expected = format!("a rate that the model `{}` reaches", self.name());
            refuse("max_rate", max_rate, expected)
        })?;
        line(most, self.onset(), intercept)
    }

    /// Returns the current at which a neuron begins to fire; that of the middle of the curve for models that never fall
    /// silent. Intercepts are the values that lead to this current.
    ///
    /// The default is the least current, found by bisection, whose rate is above 0.001 Hz.
    fn onset(&self) -> f64 {
        least_current(|current| rate_at(self, current) > 1e-3, 1e-12).unwrap_or(f64::NEG_INFINITY)
    }

    /// Replaces constant currents by the rates at them, in Hz. Decoders are solved from these. The rates of some models
    /// are negative for some currents.
    fn rates(&self, currents: &mut [f64]);

    /// Replaces currents by rates in single precision, which is enough for most decoders. A relative error of 1e-5 does
    /// no harm.
    fn rates_single(&self, currents: &mut [f32]) {
        let mut rates = [0.0; 32];
        for currents in currents.chunks_mut(rates.len()) {
            let rates = &mut rates[..currents.len()];
            rates.iter_mut().zip(&*currents).for_each(|(to, from)| *to = f64::from(*from));
            self.rates(rates);
            currents.iter_mut().zip(rates).for_each(|(to, from)| *to = *from as f32);
        }
    }

    /// Returns what the activity of a neuron is: spikes or a rate.
    fn firing(&self) -> Firing;

    /// Returns the numbers that a neuron keeps from tick to tick: by default none.
    fn state(&self) -> Vec<Variable> {
        Vec::new()
    }

    /// Steps a block of neurons by one tick: updates their state and writes their activity. Must neither allocate, lock
    /// nor log, and treat every neuron alike: blocks are cut in any way.
    fn step(&self, block: Block<'_>);

    /// Returns the current up to which a neuron at rest stays at rest. At rest all its state is zero, and so is its
    /// activity. Ensembles at rest are passed over, and gates close by such a current. Minus infinity, the default, if
    /// there is none.
    fn rest_below(&self) -> f64 {
        f64::NEG_INFINITY
    }

    /// Returns the greatest rate that neurons can show in ticks of `dt_s` seconds. Tunings with a greater rate are refused. The default,
    /// infinity, is for neurons that may fire several times in a tick, or whose activity is a rate.
    fn most_rate(&self, dt_s: f64) -> f64 {
        let _ = dt_s;
        f64::INFINITY
    }

    /// Returns the model that stands for this one in [`Population::Rate`](super::Population::Rate). The default,
    /// `None`, stands for [`RateOf`] this model: activities are [`rates`](Self::rates).
    fn rate_form(&self) -> Option<Arc<dyn NeuronModel>> {
        None
    }

    /// Returns the number of additions, multiplications and divisions in the step of a neuron, for accounts of speed
    /// ([`Traffic`](super::Traffic)). The default, 0, is for models whose operations nobody has counted.
    fn operations(&self) -> u32 {
        0
    }

    /// Adds to `hash` what tells this model from others: its name, and every number that affects its results.
    fn fingerprint(&self, hash: &mut Fingerprint);

    /// Steps ensembles. Do not override this method.
    ///
    /// It stands here because the loops over neurons are then compiled for each model, with [`step`](Self::step)
    /// inside: a tick calls a model once for each part of a bank.
    fn step_ensembles(&self, work: &Work<'_>, state: &mut [Real], out: &mut [Real]) {
        work.step(self, state, out);
    }
}

/// What the activity of a neuron is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Firing {
    /// Its firing rate, in Hz.
    Rates,
    /// The number of its spikes in the tick, which may be above 1 or, for rates below 0, negative. A spike counts as a
    /// rate of 1 / dt for one tick.
    Spikes {
        /// Index of a [`Variable`] that tells whether the neuron has fired in the tick that left its state.
        trace: usize,
        /// The neuron has fired if the variable exceeds this number.
        above: Real,
    },
}

/// A number that every neuron keeps from tick to tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Variable {
    /// Name of the variable. The random numbers of its start depend on it.
    pub name: &'static str,
    /// Values at the start of a run.
    pub start: Start,
}

/// The values of a variable at the start of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Start {
    /// One value for all neurons.
    At(Real),
    /// Random values from the range between two numbers. They keep neurons from firing in synchrony.
    Between(Real, Real),
}

impl Start {
    pub(super) fn draw<R: Rng>(self, rng: &mut R) -> Real {
        match self {
            Self::At(value) => value,
            Self::Between(low, high) => low + (high - low) * rng.random::<Real>(),
        }
    }
}

/// Refuses a model whose state has no first value, or whose spikes are told by a variable that it does not have.
pub(super) fn check_state(model: &dyn NeuronModel) -> Result<(), TuningError> {
    let state = model.state();
    for (place, Variable { name, start }) in state.iter().enumerate() {
        if state[..place].iter().any(|other| other.name == *name) {
            return Err(refuse("state", name, "variables of different names"));
        }
        let finite = match start {
            Start::At(value) => value.is_finite(),
            Start::Between(low, high) => low <= high && (high - low).is_finite(),
        };
        if !finite {
            let expected = format!("a finite start of `{name}`, the lower number first");
            return Err(refuse("state", format!("{start:?}"), expected));
        }
    }
    match model.firing() {
        Firing::Spikes { trace, .. } if trace >= state.len() => {
            let expected =
                format!("the index of one of the {} variables of the state", state.len());
            Err(refuse("trace", trace, expected))
        }
        _ => Ok(()),
    }
}

/// Neurons that are stepped together.
#[derive(Debug)]
#[non_exhaustive]
pub struct Block<'a> {
    /// Length of the tick, in seconds.
    pub dt_s: Real,
    /// Current of each neuron in this tick.
    pub currents: &'a [Real],
    /// State: the first [`Variable`] of each neuron, then the second, and so on.
    pub state: &'a mut [Real],
    /// Activity of each neuron, to be written: see [`Firing`].
    pub activity: &'a mut [Real],
    /// Random numbers of this tick.
    pub draws: Draws,
}

/// What neurons that count up to their next spike keep, and what those keep whose spikes are counted.
const VOLTAGES: Variable = Variable { name: "voltages", start: Start::Between(0.0, 1.0) };
const SPIKES: Variable = Variable { name: "spikes of the tick", start: Start::At(0.0) };

/// Returns the rate of a model at one current.
fn rate_at<M: NeuronModel + ?Sized>(model: &M, current: f64) -> f64 {
    let mut rate = [current];
    model.rates(&mut rate);
    rate[0]
}

/// Greatest magnitude of a current that a search tries.
const MOST_CURRENT: f64 = 1e9;

/// Finds the least current at which a condition holds that holds for all greater currents; `None` if it holds for all
/// currents or for none. `exact` is the relative error.
fn least_current(holds: impl Fn(f64) -> bool, exact: f64) -> Option<f64> {
    let outward = |from: f64, wanted: bool| {
        let currents = std::iter::successors(Some(from), |current| Some(current * 2.0));
        currents.take_while(|c| c.abs() <= MOST_CURRENT).find(|c| holds(*c) == wanted)
    };
    let (mut low, mut high) = (outward(-1.0, false)?, outward(1.0, true)?);
    while high - low > exact * (1.0 + high.abs()) {
        let middle = low + (high - low) / 2.0;
        if holds(middle) { high = middle } else { low = middle }
    }
    Some(high)
}

/// Returns the gain and bias with which the current is `most` at the value 1, and `onset` at the intercept.
fn line(most: f64, onset: f64, intercept: f64) -> Result<(f64, f64), TuningError> {
    if !(-1.0..1.0).contains(&intercept) {
        return Err(refuse("intercept", intercept, "at least -1 and below 1"));
    }
    let gain = (most - onset) / (1.0 - intercept);
    let found = (gain, onset - gain * intercept);
    if found.0.is_finite() && found.1.is_finite() {
        return Ok(found);
    }
    Err(refuse("intercept", intercept, "a model that begins to fire at some current"))
}

/// Returns a fault unless a maximum rate is above 0 and below a limit (Hz).
fn below_limit(max_rate: f64, limit: f64) -> Result<(), TuningError> {
    if max_rate > 0.0 && max_rate < limit {
        return Ok(());
    }
    let expected = match limit.is_finite() {
        true => format!("above 0 and below the limit of {limit} Hz"),
        false => "a finite rate above 0".into(),
    };
    Err(refuse("max_rate", max_rate, expected))
}

/// Returns a fault unless a time constant is a finite number of seconds above 0.
fn check_seconds(name: &'static str, seconds: f64) -> Result<(), TuningError> {
    match seconds.is_finite() && seconds > 0.0 {
        true => Ok(()),
        false => Err(refuse(name, seconds, "a finite number of seconds above 0")),
    }
}
