//! The layer of products of pairs of numbers.

use std::ops::Range;

use super::{Circuit, Items, Layer, Populated, check_radius};
use crate::neurons::builder::{Components, Keep, Onset, PopulationBuilder};
use crate::neurons::tuning::TuningError;
use crate::sim::{
    AdvanceIo, Fingerprint, InputSpec, Inputs, Node, NodeFault, OutputSpec, PartIo, PortDecl, Real,
    StepCx,
};

/// A request for the products of pairs of numbers: `out[i] = a[i] b[i]`.
///
/// In neurons each product is the difference of two squares, each in an ensemble of one dimension:
/// `a b = ((a + b) / 2)^2 - ((a - b) / 2)^2` (Gosmann, "Precise multiplications with the NEF", 2015).
#[derive(Debug, Clone)]
pub struct Product {
    pairs: usize,
    radius: Real,
}

impl Product {
    /// Requests `pairs` independent products (at least 1). Each input takes one connection.
    pub fn new(pairs: usize) -> Self {
        Self { pairs, radius: 1.0 }
    }

    /// Sets the greatest magnitude of `(a + b) / 2` and `(a - b) / 2` that neurons represent. Direct mode has no
    /// such limit.
    ///
    /// The default is 1, enough for factors between -1 and 1. Anything but a finite number above 0 is a fault when
    /// the graph is built.
    pub fn radius(mut self, radius: Real) -> Self {
        self.radius = radius;
        self
    }
}

impl Node for Product {
    fn declare(&self, ports: &mut PortDecl) {
        check_radius(self.radius, ports);
        ports
            .input("a", InputSpec::vector(self.pairs).at_advance())
            .input("b", InputSpec::vector(self.pairs).at_advance())
            .output("out", OutputSpec::vector(self.pairs).registered().filtered_only());
    }

    fn fingerprint(&self, _hash: &mut Fingerprint) {}

    fn advance(&self, _cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let (a, b) = (io.inputs.get(0), io.inputs.get(1));
        for ((out, a), b) in io.outputs.get_mut(0).iter_mut().zip(a).zip(b) {
            *out = a * b;
        }
        Ok(())
    }
}

impl Layer for Product {
    fn direct(&self) -> Box<dyn Node> {
        Box::new(self.clone())
    }

    fn neural(&self, builder: &PopulationBuilder<'_>) -> Result<Populated, TuningError> {
        let neurons = builder.tuning().per_product as f64 / 2.0;
        let (radius, onset, keep) = (f64::from(self.radius), Onset::Anywhere, Keep::Groups(2));
        let components = Components { width: 2 * self.pairs, neurons, radius, onset, keep };
        let squares = builder.components("components", &components, &|x| x * x)?;
        Ok(Populated::new(self.direct(), squares, Squares).unit(2, 1).scratch(4))
    }
}

/// The difference of the squares of half the sum and half the difference.
struct Squares;

impl Circuit for Squares {
    fn advance(&self, items: &Items<'_>, io: &mut PartIo<'_>) {
        let pairs: Range<usize> = items.range();
        let (halves, squares) = io.scratch.reals[..4 * pairs.len()].split_at_mut(2 * pairs.len());
        let (a, b) = (&io.inputs.get(0)[pairs.clone()], &io.inputs.get(1)[pairs]);
        for ((two, a), b) in halves.chunks_exact_mut(2).zip(a).zip(b) {
            two.copy_from_slice(&halves_of(*a, *b));
        }
        items.step(0, (halves, 1.0), io.state, squares);
        for (result, two) in io.results.iter_mut().zip(squares.chunks_exact(2)) {
            *result = two[0] - two[1];
        }
    }

    fn unlimited(&self, items: &Items<'_>, inputs: Inputs<'_>, values: &mut Vec<Real>) {
        let pairs = inputs.get(0)[items.range()].iter().zip(&inputs.get(1)[items.range()]);
        values.extend(pairs.flat_map(|(a, b)| halves_of(*a, *b)));
    }
}

/// Returns half the sum and half the difference.
fn halves_of(a: Real, b: Real) -> [Real; 2] {
    [(a + b) / 2.0, (a - b) / 2.0]
}
