//! Linear nodes: fixed maps, matrices, weighted sums and changes of vocabulary. They cost no tick.

use std::ops::Range;

use crate::sim::{
    AnyInput, AnyOutput, EmitIo, Fingerprint, In, InputSpec, Kind, Module, Node, Out, OutputSpec,
    Pointer, PointerRef, PortDecl, Real, Scalar, Scope, Scratch, ScratchSpec, Space, StepCx,
    Vector, VocabTag,
};
use crate::spa::algebra::LinearMap;
use crate::spa::item_memory::dots;
use crate::spa::vocabulary::Vocabulary;

/// A node that applies a fixed linear map, without a tick of delay.
pub struct Linear<A: Kind, B: Kind> {
    input: InputSpec<A>,
    output: OutputSpec<B>,
    map: Box<dyn LinearMap>,
    /// Fault in the numbers that the map was made from.
    fault: Option<String>,
}

/// Input and output of a [`Linear`].
pub struct LinearPorts<A: Kind, B: Kind> {
    /// Input of the map; takes one connection.
    pub input: In<A>,
    /// Output of the map.
    pub output: Out<B>,
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
        let (matrix, fault) = stacked(space, keys);
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
        let (matrix, fault) = stacked(space, values);
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
    pointers: impl IntoIterator<Item = PointerRef<'p, V>>,
) -> (Vec<Real>, Option<String>) {
    let dim = space.width();
    let (mut matrix, mut fault) = (Vec::new(), None);
    for (index, pointer) in pointers.into_iter().enumerate() {
        if pointer.len() == dim {
            matrix.extend_from_slice(&pointer);
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

impl<A: Kind, B: Kind> Node for Linear<A, B> {
    fn declare(&self, ports: &mut PortDecl) {
        if let Some(fault) = &self.fault {
            ports.fault(fault.clone());
        }
        let (takes, gives) = (
            AnyInput::from(self.input.clone()).width(),
            AnyOutput::from(self.output.clone()).width(),
        );
        if (takes, gives) != (self.map.input_width(), self.map.output_width()) {
            ports.fault(format!(
                "the map takes {} and gives {} numbers; the ports take {takes} and give {gives}; expected equal widths",
                self.map.input_width(),
                self.map.output_width()
            ));
        }
        ports
            .input("in", self.input.clone())
            .output("out", self.output.clone())
            .scratch(self.map.scratch());
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        self.map.fingerprint(hash);
    }

    fn emit(&self, _cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
        self.map.apply_into(io.inputs.get(0), io.outputs.get_mut(0), &mut io.scratch);
    }
}

impl<A: Kind, B: Kind> Module for Linear<A, B> {
    type Ports = LinearPorts<A, B>;

    fn expand(self, scope: &mut Scope<'_>) -> LinearPorts<A, B> {
        let node = scope.leaf(self);
        LinearPorts {
            input: scope.input("input", node.input("in")),
            output: scope.output("output", node.output("out")),
        }
    }
}

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

    fn scratch(&self) -> ScratchSpec {
        ScratchSpec::default()
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
    matrix: Vec<Real>,
    dim: usize,
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

    fn scratch(&self) -> ScratchSpec {
        ScratchSpec::default()
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text("weighted rows").reals(&self.matrix);
    }

    fn apply_into(&self, input: &[Real], out: &mut [Real], _scratch: &mut Scratch<'_>) {
        out.fill(0.0);
        for (row, weight) in self.matrix.chunks_exact(self.dim).zip(input) {
            if *weight != 0.0 {
                for (sum, value) in out.iter_mut().zip(row) {
                    *sum += weight * value;
                }
            }
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

    fn scratch(&self) -> ScratchSpec {
        ScratchSpec::default()
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

    fn scratch(&self) -> ScratchSpec {
        ScratchSpec::default()
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        let Range { start, end } = self.range;
        hash.text("slice").number(self.from as u64).number(start as u64).number(end as u64);
    }

    fn apply_into(&self, input: &[Real], out: &mut [Real], _scratch: &mut Scratch<'_>) {
        out.copy_from_slice(&input[self.range.clone()]);
    }
}

/// Adds pointers of one vocabulary, each with a weight. Needs no neurons and no tick of delay. Computing it takes
/// O(weights x dimensions) per tick.
///
/// [`State`](super::State) represents a sum in neurons.
pub struct Superpose<V: VocabTag> {
    space: Space<V>,
    weights: Vec<Real>,
}

/// Ports of a [`Superpose`].
pub struct SuperposePorts<V: VocabTag> {
    /// Inputs, one per weight; each takes one connection.
    pub inputs: Vec<In<Pointer<V>>>,
    /// Weighted sum of the inputs.
    pub output: Out<Pointer<V>>,
}

impl<V: VocabTag> Superpose<V> {
    /// Makes a module that adds pointers of `vocabulary`, one per weight.
    ///
    /// A weight that is not finite is a fault when the graph is built.
    pub fn new(vocabulary: &Vocabulary<V>, weights: &[Real]) -> Self {
        Self::weights(vocabulary.space(), weights)
    }

    pub(crate) fn weights(space: &Space<V>, weights: &[Real]) -> Self {
        Self { space: space.clone(), weights: weights.to_vec() }
    }
}

impl<V: VocabTag> Node for Superpose<V> {
    fn declare(&self, ports: &mut PortDecl) {
        if let Some(at) = self.weights.iter().position(|w| !w.is_finite()) {
            ports.fault(format!("weight {at} is {}; expected a finite number", self.weights[at]));
        }
        for index in 0..self.weights.len() {
            let spec = InputSpec::<Pointer<V>>::pointer(&self.space);
            ports.input(&format!("in{index}"), spec);
        }
        ports.output("out", OutputSpec::<Pointer<V>>::pointer(&self.space));
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.reals(&self.weights);
    }

    fn emit(&self, _cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
        let output = io.outputs.get_mut(0);
        output.fill(0.0);
        for (index, weight) in self.weights.iter().enumerate() {
            for (sum, value) in output.iter_mut().zip(io.inputs.get(index)) {
                *sum += weight * value;
            }
        }
    }
}

impl<V: VocabTag> Module for Superpose<V> {
    type Ports = SuperposePorts<V>;

    fn expand(self, scope: &mut Scope<'_>) -> SuperposePorts<V> {
        let count = self.weights.len();
        let node = scope.leaf(self);
        SuperposePorts {
            inputs: (0..count)
                .map(|i| scope.input(&format!("inputs[{i}]"), node.input(&format!("in{i}"))))
                .collect(),
            output: scope.output("output", node.output("out")),
        }
    }
}

/// Passes values on unchanged, as another kind of port or a pointer of another vocabulary.
///
/// Use it to connect ports of different vocabularies on purpose; a direct connection does not compile. Costs no tick.
pub struct Reinterpret<A: Kind, B: Kind> {
    input: InputSpec<A>,
    output: OutputSpec<B>,
}

/// Input and output of a [`Reinterpret`].
pub type ReinterpretPorts<A, B> = LinearPorts<A, B>;

impl<A: Kind, B: Kind> Reinterpret<A, B> {
    /// Makes a node from one kind of port to another. Different widths are a fault when the graph is built.
    pub fn new(input: InputSpec<A>, output: OutputSpec<B>) -> Self {
        Self { input, output }
    }
}

impl<A: Kind, B: Kind> Node for Reinterpret<A, B> {
    fn declare(&self, ports: &mut PortDecl) {
        let (takes, gives) = (
            AnyInput::from(self.input.clone()).width(),
            AnyOutput::from(self.output.clone()).width(),
        );
        if takes != gives {
            ports.fault(format!(
                "the input has width {takes} but the output has width {gives}; expected equal widths"
            ));
        }
        ports.input("in", self.input.clone()).output("out", self.output.clone());
    }

    fn fingerprint(&self, _hash: &mut Fingerprint) {}

    fn emit(&self, _cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
        io.outputs.get_mut(0).copy_from_slice(io.inputs.get(0));
    }
}

impl<A: Kind, B: Kind> Module for Reinterpret<A, B> {
    type Ports = ReinterpretPorts<A, B>;

    fn expand(self, scope: &mut Scope<'_>) -> ReinterpretPorts<A, B> {
        let node = scope.leaf(self);
        LinearPorts {
            input: scope.input("input", node.input("in")),
            output: scope.output("output", node.output("out")),
        }
    }
}
