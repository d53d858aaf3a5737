//! Recordings of spikes: one bit per neuron and tick.

use crate::sim::build::graph::PartPlan;
use crate::sim::describe::io::StateRef;
use crate::sim::describe::node::Node;
use crate::sim::real::Real;

/// The stored spikes of one layer.
#[derive(Debug, Clone, Default)]
pub(crate) struct SpikeRecording {
    /// Number of neurons.
    pub units: usize,
    /// Ticks that were recorded.
    pub ticks: Vec<u64>,
    /// One bit per neuron, in whole words per tick.
    pub bits: Vec<u64>,
}

impl SpikeRecording {
    /// Number of words per tick.
    pub fn words(&self) -> usize {
        self.units.div_ceil(64)
    }

    pub fn clear(&mut self) {
        self.ticks.clear();
        self.bits.clear();
    }

    /// Deletes the spikes of ticks that end after `end_tick`.
    pub fn cut(&mut self, end_tick: u64) {
        let left = self.ticks.partition_point(|tick| *tick <= end_tick);
        self.bits.truncate(left * self.words());
        self.ticks.truncate(left);
    }

    /// Stores a tick without spikes. Memory was reserved before.
    pub fn push_none(&mut self, end_tick: u64) {
        self.ticks.push(end_tick);
        self.bits.resize(self.bits.len() + self.words(), 0);
    }

    /// Stores the spikes of a tick. Memory was reserved before, so this never allocates.
    pub fn push(&mut self, end_tick: u64, body: &dyn Node, state: &StateRef<'_>) {
        self.ticks.push(end_tick);
        for word in 0..self.words() {
            let units = 64 * word..self.units.min(64 * (word + 1));
            let bit = |unit: usize| u64::from(body.event(state, unit)) << (unit % 64);
            self.bits.push(units.map(bit).fold(0, |bits, bit| bits | bit));
        }
    }

    /// Stores the spikes of a tick from the results of a node's parts. Memory was reserved before.
    pub fn push_parts(&mut self, end_tick: u64, parts: &[PartPlan], results: &[Real]) {
        self.ticks.push(end_tick);
        let row = self.bits.len();
        self.bits.resize(row + self.words(), 0);
        for part in parts {
            let words = &results[part.results.of()][part.own_results()..];
            for (word, bits) in words.iter().enumerate() {
                let mut bits = u64::from(bits.to_bits());
                while bits != 0 {
                    let unit =
                        part.units.start as usize + 32 * word + bits.trailing_zeros() as usize;
                    self.bits[row + unit / 64] |= 1 << (unit % 64);
                    bits &= bits - 1;
                }
            }
        }
    }
}

/// The recorded spikes of one layer.
#[derive(Debug, Clone, Copy)]
pub struct Spikes<'a> {
    pub(crate) recording: &'a SpikeRecording,
    pub(crate) dt_s: f64,
}

impl<'a> Spikes<'a> {
    /// Returns the number of neurons: 0 in direct and rate mode.
    pub fn neurons(&self) -> usize {
        self.recording.units
    }

    /// Returns all spikes by time: the simulated time in seconds at the end of the tick, and the index of the neuron.
    pub fn iter(&self) -> impl Iterator<Item = (f64, usize)> + use<'a> {
        let Self { recording, dt_s } = *self;
        let words = recording.words().max(1);
        let rows = recording.ticks.iter().zip(recording.bits.chunks_exact(words));
        rows.flat_map(move |(tick, row)| {
            let set = move |neuron: &usize| row[neuron / 64] >> (neuron % 64) & 1 == 1;
            (0..recording.units).filter(set).map(move |neuron| (*tick as f64 * dt_s, neuron))
        })
    }

    /// Returns the number of spikes.
    pub fn count(&self) -> usize {
        self.recording.bits.iter().map(|word| word.count_ones() as usize).sum()
    }

    /// Returns the mean rate of all neurons in Hz; 0 if nothing was recorded.
    pub fn mean_rate_hz(&self) -> f64 {
        let seconds = self.recording.ticks.len() as f64 * self.dt_s * self.neurons() as f64;
        if seconds > 0.0 { self.count() as f64 / seconds } else { 0.0 }
    }
}
