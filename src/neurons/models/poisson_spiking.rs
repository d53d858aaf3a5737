//! Spikes of a Poisson process, at the rates of any model.

use std::sync::Arc;

use super::series::exp;
use super::{Block, Draws, Firing, NeuronModel, Start, Variable};
use crate::neurons::tuning::TuningError;
use crate::sim::{Fingerprint, Real};

/// Neurons that fire like a Poisson process, at the rates of a model: the number of spikes in a tick is Poisson
/// distributed, and its mean and variance are rate times dt. Negative rates give negative spikes.
///
/// State: `spikes of the tick`.
#[derive(Debug, Clone)]
pub struct PoissonSpiking(Arc<dyn NeuronModel>);

impl PoissonSpiking {
    /// Makes neurons that fire at the rates of `model`, its [`rates`](NeuronModel::rates). Its state has no part in it.
    pub fn new(model: impl NeuronModel) -> Self {
        Self(Arc::new(model))
    }
}

/// Greatest mean that one draw covers.
const MOST: f64 = 16.0;

/// Draws a Poisson number of any mean, in double precision.
#[cold]
fn drawn(mean: Real, neuron: usize, draws: &Draws) -> Real {
    let parts = (f64::from(mean) / MOST).ceil().clamp(1.0, 1e6);
    let mean = f64::from(mean) / parts;
    let mut count = 0.0;
    for part in 0..parts as u32 {
        let uniform = f64::from(draws.uniform(neuron, part));
        let (mut k, mut term) = (0.0, (-mean).exp());
        let mut below = term;
        while uniform >= below && k < 100.0 {
            k += 1.0;
            term *= mean / k;
            below += term;
        }
        count += k;
    }
    count as Real
}

impl NeuronModel for PoissonSpiking {
    fn name(&self) -> &'static str {
        "poisson spiking"
    }

    tuned_as!(this => this.0);

    fn check(&self, dt_s: f64) -> Result<(), TuningError> {
        self.0.check(dt_s)
    }

    fn firing(&self) -> Firing {
        Firing::Spikes { trace: 0, above: 0.0 }
    }

    fn state(&self) -> Vec<Variable> {
        vec![Variable { name: "spikes of the tick", start: Start::At(0.0) }]
    }

    #[inline(always)]
    fn step(&self, block: Block<'_>) {
        let Block { dt_s, currents, state: fired, activity, draws, .. } = block;
        activity.copy_from_slice(currents);
        self.0.rates_single(activity);
        // The inverse of the distribution function, up to 4 without branches.
        for (neuron, (fired, activity)) in fired.iter_mut().zip(activity.iter()).enumerate() {
            let (mean, uniform) = (activity.abs() * dt_s, draws.uniform(neuron, 0));
            let mut term = exp(-mean);
            let (mut below, mut count) = (term, 0.0);
            for part in [1.0, 1.0 / 2.0, 1.0 / 3.0, 1.0 / 4.0] {
                count += if uniform < below { 0.0 } else { 1.0 };
                term *= mean * part;
                below += term;
            }
            *fired = if uniform < below { count } else { 5.0 };
        }
        for (neuron, (fired, activity)) in fired.iter_mut().zip(activity).enumerate() {
            let mean = activity.abs() * dt_s;
            if *fired > 4.0 {
                *fired = drawn(mean, neuron, &draws);
            }
            *activity = fired.copysign(*activity);
        }
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        self.0.fingerprint(hash.text(self.name()));
    }
}
