//! The dense algebra of a decoder solve: a symmetric product, the Cholesky factor and its two substitutions.
//!
//! Large matrices are split into halves, so that most of the work is matrix products, which `ndarray` computes with
//! vector instructions. Small ones are worked row by row. A library of linear algebra was tried: it was no faster
//! here, and took a fifth of a release build to compile.

use ndarray::linalg::general_mat_mul;
use ndarray::{ArrayView2, ArrayViewMut1, ArrayViewMut2, Axis, NdFloat, s};

/// Rows up to which plain loops are faster than halves.
const LEAF: usize = 48;

/// Returns where to split `n` rows: near the middle, at a multiple of 16.
fn half(n: usize) -> usize {
    (n / 2).next_multiple_of(16)
}

/// Subtracts `factor` times `x` from `y`.
fn subtract<T: NdFloat>(mut y: ArrayViewMut1<'_, T>, factor: T, x: &[T]) {
    debug_assert!(y.as_slice().is_some(), "rows are contiguous");
    if let Some(y) = y.as_slice_mut() {
        for (y, x) in y.iter_mut().zip(x) {
            *y -= factor * *x;
        }
    }
}

/// Rows of a symmetric product that are computed at once.
const STRIP: usize = 32;

/// Sets `out` to `scale * out + alpha * A^T A`. Only the upper triangle is complete. Columns of A belong to rows of
/// `out`.
pub(super) fn add_gram<T: NdFloat>(
    alpha: T,
    a: ArrayView2<'_, T>,
    scale: T,
    mut out: ArrayViewMut2<'_, T>,
) {
    let n = out.nrows();
    // A large matrix is split first: the squares beside the diagonal are the fastest products.
    if n > 8 * STRIP {
        let at = half(n);
        let (a1, a2) = a.split_at(Axis(1), at);
        let (upper, lower) = out.split_at(Axis(0), at);
        let (out11, mut out12) = upper.split_at(Axis(1), at);
        let (_, out22) = lower.split_at(Axis(1), at);
        add_gram(alpha, a1, scale, out11);
        general_mat_mul(alpha, &a1.t(), &a2, scale, &mut out12);
        return add_gram(alpha, a2, scale, out22);
    }
    for from in (0..n).step_by(STRIP) {
        let to = (from + STRIP).min(n);
        let (strip, rest) = (a.slice(s![.., from..to]), a.slice(s![.., from..]));
        let mut out = out.slice_mut(s![from..to, from..]);
        general_mat_mul(alpha, &strip.t(), &rest, scale, &mut out);
    }
}

/// Replaces the upper triangle of a symmetric matrix by its Cholesky factor U, `A = U^T U`. The values of the lower
/// triangle have no effect, but some are overwritten. Rows are contiguous. Costs `n^3 / 3` operations. Returns `None`
/// if the matrix is not positive definite.
fn cholesky<T: NdFloat>(mut a: ArrayViewMut2<'_, T>) -> Option<()> {
    let n = a.nrows();
    if n <= LEAF {
        for j in 0..n {
            let (mut above, mut below) = a.view_mut().split_at(Axis(0), j + 1);
            let mut row = above.row_mut(j);
            let row = &mut row.as_slice_mut()?[j..];
            if row[0] <= T::zero() || row[0].is_nan() {
                return None;
            }
            let pivot = row[0].sqrt();
            row.iter_mut().for_each(|value| *value /= pivot);
            for (i, later) in below.rows_mut().into_iter().enumerate() {
                let (_, later) = later.split_at(Axis(0), j + 1 + i);
                subtract(later, row[i + 1], &row[i + 1..]);
            }
        }
        return Some(());
    }
    let at = half(n);
    let (upper, lower) = a.split_at(Axis(0), at);
    let (mut a11, mut a12) = upper.split_at(Axis(1), at);
    let (_, mut a22) = lower.split_at(Axis(1), at);
    cholesky(a11.view_mut())?;
    solve_transposed(a11.view(), a12.view_mut());
    add_gram(-T::one(), a12.view(), T::one(), a22.view_mut());
    cholesky(a22)
}

/// Solves `U^T Y = X` in place for an upper triangular U.
fn solve_transposed<T: NdFloat>(u: ArrayView2<'_, T>, mut x: ArrayViewMut2<'_, T>) {
    let n = u.nrows();
    if n <= LEAF {
        for i in 0..n {
            let (mut above, mut below) = x.view_mut().split_at(Axis(0), i + 1);
            let mut row = above.row_mut(i);
            let Some(row) = row.as_slice_mut() else { return };
            row.iter_mut().for_each(|value| *value /= u[(i, i)]);
            for (k, later) in below.rows_mut().into_iter().enumerate() {
                subtract(later, u[(i, i + 1 + k)], row);
            }
        }
        return;
    }
    let at = half(n);
    let (upper, lower) = u.split_at(Axis(0), at);
    let ((u11, u12), u22) = (upper.split_at(Axis(1), at), lower.split_at(Axis(1), at).1);
    let (mut x1, mut x2) = x.split_at(Axis(0), at);
    solve_transposed(u11, x1.view_mut());
    general_mat_mul(-T::one(), &u12.t(), &x1, T::one(), &mut x2);
    solve_transposed(u22, x2);
}

/// Solves `U Y = X` in place for an upper triangular U.
fn solve_upper<T: NdFloat>(u: ArrayView2<'_, T>, mut x: ArrayViewMut2<'_, T>) {
    let n = u.nrows();
    if n <= LEAF {
        for i in (0..n).rev() {
            let (mut above, mut below) = x.view_mut().split_at(Axis(0), i);
            let mut row = below.row_mut(0);
            let Some(row) = row.as_slice_mut() else { return };
            row.iter_mut().for_each(|value| *value /= u[(i, i)]);
            for (k, earlier) in above.rows_mut().into_iter().enumerate() {
                subtract(earlier, u[(k, i)], row);
            }
        }
        return;
    }
    let at = half(n);
    let (upper, lower) = u.split_at(Axis(0), at);
    let ((u11, u12), u22) = (upper.split_at(Axis(1), at), lower.split_at(Axis(1), at).1);
    let (mut x1, mut x2) = x.split_at(Axis(0), at);
    solve_upper(u22, x2.view_mut());
    general_mat_mul(-T::one(), &u12, &x2, T::one(), &mut x1);
    solve_upper(u11, x1);
}

/// Solves `A Y = X` in place for a symmetric positive definite A, one right-hand side per column of `x`. Reads the
/// upper triangle of `a` and overwrites it by the Cholesky factor. Rows of both are contiguous. Costs `n^3 / 3`
/// operations and `2 n^2` for each column. Returns `None` if A is not positive definite.
pub(super) fn solve<T: NdFloat>(
    mut a: ArrayViewMut2<'_, T>,
    mut x: ArrayViewMut2<'_, T>,
) -> Option<()> {
    cholesky(a.view_mut())?;
    solve_transposed(a.view(), x.view_mut());
    solve_upper(a.view(), x);
    Some(())
}

#[cfg(test)]
mod tests {
    use ndarray::Array2;
    use rand::RngExt;

    use super::*;
    use crate::sim::Seed;

    fn drawn(rows: usize, columns: usize, seed: u64) -> Array2<f64> {
        let mut rng = Seed::new(seed).rng();
        Array2::from_shape_fn((rows, columns), |_| rng.random::<f64>() - 0.3)
    }

    #[test]
    fn a_solution_satisfies_its_system_at_all_sizes_around_the_leaf() {
        for n in [1, 2, 17, LEAF - 1, LEAF, LEAF + 1, 2 * LEAF + 1, 4 * LEAF, 257] {
            let (a, wanted) = (drawn(2 * n, n, n as u64), drawn(n, 3, 7));
            let mut gram = Array2::<f64>::zeros((n, n));
            add_gram(1.0, a.view(), 0.0, gram.view_mut());
            let whole = a.t().dot(&a);
            for i in 0..n {
                for j in i..n {
                    assert!((gram[(i, j)] - whole[(i, j)]).abs() < 1e-9, "{n}: {i}, {j}");
                }
                // The lower triangle is not read.
                (0..i).for_each(|j| gram[(i, j)] = f64::NAN);
            }
            let mut solved = wanted.clone();
            solve(gram.view_mut(), solved.view_mut()).expect("positive definite");
            let back = whole.dot(&solved);
            let worst = (&back - &wanted).iter().fold(0.0, |m: f64, d| m.max(d.abs()));
            assert!(worst < 1e-7, "{n}: {worst}");
        }
    }

    #[test]
    fn a_matrix_that_is_not_positive_definite_is_refused() {
        for n in [1, LEAF, 5 * LEAF] {
            for bad in [0, n / 2, n - 1] {
                let mut a = Array2::<f64>::eye(n);
                a[(bad, bad)] = -1.0;
                assert_eq!(
                    solve(a.view_mut(), Array2::ones((n, 1)).view_mut()),
                    None,
                    "{n}, {bad}"
                );
                let mut a = Array2::<f32>::eye(n);
                a[(bad, bad)] = f32::NAN;
                assert_eq!(
                    solve(a.view_mut(), Array2::ones((n, 1)).view_mut()),
                    None,
                    "{n}, {bad}"
                );
            }
        }
    }
}
