//! Probes: recordings of an output that never feed back into the graph.

use std::marker::PhantomData;

use super::kind::Kind;
use super::node::Real;
use super::synapse::Synapse;
use super::time::SimDuration;

/// How many samples a probe keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Capacity {
    /// Every sample.
    #[default]
    All,
    /// The latest samples, this many.
    Last(usize),
}

/// What a probe records.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ProbeSpec {
    /// Time between samples; zero means every tick.
    pub period: SimDuration,
    /// A filter of the probe's own, run in every tick.
    pub filter: Synapse,
    /// How many samples to keep.
    pub capacity: Capacity,
}

impl ProbeSpec {
    /// Every sample, unfiltered, one every `period`.
    pub fn every(period: SimDuration) -> Self {
        Self { period, ..Self::default() }
    }

    /// Adds a low-pass of the probe's own.
    pub fn filtered(mut self, filter: Synapse) -> Self {
        self.filter = filter;
        self
    }

    /// Keeps the latest `samples` only.
    pub fn last(mut self, samples: usize) -> Self {
        self.capacity = Capacity::Last(samples);
        self
    }
}

/// A handle to a probe on an output of kind `K`.
pub struct ProbeId<K: Kind> {
    pub(crate) index: usize,
    pub(crate) builder: u64,
    pub(crate) kind: PhantomData<fn() -> K>,
}

impl<K: Kind> Clone for ProbeId<K> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<K: Kind> Copy for ProbeId<K> {}

impl<K: Kind> std::fmt::Debug for ProbeId<K> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "ProbeId<{}>({})", K::label(), self.index)
    }
}

/// The stored samples of one probe.
#[derive(Debug, Clone, Default)]
pub(crate) struct Recording {
    pub ticks: Vec<u64>,
    pub values: Vec<Real>,
    /// Index of the oldest sample once a ring is full.
    pub head: usize,
}

impl Recording {
    pub fn clear(&mut self) {
        self.ticks.clear();
        self.values.clear();
        self.head = 0;
    }

    /// Stores a sample; storage was reserved before, so this never allocates.
    pub fn push(&mut self, end_tick: u64, value: &[Real], capacity: Capacity) {
        match capacity {
            Capacity::Last(most) if self.ticks.len() >= most => {
                let at = self.head * value.len();
                self.ticks[self.head] = end_tick;
                self.values[at..at + value.len()].copy_from_slice(value);
                self.head = (self.head + 1) % most;
            }
            _ => {
                self.ticks.push(end_tick);
                self.values.extend_from_slice(value);
            }
        }
    }
}

/// The samples of a probe, oldest first.
pub struct Samples<'a, K: Kind> {
    pub(crate) recording: &'a Recording,
    pub(crate) width: usize,
    pub(crate) dt_s: f64,
    pub(crate) kind: PhantomData<fn() -> K>,
}

impl<K: Kind> Clone for Samples<'_, K> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<K: Kind> Copy for Samples<'_, K> {}

impl<K: Kind> std::fmt::Debug for Samples<'_, K> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Samples<{}>({} of width {})", K::label(), self.len(), self.width)
    }
}

impl<'a, K: Kind> Samples<'a, K> {
    /// How many samples there are.
    pub fn len(&self) -> usize {
        self.recording.ticks.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Numbers per sample.
    pub fn width(&self) -> usize {
        self.width
    }

    /// The `index`-th sample, oldest first: simulated seconds at the end of its tick, and values.
    pub fn get(&self, index: usize) -> Option<(f64, K::Value<'a>)> {
        let len = self.len();
        if index >= len {
            return None;
        }
        let at = (self.recording.head + index) % len;
        let time = self.recording.ticks[at] as f64 * self.dt_s;
        let numbers = &self.recording.values[at * self.width..(at + 1) * self.width];
        Some((time, K::value(numbers)))
    }

    /// The newest sample.
    pub fn last(&self) -> Option<(f64, K::Value<'a>)> {
        self.len().checked_sub(1).and_then(|i| self.get(i))
    }

    /// All samples, oldest first.
    pub fn iter(&self) -> impl Iterator<Item = (f64, K::Value<'a>)> + use<'a, K> {
        let this = *self;
        (0..self.len()).filter_map(move |i| this.get(i))
    }
}
