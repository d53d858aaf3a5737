//! The leaky integrate-and-fire neuron: its rate, its gain and bias, and its step.
//!
//! The resting voltage is 0 and the threshold is 1. Currents are in the same unit, so a neuron fires at currents
//! above 1 (Eliasmith and Anderson, "Neural Engineering", 2003, chapter 4). Spike times are corrected within a
//! step (Shelley and Tao, "Efficient and accurate time-stepping schemes for integrate-and-fire neuronal networks",
//! 2001).

use multiversion::multiversion;
use ndarray::NdFloat;
use serde::{Deserialize, Serialize};

use super::{Block, Firing, NeuronModel, Start, Variable, check_seconds};
use crate::neurons::tuning::{TuningError, refuse};
use crate::sim::{Fingerprint, Real};

/// A leaky integrate-and-fire neuron with a refractory period (Eliasmith and Anderson, "Neural Engineering", 2003,
/// chapter 4).
///
/// The resting voltage is 0 and the threshold is 1; currents are in the same unit. By default the membrane time
/// constant is 20 ms and the refractory period 2 ms. A neuron fires at most once in a tick, also where its refractory
/// period is shorter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Lif {
    /// Membrane time constant, in seconds (above 0).
    pub tau_rc_s: f64,
    /// Refractory period, in seconds (at least 0).
    pub tau_ref_s: f64,
    /// Size of a spike, in spikes (finite, above 0; default 1). Rates and activities are multiplied by it, gains and biases
    /// are not: a maximum rate is that of the spikes.
    pub amplitude: f64,
    /// Least voltage (at most 0, which is the default; minus infinity for none). Below 0 inhibition has a memory: the
    /// neuron fires later for it. The neuron is then never at rest, so a gate cannot close it.
    #[serde(with = "floor")]
    pub min_voltage: f64,
}

/// Minus infinity is written as none, since JSON has no infinity.
mod floor {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde gives a reference")]
    pub fn serialize<S: Serializer>(value: &f64, to: S) -> Result<S::Ok, S::Error> {
        (*value != f64::NEG_INFINITY).then_some(*value).serialize(to)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
        Ok(Option::deserialize(from)?.unwrap_or(f64::NEG_INFINITY))
    }
}

impl Default for Lif {
    fn default() -> Self {
        Self { tau_rc_s: 0.02, tau_ref_s: 0.002, amplitude: 1.0, min_voltage: 0.0 }
    }
}

/// Longest tick, in membrane time constants.
const MAX_TICK: f64 = 0.25;

/// What a step computes with polynomials, from the first power on. But for rounding to single precision, they have the least relative
/// error that polynomials of their degree can have.
struct Polynomials {
    /// `1 - exp(-z)` in z, for z from 0 to the longest tick.
    decay: [Real; 4],
    /// `-ln(1 - x)` in x, where x is `(v - 1) / (J - 1)`. Of a neuron that fires, x is at most the decay of the tick.
    since: [Real; 5],
}

/// For ticks up to [`MAX_TICK`]: errors of 2.5e-7 and 3.6e-7, and 5.1e-7 with the rounding of a step.
const LONG: Polynomials = Polynomials {
    decay: [0.999_999_76, -0.499_969_32, 0.166_055_1, -0.037_709_99],
    since: [1.000_000_3, 0.499_932_95, 0.335_684_3, 0.221_773_77, 0.331_025_04],
};

/// Longest tick of [`SHORT`], in membrane time constants, with slack for ticks in single precision.
const SHORT_TICK: f64 = (1.0 + 1e-6) / 16.0;

/// Errors of 2.3e-9 and 7.3e-10, and 1.6e-7 with the rounding of a step.
const SHORT: Polynomials = Polynomials {
    decay: [1.0, -0.499_999_5, 0.166_626_61, -0.040_638_45],
    since: [1.0, 0.499_999_75, 0.333_366_34, 0.248_496_05, 0.227_570_81],
};

/// The firing rate at a constant current: `1 / (tau_ref + tau_rc ln(1 + 1 / (J - 1)))` for J above 1, and otherwise 0.
fn rate<T: NdFloat>(current: T, tau_rc: T, tau_ref: T) -> T {
    if current > T::one() {
        T::one() / (tau_ref + tau_rc * (T::one() / (current - T::one())).ln_1p())
    } else {
        T::zero()
    }
}

impl Lif {
    /// Returns the firing rate at the constant current J, in Hz. It is the amplitude times
    /// `1 / (tau_ref + tau_rc ln(1 + 1 / (J - 1)))` for J above 1, and otherwise 0.
    pub fn rate(&self, current: f64) -> f64 {
        self.amplitude * rate(current, self.tau_rc_s, self.tau_ref_s)
    }

    /// Adds the parameters to a hash. Neurons that are as they always were keep the hash, and so the start, that they
    /// always had.
    pub(super) fn add_to(&self, hash: &mut Fingerprint) {
        hash.real(self.tau_rc_s).real(self.tau_ref_s);
        let usual = Self::default();
        if (self.amplitude, self.min_voltage) != (usual.amplitude, usual.min_voltage) {
            hash.real(self.amplitude).real(self.min_voltage);
        }
    }

    /// Returns the step of a neuron for ticks of `dt` seconds.
    #[inline(always)]
    pub(super) fn tick(&self, dt: Real) -> Tick {
        let (tau_rc, tau_ref) = (self.tau_rc_s as Real, self.tau_ref_s as Real);
        let short = f64::from(dt) <= SHORT_TICK * self.tau_rc_s;
        let Polynomials { decay, since } = if short { SHORT } else { LONG };
        Tick {
            decay,
            since,
            dt,
            tau_rc,
            rest_s: tau_ref + dt,
            per_tau: (1.0 / self.tau_rc_s) as Real,
            amplitude: self.amplitude as Real,
            floor: self.min_voltage as Real,
        }
    }

    /// Steps one neuron by `dt_s` seconds at a constant current, in double precision and without polynomials: the reference for
    /// [`step`](NeuronModel::step). Returns whether the neuron fires.
    ///
    /// `voltage` and `refractory_s` are the state of the neuron; start both at 0. `refractory_s` is the rest of the
    /// refractory period, in seconds. The refractory period begins at the moment of the spike within the step.
    pub fn step_exactly(
        &self,
        dt_s: f64,
        current: f64,
        voltage: &mut f64,
        refractory_s: &mut f64,
    ) -> bool {
        *refractory_s -= dt_s;
        let free_s = (dt_s - *refractory_s).clamp(0.0, dt_s);
        *voltage -= (current - *voltage) * (-free_s / self.tau_rc_s).exp_m1();
        if *voltage > 1.0 {
            let since = self.tau_rc_s * (-(*voltage - 1.0) / (current - 1.0)).ln_1p();
            *refractory_s = self.tau_ref_s + dt_s + since;
            *voltage = 0.0;
            return true;
        }
        *voltage = voltage.max(self.min_voltage);
        false
    }
}

impl NeuronModel for Lif {
    fn name(&self) -> &'static str {
        "lif"
    }

    /// A tick must be short beside the time constant of the membrane.
    fn check(&self, dt_s: f64) -> Result<(), TuningError> {
        let Self { tau_rc_s, tau_ref_s, amplitude, min_voltage } = *self;
        check_seconds("tau_rc_s", tau_rc_s)?;
        if !(tau_ref_s.is_finite() && tau_ref_s >= 0.0) {
            return Err(refuse("tau_ref_s", tau_ref_s, "a finite number of seconds, at least 0"));
        }
        if !(amplitude.is_finite() && amplitude > 0.0) {
            return Err(refuse("amplitude", amplitude, "a finite number above 0"));
        }
        if min_voltage.is_nan() || min_voltage > 0.0 {
            return Err(refuse("min_voltage", min_voltage, "at most 0, or minus infinity"));
        }
        if dt_s > MAX_TICK * tau_rc_s {
            let expected = format!("at most {MAX_TICK} of tau_rc ({} s)", MAX_TICK * tau_rc_s);
            return Err(refuse("tick", format!("{dt_s} s"), expected));
        }
        Ok(())
    }

    fn gain_bias(&self, max_rate: f64, intercept: f64) -> Result<(f64, f64), TuningError> {
        if !(-1.0..1.0).contains(&intercept) {
            return Err(refuse("intercept", intercept, "at least -1 and below 1"));
        }
        let limit = if self.tau_ref_s > 0.0 { 1.0 / self.tau_ref_s } else { f64::INFINITY };
        if !(max_rate > 0.0 && max_rate < limit) {
            let expected = format!("above 0 and below the refractory limit of {limit} Hz");
            return Err(refuse("max_rate", max_rate, expected));
        }
        let most = 1.0 / -((self.tau_ref_s - 1.0 / max_rate) / self.tau_rc_s).exp_m1();
        let gain = (most - 1.0) / (1.0 - intercept);
        Ok((gain, 1.0 - gain * intercept))
    }

    fn onset(&self) -> f64 {
        1.0
    }

    fn rates(&self, currents: &mut [f64]) {
        for current in currents {
            *current = self.rate(*current);
        }
    }

    fn rates_single(&self, currents: &mut [f32]) {
        let (tau_ref, tau_rc) = (self.tau_ref_s as f32, self.tau_rc_s as f32);
        rates_by_series((tau_ref, tau_rc), self.amplitude as f32, currents);
    }

    /// One spike in each tick.
    fn most_rate(&self, dt_s: f64) -> f64 {
        1.0 / dt_s
    }

    /// Only just after a spike is more than one refractory period left.
    fn firing(&self) -> Firing {
        Firing::Spikes { trace: 1, above: self.tau_ref_s as Real }
    }

    fn state(&self) -> Vec<Variable> {
        let voltage = Variable { name: "voltages", start: Start::Between(0.0, 1.0) };
        vec![voltage, Variable { name: "refractory times", start: Start::At(0.0) }]
    }

    /// Every pass over the neurons is without branches, so that compilers turn it into wide instructions.
    #[inline(always)]
    fn step(&self, block: Block<'_>) {
        let Block { dt_s: dt, currents, state, activity, .. } = block;
        let tick = self.tick(dt);
        let (v, r) = state.split_at_mut(currents.len());
        // Of a block of unknown length, compilers step what is left over four at a time.
        let (currents, v, r, activity) = tick.step_whole::<16>((currents, v, r, activity));
        let (currents, v, r, activity) = tick.step_whole::<8>((currents, v, r, activity));
        let neurons = v.iter_mut().zip(r.iter_mut()).zip(currents).zip(activity.iter_mut());
        for (((v, r), current), activity) in neurons {
            *activity = tick.step(*current, v, r);
        }
    }

    /// A current above 0 moves the voltage, although only one above 1 makes the neuron fire. With a floor below 0 any
    /// current does.
    fn rest_below(&self) -> f64 {
        if self.min_voltage < 0.0 { f64::NEG_INFINITY } else { 0.0 }
    }

    /// 11 of the decay, 3 of the voltage, 14 of the moment of a spike, 2 of the refractory time.
    fn operations(&self) -> u32 {
        30
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        self.add_to(hash.real(0.0));
    }
}

/// The step of one neuron in single precision, with its constants.
pub(super) struct Tick {
    decay: [Real; 4],
    since: [Real; 5],
    dt: Real,
    tau_rc: Real,
    /// Refractory period and tick.
    rest_s: Real,
    per_tau: Real,
    amplitude: Real,
    /// Least voltage.
    floor: Real,
}

/// Currents, voltages, rests of refractory periods, and activities of the same neurons.
type Neurons<'a> = (&'a [Real], &'a mut [Real], &'a mut [Real], &'a mut [Real]);

impl Tick {
    /// Steps neurons in groups of `N`. Returns those that are left over.
    #[inline(always)]
    fn step_whole<'a, const N: usize>(&self, (c, v, r, activity): Neurons<'a>) -> Neurons<'a> {
        let (groups, c) = c.as_chunks::<N>();
        let (vs, v) = v.as_chunks_mut::<N>();
        let (rs, r) = r.as_chunks_mut::<N>();
        let (activities, activity) = activity.as_chunks_mut::<N>();
        for (((c, v), r), activity) in groups.iter().zip(vs).zip(rs).zip(activities) {
            // In copies, which overlap with nothing else, compilers see that the order of neurons does not matter.
            let (own_c, mut own_v, mut own_r, mut own_activity) = (*c, *v, *r, [0.0; N]);
            for i in 0..N {
                own_activity[i] = self.step(own_c[i], &mut own_v[i], &mut own_r[i]);
            }
            (*v, *r, *activity) = (own_v, own_r, own_activity);
        }
        (c, v, r, activity)
    }

    /// Steps a neuron with voltage `v` and rest `r` of its refractory period at the current `c`. Returns the size of
    /// a spike if it fires, else 0. Without branches.
    #[inline(always)]
    pub fn step(&self, c: Real, v: &mut Real, r: &mut Real) -> Real {
        let Self { decay, since, dt, tau_rc, rest_s, per_tau, amplitude, floor } = *self;
        let left = *r - dt;
        let free = dt - left;
        let free = if free < dt { free } else { dt };
        let z = if free > 0.0 { free } else { 0.0 } * per_tau;
        // Both polynomials are cut in halves, which do not wait for each other.
        let [d1, d2, d3, d4] = decay;
        let decay = z * ((d1 + d2 * z) + z * z * (d3 + d4 * z));
        let next = *v + (c - *v) * decay;
        // The reciprocal does not wait for the decay. Where it is infinite, no neuron fires.
        let over = (next - 1.0) * (1.0 / (c - 1.0));
        let [l1, l2, l3, l4, l5] = since;
        let square = over * over;
        let since = over * ((l1 + l2 * over) + square * ((l3 + l4 * over) + square * l5));
        let spike = next > 1.0;
        let resting = if left > 0.0 { left } else { 0.0 };
        *r = if spike { rest_s - tau_rc * since } else { resting };
        let silent = if next > floor { next } else { floor };
        *v = if spike { 0.0 } else { silent };
        if spike { amplitude } else { 0.0 }
    }
}

/// Computes [`Lif::rate`] of many currents in wide instructions, with a relative error of about 1e-5.
///
/// The logarithm is split. The exponent gives one part. The mantissa q lies between the square roots of 1/2 and 2; the
/// series of `2 artanh((q - 1) / (q + 1))` gives its logarithm.
#[multiversion(targets("x86_64+avx2+fma", "x86_64+avx2", "x86_64+sse4.1"))]
fn rates_by_series((tau_ref, tau_rc): (f32, f32), amplitude: f32, currents: &mut [f32]) {
    for current in currents {
        let over = if *current - 1.0 > 1e-6 { *current - 1.0 } else { 1e-6 };
        let bits = ((1.0 + over) / over).to_bits().wrapping_sub(ROOT_HALF);
        let exponent = bits.cast_signed() >> 23;
        let q = f32::from_bits((bits & 0x007f_ffff).wrapping_add(ROOT_HALF));
        let s = (q - 1.0) / (q + 1.0);
        let square = s * s;
        let series = 1.0 / 5.0 + square * (1.0 / 7.0 + square * (1.0 / 9.0));
        let mantissa = 2.0 * s * (1.0 + square * (1.0 / 3.0 + square * series));
        let log = exponent as f32 * std::f32::consts::LN_2 + mantissa;
        // Far above threshold the quotient is 1 but for rounding; ln(1 + x) is x - x^2 / 2 there.
        let inverse = 1.0 / over;
        let log = if over > 1e3 { inverse * (1.0 - 0.5 * inverse) } else { log };
        *current = if *current > 1.0 { amplitude / (tau_ref + tau_rc * log) } else { 0.0 };
    }
}

/// Bits of the square root of 1/2.
const ROOT_HALF: u32 = 0x3f35_04f3;
