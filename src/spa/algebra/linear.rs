//! Linear maps between vectors. Nodes apply them without a tick of delay.

use crate::sim::{Fingerprint, Real, Scratch, ScratchSpec};

/// A linear map between vectors, such as the parts of a binding that need no neurons.
pub trait LinearMap: Send + Sync {
    /// Returns the length of the input.
    fn input_width(&self) -> usize;

    /// Returns the length of the output.
    fn output_width(&self) -> usize;

    /// Returns the size of the working memory that [`apply_into`](LinearMap::apply_into) needs (default: none).
    fn scratch(&self) -> ScratchSpec {
        ScratchSpec::default()
    }

    /// Adds the identity of the map to `hash`: a name that no other kind of map has, and all numbers of the map.
    fn fingerprint(&self, hash: &mut Fingerprint);

    /// Applies the map: `out = M input`. `scratch` has the size that [`scratch`](LinearMap::scratch) returns. Must not
    /// allocate.
    fn apply_into(&self, input: &[Real], out: &mut [Real], scratch: &mut Scratch<'_>);
}

/// A binding split into linear maps and elementwise products: `bind(a, b) = back(left(a) * right(b))`.
///
/// Only the products need neurons.
pub struct ProductForm {
    /// Number of products.
    pub pairs: usize,
    /// Radius for a population that computes the products. Let x and y be the factors of one product. For random unit
    /// vectors a and b, about 99% of the values (x + y) / 2 and (x - y) / 2 lie within this radius.
    pub magnitude: Real,
    /// Map from the first vector to the first factors.
    pub left: Box<dyn LinearMap>,
    /// Map from the second vector to the second factors.
    pub right: Box<dyn LinearMap>,
    /// Map from the products to the bound vector.
    pub back: Box<dyn LinearMap>,
}
