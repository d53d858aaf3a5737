//! What a node declares about its ports, its state and its working memory.

use std::any::TypeId;
use std::marker::PhantomData;

use super::kind::{Kind, Pointer, Scalar, Shape, Space, SpaceId, Vector, VocabTag};

/// How an input is read and fed, when its kind is known at run time only.
#[derive(Debug, Clone)]
pub struct AnyInput {
    pub(crate) kind: TypeId,
    pub(crate) kind_label: String,
    pub(crate) shape: Shape,
    pub(crate) at_advance: bool,
    pub(crate) sum: bool,
    pub(crate) optional: bool,
}

/// How an output is written, when its kind is known at run time only.
#[derive(Debug, Clone)]
pub struct AnyOutput {
    pub(crate) kind: TypeId,
    pub(crate) kind_label: String,
    pub(crate) shape: Shape,
    pub(crate) registered: bool,
    pub(crate) filtered_only: bool,
}

/// How an input is read and fed; made by [`InputSpec::scalar`], [`InputSpec::vector`] or
/// [`InputSpec::pointer`].
pub struct InputSpec<K: Kind> {
    any: AnyInput,
    kind: PhantomData<fn() -> K>,
}

/// How an output is written; made by [`OutputSpec::scalar`], [`OutputSpec::vector`] or
/// [`OutputSpec::pointer`].
pub struct OutputSpec<K: Kind> {
    any: AnyOutput,
    kind: PhantomData<fn() -> K>,
}

impl<K: Kind> InputSpec<K> {
    fn with(width: usize, space: Option<SpaceId>) -> Self {
        let any = AnyInput {
            kind: TypeId::of::<K>(),
            kind_label: K::label(),
            shape: Shape { width, space },
            at_advance: false,
            sum: false,
            optional: false,
        };
        Self { any, kind: PhantomData }
    }

    /// Read only when the node commits its state, so that it takes no part in the order of emits.
    pub fn at_advance(mut self) -> Self {
        self.any.at_advance = true;
        self
    }

    /// Takes any number of sources and adds them, in the order of their paths.
    pub fn sum(mut self) -> Self {
        self.any.sum = true;
        self
    }

    /// May stay without a source; it then reads zeros.
    pub fn optional(mut self) -> Self {
        self.any.optional = true;
        self
    }
}

impl InputSpec<Scalar> {
    /// One number, read in emit, from exactly one source.
    pub fn scalar() -> Self {
        Self::with(1, None)
    }
}

impl InputSpec<Vector> {
    /// `width` numbers, read in emit, from exactly one source.
    pub fn vector(width: usize) -> Self {
        Self::with(width, None)
    }
}

impl<V: VocabTag> InputSpec<Pointer<V>> {
    /// A pointer of `space`, read in emit, from exactly one source.
    pub fn pointer(space: &Space<V>) -> Self {
        Self::with(space.width(), Some(space.id().clone()))
    }
}

impl<K: Kind> OutputSpec<K> {
    fn with(width: usize, space: Option<SpaceId>) -> Self {
        let any = AnyOutput {
            kind: TypeId::of::<K>(),
            kind_label: K::label(),
            shape: Shape { width, space },
            registered: false,
            filtered_only: false,
        };
        Self { any, kind: PhantomData }
    }

    /// Written when the node commits its state and seen one tick later.
    pub fn registered(mut self) -> Self {
        self.any.registered = true;
        self
    }

    /// Requires a synapse on every edge that leaves it.
    pub fn filtered_only(mut self) -> Self {
        self.any.filtered_only = true;
        self
    }
}

impl OutputSpec<Scalar> {
    /// One number, written in emit.
    pub fn scalar() -> Self {
        Self::with(1, None)
    }
}

impl OutputSpec<Vector> {
    /// `width` numbers, written in emit.
    pub fn vector(width: usize) -> Self {
        Self::with(width, None)
    }
}

impl<V: VocabTag> OutputSpec<Pointer<V>> {
    /// A pointer of `space`, written in emit.
    pub fn pointer(space: &Space<V>) -> Self {
        Self::with(space.width(), Some(space.id().clone()))
    }
}

impl<K: Kind> Clone for InputSpec<K> {
    fn clone(&self) -> Self {
        Self { any: self.any.clone(), kind: PhantomData }
    }
}

impl<K: Kind> Clone for OutputSpec<K> {
    fn clone(&self) -> Self {
        Self { any: self.any.clone(), kind: PhantomData }
    }
}

impl<K: Kind> From<InputSpec<K>> for AnyInput {
    fn from(spec: InputSpec<K>) -> Self {
        spec.any
    }
}

impl<K: Kind> From<OutputSpec<K>> for AnyOutput {
    fn from(spec: OutputSpec<K>) -> Self {
        spec.any
    }
}

impl AnyInput {
    /// Whether what flows in belongs to a space, as pointers do.
    pub fn is_pointer(&self) -> bool {
        self.shape.space.is_some()
    }

    /// Numbers a tick.
    pub fn width(&self) -> usize {
        self.shape.width
    }
}

impl AnyOutput {
    /// Numbers a tick.
    pub fn width(&self) -> usize {
        self.shape.width
    }
}

#[derive(Debug, Clone)]
pub(crate) struct InputDecl {
    pub name: String,
    pub spec: AnyInput,
}

#[derive(Debug, Clone)]
pub(crate) struct OutputDecl {
    pub name: String,
    pub spec: AnyOutput,
}

impl std::ops::Deref for InputDecl {
    type Target = AnyInput;
    fn deref(&self) -> &AnyInput {
        &self.spec
    }
}

impl std::ops::Deref for OutputDecl {
    type Target = AnyOutput;
    fn deref(&self) -> &AnyOutput {
        &self.spec
    }
}

/// How many numbers of each type a node keeps from tick to tick.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct StateSpec {
    /// Single-precision numbers.
    pub reals: usize,
    /// 32-bit counters.
    pub words: usize,
    /// 64-bit counters.
    pub longs: usize,
}

/// How many numbers of each type a node needs while it runs; nothing is kept between calls.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ScratchSpec {
    /// Single-precision numbers.
    pub reals: usize,
    /// Double-precision numbers.
    pub doubles: usize,
    /// Single-precision complex numbers.
    pub complexes: usize,
    /// 32-bit words.
    pub words: usize,
}

/// What a node says of itself, once: ports in order, state, scratch, and faults.
///
/// The order of declaration is the index by which the node reads and writes its ports.
#[derive(Debug, Default)]
pub struct PortDecl {
    pub(crate) inputs: Vec<InputDecl>,
    pub(crate) outputs: Vec<OutputDecl>,
    pub(crate) state: StateSpec,
    pub(crate) scratch: ScratchSpec,
    pub(crate) always_advance: bool,
    pub(crate) parallel: bool,
    pub(crate) faults: Vec<String>,
}

impl PortDecl {
    /// Declares the next input.
    pub fn input(&mut self, name: &str, spec: impl Into<AnyInput>) -> &mut Self {
        let spec = spec.into();
        self.check(name, spec.shape.width, self.inputs.iter().any(|p| p.name == name));
        self.inputs.push(InputDecl { name: name.into(), spec });
        self
    }

    /// Declares the next output.
    pub fn output(&mut self, name: &str, spec: impl Into<AnyOutput>) -> &mut Self {
        let spec = spec.into();
        self.check(name, spec.shape.width, self.outputs.iter().any(|p| p.name == name));
        self.outputs.push(OutputDecl { name: name.into(), spec });
        self
    }

    /// Asks for state; a node with state is advanced in every tick.
    pub fn state(&mut self, state: StateSpec) -> &mut Self {
        self.state = state;
        self
    }

    /// Asks for scratch.
    pub fn scratch(&mut self, scratch: ScratchSpec) -> &mut Self {
        self.scratch = scratch;
        self
    }

    /// Asks to be advanced in every tick although the node has neither state, nor inputs read at
    /// advance, nor registered outputs (a node that only watches for faults).
    pub fn advances(&mut self) -> &mut Self {
        self.always_advance = true;
        self
    }

    /// Says that the node is large enough to share its work among threads, which it does by Rayon while
    /// [`StepCx::threads`](super::StepCx::threads) is [`Threads::Pool`](super::Threads::Pool).
    pub fn parallel(&mut self) -> &mut Self {
        self.parallel = true;
        self
    }

    /// Reports a parameter that cannot work; `build` returns it with all other faults.
    pub fn fault(&mut self, reason: impl Into<String>) -> &mut Self {
        self.faults.push(reason.into());
        self
    }

    fn check(&mut self, name: &str, width: usize, taken: bool) {
        if taken {
            self.faults.push(format!("two ports are named `{name}`"));
        }
        if width == 0 {
            self.faults.push(format!("port `{name}` has width 0; at least 1 is needed"));
        }
    }

    /// Whether the two declarations offer the same ports (state and scratch may differ).
    pub(crate) fn same_ports(&self, other: &Self) -> bool {
        let input = |(a, b): (&InputDecl, &InputDecl)| {
            a.name == b.name && a.kind == b.kind && a.sum == b.sum && a.shape.fits(&b.shape)
        };
        let output = |(a, b): (&OutputDecl, &OutputDecl)| {
            a.name == b.name && a.kind == b.kind && a.shape.fits(&b.shape)
        };
        self.inputs.len() == other.inputs.len()
            && self.outputs.len() == other.outputs.len()
            && self.inputs.iter().zip(&other.inputs).all(input)
            && self.outputs.iter().zip(&other.outputs).all(output)
    }
}
