//! The prescribed error sensitivity: weights follow an error.

use super::{LearningRule, LearningTick, Needs, Side, Stretch, Trace, WeightShape};
use crate::neurons::tuning::{TuningError, not_negative};
use crate::sim::{Fingerprint, Real, Synapse};

/// How a rule is told what is wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Teacher {
    /// By the input `error`: what is, minus what should be.
    Error,
    /// By the input `target`; the error is the output of the connection in this tick minus the target.
    Target,
}

impl Teacher {
    pub fn needs(self, shape: WeightShape) -> (Option<(&'static str, usize)>, bool) {
        match self {
            Self::Error => (Some(("error", shape.outputs)), false),
            Self::Target => (Some(("target", shape.outputs)), true),
        }
    }

    /// Writes the error of a tick.
    pub fn error(self, tick: &LearningTick<'_>, error: &mut [f64]) {
        let outputs: &[Real] = if self == Self::Target { tick.output } else { &[] };
        for (at, (error, signal)) in error.iter_mut().zip(tick.signal).enumerate() {
            *error = match self {
                Self::Error => f64::from(*signal),
                Self::Target => f64::from(outputs[at]) - f64::from(*signal),
            };
        }
    }

    pub fn hash(self, hash: &mut Fingerprint) {
        hash.number(u64::from(self == Self::Target));
    }
}

/// The prescribed error sensitivity (MacNeil and Eliasmith, "Fine-tuning and the stability of recurrent neural networks",
/// PLoS ONE 6:e22885, 2011): `w[j][i]` changes by `-rate dt / n e[j] a[i]`, with `n` sources.
///
/// The error is the input `error`, with one number per output: what is, minus what should be. For a constant activity, the
/// error falls by the factor `1 - rate dt |a|^2 / n` per tick; a factor below -1 diverges. A rule of thumb for the rate is
/// at most `n / (4 tau c)`, with the time constant of the error's synapse and the greatest mean square of an activity.
///
/// Does not depend on the weights that it starts from: a connection that learns beside one of decoded values, into the
/// same input, learns what these lack.
///
/// State: `pre`, the filtered activity in Hz; `error`. Costs two operations per weight and tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pes {
    rate: f64,
    pre: Synapse,
    teacher: Teacher,
}

impl Default for Pes {
    /// The rate is 1e-4.
    fn default() -> Self {
        Self::new(1e-4)
    }
}

impl Pes {
    /// Creates the rule. `rate` is at least 0 and finite. The activity passes a low-pass of 5 ms.
    pub fn new(rate: f64) -> Self {
        Self { rate, pre: Synapse::lowpass_ms(5), teacher: Teacher::Error }
    }

    /// Sets the filter of the activity.
    pub fn pre_synapse(mut self, synapse: Synapse) -> Self {
        self.pre = synapse;
        self
    }

    /// Replaces the input `error` by `target`: the error is the output of the connection, in the same tick, minus the
    /// target.
    pub fn toward_target(mut self) -> Self {
        self.teacher = Teacher::Target;
        self
    }
}

impl LearningRule for Pes {
    fn name(&self) -> &'static str {
        "pes"
    }

    fn needs(&self, shape: WeightShape) -> Result<Needs, TuningError> {
        not_negative("rate", self.rate)?;
        let (signal, output) = self.teacher.needs(shape);
        let state = vec![("pre", shape.inputs), ("error", shape.outputs)];
        let traces = vec![Trace { state: "pre", of: Side::Pre, synapse: self.pre }];
        Ok(Needs { signal, output, post: false, state, traces })
    }

    fn observe(&self, tick: &LearningTick<'_>, state: &mut [f64]) {
        self.teacher.error(tick, &mut state[tick.shape.inputs..]);
    }

    fn change(&self, tick: &LearningTick<'_>, state: &[f64], of: &Stretch<'_>, change: &mut [f64]) {
        let (pre, error) = state.split_at(tick.shape.inputs);
        let factor = -self.rate * tick.dt_s / tick.shape.inputs as f64 * error[of.row];
        let pre = &pre[of.columns.clone()];
        change.iter_mut().zip(pre).for_each(|(change, a)| *change += factor * a);
    }

    fn leaves(&self, tick: &LearningTick<'_>, state: &[f64], row: usize) -> bool {
        state[tick.shape.inputs + row] == 0.0
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        self.pre.fingerprint(hash.real(self.rate));
        self.teacher.hash(hash);
    }
}
