//! The paper's decoder and ours. Both decode unbound pointers.

use super::world::{
    ACTIONS, ASSEMBLY, ATOMS, FACTS, Fact, OBJECTS, PLACES, PRECONDITION, STATES, Structure, Tools,
    Vector, World, bind, fact, unbind,
};
use crate::sim::Real;
use crate::spa::{dot, dots, norm, normalize};

/// Least similarity at which the paper's decoder accepts an item.
pub(super) const THRESHOLD: Real = 0.3;

/// Draws the noise of a similarity. Its arguments are the part of the state and the length of the query.
pub(super) type Comparing<'n> = dyn FnMut(usize, Real) -> Real + 'n;

/// Decodes unbound pointers.
pub(super) trait Decoder {
    /// Decodes the fact in a state's deep pointer. `unbound` has the deep pointer unbound by each of the structure's
    /// probes.
    fn fact(&self, world: &World, unbound: &[Vector], noise: &mut Comparing<'_>) -> Option<Fact>;
    /// Decodes the preconditions of an action. `unbound` is the action's deep pointer, unbound by the role of
    /// preconditions.
    fn needs(&self, world: &World, unbound: &[Real], noise: &mut Comparing<'_>) -> Vec<usize>;
}

/// The paper's decoder: matching pursuit with a fixed threshold.
pub(super) struct Paper;

impl Paper {
    /// Returns the indices of the items in a query.
    pub(super) fn items(
        &self,
        world: &World,
        query: &[Real],
        noise: &mut Comparing<'_>,
        part: usize,
    ) -> Vec<usize> {
        let mut rest = query.to_vec();
        normalize(&mut rest);
        let (mut found, mut similarities) = (Vec::new(), [0.0; ATOMS]);
        let mut retrieved = vec![0.0; rest.len()];
        while found.len() < ATOMS {
            let length = norm(&rest);
            let (mut best, mut most, mut amiss) = (0, Real::NEG_INFINITY, 0.0);
            dots(&world.rows, &rest, &mut similarities);
            for (item, similarity) in similarities.iter().enumerate() {
                let added = noise(part, length);
                if similarity + added > most {
                    (best, most, amiss) = (item, similarity + added, added);
                }
            }
            if most < THRESHOLD || found.contains(&best) {
                break;
            }
            found.push(best);
            // The item is subtracted as retrieved, with its noise. The component of the noise along the query is the
            // noise of the comparison; the components across the query are drawn here.
            retrieved.iter_mut().for_each(|component| *component = noise(part, 1.0));
            let along =
                (amiss - dot(&retrieved, &rest)) / (length * length).max(Real::MIN_POSITIVE);
            for ((out, rest), atom) in retrieved.iter_mut().zip(&rest).zip(&world.atoms[best]) {
                *out += along * rest + atom;
            }
            rest.iter_mut().zip(&retrieved).for_each(|(r, item)| *r -= most * item);
        }
        found.sort_unstable();
        found
    }
}

/// Returns the index among `choices` of a list's only item; `None` if the list does not have exactly one item.
pub(super) fn only(items: &[usize], choices: &[usize]) -> Option<usize> {
    match items {
        [item] => choices.iter().position(|c| c == item),
        _ => None,
    }
}

impl Decoder for Paper {
    fn fact(&self, world: &World, unbound: &[Vector], noise: &mut Comparing<'_>) -> Option<Fact> {
        let parts: Vec<Vec<usize>> = unbound
            .iter()
            .enumerate()
            .map(|(part, query)| self.items(world, query, noise, part))
            .collect();
        if world.structure == Structure::Roles {
            return Some(fact(
                only(&parts[0], &OBJECTS)?,
                only(&parts[1], &PLACES)?,
                only(&parts[2], &ASSEMBLY)?,
                None,
            ));
        }
        let cause = match parts.get(2) {
            None => None,
            Some(items) if items.is_empty() => None,
            Some(items) => Some(only(items, &[ACTIONS, ACTIONS + 1, ACTIONS + 2])?),
        };
        // The right object is the object whose unbinding yields a place and a state of assembly.
        (0..OBJECTS.len()).find_map(|object| match parts[object].as_slice() {
            [place, assembly] => Some(fact(
                object,
                PLACES.iter().position(|p| p == place)?,
                ASSEMBLY.iter().position(|a| a == assembly)?,
                cause,
            )),
            _ => None,
        })
    }

    fn needs(&self, world: &World, unbound: &[Real], noise: &mut Comparing<'_>) -> Vec<usize> {
        let items = self.items(world, unbound, noise, 0);
        items.iter().filter_map(|i| (STATES..ACTIONS).position(|state| state == *i)).collect()
    }
}

/// Our decoder: maximum likelihood over everything that could have been stored.
pub(super) struct Nearest {
    pub(super) facts: Vec<Fact>,
    /// Templates of the facts, one for each probe.
    pub(super) fact_templates: Vec<Templates>,
    /// Templates of all sets of preconditions. The bits of a sum's index are the states of its set.
    pub(super) need_templates: Templates,
}

/// Normalised sums of bound pairs after unbinding by a role.
pub(super) struct Templates {
    /// Pairs of atoms, bound and then unbound by the role, one in each row.
    pub(super) rows: Vec<Real>,
    /// Number of rows.
    pub(super) pairs: usize,
    /// For each sum: its pairs, the reciprocal of its length before normalisation, and its squared length after
    /// unbinding.
    pub(super) sums: Vec<(Vec<usize>, Real, Real)>,
}

impl Templates {
    pub(super) fn new(
        tools: &mut Tools,
        world: &World,
        sums: &[Vec<[usize; 2]>],
        role: usize,
    ) -> Self {
        let role = &world.atoms[role];
        let mut known: Vec<[usize; 2]> = sums.concat();
        known.sort_unstable();
        known.dedup();
        let bound: Vec<Vector> =
            known.iter().map(|[a, b]| bind(tools, &world.atoms[*a], &world.atoms[*b])).collect();
        let unbound: Vec<Vector> = bound.iter().map(|pair| unbind(tools, pair, role)).collect();
        let products = |one: &[Vector], other: &[Vector]| -> Vec<Vec<Real>> {
            one.iter().map(|a| other.iter().map(|b| dot(a, b)).collect()).collect()
        };
        let (lengths, squares) = (products(&bound, &bound), products(&unbound, &unbound));
        let sums = sums
            .iter()
            .map(|sum| {
                let pairs: Vec<usize> =
                    sum.iter().filter_map(|pair| known.iter().position(|k| k == pair)).collect();
                let of = |matrix: &[Vec<Real>]| -> Real {
                    pairs.iter().flat_map(|i| pairs.iter().map(|j| matrix[*i][*j])).sum()
                };
                let length = of(&lengths).sqrt();
                let scale = if length > 0.0 { 1.0 / length } else { 0.0 };
                let square = scale * scale * of(&squares);
                (pairs, scale, square)
            })
            .collect();
        Self { rows: unbound.concat(), pairs: known.len(), sums }
    }

    /// Adds twice the log-likelihood of each sum to `out`, up to a scale and a common constant. Each pair is retrieved
    /// once, with the noise of an item.
    pub(super) fn add_likelihoods(
        &self,
        query: &[Real],
        mut noise: impl FnMut(Real) -> Real,
        out: &mut [Real],
    ) {
        let mut products = vec![0.0; self.pairs];
        dots(&self.rows, query, &mut products);
        let length = norm(query);
        products.iter_mut().for_each(|product| *product += noise(length));
        for (out, (pairs, scale, square)) in out.iter_mut().zip(&self.sums) {
            let product: Real = pairs.iter().map(|pair| products[*pair]).sum();
            *out += 2.0 * scale * product - square;
        }
    }
}

/// Returns the index of the greatest number.
pub(super) fn greatest(of: &[Real]) -> usize {
    (0..of.len()).reduce(|best, i| if of[i] > of[best] { i } else { best }).unwrap_or(0)
}

impl Nearest {
    pub(super) fn new(tools: &mut Tools, world: &World) -> Self {
        let facts = world.hypotheses();
        let of_facts: Vec<Vec<[usize; 2]>> = facts.iter().map(|fact| world.pairs(fact)).collect();
        let fact_templates = world
            .probes()
            .iter()
            .map(|probe| Templates::new(tools, world, &of_facts, *probe))
            .collect();
        let of_sets: Vec<Vec<[usize; 2]>> = (0..1usize << FACTS.len())
            .map(|set| {
                let states: Vec<usize> =
                    (0..FACTS.len()).filter(|state| set >> state & 1 == 1).collect();
                World::bound_needs(&states)
            })
            .collect();
        let need_templates = Templates::new(tools, world, &of_sets, PRECONDITION);
        Self { facts, fact_templates, need_templates }
    }
}

impl Decoder for Nearest {
    fn fact(&self, _world: &World, unbound: &[Vector], noise: &mut Comparing<'_>) -> Option<Fact> {
        let mut scores = vec![0.0; self.facts.len()];
        for (part, (templates, query)) in self.fact_templates.iter().zip(unbound).enumerate() {
            templates.add_likelihoods(query, |length| noise(part, length), &mut scores);
        }
        self.facts.get(greatest(&scores)).copied()
    }

    fn needs(&self, _world: &World, unbound: &[Real], noise: &mut Comparing<'_>) -> Vec<usize> {
        let mut scores = vec![0.0; 1 << FACTS.len()];
        self.need_templates.add_likelihoods(unbound, |length| noise(0, length), &mut scores);
        let best = greatest(&scores);
        (0..FACTS.len()).filter(|state| best >> state & 1 == 1).collect()
    }
}
