//! Sets of fluents as words of bits.

/// A set of fluents, 64 in a word.
pub(crate) type Bits = Box<[u64]>;

/// Returns the set of some fluents, in so many words.
pub(crate) fn bits(fluents: impl IntoIterator<Item = usize>, words: usize) -> Bits {
    let mut set = vec![0; words];
    fluents.into_iter().for_each(|f| set[f / 64] |= 1 << (f % 64));
    set.into()
}

/// Returns whether all of a set are in another.
pub(crate) fn contains(state: &[u64], all: &[u64]) -> bool {
    state.iter().zip(all).all(|(state, all)| state & all == *all)
}
