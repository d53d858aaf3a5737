//! Linear nodes: fixed maps, rows of a matrix, weighted sums, changes of vocabulary.
//!
//! None of them costs a tick.

use crate::sim::{
    AnyInput, AnyOutput, EmitIo, Fingerprint, In, InputSpec, Kind, Module, Node, Out, OutputSpec,
    Pointer, PointerRef, PortDecl, Real, Scalar, Scope, Scratch, ScratchSpec, Space, StepCx,
    Vector, VocabTag,
};
use crate::spa::algebra::LinearMap;
use crate::spa::item_memory::dots;
use crate::spa::vocabulary::Vocabulary;

/// A node that applies a linear map, without a tick of delay.
pub struct Linear<A: Kind, B: Kind> {
    input: InputSpec<A>,
    output: OutputSpec<B>,
    map: Box<dyn LinearMap>,
    /// What is wrong with the numbers that the map was made of.
    fault: Option<String>,
}

/// Input and output of a [`Linear`].
pub struct LinearPorts<A: Kind, B: Kind> {
    /// What the map is applied to.
    pub input: In<A>,
    /// What it gives.
    pub output: Out<B>,
}

impl<A: Kind, B: Kind> Linear<A, B> {
    /// `map` between ports of the given kinds; `build` reports widths that do not fit.
    pub fn new(input: InputSpec<A>, output: OutputSpec<B>, map: Box<dyn LinearMap>) -> Self {
        Self { input, output, map, fault: None }
    }

    fn with_fault(mut self, fault: Option<String>) -> Self {
        self.fault = fault;
        self
    }
}

impl<A: VocabTag> Linear<Pointer<A>, Vector> {
    /// The dot products of a pointer of `space` with each of `keys`, in their order; `build` refuses a key of
    /// another dimension.
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
    /// The sum of `values`, pointers of `space`, each times a number of the input; those times zero cost
    /// nothing. `build` refuses a value of another dimension.
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

/// Pointers as the rows of a matrix, and what is wrong with the first one that has another dimension than the
/// space. Its row is zero, so that the node has the ports that are connected and the fault is the only one.
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

/// What is wrong with a matrix whose last row of `width` numbers is not whole.
fn broken_row(width: usize, matrix: &[Real]) -> Option<String> {
    let (numbers, over) = (matrix.len(), matrix.len() % width.max(1));
    (over != 0).then(|| {
        format!("{numbers} numbers are not whole rows of {width}; expected a multiple of {width}")
    })
}

impl Linear<Vector, Vector> {
    /// The dot products of a vector of `width` numbers with the rows of a row-major matrix; `build` refuses one
    /// whose last row is not whole.
    pub fn rows(width: usize, matrix: Vec<Real>) -> Self {
        let fault = broken_row(width, &matrix);
        let map = Rows { matrix, dim: width };
        let count = map.output_width();
        Self::new(InputSpec::vector(width), OutputSpec::vector(count), Box::new(map))
            .with_fault(fault)
    }

    /// The sum of the rows of a row-major matrix of `width` columns, each times a number of the input; rows
    /// times zero cost nothing. `build` refuses a matrix whose last row is not whole.
    pub fn weighted_rows(width: usize, matrix: Vec<Real>) -> Self {
        let fault = broken_row(width, &matrix);
        let map = WeightedRows { matrix, dim: width };
        let count = map.input_width();
        Self::new(InputSpec::vector(count), OutputSpec::vector(width), Box::new(map))
            .with_fault(fault)
    }
}

impl Linear<Vector, Scalar> {
    /// The dot product of a vector with `weights`.
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
                "a map from {} to {} numbers stands between ports of {takes} and {gives}",
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
struct Rows {
    matrix: Vec<Real>,
    dim: usize,
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

/// The sum of the rows of a matrix, each times a number.
struct WeightedRows {
    matrix: Vec<Real>,
    dim: usize,
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

/// Adds pointers of one vocabulary, each times a weight of its own.
///
/// With a population in the way use [`Gate`](super::Gate) or a memory; a sum needs none.
pub struct Superpose<V: VocabTag> {
    space: Space<V>,
    weights: Vec<Real>,
}

/// Ports of a [`Superpose`].
pub struct SuperposePorts<V: VocabTag> {
    /// One input for each weight.
    pub inputs: Vec<In<Pointer<V>>>,
    /// The weighted sum.
    pub output: Out<Pointer<V>>,
}

impl<V: VocabTag> Superpose<V> {
    /// A sum of as many pointers of `vocabulary` as there are `weights`.
    pub fn new(vocabulary: &Vocabulary<V>, weights: &[Real]) -> Self {
        Self::weights(vocabulary.space(), weights)
    }

    pub(crate) fn weights(space: &Space<V>, weights: &[Real]) -> Self {
        Self { space: space.clone(), weights: weights.to_vec() }
    }
}

impl<V: VocabTag> Node for Superpose<V> {
    fn declare(&self, ports: &mut PortDecl) {
        if self.weights.iter().any(|w| !w.is_finite()) {
            ports.fault("a weight is not a finite number");
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

/// Passes values on unchanged under another kind or space of the same width: the explicit way to
/// cross vocabularies without any maths.
pub struct Reinterpret<A: Kind, B: Kind> {
    input: InputSpec<A>,
    output: OutputSpec<B>,
}

/// Input and output of a [`Reinterpret`].
pub type ReinterpretPorts<A, B> = LinearPorts<A, B>;

impl<A: Kind, B: Kind> Reinterpret<A, B> {
    /// From one kind of port to another of the same width.
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
            ports.fault(format!("{takes} numbers cannot be read as {gives}"));
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
