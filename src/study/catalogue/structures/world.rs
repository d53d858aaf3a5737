//! The vocabulary of the assembly task, and its deep pointers in three structures.

use std::cell::RefCell;

use rand::Rng;

use crate::sim::Real;
use crate::spa::{Algebra, Hrr, Workspace, draw_pointer, normalize};

pub(super) const D: usize = 256;

// The vocabulary: two objects, two places, three states of assembly, roles, state and action names.
pub(super) const OBJECTS: [usize; 2] = [0, 1];
pub(super) const PLACES: [usize; 2] = [2, 3];
pub(super) const ASSEMBLY: [usize; 3] = [4, 5, 6];
pub(super) const ROLES: [usize; 3] = [7, 8, 9];
pub(super) const EFFECT_OF: usize = 10;
pub(super) const PRECONDITION: usize = 11;
pub(super) const STATES: usize = 12;
pub(super) const ACTIONS: usize = 17;
pub(super) const ATOMS: usize = 20;

/// A state of an object: indices of the object, its place, its state of assembly, and the action that causes the state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Fact {
    pub(super) object: usize,
    pub(super) place: usize,
    pub(super) assembly: usize,
    pub(super) cause: Option<usize>,
}

pub(super) const fn fact(
    object: usize,
    place: usize,
    assembly: usize,
    cause: Option<usize>,
) -> Fact {
    Fact { object, place, assembly, cause }
}

/// NUT_ON_TABLE, BOLT_ON_TABLE, NUT_IN_JIG, BOLT_IN_JIG, BOLT_ASSEMBLED.
pub(super) const FACTS: [Fact; 5] = [
    fact(0, 0, 0, None),
    fact(1, 0, 0, None),
    fact(0, 1, 1, Some(0)),
    fact(1, 1, 1, Some(1)),
    fact(1, 1, 2, Some(2)),
];
pub(super) const GOAL: usize = 4;
/// Preconditions of PUT_NUT_IN_JIG, PUT_BOLT_IN_JIG and ASSEMBLE, as indices into [`FACTS`].
pub(super) const NEEDS: [&[usize]; 3] = [&[0], &[1], &[2, 3]];
/// State that each action causes, as an index into [`FACTS`].
pub(super) const CAUSES: [usize; 3] = [2, 3, 4];

/// The composition of a state's deep pointer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Structure {
    /// `object * (location + assembly)`.
    Compact = 1,
    /// Sum of `role * value` over object, location and assembly.
    Roles = 2,
    /// As [`Compact`](Self::Compact), plus the action that causes the state.
    Effect = 3,
}

pub(super) const STRUCTURES: [Structure; 3] =
    [Structure::Compact, Structure::Roles, Structure::Effect];

/// Working memory for Fourier transforms, one for each thread.
pub(super) struct Tools {
    pub(super) work: Workspace,
    pub(super) inverse: Vec<Real>,
}

thread_local! {
    // Planning the transforms costs as much as a trial. The content left by a trial does not affect the next.
    static TOOLS: RefCell<Option<Tools>> = const { RefCell::new(None) };
}

pub(super) fn with_tools<T>(call: impl FnOnce(&mut Tools) -> T) -> T {
    TOOLS.with_borrow_mut(|tools| {
        let new = || Tools { work: Hrr.scratch(D), inverse: vec![0.0; D] };
        call(tools.get_or_insert_with(new))
    })
}

pub(super) type Vector = Vec<Real>;

pub(super) fn bind(tools: &mut Tools, a: &[Real], b: &[Real]) -> Vector {
    let mut out = vec![0.0; D];
    Hrr.bind_into(a, b, &mut out, &mut tools.work);
    out
}

pub(super) fn unbind(tools: &mut Tools, bound: &[Real], role: &[Real]) -> Vector {
    let mut inverse = std::mem::take(&mut tools.inverse);
    Hrr.inverse_into(role, &mut inverse);
    let out = bind(tools, bound, &inverse);
    tools.inverse = inverse;
    out
}

pub(super) fn add(a: &mut [Real], b: &[Real]) {
    a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
}

/// A vocabulary and the deep pointers that are composed from it.
pub(super) struct World {
    pub(super) structure: Structure,
    pub(super) atoms: Vec<Vector>,
    /// Atoms as rows of a matrix.
    pub(super) rows: Vec<Real>,
    pub(super) states: Vec<Vector>,
    pub(super) actions: Vec<Vector>,
}

impl World {
    pub(super) fn draw<R: Rng>(tools: &mut Tools, structure: Structure, rng: &mut R) -> Self {
        let atoms: Vec<Vector> = (0..ATOMS).map(|_| draw_pointer(D, rng)).collect();
        let rows = atoms.concat();
        let mut world = Self { structure, atoms, rows, states: Vec::new(), actions: Vec::new() };
        let deep = |fact| world.compose(tools, &world.pairs(fact));
        let states = FACTS.iter().map(deep).collect();
        let needs = |needs: &&[usize]| world.compose(tools, &World::bound_needs(needs));
        let actions = NEEDS.iter().map(needs).collect();
        (world.states, world.actions) = (states, actions);
        world
    }

    /// Returns the pairs of atoms that are bound and added up to a state's deep pointer.
    pub(super) fn pairs(&self, fact: &Fact) -> Vec<[usize; 2]> {
        let parts = [OBJECTS[fact.object], PLACES[fact.place], ASSEMBLY[fact.assembly]];
        let mut pairs: Vec<[usize; 2]> = match self.structure {
            Structure::Roles => ROLES.iter().zip(parts).map(|(role, part)| [*role, part]).collect(),
            _ => vec![[parts[0], parts[1]], [parts[0], parts[2]]],
        };
        if let (Structure::Effect, Some(cause)) = (self.structure, fact.cause) {
            pairs.push([EFFECT_OF, ACTIONS + cause]);
        }
        pairs
    }

    /// Returns the normalised sum of bound pairs.
    pub(super) fn compose(&self, tools: &mut Tools, pairs: &[[usize; 2]]) -> Vector {
        let mut deep = vec![0.0; D];
        for [a, b] in pairs {
            add(&mut deep, &bind(tools, &self.atoms[*a], &self.atoms[*b]));
        }
        normalize(&mut deep);
        deep
    }

    /// Returns the pairs of atoms that are bound and added up to an action's deep pointer.
    pub(super) fn bound_needs(states: &[usize]) -> Vec<[usize; 2]> {
        states.iter().map(|state| [PRECONDITION, STATES + state]).collect()
    }

    /// Returns the atoms that unbind the parts of a state's deep pointer.
    pub(super) fn probes(&self) -> &'static [usize] {
        match self.structure {
            Structure::Compact => &[0, 1],
            Structure::Roles => &[7, 8, 9],
            Structure::Effect => &[0, 1, EFFECT_OF],
        }
    }

    /// Returns every fact that this structure can store.
    pub(super) fn hypotheses(&self) -> Vec<Fact> {
        let causes: &[Option<usize>] = match self.structure {
            Structure::Effect => &[None, Some(0), Some(1), Some(2)],
            _ => &[None],
        };
        let mut all = Vec::new();
        for object in 0..OBJECTS.len() {
            for place in 0..PLACES.len() {
                for assembly in 0..ASSEMBLY.len() {
                    all.extend(causes.iter().map(|cause| fact(object, place, assembly, *cause)));
                }
            }
        }
        all
    }
}
