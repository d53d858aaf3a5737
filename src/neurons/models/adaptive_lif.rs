//! Leaky integrate-and-fire neurons with adaptation: spikes, and rates.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::{Block, Firing, Lif, NeuronModel, Start, Variable, check_seconds};
use crate::neurons::tuning::{TuningError, not_negative, refuse};
use crate::sim::{Fingerprint, Real};

/// A [`Lif`] neuron whose spikes reduce its current (La Camera et al., "Minimal models of adapted neuronal response to
/// in vivo-like input currents", 2004).
///
/// A tick is one of [`Lif`] at the current `J - n`; then `n` changes by `(dt / tau_n) (inc_n out - n)`. `out` is 1 / dt
/// in the tick of a spike, so a spike adds `inc_n / tau_n`. A constant current leads to the rate r at which `r = f(J -
/// inc_n r)`, f being the rate of [`Lif`].
///
/// Tuning and decoders are those of [`Lif`] without adaptation, as in Nengo. State: `voltages` (0 to 1 at the start),
/// `refractory times` and `adaptation` (both 0).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AdaptiveLif {
    /// The neuron without adaptation.
    pub lif: Lif,
    /// Time constant of the adaptation, in seconds (above 0, at least a tick). Default: 1.
    pub tau_n_s: f64,
    /// Strength of the adaptation: current per Hz (at least 0). Default: 0.01.
    pub inc_n: f64,
}

impl Default for AdaptiveLif {
    fn default() -> Self {
        Self { lif: Lif::default(), tau_n_s: 1.0, inc_n: 0.01 }
    }
}

/// The rates of [`AdaptiveLif`] neurons: they adapt, but have no spikes.
///
/// State: `adaptation` (0 at the start).
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct AdaptiveLifRate(pub AdaptiveLif);

/// Adaptation below which it counts as none, so that neurons come to rest.
const NONE: Real = 1e-20;

/// Greatest `inc_n`: more would soon be infinite in single precision.
const MOST_INC: f64 = 1e15;

/// How the adaptation changes in a tick.
struct Adaptation {
    /// Share that is lost in a tick.
    decay: Real,
    /// What one unit of activity adds.
    gained: Real,
}

impl Adaptation {
    #[inline(always)]
    fn step(&self, n: &mut Real, activity: Real) {
        let next = *n + self.decay * -*n + self.gained * activity;
        *n = if next > NONE { next } else { 0.0 };
    }
}

impl AdaptiveLif {
    /// Returns the change of the adaptation in ticks of `dt` seconds. A unit of activity is a rate of `unit` Hz.
    #[inline(always)]
    fn adaptation(&self, dt: Real, unit: f64) -> Adaptation {
        let decay = f64::from(dt) / self.tau_n_s;
        Adaptation { decay: decay as Real, gained: (decay * self.inc_n * unit) as Real }
    }

    fn check_adaptation(&self, dt_s: f64) -> Result<(), TuningError> {
        check_seconds("tau_n_s", self.tau_n_s)?;
        if dt_s > self.tau_n_s {
            let expected = format!("at most tau_n ({} s)", self.tau_n_s);
            return Err(refuse("tick", format!("{dt_s} s"), expected));
        }
        not_negative("inc_n", self.inc_n)?;
        match self.inc_n <= MOST_INC {
            true => Ok(()),
            false => Err(refuse("inc_n", self.inc_n, format!("at most {MOST_INC:e}"))),
        }
    }

    /// Steps one neuron in double precision, as [`Lif::step_exactly`] does; `adaptation` starts at 0. Returns whether
    /// the neuron fires.
    pub fn step_exactly(
        &self,
        dt_s: f64,
        current: f64,
        (voltage, refractory_s): (&mut f64, &mut f64),
        adaptation: &mut f64,
    ) -> bool {
        let fires = self.lif.step_exactly(dt_s, current - *adaptation, voltage, refractory_s);
        let rate = if fires { self.lif.amplitude / dt_s } else { 0.0 };
        *adaptation += dt_s / self.tau_n_s * (self.inc_n * rate - *adaptation);
        fires
    }
}

impl NeuronModel for AdaptiveLif {
    fn name(&self) -> &'static str {
        "adaptive lif"
    }

    tuned_as!(this => this.lif);

    fn check(&self, dt_s: f64) -> Result<(), TuningError> {
        self.lif.check(dt_s)?;
        self.check_adaptation(dt_s)
    }

    /// One spike in each tick.
    fn most_rate(&self, dt_s: f64) -> f64 {
        self.lif.most_rate(dt_s)
    }

    fn firing(&self) -> Firing {
        self.lif.firing()
    }

    fn state(&self) -> Vec<Variable> {
        let mut all = self.lif.state();
        all.push(Variable { name: "adaptation", start: Start::At(0.0) });
        all
    }

    #[inline(always)]
    fn step(&self, block: Block<'_>) {
        let Block { dt_s: dt, currents, state, activity, .. } = block;
        let (tick, adaptation) = (self.lif.tick(dt), self.adaptation(dt, 1.0 / f64::from(dt)));
        let (v, rest) = state.split_at_mut(currents.len());
        let (r, n) = rest.split_at_mut(currents.len());
        let state = v.iter_mut().zip(r).zip(n);
        for (((v, r), n), (current, activity)) in state.zip(currents.iter().zip(activity)) {
            let fires = tick.step(current - *n, v, r);
            adaptation.step(n, fires);
            *activity = fires;
        }
    }

    fn rate_form(&self) -> Option<Arc<dyn NeuronModel>> {
        Some(Arc::new(AdaptiveLifRate(*self)))
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        self.lif.fingerprint(hash.text(self.name()));
        hash.real(self.tau_n_s).real(self.inc_n);
    }
}

impl NeuronModel for AdaptiveLifRate {
    fn name(&self) -> &'static str {
        "adaptive lif rate"
    }

    tuned_as!(this => this.0);

    fn check(&self, dt_s: f64) -> Result<(), TuningError> {
        self.0.lif.check(dt_s)?;
        self.0.check_adaptation(dt_s)
    }

    fn firing(&self) -> Firing {
        Firing::Rates
    }

    fn state(&self) -> Vec<Variable> {
        vec![Variable { name: "adaptation", start: Start::At(0.0) }]
    }

    #[inline(always)]
    fn step(&self, block: Block<'_>) {
        let Block { dt_s: dt, currents, state: n, activity, .. } = block;
        let adaptation = self.0.adaptation(dt, 1.0);
        for (activity, (current, n)) in activity.iter_mut().zip(currents.iter().zip(&*n)) {
            *activity = current - n;
        }
        self.0.rates_single(activity);
        for (n, rate) in n.iter_mut().zip(activity) {
            adaptation.step(n, *rate);
        }
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        self.0.fingerprint(hash.text(self.name()));
    }
}
