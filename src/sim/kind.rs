//! What can flow through a port: numbers, vectors, and pointers typed by vocabulary.

use std::fmt;
use std::marker::PhantomData;
use std::ops::Deref;
use std::sync::Arc;

use super::fingerprint::Fingerprint;
use super::node::Real;

/// What flows through a port. A handle of one kind does not fit a port of another: the compiler
/// refuses the connection.
pub trait Kind: 'static {
    /// The numbers of one port in one tick, as an observer gets them: a slice, or a typed pointer.
    type Value<'a>: Copy + Deref<Target = [Real]>;

    /// A readable name for messages and pictures.
    fn label() -> String;

    /// A port's numbers as a value of this kind.
    fn value(numbers: &[Real]) -> Self::Value<'_>;
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
    type Value<'a> = &'a [Real];

    fn label() -> String {
        "scalar".into()
    }

    fn value(numbers: &[Real]) -> &[Real] {
        numbers
    }
}

impl Kind for Vector {
    type Value<'a> = &'a [Real];

    fn label() -> String {
        "vector".into()
    }

    fn value(numbers: &[Real]) -> &[Real] {
        numbers
    }
}

impl<V: VocabTag> Kind for Pointer<V> {
    type Value<'a> = PointerRef<'a, V>;

    fn label() -> String {
        format!("pointer of {}", V::NAME)
    }

    fn value(numbers: &[Real]) -> PointerRef<'_, V> {
        PointerRef::from_raw(numbers)
    }
}

/// A borrowed pointer of the vocabularies tagged `V`. It can be read as a slice.
pub struct PointerRef<'a, V: VocabTag> {
    values: &'a [Real],
    tag: PhantomData<fn() -> V>,
}

impl<'a, V: VocabTag> PointerRef<'a, V> {
    /// Takes the caller's word that these are components of a pointer of `V`. For vectors that come from
    /// outside; what a vocabulary or a probe gives out is typed already.
    pub fn from_raw(values: &'a [Real]) -> Self {
        Self { values, tag: PhantomData }
    }

    /// The components, for as long as they are borrowed.
    pub fn values(self) -> &'a [Real] {
        self.values
    }
}

impl<V: VocabTag> Clone for PointerRef<'_, V> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<V: VocabTag> Copy for PointerRef<'_, V> {}

impl<V: VocabTag> Deref for PointerRef<'_, V> {
    type Target = [Real];

    fn deref(&self) -> &[Real] {
        self.values
    }
}

/// Anything that is a pointer of the vocabularies tagged `V`, owned or borrowed.
pub trait AsPointer<V: VocabTag> {
    /// The pointer, borrowed.
    fn as_pointer(&self) -> PointerRef<'_, V>;
}

impl<V: VocabTag> AsPointer<V> for PointerRef<'_, V> {
    fn as_pointer(&self) -> PointerRef<'_, V> {
        *self
    }
}

impl<V: VocabTag> fmt::Debug for PointerRef<'_, V> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "pointer of {} ({} dimensions)", V::NAME, self.values.len())
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

    pub(crate) fn id(&self) -> &SpaceId {
        &self.id
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
    /// Whether width and space are the same.
    pub fn fits(&self, other: &Self) -> bool {
        self.width == other.width && self.same_space(other)
    }

    /// Whether both are of one space, or both of none.
    pub fn same_space(&self, other: &Self) -> bool {
        match (&self.space, &other.space) {
            (Some(a), Some(b)) => a.same_as(b),
            (None, None) => true,
            _ => false,
        }
    }

    /// Adds width and space to `hash`.
    pub fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.number(self.width as u64);
        if let Some(space) = &self.space {
            hash.number(space.id);
        }
    }
}
