//! Probes: recordings of outputs. They do not affect the graph.

use std::marker::PhantomData;

use super::kind::Kind;
use super::synapse::Synapse;
use crate::sim::time::SimDuration;

/// The number of samples that a probe keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Capacity {
    /// All samples.
    #[default]
    All,
    /// The given number of latest samples, at least 1.
    Last(usize),
}

/// The settings of a probe. The default records the unfiltered value in every tick and keeps all samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ProbeSpec {
    /// Simulated time between samples, a whole number of ticks. Zero means one sample per tick.
    pub period: SimDuration,
    /// Filter in front of the probe, updated in every tick. The sample of a tick includes the value of that tick; the same
    /// synapse on a connection hands it on one tick later.
    pub filter: Synapse,
    /// Number of samples to keep.
    pub capacity: Capacity,
}

impl ProbeSpec {
    /// Records one sample every `period`, unfiltered, and keeps all samples.
    pub fn every(period: SimDuration) -> Self {
        Self { period, ..Self::default() }
    }

    /// Filters the value before it is sampled, without the tick that a connection adds.
    pub fn filtered(mut self, filter: Synapse) -> Self {
        self.filter = filter;
        self
    }

    /// Keeps only the latest `samples` samples, at least 1.
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

/// A handle to a recording of the spikes of one layer.
#[derive(Debug, Clone, Copy)]
pub struct SpikeProbe {
    pub(crate) index: usize,
    pub(crate) builder: u64,
}
