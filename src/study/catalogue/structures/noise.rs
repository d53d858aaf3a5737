//! Noise of what is retrieved and unbound, the same for whoever decodes it.

use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

use super::world::{ATOMS, D, Vector};
use crate::sim::{Real, Seed};

/// What is fetched or computed with noise; a number for each.
#[derive(Debug, Clone, Copy)]
pub(super) enum Event {
    /// The deep pointer of a state or action.
    Deep(usize),
    /// The role or object by which it is unbound.
    Role(usize, usize),
    /// What comes out.
    Unbound(usize, usize),
    /// Items compared with that.
    Items(usize, usize),
}

/// Deep pointers by number: five states, then three actions.
pub(super) const DEEPS: usize = 8;

impl Event {
    pub(super) fn number(self) -> usize {
        match self {
            Self::Deep(deep) => deep,
            Self::Role(deep, probe) => DEEPS * (1 + probe) + deep,
            Self::Unbound(deep, probe) => DEEPS * (1 + ATOMS + probe) + deep,
            Self::Items(deep, probe) => DEEPS * (1 + 2 * ATOMS + probe) + deep,
        }
    }
}

/// Noise as a function of trial, step, event and how often it has happened.
pub(super) struct Noise {
    pub(super) seed: Seed,
    /// Standard deviation of a component.
    pub(super) sd: Real,
    pub(super) step: u64,
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

    pub(super) fn rng(&mut self, event: Event) -> impl Rng + use<> {
        let number = event.number();
        self.times[number] += 1;
        let key = (self.step << 32) | (self.times[number] << 16) | number as u64;
        self.seed.derive_index("noise", key).rng()
    }

    pub(super) fn onto(&mut self, event: Event, vector: &[Real]) -> Vector {
        if self.sd == 0.0 {
            return vector.to_vec();
        }
        let mut rng = self.rng(event);
        vector
            .iter()
            .map(|v| {
                let noise: f32 = StandardNormal.sample(&mut rng);
                v + self.sd * noise
            })
            .collect()
    }
}
