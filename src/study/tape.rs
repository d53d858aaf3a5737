//! Plans on a tape and on the shift stack of the 2016 paper: written, then read back whole.
//!
//! The tape is `sum over k of INDEX^k * action_k`, of which only the index moves. It is read position by position, where all
//! other actions are noise, or all positions together, which subtracts what is recognised. The shift stack of Blouw, Eliasmith
//! and Tripp (2016) is pushed by `stack * INDEX + action`, and its population limits the length: each push takes
//! 1 / sqrt 2 off all that was there. It is popped from the top: the action that is read is subtracted, and the rest
//! is shifted back and amplified until it fills the population.

use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

use crate::neurons::{LifSpec, PatternError, Population, PopulationPlan, SolvedModel, Tuning};
use crate::sim::{
    GraphBuilder, PointerRef, Real, Seed, Signal, SimDuration, Simulator, Stimulus, Synapse,
    Timebase, VocabTag,
};
use crate::spa::{
    PairDecoder, Tape, VocabError, Vocabulary, VocabularyBuilder, cosine_of_slices, dot, norm,
    normalize,
};
use crate::task::TaskError;

/// Sizes of a trial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TapeSpec {
    /// Number of dimensions.
    pub dimensions: usize,
    /// Number of actions from which plans are drawn.
    pub actions: usize,
    /// Number of actions of a plan.
    pub depth: usize,
    /// Standard deviation of noise on each component in exact maths: of the tape, and of the stack after each push and
    /// pop.
    pub noise: Real,
}

impl Default for TapeSpec {
    fn default() -> Self {
        Self { dimensions: 512, actions: 200, depth: 15, noise: 0.02 }
    }
}

/// The tag of the pointers.
struct Planned;

impl VocabTag for Planned {
    const NAME: &'static str = "planned";
}

/// Actions, positions, and a plan.
struct Plan {
    vocabulary: Vocabulary<Planned>,
    actions: Vec<String>,
    positions: Vec<String>,
    /// Number of each action of the plan.
    chosen: Vec<usize>,
}

impl Plan {
    fn draw(spec: &TapeSpec, seed: Seed) -> Result<Self, VocabError> {
        let actions: Vec<String> = (0..spec.actions).map(|i| format!("A{i}")).collect();
        // One position more than actions, so that the index can begin again.
        let positions: Vec<String> = (1..=spec.depth + 1).map(|i| format!("P{i}")).collect();
        let mut builder = VocabularyBuilder::new(spec.dimensions, seed)
            .any_similarity()
            .pointers(&actions)
            .unitary("P1");
        for pair in positions.windows(2) {
            builder = builder.define(pair[1].clone(), format!("{} * P1", pair[0]));
        }
        let mut rng = seed.derive("tape", "plan").rng();
        let chosen = (0..spec.depth).map(|_| rng.random_range(0..spec.actions.max(1))).collect();
        Ok(Self { vocabulary: builder.build()?, actions, positions, chosen })
    }

    fn action(&self, number: usize) -> &[Real] {
        let dim = self.vocabulary.dim();
        &self.vocabulary.matrix()[number * dim..(number + 1) * dim]
    }

    /// Returns the tape that holds the whole plan.
    fn tape(&self) -> Result<Vec<Real>, VocabError> {
        let (dim, algebra) = (self.vocabulary.dim(), self.vocabulary.algebra());
        let (mut work, mut bound) = (algebra.scratch(dim), vec![0.0; dim]);
        let mut tape = vec![0.0; dim];
        for (position, action) in self.positions.iter().zip(&self.chosen) {
            let position = self.vocabulary.get(position)?;
            algebra.bind_into(self.action(*action), &position, &mut bound, &mut work);
            tape.iter_mut().zip(&bound).for_each(|(sum, value)| *sum += value);
        }
        Ok(tape)
    }

    /// Returns the number of the action that is most similar to `read`.
    fn nearest(&self, read: &[Real]) -> usize {
        let similar = |number: &usize| dot(self.action(*number), read);
        (0..self.actions.len()).max_by(|a, b| similar(a).total_cmp(&similar(b))).unwrap_or(0)
    }
}

fn disturb<R: Rng>(vector: &mut [Real], sd: Real, rng: &mut R) {
    for value in vector {
        let z: Real = StandardNormal.sample(rng);
        *value += sd * z;
    }
}

/// Writes a plan to a tape in exact maths, with noise, and returns how many of its actions are read right.
///
/// # Errors
/// [`VocabError::Dimension`] if the number of dimensions cannot be used.
pub fn exact_tape(spec: &TapeSpec, seed: Seed) -> Result<usize, VocabError> {
    let plan = Plan::draw(spec, seed)?;
    let (dim, algebra) = (spec.dimensions, plan.vocabulary.algebra());
    let (mut work, mut inverse, mut read) = (algebra.scratch(dim), vec![0.0; dim], vec![0.0; dim]);
    let mut tape = plan.tape()?;
    disturb(&mut tape, spec.noise, &mut seed.derive("tape", "noise").rng());
    let mut right = 0;
    for (position, action) in plan.positions.iter().zip(&plan.chosen) {
        algebra.inverse_into(&plan.vocabulary.get(position)?, &mut inverse);
        algebra.bind_into(&tape, &inverse, &mut read, &mut work);
        right += usize::from(plan.nearest(&read) == *action);
    }
    Ok(right)
}

/// Writes a plan to a tape in exact maths, with noise, reads all positions together ([`PairDecoder`]), and returns how many
/// of its actions are read right.
///
/// # Errors
/// [`VocabError::Dimension`] if the number of dimensions cannot be used; [`VocabError::BadVector`] if there are no actions.
pub fn exact_together(spec: &TapeSpec, seed: Seed) -> Result<usize, VocabError> {
    let plan = Plan::draw(spec, seed)?;
    let (matrix, dim) = (plan.vocabulary.matrix(), spec.dimensions);
    let (actions, positions) = matrix.split_at(plan.actions.len() * dim);
    let mut decoder = PairDecoder::new(dim, positions, actions)?;
    let mut tape = plan.tape()?;
    disturb(&mut tape, spec.noise, &mut seed.derive("tape", "noise").rng());
    let read = decoder.read(&tape);
    Ok(read.iter().zip(&plan.chosen).filter(|(filler, action)| filler.item == **action).count())
}

/// Pushes a plan on a shift stack in exact maths, with noise, and returns how many of its actions are popped right before
/// the first wrong one.
///
/// # Errors
/// [`VocabError::Dimension`] if the number of dimensions cannot be used.
pub fn exact_stack(spec: &TapeSpec, seed: Seed) -> Result<usize, VocabError> {
    let plan = Plan::draw(spec, seed)?;
    let (dim, algebra) = (spec.dimensions, plan.vocabulary.algebra());
    let mut rng = seed.derive("tape", "noise").rng();
    let (mut work, mut inverse, mut next) = (algebra.scratch(dim), vec![0.0; dim], vec![0.0; dim]);
    let index = plan.vocabulary.get("P1")?;
    algebra.inverse_into(&index, &mut inverse);
    let mut stack = vec![0.0; dim];
    for action in &plan.chosen {
        algebra.bind_into(&stack, &index, &mut next, &mut work);
        let pushed = next.iter().zip(plan.action(*action)).map(|(old, new)| old + new);
        stack = pushed.collect();
        normalize(&mut stack);
        disturb(&mut stack, spec.noise, &mut rng);
    }
    for (popped, action) in plan.chosen.iter().rev().enumerate() {
        let top = plan.nearest(&stack);
        if top != *action {
            return Ok(popped);
        }
        let rest: Vec<Real> = stack.iter().zip(plan.action(top)).map(|(a, b)| a - b).collect();
        algebra.bind_into(&rest, &inverse, &mut stack, &mut work);
        normalize(&mut stack);
        disturb(&mut stack, spec.noise, &mut rng);
    }
    Ok(plan.chosen.len())
}

/// Number of neurons per dimension of the population that holds the tape, for [`populations`].
///
/// 25 read 5 of 8 plans back whole, 50 read 8 of 8. 100 are twice what is needed, and hold 20 actions: 8 of 8.
pub(super) const HELD_PER_DIMENSION: usize = 100;
/// Number of neurons per product that binds, for [`populations`].
///
/// 25 read 8 of 8 plans back whole with 50 neurons per dimension of the tape. 50 are twice that.
pub(super) const PER_PRODUCT: usize = 50;

/// Returns spiking populations for [`run_tape`]: more neurons than usual hold the tape, fewer bind. With 512 dimensions, 200
/// actions and 15 of them on the tape they are 310,600 neurons.
///
/// # Errors
/// None that is known: the path in it is valid.
pub fn populations() -> Result<PopulationPlan, TaskError> {
    let usual = Tuning { per_product: PER_PRODUCT, ..Tuning::default() };
    let held = Tuning { per_dimension: HELD_PER_DIMENSION, ..usual };
    let of = |tuning| Population::Lif(LifSpec::tuned(tuning));
    let path = "tape/held".parse().map_err(|error: PatternError| VocabError::BadVector {
        name: "tape".into(),
        reason: error.to_string(),
    })?;
    Ok(PopulationPlan::all(of(usual)).with(path, of(held)))
}

/// What a network read back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TapeRead {
    /// Number of actions that were read right.
    pub right: usize,
    /// Number of neurons.
    pub neurons: usize,
    /// Length of the tape after all actions were written.
    pub length: f64,
    /// Cosine of the tape with the exact one.
    pub cosine: f64,
}

/// Time from one position to the next: while actions are written, and while they are read.
const STEP: SimDuration = SimDuration::from_millis(200);
/// Time of a step for which `next` is 1.
const MOVING_S: f64 = 0.07;
/// Time of a step at which writing begins; it ends with the step.
const WRITING_FROM_S: f64 = 0.1;

/// Writes a plan to a [`Tape`] in a network and reads it back. The plan is shown action by action, 200 ms each; then the
/// index goes over the positions again, 200 ms each. The tape knows the actions ([`Tape::items`]): it decodes all positions
/// together and gives the action at the index. An action is read right if the output of the last 40 ms is nearer to it than
/// to all others, with a similarity of at least 0.5.
///
/// # Errors
/// [`TaskError::Vocabulary`] or [`TaskError::Build`] if the number of dimensions or the plan of populations is invalid;
/// [`TaskError::Sim`] if a value becomes infinite or NaN.
pub fn run_tape(
    spec: &TapeSpec,
    populations: &PopulationPlan,
    seed: Seed,
) -> Result<TapeRead, TaskError> {
    let plan = Plan::draw(spec, seed)?;
    let vocabulary = &plan.vocabulary;
    let mut graph = GraphBuilder::new();
    let tape = Tape::new(vocabulary, plan.positions.iter().map(String::as_str))?
        .items(plan.actions.iter().map(String::as_str))?;
    let tape = graph.add("tape", tape);

    let step = STEP.as_secs_f64();
    let written = step * spec.depth as f64;
    let next = Signal::scalar(move |t| if t >= step && t % step < MOVING_S { 1.0 } else { 0.0 });
    let write =
        Signal::scalar(
            move |t| {
                if t < written - 1e-9 && t % step >= WRITING_FROM_S { 1.0 } else { 0.0 }
            },
        );
    let (next, write) = (graph.add("next", next), graph.add("write", write));
    let pointer = |number: usize| PointerRef::<Planned>::from_raw(plan.action(number));
    let first = plan.chosen.first().copied().unwrap_or(0);
    let mut item = Stimulus::pointer(vocabulary.space(), &pointer(first));
    for (at, action) in plan.chosen.iter().enumerate().skip(1) {
        // The last action is bound until its gate is closed.
        let from = STEP.as_micros() * at as u64 + LATE.as_micros();
        item = item.from(SimDuration::from_micros(from), &pointer(*action));
    }
    let item = graph.add("item", item);
    graph.connect(&next, &tape.next, Synapse::None);
    graph.connect(&write, &tape.write, Synapse::None);
    graph.connect(&item, &tape.item, Synapse::None);

    let graph = std::sync::Arc::new(graph.build(Timebase::default(), populations, seed)?);
    let neurons = SolvedModel::of(&graph).neurons();
    let mut sim = Simulator::new(graph, crate::sim::RunConfig::seeded(seed))?;
    let steps = |count: usize| SimDuration::from_micros(STEP.as_micros() * count as u64);
    sim.run_for(steps(spec.depth))?;
    let held = sim.value(&tape.memory).to_vec();
    // The index passes the one position that is free.
    sim.run_for(steps(1))?;
    let mut right = 0;
    for action in &plan.chosen {
        let mut read = vec![0.0; spec.dimensions];
        sim.run_for(SimDuration::from_micros(STEP.as_micros() - READ.as_micros()))?;
        for _ in 0..READ.as_micros() / 1_000 {
            sim.run_for(SimDuration::from_millis(1))?;
            let output = sim.value(&tape.output);
            read.iter_mut().zip(output.iter()).for_each(|(sum, value)| *sum += value);
        }
        let similarity = dot(plan.action(*action), &read) / (READ.as_micros() / 1_000) as Real;
        let is_read = plan.nearest(&read) == *action && similarity >= CLEAR;
        right += usize::from(is_read);
    }
    let exact = plan.tape()?;
    let (length, cosine) = (f64::from(norm(&held)), f64::from(cosine_of_slices(&held, &exact)));
    Ok(TapeRead { right, neurons, length, cosine })
}

/// Time after the end of a step at which the next action is shown.
const LATE: SimDuration = SimDuration::from_millis(10);
/// Similarity of the output to an action that is read.
const CLEAR: Real = 0.5;
/// Time at the end of a step over which the output is averaged.
const READ: SimDuration = SimDuration::from_millis(40);
