//! The arenas: a few flat vectors that hold all numbers of a run. The layout assigns the ranges.

use super::graph::{Sizes, Source};
use super::node::{Complex, Real, Scratch};
use super::port::ScratchSpec;
use super::seed::Seed;
use super::team::Rest;
use super::tick::{Clock, View};

/// All numbers that change during a run, except those of the world.
#[derive(Debug, Clone)]
pub(crate) struct Arenas {
    /// Outputs written in emit, in the order of emits.
    pub signals: Vec<Real>,
    /// Registered outputs, as nodes and the world last wrote them.
    pub registered: Vec<Real>,
    /// Values that stay constant during a tick: registered outputs at its start, then the filters of connections.
    pub held: Vec<Real>,
    /// Sums of several sources, and zeros for unconnected inputs.
    pub gathered: Vec<Real>,
    pub reals: Vec<Real>,
    pub words: Vec<u32>,
    pub longs: Vec<u64>,
    pub probe_filters: Vec<Real>,
    /// The results of all parts, and what ranks tell one another.
    pub results: Vec<Real>,
    pub scratch: ScratchArena,
}

/// Scratch memory, lent to one node at a time.
#[derive(Debug, Clone, Default)]
pub(crate) struct ScratchArena {
    pub reals: Vec<Real>,
    pub doubles: Vec<f64>,
    pub complexes: Vec<Complex>,
    pub words: Vec<u32>,
}

impl Arenas {
    pub fn new(sizes: &Sizes) -> Self {
        Self {
            signals: vec![0.0; sizes.signals],
            registered: vec![0.0; sizes.registered],
            held: vec![0.0; sizes.held],
            gathered: vec![0.0; sizes.gathered],
            reals: vec![0.0; sizes.reals],
            words: vec![0; sizes.words],
            longs: vec![0; sizes.longs],
            probe_filters: vec![0.0; sizes.probe_filters],
            results: vec![0.0; sizes.results],
            scratch: ScratchArena::new(&sizes.scratch),
        }
    }

    /// Returns what nodes read in advance, and what they change.
    pub fn split<'a>(&'a mut self, seeds: &'a [Seed], clock: Clock) -> (View<'a>, Rest<'a>) {
        let view = View {
            signals: &self.signals,
            held: &self.held,
            gathered: &self.gathered,
            seeds,
            cx: clock.cx(),
        };
        let rest = Rest {
            registered: &mut self.registered,
            reals: &mut self.reals,
            words: &mut self.words,
            longs: &mut self.longs,
            scratch: &mut self.scratch,
        };
        (view, rest)
    }

    /// Sets all numbers to zero. Scratch memory stays as it is, because no node may rely on its contents.
    pub fn clear(&mut self) {
        for arena in [
            &mut self.signals,
            &mut self.registered,
            &mut self.held,
            &mut self.gathered,
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
        self.held[..self.registered.len()].copy_from_slice(&self.registered);
    }

    /// Returns the latest values of a source.
    pub fn source(&self, source: Source) -> &[Real] {
        match source {
            Source::Signal(span) => &self.signals[span.of()],
            Source::Registered(span) => &self.registered[span.of()],
        }
    }

    /// Returns whether every signal, registered output and filter is a finite number.
    pub fn all_finite(&self) -> bool {
        finite(&self.signals) && finite(&self.registered) && finite(&self.held)
    }
}

impl ScratchArena {
    pub fn new(sizes: &ScratchSpec) -> Self {
        Self {
            reals: vec![0.0; sizes.reals],
            doubles: vec![0.0; sizes.doubles],
            complexes: vec![Complex::default(); sizes.complexes],
            words: vec![0; sizes.words],
        }
    }

    /// Lends scratch memory of these lengths: reals, doubles, complexes, words.
    #[inline]
    pub fn lend(&mut self, lengths: [u32; 4]) -> Scratch<'_> {
        if lengths == [0; 4] {
            return Scratch {
                reals: &mut [],
                doubles: &mut [],
                complexes: &mut [],
                words: &mut [],
            };
        }
        let [reals, doubles, complexes, words] = lengths.map(|n| n as usize);
        Scratch {
            reals: &mut self.reals[..reals],
            doubles: &mut self.doubles[..doubles],
            complexes: &mut self.complexes[..complexes],
            words: &mut self.words[..words],
        }
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
