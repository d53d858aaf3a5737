//! Lists as pointers: items bound to the powers of a position.

use super::Vocabulary;
use crate::sim::VocabTag;
use crate::spa::error::VocabError;
use crate::spa::pointer::PointerValue;

impl<V: VocabTag> Vocabulary<V> {
    /// Returns a list: the sum of its items, each bound to a power of `position` (Plate 1995, section 2.7). The item at
    /// index 0 is bound to the first power.
    ///
    /// Unbinding a power gives the item there, with noise from the other items; `position` should be a unitary pointer,
    /// whose powers are unbound exactly. Items are expressions, such as names.
    ///
    /// ```
    /// # use symbolt::prelude::*;
    /// # struct Words;
    /// # impl VocabTag for Words { const NAME: &'static str = "words"; }
    /// let words = VocabularyBuilder::<Words>::new(512, Seed::new(1))
    ///     .pointers(["ONE", "TWO", "THREE"])
    ///     .unitary("POSITION")
    ///     .build()?;
    /// let list = words.list("POSITION", ["TWO", "THREE", "TWO"])?;
    /// let second = words.power(&words.get("POSITION")?, 2.0)?;
    /// let item = words.value(&list * !&second)?;
    /// assert!(dot(&item, &words.get("THREE")?) > 0.8);
    /// assert!(dot(&item, &words.get("TWO")?) < 0.3);
    /// # Ok::<(), symbolt::spa::VocabError>(())
    /// ```
    ///
    /// # Errors
    /// As for [`parse`](Self::parse); [`VocabError::BadVector`] if there are no items.
    pub fn list<'e>(
        &self,
        position: &str,
        items: impl IntoIterator<Item = &'e str>,
    ) -> Result<PointerValue<V>, VocabError> {
        let base = self.parse(position)?;
        let mut work = self.algebra().scratch(self.dim());
        let (mut sum, mut bound) = (vec![0.0; self.dim()], vec![0.0; self.dim()]);
        let mut texts = Vec::new();
        for (index, item) in items.into_iter().enumerate() {
            let power = self.power(&base, (index + 1) as f64)?;
            self.algebra().bind_into(&self.parse(item)?, &power, &mut bound, &mut work);
            sum.iter_mut().zip(&bound).for_each(|(sum, value)| *sum += value);
            texts.push(item);
        }
        if texts.is_empty() {
            let reason = "the list has no items; expected at least one".into();
            return Err(VocabError::BadVector { name: "list".into(), reason });
        }
        let sum = super::check_vector("list", sum, self.dim())?;
        Ok(PointerValue::new(sum, format!("list of {} by {position}", texts.join(", "))))
    }
}
