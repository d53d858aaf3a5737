//! The arenas: a few flat vectors that hold all numbers of a run. The layout assigns the ranges.

use super::stage::Stage;
use crate::sim::build::graph::{Sizes, Source};
use crate::sim::describe::io::ScratchArena;
use crate::sim::real::Real;

/// All numbers that change during a run, except those of the world.
pub(crate) struct Arenas {
    /// What nodes read.
    pub stage: Stage,
    /// Registered outputs, as nodes and the world last wrote them.
    pub registered: Vec<Real>,
    pub reals: Vec<Real>,
    pub words: Vec<u32>,
    pub longs: Vec<u64>,
    pub probe_filters: Vec<Real>,
    /// The results of all parts, and what ranks tell one another.
    pub results: Vec<Real>,
    pub scratch: ScratchArena,
}

impl Arenas {
    pub fn new(sizes: &Sizes) -> Self {
        Self {
            stage: Stage {
                signals: vec![0.0; sizes.signals],
                held: vec![0.0; sizes.held],
                gathered: vec![0.0; sizes.gathered],
                ..Stage::default()
            },
            registered: vec![0.0; sizes.registered],
            reals: vec![0.0; sizes.reals],
            words: vec![0; sizes.words],
            longs: vec![0; sizes.longs],
            probe_filters: vec![0.0; sizes.probe_filters],
            results: vec![0.0; sizes.results],
            scratch: ScratchArena::new(&sizes.scratch),
        }
    }

    /// Sets all numbers to zero. Scratch memory stays as it is, because no node may rely on its contents.
    pub fn clear(&mut self) {
        for arena in [
            &mut self.stage.signals,
            &mut self.stage.held,
            &mut self.stage.gathered,
            &mut self.registered,
            &mut self.reals,
            &mut self.probe_filters,
            &mut self.results,
        ] {
            arena.fill(0.0);
        }
        self.words.fill(0);
        self.longs.fill(0);
    }

    /// Makes the registered outputs visible to the next tick.
    pub fn commit_registered(&mut self) {
        self.stage.held[..self.registered.len()].copy_from_slice(&self.registered);
    }

    /// Returns the latest values of a source.
    pub fn source(&self, source: Source) -> &[Real] {
        match source {
            Source::Signal(span) => &self.stage.signals[span.of()],
            Source::Registered(span) => &self.registered[span.of()],
        }
    }

    /// Returns whether every signal, registered output and filter is a finite number.
    pub fn all_finite(&self) -> bool {
        finite(&self.stage.signals) && finite(&self.registered) && finite(&self.stage.held)
    }
}

/// Returns whether all numbers are finite, without a branch per number. A number times zero is zero, unless the number
/// is infinite or not a number. Eight independent sums let the compiler use wide registers.
fn finite(values: &[Real]) -> bool {
    let mut sums = [0.0f32; 8];
    let chunks = values.chunks_exact(8);
    let rest = chunks.remainder();
    for chunk in chunks {
        for (sum, value) in sums.iter_mut().zip(chunk) {
            *sum += value * 0.0;
        }
    }
    let tail: f32 = rest.iter().map(|v| v * 0.0).sum();
    sums.iter().sum::<f32>() + tail == 0.0
}

#[cfg(test)]
mod tests {
    use super::finite;

    #[test]
    fn one_bad_number_anywhere_is_found() {
        for len in [1, 7, 8, 9, 1000] {
            for at in [0, len / 2, len - 1] {
                for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                    let mut values = vec![f32::MAX; len];
                    assert!(finite(&values));
                    values[at] = bad;
                    assert!(!finite(&values), "{bad} at {at} of {len}");
                }
            }
        }
    }
}
