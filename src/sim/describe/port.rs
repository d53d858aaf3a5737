//! Declarations of a node: its ports, state and scratch memory.

use std::any::TypeId;
use std::marker::PhantomData;
use std::sync::Arc;

use super::kind::{Kind, Pointer, Scalar, Shape, Space, SpaceId, Vector, VocabTag};

/// An [`InputSpec`] without the kind as a type, for kinds known only at run time.
#[derive(Debug, Clone)]
pub struct AnyInput {
    pub(crate) kind: TypeId,
    pub(crate) kind_label: String,
    pub(crate) shape: Shape,
    pub(crate) at_advance: bool,
    pub(crate) at_settle: bool,
    pub(crate) sum: bool,
    pub(crate) optional: bool,
}

/// An [`OutputSpec`] without the kind as a type, for kinds known only at run time.
#[derive(Debug, Clone)]
pub struct AnyOutput {
    pub(crate) kind: TypeId,
    pub(crate) kind_label: String,
    pub(crate) shape: Shape,
    pub(crate) registered: bool,
    pub(crate) filtered_only: bool,
}

/// The properties of an input. Created by [`InputSpec::scalar`], [`InputSpec::vector`] or
/// [`InputSpec::pointer`].
///
/// By default an input is read in emit and takes exactly one connection.
pub struct InputSpec<K: Kind> {
    any: AnyInput,
    kind: PhantomData<fn() -> K>,
}

/// The properties of an output. Created by [`OutputSpec::scalar`], [`OutputSpec::vector`] or
/// [`OutputSpec::pointer`].
///
/// By default an output is written in emit and its readers see it in the same tick.
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
            at_settle: false,
            sum: false,
            optional: false,
        };
        Self { any, kind: PhantomData }
    }

    /// Makes the input readable in advance only. The node then emits without waiting for the input's source, so a
    /// connection to this input can close a loop without a synapse.
    pub fn at_advance(mut self) -> Self {
        self.any.at_advance = true;
        self
    }

    /// Makes the input readable at the end of the tick: the node advances after all others, when what they have written in
    /// this tick is known. A connection without a synapse from a registered output then carries the value of this tick,
    /// also from an output that otherwise needs a synapse. A learning rule reads the activity of neurons so.
    ///
    /// What the node writes to registered outputs itself is not known by then: such an output needs a synapse on its way
    /// to another input of this kind.
    pub fn at_settle(mut self) -> Self {
        self.any.at_advance = true;
        self.any.at_settle = true;
        self
    }

    /// Lets the input take any number of connections. Their values are added in the order of the sources' paths.
    pub fn sum(mut self) -> Self {
        self.any.sum = true;
        self
    }

    /// Lets the input stay unconnected. It then reads zeros.
    pub fn optional(mut self) -> Self {
        self.any.optional = true;
        self
    }
}

impl InputSpec<Scalar> {
    /// Declares an input of one number.
    pub fn scalar() -> Self {
        Self::with(1, None)
    }
}

impl InputSpec<Vector> {
    /// Declares an input of `width` numbers.
    pub fn vector(width: usize) -> Self {
        Self::with(width, None)
    }
}

impl<V: VocabTag> InputSpec<Pointer<V>> {
    /// Declares an input for pointers of `space`.
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

    /// Makes this a registered output: the node writes it in advance, and readers see it one tick later.
    pub fn registered(mut self) -> Self {
        self.any.registered = true;
        self
    }

    /// Requires a synapse on every connection from this output.
    pub fn filtered_only(mut self) -> Self {
        self.any.filtered_only = true;
        self
    }
}

impl OutputSpec<Scalar> {
    /// Declares an output of one number.
    pub fn scalar() -> Self {
        Self::with(1, None)
    }
}

impl OutputSpec<Vector> {
    /// Declares an output of `width` numbers.
    pub fn vector(width: usize) -> Self {
        Self::with(width, None)
    }
}

impl<V: VocabTag> OutputSpec<Pointer<V>> {
    /// Declares an output for pointers of `space`.
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
    /// Returns whether the input takes pointers.
    pub(crate) fn is_pointer(&self) -> bool {
        self.shape.space.is_some()
    }

    /// Returns the number of values on the port.
    pub(crate) fn width(&self) -> usize {
        self.shape.width
    }
}

impl AnyOutput {
    /// Returns the number of values on the port.
    pub(crate) fn width(&self) -> usize {
        self.shape.width
    }
}

#[derive(Debug, Clone)]
pub(crate) struct InputDecl {
    pub name: String,
    /// The full name given by the outermost module that exposes the port.
    pub exposed: Option<Arc<str>>,
    pub spec: AnyInput,
}

#[derive(Debug, Clone)]
pub(crate) struct OutputDecl {
    pub name: String,
    /// The full name given by the outermost module that exposes the port.
    pub exposed: Option<Arc<str>>,
    /// The full names given by the modules inside that one.
    pub inner: Vec<Arc<str>>,
    pub spec: AnyOutput,
}

impl std::ops::Deref for InputDecl {
    type Target = AnyInput;
    fn deref(&self) -> &AnyInput {
        &self.spec
    }
}

impl OutputDecl {
    /// Returns whether a module around the port calls it `name`.
    pub fn is_exposed_as(&self, name: &str) -> bool {
        self.exposed.iter().chain(&self.inner).any(|own| **own == *name)
    }
}

impl std::ops::Deref for OutputDecl {
    type Target = AnyOutput;
    fn deref(&self) -> &AnyOutput {
        &self.spec
    }
}

/// Returns whether a port with this name can be found by name.
pub(crate) fn is_port_name(name: &str) -> bool {
    !name.is_empty() && !name.contains(['.', '/'])
}

/// Size of a node's state: the values that it keeps from tick to tick.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct StateSpec {
    /// Number of single-precision values.
    pub reals: usize,
    /// Number of 32-bit integers.
    pub words: usize,
    /// Number of 64-bit integers.
    pub longs: usize,
}

/// Size of a node's scratch memory. Its contents are not kept between calls.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ScratchSpec {
    /// Number of single-precision values.
    pub reals: usize,
    /// Number of single-precision complex values.
    pub complexes: usize,
    /// Number of 32-bit integers.
    pub words: usize,
}

/// The declaration of a node: its ports, state, scratch memory and faults.
///
/// Inputs are numbered from 0 in the order of declaration. Outputs have numbers of their own, also from 0. A node
/// reads and writes its ports by these numbers.
#[derive(Debug, Clone, Default)]
pub struct PortDecl {
    pub(crate) inputs: Vec<InputDecl>,
    pub(crate) outputs: Vec<OutputDecl>,
    pub(crate) state: StateSpec,
    pub(crate) scratch: ScratchSpec,
    pub(crate) always_advance: bool,
    pub(crate) faults: Vec<String>,
}

impl PortDecl {
    /// Declares the next input. A repeated name or a width of 0 is a fault when the graph is built.
    pub fn input(&mut self, name: &str, spec: impl Into<AnyInput>) -> &mut Self {
        let spec = spec.into();
        self.check(name, spec.shape.width, self.inputs.iter().any(|p| p.name == name));
        self.inputs.push(InputDecl { name: name.into(), exposed: None, spec });
        self
    }

    /// Declares the next output. A repeated name or a width of 0 is a fault when the graph is built.
    pub fn output(&mut self, name: &str, spec: impl Into<AnyOutput>) -> &mut Self {
        let spec = spec.into();
        self.check(name, spec.shape.width, self.outputs.iter().any(|p| p.name == name));
        self.outputs.push(OutputDecl { name: name.into(), exposed: None, inner: Vec::new(), spec });
        self
    }

    /// Returns whether the node advances after all others.
    pub(crate) fn settles(&self) -> bool {
        self.inputs.iter().any(|input| input.at_settle)
    }

    /// Requests state. A node with state is advanced in every tick.
    pub fn state(&mut self, state: StateSpec) -> &mut Self {
        self.state = state;
        self
    }

    /// Requests scratch memory.
    pub fn scratch(&mut self, scratch: ScratchSpec) -> &mut Self {
        self.scratch = scratch;
        self
    }

    /// Requests a call of [`Node::advance`](crate::sim::Node::advance) in every tick. Nodes with state, registered outputs
    /// or inputs read in advance do not need this request. It is for other nodes, such as those that only check for
    /// faults.
    pub fn advances(&mut self) -> &mut Self {
        self.always_advance = true;
        self
    }

    /// Reports an invalid parameter. `build` returns the reason with all other faults.
    pub fn fault(&mut self, reason: impl Into<String>) -> &mut Self {
        self.faults.push(reason.into());
        self
    }

    fn check(&mut self, name: &str, width: usize, taken: bool) {
        if taken {
            self.faults
                .push(format!("two ports are named `{name}`; give one of them another name"));
        }
        if width == 0 {
            self.faults.push(format!("port `{name}` has width 0; expected at least 1"));
        }
    }

    /// Returns whether both declarations have the same ports. State and scratch may differ.
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
