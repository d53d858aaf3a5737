//! The pointers of a world: roles, places, goals, effects and the names of objects, and the memories made of them.

use std::ops::Range;

use rand::RngExt;

use super::world::{Query, World};
use crate::sim::{Real, Seed, VocabTag};
use crate::spa::{FactoredItems, VocabError, Vocabulary, VocabularyBuilder, norm};

/// How roles and fillers are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Roles {
    /// Random roles of norm 1, and random fillers.
    Gaussian,
    /// Unitary roles, and random fillers.
    Unitary,
    /// Unitary roles; places and goals are a tight frame once they are bound.
    Frame,
}

/// The tag of the pointers.
pub struct Retrieved;

impl VocabTag for Retrieved {
    const NAME: &'static str = "retrieved";
}

/// The pointers of a world.
pub struct Symbols {
    /// The roles LOCATION, GOAL, THING and EFFECT, and all fillers: places `P`, goals `G`, effects `E`, and atoms of
    /// names `X`.
    pub vocabulary: Vocabulary<Retrieved>,
    places: usize,
    goals: usize,
    effects: usize,
}

/// The memory of the actions by names.
pub struct Actions {
    /// Actions, `THING * name + EFFECT * effect`.
    pub items: FactoredItems,
    /// Bound names of the objects, `THING * name`.
    pub objects: FactoredItems,
    /// Bound effects, `EFFECT * effect`.
    pub effects: FactoredItems,
}

/// The roles, which come first in the vocabulary.
const ROLES: [&str; 4] = ["LOCATION", "GOAL", "THING", "EFFECT"];
/// Number of terms in the name of an object.
const NAME_TERMS: usize = 16;

impl Symbols {
    /// Draws the pointers.
    ///
    /// # Errors
    /// [`VocabError::Dimension`] if the number of dimensions cannot be used.
    pub fn draw(
        world: &World,
        dimensions: usize,
        roles: Roles,
        seed: Seed,
    ) -> Result<Self, VocabError> {
        let names = |kind: char, count: usize| (0..count).map(move |i| format!("{kind}{i}"));
        let (places, goals, effects) = (world.spec.places, world.spec.goals, world.spec.effects);
        let mut builder = VocabularyBuilder::new(dimensions, seed).any_similarity();
        for role in ROLES {
            builder = match roles {
                Roles::Gaussian => builder.pointer(role),
                Roles::Unitary | Roles::Frame => builder.unitary(role),
            };
        }
        let builder = match roles {
            Roles::Frame => {
                let bound = [("LOCATION", 'P', places), ("GOAL", 'G', goals)];
                builder.bound_frame(bound.map(|(role, kind, count)| (role, names(kind, count))))
            }
            Roles::Gaussian | Roles::Unitary => {
                builder.pointers(names('P', places).chain(names('G', goals)))
            }
        };
        let builder = builder.pointers(names('E', effects)).orthonormal(names('X', dimensions));
        Ok(Self { vocabulary: builder.build()?, places, goals, effects })
    }

    /// Binds vectors, row by row, to a role.
    pub(super) fn bound(&self, role: &str, rows: &[Real]) -> Result<Vec<Real>, VocabError> {
        let (dim, algebra) = (self.vocabulary.dim(), self.vocabulary.algebra());
        let (role, mut work) = (self.vocabulary.get(role)?, algebra.scratch(dim));
        let mut out = vec![0.0; rows.len()];
        for (row, out) in rows.chunks_exact(dim).zip(out.chunks_exact_mut(dim)) {
            algebra.bind_into(row, &role, out, &mut work);
        }
        Ok(out)
    }

    /// Returns consecutive fillers of a kind, row by row: places `P`, goals `G`, effects `E`, parts of names `X`.
    fn fillers(&self, kind: char, which: Range<usize>) -> &[Real] {
        let before = match kind {
            'P' => 0,
            'G' => self.places,
            'E' => self.places + self.goals,
            _ => self.places + self.goals + self.effects,
        };
        // The roles come first.
        let first = ROLES.len() + before;
        let dim = self.vocabulary.dim();
        &self.vocabulary.matrix()[(first + which.start) * dim..(first + which.end) * dim]
    }

    /// Returns the bound places and goals, the atoms of the objects.
    fn properties(&self) -> Result<Vec<Real>, VocabError> {
        let mut atoms = self.bound("LOCATION", self.fillers('P', 0..self.places))?;
        atoms.extend(self.bound("GOAL", self.fillers('G', 0..self.goals))?);
        Ok(atoms)
    }

    /// Returns the memory of the objects: for each the sum of `LOCATION * place` over its places and `GOAL * goal` over
    /// its goals.
    ///
    /// # Errors
    /// As for [`FactoredItems::new`]; a vocabulary causes none. The same holds for the other memories.
    pub fn objects(&self, world: &World) -> Result<FactoredItems, VocabError> {
        let items = world.objects.iter().map(|[places, goals]| {
            let goals = goals.iter().map(|goal| self.places + goal);
            places.iter().copied().chain(goals).map(|atom| (atom, 1.0)).collect()
        });
        FactoredItems::new(self.properties()?, self.vocabulary.dim(), items)
    }

    /// Returns the actions as the 2016 paper makes them: `THING * norm(object) + EFFECT * effect`.
    pub(super) fn actions_of_pointers(
        &self,
        world: &World,
        objects: &FactoredItems,
    ) -> Result<FactoredItems, VocabError> {
        let mut atoms = self.bound("THING", &self.properties()?)?;
        let first = objects.atoms();
        atoms.extend(self.bound("EFFECT", self.fillers('E', 0..self.effects))?);
        let items = world.actions.iter().map(|[object, effect]| {
            let length = norm(&objects.item(*object));
            let scale = if length > 0.0 { length.recip() } else { 0.0 };
            let terms = objects.terms(*object).iter();
            let terms = terms.map(|(atom, weight)| (*atom as usize, scale * weight));
            terms.chain([(first + effect, 1.0)]).collect()
        });
        FactoredItems::new(atoms, self.vocabulary.dim(), items)
    }

    /// Returns random names of norm 1, bound to a role. A name is a sum of 16 of D orthonormal atoms with random signs: two
    /// names are as dissimilar as dense random pointers, but their memory is factored.
    fn names(&self, role: &str, count: usize, seed: Seed) -> Result<FactoredItems, VocabError> {
        let dim = self.vocabulary.dim();
        let atoms = self.bound(role, self.fillers('X', 0..dim))?;
        let mut rng = seed.derive("retrieval names", role).rng();
        let terms = NAME_TERMS.min(dim);
        let weight = (terms as Real).sqrt().recip();
        let items = (0..count).map(|_| {
            let chosen = rand::seq::index::sample(&mut rng, dim, terms);
            let sign = |at| (at, if rng.random() { weight } else { -weight });
            chosen.iter().map(sign).collect()
        });
        FactoredItems::new(atoms, dim, items.collect::<Vec<_>>())
    }

    /// Returns the memory of the actions by the names of their objects, `THING * name + EFFECT * effect`, and what is
    /// needed to ask it. Effects are names, too.
    pub fn actions(&self, world: &World, seed: Seed) -> Result<Actions, VocabError> {
        let objects = self.names("THING", world.objects.len(), seed)?;
        let effects = self.names("EFFECT", world.spec.effects, seed)?;
        let first = objects.atoms();
        let atoms =
            |of: &FactoredItems| (0..first).filter_map(|i| of.atom(i)).flatten().copied().collect();
        let atoms: [Vec<Real>; 2] = [atoms(&objects), atoms(&effects)];
        let items = world.actions.iter().map(|[object, effect]| {
            let own = objects.terms(*object).iter().map(|(atom, weight)| (*atom as usize, *weight));
            let effect = effects.terms(*effect).iter();
            own.chain(effect.map(|(atom, weight)| (first + *atom as usize, *weight))).collect()
        });
        let items = FactoredItems::new(atoms.concat(), self.vocabulary.dim(), items)?;
        Ok(Actions { items, objects, effects })
    }

    /// Returns the two conditions of a query on objects: the bound place and the bound goal.
    pub(super) fn conditions(&self, query: &Query) -> Result<[Vec<Real>; 2], VocabError> {
        let one = |index: usize| index..index + 1;
        Ok([
            self.bound("LOCATION", self.fillers('P', one(query.place)))?,
            self.bound("GOAL", self.fillers('G', one(query.goal)))?,
        ])
    }

    /// Returns an effect as the actions of pointers have it, bound.
    pub(super) fn effect(&self, effect: usize) -> Result<Vec<Real>, VocabError> {
        self.bound("EFFECT", self.fillers('E', effect..effect + 1))
    }
}
