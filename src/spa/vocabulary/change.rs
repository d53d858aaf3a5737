//! Vocabularies made from others: grown, smaller, united, translated; and pointers in words.

use std::sync::Arc;

use super::{Content, Vocabulary, VocabularyBuilder};
use crate::sim::{
    AsPointer, Fingerprint, InputSpec, OutputSpec, Pointer, Real, Scratch, ScratchSpec, Space,
    VocabTag,
};
use crate::spa::algebra::{LinearMap, dot, norm};
use crate::spa::error::VocabError;
use crate::spa::item_memory::dots;
use crate::spa::modules::{Linear, Rows, WeightedRows, weighted_rows};
use crate::spa::pointer::PointerValue;

impl<V: VocabTag> Vocabulary<V> {
    /// Starts a larger vocabulary of the same space, with all pointers of this one.
    ///
    /// Pointers of the larger vocabulary fit every port that was declared with this one.
    ///
    /// ```
    /// # use symbolt::prelude::*;
    /// # struct Parts;
    /// # impl VocabTag for Parts { const NAME: &'static str = "parts"; }
    /// let parts = VocabularyBuilder::<Parts>::new(64, Seed::new(1)).pointers(["NUT", "JIG"]).build()?;
    /// let more = parts.grow().pointer("BOLT").define("SEATED", "NUT * JIG").build()?;
    /// assert!(more.space().same_as(parts.space()));
    /// assert_eq!(more.get("NUT")?.to_vec(), parts.get("NUT")?.to_vec());
    /// # Ok::<(), symbolt::spa::VocabError>(())
    /// ```
    pub fn grow(&self) -> VocabularyBuilder<V> {
        VocabularyBuilder::from_base(self.space.number(), &self.content)
    }

    /// Returns the vocabulary of some of the names, in the same space.
    ///
    /// # Errors
    /// [`VocabError::Unknown`] for a name that this vocabulary does not have; [`VocabError::Duplicate`] for a name given
    /// twice.
    pub fn subset<'n>(&self, names: impl IntoIterator<Item = &'n str>) -> Result<Self, VocabError> {
        let mut content = self.content.without_names();
        for name in names {
            content.insert(name, &self.get(name)?)?;
        }
        Ok(Self::of(self.space.number(), content))
    }

    /// Returns the vocabulary of the names of both, in the same space. A name that both have must have the same pointer.
    ///
    /// # Errors
    /// [`VocabError::BadVector`] if `other` has another space; [`VocabError::Duplicate`] if a name has two pointers.
    pub fn union(&self, other: &Self) -> Result<Self, VocabError> {
        if !self.space.same_as(&other.space) {
            let reason = format!(
                "its space is not that of {}; vocabularies of one space come from `grow` and `subset`",
                self.space
            );
            return Err(VocabError::BadVector { name: V::NAME.into(), reason });
        }
        let mut content = (*self.content).clone();
        for (index, name) in other.names().iter().enumerate() {
            let theirs = other.content.row(index);
            if content.find(name) != Some(theirs) {
                content.insert(name, theirs)?;
            }
        }
        Ok(Self::of(self.space.number(), content))
    }

    /// Returns the identity of binding.
    pub fn identity(&self) -> PointerValue<V> {
        let mut values = vec![0.0; self.dim()];
        self.algebra().identity_into(&mut values);
        PointerValue::new(values, "identity".into())
    }

    /// Returns the power of a pointer under binding, as [`Algebra::power_into`](crate::spa::Algebra::power_into) says.
    ///
    /// # Errors
    /// [`VocabError::Exponent`] if the algebra has no such power or it is not finite; [`VocabError::BadVector`] if the pointer has another
    /// number of dimensions.
    pub fn power(
        &self,
        pointer: &impl AsPointer<V>,
        exponent: f64,
    ) -> Result<PointerValue<V>, VocabError> {
        let pointer = pointer.as_pointer();
        let text = format!("pointer ^ {exponent}");
        let base = super::check_vector(&text, pointer.to_vec(), self.dim())?;
        let mut out = vec![0.0; self.dim()];
        let mut work = self.algebra().scratch(self.dim());
        self.algebra().power_into(&base, exponent, &mut out, &mut work)?;
        if out.iter().any(|value| !value.is_finite()) {
            let reason =
                "the power has a component that is not finite; use a smaller exponent".into();
            return Err(VocabError::Exponent { exponent, reason });
        }
        Ok(PointerValue::new(out, text))
    }

    /// Returns the zero vector.
    pub fn zero(&self) -> PointerValue<V> {
        PointerValue::new(vec![0.0; self.dim()], "zero".into())
    }

    /// Returns a pointer in words, such as `0.80 NUT + 0.30 JIG`: the names with which its dot product has a magnitude of
    /// at least `least`, the greatest first. Returns `0` if there is none. Costs O(names x D).
    ///
    /// ```
    /// # use symbolt::prelude::*;
    /// # struct Parts;
    /// # impl VocabTag for Parts { const NAME: &'static str = "parts"; }
    /// let parts = VocabularyBuilder::<Parts>::new(64, Seed::new(1)).orthonormal(["NUT", "JIG", "BOLT"]).build()?;
    /// assert_eq!(parts.describe(&parts.parse("0.8 * NUT - 0.3 * BOLT")?, 0.1), "0.80 NUT - 0.30 BOLT");
    /// # Ok::<(), symbolt::spa::VocabError>(())
    /// ```
    pub fn describe(&self, pointer: &impl AsPointer<V>, least: Real) -> String {
        let pointer = pointer.as_pointer();
        let products = (0..self.len()).map(|index| dot(&pointer, self.content.row(index)));
        let mut named: Vec<(&String, Real)> = self.names().iter().zip(products).collect();
        named.retain(|(_, product)| product.abs() >= least);
        named.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
        let mut text = String::new();
        for (name, product) in named {
            let sign = match (text.is_empty(), product < 0.0) {
                (true, false) => "",
                (true, true) => "-",
                (false, false) => " + ",
                (false, true) => " - ",
            };
            text += &format!("{sign}{:.2} {name}", product.abs());
        }
        if text.is_empty() { "0".into() } else { text }
    }

    /// Returns a node that translates pointers into another vocabulary: the linear map of least norm that takes every
    /// name that both have from its pointer here to its pointer there.
    ///
    /// The map is exact for sums of these names if their pointers are linearly independent. It costs O(names x D) per
    /// tick and no tick of delay; fitting costs O(names^2 D + names^3).
    ///
    /// # Errors
    /// [`VocabError::BadVector`] if the two have no name in common.
    pub fn translation<W: VocabTag>(
        &self,
        to: &Vocabulary<W>,
    ) -> Result<Linear<Pointer<V>, Pointer<W>>, VocabError> {
        let map = self.content.translation::<V, W>(to)?;
        let specs = (InputSpec::pointer(&self.space), OutputSpec::pointer(&to.space));
        Ok(Linear::new(specs.0, specs.1, map))
    }

    /// Returns the map of [`translation`](Self::translation) from the vocabulary of `space` to this one.
    pub(in crate::spa) fn translation_from<W: VocabTag>(
        &self,
        space: &Space<W>,
    ) -> Result<Box<dyn LinearMap>, VocabError> {
        match space.attached::<Arc<Content>>() {
            Some(content) => content.translation::<W, V>(self),
            None => Err(nothing_in_common::<W>(self)),
        }
    }
}

fn nothing_in_common<V: VocabTag>(to: &Vocabulary<impl VocabTag>) -> VocabError {
    let reason = format!("it has no name in common with {}", to.space);
    VocabError::BadVector { name: V::NAME.into(), reason }
}

impl Content {
    /// Returns the map that translates from this vocabulary, of the tag `V`, to another one.
    fn translation<V: VocabTag, W: VocabTag>(
        &self,
        to: &Vocabulary<W>,
    ) -> Result<Box<dyn LinearMap>, VocabError> {
        let names = self.names().iter().enumerate();
        let pairs =
            names.filter_map(|(index, name)| Some((self.row(index), to.content.find(name)?)));
        let (keys, values): (Vec<&[Real]>, Vec<&[Real]>) = pairs.unzip();
        if keys.is_empty() {
            return Err(nothing_in_common::<V>(to));
        }
        Ok(Box::new(Translation {
            values: WeightedRows { matrix: fitted(&keys, &values, to.dim()), dim: to.dim() },
            keys: Rows { matrix: keys.concat(), dim: self.dim },
        }))
    }

    fn without_names(&self) -> Self {
        let algebra = self.algebra.clone();
        let Self { dim, seed, ceiling, best_of, .. } = *self;
        let (names, index, vectors) = Default::default();
        Self { algebra, dim, seed, ceiling, best_of, names, index, vectors }
    }

    fn insert(&mut self, name: &str, vector: &[Real]) -> Result<(), VocabError> {
        if self.index.contains_key(name) {
            return Err(VocabError::Duplicate { name: name.into() });
        }
        self.push(name.into(), vector);
        Ok(())
    }
}

/// Share of the greatest squared norm that is added to the diagonal of the keys' dot products. It keeps the fit finite
/// when keys depend on each other.
const RIDGE: f64 = 1e-9;

/// Returns `(K K^T + ridge)^-1 V`, row-major, for keys K and values V of one row per name.
fn fitted(keys: &[&[Real]], values: &[&[Real]], width: usize) -> Vec<Real> {
    let count = keys.len();
    let wide = |a: &[Real], b: &[Real]| -> f64 {
        a.iter().zip(b).map(|(x, y)| f64::from(*x) * f64::from(*y)).sum()
    };
    let longest = keys.iter().map(|key| f64::from(norm(key)).powi(2)).fold(1e-30, f64::max);
    let gram = nalgebra::DMatrix::from_fn(count, count, |i, j| {
        wide(keys[i], keys[j]) + if i == j { RIDGE * longest } else { 0.0 }
    });
    let aims = nalgebra::DMatrix::from_fn(count, width, |i, j| f64::from(values[i][j]));
    let solved = gram.clone().cholesky().map(|c| c.solve(&aims));
    let solved = solved.or_else(|| gram.lu().solve(&aims)).unwrap_or(aims);
    (0..count).flat_map(|i| solved.row(i).iter().map(|v| *v as Real).collect::<Vec<_>>()).collect()
}

/// Dot products with the keys, then a weighted sum of the fitted values.
struct Translation {
    keys: Rows,
    values: WeightedRows,
}

impl LinearMap for Translation {
    fn input_width(&self) -> usize {
        self.keys.dim
    }

    fn output_width(&self) -> usize {
        self.values.dim
    }

    fn scratch(&self) -> ScratchSpec {
        ScratchSpec { reals: self.keys.output_width(), ..ScratchSpec::default() }
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text("translation");
        self.keys.fingerprint(hash);
        self.values.fingerprint(hash);
    }

    fn apply_into(&self, input: &[Real], out: &mut [Real], scratch: &mut Scratch<'_>) {
        let weights = &mut scratch.reals[..self.keys.output_width()];
        dots(&self.keys.matrix, input, weights);
        weighted_rows(&self.values.matrix, weights, out);
    }
}
