//! The node of every layer in neurons: its populations, and the circuit that wires them to inputs and outputs.

use std::ops::Range;
use std::sync::Arc;

use crate::neurons::bank::{Bank, Ensembles, Solved};
use crate::sim::{
    Fingerprint, Inputs, Node, Outputs, PartIo, PartSpec, Parts, PortDecl, Real, ScratchSpec,
    StateMut, StateSpec, StepCx, mix64,
};

/// How the populations of a layer compute a tick. The default feeds the rows of the first input to the first
/// population, and hands on what is decoded as the first output.
///
/// A layer advances in parts, each of some of its items; an item is an ensemble of the first population, or the
/// ensembles that [`Populated::unit`] keeps together.
pub trait Circuit: Send + Sync + 'static {
    /// Advances the items of a part: updates `io.state` and writes `io.results`. Must neither allocate, lock nor log.
    fn advance(&self, items: &Items<'_>, io: &mut PartIo<'_>) {
        let values = &io.inputs.get(0)[items.rows()];
        items.step(0, (values, 1.0), io.state, io.results);
    }

    /// Writes the results of some items to the outputs.
    fn collect(&self, items: Range<usize>, results: &[Real], outputs: &mut Outputs<'_>) {
        let width = results.len() / items.len();
        outputs.get_mut(0)[items.start * width..items.end * width].copy_from_slice(results);
    }

    /// Adds to `values` the values that the ensembles of the first population are to represent, a row per ensemble, if
    /// exact maths goes on beyond their radius. The default is for layers whose exact form is limited as their neurons are.
    fn unlimited(&self, items: &Items<'_>, inputs: Inputs<'_>, values: &mut Vec<Real>) {
        let _ = (items, inputs, values);
    }

    /// Adds to `hash` what neither the ports nor the populations determine.
    fn fingerprint(&self, hash: &mut Fingerprint) {
        let _ = hash;
    }
}

/// The circuit of a layer that decodes its first input.
#[derive(Debug, Clone, Copy)]
pub struct Through;

impl Circuit for Through {}

/// The items of a layer that are advanced together.
#[derive(Debug)]
pub struct Items<'a> {
    populations: &'a [Ensembles],
    part: usize,
    range: Range<usize>,
    /// Key of the random numbers of the tick.
    draws: u64,
}

impl Items<'_> {
    /// Returns the indices of the items.
    pub fn range(&self) -> Range<usize> {
        self.range.clone()
    }

    /// Returns the place of their values in an input of the first population.
    pub fn rows(&self) -> Range<usize> {
        let first = &self.populations[0];
        let (ensembles, dims) = (first.ensembles(self.part), first.bank.shape().dims);
        ensembles.start * dims..ensembles.end * dims
    }

    /// Steps their ensembles of a population, which are counted from 0. `values` is a row per ensemble, and a gate: 0
    /// silences every neuron, 1 has no effect. `out` gets a row of decoded values per ensemble.
    pub fn step(
        &self,
        population: usize,
        values: (&[Real], Real),
        state: &mut [Real],
        out: &mut [Real],
    ) {
        let draws = self.draws_of(population);
        self.populations[population].step((self.part, draws), values, &[], state, out);
    }

    /// Steps the ensembles of the first population, with a current added to each neuron: a row per ensemble. `out` gets a
    /// row of decoded values per ensemble, then the activity of every neuron in Hz, a row per ensemble.
    pub(super) fn step_neurons(
        &self,
        values: &[Real],
        currents: &[Real],
        state: &mut [Real],
        out: &mut [Real],
    ) {
        let draws = self.draws_of(0);
        self.populations[0].step((self.part, draws), (values, 1.0), currents, state, out);
    }

    /// Writes a variable of the neurons of the first population.
    pub(super) fn show(&self, variable: usize, state: &[Real], out: &mut [Real]) {
        let bank = &self.populations[0].bank;
        let neurons = out.iter_mut().enumerate();
        neurons.for_each(|(neuron, out)| *out = bank.variable(variable, state, neuron));
    }

    /// Returns the key of the random numbers of a population in this tick.
    fn draws_of(&self, population: usize) -> u64 {
        mix64(self.draws.wrapping_add(population as u64))
    }

    /// Splits the state of the items: that of each population, and the numbers of [`Populated::held`].
    pub fn split<'s, const N: usize>(
        &self,
        state: &'s mut [Real],
    ) -> ([&'s mut [Real]; N], &'s mut [Real]) {
        let mut rest = state;
        let own = std::array::from_fn(|population| {
            let state = self.populations[population].spec(self.part).state;
            let (own, after) = std::mem::take(&mut rest).split_at_mut(state);
            rest = after;
            own
        });
        (own, rest)
    }
}

/// The node of a layer in neurons.
pub struct Populated {
    ports: Box<dyn Node>,
    populations: Vec<Ensembles>,
    circuit: Box<dyn Circuit>,
    unit: usize,
    results: usize,
    held: usize,
    scratch: usize,
}

impl Populated {
    /// Makes a node with the ports of `exact`, the layer's node in direct mode.
    pub fn new(exact: Box<dyn Node>, population: Ensembles, circuit: impl Circuit) -> Self {
        let results = population.bank.shape().outputs;
        Self {
            ports: exact,
            populations: vec![population],
            circuit: Box::new(circuit),
            unit: 1,
            results,
            held: 0,
            scratch: 0,
        }
    }

    /// Adds a further population, with as many ensembles as the first, cut into the same parts.
    pub fn and(mut self, population: Ensembles) -> Self {
        self.populations.push(population);
        self
    }

    /// Sets the number of ensembles of an item (default 1), and the number of its results (default: what one ensemble
    /// decodes).
    pub fn unit(mut self, ensembles: usize, results: usize) -> Self {
        (self.unit, self.results) = (ensembles, results);
        self
    }

    /// Gives each item numbers that it keeps from tick to tick. They start at 0.
    pub fn held(mut self, numbers: usize) -> Self {
        self.held = numbers;
        self
    }

    /// Lends each item numbers of scratch memory.
    pub fn scratch(mut self, numbers: usize) -> Self {
        self.scratch = numbers;
        self
    }

    /// Returns what the populations were solved to.
    pub(in crate::neurons) fn solved(&self) -> impl Iterator<Item = &Arc<Solved>> {
        self.populations.iter().map(|population| &population.bank.solved)
    }

    /// Returns the populations.
    pub(in crate::neurons) fn populations(&self) -> &[Ensembles] {
        &self.populations
    }

    /// Adds to `values` what [`Circuit::unlimited`] says of the items of a part.
    pub(in crate::neurons) fn unlimited(
        &self,
        part: usize,
        inputs: Inputs<'_>,
        values: &mut Vec<Real>,
    ) {
        self.circuit.unlimited(&self.items(part, 0), inputs, values);
    }

    /// Returns the radius of the ensembles of the first population; `None` if they cannot be drawn again.
    pub(in crate::neurons) fn radius(&self) -> Option<f64> {
        Some((self.first().origin.draft)(0).ok()?.radius)
    }

    /// Returns the number of dimensions of an ensemble of the first population.
    pub(in crate::neurons) fn dims(&self) -> usize {
        self.first().bank.shape().dims
    }

    /// Returns the banks, to be changed before the graph is built.
    pub(in crate::neurons) fn banks_mut(&mut self) -> impl Iterator<Item = &mut Bank> {
        self.populations.iter_mut().map(|population| &mut population.bank)
    }

    fn first(&self) -> &Ensembles {
        &self.populations[0]
    }

    fn items(&self, part: usize, draws: u64) -> Items<'_> {
        let ensembles = self.first().ensembles(part);
        let range = ensembles.start / self.unit..ensembles.end / self.unit;
        Items { populations: &self.populations, part, range, draws }
    }
}

impl Node for Populated {
    fn declare(&self, ports: &mut PortDecl) {
        self.ports.declare(ports);
        let reals = self.scratch * self.items(0, 0).range.len();
        ports.state(StateSpec::default()).scratch(ScratchSpec { reals, ..ScratchSpec::default() });
    }

    /// The weights of a circuit follow from its populations and the length of a tick.
    fn fingerprint(&self, hash: &mut Fingerprint) {
        for solved in self.solved() {
            hash.number(solved.fingerprint);
        }
        self.circuit.fingerprint(hash);
    }

    fn init(&self, _cx: &StepCx<'_>, state: &mut StateMut<'_>, _registered: &mut Outputs<'_>) {
        for (index, population) in self.populations.iter().enumerate() {
            let mut next = 0;
            let places = (0..self.count()).map(move |part| {
                let before: usize =
                    self.populations[..index].iter().map(|other| other.spec(part).state).sum();
                let start = next + before;
                next += self.part(part).state;
                start..start + population.spec(part).state
            });
            population.bank.init(state.reals, places);
        }
    }

    fn parts(&self) -> Option<&dyn Parts> {
        Some(self)
    }

    fn units(&self) -> usize {
        let bank = &self.first().bank;
        bank.spiking_of(bank.shape().ensembles)
    }
}

impl Parts for Populated {
    fn count(&self) -> usize {
        self.first().count()
    }

    fn part(&self, part: usize) -> PartSpec {
        let (items, own) = (self.items(part, 0).range.len(), self.first().spec(part));
        let all = || self.populations.iter().map(|population| population.spec(part));
        PartSpec {
            results: self.results * items,
            state: all().map(|spec| spec.state).sum::<usize>() + self.held * items,
            work: all().map(|spec| spec.work).sum(),
            ..own
        }
    }

    fn advance(&self, cx: &StepCx<'_>, part: usize, io: &mut PartIo<'_>) {
        self.circuit.advance(&self.items(part, cx.draws()), io);
    }

    fn collect(&self, part: usize, results: &[Real], outputs: &mut Outputs<'_>) {
        self.circuit.collect(self.items(part, 0).range, results, outputs);
    }

    fn event(&self, part: usize, state: &[Real], neuron: usize) -> bool {
        let first = self.first();
        first.bank.spiked(&state[..first.spec(part).state], neuron)
    }
}
