//! The checkpoints of a live run, in bounded memory: close together near the run's tick, further apart with distance.

use std::sync::Arc;

use super::log::Logged;
use crate::sim::error::SimError;
use crate::sim::run::checkpoint::Checkpoint;
use crate::sim::run::simulator::Simulator;

/// Greatest number of checkpoints: to thin them out costs a look at each.
const MOST: usize = 1_024;

struct Saved {
    /// The checkpoint's tick, here as well: to thin out a full ring all are looked at.
    tick: u64,
    checkpoint: Arc<Checkpoint>,
    /// Number of logged interventions made before.
    made: usize,
    bytes: usize,
}

/// Checkpoints by rising tick.
pub(super) struct Ring {
    saved: Vec<Saved>,
    bytes: usize,
    most_bytes: usize,
    spacing: u64,
    /// Bytes of the largest checkpoint so far.
    largest: usize,
}

impl Ring {
    pub fn new(most_bytes: usize, spacing: u64) -> Self {
        Self { saved: Vec::new(), bytes: 0, most_bytes, spacing: spacing.max(1), largest: 0 }
    }

    pub fn bytes(&self) -> usize {
        self.bytes
    }

    pub fn earliest(&self) -> Option<u64> {
        self.saved.first().map(|saved| saved.tick)
    }

    /// Returns the next tick after `tick` at which a checkpoint is due.
    pub fn next_due(&self, tick: u64) -> u64 {
        match self.most_bytes {
            0 => u64::MAX,
            _ => (tick / self.spacing + 1).saturating_mul(self.spacing),
        }
    }

    /// Returns the latest checkpoint of a tick up to `tick`, with the number of interventions made before.
    pub fn at_or_before(&self, tick: u64) -> Option<(Arc<Checkpoint>, usize)> {
        let after = self.saved.partition_point(|saved| saved.tick <= tick);
        let saved = &self.saved[after.checked_sub(1)?];
        Some((saved.checkpoint.clone(), saved.made))
    }

    pub fn save_if_due(&mut self, sim: &Simulator, made: usize) -> Result<(), SimError> {
        match sim.tick().is_multiple_of(self.spacing) {
            true => self.save(sim, made),
            false => Ok(()),
        }
    }

    /// Saves the run, unless there is a checkpoint of its tick or no room for one.
    pub fn save(&mut self, sim: &Simulator, made: usize) -> Result<(), SimError> {
        let tick = sim.tick();
        let at = self.saved.partition_point(|saved| saved.tick < tick);
        if self.saved.get(at).is_some_and(|saved| saved.tick == tick) {
            return Ok(());
        }
        // Room is made first, so that the new one does not add to a full ring.
        if self.largest > self.most_bytes || self.most_bytes == 0 {
            return Ok(());
        }
        self.thin(self.most_bytes - self.largest, MOST - 1, tick);
        let checkpoint = match sim.checkpoint() {
            // A world may refuse at some moments.
            Err(SimError::World { .. }) => return Ok(()),
            other => Arc::new(other?),
        };
        let bytes = checkpoint.bytes() + size_of::<Saved>();
        self.largest = self.largest.max(bytes);
        if bytes > self.most_bytes {
            return Ok(());
        }
        self.thin(self.most_bytes - bytes, MOST - 1, tick);
        let at = self.saved.partition_point(|saved| saved.tick < tick);
        self.saved.insert(at, Saved { tick, checkpoint, made, bytes });
        self.bytes += bytes;
        Ok(())
    }

    /// Sets how many interventions were made before the only checkpoint.
    pub fn save_as(&mut self, made: usize) {
        self.saved.iter_mut().for_each(|saved| saved.made = made);
    }

    /// Removes checkpoints until they take at most so many bytes and are at most so many. Each time the one goes whose
    /// absence makes the least gap, compared with its distance from `now`; the first goes last.
    fn thin(&mut self, bytes: usize, count: usize, now: u64) {
        while self.bytes > bytes || self.saved.len() > count {
            let gap = |at: usize| {
                let after = self.saved.get(at + 1).map_or(now, |saved| saved.tick);
                let gap = after.abs_diff(self.saved[at - 1].tick) as f64;
                gap / (now.abs_diff(self.saved[at].tick) as f64 + self.spacing as f64)
            };
            let gaps = (1..self.saved.len()).map(|at| (gap(at), at));
            let least = gaps.min_by(|(a, _), (b, _)| a.total_cmp(b));
            let gone = self.saved.remove(least.map_or(0, |(_, at)| at));
            self.bytes -= gone.bytes;
        }
    }

    fn retain(&mut self, keep: impl Fn(&Saved) -> bool) {
        self.saved.retain(keep);
        self.bytes = self.saved.iter().map(|saved| saved.bytes).sum();
    }

    pub fn clear(&mut self) {
        self.retain(|_| false);
    }

    /// Forgets what lies after `tick`, because other interventions will lead there.
    pub fn forget_after(&mut self, tick: u64) {
        self.retain(|saved| saved.tick <= tick);
    }

    /// Keeps the checkpoints on the path of `new`, a log that leads to `tick`, of those on the path of `old`.
    pub fn keep_path(&mut self, old: &[Logged], new: &[Logged], tick: u64) {
        let common = old.iter().zip(new).take_while(|(old, new)| old == new).count();
        self.retain(|saved| {
            saved.tick <= tick
                && saved.made <= common
                && new[saved.made..].iter().all(|next| next.tick >= saved.tick)
        });
    }
}
