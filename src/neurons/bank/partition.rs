//! Banks in parts: the ensembles that are stepped together, and the rank that owns them.

use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use super::{Bank, Draft, Shape};
use crate::neurons::built::Origin;
use crate::neurons::tuning::TuningError;
use crate::sim::{PartSpec, Ranks, Real};

/// Work of one part: about six microseconds per tick. That is little enough to share a bank evenly, and so long that the
/// call of a part costs under a hundredth of it.
const PART: usize = 3_000;

/// Assigns parts to ranks: each to the rank with the least work so far.
pub(crate) struct LoadBalance {
    rank: u32,
    work: Mutex<Vec<u64>>,
}

impl LoadBalance {
    pub fn new(ranks: Option<&Ranks>) -> Self {
        let (rank, ranks) = ranks.map_or((0, 1), |ranks| (ranks.rank(), ranks.ranks()));
        Self { rank: rank as u32, work: Mutex::new(vec![0; ranks]) }
    }

    /// Returns the owner of the next part, of so much work: for parts of one dimension, their number of neurons.
    pub fn owner(&self, work: usize) -> u32 {
        let mut all = self.work.lock().unwrap_or_else(PoisonError::into_inner);
        let least = (0..all.len()).min_by_key(|rank| all[*rank]).unwrap_or(0);
        all[least] += work as u64;
        least as u32
    }

    /// Cuts a bank into parts of a multiple of `unit` ensembles, and assigns them.
    pub fn partition(&self, shape: Shape, unit: usize) -> Partition {
        let unit = unit.max(1);
        let mut together = unit;
        while !together.is_multiple_of(shape.group()) {
            together += unit;
        }
        let each = (PART / work(shape, 1)).max(1).next_multiple_of(together);
        let parts = shape.ensembles.div_ceil(each);
        let of = |part: usize| each.min(shape.ensembles - part * each);
        let owners = (0..parts).map(|part| self.owner(work(shape, of(part)))).collect();
        Partition { each, owners, rank: self.rank }
    }

    /// Keeps a bank in one part.
    pub fn whole(&self, shape: Shape, owner: u32) -> Partition {
        Partition { each: shape.ensembles, owners: vec![owner], rank: self.rank }
    }
}

/// How a bank is cut into parts.
#[derive(Debug, Clone)]
pub(crate) struct Partition {
    /// Number of ensembles in every part but the last.
    each: usize,
    /// The rank that owns each part.
    owners: Vec<u32>,
    /// Rank of this process.
    rank: u32,
}

impl Partition {
    /// Returns which ensembles this process owns; `None` if it owns all.
    pub fn own(&self, ensembles: usize) -> Option<Vec<usize>> {
        if self.owners.iter().all(|owner| *owner == self.rank) {
            return None;
        }
        let own = |ensemble: &usize| self.owners[ensemble / self.each] == self.rank;
        Some((0..ensembles).filter(own).collect())
    }
}

/// Work of `ensembles` ensembles in one tick, as measured (see the module `bank`): a neuron of sixteen dimensions costs
/// about twice as much as one of a single dimension.
fn work(shape: Shape, ensembles: usize) -> usize {
    (ensembles * shape.padded() * (14 + shape.dims)).div_ceil(15)
}

/// Ensembles of neurons of equal shape, which are advanced in parts.
/// [`PopulationBuilder`](crate::neurons::PopulationBuilder) makes them.
#[derive(Debug, Clone)]
pub struct Ensembles {
    pub(crate) bank: Bank,
    pub(crate) partition: Partition,
    /// What they were made from, to be read back.
    pub(crate) origin: Arc<Origin>,
}

impl Ensembles {
    /// Number of parts.
    pub(crate) fn count(&self) -> usize {
        self.partition.owners.len()
    }

    /// Returns the ensembles of a part.
    pub(crate) fn ensembles(&self, part: usize) -> Range<usize> {
        let start = part * self.partition.each;
        start..(start + self.partition.each).min(self.bank.shape().ensembles)
    }

    /// Returns the sizes of a part, without results.
    pub(crate) fn spec(&self, part: usize) -> PartSpec {
        let (shape, ensembles) = (self.bank.shape(), self.ensembles(part).len());
        PartSpec {
            state: self.bank.state_of(ensembles),
            results: 0,
            units: self.bank.spiking_of(ensembles),
            work: work(shape, ensembles),
            rank: self.partition.owners[part] as usize,
        }
    }

    /// Returns the gain over the radius of every neuron, ensemble by ensemble.
    pub(crate) fn gains(&self) -> Result<Vec<Real>, TuningError> {
        let mut gains = Vec::new();
        for ensemble in 0..self.bank.shape().ensembles {
            let Draft { neurons, radius, .. } = (self.origin.draft)(ensemble)?;
            gains.extend(neurons.gains.iter().map(|gain| (gain / radius) as Real));
        }
        Ok(gains)
    }

    /// Steps a part. `values` and `out` are those of its ensembles, `draws` the key of their random numbers.
    pub(crate) fn step(
        &self,
        (part, draws): (usize, u64),
        values: (&[Real], Real),
        injected: &[Real],
        state: &mut [Real],
        out: &mut [Real],
    ) {
        let first = part * self.partition.each;
        self.bank.step_injected((draws, first), values, injected, state, out);
    }
}
