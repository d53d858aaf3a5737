//! Probes: recordings of outputs. They do not affect the graph.

use std::marker::PhantomData;

use std::any::TypeId;
use std::cmp::Reverse;

use super::draft::NodeDraft;
use super::error::BuildError;
use super::kind::Kind;
use super::node::Real;
use super::synapse::Synapse;
use super::time::SimDuration;

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
    /// Filter in front of the probe, updated in every tick.
    pub filter: Synapse,
    /// Number of samples to keep.
    pub capacity: Capacity,
}

impl ProbeSpec {
    /// Records one sample every `period`, unfiltered, and keeps all samples.
    pub fn every(period: SimDuration) -> Self {
        Self { period, ..Self::default() }
    }

    /// Filters the value before it is sampled.
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

/// Returns how many characters two names have in common at their beginnings and ends, to put likely choices first.
pub(crate) fn in_common(a: &str, b: &str) -> usize {
    let same = |(a, b): &(u8, u8)| a == b;
    let start = a.bytes().zip(b.bytes()).take_while(same).count();
    let end = a.bytes().rev().zip(b.bytes().rev()).take_while(same).count();
    (start + end).min(a.len()).min(b.len())
}

/// Finds the output of kind `K` with a name that [`probe_at`](super::GraphBuilder::probe_at) accepts: indices of node and
/// port.
pub(crate) fn find<K: Kind>(nodes: &[NodeDraft], name: &str) -> Result<(usize, usize), BuildError> {
    let of_module = format!("{name}.output");
    let (path, port) = name.rsplit_once('.').unwrap_or((name, "out"));
    let mut all = Vec::new();
    for (index, node) in nodes.iter().enumerate() {
        for (output, declared) in node.ports.outputs.iter().enumerate() {
            let exposed = declared.exposed.as_deref();
            let called = node.path == path && declared.name == port
                || declared.is_exposed_as(name)
                || declared.is_exposed_as(&of_module);
            if called && declared.spec.kind == TypeId::of::<K>() {
                return Ok((index, output));
            }
            let full = format!("{}.{}", node.path, declared.name);
            let label = &declared.spec.kind_label;
            let shown = exposed.unwrap_or(&full);
            all.push((Reverse((called, in_common(shown, name))), format!("{shown}: {label}")));
        }
    }
    all.sort();
    let choices = all.into_iter().map(|(_, choice)| choice).collect();
    Err(BuildError::UnknownOutput { asked: name.into(), kind: K::label(), choices })
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
    /// Index of the oldest sample, 0 until the capacity is reached.
    pub head: usize,
}

impl Recording {
    pub fn clear(&mut self) {
        self.ticks.clear();
        self.values.clear();
        self.head = 0;
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
