//! The Vector-Oja rule: encoders move toward the values at which their neurons fire.

use super::{LearningRule, LearningTick, Needs, Side, Stretch, Trace, WeightShape};
use crate::neurons::tuning::{TuningError, not_negative, refuse};
use crate::sim::{Fingerprint, Synapse};

/// The Vector-Oja rule (Voelker, Crawford and Eliasmith, "Learning large-scale heteroassociative memories in spiking
/// neurons", 2014): an encoder `e[j]` changes by `rate dt b[j] (x - e[j])`, where `x` is the value over the radius. For
/// a connection of [encoders](super::Learned::encoders).
///
/// For constant `b` and `x` the encoder of tick k is `x + (1 - rate dt b)^k (e_0 - x)`. Encoders are not normalised again.
/// A factor of learning ([`Learned::switched`](super::Learned::switched)) below 0 lets encoders forget.
///
/// State: `post`, the filtered activity in Hz. Costs three operations per tick and weight of a neuron that
/// has been active.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Voja {
    rate: f64,
    post: Synapse,
    radius: f64,
}

impl Default for Voja {
    /// The rate is 0.01.
    fn default() -> Self {
        Self::new(0.01)
    }
}

impl Voja {
    /// Creates the rule. `rate` is at least 0 and finite. The activity passes a low-pass of 5 ms.
    pub fn new(rate: f64) -> Self {
        Self { rate, post: Synapse::lowpass_ms(5), radius: 1.0 }
    }

    /// Sets the filter of the activity of the neurons.
    pub fn post_synapse(mut self, synapse: Synapse) -> Self {
        self.post = synapse;
        self
    }

    /// Sets the radius by which values are divided: that of the ensemble (default 1, above 0). Nengo does not divide:
    /// there encoders move toward the value itself, as with 1.
    pub fn radius(mut self, radius: f64) -> Self {
        self.radius = radius;
        self
    }
}

impl LearningRule for Voja {
    fn name(&self) -> &'static str {
        "voja"
    }

    fn needs(&self, shape: WeightShape) -> Result<Needs, TuningError> {
        not_negative("rate", self.rate)?;
        if !(self.radius.is_normal() && self.radius > 0.0) {
            return Err(refuse("radius", self.radius, "a normal number above 0"));
        }
        let state = vec![("post", shape.outputs)];
        let traces = vec![Trace { state: "post", of: Side::Post, synapse: self.post }];
        Ok(Needs { post: true, state, traces, ..Needs::default() })
    }

    fn change(&self, tick: &LearningTick<'_>, state: &[f64], of: &Stretch<'_>, change: &mut [f64]) {
        let factor = self.rate * tick.dt_s * state[of.row];
        let each = change.iter_mut().zip(of.weights).zip(&tick.pre[of.columns.clone()]);
        for ((change, weight), x) in each {
            *change += factor * (f64::from(*x) / self.radius - weight);
        }
    }

    fn leaves(&self, _tick: &LearningTick<'_>, state: &[f64], row: usize) -> bool {
        state[row] == 0.0
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        self.post.fingerprint(hash.real(self.rate).real(self.radius));
    }
}
