//! The node trait, and the views of the engine's memory that a node gets during a tick.

use std::any::Any;
use std::marker::PhantomData;

use rand_chacha::ChaCha8Rng;

use super::error::NodeFault;
use super::fingerprint::Fingerprint;
use super::parts::Parts;
use super::port::PortDecl;
use super::seed::Seed;
use super::span::Span;
use super::time::{SimDuration, Timebase};

/// The number type of all signals.
pub type Real = f32;

/// A complex number in scratch memory.
pub type Complex = rustfft::num_complex::Complex<f32>;

/// The smallest part of a graph: it computes outputs from inputs and state.
///
/// A node is immutable while the graph runs. The engine owns its state and lends it during each tick, so the engine can
/// reset, save and restore every node.
///
/// In each tick the engine first calls [`emit`](Node::emit) on every node that has ordinary (not registered) outputs,
/// in topological order. It then calls [`advance`](Node::advance) on every node that has state, registered outputs or
/// inputs read in advance. Neither method may allocate, lock or log.
///
/// This node has an input and an output of three numbers:
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
    /// Declares the node's ports, state and scratch memory. The engine may call this method more than once. Every call
    /// must make the same declarations.
    fn declare(&self, ports: &mut PortDecl);

    /// Adds the node's parameters to `hash`: every number that affects the node's results. The engine adds the
    /// declared ports and state itself.
    ///
    /// A graph refuses checkpoints of graphs with another fingerprint. If you leave out a parameter, the graph also
    /// accepts checkpoints that were taken with another value of that parameter.
    fn fingerprint(&self, hash: &mut Fingerprint);

    /// Returns the name of the node's type, which is part of the fingerprint. Do not override this method.
    fn type_name(&self) -> &'static str {
        std::any::type_name::<Self>()
    }

    /// Writes the initial state and registered outputs, which are zero before the call. Called by
    /// [`Simulator::new`](super::Simulator::new) and [`Simulator::reset`](super::Simulator::reset).
    fn init(&self, state: &mut StateMut<'_>, registered: &mut Outputs<'_>) {
        let _ = (state, registered);
    }

    /// Computes the outputs of this tick from inputs and state.
    fn emit(&self, cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
        let _ = (cx, io);
    }

    /// Updates state and registered outputs for the next tick.
    ///
    /// # Errors
    /// A [`NodeFault`] ends the run. The run's error names the node and the tick.
    fn advance(&self, cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let _ = (cx, io);
        Ok(())
    }

    /// Returns the node as one that advances in parts, if it does. Most nodes do not.
    fn parts(&self) -> Option<&dyn Parts> {
        None
    }

    /// Returns the number of units that have events, such as neurons that spike. Most nodes have none. In a node with
    /// parts it is the sum over its parts.
    fn units(&self) -> usize {
        0
    }

    /// Returns whether `unit` had an event in the tick that produced this state. `unit` is less than
    /// [`units`](Node::units).
    fn event(&self, state: &StateRef<'_>, unit: usize) -> bool {
        let _ = (state, unit);
        false
    }
}

/// The context of a call in one tick.
#[derive(Debug, Clone, Copy)]
pub struct StepCx<'a> {
    pub(crate) tick: u64,
    pub(crate) time: Timebase,
    pub(crate) noise_scale: Real,
    pub(crate) node_seed: Seed,
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

    /// Returns a random number generator that depends only on run seed, node path and tick. All calls in one tick
    /// return the same generator. Does not allocate.
    pub fn rng(&self) -> ChaCha8Rng {
        let mut rng = self.node_seed.rng();
        rng.set_stream(self.tick);
        rng
    }
}

/// The place of an input's numbers in the arenas.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Slot {
    /// Written in this tick by an earlier node.
    Signal(Span),
    /// A registered output, a filter or a sense, constant during the tick.
    Held(Span),
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
    /// If the node has no such input, or if emit reads an input declared [`at_advance`](super::InputSpec::at_advance).
    /// Both are errors in the code of the node.
    #[inline]
    pub fn get(&self, index: usize) -> &'a [Real] {
        match self.slots[index] {
            Slot::Signal(span) => &self.signals[span.of()],
            Slot::Held(span) => &self.held[span.of()],
            Slot::Gathered(span) => &self.gathered[span.of()],
            Slot::OtherPhase => panic!("input {index} is read in the other phase of the tick"),
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
    /// Double-precision values.
    pub doubles: &'a mut [f64],
    /// Complex values.
    pub complexes: &'a mut [Complex],
    /// 32-bit integers.
    pub words: &'a mut [u32],
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
