//! The operations of a vector-symbolic architecture: binding, inverse, similarity.

mod hrr;
mod linear;
mod vtb;

use std::any::Any;
use std::fmt;

pub use hrr::Hrr;
pub use linear::{LinearMap, ProductForm};
pub use vtb::{Tvtb, Vtb};

use super::error::VocabError;
use crate::sim::{AsPointer, Real, VocabTag};

/// The working memory of an algebra for one number of dimensions: transform plans and buffers.
///
/// Make it once with [`Algebra::scratch`] and reuse it, so that no operation allocates.
pub struct Workspace(Box<dyn Any + Send + Sync>);

impl Workspace {
    /// Wraps the working memory of an algebra. Allocates.
    pub fn new(memory: impl Any + Send + Sync) -> Self {
        Self(Box::new(memory))
    }

    /// Returns the working memory; `None` if it is of another type, that is, of another algebra.
    pub fn get_mut<T: Any>(&mut self) -> Option<&mut T> {
        self.0.downcast_mut()
    }
}

impl fmt::Debug for Workspace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Workspace")
    }
}

/// A vector-symbolic algebra: it binds two vectors into one, and unbinds them again.
///
/// All slices of one call must have the length for which the workspace was made.
pub trait Algebra: Send + Sync + fmt::Debug {
    /// Returns the name of the algebra. It is part of every vocabulary's identity.
    fn name(&self) -> &'static str;

    /// Checks that the algebra can use vectors of `dim` components.
    ///
    /// # Errors
    /// [`VocabError::Dimension`] if it cannot; the error gives the valid range.
    fn check_dim(&self, dim: usize) -> Result<(), VocabError>;

    /// Makes a workspace for vectors of `dim` components, a number that [`check_dim`](Algebra::check_dim) accepts.
    /// Allocates.
    fn scratch(&self, dim: usize) -> Workspace;

    /// Binds `a` and `b`: `out = a (*) b`.
    ///
    /// # Panics
    /// If a slice has another length than `scratch` was made for, or another algebra made `scratch`.
    fn bind_into(&self, a: &[Real], b: &[Real], out: &mut [Real], scratch: &mut Workspace);

    /// Writes the inverse of `a` under binding to `out`. The inverse is linear in `a`. Each algebra documents whether
    /// its inverse is exact.
    fn inverse_into(&self, a: &[Real], out: &mut [Real]);

    /// Writes the identity of binding to `out`: `a (*) identity = a`.
    fn identity_into(&self, out: &mut [Real]);

    /// Replaces `a` by the nearest unitary vector. Binding with a unitary vector preserves norms, and its
    /// [`inverse_into`](Algebra::inverse_into) is exact.
    ///
    /// # Panics
    /// If `a` has another length than `scratch` was made for, or another algebra made `scratch`.
    fn make_unitary(&self, a: &mut [Real], scratch: &mut Workspace);

    /// Splits the binding of two changing vectors of `dim` components into linear maps and elementwise products, so
    /// that neurons can compute it. Allocates.
    fn product_form(&self, dim: usize) -> ProductForm;

    /// Returns binding with `fixed` on the right as a linear map: `out = input (*) fixed`. Allocates.
    fn bind_with(&self, fixed: &[Real]) -> Box<dyn LinearMap>;

    /// Returns binding with `fixed` on the left as a linear map: `out = fixed (*) input`. Allocates.
    ///
    /// The default is [`bind_with`](Algebra::bind_with). An algebra whose binding does not commute must override it.
    fn bind_onto(&self, fixed: &[Real]) -> Box<dyn LinearMap> {
        self.bind_with(fixed)
    }

    /// Writes the power of `a` under binding to `out`: binding with it on the right is binding with `a` as many times as
    /// the exponent says. The power -1 is the [inverse](Algebra::inverse_into). An algebra documents whether it has
    /// fractional powers.
    ///
    /// The default binds repeatedly, and needs an associative binding.
    ///
    /// # Errors
    /// [`VocabError::Exponent`] if the algebra has no such power.
    ///
    /// # Panics
    /// If a slice has another length than `scratch` was made for, or another algebra made `scratch`.
    fn power_into(
        &self,
        a: &[Real],
        exponent: f64,
        out: &mut [Real],
        scratch: &mut Workspace,
    ) -> Result<(), VocabError> {
        let whole = whole_exponent(self.name(), exponent)?;
        let mut base = a.to_vec();
        if whole < 0 {
            self.inverse_into(a, &mut base);
        }
        self.identity_into(out);
        let mut next = vec![0.0; a.len()];
        for _ in 0..whole.unsigned_abs() {
            self.bind_into(out, &base, &mut next, scratch);
            out.copy_from_slice(&next);
        }
        Ok(())
    }
}

/// Greatest magnitude of a whole exponent. Powers beyond it are out of range for almost every vector.
const MAX_EXPONENT: f64 = 1e4;

/// Returns a whole exponent as an integer.
fn whole_exponent(algebra: &'static str, exponent: f64) -> Result<i32, VocabError> {
    if exponent.fract() == 0.0 && exponent.abs() <= MAX_EXPONENT {
        return Ok(exponent as i32);
    }
    let reason = format!("{algebra} has the whole exponents from -10000 to 10000");
    Err(VocabError::Exponent { exponent, reason })
}

/// Returns the Euclidean norm of `a`, summed in double precision.
pub fn norm(a: &[Real]) -> Real {
    a.iter().map(|v| f64::from(*v) * f64::from(*v)).sum::<f64>().sqrt() as Real
}

/// Returns the dot product of `a` and `b`, summed in double precision. If one slice is longer, its surplus components
/// are ignored.
pub fn dot(a: &[Real], b: &[Real]) -> Real {
    a.iter().zip(b).map(|(x, y)| f64::from(*x) * f64::from(*y)).sum::<f64>() as Real
}

/// Returns the cosine similarity of two pointers of one vocabulary, -1 to 1; 0 if either pointer is zero.
///
/// ```
/// # use symbolt::sim::{Seed, VocabTag};
/// # use symbolt::spa::{VocabularyBuilder, cosine};
/// # struct Parts;
/// # impl VocabTag for Parts { const NAME: &'static str = "parts"; }
/// # struct Actions;
/// # impl VocabTag for Actions { const NAME: &'static str = "actions"; }
/// let parts = VocabularyBuilder::<Parts>::new(64, Seed::new(1)).pointers(["NUT", "JIG"]).build()?;
/// let actions = VocabularyBuilder::<Actions>::new(64, Seed::new(1)).pointer("GRASP").build()?;
/// assert!(cosine(&parts.get("NUT")?, &parts.parse("2 * NUT")?) > 0.999);
/// # Ok::<(), symbolt::spa::VocabError>(())
/// ```
///
/// Comparing pointers of two vocabularies does not compile:
///
/// ```compile_fail
/// # use symbolt::sim::{Seed, VocabTag};
/// # use symbolt::spa::{VocabularyBuilder, cosine};
/// # struct Parts;
/// # impl VocabTag for Parts { const NAME: &'static str = "parts"; }
/// # struct Actions;
/// # impl VocabTag for Actions { const NAME: &'static str = "actions"; }
/// let parts = VocabularyBuilder::<Parts>::new(64, Seed::new(1)).pointers(["NUT", "JIG"]).build()?;
/// let actions = VocabularyBuilder::<Actions>::new(64, Seed::new(1)).pointer("GRASP").build()?;
/// assert!(cosine(&parts.get("NUT")?, &actions.parse("2 * GRASP")?) > 0.999);
/// # Ok::<(), symbolt::spa::VocabError>(())
/// ```
pub fn cosine<V: VocabTag>(a: &impl AsPointer<V>, b: &impl AsPointer<V>) -> Real {
    cosine_of_slices(&a.as_pointer(), &b.as_pointer())
}

/// Returns the cosine similarity of two vectors of equal length, -1 to 1; 0 if either vector is zero.
pub fn cosine_of_slices(a: &[Real], b: &[Real]) -> Real {
    let lengths = norm(a) * norm(b);
    if lengths > 0.0 { dot(a, b) / lengths } else { 0.0 }
}

/// Scales `a` to norm 1. A zero vector stays zero.
pub fn normalize(a: &mut [Real]) {
    let length = norm(a);
    if length > 0.0 {
        a.iter_mut().for_each(|v| *v /= length);
    }
}
