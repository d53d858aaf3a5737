//! The samples of probes.

use std::marker::PhantomData;

use crate::sim::describe::kind::Kind;
use crate::sim::describe::probe_spec::Capacity;
use crate::sim::real::Real;

/// The stored samples of one probe.
#[derive(Debug, Clone, Default)]
pub(crate) struct Recording {
    pub ticks: Vec<u64>,
    pub values: Vec<Real>,
    /// Index of the oldest sample, 0 until the capacity is reached.
    pub head: usize,
}

impl Recording {
    pub fn clear(&mut self) {
        self.ticks.clear();
        self.values.clear();
        self.head = 0;
    }

    /// Deletes the samples of ticks that end after `end_tick`.
    pub fn cut(&mut self, end_tick: u64) {
        let width = self.values.len() / self.ticks.len().max(1);
        self.ticks.rotate_left(self.head);
        self.values.rotate_left(self.head * width);
        self.head = 0;
        let left = self.ticks.partition_point(|tick| *tick <= end_tick);
        self.ticks.truncate(left);
        self.values.truncate(left * width);
    }

    /// Stores a sample. Memory was reserved before, so this never allocates.
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
    /// Returns the number of samples.
    pub fn len(&self) -> usize {
        self.recording.ticks.len()
    }

    /// Returns whether there are no samples.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the number of values per sample.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Returns sample number `index`, counted from the oldest: the simulated time in seconds at the end of the sample's
    /// tick, and the value. Returns `None` if there are fewer samples.
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

    /// Returns the latest sample, as [`get`](Self::get) does.
    pub fn last(&self) -> Option<(f64, K::Value<'a>)> {
        self.len().checked_sub(1).and_then(|i| self.get(i))
    }

    /// Returns all samples, oldest first, each as [`get`](Self::get) does.
    pub fn iter(&self) -> impl Iterator<Item = (f64, K::Value<'a>)> + use<'a, K> {
        let this = *self;
        (0..self.len()).filter_map(move |i| this.get(i))
    }
}
