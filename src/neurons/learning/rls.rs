//! Recursive least squares: weights follow an error as fast as the correlations of the activities allow.

use super::connection::dot;
use super::pes::Teacher;
use super::{LearningRule, LearningTick, Needs, Side, Stretch, Trace, WeightShape};
use crate::neurons::tuning::{TuningError, not_negative, refuse};
use crate::sim::{Fingerprint, Synapse};

/// Recursive least squares (Sussillo and Abbott, "Generating coherent patterns of activity from chaotic neural networks",
/// Neuron 63:544, 2009). With `g = P a`, `w[j][i]` changes by `-e[j] g[i] / (1 + a.g)`, and `P` by
/// `-g g' / (1 + a.g)`. `P` starts as `rate dt / n` times the identity, with `n` sources.
///
/// The error is the input `error`, with one number per output: what is, minus what should be. For a constant activity, the
/// error of tick k is that of tick 0 divided by `1 + k c`, with `c = rate dt |a|^2 / n`.
///
/// State: `pre`, the filtered activity in Hz; `error`; `gain`, which is `g / (1 + a.g)`; `inverse`, the matrix `P`, which
/// estimates the inverse of the activities' correlations. It takes 8 n^2 bytes, and 4 n^2 operations per tick. At most
/// 4,096 sources.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rls {
    rate: f64,
    pre: Synapse,
    teacher: Teacher,
}

impl Default for Rls {
    /// The rate is 1e-3.
    fn default() -> Self {
        Self::new(1e-3)
    }
}

/// Greatest number of sources, because memory grows with its square.
const MOST_INPUTS: usize = 4_096;

impl Rls {
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
    /// target. Without a filter of the activity this is the least-squares solution of all ticks so far.
    pub fn toward_target(mut self) -> Self {
        self.teacher = Teacher::Target;
        self
    }
}

impl LearningRule for Rls {
    fn name(&self) -> &'static str {
        "rls"
    }

    fn needs(&self, shape: WeightShape) -> Result<Needs, TuningError> {
        not_negative("rate", self.rate)?;
        let WeightShape { outputs, inputs } = shape;
        if inputs > MOST_INPUTS {
            return Err(refuse("sources", inputs, format!("at most {MOST_INPUTS}")));
        }
        let (signal, output) = self.teacher.needs(shape);
        let state =
            vec![("pre", inputs), ("error", outputs), ("gain", inputs), ("inverse", inputs.pow(2))];
        let traces = vec![Trace { state: "pre", of: Side::Pre, synapse: self.pre }];
        Ok(Needs { signal, output, post: false, state, traces })
    }

    fn start(&self, shape: WeightShape, dt_s: f64, state: &mut [f64]) {
        let n = shape.inputs;
        let inverse = &mut state[2 * n + shape.outputs..];
        inverse.iter_mut().step_by(n + 1).for_each(|p| *p = self.rate * dt_s / n as f64);
    }

    /// A factor of learning between 0 and 1 acts on `P` as on the weights.
    fn observe(&self, tick: &LearningTick<'_>, state: &mut [f64]) {
        let n = tick.shape.inputs;
        let (pre, rest) = state.split_at_mut(n);
        let (error, rest) = rest.split_at_mut(tick.shape.outputs);
        let (gain, inverse) = rest.split_at_mut(n);
        self.teacher.error(tick, error);
        let share = tick.learning.clamp(0.0, 1.0);
        if share == 0.0 {
            return gain.fill(0.0);
        }
        for (gain, row) in gain.iter_mut().zip(inverse.chunks_exact(n)) {
            *gain = dot(row, pre);
        }
        let whole = 1.0 + dot(gain, pre);
        for (at, row) in inverse.chunks_exact_mut(n).enumerate() {
            let factor = share * gain[at] / whole;
            row.iter_mut().zip(&*gain).for_each(|(p, gain)| *p -= factor * gain);
        }
        gain.iter_mut().for_each(|gain| *gain /= whole);
    }

    fn change(&self, tick: &LearningTick<'_>, state: &[f64], of: &Stretch<'_>, change: &mut [f64]) {
        let WeightShape { outputs, inputs } = tick.shape;
        let error = state[inputs + of.row];
        let gain = &state[inputs + outputs..][of.columns.clone()];
        change.iter_mut().zip(gain).for_each(|(change, gain)| *change -= error * gain);
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        self.pre.fingerprint(hash.real(self.rate));
        self.teacher.hash(hash);
    }
}
