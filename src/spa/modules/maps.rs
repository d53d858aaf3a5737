//! Linear maps with a structure, so that they cost less than a matrix.

use std::ops::Range;
use std::sync::Arc;

use crate::sim::{Fingerprint, Real, Scratch, ScratchSpec};
use crate::spa::algebra::{Algebra, LinearMap};
use crate::spa::item_memory::dots;

/// The dot products of a vector with the rows of a matrix.
pub(crate) struct Rows {
    pub matrix: Vec<Real>,
    pub dim: usize,
}

impl Rows {
    /// Makes the map of one row.
    pub fn one(row: Vec<Real>) -> Self {
        Self { dim: row.len(), matrix: row }
    }
}

impl LinearMap for Rows {
    fn input_width(&self) -> usize {
        self.dim
    }

    fn output_width(&self) -> usize {
        self.matrix.len() / self.dim.max(1)
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text("rows").reals(&self.matrix);
    }

    fn apply_into(&self, input: &[Real], out: &mut [Real], _scratch: &mut Scratch<'_>) {
        dots(&self.matrix, input, out);
    }
}

/// A weighted sum of the rows of a matrix.
pub(crate) struct WeightedRows {
    pub matrix: Vec<Real>,
    pub dim: usize,
}

impl WeightedRows {
    /// Makes the map of one row.
    pub fn one(row: Vec<Real>) -> Self {
        Self { dim: row.len(), matrix: row }
    }
}

impl LinearMap for WeightedRows {
    fn input_width(&self) -> usize {
        self.matrix.len() / self.dim.max(1)
    }

    fn output_width(&self) -> usize {
        self.dim
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text("weighted rows").reals(&self.matrix);
    }

    fn apply_into(&self, input: &[Real], out: &mut [Real], _scratch: &mut Scratch<'_>) {
        weighted_rows(&self.matrix, input, out);
    }
}

/// Writes the weighted sum of the rows of a matrix. A row of weight zero costs nothing.
pub(crate) fn weighted_rows(matrix: &[Real], weights: &[Real], out: &mut [Real]) {
    out.fill(0.0);
    for (row, weight) in matrix.chunks_exact(out.len()).zip(weights) {
        if *weight != 0.0 {
            out.iter_mut().zip(row).for_each(|(sum, value)| *sum += weight * value);
        }
    }
}

/// Scales a vector, or spreads one number over a vector.
pub(crate) struct Spread {
    pub from: usize,
    pub to: usize,
    pub factor: Real,
}

impl LinearMap for Spread {
    fn input_width(&self) -> usize {
        self.from
    }

    fn output_width(&self) -> usize {
        self.to
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text("spread").number(self.from as u64).number(self.to as u64).reals(&[self.factor]);
    }

    fn apply_into(&self, input: &[Real], out: &mut [Real], _scratch: &mut Scratch<'_>) {
        match input {
            [one] => out.fill(self.factor * one),
            _ => out.iter_mut().zip(input).for_each(|(to, from)| *to = self.factor * from),
        }
    }
}

/// Takes consecutive components of a vector.
pub(crate) struct Slice {
    pub from: usize,
    pub range: Range<usize>,
}

impl LinearMap for Slice {
    fn input_width(&self) -> usize {
        self.from
    }

    fn output_width(&self) -> usize {
        self.range.len()
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        let Range { start, end } = self.range;
        hash.text("slice").number(self.from as u64).number(start as u64).number(end as u64);
    }

    fn apply_into(&self, input: &[Real], out: &mut [Real], _scratch: &mut Scratch<'_>) {
        out.copy_from_slice(&input[self.range.clone()]);
    }
}

/// Gives every component the weighted sum of all components, or of all others.
pub(crate) struct Pooled {
    pub weights: Vec<Real>,
    /// Leaves out the component itself. Costs O(width) for each component that is not zero.
    pub others: bool,
}

impl LinearMap for Pooled {
    fn input_width(&self) -> usize {
        self.weights.len()
    }

    fn output_width(&self) -> usize {
        self.weights.len()
    }

    fn scratch(&self) -> ScratchSpec {
        ScratchSpec { reals: self.weights.len(), ..ScratchSpec::default() }
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text("pooled").reals(&self.weights).number(u64::from(self.others));
    }

    fn apply_into(&self, input: &[Real], out: &mut [Real], scratch: &mut Scratch<'_>) {
        let sum = |values: &[Real]| {
            let mut sum = [0.0];
            dots(&self.weights, values, &mut sum);
            sum[0]
        };
        out.fill(sum(input));
        if self.others {
            let others = &mut *scratch.reals;
            others.copy_from_slice(input);
            // Subtracting from the whole sum would round.
            for (at, value) in input.iter().enumerate().filter(|(_, value)| **value != 0.0) {
                others[at] = 0.0;
                out[at] = sum(others);
                others[at] = *value;
            }
        }
    }
}

/// A matrix by columns: for each input, the outputs that it reaches.
pub(crate) struct Sparse {
    to: usize,
    /// Where the weights of each column begin, and where those of the last one end.
    starts: Vec<usize>,
    /// Output and factor of each weight, column by column.
    weights: Vec<(u32, Real)>,
}

impl Sparse {
    /// Makes a matrix from weights: input, output, factor. Their positions lie within its widths, or they are left out. Weights of
    /// one column are added in the order in which they are given.
    pub fn new(from: usize, to: usize, weights: &[(usize, usize, Real)]) -> Self {
        let inside = || weights.iter().filter(|(input, output, _)| *input < from && *output < to);
        let mut starts = vec![0; from + 1];
        inside().for_each(|(input, ..)| starts[input + 1] += 1);
        for column in 0..from {
            starts[column + 1] += starts[column];
        }
        let mut free = starts.clone();
        let mut sorted = vec![(0, 0.0); starts[from]];
        for (input, output, factor) in inside() {
            sorted[free[*input]] = (*output as u32, *factor);
            free[*input] += 1;
        }
        Self { to, starts, weights: sorted }
    }

    fn columns(&self) -> impl Iterator<Item = &[(u32, Real)]> {
        self.starts.windows(2).map(|ends| &self.weights[ends[0]..ends[1]])
    }
}

impl LinearMap for Sparse {
    fn input_width(&self) -> usize {
        self.starts.len() - 1
    }

    fn output_width(&self) -> usize {
        self.to
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text("sparse").number(self.to as u64);
        for column in self.columns() {
            hash.number(column.len() as u64);
            for (output, factor) in column {
                hash.number(u64::from(*output)).reals(&[*factor]);
            }
        }
    }

    fn apply_into(&self, input: &[Real], out: &mut [Real], _scratch: &mut Scratch<'_>) {
        const GROUP: usize = 8;
        out.fill(0.0);
        let input = &input[..input.len().min(self.input_width())];
        for (group, values) in input.chunks(GROUP).enumerate() {
            // Most inputs are zero: facts that do not hold, operators that are not chosen.
            if values.iter().fold(0, |bits, value| bits | value.to_bits() << 1) == 0 {
                continue;
            }
            for (value, column) in values.iter().zip(group * GROUP..) {
                if *value != 0.0 {
                    let weights = self.starts[column]..self.starts[column + 1];
                    for (output, factor) in &self.weights[weights] {
                        out[*output as usize] += value * factor;
                    }
                }
            }
        }
    }
}

/// The algebra's inverse as a linear map.
pub(crate) struct Inverse {
    pub algebra: Arc<dyn Algebra>,
    pub dim: usize,
}

impl LinearMap for Inverse {
    fn input_width(&self) -> usize {
        self.dim
    }

    fn output_width(&self) -> usize {
        self.dim
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text("inverse").text(self.algebra.name());
    }

    fn apply_into(&self, input: &[Real], out: &mut [Real], _scratch: &mut Scratch<'_>) {
        self.algebra.inverse_into(input, out);
    }
}
