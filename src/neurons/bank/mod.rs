//! Banks: many small ensembles of equal shape that are encoded, stepped and decoded together.
//!
//! # Memory layout
//!
//! A bank is a structure of arrays. The array of encoders, each times gain / radius, is ordered by ensemble, then by
//! group of 32 neurons (8 if the ensemble has one dimension), then by dimension. Encoding therefore reads memory from
//! front to back. Of encoders that are rows of Hadamard matrices the array has one number per neuron (`hadamard.rs`).
//! Biases have one array. The state is cut into the blocks in which neurons are stepped; a block holds
//! the first variable of its neurons (of spiking neurons the voltages), then the second, and so on. Neurons without
//! effect pad every ensemble to whole groups. Ensembles of 1 to 4 neurons with one dimension and one output are not
//! padded: they stand side by side, and a block holds the neurons of eight ensembles (`few.rs`).
//!
//! # Passes
//!
//! One pass computes currents. A second pass, by the neuron model, computes the activity of one block of neurons after
//! another. A third pass decodes (`decode.rs`). With several outputs it adds only the decoders of the neurons that are
//! active (event-driven), of up to seven blocks at once: the rows are scattered over memory, and reads that do not wait
//! for one another take little longer than one. With one output it adds all decoders times the activity,
//! which costs less than finding the neurons that are active. The loop skips resting ensembles that their input cannot wake.
//! Skipping does not change the bits.
//!
//! # Memory traffic
//!
//! Per neuron and tick, a scalar bank reads 16 bytes (encoder, bias, voltage, refractory time) and writes 8. A bank of
//! d dimensions reads 4 d bytes of encoders instead of 4 (but 4 for Hadamard encoders), and 4 d bytes of decoders for
//! each neuron that fires (about one in ten). This traffic limits the speed of banks that do not fit the caches.
//!
//! # Time
//!
//! `docs/speed.md` has the measured times, and how far they are from what a machine can do. In one dimension most of the
//! time is arithmetic. The decay within a refractory period and the moment of a spike (a division) are computed for
//! every neuron: a branch for the tenth of the neurons that fires would often be mispredicted and cost more. In sixteen
//! dimensions most of it is memory: encoders, and the decoders of the neurons that fired.

mod decode;
mod few;
pub(super) mod hadamard;
mod loops;
mod partition;
#[cfg(test)]
mod pass_tests;
mod shape;
#[cfg(test)]
mod tests;
pub(super) mod work;

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use super::draw::Neurons;
use super::models::{Firing, NeuronModel, Start, Variable};
use super::solve::{self, Points, Special};
use super::tuning::{TuningError, refuse};
use super::turn::{Turn, origin};
use crate::sim::{Real, Seed};

pub use partition::Ensembles;
pub(crate) use partition::{LoadBalance, Partition};
use shape::NARROW;
pub(crate) use shape::Shape;
pub use work::Work;

/// One ensemble before its decoders are solved.
pub(crate) struct Draft {
    pub neurons: Neurons,
    /// Radius: greatest norm of a represented value. Division by the radius maps values to the unit ball.
    pub radius: f64,
    /// Evaluation points, in units of the radius. The target values are not divided by the radius.
    pub points: Points,
}

/// The numbers of a bank that were drawn and solved for.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Solved {
    pub shape: Shape,
    /// Hash of everything that determines the other numbers.
    pub fingerprint: u64,
    pub encoders: Vec<Real>,
    pub biases: Vec<Real>,
    pub decoders: Vec<Real>,
    /// Magnitude of the negative current that silences every neuron.
    pub silencing: Real,
    /// The silencing current silences every neuron for inputs of at most this squared norm.
    pub quiet: Real,
    /// The ensembles that the other fields hold, in rising order; `None` for all. The others belong to other ranks.
    pub own: Option<Vec<usize>>,
}

/// What a bank is solved from, besides its drafts.
pub(crate) struct Recipe<'a> {
    pub model: &'a dyn NeuronModel,
    pub dt_s: f64,
    pub shape: Shape,
    pub regularisation: f64,
    pub seed: Seed,
    pub fingerprint: u64,
    /// The ensembles to solve for; `None` for all.
    pub own: Option<Vec<usize>>,
    /// Outputs with points or a solver of their own.
    pub special: &'a [Special],
    /// So many ensembles are drawn and solved for. The others are these, turned.
    pub distinct: usize,
}

#[cfg(test)]
impl<'a> Recipe<'a> {
    /// A recipe of the default regularisation and a fixed seed.
    pub fn of(model: &'a dyn NeuronModel, dt_s: f64, shape: Shape) -> Self {
        let (seed, fingerprint, own) = (Seed::new(1), 0, None);
        let (regularisation, special, distinct) = (0.1, &[][..], usize::MAX);
        Self { model, dt_s, shape, regularisation, seed, fingerprint, own, special, distinct }
    }
}

/// Returns the seed of an ensemble, from that of its bank.
pub(crate) fn ensemble_seed(bank: Seed, ensemble: usize) -> Seed {
    bank.derive_index("ensemble", ensemble as u64)
}

impl Recipe<'_> {
    /// Draws the neurons of a bank and solves for their decoders.
    ///
    /// `draft` makes one ensemble from its index and seed. Ensembles are solved in parallel; the result does not
    /// depend on the number of threads. An ensemble does not depend on the others, but for the one that it is a turned
    /// copy of.
    pub fn solve(
        self,
        draft: impl Fn(usize, Seed) -> Result<Draft, TuningError> + Sync,
    ) -> Result<Solved, TuningError> {
        let Self { model, shape, seed, .. } = self;
        if shape.neurons == 0 || shape.ensembles == 0 || shape.dims == 0 {
            return Err(refuse("neurons", shape.neurons, "at least 1 per ensemble"));
        }
        let all = || (0..shape.ensembles).collect();
        let solve = |index: usize| {
            let seed = ensemble_seed(seed, index);
            let draft = draft(index, seed)?;
            let (neurons, special) = ((model, &draft.neurons), self.special);
            let decoders =
                solve::solve_all(neurons, &draft.points, self.regularisation, special, seed)?;
            Ok((draft, decoders))
        };
        let lay_out = |neurons: &Neurons, radius: f64, decoders: &[f64]| {
            LaidOut::lay_out((neurons, radius), decoders, (model, self.dt_s), shape).checked()
        };
        let (distinct, own) = (self.distinct, self.own.clone().unwrap_or_else(all));
        // None is kept where each ensemble is its own.
        let mut origins: Vec<usize> = own.iter().map(|index| origin(*index, distinct)).collect();
        origins.retain(|_| distinct < shape.ensembles);
        origins.sort_unstable();
        origins.dedup();
        let origins: BTreeMap<usize, (Draft, Vec<f64>)> = origins
            .into_par_iter()
            .map(|index| Ok((index, solve(index)?)))
            .collect::<Result<_, TuningError>>()?;
        let solved: Vec<LaidOut> = own
            .into_par_iter()
            .map(|index| {
                let Some((draft, decoders)) = origins.get(&origin(index, distinct)) else {
                    let (draft, decoders) = solve(index)?;
                    return lay_out(&draft.neurons, draft.radius, &decoders);
                };
                if index == origin(index, distinct) {
                    return lay_out(&draft.neurons, draft.radius, decoders);
                }
                let turn = Turn::of(ensemble_seed(seed, index), shape.dims);
                lay_out(&turn.neurons(&draft.neurons), draft.radius, &turn.vectors(decoders))
            })
            .collect::<Result<_, TuningError>>()?;
        Ok(Solved {
            own: self.own,
            fingerprint: self.fingerprint,
            ..Solved::assemble(shape, &solved)
        })
    }
}

impl Solved {
    /// Returns a copy that holds only the ensembles in `own`.
    pub fn only(&self, own: Vec<usize>) -> Self {
        let per = self.shape.padded();
        let pick = |of: &[Real], each: usize| -> Vec<Real> {
            own.iter().flat_map(|ensemble| &of[ensemble * each..][..each]).copied().collect()
        };
        Self {
            encoders: pick(&self.encoders, per * self.shape.columns()),
            biases: pick(&self.biases, per),
            decoders: pick(&self.decoders, per * self.shape.outputs),
            own: Some(own),
            ..*self
        }
    }

    /// Joins the ensembles' arrays, one ensemble after another.
    pub fn assemble(shape: Shape, solved: &[LaidOut]) -> Self {
        let join = |part: fn(&LaidOut) -> &Vec<Real>| -> Vec<Real> {
            solved.iter().flat_map(|e| part(e).iter().copied()).collect()
        };
        Self {
            shape,
            fingerprint: 0,
            encoders: join(|e| &e.encoders),
            biases: join(|e| &e.biases),
            decoders: join(|e| &e.decoders),
            silencing: solved.iter().map(|e| e.silencing).fold(0.0, Real::max),
            quiet: solved.iter().map(|e| e.quiet).fold(Real::MAX, Real::min),
            own: None,
        }
    }

    /// Returns, for each ensemble, the input below which no neuron gets a current above `level`.
    ///
    /// It is minus infinity unless the ensemble has one dimension and only positive encoders.
    fn rests(&self, level: Real) -> Vec<Real> {
        let per = self.shape.padded();
        if self.shape.dims > 1 || level == Real::NEG_INFINITY {
            return vec![Real::NEG_INFINITY; self.biases.len() / per];
        }
        let least = |(encoders, biases): (&[Real], &[Real])| {
            let below = |(encoder, bias): (&Real, &Real)| {
                let at = (level - bias) / encoder;
                match (*encoder > 0.0, *bias < level) {
                    // The input at which the current is `level`, less an allowance for rounding.
                    (true, _) => at - 1e-3 * (1.0 + at.abs()),
                    (false, true) if *encoder == 0.0 => Real::INFINITY,
                    _ => Real::NEG_INFINITY,
                }
            };
            encoders.iter().zip(biases).map(below).fold(Real::INFINITY, Real::min)
        };
        self.encoders.chunks_exact(per).zip(self.biases.chunks_exact(per)).map(least).collect()
    }
}

/// Ensembles of equal shape: their numbers, and the model by which they are stepped.
#[derive(Debug, Clone)]
pub(crate) struct Bank {
    pub solved: Arc<Solved>,
    pub model: Arc<dyn NeuronModel>,
    pub dt_s: f64,
    firing: Firing,
    variables: Vec<Variable>,
    /// For each ensemble, the input below which no neuron leaves its rest.
    rests: Vec<Real>,
    /// As in [`Solved`], or greater if the banks of other ranks need more.
    pub silencing: Real,
    /// As in [`Solved`], or less if the banks of other ranks bear less.
    pub quiet: Real,
}

impl Bank {
    pub fn new(solved: Arc<Solved>, model: Arc<dyn NeuronModel>, dt_s: f64) -> Self {
        let level = model.rest_below() as Real;
        Self {
            dt_s,
            firing: model.firing(),
            variables: model.state(),
            rests: solved.rests(level),
            silencing: solved.silencing,
            quiet: if level == Real::NEG_INFINITY { -1.0 } else { solved.quiet },
            model,
            solved,
        }
    }

    pub fn shape(&self) -> Shape {
        self.solved.shape
    }

    /// Sets the start of a variable, if the model has it.
    pub fn start(&mut self, name: &str, start: Start) {
        for variable in self.variables.iter_mut().filter(|variable| variable.name == name) {
            variable.start = start;
        }
    }

    /// Returns whether some current silences every neuron, so that a gate can close.
    pub fn falls_silent(&self) -> bool {
        self.quiet >= 0.0
    }

    /// Writes the states of all parts at the start of a run. `parts` are their places in `state`, one after another.
    /// The values do not depend on the parts.
    pub fn init(&self, state: &mut [Real], parts: impl Iterator<Item = Range<usize>> + Clone) {
        let (shape, count) = (self.shape(), self.variables.len());
        for (index, variable) in self.variables.iter().enumerate() {
            let mut rng = Seed::new(self.solved.fingerprint).derive("", variable.name).rng();
            for part in parts.clone() {
                let own = &mut state[part];
                for block in shape.blocks(own.len() / count / shape.padded()) {
                    let of_block = &mut own[block.start * count + index * block.len()..];
                    of_block[..block.len()].fill_with(|| variable.start.draw(&mut rng));
                }
            }
        }
    }

    /// Returns whether a neuron of a range of ensembles fired in the tick that left this state of the range.
    pub fn spiked(&self, state: &[Real], neuron: usize) -> bool {
        let Firing::Spikes { trace, above } = self.firing else { return false };
        self.variable(trace, state, neuron) > above
    }

    /// Returns a variable of a neuron of a range of ensembles, from the state of the range.
    pub fn variable(&self, index: usize, state: &[Real], neuron: usize) -> Real {
        let (shape, count) = (self.shape(), self.variables.len());
        let neuron = neuron / shape.neurons * shape.padded() + neuron % shape.neurons;
        let block = shape.block(state.len() / count / shape.padded(), neuron);
        state[block.start * count + index * block.len() + neuron - block.start]
    }

    /// Number of neurons that spike in so many ensembles: all of them, or none if their activity is a rate.
    pub fn spiking_of(&self, ensembles: usize) -> usize {
        match self.firing {
            Firing::Spikes { .. } => ensembles * self.shape().neurons,
            Firing::Rates => 0,
        }
    }

    /// Length of the state of so many ensembles.
    pub fn state_of(&self, ensembles: usize) -> usize {
        self.variables.len() * ensembles * self.shape().padded()
    }

    /// Steps the ensembles from `first` on by one tick. This process must own them.
    ///
    /// `values` and `out` have one row per ensemble. `open` is the gate: 0 silences every neuron, 1 has no effect.
    /// `draws` is the key of the random numbers. Ensembles are independent, so several calls for parts of a bank give the
    /// same bits as one call for all.
    ///
    /// `injected` are currents added to the neurons, a row per ensemble; it may be empty. If `out` is longer than the
    /// decoded values, the activity of every neuron follows them, in Hz.
    pub fn step_injected(
        &self,
        (draws, first): (u64, usize),
        (values, open): (&[Real], Real),
        injected: &[Real],
        state: &mut [Real],
        out: &mut [Real],
    ) {
        let (solved, shape, padded) = (&*self.solved, self.shape(), self.shape().padded());
        let shift = -self.silencing * (1.0 - open.clamp(0.0, 1.0));
        let draws = (draws, first);
        let first = match &solved.own {
            None => first,
            Some(own) => own.partition_point(|ensemble| *ensemble < first),
        };
        let count = values.len() / shape.dims;
        let at = |per: usize| first * per..(first + count) * per;
        let work = Work {
            dt_s: self.dt_s as Real,
            shape,
            variables: self.variables.len(),
            unit_hz: if self.firing == Firing::Rates { 1.0 } else { (1.0 / self.dt_s) as Real },
            shift,
            quiet: if shift <= -self.silencing { self.quiet } else { -1.0 },
            rests: &self.rests[at(1)],
            encoders: &solved.encoders[at(padded * shape.columns())],
            biases: &solved.biases[at(padded)],
            decoders: &solved.decoders[at(padded * shape.outputs)],
            values,
            injected,
            draws,
        };
        self.model.step_ensembles(&work, state, out);
    }

    /// Steps without random numbers and injected currents.
    #[cfg(test)]
    pub fn step(
        &self,
        first: usize,
        values: (&[Real], Real),
        state: &mut [Real],
        out: &mut [Real],
    ) {
        self.step_injected((0, first), values, &[], state, out);
    }
}

/// One ensemble in the layout of the hot loop.
pub(crate) struct LaidOut {
    encoders: Vec<Real>,
    biases: Vec<Real>,
    decoders: Vec<Real>,
    silencing: Real,
    quiet: Real,
}

impl LaidOut {
    /// Lays out one ensemble. `solved` holds the decoders of rates in Hz, one row per neuron.
    pub fn lay_out(
        (neurons, radius): (&Neurons, f64),
        solved: &[f64],
        (model, dt_s): (&dyn NeuronModel, f64),
        shape: Shape,
    ) -> Self {
        let (dims, count, padded) = (shape.dims, shape.neurons, shape.padded());
        // The rate that one unit of activity stands for.
        let unit = if model.firing() == Firing::Rates { 1.0 } else { 1.0 / dt_s };
        let level = Some(model.rest_below()).filter(|level| level.is_finite()).unwrap_or(0.0);
        let gains: Vec<f64> = neurons.gains.iter().map(|gain| gain / radius).collect();
        let encoders = if shape.hadamard {
            hadamard::lay_out(&shape, &gains, &neurons.encoders)
        } else {
            let mut encoders = vec![0.0; padded * dims];
            for (neuron, gain) in gains.iter().enumerate() {
                for k in 0..dims {
                    let encoder = neurons.encoders[neuron * dims + k] * gain;
                    encoders[shape.encoder_at(neuron, k)] = encoder as Real;
                }
            }
            encoders
        };
        let mut decoders = vec![0.0; padded * shape.outputs];
        // Such a current keeps the padding neurons from ever firing.
        let mut biases = vec![level.min(0.0) as Real - 1.0; padded];
        let mut silencing = 0.0f64;
        for neuron in 0..count {
            biases[neuron] = neurons.biases[neuron] as Real;
            for k in 0..shape.outputs {
                let decoder = solved[neuron * shape.outputs + k] * unit;
                decoders[neuron * shape.outputs + k] = decoder as Real;
            }
            let row = &neurons.encoders[neuron * dims..][..dims];
            let length = row.iter().map(|x| x * x).sum::<f64>().sqrt();
            // Directions have length 1 but for rounding.
            let length = if length > 1.000_001 { length } else { 1.0 };
            let most = neurons.gains[neuron].abs() * length + neurons.biases[neuron].abs();
            silencing = silencing.max(2.0 * most - level.min(0.0));
        }
        // A neuron of gain g and bias b gets at most g |x| / radius + |b| - 2 (g + |b|) + level, if level is below 0.
        let quiet = (1.9 * radius).powi(2) as Real;
        Self { encoders, biases, decoders, silencing: silencing as Real, quiet }
    }

    /// Refuses numbers beyond single precision, and those that are none.
    fn checked(self) -> Result<Self, TuningError> {
        let all =
            [("encoders", &self.encoders), ("biases", &self.biases), ("decoders", &self.decoders)];
        for (name, numbers) in all {
            if let Some(wrong) = numbers.iter().find(|number| !number.is_finite()) {
                let expected = "numbers in the range of single precision: \
                                use a radius, gains and values of functions nearer to 1";
                return Err(refuse(name, wrong, expected));
            }
        }
        Ok(self)
    }
}
