//! The dense algebra of a decoder solve: a symmetric product, the Cholesky factor and its two substitutions.
//!
//! Every operation splits its matrices in halves. Nearly all of the work is then matrix products, which `ndarray`
//! computes with vector instructions. A linear-algebra library would be a fifth faster, but takes longer to compile
//! than the rest of a small program.

use ndarray::linalg::general_mat_mul;
use ndarray::{Array2, ArrayView2, ArrayViewMut2, Axis, NdFloat};

/// Greatest number of rows for plain loops.
const LEAF: usize = 24;

/// Returns the row at which `n` rows are split: about the middle, at a multiple of the leaf size.
fn half(n: usize) -> usize {
    (n / 2).div_ceil(LEAF) * LEAF
}

/// Computes `out = scale * out + alpha * A^T A`. Only the lower triangle of `out` is valid afterwards. `out` has one
/// row per column of A.
pub(super) fn add_gram<T: NdFloat>(
    alpha: T,
    a: ArrayView2<'_, T>,
    scale: T,
    out: ArrayViewMut2<'_, T>,
) {
    let n = out.nrows();
    // Up to this size, computing the whole product costs less than splitting it.
    if n <= 4 * LEAF {
        let mut out = out;
        general_mat_mul(alpha, &a.t(), &a, scale, &mut out);
        return;
    }
    let at = half(n);
    let (a1, a2) = a.split_at(Axis(1), at);
    let (upper, lower) = out.split_at(Axis(0), at);
    let (out11, _) = upper.split_at(Axis(1), at);
    let (mut out21, out22) = lower.split_at(Axis(1), at);
    add_gram(alpha, a1, scale, out11);
    general_mat_mul(alpha, &a2.t(), &a1, scale, &mut out21);
    add_gram(alpha, a2, scale, out22);
}

/// Replaces the lower triangle of a symmetric matrix by its Cholesky factor L, `A = L L^T`. Does not read the upper
/// triangle and may overwrite it. Costs `n^3 / 3` operations. Returns `None` if the matrix is not positive definite.
pub(super) fn cholesky<T: NdFloat>(mut a: ArrayViewMut2<'_, T>) -> Option<()> {
    let n = a.nrows();
    if n <= LEAF {
        for j in 0..n {
            for i in j..n {
                let (above, row) = (a.row(j), a.row(i));
                let done = (0..j).fold(T::zero(), |sum, k| sum + row[k] * above[k]);
                let rest = a[(i, j)] - done;
                a[(i, j)] = if i > j {
                    rest / a[(j, j)]
                } else if rest > T::zero() {
                    rest.sqrt()
                } else {
                    return None;
                };
            }
        }
        return Some(());
    }
    let at = half(n);
    let (upper, lower) = a.split_at(Axis(0), at);
    let (mut a11, _) = upper.split_at(Axis(1), at);
    let (mut a21, mut a22) = lower.split_at(Axis(1), at);
    cholesky(a11.view_mut())?;
    divide_by_transpose(a21.view_mut(), a11.view());
    add_gram(-T::one(), a21.t(), T::one(), a22.view_mut());
    cholesky(a22)
}

/// Computes `X = X L^-T` for a lower triangular L.
fn divide_by_transpose<T: NdFloat>(mut x: ArrayViewMut2<'_, T>, l: ArrayView2<'_, T>) {
    let n = l.nrows();
    if n <= LEAF {
        for mut row in x.rows_mut() {
            for j in 0..n {
                let done = (0..j).fold(T::zero(), |sum, k| sum + row[k] * l[(j, k)]);
                row[j] = (row[j] - done) / l[(j, j)];
            }
        }
        return;
    }
    let at = half(n);
    let (upper, lower) = l.split_at(Axis(0), at);
    let (l11, l21, l22) = (
        upper.split_at(Axis(1), at).0,
        lower.split_at(Axis(1), at).0,
        lower.split_at(Axis(1), at).1,
    );
    let (mut x1, mut x2) = x.split_at(Axis(1), at);
    divide_by_transpose(x1.view_mut(), l11);
    general_mat_mul(-T::one(), &x1, &l21.t(), T::one(), &mut x2);
    divide_by_transpose(x2, l22);
}

/// Computes `X = X L^-1` for a lower triangular L.
fn divide<T: NdFloat>(mut x: ArrayViewMut2<'_, T>, l: ArrayView2<'_, T>) {
    let n = l.nrows();
    if n <= LEAF {
        for mut row in x.rows_mut() {
            for j in (0..n).rev() {
                let done = (j + 1..n).fold(T::zero(), |sum, k| sum + row[k] * l[(k, j)]);
                row[j] = (row[j] - done) / l[(j, j)];
            }
        }
        return;
    }
    let at = half(n);
    let (upper, lower) = l.split_at(Axis(0), at);
    let (l11, l21, l22) = (
        upper.split_at(Axis(1), at).0,
        lower.split_at(Axis(1), at).0,
        lower.split_at(Axis(1), at).1,
    );
    let (mut x1, mut x2) = x.split_at(Axis(1), at);
    divide(x2.view_mut(), l22);
    general_mat_mul(-T::one(), &x2, &l21, T::one(), &mut x1);
    divide(x1, l11);
}

/// Solves `A Y = B` for a symmetric positive definite A. Reads and overwrites the lower triangle of A. Each row of `b`
/// is one right-hand side and is replaced by its solution. Returns `None` if A is not positive definite.
pub(super) fn solve<T: NdFloat>(a: &mut Array2<T>, b: &mut Array2<T>) -> Option<()> {
    cholesky(a.view_mut())?;
    divide_by_transpose(b.view_mut(), a.view());
    divide(b.view_mut(), a.view());
    Some(())
}

#[cfg(test)]
mod tests {
    use rand::RngExt;

    use super::*;
    use crate::sim::Seed;

    fn drawn(rows: usize, columns: usize, seed: u64) -> Array2<f64> {
        let mut rng = Seed::new(seed).rng();
        Array2::from_shape_fn((rows, columns), |_| rng.random::<f64>() - 0.3)
    }

    #[test]
    fn a_solution_satisfies_its_system_at_all_sizes_around_the_leaf() {
        for n in [1, 2, LEAF - 1, LEAF, LEAF + 1, 2 * LEAF + 1, 4 * LEAF, 4 * LEAF + 1, 257] {
            let (a, wanted) = (drawn(2 * n, n, n as u64), drawn(3, n, 7));
            let mut gram = Array2::<f64>::from_elem((n, n), f64::NAN);
            gram.fill(0.0);
            add_gram(1.0, a.view(), 0.0, gram.view_mut());
            let whole = a.t().dot(&a);
            for i in 0..n {
                for j in 0..=i {
                    assert!((gram[(i, j)] - whole[(i, j)]).abs() < 1e-9, "{n}: {i}, {j}");
                }
            }
            let mut solved = wanted.clone();
            solve(&mut gram, &mut solved).expect("positive definite");
            let back = solved.dot(&whole);
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
                assert_eq!(solve(&mut a, &mut Array2::ones((1, n))), None, "{n}, {bad}");
                let mut a = Array2::<f32>::eye(n);
                a[(bad, bad)] = f32::NAN;
                assert_eq!(solve(&mut a, &mut Array2::ones((1, n))), None, "{n}, {bad}");
            }
        }
    }
}
