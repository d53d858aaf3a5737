//! Oja's rule: weights grow between neurons that fire together, and stay bounded.

use super::{LearningRule, LearningTick, Needs, Side, Stretch, Trace, WeightShape};
use crate::neurons::tuning::{TuningError, not_negative};
use crate::sim::{Fingerprint, Synapse};

/// Oja's rule (Oja, "Simplified neuron model as a principal component analyzer", J Math Biol 15:267, 1982): `w[j][i]`
/// changes by `rate dt (b[j] a[i] - beta b[j]^2 w[j][i])`.
///
/// For constant activities weights go to `a / (beta b)`, by the factor `1 - rate dt beta b^2` per tick. A larger target
/// feels more change.
///
/// State: `pre` and `post`, the filtered activities in Hz. Costs three operations per weight and tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Oja {
    rate: f64,
    beta: f64,
    synapses: [Synapse; 2],
}

impl Default for Oja {
    /// The rate is 1e-6.
    fn default() -> Self {
        Self::new(1e-6)
    }
}

impl Oja {
    /// Creates the rule. `rate` is at least 0 and finite. Beta is 1, and both activities pass low-passes of 5 ms.
    pub fn new(rate: f64) -> Self {
        Self { rate, beta: 1.0, synapses: [Synapse::lowpass_ms(5); 2] }
    }

    /// Sets the weight of forgetting (at least 0).
    pub fn beta(mut self, beta: f64) -> Self {
        self.beta = beta;
        self
    }

    /// Sets the filter of the sources' activity.
    pub fn pre_synapse(mut self, synapse: Synapse) -> Self {
        self.synapses[0] = synapse;
        self
    }

    /// Sets the filter of the targets' activity.
    pub fn post_synapse(mut self, synapse: Synapse) -> Self {
        self.synapses[1] = synapse;
        self
    }
}

impl LearningRule for Oja {
    fn name(&self) -> &'static str {
        "oja"
    }

    fn needs(&self, shape: WeightShape) -> Result<Needs, TuningError> {
        not_negative("rate", self.rate)?;
        not_negative("beta", self.beta)?;
        let state = vec![("pre", shape.inputs), ("post", shape.outputs)];
        let traces = vec![
            Trace { state: "pre", of: Side::Pre, synapse: self.synapses[0] },
            Trace { state: "post", of: Side::Post, synapse: self.synapses[1] },
        ];
        Ok(Needs { post: true, state, traces, ..Needs::default() })
    }

    fn change(&self, tick: &LearningTick<'_>, state: &[f64], of: &Stretch<'_>, change: &mut [f64]) {
        let (pre, post) = state.split_at(tick.shape.inputs);
        let b = post[of.row];
        let (grow, shrink) = (self.rate * tick.dt_s * b, self.rate * tick.dt_s * self.beta * b * b);
        let each = change.iter_mut().zip(of.weights).zip(&pre[of.columns.clone()]);
        each.for_each(|((change, weight), a)| *change += grow * a - shrink * weight);
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.real(self.rate).real(self.beta);
        self.synapses.iter().for_each(|synapse| synapse.fingerprint(hash));
    }
}
