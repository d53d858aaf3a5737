//! The number types of the engine, and ranges of numbers.

use std::ops::Range;

/// The number type of all signals.
pub type Real = f32;

/// A complex number in scratch memory.
pub type Complex = rustfft::num_complex::Complex<f32>;

/// A range with `u32` bounds, half the size of a `Range<usize>`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Span {
    pub start: u32,
    pub end: u32,
}

impl Span {
    pub fn of(self) -> Range<usize> {
        self.start as usize..self.end as usize
    }

    pub fn len(self) -> usize {
        (self.end - self.start) as usize
    }
}
