//! The number types of the engine, and ranges of numbers.

use std::ops::Range;

/// The number type of all signals.
pub type Real = f32;

/// A number, or an array of numbers: what closures of signals and of decoded functions return.
///
/// ```
/// use symbolt::sim::Numbers;
/// let mut out = [0.0; 2];
/// [0.5, -0.5].write(&mut out);
/// assert_eq!((out, <[f64; 2]>::WIDTH, f32::WIDTH), ([0.5, -0.5], 2, 1));
/// ```
pub trait Numbers {
    /// How many numbers it holds.
    const WIDTH: usize;

    /// Writes the numbers to `out`, which holds [`WIDTH`](Self::WIDTH).
    fn write(self, out: &mut [Real]);
}

impl Numbers for Real {
    const WIDTH: usize = 1;

    fn write(self, out: &mut [Real]) {
        out.fill(self);
    }
}

impl Numbers for f64 {
    const WIDTH: usize = 1;

    fn write(self, out: &mut [Real]) {
        let number: Self = self;
        out.fill(number as Real);
    }
}

impl<T: Numbers, const N: usize> Numbers for [T; N] {
    const WIDTH: usize = N * T::WIDTH;

    fn write(self, out: &mut [Real]) {
        // Chunks cannot be empty.
        let parts = out.chunks_mut(T::WIDTH.max(1));
        self.into_iter().zip(parts).for_each(|(value, part)| value.write(part));
    }
}

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
