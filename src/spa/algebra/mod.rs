//! The operations on vectors that a vector-symbolic architecture is made of.

mod hrr;
mod linear;

use std::any::Any;
use std::fmt;

pub use hrr::Hrr;
pub use linear::{LinearMap, ProductForm};

use super::error::VocabError;
use crate::sim::{AsPointer, Real, VocabTag};

/// Working memory of an algebra at one dimension: its plans and buffers, made once by
/// [`Algebra::scratch`] and reused, so that no operation allocates.
pub struct Workspace(pub(crate) Box<dyn Any + Send + Sync>);

impl fmt::Debug for Workspace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Workspace")
    }
}

/// A vector-symbolic algebra: how two vectors are bound into one and how that is undone.
///
/// All slices of one call have the length for which the workspace was made.
pub trait Algebra: Send + Sync + fmt::Debug {
    /// The algebra's name, part of the identity of every vocabulary.
    fn name(&self) -> &'static str;

    /// Whether vectors of `dim` components can be used.
    ///
    /// # Errors
    /// [`VocabError::Dimension`] with the reason.
    fn check_dim(&self, dim: usize) -> Result<(), VocabError>;

    /// Plans and buffers for `dim` components, a dimension that [`check_dim`](Algebra::check_dim)
    /// accepts. Allocates.
    fn scratch(&self, dim: usize) -> Workspace;

    /// `out = a (*) b`.
    ///
    /// # Panics
    /// If a slice has another length than `scratch` was made for, or `scratch` is another
    /// algebra's: a mistake in the calling code.
    fn bind_into(&self, a: &[Real], b: &[Real], out: &mut [Real], scratch: &mut Workspace);

    /// The inverse of `a` under binding; each algebra says whether it is exact. Linear in `a`.
    fn inverse_into(&self, a: &[Real], out: &mut [Real]);

    /// The identity of binding: `a (*) identity = a`.
    fn identity_into(&self, out: &mut [Real]);

    /// Replaces `a` by the nearest vector whose binding preserves lengths and whose
    /// [`inverse_into`](Algebra::inverse_into) is exact.
    ///
    /// # Panics
    /// As [`bind_into`](Algebra::bind_into).
    fn make_unitary(&self, a: &mut [Real], scratch: &mut Workspace);

    /// The binding of two running vectors as linear maps around elementwise products. Allocates.
    fn product_form(&self, dim: usize) -> ProductForm;

    /// Binding with the vector `fixed`, a linear map. Allocates.
    fn bind_with(&self, fixed: &[Real]) -> Box<dyn LinearMap>;
}

/// Euclidean length of `a`, summed in double precision.
pub fn norm(a: &[Real]) -> Real {
    a.iter().map(|v| f64::from(*v) * f64::from(*v)).sum::<f64>().sqrt() as Real
}

/// Dot product of `a` and `b`, summed in double precision.
pub fn dot(a: &[Real], b: &[Real]) -> Real {
    a.iter().zip(b).map(|(x, y)| f64::from(*x) * f64::from(*y)).sum::<f64>() as Real
}

/// Cosine of the angle between two pointers of one vocabulary, -1 to 1; 0 if either is zero.
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
/// Pointers of two vocabularies are not comparable, and the program does not compile:
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

/// Cosine of the angle between two vectors of any origin, -1 to 1; 0 if either is zero.
pub fn cosine_of_slices(a: &[Real], b: &[Real]) -> Real {
    let lengths = norm(a) * norm(b);
    if lengths > 0.0 { dot(a, b) / lengths } else { 0.0 }
}

/// Scales `a` to length 1; a zero vector stays as it is.
pub fn normalize(a: &mut [Real]) {
    let length = norm(a);
    if length > 0.0 {
        a.iter_mut().for_each(|v| *v /= length);
    }
}
