//! Owned pointers outside a graph, typed by vocabulary.

use std::fmt;
use std::marker::PhantomData;
use std::ops::Deref;

use crate::sim::{AsPointer, PointerRef, Real, VocabTag};

/// An owned pointer of vocabulary `V`, with the expression that gave its value.
///
/// Dereferences to its components, one per dimension.
pub struct PointerValue<V: VocabTag> {
    values: Vec<Real>,
    expression: String,
    tag: PhantomData<fn() -> V>,
}

impl<V: VocabTag> PointerValue<V> {
    pub(crate) fn new(values: Vec<Real>, expression: String) -> Self {
        Self { values, expression, tag: PhantomData }
    }

    /// Makes a pointer of `V` from components, without checking them.
    ///
    /// Use it for vectors from outside the program. Pointers from a vocabulary are typed already.
    pub fn from_raw(values: Vec<Real>) -> Self {
        Self { values, expression: "given values".into(), tag: PhantomData }
    }

    /// Returns the components, one per dimension.
    pub fn into_values(self) -> Vec<Real> {
        self.values
    }

    /// Returns the expression that gave the pointer its value, or `given values` if [`from_raw`](Self::from_raw) made
    /// the pointer.
    pub fn expression(&self) -> &str {
        &self.expression
    }
}

impl<V: VocabTag> Deref for PointerValue<V> {
    type Target = [Real];

    fn deref(&self) -> &[Real] {
        &self.values
    }
}

impl<V: VocabTag> AsPointer<V> for PointerValue<V> {
    fn as_pointer(&self) -> PointerRef<'_, V> {
        PointerRef::from_raw(&self.values)
    }
}

impl<V: VocabTag> fmt::Debug for PointerValue<V> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "pointer of {}: {}", V::NAME, self.expression)
    }
}
