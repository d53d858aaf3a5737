//! The hot loop: banks of small ensembles of equal shape, encoded, stepped and decoded together.
//!
//! A bank's numbers stand as structure of arrays: for each ensemble and each group of 32 neurons (8 in one
//! dimension) the encoders, a row a dimension, scaled by gain and radius, so that encoding reads memory from
//! front to back; then biases, voltages and refractory times, padded with neurons that never fire. Passes
//! over a block compute currents, then voltages and a mask of those that fired. With several outputs only the
//! decoders of these are added up (event-driven); with one output a masked sum costs less than
//! finding them. An ensemble at rest that nothing can wake is passed over, with the same bits.
//!
//! # Where the time goes
//!
//! Per neuron and tick a scalar bank reads 16 bytes (encoder, bias, voltage, refractory time) and writes 8; a
//! bank of d dimensions reads 4 d bytes more of encoders, and 4 d of decoders for the tenth that fires. That is
//! the bound for banks that do not fit the caches: a core of the machine of the figures (a shared EPYC at
//! about 2.4 GHz) reads 40 to 50 GB/s from its last cache and 15 GB/s from memory, both cores 28 GB/s.
//! Measured there: 2.2 to 2.5 ns a neuron and tick in scalar banks of 100,000 neurons (a bare loop over voltages
//! takes 0.5 ns, the reading alone 0.4 to 0.6 ns), 4.6 to 5 ns with sixteen dimensions (1.6 ns of reading from the
//! last cache). Most of it is arithmetic: the decay within a refractory period, and the moment of a spike, which
//! has a division, are computed for every neuron, since a branch for the tenth that fires is
//! mispredicted more dearly; with sixteen dimensions a third is encoding and a fifth waits for the decoders
//! of those that fired. A network of 341,450 neurons no longer fits the caches: its 22 MB of encoders are
//! 0.8 ms a tick at the bandwidth of both cores.

mod loops;
#[cfg(test)]
mod tests;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use self::loops::{Work, rates, spikes};
use super::decode::{self, Points};
use super::model::{Lif, TuningError, refuse};
use super::tuning::Neurons;
use crate::sim::{Real, Seed, Threads};

/// What a bank's neurons send.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Firing {
    /// Spikes.
    Spikes,
    /// Their firing rates.
    Rates,
}

/// The number of ensembles in a bank, and the size of each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Shape {
    pub ensembles: usize,
    /// Neurons of one ensemble.
    pub neurons: usize,
    /// Dimensions of the value that one ensemble represents.
    pub dims: usize,
    /// Numbers decoded from one ensemble.
    pub outputs: usize,
}

/// One ensemble before its decoders are solved.
pub(crate) struct Draft {
    pub neurons: Neurons,
    /// Length of the values that the unit ball stands for.
    pub radius: f64,
    /// In units of the radius; the wanted values are not.
    pub points: Points,
}

/// What the loops need of the model and the clock.
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

/// Many ensembles of equal shape.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Bank {
    pub(super) shape: Shape,
    pub(super) firing: Firing,
    pub(super) encoders: Vec<Real>,
    pub(super) biases: Vec<Real>,
    pub(super) decoders: Vec<Real>,
    /// A current that silences every neuron.
    pub(super) silencing: Real,
    /// Square of the value up to which that current does.
    pub(super) quiet: Real,
    /// For each ensemble the value below which no neuron gets a current above 0. Follows from the rest.
    pub(super) rests: Vec<Real>,
    pub(super) consts: Consts,
}

impl Shape {
    /// Neurons whose encoders stand together, a row a dimension.
    fn lanes(&self) -> usize {
        if self.dims == 1 { NARROW } else { WIDE }
    }

    /// Neurons of one ensemble with those that fill up the last group.
    pub(super) fn padded(&self) -> usize {
        self.neurons.next_multiple_of(self.lanes())
    }

    /// Where the encoder of a neuron for a dimension stands among those of its ensemble.
    fn encoder_at(&self, neuron: usize, dimension: usize) -> usize {
        let lanes = self.lanes();
        (neuron / lanes * self.dims + dimension) * lanes + neuron % lanes
    }
}

/// Numbers in the widest registers that are used.
const NARROW: usize = 8;
/// Neurons that are encoded together where there are several dimensions.
const WIDE: usize = 32;
/// Neurons whose currents are kept at hand.
const BLOCK: usize = 128;

/// The least number of neurons for which a second thread is worth its cost.
const MIN_SHARED_NEURONS: usize = 6_000;

/// The longest tick, in membrane time constants, for which the series of the decay is right to 1e-6.
const MAX_TICK: f64 = 0.25;

impl Bank {
    /// Draws and solves a bank; `draft` makes each ensemble from its number and seed. In parallel over the
    /// ensembles, with the same result whatever the thread count.
    pub fn build(
        lif: &Lif,
        dt_s: f64,
        shape: Shape,
        (firing, regularisation): (Firing, f64),
        seed: Seed,
        draft: impl Fn(usize, Seed) -> Result<Draft, TuningError> + Sync,
    ) -> Result<Self, TuningError> {
        lif.check()?;
        if shape.neurons == 0 || shape.ensembles == 0 || shape.dims == 0 {
            return Err(refuse("neurons", shape.neurons, "at least 1 an ensemble"));
        }
        if dt_s > lif.tau_ref_s && firing == Firing::Spikes {
            let expected = format!("at most the refractory period of {} s", lif.tau_ref_s);
            return Err(refuse("tick", format!("{dt_s} s"), expected));
        }
        if dt_s > MAX_TICK * lif.tau_rc_s {
            let expected = format!("at most {MAX_TICK} of tau_rc, {} s", MAX_TICK * lif.tau_rc_s);
            return Err(refuse("tick", format!("{dt_s} s"), expected));
        }
        if !(regularisation.is_finite() && regularisation > 0.0) {
            return Err(refuse("regularisation", regularisation, "a finite number above 0"));
        }
        let per_spike = if firing == Firing::Spikes { 1.0 / dt_s } else { 1.0 };
        let solved: Vec<Ensemble> = (0..shape.ensembles)
            .into_par_iter()
            .map(|index| {
                let draft = draft(index, seed.derive_index("ensemble", index as u64))?;
                let decoders = decode::solve(lif, &draft.neurons, &draft.points, regularisation)?;
                Ok(Ensemble::lay_out(&draft, &decoders, shape, per_spike))
            })
            .collect::<Result<_, TuningError>>()?;
        Ok(Self::assemble(lif, dt_s, (shape, firing), &solved))
    }

    /// Lays ensembles out one after another.
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
        }
    }

    /// Whether a neuron fired in the tick that left this state: only then more than one refractory
    /// period is left.
    pub fn spiked(&self, state: &[Real], neuron: usize) -> bool {
        let (each, per) = (self.shape.neurons, self.shape.padded());
        let refractory = &state[state.len() / 2..];
        refractory[neuron / each * per + neuron % each] > self.consts.tau_ref
    }

    /// Neurons that spike.
    pub fn spiking(&self) -> usize {
        match self.firing {
            Firing::Spikes => self.shape.ensembles * self.shape.neurons,
            Firing::Rates => 0,
        }
    }

    /// Numbers of state: voltages, then refractory times.
    pub fn state_len(&self) -> usize {
        match self.firing {
            Firing::Spikes => 2 * self.shape.ensembles * self.shape.padded(),
            Firing::Rates => 0,
        }
    }

    /// Whether there are enough neurons for several threads.
    pub fn parallel(&self) -> bool {
        self.shape.ensembles > 1 && self.shape.ensembles * self.shape.padded() > MIN_SHARED_NEURONS
    }

    /// One tick: `values` holds a row an ensemble, and so does `out`; `open` between 0, silenced, and 1.
    pub fn step(
        &self,
        threads: Threads,
        (values, open): (&[Real], Real),
        state: &mut [Real],
        out: &mut [Real],
    ) {
        let shift = -self.silencing * (1.0 - open.clamp(0.0, 1.0));
        let (voltages, refractory) = state.split_at_mut(state.len() / 2);
        let share = threads == Threads::Pool && rayon::current_num_threads() > 1;
        let slice = Slice {
            bank: self,
            first: 0,
            count: self.shape.ensembles,
            values,
            voltages,
            refractory,
            out,
        };
        slice.run(shift, share);
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
    /// From neurons, and decoders a row a neuron, to what each spike (or spike a second) is worth.
    pub(super) fn lay_out(draft: &Draft, solved: &[f64], shape: Shape, per_spike: f64) -> Self {
        let (dims, count, padded) = (shape.dims, shape.neurons, shape.padded());
        let neurons = &draft.neurons;
        let mut encoders = vec![0.0; padded * dims];
        let mut decoders = vec![0.0; padded * shape.outputs];
        // A current that pulls what fills up below rest for ever.
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

/// A range of ensembles with their inputs, state and outputs.
struct Slice<'a> {
    bank: &'a Bank,
    first: usize,
    count: usize,
    values: &'a [Real],
    voltages: &'a mut [Real],
    refractory: &'a mut [Real],
    out: &'a mut [Real],
}

impl Slice<'_> {
    /// Ensembles do not look at one another, so halves give the same bits as the whole.
    fn run(self, shift: Real, share: bool) {
        let (shape, padded) = (self.bank.shape, self.bank.shape.padded());
        if share && self.count > 1 && self.count * padded > MIN_SHARED_NEURONS {
            let half = self.count / 2;
            let (values, more_values) = self.values.split_at(half * shape.dims);
            let (out, more_out) = self.out.split_at_mut(half * shape.outputs);
            let cut = (half * padded).min(self.voltages.len());
            let (voltages, more_voltages) = self.voltages.split_at_mut(cut);
            let (refractory, more_refractory) = self.refractory.split_at_mut(cut);
            let left = Slice { count: half, values, voltages, refractory, out, ..self };
            let right = Slice {
                bank: left.bank,
                first: left.first + half,
                count: self.count - half,
                values: more_values,
                voltages: more_voltages,
                refractory: more_refractory,
                out: more_out,
            };
            rayon::join(|| left.run(shift, share), || right.run(shift, share));
            return;
        }
        let bank = self.bank;
        let at = |per: usize| self.first * per..(self.first + self.count) * per;
        let work = Work {
            consts: bank.consts,
            shape,
            shift,
            quiet: if shift <= -bank.silencing { bank.quiet } else { -1.0 },
            rests: &bank.rests[at(1)],
            encoders: &bank.encoders[at(padded * shape.dims)],
            biases: &bank.biases[at(padded)],
            decoders: &bank.decoders[at(padded * shape.outputs)],
            values: self.values,
        };
        match bank.firing {
            Firing::Rates => rates(&work, self.out),
            Firing::Spikes => spikes(&work, self.voltages, self.refractory, self.out),
        }
    }
}

/// Values below which every neuron of an ensemble stays at rest, if there are any: where there is one
/// dimension and all encoders point upwards.
pub(super) fn rests(shape: Shape, encoders: &[Real], biases: &[Real]) -> Vec<Real> {
    if shape.dims > 1 {
        return vec![Real::NEG_INFINITY; shape.ensembles];
    }
    let per = shape.padded();
    let least = |(encoders, biases): (&[Real], &[Real])| {
        let below = |(encoder, bias): (&Real, &Real)| match (*encoder > 0.0, *bias < 0.0) {
            // A little less than where the current is 0, for the rounding of the current.
            (true, _) => -bias / encoder - 1e-3 * (1.0 + (bias / encoder).abs()),
            (false, true) if *encoder == 0.0 => Real::INFINITY,
            _ => Real::NEG_INFINITY,
        };
        encoders.iter().zip(biases).map(below).fold(Real::INFINITY, Real::min)
    };
    encoders.chunks_exact(per).zip(biases.chunks_exact(per)).map(least).collect()
}
