//! The literals that an action may have: atoms over its parameters and the constants of the domain.

use super::LearnError;
use crate::plan::strips::GroundAtom;
use crate::plan::strips::{Action, Atom, Domain, Term};

/// Greatest number of atoms over the parameters of one action.
pub(super) const MAX_ATOMS: usize = 100_000;

/// An argument of a bound atom.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Slot {
    /// Parameter of the action.
    Parameter(usize),
    /// Constant of the domain. It has the same position in every trajectory.
    Constant(usize),
}

/// A predicate over parameters and constants, no two of them the same.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Bound {
    pub predicate: usize,
    pub slots: Vec<Slot>,
}

impl Bound {
    /// Returns the atom over the objects that the action was called with.
    pub fn ground(&self, arguments: &[usize]) -> GroundAtom {
        let object = |slot: &Slot| match slot {
            Slot::Parameter(position) => arguments[*position],
            Slot::Constant(object) => *object,
        };
        GroundAtom { predicate: self.predicate, arguments: self.slots.iter().map(object).collect() }
    }

    /// Returns the positions of the parameters in the atom.
    pub fn parameters(&self) -> impl Iterator<Item = usize> + '_ {
        self.slots.iter().filter_map(|slot| match slot {
            Slot::Parameter(position) => Some(*position),
            Slot::Constant(_) => None,
        })
    }

    /// Returns the atom with names.
    pub fn atom(&self, domain: &Domain) -> Atom {
        let term = |slot: &Slot| match slot {
            Slot::Parameter(position) => Term::Parameter(*position),
            Slot::Constant(object) => Term::Constant(domain.constants[*object].name.clone()),
        };
        Atom {
            predicate: domain.predicates[self.predicate].name.clone(),
            arguments: self.slots.iter().map(term).collect(),
        }
    }
}

/// Returns all bound atoms of an action whose types fit, in the order of the predicates.
pub(super) fn vocabulary(domain: &Domain, action: &Action) -> Result<Vec<Bound>, LearnError> {
    let parameters = action.parameters.iter().map(|p| &p.types).enumerate();
    let constants = domain.constants.iter().map(|c| &c.types).enumerate();
    let slots: Vec<(Slot, &Vec<String>)> = parameters
        .map(|(i, types)| (Slot::Parameter(i), types))
        .chain(constants.map(|(i, types)| (Slot::Constant(i), types)))
        .collect();
    let mut all = Vec::new();
    for (predicate, declared) in domain.predicates.iter().enumerate() {
        let mut found: Vec<Vec<Slot>> = vec![Vec::new()];
        for wanted in &declared.parameters {
            let fitting: Vec<Slot> = slots
                .iter()
                .filter(|(_, types)| domain.types.fits(types, &wanted.types))
                .map(|(slot, _)| *slot)
                .collect();
            let mut longer = Vec::new();
            for begun in &found {
                let fresh = fitting.iter().filter(|slot| !begun.contains(slot));
                longer.extend(fresh.map(|slot| [begun.as_slice(), &[*slot]].concat()));
                if all.len() + longer.len() > MAX_ATOMS {
                    return Err(LearnError::TooManyAtoms { action: action.name.clone() });
                }
            }
            found = longer;
        }
        all.extend(found.into_iter().map(|slots| Bound { predicate, slots }));
    }
    Ok(all)
}
