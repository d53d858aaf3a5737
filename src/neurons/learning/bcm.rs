//! The rule of Bienenstock, Cooper and Munro: weights grow where the target fires above its threshold, which slides.

use super::{LearningRule, LearningTick, Needs, Side, Stretch, Trace, WeightShape};
use crate::neurons::tuning::{TuningError, not_negative};
use crate::sim::{Fingerprint, Synapse};

/// The rule of Bienenstock, Cooper and Munro ("Theory for the development of neuron selectivity", J Neurosci 2:32, 1982):
/// `w[j][i]` changes by `rate dt b[j] (b[j] - theta[j]) a[i]`. The threshold `theta` is the target's activity through a
/// slow filter. A larger target feels more change.
///
/// State: `pre` and `post`, the filtered activities in Hz; `theta`, in Hz. Costs two operations per weight and tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bcm {
    rate: f64,
    /// Of the sources, the targets and the threshold.
    synapses: [Synapse; 3],
}

impl Default for Bcm {
    /// The rate is 1e-9.
    fn default() -> Self {
        Self::new(1e-9)
    }
}

impl Bcm {
    /// Creates the rule. `rate` is at least 0 and finite. Both activities pass low-passes of 5 ms, and the threshold has
    /// one of 1 s.
    pub fn new(rate: f64) -> Self {
        let (fast, slow) = (Synapse::lowpass_ms(5), Synapse::lowpass_ms(1000));
        Self { rate, synapses: [fast, fast, slow] }
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

impl LearningRule for Bcm {
    fn name(&self) -> &'static str {
        "bcm"
    }

    fn needs(&self, shape: WeightShape) -> Result<Needs, TuningError> {
        not_negative("rate", self.rate)?;
        let WeightShape { outputs, inputs } = shape;
        let state = vec![("pre", inputs), ("post", outputs), ("theta", outputs)];
        let traces = vec![
            Trace { state: "pre", of: Side::Pre, synapse: self.synapses[0] },
            Trace { state: "post", of: Side::Post, synapse: self.synapses[1] },
            Trace { state: "theta", of: Side::Post, synapse: self.synapses[2] },
        ];
        Ok(Needs { post: true, state, traces, ..Needs::default() })
    }

    fn change(&self, tick: &LearningTick<'_>, state: &[f64], of: &Stretch<'_>, change: &mut [f64]) {
        let (pre, rest) = state.split_at(tick.shape.inputs);
        let (post, theta) = rest.split_at(tick.shape.outputs);
        let factor = self.rate * tick.dt_s * post[of.row] * (post[of.row] - theta[of.row]);
        let pre = &pre[of.columns.clone()];
        change.iter_mut().zip(pre).for_each(|(change, a)| *change += factor * a);
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.real(self.rate);
        self.synapses.iter().for_each(|synapse| synapse.fingerprint(hash));
    }
}
