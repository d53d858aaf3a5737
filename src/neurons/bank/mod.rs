//! Banks: many small ensembles of equal shape that are encoded, stepped and decoded together.
//!
//! # Memory layout
//!
//! A bank is a structure of arrays. The array of encoders, each times gain / radius, is ordered by ensemble, then by
//! group of 32 neurons (8 if the ensemble has one dimension), then by dimension. Encoding therefore reads memory from
//! front to back. Biases, voltages and refractory times have one array each. Neurons that never fire pad every ensemble
//! to whole groups. Ensembles of 1 to 4 neurons with one dimension and one output are not padded: they stand side by
//! side, and a group holds the neurons of eight ensembles (`few.rs`).
//!
//! # Passes
//!
//! One pass over a block of neurons computes currents. A second pass computes voltages and a mask of the neurons that
//! fired. A third pass decodes. With several outputs it adds only the decoders of the neurons that fired
//! (event-driven). With one output it adds all decoders under the mask, which costs less than finding the neurons that
//! fired. The loop skips resting ensembles that their input cannot wake. Skipping does not change the bits.
//!
//! # Memory traffic
//!
//! Per neuron and tick, a scalar bank reads 16 bytes (encoder, bias, voltage, refractory time) and writes 8. A bank of
//! d dimensions reads 4 d bytes of encoders instead of 4, and 4 d bytes of decoders for each neuron that fires (about
//! one in ten). This traffic limits the speed of banks that do not fit the caches.
//!
//! # Measured time
//!
//! On a shared EPYC at about 2.4 GHz, one core reads 40 to 50 GB/s from its last cache and 15 GB/s from memory;
//! two cores together read 28 GB/s from memory.
//!
//! | bank | time per neuron and tick | for comparison |
//! |---|---|---|
//! | scalar, 100,000 neurons | 2.2 to 2.5 ns | a bare loop over voltages: 0.5 ns; reading alone: 0.4 to 0.6 ns |
//! | sixteen dimensions | 4.6 to 5 ns | reading from the last cache alone: 1.6 ns |
//!
//! Most of the time is arithmetic. The decay within a refractory period and the moment of a spike (a division) are
//! computed for every neuron. A branch for the tenth of the neurons that fires would often be mispredicted and cost
//! more. With sixteen dimensions, a third of the time is encoding and a fifth is waiting for the decoders of the
//! neurons that fired. A network of 341,450 neurons does not fit the caches: at the bandwidth of both cores, reading
//! its 22 MB of encoders takes 0.8 ms per tick.

mod few;
mod loops;
#[cfg(test)]
mod tests;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use self::few::few;
use self::loops::{Work, rates, spikes};
use super::decode::{self, Points};
use super::model::{Lif, TuningError, refuse};
use super::tuning::Neurons;
use crate::sim::{Real, Seed};

/// The kind of output that a bank's neurons send.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Firing {
    /// Spikes. A spike counts as a rate of 1 / dt for one tick.
    Spikes,
    /// Firing rates, in Hz.
    Rates,
}

/// The number of ensembles in a bank, and the size of each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Shape {
    pub ensembles: usize,
    /// Number of neurons in one ensemble.
    pub neurons: usize,
    /// Number of dimensions of the value that one ensemble represents.
    pub dims: usize,
    /// Number of values decoded from one ensemble.
    pub outputs: usize,
}

/// One ensemble before its decoders are solved.
pub(crate) struct Draft {
    pub neurons: Neurons,
    /// Radius: greatest norm of a represented value. Division by the radius maps values to the unit ball.
    pub radius: f64,
    /// Evaluation points, in units of the radius. The target values are not divided by the radius.
    pub points: Points,
}

/// Constants that the loops take from the neuron model and the tick.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Consts {
    dt: Real,
    per_tau: Real,
    tau_rc: Real,
    tau_ref: Real,
}

impl Consts {
    pub fn new(lif: &Lif, dt_s: f64) -> Self {
        Self {
            dt: dt_s as Real,
            per_tau: (1.0 / lif.tau_rc_s) as Real,
            tau_rc: lif.tau_rc_s as Real,
            tau_ref: lif.tau_ref_s as Real,
        }
    }
}

/// Ensembles of equal shape with all their parameters.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Bank {
    pub(super) shape: Shape,
    pub(super) firing: Firing,
    pub(super) encoders: Vec<Real>,
    pub(super) biases: Vec<Real>,
    pub(super) decoders: Vec<Real>,
    /// Magnitude of the negative current that silences every neuron.
    pub(super) silencing: Real,
    /// The silencing current silences every neuron for inputs of at most this squared norm.
    pub(super) quiet: Real,
    /// For each ensemble, the input below which no neuron gets a current above 0. Follows from the other fields.
    pub(super) rests: Vec<Real>,
    pub(super) consts: Consts,
    /// The ensembles that the other fields hold, in rising order; `None` for all. The others belong to other ranks.
    pub(super) own: Option<Vec<usize>>,
}

impl Shape {
    /// Number of neurons in one group of encoders.
    fn lanes(&self) -> usize {
        match self.dims {
            1 if self.is_few() => 1,
            1 => NARROW,
            _ => WIDE,
        }
    }

    /// Returns whether several ensembles share a group.
    pub(super) fn is_few(&self) -> bool {
        self.neurons <= FEW && self.dims == 1 && self.outputs == 1
    }

    /// Number of neurons in one ensemble, including those that pad its last group.
    pub(super) fn padded(&self) -> usize {
        self.neurons.next_multiple_of(self.lanes())
    }

    /// Index of a neuron's encoder for a dimension, within its ensemble's encoders.
    fn encoder_at(&self, neuron: usize, dimension: usize) -> usize {
        let lanes = self.lanes();
        (neuron / lanes * self.dims + dimension) * lanes + neuron % lanes
    }
}

/// Neurons encoded together in ensembles of one dimension: the width of the widest registers in use.
pub(super) const NARROW: usize = 8;
/// Neurons encoded together in ensembles of several dimensions.
const WIDE: usize = 32;
/// Greatest number of neurons in ensembles that share a group.
const FEW: usize = 4;
/// Neurons in one block: their currents stay in the first-level cache between passes.
const BLOCK: usize = 128;

/// Longest tick, in membrane time constants. Up to it, the series of the decay is accurate to 1e-6.
const MAX_TICK: f64 = 0.25;

impl Bank {
    /// Draws the neurons of a bank and solves for their decoders.
    ///
    /// `draft` makes one ensemble from its index and seed. Ensembles are solved in parallel; the result does not
    /// depend on the number of threads. Only the ensembles in `own` are made, or all if it is `None`; an ensemble does not
    /// depend on the others.
    pub fn build(
        lif: &Lif,
        dt_s: f64,
        shape: Shape,
        (firing, regularisation): (Firing, f64),
        (seed, own): (Seed, Option<Vec<usize>>),
        draft: impl Fn(usize, Seed) -> Result<Draft, TuningError> + Sync,
    ) -> Result<Self, TuningError> {
        lif.check()?;
        if shape.neurons == 0 || shape.ensembles == 0 || shape.dims == 0 {
            return Err(refuse("neurons", shape.neurons, "at least 1 per ensemble"));
        }
        if dt_s > lif.tau_ref_s && firing == Firing::Spikes {
            let expected = format!("at most the refractory period of {} s", lif.tau_ref_s);
            return Err(refuse("tick", format!("{dt_s} s"), expected));
        }
        if dt_s > MAX_TICK * lif.tau_rc_s {
            let expected = format!("at most {MAX_TICK} of tau_rc ({} s)", MAX_TICK * lif.tau_rc_s);
            return Err(refuse("tick", format!("{dt_s} s"), expected));
        }
        if !(regularisation.is_finite() && regularisation > 0.0) {
            return Err(refuse("regularisation", regularisation, "a finite number above 0"));
        }
        let per_spike = if firing == Firing::Spikes { 1.0 / dt_s } else { 1.0 };
        let all = || (0..shape.ensembles).collect();
        let solved: Vec<Ensemble> = own
            .clone()
            .unwrap_or_else(all)
            .into_par_iter()
            .map(|index| {
                let draft = draft(index, seed.derive_index("ensemble", index as u64))?;
                let decoders = decode::solve(lif, &draft.neurons, &draft.points, regularisation)?;
                Ok(Ensemble::lay_out(&draft, &decoders, shape, per_spike))
            })
            .collect::<Result<_, TuningError>>()?;
        Ok(Self { own, ..Self::assemble(lif, dt_s, (shape, firing), &solved) })
    }

    /// Returns a copy that holds only the ensembles in `own`.
    pub fn only(&self, own: Vec<usize>) -> Self {
        let per = self.shape.padded();
        let pick = |of: &[Real], each: usize| -> Vec<Real> {
            own.iter().flat_map(|ensemble| &of[ensemble * each..][..each]).copied().collect()
        };
        Self {
            encoders: pick(&self.encoders, per * self.shape.dims),
            biases: pick(&self.biases, per),
            decoders: pick(&self.decoders, per * self.shape.outputs),
            rests: pick(&self.rests, 1),
            own: Some(own),
            ..*self
        }
    }

    /// Joins the ensembles' arrays, one ensemble after another.
    pub(super) fn assemble(
        lif: &Lif,
        dt_s: f64,
        (shape, firing): (Shape, Firing),
        solved: &[Ensemble],
    ) -> Self {
        let join = |part: fn(&Ensemble) -> &Vec<Real>| -> Vec<Real> {
            solved.iter().flat_map(|e| part(e).iter().copied()).collect()
        };
        let (encoders, biases) = (join(|e| &e.encoders), join(|e| &e.biases));
        Self {
            shape,
            firing,
            rests: rests(shape, &encoders, &biases),
            encoders,
            biases,
            decoders: join(|e| &e.decoders),
            silencing: solved.iter().map(|e| e.silencing).fold(0.0, Real::max),
            quiet: solved.iter().map(|e| e.quiet).fold(Real::MAX, Real::min),
            consts: Consts::new(lif, dt_s),
            own: None,
        }
    }

    /// Returns whether a neuron of a range of ensembles fired in the tick that left this state of the range. Only then is
    /// more than one refractory period left.
    pub fn spiked(&self, state: &[Real], neuron: usize) -> bool {
        let (each, per) = (self.shape.neurons, self.shape.padded());
        let refractory = &state[state.len() / 2..];
        refractory[neuron / each * per + neuron % each] > self.consts.tau_ref
    }

    /// Number of neurons in all ensembles that spike: all of them, or none in rate mode.
    pub fn spiking(&self) -> usize {
        self.spiking_of(self.shape.ensembles)
    }

    /// Number of neurons that spike in so many ensembles.
    pub fn spiking_of(&self, ensembles: usize) -> usize {
        match self.firing {
            Firing::Spikes => ensembles * self.shape.neurons,
            Firing::Rates => 0,
        }
    }

    /// Length of the state of all ensembles: all voltages, then all refractory times. 0 in rate mode.
    pub fn state_len(&self) -> usize {
        self.state_of(self.shape.ensembles)
    }

    /// Length of the state of so many ensembles.
    pub fn state_of(&self, ensembles: usize) -> usize {
        match self.firing {
            Firing::Spikes => 2 * ensembles * self.shape.padded(),
            Firing::Rates => 0,
        }
    }

    /// Steps the ensembles from `first` on by one tick. This process must own them.
    ///
    /// `values` and `out` have one row per ensemble. `open` is the gate: 0 silences every neuron, 1 has no effect.
    /// Ensembles are independent, so several calls for parts of a bank give the same bits as one call for all.
    pub fn step(
        &self,
        first: usize,
        (values, open): (&[Real], Real),
        state: &mut [Real],
        out: &mut [Real],
    ) {
        let (shape, padded) = (self.shape, self.shape.padded());
        let shift = -self.silencing * (1.0 - open.clamp(0.0, 1.0));
        let (voltages, refractory) = state.split_at_mut(state.len() / 2);
        let first = match &self.own {
            None => first,
            Some(own) => own.partition_point(|ensemble| *ensemble < first),
        };
        let count = values.len() / shape.dims;
        let at = |per: usize| first * per..(first + count) * per;
        let work = Work {
            consts: self.consts,
            shape,
            shift,
            quiet: if shift <= -self.silencing { self.quiet } else { -1.0 },
            rests: &self.rests[at(1)],
            encoders: &self.encoders[at(padded * shape.dims)],
            biases: &self.biases[at(padded)],
            decoders: &self.decoders[at(padded * shape.outputs)],
            values,
        };
        match self.firing {
            Firing::Rates => rates(&work, out),
            Firing::Spikes if shape.is_few() => few(&work, voltages, refractory, out),
            Firing::Spikes => spikes(&work, voltages, refractory, out),
        }
    }
}

/// One ensemble in the layout of the hot loop.
pub(super) struct Ensemble {
    encoders: Vec<Real>,
    biases: Vec<Real>,
    decoders: Vec<Real>,
    silencing: Real,
    quiet: Real,
}

impl Ensemble {
    /// Lays out one ensemble. `solved` holds the decoders of rates in Hz, one row per neuron. `per_spike` is the rate
    /// that one unit of output stands for: 1 / dt for a spike, 1 for a rate.
    pub(super) fn lay_out(draft: &Draft, solved: &[f64], shape: Shape, per_spike: f64) -> Self {
        let (dims, count, padded) = (shape.dims, shape.neurons, shape.padded());
        let neurons = &draft.neurons;
        let mut encoders = vec![0.0; padded * dims];
        let mut decoders = vec![0.0; padded * shape.outputs];
        // A negative current keeps the padding neurons from ever firing.
        let mut biases = vec![-1.0; padded];
        let mut silencing = 0.0f64;
        for neuron in 0..count {
            let gain = neurons.gains[neuron] / draft.radius;
            for k in 0..dims {
                let encoder = neurons.encoders[neuron * dims + k] * gain;
                encoders[shape.encoder_at(neuron, k)] = encoder as Real;
            }
            biases[neuron] = neurons.biases[neuron] as Real;
            for k in 0..shape.outputs {
                let decoder = solved[neuron * shape.outputs + k] * per_spike;
                decoders[neuron * shape.outputs + k] = decoder as Real;
            }
            silencing = silencing.max(2.0 * (neurons.gains[neuron] + neurons.biases[neuron].abs()));
        }
        // A neuron of gain g and bias b gets at most g |x| / radius + |b| - 2 (g + |b|).
        let quiet = (1.9 * draft.radius).powi(2) as Real;
        Self { encoders, biases, decoders, silencing: silencing as Real, quiet }
    }
}

/// Returns, for each ensemble, the input below which no neuron gets a current above 0.
///
/// It is minus infinity unless the ensemble has one dimension and only positive encoders.
pub(super) fn rests(shape: Shape, encoders: &[Real], biases: &[Real]) -> Vec<Real> {
    let per = shape.padded();
    if shape.dims > 1 {
        return vec![Real::NEG_INFINITY; biases.len() / per];
    }
    let least = |(encoders, biases): (&[Real], &[Real])| {
        let below = |(encoder, bias): (&Real, &Real)| match (*encoder > 0.0, *bias < 0.0) {
            // The input at which the current is 0, less an allowance for rounding.
            (true, _) => -bias / encoder - 1e-3 * (1.0 + (bias / encoder).abs()),
            (false, true) if *encoder == 0.0 => Real::INFINITY,
            _ => Real::NEG_INFINITY,
        };
        encoders.iter().zip(biases).map(below).fold(Real::INFINITY, Real::min)
    };
    encoders.chunks_exact(per).zip(biases.chunks_exact(per)).map(least).collect()
}
