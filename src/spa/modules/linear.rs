//! Linear nodes: fixed maps between ports. They cost no tick.

use std::fmt::Display;

use super::maps::{Rows, Sparse, Spread, WeightedRows};
use crate::sim::Ports;
use crate::sim::{
    AnyInput, AnyOutput, EmitIo, Fingerprint, InputSpec, Kind, Module, Node, OutputSpec, Pointer,
    PointerRef, PortDecl, Real, Scalar, Scope, Space, StepCx, Vector, VocabTag,
};
use crate::spa::algebra::LinearMap;
use crate::spa::error::VocabError;
use crate::spa::vocabulary::Vocabulary;

/// A node that applies a fixed linear map, without a tick of delay. Its input takes one connection.
pub struct Linear<A: Kind, B: Kind> {
    input: InputSpec<A>,
    output: OutputSpec<B>,
    map: Box<dyn LinearMap>,
    /// Fault in the numbers that the map was made from.
    fault: Option<String>,
}

impl<A: Kind, B: Kind> Linear<A, B> {
    /// Makes a node that applies `map` between ports of the given kinds. Different widths of map and ports are a fault
    /// when the graph is built.
    pub fn new(input: InputSpec<A>, output: OutputSpec<B>, map: Box<dyn LinearMap>) -> Self {
        Self { input, output, map, fault: None }
    }

    pub(super) fn with_fault(mut self, fault: Option<String>) -> Self {
        self.fault = fault;
        self
    }

    /// Makes a node that passes values on unchanged, as another kind of port or a pointer of another vocabulary.
    /// Different widths are a fault when the graph is built.
    ///
    /// Use it to connect ports of different vocabularies on purpose; a direct connection does not compile.
    pub fn reinterpret(input: InputSpec<A>, output: OutputSpec<B>) -> Self {
        let (from, to) = widths(&input, &output);
        let fault = (from != to).then(|| {
            format!(
                "the input has width {from} but the output has width {to}; expected equal widths"
            )
        });
        Self::new(input, output, Box::new(Spread { from, to, factor: 1.0 })).with_fault(fault)
    }
}

/// Returns the widths of an input and an output.
fn widths<A: Kind, B: Kind>(input: &InputSpec<A>, output: &OutputSpec<B>) -> (usize, usize) {
    (AnyInput::from(input.clone()).width(), AnyOutput::from(output.clone()).width())
}

impl<V: VocabTag> Linear<Pointer<V>, Pointer<V>> {
    /// Makes a node that unbinds `role`, an expression over `vocabulary`: `out = bound (*) inverse(role)`.
    ///
    /// # Errors
    /// As for [`Vocabulary::parse`]: an invalid expression, or a name that the vocabulary does not have.
    pub fn unbind(vocabulary: &Vocabulary<V>, role: &str) -> Result<Self, VocabError> {
        let role = vocabulary.parse(role)?;
        let mut inverse = vec![0.0; vocabulary.dim()];
        vocabulary.algebra().inverse_into(&role, &mut inverse);
        let map = vocabulary.algebra().bind_with(&inverse);
        let space = vocabulary.space();
        Ok(Self::new(InputSpec::pointer(space), OutputSpec::pointer(space), map))
    }
}

impl<A: VocabTag> Linear<Pointer<A>, Vector> {
    /// Makes a node that gives the dot products of a pointer of `space` with each of `keys`, in their order.
    ///
    /// A key with another number of dimensions is a fault when the graph is built. Costs O(keys x dimensions) per tick.
    ///
    /// ```
    /// # use symbolt::sim::{Seed, VocabTag};
    /// # use symbolt::spa::{Linear, VocabularyBuilder};
    /// # struct Parts;
    /// # impl VocabTag for Parts { const NAME: &'static str = "parts"; }
    /// # struct Actions;
    /// # impl VocabTag for Actions { const NAME: &'static str = "actions"; }
    /// let parts = VocabularyBuilder::<Parts>::new(64, Seed::new(1)).pointer("NUT").build()?;
    /// let actions = VocabularyBuilder::<Actions>::new(64, Seed::new(1)).pointer("GRASP").build()?;
    /// Linear::similarities(parts.space(), [parts.get("NUT")?]);
    /// # Ok::<(), symbolt::spa::VocabError>(())
    /// ```
    ///
    /// Keys of another vocabulary do not compile:
    ///
    /// ```compile_fail
    /// # use symbolt::sim::{Seed, VocabTag};
    /// # use symbolt::spa::{Linear, VocabularyBuilder};
    /// # struct Parts;
    /// # impl VocabTag for Parts { const NAME: &'static str = "parts"; }
    /// # struct Actions;
    /// # impl VocabTag for Actions { const NAME: &'static str = "actions"; }
    /// let parts = VocabularyBuilder::<Parts>::new(64, Seed::new(1)).pointer("NUT").build()?;
    /// let actions = VocabularyBuilder::<Actions>::new(64, Seed::new(1)).pointer("GRASP").build()?;
    /// Linear::similarities(actions.space(), [parts.get("NUT")?]);
    /// # Ok::<(), symbolt::spa::VocabError>(())
    /// ```
    pub fn similarities<'p>(
        space: &Space<A>,
        keys: impl IntoIterator<Item = PointerRef<'p, A>>,
    ) -> Self {
        let (matrix, fault) = stacked(space, keys.into_iter());
        let map = Rows { matrix, dim: space.width() };
        let count = map.output_width();
        Self::new(InputSpec::pointer(space), OutputSpec::vector(count), Box::new(map))
            .with_fault(fault)
    }
}

impl<B: VocabTag> Linear<Vector, Pointer<B>> {
    /// Makes a node that gives a weighted sum of `values`, pointers of `space`. The input has one weight per value.
    ///
    /// A value of weight zero costs nothing. Each other value costs O(dimensions) per tick. A value with another
    /// number of dimensions is a fault when the graph is built.
    pub fn combination<'p>(
        space: &Space<B>,
        values: impl IntoIterator<Item = PointerRef<'p, B>>,
    ) -> Self {
        let (matrix, fault) = stacked(space, values.into_iter());
        let map = WeightedRows { matrix, dim: space.width() };
        let count = map.input_width();
        Self::new(InputSpec::vector(count), OutputSpec::pointer(space), Box::new(map))
            .with_fault(fault)
    }
}

/// Stacks pointers as the rows of a matrix. Also returns a fault that names the first pointer without the dimensions
/// of `space`. Such a pointer becomes a row of zeros: the ports keep their widths, and the graph gets no further
/// faults.
fn stacked<'p, V: VocabTag>(
    space: &Space<V>,
    pointers: impl Iterator<Item = PointerRef<'p, V>>,
) -> (Vec<Real>, Option<String>) {
    let mut rows = pointers.map(PointerRef::values);
    stacked_rows(space, space.width(), &mut rows)
}

fn stacked_rows(
    space: &dyn Display,
    dim: usize,
    rows: &mut dyn Iterator<Item = &[Real]>,
) -> (Vec<Real>, Option<String>) {
    let (mut matrix, mut fault) = (Vec::new(), None);
    for (index, pointer) in rows.enumerate() {
        if pointer.len() == dim {
            matrix.extend_from_slice(pointer);
            continue;
        }
        matrix.resize(matrix.len() + dim, 0.0);
        fault = fault.or_else(|| {
            let (number, found) = (index + 1, pointer.len());
            Some(format!(
                "pointer {number} has {found} dimensions; expected {dim}, those of {space}"
            ))
        });
    }
    (matrix, fault)
}

/// Returns the fault of a matrix whose last row has fewer than `width` numbers.
fn broken_row(width: usize, matrix: &[Real]) -> Option<String> {
    let (numbers, over) = (matrix.len(), matrix.len() % width.max(1));
    (over != 0).then(|| {
        format!("{numbers} numbers are not whole rows of {width}; expected a multiple of {width}")
    })
}

impl Linear<Vector, Vector> {
    /// Makes a node that gives the dot products of a vector of `width` numbers with the rows of `matrix`.
    ///
    /// `matrix` is row-major, with `width` numbers per row. An incomplete row is a fault when the graph is built.
    /// Costs O(rows x width) per tick.
    pub fn rows(width: usize, matrix: Vec<Real>) -> Self {
        let fault = broken_row(width, &matrix);
        let map = Rows { matrix, dim: width };
        let count = map.output_width();
        Self::new(InputSpec::vector(width), OutputSpec::vector(count), Box::new(map))
            .with_fault(fault)
    }

    /// Makes a node that gives a weighted sum of the rows of `matrix`. The input has one weight per row.
    ///
    /// `matrix` is row-major, with `width` numbers per row. An incomplete row is a fault when the graph is built. A
    /// row of weight zero costs nothing; each other row costs O(width) per tick.
    pub fn weighted_rows(width: usize, matrix: Vec<Real>) -> Self {
        let fault = broken_row(width, &matrix);
        let map = WeightedRows { matrix, dim: width };
        let count = map.input_width();
        Self::new(InputSpec::vector(count), OutputSpec::vector(width), Box::new(map))
            .with_fault(fault)
    }

    /// Makes a node that takes `from` numbers and gives `to` numbers. Each weight is the position of an input, the
    /// position of an output, and a factor; factors of the same pair add up.
    ///
    /// An input of zero costs nothing. Each other input costs O(its weights) per tick. A position outside the vectors is
    /// a fault when the graph is built.
    ///
    /// ```
    /// use symbolt::prelude::*;
    /// use symbolt::spa::Linear;
    ///
    /// let mut graph = GraphBuilder::new();
    /// let input = graph.add("input", Constant::vector(&[1.0, 2.0, 3.0]));
    /// let sums = graph.add("sums", Linear::sparse(3, 2, [(0, 0, 1.0), (2, 0, 1.0), (1, 1, -1.0)]));
    /// graph.connect(&input, &sums.input, Synapse::None);
    /// let probe = graph.probe(&sums.output, ProbeSpec::default());
    /// let graph = graph.build(Timebase::default(), &PopulationPlan::default(), Seed::new(1))?;
    /// let mut sim = Simulator::new(graph.into(), RunConfig::default())?;
    /// sim.run_for(SimDuration::from_millis(1))?;
    /// assert_eq!(sim.samples(&probe).last().expect("one tick").1, [4.0, -2.0]);
    /// # Ok::<(), symbolt::sim::SimError>(())
    /// ```
    pub fn sparse(
        from: usize,
        to: usize,
        weights: impl IntoIterator<Item = (usize, usize, Real)>,
    ) -> Self {
        let weights: Vec<_> = weights.into_iter().collect();
        let outside = weights.iter().rfind(|(input, output, _)| *input >= from || *output >= to);
        let fault = outside.map(|(input, output, _)| {
            format!(
                "the weight from {input} to {output} is outside the node; it has {from} inputs and {to} outputs, counted from 0"
            )
        });
        let map = Sparse::new(from, to, &weights);
        Self::new(InputSpec::vector(from), OutputSpec::vector(to), Box::new(map)).with_fault(fault)
    }
}

impl Linear<Vector, Scalar> {
    /// Makes a node that gives the dot product of a vector with `weights`. The vector has one component per weight.
    /// Costs O(weights) per tick.
    pub fn weighted_sum(weights: Vec<Real>) -> Self {
        let dim = weights.len();
        let map = Rows { matrix: weights, dim };
        Self::new(InputSpec::vector(dim), OutputSpec::scalar(), Box::new(map))
    }
}

/// Declares the ports of a map, of any kinds: compiled once.
fn declare(
    ports: &mut PortDecl,
    (input, output): (AnyInput, AnyOutput),
    map: &dyn LinearMap,
    fault: Option<&str>,
) {
    if let Some(fault) = fault {
        ports.fault(fault);
    }
    let (takes, gives) = (input.width(), output.width());
    let (from, to) = (map.input_width(), map.output_width());
    if (takes, gives) != (from, to) {
        ports.fault(format!(
            "the map takes {from} and gives {to} numbers; the ports take {takes} and give {gives}; expected equal widths"
        ));
    }
    ports.input("in", input).output("out", output).scratch(map.scratch());
}

impl<A: Kind, B: Kind> Node for Linear<A, B> {
    fn declare(&self, ports: &mut PortDecl) {
        let (input, output) = (self.input.clone().into(), self.output.clone().into());
        declare(ports, (input, output), &*self.map, self.fault.as_deref());
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        self.map.fingerprint(hash);
    }

    fn emit(&self, _cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
        self.map.apply_into(io.inputs.get(0), io.outputs.get_mut(0), &mut io.scratch);
    }
}

impl<A: Kind, B: Kind> Module for Linear<A, B> {
    type Ports = Ports<A, B>;

    fn expand(self, scope: &mut Scope<'_>) -> Ports<A, B> {
        let node = scope.leaf(self);
        scope.ports(Ports::of(&node))
    }
}
