//! Pointers outside a graph: borrowed views and owned values, typed by vocabulary.

use std::fmt;
use std::marker::PhantomData;
use std::ops::Deref;

use crate::sim::{Real, VocabTag};

/// A borrowed pointer of the vocabularies tagged `V`.
pub struct PointerRef<'a, V: VocabTag> {
    values: &'a [Real],
    tag: PhantomData<fn() -> V>,
}

impl<'a, V: VocabTag> PointerRef<'a, V> {
    pub(crate) fn new(values: &'a [Real]) -> Self {
        Self { values, tag: PhantomData }
    }

    /// The components, for as long as the vocabulary lives.
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

impl<V: VocabTag> fmt::Debug for PointerRef<'_, V> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "pointer of {} ({} dimensions)", V::NAME, self.values.len())
    }
}

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

impl<V: VocabTag> fmt::Debug for PointerValue<V> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "pointer of {}: {}", V::NAME, self.expression)
    }
}
