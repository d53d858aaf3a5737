//! The views of the engine's memory that a node gets during a tick, and scratch memory.

use std::marker::PhantomData;

use rand_chacha::ChaCha8Rng;

use super::port::ScratchSpec;
use crate::sim::real::{Complex, Real, Span};
use crate::sim::seed::{Seed, mix64};
use crate::sim::time::{SimDuration, Timebase};

/// The context of a call in one tick.
#[derive(Debug, Clone, Copy)]
pub struct StepCx<'a> {
    pub(crate) tick: u64,
    pub(crate) time: Timebase,
    pub(crate) noise_scale: Real,
    pub(crate) node_seed: Seed,
    /// The part that advances, in a node with parts.
    pub(crate) part: Option<u32>,
    pub(crate) graph: PhantomData<&'a ()>,
}

impl StepCx<'_> {
    /// Returns the number of completed ticks.
    pub fn tick(&self) -> u64 {
        self.tick
    }

    /// Returns the length of a tick in seconds.
    pub fn dt_s(&self) -> f64 {
        self.time.dt_s()
    }

    /// Returns the simulated time at the start of this tick.
    pub fn time(&self) -> SimDuration {
        self.time.span(self.tick)
    }

    /// Returns the run's factor for all noise amplitudes: 0 turns noise off, 1 leaves the amplitudes unchanged.
    pub fn noise_scale(&self) -> Real {
        self.noise_scale
    }

    /// Returns a random number generator that depends only on run seed, node path, tick and, in a node with parts, the
    /// part that advances. All calls in one tick return the same generator. Does not allocate.
    pub fn rng(&self) -> ChaCha8Rng {
        let seed = match self.part {
            Some(part) => self.node_seed.derive_index("part", u64::from(part)),
            None => self.node_seed,
        };
        let mut rng = seed.rng();
        rng.set_stream(self.tick);
        rng
    }

    /// Returns a key of random numbers that depends on the run seed, the node and the tick, the same in all parts.
    pub(crate) fn draws(&self) -> u64 {
        mix64(self.node_seed.value() ^ mix64(self.tick))
    }
}

/// The place of an input's numbers in the arenas.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Slot {
    /// Written in this tick by an earlier node.
    Signal(Span),
    /// A registered output, a filter or a sense, constant during the tick.
    Held(Span),
    /// A registered output as it was written in this tick. Only sums have it as a source.
    Settled(Span),
    /// A sum of several sources, or zeros for an unconnected input.
    Gathered(Span),
    /// Readable in the other phase only.
    OtherPhase,
}

/// The inputs of a node in one phase of a tick.
#[derive(Debug, Clone, Copy)]
pub struct Inputs<'a> {
    pub(crate) slots: &'a [Slot],
    pub(crate) signals: &'a [Real],
    pub(crate) held: &'a [Real],
    pub(crate) gathered: &'a [Real],
}

impl<'a> Inputs<'a> {
    /// Returns the numbers of input `index`. Inputs are counted from 0 in the order of declaration. An unconnected
    /// input reads zeros.
    ///
    /// # Panics
    /// If the node has no such input, or if emit reads an input declared [`at_advance`](crate::sim::InputSpec::at_advance).
    /// Both are errors in the code of the node.
    #[inline]
    pub fn get(&self, index: usize) -> &'a [Real] {
        match self.slots[index] {
            Slot::Signal(span) => &self.signals[span.of()],
            Slot::Held(span) => &self.held[span.of()],
            Slot::Gathered(span) => &self.gathered[span.of()],
            Slot::Settled(_) | Slot::OtherPhase => {
                panic!("input {index} is read in the other phase of the tick")
            }
        }
    }

    /// Returns the first number of input `index`.
    ///
    /// # Panics
    /// As for [`Inputs::get`].
    #[inline]
    pub fn scalar(&self, index: usize) -> Real {
        self.get(index)[0]
    }
}

/// The outputs of a node in one phase of a tick: in emit the ordinary outputs, in advance the registered ones.
#[derive(Debug)]
pub struct Outputs<'a> {
    pub(crate) spans: &'a [OutSlot],
    pub(crate) base: usize,
    pub(crate) registered: bool,
    pub(crate) values: &'a mut [Real],
}

/// The place of an output's numbers, and the arena that holds them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OutSlot {
    pub span: Span,
    pub registered: bool,
}

impl Outputs<'_> {
    /// Returns the numbers of output `index`, for writing. Outputs are counted from 0 in the order of declaration. A
    /// registered output still holds its latest value.
    ///
    /// # Panics
    /// If the node has no such output, or if the output belongs to the other phase. Both are errors in the code of the
    /// node.
    #[inline]
    pub fn get_mut(&mut self, index: usize) -> &mut [Real] {
        let slot = self.spans[index];
        assert!(slot.registered == self.registered, "output {index} belongs to the other phase");
        let range = slot.span.of();
        &mut self.values[range.start - self.base..range.end - self.base]
    }

    /// Writes one number to output `index`.
    ///
    /// # Panics
    /// As for [`Outputs::get_mut`].
    #[inline]
    pub fn set(&mut self, index: usize, value: Real) {
        self.get_mut(index)[0] = value;
    }
}

/// A node's state, for reading.
#[derive(Debug, Clone, Copy)]
pub struct StateRef<'a> {
    /// Single-precision values.
    pub reals: &'a [Real],
    /// 32-bit integers.
    pub words: &'a [u32],
    /// 64-bit integers.
    pub longs: &'a [u64],
}

/// A node's state, for writing.
#[derive(Debug)]
pub struct StateMut<'a> {
    /// Single-precision values.
    pub reals: &'a mut [Real],
    /// 32-bit integers.
    pub words: &'a mut [u32],
    /// 64-bit integers.
    pub longs: &'a mut [u64],
}

/// Scratch memory. Its contents are undefined at the start of every call.
#[derive(Debug)]
pub struct Scratch<'a> {
    /// Single-precision values.
    pub reals: &'a mut [Real],
    /// Complex values.
    pub complexes: &'a mut [Complex],
    /// 32-bit integers.
    pub words: &'a mut [u32],
}

impl Scratch<'_> {
    /// Lends the same memory for a shorter time.
    #[inline]
    pub(crate) fn reborrow(&mut self) -> Scratch<'_> {
        Scratch {
            reals: &mut *self.reals,
            complexes: &mut *self.complexes,
            words: &mut *self.words,
        }
    }
}

/// Scratch memory, lent to one node at a time.
#[derive(Debug, Clone, Default)]
pub(crate) struct ScratchArena {
    pub reals: Vec<Real>,
    pub complexes: Vec<Complex>,
    pub words: Vec<u32>,
}

impl ScratchArena {
    pub fn new(sizes: &ScratchSpec) -> Self {
        Self {
            reals: vec![0.0; sizes.reals],
            complexes: vec![Complex::default(); sizes.complexes],
            words: vec![0; sizes.words],
        }
    }

    /// Lends scratch memory of these lengths: reals, complexes, words.
    #[inline]
    pub fn lend(&mut self, lengths: [u32; 3]) -> Scratch<'_> {
        if lengths == [0; 3] {
            return Scratch { reals: &mut [], complexes: &mut [], words: &mut [] };
        }
        let [reals, complexes, words] = lengths.map(|n| n as usize);
        Scratch {
            reals: &mut self.reals[..reals],
            complexes: &mut self.complexes[..complexes],
            words: &mut self.words[..words],
        }
    }
}

/// The inputs, outputs, state and scratch memory of a node in emit.
#[derive(Debug)]
pub struct EmitIo<'a> {
    /// Inputs that are readable in emit.
    pub inputs: Inputs<'a>,
    /// Ordinary outputs.
    pub outputs: Outputs<'a>,
    /// State after the previous tick.
    pub state: StateRef<'a>,
    /// Scratch memory.
    pub scratch: Scratch<'a>,
}

/// The inputs, outputs, state and scratch memory of a node in advance.
#[derive(Debug)]
pub struct AdvanceIo<'a> {
    /// All inputs, with their values of this tick.
    pub inputs: Inputs<'a>,
    /// Registered outputs.
    pub outputs: Outputs<'a>,
    /// State, to be updated for the next tick.
    pub state: StateMut<'a>,
    /// Scratch memory.
    pub scratch: Scratch<'a>,
}
