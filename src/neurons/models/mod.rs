//! Neuron models: what a neuron does with its current. Each model has a file of its own.

mod lif;
mod lif_rate;

use std::fmt;

use rand::{Rng, RngExt};

use super::bank::work::Work;
use super::tuning::TuningError;
use crate::sim::{Fingerprint, Real};

pub use lif::Lif;
pub use lif_rate::LifRate;

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
    /// [`TuningError::Setting`] if a parameter or the tick is outside its range.
    fn check(&self, dt_s: f64) -> Result<(), TuningError>;

    /// Returns the gain and bias of a neuron with the given maximum rate (Hz) and intercept.
    ///
    /// Let x be the represented value along the encoder of the neuron, in units of the radius. The current is
    /// `gain x + bias`. The neuron begins to fire at x = `intercept` and fires at `max_rate` at x = 1.
    ///
    /// # Errors
    /// [`TuningError::Setting`] if no neuron of this model has this rate and intercept.
    fn gain_bias(&self, max_rate: f64, intercept: f64) -> Result<(f64, f64), TuningError>;

    /// Replaces constant currents by the rates at them, in Hz. Decoders are solved from these.
    fn rates(&self, currents: &mut [f64]);

    /// Replaces currents by rates in single precision, which is enough for most decoders. A relative error of 1e-5 does
    /// no harm.
    fn rates_single(&self, currents: &mut [f32]) {
        for current in currents {
            let mut rate = [f64::from(*current)];
            self.rates(&mut rate);
            *current = rate[0] as f32;
        }
    }

    /// Returns what the activity of a neuron is: spikes or a rate.
    fn firing(&self) -> Firing;

    /// Returns the numbers that a neuron keeps from tick to tick.
    fn state(&self) -> Vec<Variable>;

    /// Steps a block of neurons by one tick: updates their state and writes their activity. Must neither allocate, lock
    /// nor log, and treat every neuron alike: blocks are cut in any way.
    fn step(&self, block: Block<'_>);

    /// Returns the current up to which a neuron at rest stays at rest. At rest all its state is zero, and so is its
    /// activity. Ensembles at rest are passed over, and gates close by such a current. Minus infinity, the default, if
    /// there is none.
    fn rest_below(&self) -> f64 {
        f64::NEG_INFINITY
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
    /// The number of its spikes in the tick. A spike counts as a rate of 1 / dt for one tick.
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
}
