//! A value that never changes.

use super::stimulus::Stimulus;
use crate::sim::describe::builder::{Module, Scope};
use crate::sim::describe::handle::Out;
use crate::sim::describe::kind::{AsPointer, Kind, Pointer, Scalar, Space, Vector, VocabTag};
use crate::sim::describe::port::OutputSpec;
use crate::sim::real::Real;

/// An output with a constant value.
///
/// Adding it to a graph returns the handle of the output. A value that is not finite is a fault when the graph is
/// built. Costs one copy per tick.
pub struct Constant<K: Kind> {
    spec: OutputSpec<K>,
    values: Vec<Real>,
}

impl<K: Kind> Constant<K> {
    /// Creates a constant of any kind.
    pub(crate) fn of(spec: OutputSpec<K>, values: &[Real]) -> Self {
        Self { spec, values: values.to_vec() }
    }
}

impl Constant<Scalar> {
    /// Creates a constant number.
    pub fn scalar(value: Real) -> Self {
        Self { spec: OutputSpec::scalar(), values: vec![value] }
    }
}

impl Constant<Vector> {
    /// Creates a constant vector.
    pub fn vector(values: &[Real]) -> Self {
        Self { spec: OutputSpec::vector(values.len()), values: values.to_vec() }
    }
}

impl<V: VocabTag> Constant<Pointer<V>> {
    /// Creates a constant pointer of `space`. `build` reports a `value` with another number of dimensions.
    ///
    /// The value must have the same tag as the space:
    ///
    /// ```
    /// # use symbolt::sim::{Constant, PointerRef, Space, VocabTag};
    /// # struct Parts;
    /// # impl VocabTag for Parts { const NAME: &'static str = "parts"; }
    /// # struct Actions;
    /// # impl VocabTag for Actions { const NAME: &'static str = "actions"; }
    /// let (parts, actions) = (Space::<Parts>::new(1, 2, "parts"), Space::<Actions>::new(2, 2, "actions"));
    /// let nut = PointerRef::<Parts>::from_raw(&[1.0, 0.0]);
    /// let grasp = PointerRef::<Actions>::from_raw(&[0.0, 1.0]);
    /// Constant::pointer(&parts, &nut);
    /// ```
    ///
    /// A value with another tag does not compile:
    ///
    /// ```compile_fail
    /// # use symbolt::sim::{Constant, PointerRef, Space, VocabTag};
    /// # struct Parts;
    /// # impl VocabTag for Parts { const NAME: &'static str = "parts"; }
    /// # struct Actions;
    /// # impl VocabTag for Actions { const NAME: &'static str = "actions"; }
    /// let (parts, actions) = (Space::<Parts>::new(1, 2, "parts"), Space::<Actions>::new(2, 2, "actions"));
    /// let nut = PointerRef::<Parts>::from_raw(&[1.0, 0.0]);
    /// let grasp = PointerRef::<Actions>::from_raw(&[0.0, 1.0]);
    /// Constant::pointer(&actions, &nut);
    /// ```
    pub fn pointer(space: &Space<V>, value: &impl AsPointer<V>) -> Self {
        Self { spec: OutputSpec::pointer(space), values: value.as_pointer().to_vec() }
    }
}

impl<K: Kind> Module for Constant<K> {
    type Ports = Out<K>;

    fn expand(self, scope: &mut Scope<'_>) -> Out<K> {
        Stimulus::new(self.spec, self.values).expand(scope)
    }
}
