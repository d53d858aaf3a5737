//! Laws that the algebras obey for any number of dimensions, and broken algebras that every law must catch.
//!
//! A table states for each algebra whether a law holds exactly, nearly or not at all, and all three are tested.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use proptest::prelude::*;
use symbolt::sim::{Complex, Scratch, Seed};
use symbolt::spa::{
    Algebra, Hrr, LinearMap, ProductForm, Tvtb, VocabError, Vtb, Workspace, cosine_of_slices, dot,
    norm, normalize, random_pointer,
};

fn sum(a: &[f32], b: &[f32]) -> Vec<f32> {
    a.iter().zip(b).map(|(x, y)| x + y).collect()
}

fn scaled(a: &[f32], factor: f32) -> Vec<f32> {
    a.iter().map(|x| factor * x).collect()
}

fn far(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).map(|(x, y)| (x - y).abs()).fold(0.0, f32::max)
}

/// An algebra with three random vectors and a unitary one.
#[derive(Debug, Clone)]
struct Case<'a> {
    algebra: &'a dyn Algebra,
    a: Vec<f32>,
    b: Vec<f32>,
    c: Vec<f32>,
    unitary: Vec<f32>,
}

impl<'a> Case<'a> {
    fn of(algebra: &'a dyn Algebra, dim: usize, seed: u64) -> Self {
        let draw = |k| random_pointer(dim, Seed::new(seed).derive_index("law", k));
        let mut unitary = draw(3);
        algebra.make_unitary(&mut unitary, &mut algebra.scratch(dim));
        Self { algebra, a: draw(0), b: draw(1), c: draw(2), unitary }
    }

    fn bind(&self, a: &[f32], b: &[f32]) -> Vec<f32> {
        let mut out = vec![0.0; a.len()];
        self.algebra.bind_into(a, b, &mut out, &mut self.algebra.scratch(a.len()));
        out
    }

    fn inverse(&self, a: &[f32]) -> Vec<f32> {
        let mut out = vec![0.0; a.len()];
        self.algebra.inverse_into(a, &mut out);
        out
    }

    fn identity(&self) -> Vec<f32> {
        let mut out = vec![0.0; self.a.len()];
        self.algebra.identity_into(&mut out);
        out
    }

    fn power(&self, a: &[f32], exponent: f64) -> Result<Vec<f32>, VocabError> {
        let mut out = vec![0.0; a.len()];
        self.algebra.power_into(a, exponent, &mut out, &mut self.algebra.scratch(a.len()))?;
        Ok(out)
    }
}

fn apply(map: &dyn LinearMap, x: &[f32]) -> Vec<f32> {
    let spec = map.scratch();
    let (mut reals, mut complexes) =
        (vec![0.0; spec.reals], vec![Complex::default(); spec.complexes]);
    let mut out = vec![0.0; map.output_width()];
    let mut scratch = Scratch { reals: &mut reals, complexes: &mut complexes, words: &mut [] };
    map.apply_into(x, &mut out, &mut scratch);
    out
}

/// Binding by its definition. HRR: circular convolution. VTB: each block of the left vector times the matrix of the
/// right one.
fn definition(algebra: &dyn Algebra, a: &[f32], b: &[f32]) -> Vec<f32> {
    let (n, d) = (a.len(), a.len().isqrt());
    let product = |x: f32, y: f32| f64::from(x) * f64::from(y);
    let hrr = |j: usize| (0..n).map(|k| product(a[k], b[(n + j - k) % n])).sum::<f64>();
    let vtb = |j: usize| -> f64 {
        let (block, row) = (j / d, j % d);
        let products = (0..d).map(|k| product(b[row * d + k], a[block * d + k]));
        (d as f64).sqrt() * products.sum::<f64>()
    };
    let tvtb = |j: usize| -> f64 {
        let products = (0..d).map(|k| product(a[j / d * d + k], b[k * d + j % d]));
        (d as f64).sqrt() * products.sum::<f64>()
    };
    let component = |j| match algebra.name() {
        "HRR" => hrr(j),
        "VTB" => vtb(j),
        _ => tvtb(j),
    };
    (0..n).map(|j| component(j) as f32).collect()
}

/// How a law holds for an algebra.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Held {
    /// Up to rounding, in any number of dimensions.
    Exactly,
    /// For random vectors of 256 dimensions or more, at a distance below 1.
    Nearly,
    /// Not for random vectors of 64 dimensions or more.
    Not,
}

use Held::{Exactly, Nearly, Not};

impl Held {
    /// Whether two sides that are `off` apart agree with the statement; `None` if it says nothing in these dimensions.
    fn agrees(self, off: f32, dim: usize) -> Option<bool> {
        match self {
            Exactly => Some(off < 5e-5),
            Nearly => (dim >= 256).then_some(off < 1.0),
            Not => (dim >= 64).then_some(off > 1e-3),
        }
    }
}

/// All algebras. The columns of [`LAWS`] are in this order.
const ALGEBRAS: [&dyn Algebra; 3] = [&Hrr, &Vtb, &Tvtb];

/// How far the two sides of a law are apart.
type Law = fn(&Case) -> f32;

/// Each law, how it holds for each algebra, and what breaks an algebra so that the law must fail.
const LAWS: [(&str, Law, [Held; 3], Fault); 24] = [
    (
        "binding is what its definition says",
        |x| far(&x.bind(&x.a, &x.b), &definition(x.algebra, &x.a, &x.b)),
        [Exactly, Exactly, Exactly],
        Fault::Correlates,
    ),
    (
        "it commutes",
        |x| far(&x.bind(&x.a, &x.b), &x.bind(&x.b, &x.a)),
        [Exactly, Not, Not],
        Fault::Correlates,
    ),
    (
        "it associates",
        |x| far(&x.bind(&x.bind(&x.a, &x.b), &x.c), &x.bind(&x.a, &x.bind(&x.b, &x.c))),
        [Exactly, Not, Exactly],
        Fault::Correlates,
    ),
    (
        "it distributes over a sum on the right",
        |x| far(&x.bind(&x.a, &sum(&x.b, &x.c)), &sum(&x.bind(&x.a, &x.b), &x.bind(&x.a, &x.c))),
        [Exactly, Exactly, Exactly],
        Fault::Normalises,
    ),
    (
        "it distributes over a sum on the left",
        |x| far(&x.bind(&sum(&x.a, &x.b), &x.c), &sum(&x.bind(&x.a, &x.c), &x.bind(&x.b, &x.c))),
        [Exactly, Exactly, Exactly],
        Fault::Normalises,
    ),
    (
        "a number scales it on either side",
        |x| {
            let whole = scaled(&x.bind(&x.a, &x.b), 0.3);
            far(&x.bind(&scaled(&x.a, 0.3), &x.b), &whole)
                .max(far(&x.bind(&x.a, &scaled(&x.b, 0.3)), &whole))
        },
        [Exactly, Exactly, Exactly],
        Fault::Normalises,
    ),
    (
        "the identity on the right changes nothing",
        |x| far(&x.bind(&x.a, &x.identity()), &x.a),
        [Exactly, Exactly, Exactly],
        Fault::Doubles,
    ),
    (
        "the identity on the left changes nothing",
        |x| far(&x.bind(&x.identity(), &x.a), &x.a),
        [Exactly, Not, Exactly],
        Fault::Doubles,
    ),
    (
        "the identity has norm 1",
        |x| norm(&x.identity()) - 1.0,
        [Exactly, Exactly, Exactly],
        Fault::Doubles,
    ),
    (
        "the inverse of the inverse is the vector",
        |x| far(&x.inverse(&x.inverse(&x.a)), &x.a),
        [Exactly, Exactly, Exactly],
        Fault::HalvesInverse,
    ),
    (
        "the inverse of a binding is the binding of the inverses",
        |x| far(&x.inverse(&x.bind(&x.a, &x.b)), &x.bind(&x.inverse(&x.a), &x.inverse(&x.b))),
        [Exactly, Not, Not],
        Fault::RotatesInverse,
    ),
    (
        "the inverse on the right undoes a binding, with noise",
        |x| {
            let back = x.bind(&x.bind(&x.b, &x.a), &x.inverse(&x.a));
            (1.0 - cosine_of_slices(&back, &x.b)) / 0.6
        },
        [Nearly, Nearly, Nearly],
        Fault::RotatesInverse,
    ),
    (
        "the inverse of any vector undoes a binding exactly",
        |x| far(&x.bind(&x.bind(&x.b, &x.a), &x.inverse(&x.a)), &x.b),
        [Not, Not, Not],
        Fault::RotatesInverse,
    ),
    (
        "the inverse of a unitary vector undoes a binding exactly",
        |x| far(&x.bind(&x.bind(&x.b, &x.unitary), &x.inverse(&x.unitary)), &x.b),
        [Exactly, Exactly, Exactly],
        Fault::OnlyNormalisesUnitary,
    ),
    (
        "a unitary vector has norm 1",
        |x| (norm(&x.unitary) - 1.0).abs(),
        [Exactly, Exactly, Exactly],
        Fault::DoublesUnitary,
    ),
    (
        "binding with a unitary vector keeps norms",
        |x| (norm(&x.bind(&x.b, &x.unitary)) - norm(&x.b)).abs(),
        [Exactly, Exactly, Exactly],
        Fault::DoublesUnitary,
    ),
    (
        "binding with a unitary vector keeps similarities",
        |x| {
            let bound = dot(&x.bind(&x.b, &x.unitary), &x.bind(&x.c, &x.unitary));
            (bound - dot(&x.b, &x.c)).abs()
        },
        [Exactly, Exactly, Exactly],
        Fault::OnlyNormalisesUnitary,
    ),
    (
        "the bound resembles neither part",
        |x| {
            let bound = x.bind(&x.a, &x.b);
            let nearest = [&x.a, &x.b].map(|part| cosine_of_slices(&bound, part).abs());
            // 1 is 5.6 standard deviations: a false alarm in one of 10^7 cases.
            nearest[0].max(nearest[1]) * (x.a.len() as f32).sqrt() / 8.0
        },
        [Nearly, Nearly, Nearly],
        Fault::Superposes,
    ),
    (
        "the powers -1, 0 and 1 are the inverse, the identity and the vector",
        |x| {
            let known = [(-1.0, x.inverse(&x.a)), (0.0, x.identity()), (1.0, x.a.clone())];
            let off = known.map(|(exponent, known)| match x.power(&x.a, exponent) {
                Ok(power) => far(&power, &known),
                Err(_) => f32::INFINITY,
            });
            off.into_iter().fold(0.0, f32::max)
        },
        [Exactly, Exactly, Exactly],
        Fault::MultipliesPower,
    ),
    (
        "binding with a whole power is binding as often",
        |x| {
            let thrice = (0..3).fold(x.b.clone(), |bound, _| x.bind(&bound, &x.unitary));
            let cube = x.power(&x.unitary, 3.0);
            cube.map_or(f32::INFINITY, |cube| far(&x.bind(&x.b, &cube), &thrice))
        },
        [Exactly, Exactly, Exactly],
        Fault::MultipliesPower,
    ),
    (
        "fractional powers add their exponents",
        |x| {
            // A square has no negative real values in its spectrum.
            let base = x.bind(&x.unitary, &x.unitary);
            let share = f64::from(x.a[0].abs()).clamp(0.1, 0.9);
            match (x.power(&base, share), x.power(&base, 1.0 - share)) {
                (Ok(first), Ok(second)) => {
                    far(&x.bind(&x.bind(&x.b, &first), &second), &x.bind(&x.b, &base))
                }
                _ => f32::INFINITY,
            }
        },
        [Exactly, Not, Not],
        Fault::MultipliesPower,
    ),
    (
        "the product form is the binding",
        |x| {
            let form = x.algebra.product_form(x.a.len());
            let (left, right) = (apply(&*form.left, &x.a), apply(&*form.right, &x.b));
            let products: Vec<f32> = left.iter().zip(&right).map(|(x, y)| x * y).collect();
            assert_eq!(products.len(), form.pairs);
            far(&apply(&*form.back, &products), &x.bind(&x.a, &x.b))
        },
        [Exactly, Exactly, Exactly],
        Fault::Correlates,
    ),
    (
        "binding with a fixed vector on the right is the binding",
        |x| far(&apply(&*x.algebra.bind_with(&x.b), &x.a), &x.bind(&x.a, &x.b)),
        [Exactly, Exactly, Exactly],
        Fault::Correlates,
    ),
    (
        "binding with a fixed vector on the left is the binding",
        |x| far(&apply(&*x.algebra.bind_onto(&x.a), &x.b), &x.bind(&x.a, &x.b)),
        [Exactly, Exactly, Exactly],
        Fault::Correlates,
    ),
];

/// What is wrong with an algebra.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fault {
    /// Binds with the inverse.
    Correlates,
    /// Scales what it has bound to norm 1.
    Normalises,
    /// Doubles what it has bound, and the identity.
    Doubles,
    /// Adds instead of binding.
    Superposes,
    /// Halves an inverse.
    HalvesInverse,
    /// Rotates the components of an inverse by one.
    RotatesInverse,
    /// Scales a vector to norm 1 instead of making it unitary.
    OnlyNormalisesUnitary,
    /// Makes unitary vectors of norm 2.
    DoublesUnitary,
    /// Multiplies with the exponent.
    MultipliesPower,
}

/// An algebra with a fault.
#[derive(Debug)]
struct Broken {
    of: &'static dyn Algebra,
    fault: Fault,
}

impl Algebra for Broken {
    fn name(&self) -> &'static str {
        self.of.name()
    }

    fn check_dim(&self, dim: usize) -> Result<(), VocabError> {
        self.of.check_dim(dim)
    }

    fn scratch(&self, dim: usize) -> Workspace {
        self.of.scratch(dim)
    }

    fn bind_into(&self, a: &[f32], b: &[f32], out: &mut [f32], scratch: &mut Workspace) {
        let mut b = b.to_vec();
        if self.fault == Fault::Correlates {
            self.of.inverse_into(&b.clone(), &mut b);
        }
        self.of.bind_into(a, &b, out, scratch);
        match self.fault {
            Fault::Normalises => normalize(out),
            Fault::Doubles => out.iter_mut().for_each(|x| *x *= 2.0),
            Fault::Superposes => out.copy_from_slice(&sum(a, &b)),
            _ => {}
        }
    }

    fn inverse_into(&self, a: &[f32], out: &mut [f32]) {
        self.of.inverse_into(a, out);
        match self.fault {
            Fault::HalvesInverse => out.iter_mut().for_each(|x| *x /= 2.0),
            Fault::RotatesInverse => out.rotate_right(1),
            _ => {}
        }
    }

    fn identity_into(&self, out: &mut [f32]) {
        self.of.identity_into(out);
        if self.fault == Fault::Doubles {
            out.iter_mut().for_each(|x| *x *= 2.0);
        }
    }

    fn make_unitary(&self, a: &mut [f32], scratch: &mut Workspace) {
        match self.fault {
            Fault::OnlyNormalisesUnitary => normalize(a),
            _ => self.of.make_unitary(a, scratch),
        }
        if self.fault == Fault::DoublesUnitary {
            a.iter_mut().for_each(|x| *x *= 2.0);
        }
    }

    fn product_form(&self, dim: usize) -> ProductForm {
        self.of.product_form(dim)
    }

    fn bind_with(&self, fixed: &[f32]) -> Box<dyn LinearMap> {
        self.of.bind_with(fixed)
    }

    fn bind_onto(&self, fixed: &[f32]) -> Box<dyn LinearMap> {
        self.of.bind_onto(fixed)
    }

    fn power_into(
        &self,
        a: &[f32],
        exponent: f64,
        out: &mut [f32],
        scratch: &mut Workspace,
    ) -> Result<(), VocabError> {
        if self.fault == Fault::MultipliesPower {
            out.copy_from_slice(&scaled(a, exponent as f32));
            return Ok(());
        }
        self.of.power_into(a, exponent, out, scratch)
    }
}

#[test]
fn a_convolution_computes_no_product_that_is_always_zero() {
    for dim in 2..=33 {
        let x = Case::of(&Hrr, dim, dim as u64);
        let form = Hrr.product_form(dim);
        assert_eq!(form.pairs, if dim % 2 == 0 { 2 * dim - 2 } else { 2 * dim - 1 });
        for factors in [apply(&*form.left, &x.a), apply(&*form.right, &x.b)] {
            assert!(factors.iter().all(|factor| factor.abs() > 1e-6), "{dim}: {factors:?}");
        }
    }
}

/// Numbers of dimensions of every kind: tiny, odd, prime, squares, powers of two.
fn dims() -> impl Strategy<Value = usize> {
    prop_oneof![
        prop::sample::select(vec![2, 3, 4, 7, 9, 16, 63, 64, 101, 121, 256, 289]),
        2usize..300
    ]
}

/// An algebra, a number of dimensions that it can use, and a seed.
fn cases() -> impl Strategy<Value = (usize, usize, u64)> {
    let possible = |(algebra, dim, seed): (usize, usize, u64)| {
        let fits = ALGEBRAS[algebra].check_dim(dim).is_ok();
        (algebra, if fits { dim } else { dim.isqrt().max(2).pow(2) }, seed)
    };
    (0..ALGEBRAS.len(), dims(), any::<u64>()).prop_map(possible)
}

#[test]
fn every_law_catches_a_broken_algebra() {
    let mut caught = 0;
    for (name, law, held, fault) in LAWS {
        for (of, held) in ALGEBRAS.into_iter().zip(held).filter(|(_, held)| *held != Not) {
            let broken = Broken { of, fault };
            let off = law(&Case::of(&broken, 256, 1));
            assert_eq!(held.agrees(off, 256), Some(false), "{}: {name}: {off}", of.name());
            caught += 1;
        }
    }
    assert_eq!(caught, 61);
}

#[test]
fn an_exponent_that_is_no_number_is_refused() {
    for algebra in ALGEBRAS {
        let case = Case::of(algebra, 64, 1);
        assert!(matches!(case.power(&case.a, f64::NAN), Err(VocabError::Exponent { .. })));
    }
}

proptest! {
    #[test]
    fn every_algebra_obeys_the_laws_that_it_states((algebra, dim, seed) in cases()) {
        let case = Case::of(ALGEBRAS[algebra], dim, seed);
        let mut judged = 0;
        for (name, law, held, _) in LAWS {
            let off = law(&case);
            if let Some(agrees) = held[algebra].agrees(off, dim) {
                prop_assert!(agrees, "{}: {name}: {:?}: {off}", case.algebra.name(), held[algebra]);
                judged += 1;
            }
        }
        prop_assert!(judged == LAWS.len() || dim < 256);
    }
}
