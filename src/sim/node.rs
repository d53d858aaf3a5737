//! The node trait and the views of the engine's arenas that a node is lent.

use std::any::Any;
use std::marker::PhantomData;

use rand_chacha::ChaCha8Rng;

use super::error::NodeFault;
use super::fingerprint::Fingerprint;
use super::port::PortDecl;
use super::seed::Seed;
use super::span::Span;
use super::threads::Threads;
use super::time::{SimDuration, Timebase};

/// The number type of the running arenas.
pub type Real = f32;

/// A complex number of the running arenas.
pub type Complex = rustfft::num_complex::Complex<f32>;

/// A part of a graph: immutable while it runs, all its changing numbers lent by the engine.
///
/// In one tick the engine calls [`emit`](Node::emit) on every node in topological order, then
/// [`advance`](Node::advance) on every node that has state, registered outputs or inputs read at
/// advance. Neither may allocate, lock or log.
///
/// ```
/// use symbolt::sim::{EmitIo, Fingerprint, InputSpec, Node, OutputSpec, PortDecl, StepCx};
///
/// struct Square;
/// impl Node for Square {
///     fn declare(&self, ports: &mut PortDecl) {
///         ports.input("x", InputSpec::vector(3)).output("y", OutputSpec::vector(3));
///     }
///     fn fingerprint(&self, _hash: &mut Fingerprint) {} // no parameters
///     fn emit(&self, _cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
///         let x = io.inputs.get(0);
///         for (y, x) in io.outputs.get_mut(0).iter_mut().zip(x) {
///             *y = x * x;
///         }
///     }
/// }
/// ```
pub trait Node: Any + Send + Sync {
    /// Says which ports, state and scratch the node has. Called while the graph is described and
    /// once more when it is built; both must agree.
    fn declare(&self, ports: &mut PortDecl);

    /// Adds the node's own parameters to `hash`: every number that decides what the node does with its
    /// state, and nothing that its ports show already. A checkpoint is refused by a graph of another
    /// fingerprint, so a parameter that is left out lets a checkpoint into a graph in which it means something else.
    fn fingerprint(&self, hash: &mut Fingerprint);

    /// The name of the node's type, a part of the fingerprint. Leave it as it is.
    fn type_name(&self) -> &'static str {
        std::any::type_name::<Self>()
    }

    /// Writes the state and the registered outputs that a fresh run starts from. All are zero
    /// before. Called by `Simulator::new` and `reset`.
    fn init(&self, state: &mut StateMut<'_>, registered: &mut Outputs<'_>) {
        let _ = (state, registered);
    }

    /// Computes the outputs of this tick from state and inputs.
    fn emit(&self, cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
        let _ = (cx, io);
    }

    /// Commits state and registered outputs.
    ///
    /// # Errors
    /// A [`NodeFault`] ends the run, naming the node and the tick.
    fn advance(&self, cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let _ = (cx, io);
        Ok(())
    }

    /// How many units of the node an observer can ask for events, one by one; most nodes have none.
    fn units(&self) -> usize {
        0
    }

    /// Whether `unit`, less than [`units`](Node::units), had an event in the tick that left this state.
    fn event(&self, state: &StateRef<'_>, unit: usize) -> bool {
        let _ = (state, unit);
        false
    }
}

/// The tick in which a node is called.
#[derive(Debug, Clone, Copy)]
pub struct StepCx<'a> {
    pub(crate) tick: u64,
    pub(crate) time: Timebase,
    pub(crate) noise_scale: Real,
    pub(crate) node_seed: Seed,
    pub(crate) threads: Threads,
    pub(crate) graph: PhantomData<&'a ()>,
}

impl StepCx<'_> {
    /// The number of ticks already done.
    pub fn tick(&self) -> u64 {
        self.tick
    }

    /// The length of a tick in seconds.
    pub fn dt_s(&self) -> f64 {
        self.time.dt_s()
    }

    /// Simulated time at the start of this tick.
    pub fn time(&self) -> SimDuration {
        self.time.span(self.tick)
    }

    /// The run's multiplier of every noise amplitude: 0 for none, 1 as described.
    pub fn noise_scale(&self) -> Real {
        self.noise_scale
    }

    /// Whether a node may share its work with the pool that it runs in. The result must have the same bits
    /// either way.
    pub fn threads(&self) -> Threads {
        self.threads
    }

    /// A generator whose stream is a function of run seed, node path and tick alone. Costs no
    /// allocation.
    pub fn rng(&self) -> ChaCha8Rng {
        let mut rng = self.node_seed.rng();
        rng.set_stream(self.tick);
        rng
    }
}

/// A resolved input: where in the arenas its numbers stand.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Slot {
    /// Written by an earlier node of this tick.
    Signal(Span),
    /// A registered output, a filter or a sense: constant during the tick.
    Held(Span),
    /// A sum gathered just before, or zeros for an input without a source.
    Gathered(Span),
    /// Read in the other phase.
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
    /// The numbers of input `index` (the order of declaration). Zeros if it has no source.
    ///
    /// # Panics
    /// If the node has no such input, or reads an input of the other phase: both are mistakes in
    /// the node's own code.
    #[inline]
    pub fn get(&self, index: usize) -> &'a [Real] {
        match self.slots[index] {
            Slot::Signal(span) => &self.signals[span.of()],
            Slot::Held(span) => &self.held[span.of()],
            Slot::Gathered(span) => &self.gathered[span.of()],
            Slot::OtherPhase => panic!("input {index} is read in the other phase of the tick"),
        }
    }

    /// The first number of input `index`.
    ///
    /// # Panics
    /// As [`Inputs::get`].
    #[inline]
    pub fn scalar(&self, index: usize) -> Real {
        self.get(index)[0]
    }
}

/// The outputs of a node in one phase of a tick: those written in emit, or those registered.
#[derive(Debug)]
pub struct Outputs<'a> {
    pub(crate) spans: &'a [OutSlot],
    pub(crate) base: usize,
    pub(crate) registered: bool,
    pub(crate) values: &'a mut [Real],
}

/// Where an output stands, and in which arena.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OutSlot {
    pub span: Span,
    pub registered: bool,
}

impl Outputs<'_> {
    /// The numbers of output `index` (the order of declaration), to be written. A registered
    /// output still holds what was last written to it.
    ///
    /// # Panics
    /// If the node has no such output, or it belongs to the other phase: both are mistakes in the
    /// node's own code.
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
    /// As [`Outputs::get_mut`].
    #[inline]
    pub fn set(&mut self, index: usize, value: Real) {
        self.get_mut(index)[0] = value;
    }
}

/// A node's state, read in emit.
#[derive(Debug, Clone, Copy)]
pub struct StateRef<'a> {
    /// Single-precision numbers.
    pub reals: &'a [Real],
    /// 32-bit counters.
    pub words: &'a [u32],
    /// 64-bit counters.
    pub longs: &'a [u64],
}

/// A node's state, written in init and advance.
#[derive(Debug)]
pub struct StateMut<'a> {
    /// Single-precision numbers.
    pub reals: &'a mut [Real],
    /// 32-bit counters.
    pub words: &'a mut [u32],
    /// 64-bit counters.
    pub longs: &'a mut [u64],
}

/// Working memory. Its contents are undefined at every call, and no checkpoint holds it.
#[derive(Debug)]
pub struct Scratch<'a> {
    /// Single-precision numbers.
    pub reals: &'a mut [Real],
    /// Double-precision numbers.
    pub doubles: &'a mut [f64],
    /// Complex numbers.
    pub complexes: &'a mut [Complex],
    /// 32-bit words.
    pub words: &'a mut [u32],
}

/// What a node is lent in emit.
#[derive(Debug)]
pub struct EmitIo<'a> {
    /// Inputs read in emit.
    pub inputs: Inputs<'a>,
    /// Outputs written in emit.
    pub outputs: Outputs<'a>,
    /// The state as of the last advance.
    pub state: StateRef<'a>,
    /// Working memory.
    pub scratch: Scratch<'a>,
}

/// What a node is lent in advance.
#[derive(Debug)]
pub struct AdvanceIo<'a> {
    /// Inputs read at advance, and with them those read in emit: all values of this tick.
    pub inputs: Inputs<'a>,
    /// Registered outputs.
    pub outputs: Outputs<'a>,
    /// The state, to be committed.
    pub state: StateMut<'a>,
    /// Working memory.
    pub scratch: Scratch<'a>,
}
