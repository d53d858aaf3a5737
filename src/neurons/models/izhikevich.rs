//! The neuron of Izhikevich, which bursts, chatters or resonates.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::{
    Block, Firing, NeuronModel, SPIKES, Start, Variable, check_seconds, least_current, line,
    rate_at,
};
use crate::neurons::tuning::{TuningError, not_negative, refuse};
use crate::sim::{Fingerprint, Real};

/// A neuron of Izhikevich ("Simple model of spiking neurons", 2003): `v' = 0.04 v^2 + 5 v + 140 - u + J` and
/// `u' = a (b v - u)`, per millisecond. It fires at v = 30; then `v = c` and `u` grows by d.
///
/// A tick is that of Nengo, not the two half steps of the paper: J is at least -30; one Euler step of v over the whole
/// tick; the test and the reset; one Euler step of u, with the new v; and then the growth by d. With it, ticks above 1
/// ms are refused.
///
/// There is no closed form of the rate. [`rates`](NeuronModel::rates) counts the spikes of one second, after one tick
/// from v = 0 and u = 0, in ticks of 1 ms, as Nengo does; gains and biases are found by a search, 0.5 to 2 ms per
/// neuron. Rates so are whole numbers.
///
/// State: `voltages` (at the start between c and c + 15) and `recoveries` (`b c`). The defaults are those of regular
/// spiking; other constructors give the other types of the paper.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Izhikevich {
    /// Rate of the recovery, a, per millisecond (above 0). Default: 0.02.
    pub recovery_rate: f64,
    /// How strongly the recovery follows the voltage, b. Default: 0.2.
    pub coupling: f64,
    /// Voltage after a spike, c, in mV (below 30). Default: -65.
    pub reset_voltage: f64,
    /// What a spike adds to the recovery, d. Default: 8.
    pub reset_recovery: f64,
}

impl Default for Izhikevich {
    fn default() -> Self {
        Self::regular_spiking()
    }
}

/// Voltage at which a neuron fires.
const PEAK: f64 = 30.0;
/// Least current that has an effect.
const LEAST_CURRENT: f64 = -30.0;
/// Ticks over which spikes are counted, and their length in ms.
const COUNTED: usize = 1_000;

impl Izhikevich {
    const fn of(recovery_rate: f64, coupling: f64, c: f64, d: f64) -> Self {
        Self { recovery_rate, coupling, reset_voltage: c, reset_recovery: d }
    }

    /// Regular spiking (RS): the default.
    pub const fn regular_spiking() -> Self {
        Self::of(0.02, 0.2, -65.0, 8.0)
    }

    /// Intrinsically bursting (IB).
    pub const fn bursting() -> Self {
        Self::of(0.02, 0.2, -55.0, 4.0)
    }

    /// Chattering (CH).
    pub const fn chattering() -> Self {
        Self::of(0.02, 0.2, -50.0, 2.0)
    }

    /// Fast spiking (FS).
    pub const fn fast_spiking() -> Self {
        Self::of(0.1, 0.2, -65.0, 8.0)
    }

    /// Low-threshold spiking (LTS).
    pub const fn low_threshold() -> Self {
        Self::of(0.02, 0.25, -65.0, 8.0)
    }

    /// A resonator (RZ).
    pub const fn resonator() -> Self {
        Self::of(0.1, 0.26, -65.0, 8.0)
    }

    /// Steps one neuron in double precision. Returns whether it fires.
    #[inline(always)]
    pub fn step_exactly(&self, dt_s: f64, current: f64, v: &mut f64, u: &mut f64) -> bool {
        let current = if current > LEAST_CURRENT { current } else { LEAST_CURRENT };
        let next = *v + (0.04 * (*v * *v) + 5.0 * *v + 140.0 - *u + current) * 1e3 * dt_s;
        let fires = next >= PEAK;
        *v = if fires { self.reset_voltage } else { next };
        *u += self.recovery_rate * (self.coupling * *v - *u) * 1e3 * dt_s;
        *u += if fires { self.reset_recovery } else { 0.0 };
        fires
    }
}

impl NeuronModel for Izhikevich {
    fn name(&self) -> &'static str {
        "izhikevich"
    }

    fn check(&self, dt_s: f64) -> Result<(), TuningError> {
        if !(self.recovery_rate > 0.0 && self.recovery_rate < 1.0) {
            return Err(refuse("recovery_rate", self.recovery_rate, "above 0 and below 1 per ms"));
        }
        if !self.coupling.is_finite() {
            return Err(refuse("coupling", self.coupling, "a finite number"));
        }
        if !(-1e3..PEAK).contains(&self.reset_voltage) {
            return Err(refuse("reset_voltage", self.reset_voltage, "-1000 to below 30 mV"));
        }
        not_negative("reset_recovery", self.reset_recovery)?;
        check_seconds("tick", dt_s)?;
        match dt_s <= 0.001 {
            true => Ok(()),
            false => Err(refuse("tick", format!("{dt_s} s"), "at most 0.001 s")),
        }
    }

    fn gain_bias(&self, max_rate: f64, intercept: f64) -> Result<(f64, f64), TuningError> {
        // Steps of a rate need no twelve digits.
        let reached = |current: f64| rate_at(self, current) >= max_rate;
        let most = least_current(reached, 1e-4).filter(|_| max_rate > 0.0 && max_rate < 1e3);
        let expected = "above 0 and below 1000 Hz";
        line(most.ok_or_else(|| refuse("max_rate", max_rate, expected))?, self.onset(), intercept)
    }

    fn onset(&self) -> f64 {
        least_current(|current| rate_at(self, current) > 0.0, 1e-6).unwrap_or(f64::NEG_INFINITY)
    }

    fn rates(&self, currents: &mut [f64]) {
        // Several neurons at once, since the steps of one wait for each other; so few that all their numbers stay in
        // registers.
        const LANES: usize = 4;
        for block in currents.chunks_mut(LANES) {
            let mut driven = [0.0; LANES];
            driven[..block.len()].copy_from_slice(block);
            let (mut v, mut u, mut count) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
            for tick in 0..=COUNTED {
                for i in 0..LANES {
                    let fires = self.step_exactly(0.001, driven[i], &mut v[i], &mut u[i]);
                    count[i] += if fires && tick > 0 { 1.0 } else { 0.0 };
                }
            }
            block.copy_from_slice(&count[..block.len()]);
        }
    }

    fn firing(&self) -> Firing {
        Firing::Spikes { trace: 2, above: 0.0 }
    }

    fn state(&self) -> Vec<Variable> {
        let reset = self.reset_voltage as Real;
        let voltages = Start::Between(reset, reset + 15.0);
        let recoveries = Start::At((self.coupling * self.reset_voltage) as Real);
        vec![
            Variable { name: "voltages", start: voltages },
            Variable { name: "recoveries", start: recoveries },
            SPIKES,
        ]
    }

    #[inline(always)]
    fn step(&self, block: Block<'_>) {
        let Block { dt_s, currents, state, activity, .. } = block;
        let ms = dt_s * 1e3;
        let [a, b, c, d] =
            [self.recovery_rate, self.coupling, self.reset_voltage, self.reset_recovery]
                .map(|x| x as Real);
        let (v, rest) = state.split_at_mut(currents.len());
        let (u, fired) = rest.split_at_mut(currents.len());
        let state = v.iter_mut().zip(u).zip(fired);
        for (((v, u), fired), (current, activity)) in state.zip(currents.iter().zip(activity)) {
            let least = LEAST_CURRENT as Real;
            let current = if *current > least { *current } else { least };
            let next = *v + (0.04 * (*v * *v) + 5.0 * *v + 140.0 - *u + current) * ms;
            let fires = next >= PEAK as Real;
            *v = if fires { c } else { next };
            *u += a * (b * *v - *u) * ms + if fires { d } else { 0.0 };
            *fired = if fires { 1.0 } else { 0.0 };
            *activity = *fired;
        }
    }

    fn rate_form(&self) -> Option<Arc<dyn NeuronModel>> {
        let currents = (0..ENTRIES + 1).map(|entry| LEAST_CURRENT + STEP * entry as f64);
        let mut rates: Vec<f64> = currents.collect();
        self.rates(&mut rates);
        let table = std::array::from_fn(|entry| {
            [rates[entry], rates[entry + 1] - rates[entry]].map(|rate| rate as Real)
        });
        Some(Arc::new(Tabulated { model: *self, table: Arc::new(table) }))
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text(self.name()).real(self.recovery_rate).real(self.coupling);
        hash.real(self.reset_voltage).real(self.reset_recovery);
    }
}

/// Intervals of currents in the table of rates, and the length of each.
const ENTRIES: usize = 4_120;
const STEP: f64 = 0.25;

/// The rates of a neuron from a table of currents from -30 to 1,000, linear between them: counting spikes takes a
/// thousand ticks.
#[derive(Debug, Clone)]
struct Tabulated {
    model: Izhikevich,
    /// The rate at the beginning of each interval, and the difference from there to its end. Both are whole numbers.
    table: Arc<[[Real; 2]; ENTRIES]>,
}

impl Tabulated {
    #[inline(always)]
    fn rate(&self, current: Real) -> Real {
        let at = (current - LEAST_CURRENT as Real) * (1.0 / STEP) as Real;
        let at = at.clamp(0.0, ENTRIES as Real);
        let entry = (at as u32 as usize).min(ENTRIES - 1);
        let [rate, difference] = self.table[entry];
        rate + difference * (at - entry as Real)
    }
}

impl NeuronModel for Tabulated {
    fn name(&self) -> &'static str {
        "izhikevich rate"
    }

    fn check(&self, dt_s: f64) -> Result<(), TuningError> {
        self.model.check(dt_s)
    }

    fn rates(&self, currents: &mut [f64]) {
        currents.iter_mut().for_each(|current| *current = f64::from(self.rate(*current as Real)));
    }

    fn firing(&self) -> Firing {
        Firing::Rates
    }

    fn step(&self, block: Block<'_>) {
        for (activity, current) in block.activity.iter_mut().zip(block.currents) {
            *activity = self.rate(*current);
        }
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        self.model.fingerprint(hash.text(self.name()));
    }
}
