//! Retrieval as a network: conditions in populations, thresholds of few neurons per item, and a new query every 40 ms.

use std::sync::Arc;

use super::Score;
use super::symbols::{Actions, Retrieved, Roles, Symbols};
use super::world::{Query, World};
use crate::neurons::{LifSpec, PatternError, Population, PopulationPlan, SolvedModel};
use crate::sim::{
    Graph, GraphBuilder, In, Out, Pointer, PointerRef, Real, RunConfig, Seed, SimDuration,
    Simulator, Stimulus, Synapse, Timebase, Vector,
};
use crate::spa::{JointMemory, Linear, State, VocabError};
use crate::task::TaskError;

/// What a network retrieves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reach {
    /// Objects by place and goal.
    Objects,
    /// Objects, and actions by object and effect.
    Actions,
}

/// Settings of a retrieval network.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NetworkSpec {
    /// Number of dimensions.
    pub dimensions: usize,
    /// How roles and fillers are drawn.
    pub roles: Roles,
    /// What is retrieved.
    pub reach: Reach,
    /// Similarity at which an object meets a condition.
    pub level: Real,
    /// Whether objects are compared with cleaned conditions ([`JointMemory::cleaned`]).
    pub cleaned: bool,
    /// Neurons of the populations that represent the conditions; `None` for exact maths in the whole network.
    pub conditions: Option<LifSpec>,
}

impl Default for NetworkSpec {
    fn default() -> Self {
        Self {
            dimensions: 500,
            roles: Roles::Frame,
            reach: Reach::Objects,
            level: 0.65,
            cleaned: false,
            conditions: Some(LifSpec::default()),
        }
    }
}

impl NetworkSpec {
    fn plan(&self) -> Result<PopulationPlan, PatternError> {
        let Some(conditions) = self.conditions else { return Ok(PopulationPlan::direct()) };
        let few = Population::Lif(LifSpec::few_per_item(1));
        let plan = PopulationPlan::all(Population::Lif(conditions))
            .with("objects/**".parse()?, few.clone());
        match self.reach {
            Reach::Objects => Ok(plan),
            Reach::Actions => Ok(plan.with("actions/**".parse()?, few)),
        }
    }
}

/// A network that answers queries one after another.
pub struct Network {
    graph: Arc<Graph>,
    objects: Out<Vector>,
    actions: Option<Out<Vector>>,
    neurons: usize,
}

/// Simulated time of a query.
const SPAN: SimDuration = SimDuration::from_millis(40);
/// Activity above which an item counts as found.
const FOUND: Real = 0.5;
/// Level of the similarity of a condition to an atom, where conditions are cleaned.
const ATOM_LEVEL: Real = 0.5;
/// Level of the similarity of an action to the names of the found objects, and to the effect.
const ACTION_LEVEL: Real = 0.5;

impl Network {
    /// Builds a network that gets `queries` one after another. Solving takes some seconds.
    ///
    /// # Errors
    /// [`TaskError::Vocabulary`] or [`TaskError::Build`] if the number of dimensions or a population is invalid.
    pub fn build(
        world: &World,
        spec: &NetworkSpec,
        queries: &[Query],
        seed: Seed,
    ) -> Result<Self, TaskError> {
        let symbols = Symbols::draw(world, spec.dimensions, spec.roles, seed)?;
        let vocabulary = &symbols.vocabulary;
        let mut graph = GraphBuilder::new();
        let memory = JointMemory::new(vocabulary, Arc::new(symbols.objects(world)?), 2);
        let memory = memory.level(spec.level);
        let memory = if spec.cleaned { memory.cleaned(ATOM_LEVEL) } else { memory };
        let objects = graph.add("objects", memory);
        let mut shown = [Vec::new(), Vec::new()];
        for query in queries {
            let [place, goal] = symbols.conditions(query)?;
            shown.iter_mut().zip([place, goal]).for_each(|(all, one)| all.push(one));
        }
        let show = |graph: &mut GraphBuilder, name: &str, all: &[Vec<Real>], port: &In<_>| {
            let given = graph.add(&format!("{name}_given"), stimulus(&symbols, all));
            let state = graph.add(name, State::new(vocabulary));
            graph.connect(&given, &state.input, Synapse::None);
            graph.connect(&state.output, port, Synapse::None);
        };
        show(&mut graph, "place", &shown[0], &objects.conditions[0]);
        show(&mut graph, "goal", &shown[1], &objects.conditions[1]);
        let mut found_actions = None;
        if spec.reach == Reach::Actions {
            let Actions { items, objects: names, effects } = symbols.actions(world, seed)?;
            let memory = JointMemory::new(vocabulary, Arc::new(items), 2).level(ACTION_LEVEL);
            let actions = graph.add("actions", memory);
            // The objects that were found give the sum of their names.
            let named = Linear::factored_combination(vocabulary, Arc::new(names));
            let named = graph.add("named", named);
            graph.connect(&objects.items, &named.input, Synapse::None);
            graph.connect(&named.output, &actions.conditions[0], Synapse::None);
            let effects: Vec<_> = queries.iter().map(|query| effects.item(query.effect)).collect();
            show(&mut graph, "effect", &effects, &actions.conditions[1]);
            found_actions = Some(actions.items);
        }
        let plan = spec.plan().map_err(|error| VocabError::BadVector {
            name: "plan".into(),
            reason: error.to_string(),
        })?;
        let graph = Arc::new(graph.build(Timebase::default(), &plan, seed)?);
        let neurons = SolvedModel::of(&graph).neurons();
        Ok(Self { graph, objects: objects.items, actions: found_actions, neurons })
    }

    /// Returns the number of neurons.
    pub fn neurons(&self) -> usize {
        self.neurons
    }

    /// Answers all queries and reads the answers at each of the times `at` after the onset of a query, in rising order
    /// and at most the time of a query. Returns a score for each of the times.
    ///
    /// # Errors
    /// [`TaskError::Sim`] if a value becomes infinite or NaN.
    pub fn run(
        &self,
        world: &World,
        queries: &[Query],
        at: &[SimDuration],
        seed: Seed,
    ) -> Result<Vec<Score>, TaskError> {
        let mut sim = Simulator::new(self.graph.clone(), RunConfig::seeded(seed))?;
        let mut scores = vec![Score::default(); at.len()];
        let found = |values: &[Real]| -> Vec<usize> {
            (0..values.len()).filter(|index| values[*index] >= FOUND).collect()
        };
        for query in queries {
            let objects = world.objects_of(query);
            let actions = self.actions.as_ref().map(|_| world.actions_of(query));
            let mut now = 0;
            for (score, time) in scores.iter_mut().zip(at) {
                sim.run_for(SimDuration::from_micros(time.as_micros().saturating_sub(now)))?;
                now = now.max(time.as_micros());
                score.objects.add(&found(sim.value(&self.objects)), &objects);
                if let (Some(out), Some(actions)) = (&self.actions, &actions) {
                    score.actions.add(&found(sim.value(out)), actions);
                }
            }
            sim.run_for(SimDuration::from_micros(SPAN.as_micros().saturating_sub(now)))?;
        }
        Ok(scores)
    }
}

/// Shows vectors one after another, each for the time of a query.
fn stimulus(symbols: &Symbols, vectors: &[Vec<Real>]) -> Stimulus<Pointer<Retrieved>> {
    let space = symbols.vocabulary.space();
    let zero = vec![0.0; symbols.vocabulary.dim()];
    let first = vectors.first().unwrap_or(&zero);
    let mut shown = Stimulus::pointer(space, &PointerRef::from_raw(first));
    for (index, vector) in vectors.iter().enumerate().skip(1) {
        let from = SimDuration::from_micros(SPAN.as_micros() * index as u64);
        shown = shown.from(from, &PointerRef::<Retrieved>::from_raw(vector));
    }
    shown
}
