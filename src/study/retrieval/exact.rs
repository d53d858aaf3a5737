//! Retrieval in exact arithmetic: by the similarity to the sum of the conditions, or by each condition apart.

use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

use super::Score;
use super::symbols::{Roles, Symbols};
use super::world::{Query, World};
use crate::sim::{Real, Seed};
use crate::spa::{FactoredItems, VocabError, norm};

/// A method of retrieval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// One threshold on the similarity to the sum of the conditions, as in the 2016 paper. The threshold is the lowest
    /// tenth of the true matches, so it is known only afterwards. Actions hold the pointers of their objects.
    Sum(Roles),
    /// A threshold for each condition. Actions hold names of their objects.
    Joint {
        /// How roles and fillers are drawn.
        roles: Roles,
        /// Least similarity of an object.
        level: Real,
        /// Standard deviation of noise on each component of every condition.
        noise: Real,
    },
}

/// Share of the true matches below the threshold of [`Method::Sum`].
const BELOW: f64 = 0.1;
/// Least similarity of an action to the names of the found objects, and to the effect.
const ACTION_LEVEL: Real = 0.5;

/// Asks for the objects of each query of the first list, and for objects and actions of each of the second.
///
/// # Errors
/// [`VocabError::Dimension`] if the number of dimensions cannot be used.
pub fn exact(
    world: &World,
    dimensions: usize,
    method: Method,
    queries: [&[Query]; 2],
    seed: Seed,
) -> Result<Score, VocabError> {
    let (Method::Sum(roles) | Method::Joint { roles, .. }) = method;
    let symbols = Symbols::draw(world, dimensions, roles, seed)?;
    match method {
        Method::Sum(_) => by_sum(world, &symbols, queries),
        Method::Joint { level, noise, .. } => {
            by_each(world, &symbols, (level, noise), queries, seed)
        }
    }
}

fn add(to: &mut [Real], from: &[Real]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to += from);
}

fn similarities(items: &FactoredItems, query: &[Real]) -> Vec<Real> {
    let mut out = vec![0.0; items.len()];
    items.similarities_into(query, &mut out);
    out
}

/// Returns the positions of all values of at least `level`.
fn above(values: &[Real], level: Real) -> Vec<usize> {
    (0..values.len()).filter(|index| values[*index] >= level).collect()
}

/// Returns the positions at which both values are at least `level`.
fn both_above(a: &[Real], b: &[Real], level: Real) -> Vec<usize> {
    (0..a.len()).filter(|index| a[*index].min(b[*index]) >= level).collect()
}

/// Returns the value below which a tenth of `scores` lies.
fn lowest_tenth(mut scores: Vec<Real>) -> Real {
    scores.sort_by(Real::total_cmp);
    let at = (BELOW * scores.len() as f64) as usize;
    scores.get(at).copied().unwrap_or(Real::INFINITY)
}

/// Retrieves by one threshold, which all queries share.
fn by_sum(
    world: &World,
    symbols: &Symbols,
    [on_objects, on_actions]: [&[Query]; 2],
) -> Result<Score, VocabError> {
    let objects = symbols.objects(world)?;
    let actions = symbols.actions_of_pointers(world, &objects)?;
    let mut score = Score::default();
    let ask = |query: &Query| {
        let [mut sum, goal] = symbols.conditions(query)?;
        add(&mut sum, &goal);
        Ok::<_, VocabError>(similarities(&objects, &sum))
    };
    let mut of_matches = Vec::new();
    for query in on_objects {
        let values = ask(query)?;
        of_matches.extend(world.objects_of(query).into_iter().map(|index| values[index]));
    }
    let level = lowest_tenth(of_matches);
    for query in on_objects {
        score.objects.add(&above(&ask(query)?, level), &world.objects_of(query));
    }
    // The actions are asked with all objects above the threshold.
    let mut of_matches = Vec::new();
    let mut asked = Vec::with_capacity(on_actions.len());
    for query in on_actions {
        let mut found = vec![0.0; symbols.vocabulary.dim()];
        for index in above(&ask(query)?, level) {
            let object = objects.item(index);
            let length = norm(&object);
            found.iter_mut().zip(object).for_each(|(sum, value)| *sum += value / length);
        }
        let mut sum = symbols.bound("THING", &found)?;
        add(&mut sum, &symbols.effect(query.effect)?);
        let values = similarities(&actions, &sum);
        of_matches.extend(world.actions_of(query).into_iter().map(|index| values[index]));
        asked.push(sum);
    }
    let level = lowest_tenth(of_matches);
    for (query, sum) in on_actions.iter().zip(asked) {
        let found = above(&similarities(&actions, &sum), level);
        score.actions.add(&found, &world.actions_of(query));
    }
    Ok(score)
}

/// Noise on the components of conditions.
struct Noise<R> {
    sd: Real,
    rng: R,
}

impl<R: Rng> Noise<R> {
    /// Returns the similarities of items to a condition with noise.
    fn similarities(&mut self, items: &FactoredItems, condition: &[Real]) -> Vec<Real> {
        let mut disturbed = condition.to_vec();
        for value in &mut disturbed {
            let z: Real = StandardNormal.sample(&mut self.rng);
            *value += self.sd * z;
        }
        similarities(items, &disturbed)
    }
}

/// Retrieves by a threshold for each condition.
fn by_each(
    world: &World,
    symbols: &Symbols,
    (level, noise): (Real, Real),
    [on_objects, on_actions]: [&[Query]; 2],
    seed: Seed,
) -> Result<Score, VocabError> {
    let objects = symbols.objects(world)?;
    let actions = symbols.actions(world, seed)?;
    let mut noise = Noise { sd: noise, rng: seed.derive("retrieval", "noise").rng() };
    let mut score = Score::default();
    let ask = |noise: &mut Noise<_>, query: &Query| {
        let conditions = symbols.conditions(query)?;
        let [place, goal] = conditions.map(|condition| noise.similarities(&objects, &condition));
        Ok::<_, VocabError>(both_above(&place, &goal, level))
    };
    for query in on_objects {
        score.objects.add(&ask(&mut noise, query)?, &world.objects_of(query));
    }
    for query in on_actions {
        let mut named = vec![0.0; symbols.vocabulary.dim()];
        for index in ask(&mut noise, query)? {
            add(&mut named, &actions.objects.item(index));
        }
        let by_name = noise.similarities(&actions.items, &named);
        let effect = actions.effects.item(query.effect);
        let by_effect = noise.similarities(&actions.items, &effect);
        let found = both_above(&by_name, &by_effect, ACTION_LEVEL);
        score.actions.add(&found, &world.actions_of(query));
    }
    Ok(score)
}
