//! Kinds of ports: scalars, vectors, and pointers of a vocabulary.

use std::any::Any;
use std::fmt;
use std::marker::PhantomData;
use std::ops::Deref;
use std::sync::Arc;

use super::fingerprint::Fingerprint;
use crate::sim::real::Real;

/// The kind of value on a port: [`Scalar`], [`Vector`] or [`Pointer`]. A connection between ports of different kinds
/// does not compile.
pub trait Kind: 'static {
    /// The value of a port in one tick: a slice of numbers, or a [`PointerRef`].
    type Value<'a>: Copy + Deref<Target = [Real]>;

    /// Returns a readable name for messages.
    fn label() -> String;

    /// Wraps the numbers of a port as a value of this kind.
    fn value(numbers: &[Real]) -> Self::Value<'_>;
}

/// One number.
#[derive(Debug, Clone, Copy)]
pub enum Scalar {}

/// Several numbers that belong to no vocabulary.
#[derive(Debug, Clone, Copy)]
pub enum Vector {}

/// A semantic pointer of a vocabulary with the tag `V`.
#[derive(Debug, Clone, Copy)]
pub struct Pointer<V: VocabTag>(PhantomData<fn() -> V>);

/// A compile-time tag for vocabularies. Pointers with different tags cannot be connected. Two vocabularies with the
/// same tag are distinguished by their [`Space`] when the graph is built.
///
/// ```
/// use symbolt::sim::VocabTag;
///
/// struct Parts;
/// impl VocabTag for Parts {
///     const NAME: &'static str = "parts";
/// }
/// ```
pub trait VocabTag: 'static {
    /// The name of the tag in messages.
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

/// A borrowed pointer of a vocabulary with the tag `V`. It dereferences to a slice.
pub struct PointerRef<'a, V: VocabTag> {
    values: &'a [Real],
    tag: PhantomData<fn() -> V>,
}

impl<'a, V: VocabTag> PointerRef<'a, V> {
    /// Wraps components from outside the crate as a pointer of `V`. Checks nothing: the caller guarantees that the
    /// components are a pointer of a vocabulary with this tag.
    pub fn from_raw(values: &'a [Real]) -> Self {
        Self { values, tag: PhantomData }
    }

    /// Returns the components.
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

/// An owned or borrowed pointer of a vocabulary with the tag `V`.
pub trait AsPointer<V: VocabTag> {
    /// Borrows the pointer.
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

/// The identity of a vector space. The engine only compares identities.
#[derive(Debug, Clone)]
pub(crate) struct SpaceId {
    id: u64,
    width: usize,
    label: Arc<str>,
    attached: Option<Attached>,
}

/// Data that a layer above the engine attaches to a space, such as the algebra of its pointers.
#[derive(Clone)]
struct Attached(Arc<dyn Any + Send + Sync>);

impl fmt::Debug for Attached {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Attached")
    }
}

impl SpaceId {
    /// Returns whether `other` is the same space. Labels are not compared.
    pub fn same_as(&self, other: &Self) -> bool {
        self.id == other.id && self.width == other.width
    }

    /// Returns the attached data; `None` if there is none of this type.
    pub fn attached<T: Any>(&self) -> Option<&T> {
        self.attached.as_ref()?.0.downcast_ref()
    }
}

/// The vector space of a vocabulary with the tag `V`. A port for pointers of the vocabulary is declared with this
/// space.
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
    /// Creates a space of `width` dimensions. Two spaces are the same if `id` and width are the same; `label` appears
    /// in messages only.
    pub fn new(id: u64, width: usize, label: impl Into<Arc<str>>) -> Self {
        Self { id: SpaceId { id, width, label: label.into(), attached: None }, tag: PhantomData }
    }

    /// Attaches data of a layer above the engine. It travels with every port that is declared with this space.
    pub(crate) fn with_attached<T: Any + Send + Sync>(mut self, data: T) -> Self {
        self.id.attached = Some(Attached(Arc::new(data)));
        self
    }

    /// Returns the attached data; `None` if there is none of this type.
    pub(crate) fn attached<T: Any>(&self) -> Option<&T> {
        self.id.attached()
    }

    /// Returns the number that identifies the space, together with its width.
    pub(crate) fn number(&self) -> u64 {
        self.id.id
    }

    /// Wraps the identity that a port was declared with.
    pub(crate) fn of(id: SpaceId) -> Self {
        Self { id, tag: PhantomData }
    }

    pub(crate) fn id(&self) -> &SpaceId {
        &self.id
    }

    /// Returns the number of dimensions.
    pub fn width(&self) -> usize {
        self.id.width
    }

    /// Returns whether `other` is the same space. Labels are not compared.
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

/// Width and space of a port.
#[derive(Debug, Clone)]
pub(crate) struct Shape {
    pub width: usize,
    pub space: Option<SpaceId>,
}

impl Shape {
    /// Returns whether width and space are the same.
    pub fn fits(&self, other: &Self) -> bool {
        self.width == other.width && self.same_space(other)
    }

    /// Returns whether both have the same space, or both have none.
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
