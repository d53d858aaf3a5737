//! Noise of retrieval and unbinding, the same for both decoders.

use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

use super::world::{ATOMS, D, Vector};
use crate::sim::{Real, Seed};

/// A pointer that gets noise when it is retrieved or computed.
#[derive(Debug, Clone, Copy)]
pub(super) enum Source {
    /// Deep pointer of a state or action.
    Deep(usize),
    /// Role or object that unbinds a deep pointer: the deep pointer and the atom.
    Role(usize, usize),
    /// Unbound pointer: the deep pointer and the atom that unbound it.
    Unbound(usize, usize),
    /// Items that are compared with an unbound pointer: the deep pointer and the part of the state.
    Items(usize, usize),
}

/// Number of deep pointers: five states, then three actions.
pub(super) const DEEPS: usize = 8;

impl Source {
    pub(super) fn number(self) -> usize {
        match self {
            Self::Deep(deep) => deep,
            Self::Role(deep, probe) => DEEPS * (1 + probe) + deep,
            Self::Unbound(deep, probe) => DEEPS * (1 + ATOMS + probe) + deep,
            Self::Items(deep, probe) => DEEPS * (1 + 2 * ATOMS + probe) + deep,
        }
    }
}

/// Noise as a function of the trial, the step, the source, and the number of times the source was used in this step.
pub(super) struct Noise {
    pub(super) seed: Seed,
    /// Standard deviation of each component.
    pub(super) sd: Real,
    pub(super) step: u64,
    /// Number of uses of each source in this step.
    pub(super) times: Vec<u64>,
}

impl Noise {
    pub(super) fn new(seed: Seed, sigma: f64) -> Self {
        let sd = (sigma / (D as f64).sqrt()) as Real;
        Self { seed, sd, step: 0, times: vec![0; DEEPS * (1 + 3 * ATOMS)] }
    }

    pub(super) fn next_step(&mut self) {
        self.step += 1;
        self.times.fill(0);
    }

    pub(super) fn rng(&mut self, source: Source) -> impl Rng + use<> {
        let number = source.number();
        self.times[number] += 1;
        let key = (self.step << 32) | (self.times[number] << 16) | number as u64;
        self.seed.derive_index("noise", key).rng()
    }

    pub(super) fn onto(&mut self, source: Source, vector: &[Real]) -> Vector {
        if self.sd == 0.0 {
            return vector.to_vec();
        }
        let mut rng = self.rng(source);
        vector
            .iter()
            .map(|v| {
                let noise: f32 = StandardNormal.sample(&mut rng);
                v + self.sd * noise
            })
            .collect()
    }
}
