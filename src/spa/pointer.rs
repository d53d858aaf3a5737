//! Pointers outside a graph: owned values, typed by vocabulary.

use std::fmt;
use std::marker::PhantomData;
use std::ops::Deref;

use crate::sim::{AsPointer, PointerRef, Real, VocabTag};

/// An owned pointer, with the expression that it is the value of.
pub struct PointerValue<V: VocabTag> {
    values: Vec<Real>,
    expression: String,
    tag: PhantomData<fn() -> V>,
}

impl<V: VocabTag> PointerValue<V> {
    pub(crate) fn new(values: Vec<Real>, expression: String) -> Self {
        Self { values, expression, tag: PhantomData }
    }

    /// Takes the caller's word that these are components of a pointer of `V`. For vectors that come from
    /// outside; what a vocabulary gives out is typed already.
    pub fn from_raw(values: Vec<Real>) -> Self {
        Self { values, expression: "given values".into(), tag: PhantomData }
    }

    /// The components.
    pub fn into_values(self) -> Vec<Real> {
        self.values
    }

    /// Where the pointer comes from.
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
