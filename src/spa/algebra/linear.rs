//! Linear maps between vectors, applied by nodes without a tick of delay.

use crate::sim::{Fingerprint, Real, Scratch, ScratchSpec};

/// A linear map: the parts of a binding that need no neurons.
pub trait LinearMap: Send + Sync {
    /// Numbers taken.
    fn input_width(&self) -> usize;

    /// Numbers given.
    fn output_width(&self) -> usize;

    /// The working memory that [`apply_into`](LinearMap::apply_into) is lent.
    fn scratch(&self) -> ScratchSpec;

    /// Adds what the map is to `hash`: a name of its own, and its numbers.
    fn fingerprint(&self, hash: &mut Fingerprint);

    /// `out = M input`. Does not allocate.
    fn apply_into(&self, input: &[Real], out: &mut [Real], scratch: &mut Scratch<'_>);
}

/// A binding taken apart: `bind(a, b) = back(left(a) * right(b))` with elementwise products. The
/// products are all that a population has to compute.
pub struct ProductForm {
    /// How many products there are.
    pub pairs: usize,
    /// What the halves of the factors' sums and differences stay below for random unit vectors, but for
    /// about one of a hundred: the range that a population for the products should have.
    pub magnitude: Real,
    /// From the first vector to the first factors.
    pub left: Box<dyn LinearMap>,
    /// From the second vector to the second factors.
    pub right: Box<dyn LinearMap>,
    /// From the products to the bound vector.
    pub back: Box<dyn LinearMap>,
}
