//! Vocabularies: named pointers of one space, drawn from a seed.
//!
//! A vocabulary never changes. [`Vocabulary::grow`], [`Vocabulary::subset`] and [`Vocabulary::union`] make others of the
//! same space, so that their pointers fit the same ports.

mod builder;
mod change;
mod evaluate;
mod lists;
mod name;
mod of_output;
mod room;
mod similarities;
mod stimulus;

use std::collections::HashMap;
use std::sync::Arc;

use rand::{Rng, RngExt};
use rand_distr::StandardNormal;

pub use builder::VocabularyBuilder;
pub use name::Name;
pub use of_output::OutputVocabulary;

use super::algebra::{Algebra, normalize};
use super::error::VocabError;
use super::pointer::PointerValue;
use crate::sim::{PointerRef, Real, Seed, Space, VocabTag};

/// Draws a random unit vector of `dim` components, uniformly on the sphere.
///
/// The components are independent normal numbers, scaled to norm 1. The result depends only on `dim` (any number)
/// and `seed`.
pub fn random_pointer(dim: usize, seed: Seed) -> Vec<Real> {
    draw_pointer(dim, &mut seed.rng())
}

/// Draws a random unit vector from `rng`: `dim` normal numbers in single precision, scaled to norm 1.
pub(crate) fn draw_pointer<R: Rng>(dim: usize, rng: &mut R) -> Vec<Real> {
    let mut vector: Vec<Real> = (0..dim).map(|_| rng.sample(StandardNormal)).collect();
    normalize(&mut vector);
    vector
}

fn check_vector(name: &str, values: Vec<Real>, dim: usize) -> Result<Vec<Real>, VocabError> {
    let reason = if values.len() != dim {
        format!("the vector has {} components; expected {dim}", values.len())
    } else if let Some(at) = values.iter().position(|v| !v.is_finite()) {
        format!("component {at} is {}; expected a finite number", values[at])
    } else {
        return Ok(values);
    };
    Err(VocabError::BadVector { name: name.into(), reason })
}

/// Named pointers of one space. Neither names nor pointers change after [`VocabularyBuilder::build`].
///
/// Cloning costs nothing: clones share the pointers.
pub struct Vocabulary<V: VocabTag> {
    space: Space<V>,
    content: Arc<Content>,
}

/// The pointers of a vocabulary, and how they were drawn. It travels with every port of the vocabulary's space.
#[derive(Clone)]
pub(crate) struct Content {
    pub algebra: Arc<dyn Algebra>,
    dim: usize,
    seed: Seed,
    ceiling: Option<Real>,
    best_of: Option<u64>,
    names: Vec<String>,
    index: HashMap<String, usize>,
    /// Row-major, one row per name.
    vectors: Vec<Real>,
}

impl Content {
    /// Returns the pointer called `name`; `None` if there is none.
    pub fn find(&self, name: &str) -> Option<&[Real]> {
        self.index.get(name).map(|index| self.row(*index))
    }

    /// Returns the names, in the order in which they were added.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    fn row(&self, index: usize) -> &[Real] {
        &self.vectors[index * self.dim..(index + 1) * self.dim]
    }

    fn push(&mut self, name: String, vector: &[Real]) {
        self.index.insert(name.clone(), self.names.len());
        self.names.push(name);
        self.vectors.extend_from_slice(vector);
    }
}

impl<V: VocabTag> Clone for Vocabulary<V> {
    fn clone(&self) -> Self {
        Self { space: self.space.clone(), content: self.content.clone() }
    }
}

impl<V: VocabTag> std::fmt::Debug for Vocabulary<V> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Vocabulary({})", self.space)
    }
}

impl<V: VocabTag> Vocabulary<V> {
    /// Makes a vocabulary of a space with this identity.
    fn of(id: u64, content: Content) -> Self {
        let label = format!(
            "the vocabulary `{}` (D = {}, {}, seed {}, {} names)",
            V::NAME,
            content.dim,
            content.algebra.name(),
            content.seed,
            content.names.len()
        );
        let content = Arc::new(content);
        let space = Space::new(id, content.dim, label).with_attached(content.clone());
        Self { space, content }
    }

    /// Returns the space of the pointers. Ports for these pointers are declared with it.
    pub fn space(&self) -> &Space<V> {
        &self.space
    }

    /// Returns the number of dimensions.
    pub fn dim(&self) -> usize {
        self.space.width()
    }

    /// Returns the number of names.
    pub fn len(&self) -> usize {
        self.content.names.len()
    }

    /// Returns whether there are no names.
    pub fn is_empty(&self) -> bool {
        self.content.names.is_empty()
    }

    /// Returns the names, in the order in which they were added.
    pub fn names(&self) -> &[String] {
        &self.content.names
    }

    /// Returns the algebra.
    pub fn algebra(&self) -> &Arc<dyn Algebra> {
        &self.content.algebra
    }

    /// Returns all vectors as a row-major matrix, one row of `dim` numbers per name, in the order of
    /// [`names`](Self::names).
    pub fn matrix(&self) -> &[Real] {
        &self.content.vectors
    }

    /// Returns the pointer of name number `index`, counted from 0. Returns `None` if there are fewer names.
    pub fn vector(&self, index: usize) -> Option<PointerRef<'_, V>> {
        let dim = self.dim();
        self.content.vectors.get(index * dim..(index + 1) * dim).map(PointerRef::from_raw)
    }

    /// Returns the pointer called `name`.
    ///
    /// # Errors
    /// [`VocabError::Unknown`] if there is no such name; the error lists all names.
    pub fn get(&self, name: &str) -> Result<PointerRef<'_, V>, VocabError> {
        Ok(PointerRef::from_raw(self.content.row(self.position(name)?)))
    }

    /// Returns the index of `name` in [`names`](Self::names).
    ///
    /// # Errors
    /// [`VocabError::Unknown`] if there is no such name; the error lists all names.
    pub fn position(&self, name: &str) -> Result<usize, VocabError> {
        self.content.position(V::NAME, name)
    }

    /// Evaluates an expression such as `PRECONDITION * (NUT_IN_JIG + BOLT_IN_JIG)`.
    ///
    /// `+` and `-` add and subtract. `*` binds two pointers or scales a pointer by a number. `~` inverts, a leading
    /// `-` negates, and parentheses group. `0` is the zero vector. The value is not normalised. Allocates.
    ///
    /// # Errors
    /// - [`VocabError::Syntax`] if the text is neither 0 nor an expression with at least one name; the error shows the position;
    /// - [`VocabError::Unknown`] if a name is not in the vocabulary;
    /// - [`VocabError::BadVector`] if the value is not finite.
    pub fn parse(&self, text: &str) -> Result<PointerValue<V>, VocabError> {
        Ok(PointerValue::new(self.content.parse(V::NAME, text)?, text.trim().to_owned()))
    }
}
