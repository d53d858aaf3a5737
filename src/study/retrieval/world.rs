//! A world of objects with places and goals, and of actions with objects and effects.

use rand::{Rng, RngExt};
use rand_distr::{Distribution, Poisson};

use crate::sim::Seed;

/// Sizes of a world. The defaults are those of the 2016 paper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorldSpec {
    /// Number of places.
    pub places: usize,
    /// Number of goals.
    pub goals: usize,
    /// Number of objects.
    pub objects: usize,
    /// Mean number of places of an object, and of goals, above 0. Each object draws both from a Poisson distribution. A
    /// number that is not positive and finite gives objects without places and goals.
    pub each: f64,
    /// Number of actions. Each has one object and one effect.
    pub actions: usize,
    /// Number of effects.
    pub effects: usize,
}

impl Default for WorldSpec {
    fn default() -> Self {
        Self {
            places: 250,
            goals: 1_000,
            objects: 25_000,
            each: 5.0,
            actions: 10_000,
            effects: 2_500,
        }
    }
}

/// What is asked: the objects at a place that serve a goal, and the actions with such an object that have an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Query {
    /// Number of the place.
    pub place: usize,
    /// Number of the goal.
    pub goal: usize,
    /// Number of the effect.
    pub effect: usize,
}

/// Objects with their places and goals, and actions with their objects and effects.
#[derive(Debug, Clone, PartialEq)]
pub struct World {
    /// Sizes.
    pub spec: WorldSpec,
    /// For each object, its places and goals, sorted.
    pub objects: Vec<[Vec<usize>; 2]>,
    /// For each action, its object and its effect.
    pub actions: Vec<[usize; 2]>,
}

/// Draws a number of different choices, sorted.
fn some<R: Rng>(rng: &mut R, mean: f64, choices: usize) -> Vec<usize> {
    let count = Poisson::new(mean).map_or(0.0, |poisson| poisson.sample(rng)) as usize;
    let mut chosen = Vec::new();
    while chosen.len() < count.min(choices) {
        let choice = rng.random_range(0..choices);
        if !chosen.contains(&choice) {
            chosen.push(choice);
        }
    }
    chosen.sort_unstable();
    chosen
}

impl World {
    /// Draws a world.
    ///
    /// # Panics
    /// If a number of the sizes is 0.
    pub fn draw(spec: &WorldSpec, seed: Seed) -> Self {
        let mut rng = seed.derive("retrieval", "world").rng();
        let WorldSpec { places, goals, objects, each, actions, effects } = *spec;
        let objects =
            (0..objects).map(|_| [some(&mut rng, each, places), some(&mut rng, each, goals)]);
        let objects: Vec<_> = objects.collect();
        let actions = (0..actions)
            .map(|_| [rng.random_range(0..objects.len()), rng.random_range(0..effects)])
            .collect();
        Self { spec: *spec, objects, actions }
    }

    /// Draws queries of any place, goal and effect. Few of them have an action.
    pub fn queries(&self, count: usize, seed: Seed) -> Vec<Query> {
        let mut rng = seed.derive("retrieval", "queries").rng();
        let WorldSpec { places, goals, effects, .. } = self.spec;
        let query = |_| Query {
            place: rng.random_range(0..places),
            goal: rng.random_range(0..goals),
            effect: rng.random_range(0..effects),
        };
        (0..count).map(query).collect()
    }

    /// Draws queries that each have an action: an action is drawn, its effect, and a place and goal of its object.
    /// Objects without a place or goal are passed over; a world of such objects gives no queries.
    pub fn queries_of_actions(&self, count: usize, seed: Seed) -> Vec<Query> {
        let mut rng = seed.derive("retrieval", "queries of actions").rng();
        let usable =
            |[object, _]: &&[usize; 2]| self.objects[*object].iter().all(|own| !own.is_empty());
        let usable: Vec<&[usize; 2]> = self.actions.iter().filter(usable).collect();
        if usable.is_empty() {
            return Vec::new();
        }
        let query = |_| {
            let [object, effect] = *usable[rng.random_range(0..usable.len())];
            let [places, goals] = &self.objects[object];
            let place = places[rng.random_range(0..places.len())];
            Query { place, goal: goals[rng.random_range(0..goals.len())], effect }
        };
        (0..count).map(query).collect()
    }

    /// Returns the objects that a query asks for, in order.
    pub(super) fn objects_of(&self, query: &Query) -> Vec<usize> {
        let fits = |[places, goals]: &[Vec<usize>; 2]| {
            places.binary_search(&query.place).is_ok() && goals.binary_search(&query.goal).is_ok()
        };
        (0..self.objects.len()).filter(|index| fits(&self.objects[*index])).collect()
    }

    /// Returns the actions that a query asks for, in order: those with the effect and one of the objects.
    pub(super) fn actions_of(&self, query: &Query) -> Vec<usize> {
        let objects = self.objects_of(query);
        let fits = |[object, effect]: [usize; 2]| {
            effect == query.effect && objects.binary_search(&object).is_ok()
        };
        (0..self.actions.len()).filter(|index| fits(self.actions[*index])).collect()
    }
}
