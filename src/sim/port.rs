//! Port kinds, typed handles, and what a node declares about its ports.

use std::any::TypeId;
use std::fmt;
use std::marker::PhantomData;
use std::ops::Range;
use std::sync::Arc;

use super::fingerprint::Fingerprint;

/// What flows through a port. A handle of one kind does not fit a port of another: the compiler
/// refuses the connection.
pub trait Kind: 'static {
    /// A readable name for messages and pictures.
    fn label() -> String;
}

/// One number.
#[derive(Debug, Clone, Copy)]
pub enum Scalar {}

/// A plain vector of numbers without a vocabulary.
#[derive(Debug, Clone, Copy)]
pub enum Vector {}

/// A semantic pointer of the vocabularies tagged `V`.
#[derive(Debug, Clone, Copy)]
pub struct Pointer<V: VocabTag>(PhantomData<fn() -> V>);

/// Marks a family of vector spaces at compile time. Two instances of one tag are told apart at
/// build time, by their [`Space`].
pub trait VocabTag: 'static {
    /// The name used in messages.
    const NAME: &'static str;
}

impl Kind for Scalar {
    fn label() -> String {
        "scalar".into()
    }
}

impl Kind for Vector {
    fn label() -> String {
        "vector".into()
    }
}

impl<V: VocabTag> Kind for Pointer<V> {
    fn label() -> String {
        format!("pointer of {}", V::NAME)
    }
}

/// The identity of a vector space: the engine compares it and knows nothing else about it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct SpaceId {
    id: u64,
    width: usize,
    label: Arc<str>,
}

impl SpaceId {
    /// Whether `other` is this very space (labels are not compared).
    pub fn same_as(&self, other: &Self) -> bool {
        self.id == other.id && self.width == other.width
    }
}

/// A vector space of the family `V`: what makes a port one of that family.
#[derive(Debug)]
pub struct Space<V: VocabTag> {
    id: SpaceId,
    tag: PhantomData<fn() -> V>,
}

impl<V: VocabTag> Clone for Space<V> {
    fn clone(&self) -> Self {
        Self { id: self.id.clone(), tag: PhantomData }
    }
}

impl<V: VocabTag> Space<V> {
    /// A space of `width` dimensions. Spaces are the same when their `id` and width are.
    pub fn new(id: u64, width: usize, label: impl Into<Arc<str>>) -> Self {
        Self { id: SpaceId { id, width, label: label.into() }, tag: PhantomData }
    }

    /// The number of dimensions.
    pub fn width(&self) -> usize {
        self.id.width
    }

    /// Whether `other` is this very space (labels are not compared).
    pub fn same_as<W: VocabTag>(&self, other: &Space<W>) -> bool {
        self.id.same_as(&other.id)
    }
}

impl<V: VocabTag> fmt::Display for Space<V> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.id.fmt(f)
    }
}

impl fmt::Display for SpaceId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.label)
    }
}

/// Width and space of a port, without its name.
#[derive(Debug, Clone)]
pub(crate) struct Shape {
    pub width: usize,
    pub space: Option<SpaceId>,
}

impl Shape {
    /// Adds width and space to `hash`.
    pub fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.number(self.width as u64);
        if let Some(space) = &self.space {
            hash.number(space.id);
        }
    }
}

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
        Self::with(space.width(), Some(space.id.clone()))
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

    /// The output of a population: every edge that leaves it needs a synapse.
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
        Self::with(space.width(), Some(space.id.clone()))
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
        let space = |a: &Shape, b: &Shape| {
            a.width == b.width
                && match (&a.space, &b.space) {
                    (None, None) => true,
                    (Some(x), Some(y)) => x.same_as(y),
                    _ => false,
                }
        };
        self.inputs.len() == other.inputs.len()
            && self.outputs.len() == other.outputs.len()
            && self.inputs.iter().zip(&other.inputs).all(|(a, b)| {
                a.name == b.name && a.kind == b.kind && a.sum == b.sum && space(&a.shape, &b.shape)
            })
            && self
                .outputs
                .iter()
                .zip(&other.outputs)
                .all(|(a, b)| a.name == b.name && a.kind == b.kind && space(&a.shape, &b.shape))
    }
}

/// Where a handle points: a port of a node of one builder, or a name that was not found.
#[derive(Debug, Clone)]
pub(crate) enum PortRef {
    Known { builder: u64, node: usize, port: usize },
    Unknown { node: String, port: String, kind: String, choices: Vec<String> },
}

/// A handle to an output of kind `K`.
pub struct Out<K: Kind> {
    pub(crate) port: PortRef,
    kind: PhantomData<fn() -> K>,
}

/// A handle to an input of kind `K`.
pub struct In<K: Kind> {
    pub(crate) port: PortRef,
    kind: PhantomData<fn(K)>,
}

impl<K: Kind> Out<K> {
    pub(crate) fn new(port: PortRef) -> Self {
        Self { port, kind: PhantomData }
    }
}

impl<K: Kind> In<K> {
    pub(crate) fn new(port: PortRef) -> Self {
        Self { port, kind: PhantomData }
    }
}

impl<K: Kind> Clone for Out<K> {
    fn clone(&self) -> Self {
        Self::new(self.port.clone())
    }
}

impl<K: Kind> Clone for In<K> {
    fn clone(&self) -> Self {
        Self::new(self.port.clone())
    }
}

impl<K: Kind> fmt::Debug for Out<K> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Out<{}>({:?})", K::label(), self.port)
    }
}

impl<K: Kind> fmt::Debug for In<K> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "In<{}>({:?})", K::label(), self.port)
    }
}

/// The ports of an added node, looked up by name.
///
/// A name or kind that the node does not have gives a handle that makes `build` report the fault
/// together with the ports that exist.
#[derive(Debug, Clone)]
pub struct NodePorts {
    pub(crate) builder: u64,
    pub(crate) node: usize,
    pub(crate) path: String,
    pub(crate) inputs: Arc<[(String, TypeId, String)]>,
    pub(crate) outputs: Arc<[(String, TypeId, String)]>,
}

impl NodePorts {
    /// The input called `name`.
    pub fn input<K: Kind>(&self, name: &str) -> In<K> {
        In::new(self.find::<K>(&self.inputs, name))
    }

    /// The output called `name`.
    pub fn output<K: Kind>(&self, name: &str) -> Out<K> {
        Out::new(self.find::<K>(&self.outputs, name))
    }

    /// The node's full path.
    pub fn path(&self) -> &str {
        &self.path
    }

    fn find<K: Kind>(&self, ports: &[(String, TypeId, String)], name: &str) -> PortRef {
        let kind = TypeId::of::<K>();
        match ports.iter().position(|(n, k, _)| n == name && *k == kind) {
            Some(port) => PortRef::Known { builder: self.builder, node: self.node, port },
            None => PortRef::Unknown {
                node: self.path.clone(),
                port: name.into(),
                kind: K::label(),
                choices: ports.iter().map(|(n, _, label)| format!("{n}: {label}")).collect(),
            },
        }
    }
}

/// A range of `u32` bounds, half the size of a `Range<usize>`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Span {
    pub start: u32,
    pub end: u32,
}

impl Span {
    pub fn of(self) -> Range<usize> {
        self.start as usize..self.end as usize
    }

    pub fn len(self) -> usize {
        (self.end - self.start) as usize
    }
}
