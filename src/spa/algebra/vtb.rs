//! Vector-derived transformation binding: binding by multiplication with a matrix made from a vector.
//!
//! A vector of D = d^2 components is read as a d x d matrix, row by row. With matrices A and B, the binding of a and b
//! is `sqrt(d) A B^T` (Gosmann and Eliasmith, "Vector-derived transformation binding: an improved binding operation for
//! deep symbol-like processing in neural networks", Neural Computation 31(5), 2019). The inverse of b is B^T. It is
//! approximate for random vectors and exact if `sqrt(d) B` is orthogonal.
//!
//! The binding does not commute and does not associate, so the order matters: the *right* factor can be unbound. Write
//! `FILLER * ROLE`, and unbind with `~ROLE` on the right.
//!
//! The transposed form ([`Tvtb`]) binds to `sqrt(d) A B`. It associates, and identity and inverse hold on both sides, but it
//! does not commute either.
//!
//! A binding costs O(D^1.5). In a graph, a population computes D^1.5 products; everything else is linear.

use nalgebra::DMatrix;

use super::{Algebra, LinearMap, ProductForm, Workspace};
use crate::sim::{Fingerprint, Real, Scratch};
use crate::spa::error::VocabError;

/// The algebra of vector-derived transformation binding (Gosmann and Eliasmith 2019).
///
/// Works for square numbers of dimensions from 4 to 16,384. Binding keeps the similarity of vectors after many nested
/// bindings better than [`Hrr`](super::Hrr), and needs more products. The order of factors matters: only the right
/// factor can be unbound.
///
/// ```
/// use symbolt::spa::{Algebra, Vtb, cosine_of_slices, random_pointer};
/// use symbolt::sim::Seed;
///
/// let (red, ball) = (random_pointer(256, Seed::new(1)), random_pointer(256, Seed::new(2)));
/// let (mut red_ball, mut not_ball, mut answer) = (vec![0.0; 256], vec![0.0; 256], vec![0.0; 256]);
/// let mut work = Vtb.scratch(256);
/// Vtb.bind_into(&red, &ball, &mut red_ball, &mut work);
/// Vtb.inverse_into(&ball, &mut not_ball);
/// Vtb.bind_into(&red_ball, &not_ball, &mut answer, &mut work);
/// assert!(cosine_of_slices(&answer, &red) > 0.5);
/// assert!(cosine_of_slices(&red_ball, &red).abs() < 0.3);
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Vtb;

/// The algebra of transposed vector-derived transformation binding: the product of the vectors' matrices.
///
/// Dimensions and costs are those of [`Vtb`]. Unlike there, either factor can be unbound, on its own side: with
/// `C = A * B`, `C * ~B` is like A and `~A * C` is like B. Nested bindings need no parentheses.
///
/// ```
/// use symbolt::spa::{Algebra, Tvtb, cosine_of_slices, random_pointer};
/// use symbolt::sim::Seed;
///
/// let (red, ball) = (random_pointer(256, Seed::new(1)), random_pointer(256, Seed::new(2)));
/// let (mut red_ball, mut not_red, mut answer) = (vec![0.0; 256], vec![0.0; 256], vec![0.0; 256]);
/// let mut work = Tvtb.scratch(256);
/// Tvtb.bind_into(&red, &ball, &mut red_ball, &mut work);
/// Tvtb.inverse_into(&red, &mut not_red);
/// Tvtb.bind_into(&not_red, &red_ball, &mut answer, &mut work);
/// assert!(cosine_of_slices(&answer, &ball) > 0.5);
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Tvtb;

/// Least and greatest number of dimensions.
const DIMS: (usize, usize) = (4, 1 << 14);

/// Workspace of both algebras, which need no memory.
struct VtbWork;

/// Whether the matrix on the right of a product is transposed: an algebra's only choice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Right {
    Transposed,
    AsIs,
}

/// Returns the number of rows of a vector's matrix.
fn rows(dim: usize) -> usize {
    dim.isqrt()
}

/// Writes `sqrt(d) A B^T`, or `sqrt(d) A B`, to `out`.
fn multiply(form: Right, a: &[Real], b: &[Real], out: &mut [Real]) {
    let d = rows(out.len());
    let scale = (d as Real).sqrt();
    for (row, a) in out.chunks_exact_mut(d).zip(a.chunks_exact(d)) {
        match form {
            Right::Transposed => {
                for (value, b) in row.iter_mut().zip(b.chunks_exact(d)) {
                    *value = scale * a.iter().zip(b).map(|(x, y)| x * y).sum::<Real>();
                }
            }
            Right::AsIs => {
                row.fill(0.0);
                for (x, b) in a.iter().zip(b.chunks_exact(d)) {
                    row.iter_mut().zip(b).for_each(|(value, y)| *value += scale * x * y);
                }
            }
        }
    }
}

fn matrix(a: &[Real]) -> DMatrix<f64> {
    let d = rows(a.len());
    DMatrix::from_fn(d, d, |i, j| f64::from(a[i * d + j]))
}

fn write(from: &DMatrix<f64>, scale: f64, out: &mut [Real]) {
    let d = from.nrows();
    for (index, value) in out.iter_mut().enumerate() {
        *value = (scale * from[(index / d, index % d)]) as Real;
    }
}

/// Implements the algebra of a form.
macro_rules! algebra {
    ($algebra:ident, $name:literal, $form:expr) => {
        impl Algebra for $algebra {
            fn name(&self) -> &'static str {
                $name
            }

            fn check_dim(&self, dim: usize) -> Result<(), VocabError> {
                let (min, max) = DIMS;
                if !(min..=max).contains(&dim) {
                    return Err(VocabError::Dimension { dim, min, max });
                }
                let below = rows(dim).pow(2);
                if below != dim {
                    return Err(VocabError::NotSquare {
                        dim,
                        below,
                        above: (rows(dim) + 1).pow(2),
                    });
                }
                Ok(())
            }

            fn scratch(&self, _dim: usize) -> Workspace {
                Workspace::new(VtbWork)
            }

            fn bind_into(&self, a: &[Real], b: &[Real], out: &mut [Real], scratch: &mut Workspace) {
                assert!(
                    scratch.get_mut::<VtbWork>().is_some(),
                    concat!("another algebra made the workspace; expected that of ", $name)
                );
                assert!(a.len() == out.len() && b.len() == out.len(), "slices differ in length");
                multiply($form, a, b, out);
            }

            /// Transposes the matrix of `a`: the inverse, exact for unitary vectors.
            fn inverse_into(&self, a: &[Real], out: &mut [Real]) {
                let d = rows(a.len());
                for (index, value) in out.iter_mut().enumerate() {
                    *value = a[index % d * d + index / d];
                }
            }

            fn identity_into(&self, out: &mut [Real]) {
                let d = rows(out.len());
                let scale = (d as Real).sqrt().recip();
                for (index, value) in out.iter_mut().enumerate() {
                    *value = if index / d == index % d { scale } else { 0.0 };
                }
            }

            fn make_unitary(&self, a: &mut [Real], _scratch: &mut Workspace) {
                let (d, parts) = (rows(a.len()) as f64, matrix(a).svd(true, true));
                if let (Some(u), Some(v)) = (parts.u, parts.v_t) {
                    write(&(u * v), d.sqrt().recip(), a);
                }
            }

            fn product_form(&self, dim: usize) -> ProductForm {
                let d = rows(dim);
                ProductForm {
                    pairs: dim * d,
                    // Components of random unit vectors have a standard deviation of 1 / d; half a sum or difference of two
                    // stays within 2.58 / sqrt(2) of them in 99% of cases.
                    magnitude: 1.82 / d as Real,
                    left: Box::new(Factor { rows: d, form: None }),
                    right: Box::new(Factor { rows: d, form: Some($form) }),
                    back: Box::new(FromProducts { rows: d }),
                }
            }

            fn bind_with(&self, fixed: &[Real]) -> Box<dyn LinearMap> {
                Box::new(Times { form: $form, fixed: fixed.to_vec(), fixed_left: false })
            }

            fn bind_onto(&self, fixed: &[Real]) -> Box<dyn LinearMap> {
                Box::new(Times { form: $form, fixed: fixed.to_vec(), fixed_left: true })
            }

            /// Multiplies the matrix of `a` with itself. Only whole exponents have a power.
            fn power_into(
                &self,
                a: &[Real],
                exponent: f64,
                out: &mut [Real],
                _scratch: &mut Workspace,
            ) -> Result<(), VocabError> {
                let whole = super::whole_exponent(self.name(), exponent)?;
                let d = rows(a.len()) as f64;
                let mut base = matrix(a) * d.sqrt();
                if whole < 0 {
                    base = base.transpose();
                }
                let power = base.pow(whole.unsigned_abs());
                write(&power, d.sqrt().recip(), out);
                Ok(())
            }
        }
    };
}

algebra!(Vtb, "VTB", Right::Transposed);
algebra!(Tvtb, "TVTB", Right::AsIs);

/// Spreads a vector over the factors of all products. Product `(k d + i) d + j` is `A[k][j] B[i][j]`, or `A[k][j] B[j][i]`.
struct Factor {
    rows: usize,
    /// That of the right factors; `None` for the left ones.
    form: Option<Right>,
}

impl LinearMap for Factor {
    fn input_width(&self) -> usize {
        self.rows * self.rows
    }

    fn output_width(&self) -> usize {
        self.rows.pow(3)
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text("VTB factor").number(self.rows as u64).number(match self.form {
            Some(Right::Transposed) => 0,
            None => 1,
            Some(Right::AsIs) => 2,
        });
    }

    fn apply_into(&self, input: &[Real], out: &mut [Real], _scratch: &mut Scratch<'_>) {
        let d = self.rows;
        for (pair, block) in out.chunks_exact_mut(d).enumerate() {
            let row = if self.form.is_none() { pair / d } else { pair % d };
            match self.form {
                Some(Right::AsIs) => {
                    let column = input[row..].iter().step_by(d);
                    block.iter_mut().zip(column).for_each(|(to, from)| *to = *from);
                }
                _ => block.copy_from_slice(&input[row * d..(row + 1) * d]),
            }
        }
    }
}

/// Sums the products of each component.
struct FromProducts {
    rows: usize,
}

impl LinearMap for FromProducts {
    fn input_width(&self) -> usize {
        self.rows.pow(3)
    }

    fn output_width(&self) -> usize {
        self.rows * self.rows
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text("VTB products").number(self.rows as u64);
    }

    fn apply_into(&self, input: &[Real], out: &mut [Real], _scratch: &mut Scratch<'_>) {
        let scale = (self.rows as Real).sqrt();
        for (value, products) in out.iter_mut().zip(input.chunks_exact(self.rows)) {
            *value = scale * products.iter().sum::<Real>();
        }
    }
}

/// Binding with a fixed vector on one side.
struct Times {
    form: Right,
    fixed: Vec<Real>,
    fixed_left: bool,
}

impl LinearMap for Times {
    fn input_width(&self) -> usize {
        self.fixed.len()
    }

    fn output_width(&self) -> usize {
        self.fixed.len()
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        let form = if self.form == Right::Transposed { "VTB times" } else { "TVTB times" };
        hash.text(form).number(u64::from(self.fixed_left)).reals(&self.fixed);
    }

    fn apply_into(&self, input: &[Real], out: &mut [Real], _scratch: &mut Scratch<'_>) {
        match self.fixed_left {
            true => multiply(self.form, &self.fixed, input, out),
            false => multiply(self.form, input, &self.fixed, out),
        }
    }
}
