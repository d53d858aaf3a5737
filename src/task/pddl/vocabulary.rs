//! The names of a learned domain in PDDL: types, predicates, and constants for places.

use std::collections::{BTreeMap, BTreeSet};

use crate::plan::strips::{
    Atom, Fact, Literal, Names, OBJECT, Predicate, Term, Typed, Types, variable,
};
use crate::task::domain::{self, RelationalDomain, Role, Subject};

/// The predicate of a state and the types of its arguments.
pub(super) struct Named {
    pub predicate: String,
    pub kind: String,
    /// Type of the reference; `None` in the world frame.
    pub frame: Option<String>,
    /// Type and constants of the places, if there are several.
    pub places: Option<(String, Vec<String>)>,
}

/// The names of a domain. They do not depend on a scene.
pub(super) struct Vocabulary {
    /// By number of the state.
    pub states: Vec<Named>,
    /// Type of each kind.
    pub kinds: BTreeMap<String, String>,
    /// Types with their supertypes, in the order in which they are written.
    types: Vec<Typed>,
    /// For each type whose first object in the scene an effect names, the predicate that holds for this object.
    pub firsts: BTreeMap<String, String>,
    pub names: Names,
    renamed: Vec<(String, String)>,
}

pub(super) fn typed(name: impl Into<String>, kind: &str) -> Typed {
    Typed { name: name.into(), types: vec![kind.to_owned()] }
}

impl Vocabulary {
    pub fn new(domain: &RelationalDomain) -> Self {
        let (mut names, mut types) = (Names::new(), Names::new());
        let of_states = domain.states.iter().flat_map(|s| [Some(&*s.kind), s.frame.kind()]);
        let of_states: BTreeSet<&str> = of_states.flatten().collect();
        // A kind that is divided is a type above its parts, unless the domain tells its objects from those of the parts.
        let divided = || domain.sub_kinds.iter().filter(|s| !of_states.contains(&*s.kind));
        let parts = divided().flat_map(|s| s.of.iter().map(|part| (&*part.name, &*s.kind)));
        let above: BTreeMap<&str, &str> = parts.collect();
        let all: BTreeSet<&str> =
            of_states.iter().copied().chain(above.iter().flat_map(|(a, b)| [*a, *b])).collect();
        let kinds: BTreeMap<String, String> =
            all.iter().map(|kind| ((*kind).to_owned(), types.of(kind))).collect();
        let renamed = types.renamed();
        let mut declared: Vec<Typed> = all
            .iter()
            .map(|kind| typed(&kinds[*kind], above.get(kind).map_or(OBJECT, |a| &kinds[*a])))
            .collect();
        let states: Vec<Named> = domain
            .states
            .iter()
            .map(|state| {
                let predicate = names.of(&state.name);
                let places = (state.places.len() > 1).then(|| {
                    let kind = types.fresh(&format!("{predicate}_place"));
                    let name = |place| names.fresh(&format!("{predicate}_place_{place}"));
                    let all = (1..=state.places.len()).map(name).collect();
                    (kind, all)
                });
                let frame = state.frame.kind().map(|kind| kinds[kind].clone());
                Named { predicate, kind: kinds[&state.kind].clone(), frame, places }
            })
            .collect();
        // An object that comes into a state with a reference, and no condition says which.
        let begun = domain.operators.iter().flat_map(|o| {
            let conditions = o.side_effects.iter().filter(|e| e.begins).map(|e| e.condition);
            conditions.filter(|c| match c.subject {
                Subject::At(_) | Subject::Is(Role::Object) => false,
                // It comes along to the target.
                Subject::Is(Role::Origin) => states[c.state].frame != states[o.to].frame,
                Subject::Is(_) | Subject::Any => true,
            })
        });
        let frames: BTreeSet<&str> =
            begun.filter_map(|c| states[c.state].frame.as_deref()).collect();
        let firsts = frames.into_iter().map(|f| (f.to_owned(), names.fresh(&format!("first_{f}"))));
        let firsts = firsts.collect();
        declared.extend(states.iter().filter_map(|s| Some(typed(&s.places.as_ref()?.0, OBJECT))));
        // Types of one supertype stand together, as a typed list is read.
        declared.sort_by_key(|t| t.types[0] == OBJECT);
        Self { states, kinds, types: declared, firsts, names, renamed }
    }

    pub fn types(&self) -> Types {
        let flat = || self.types.iter().map(|t| typed(&t.name, OBJECT)).collect();
        // Kinds that divide each other in a circle stand side by side.
        Types::new(self.types.clone()).or_else(|_| Types::new(flat())).unwrap_or_default()
    }

    pub fn constants(&self) -> Vec<Typed> {
        let places = self.states.iter().filter_map(|s| s.places.as_ref());
        places.flat_map(|(kind, all)| all.iter().map(move |name| typed(name, kind))).collect()
    }

    pub fn predicates(&self) -> Vec<Predicate> {
        let of = |state: &Named| {
            let place = state.places.as_ref().map(|(kind, _)| ("place", kind));
            let objects = [Some(&state.kind), state.frame.as_ref()].into_iter().flatten();
            let mut parameters = Vec::new();
            for (name, kind) in objects.map(|kind| (&**kind, kind)).chain(place) {
                parameters.push(typed(variable(name, &parameters), kind));
            }
            Predicate { name: state.predicate.clone(), parameters, of_type: false }
        };
        let first = self.firsts.iter().map(|(kind, name)| Predicate {
            name: name.clone(),
            parameters: vec![typed(variable(kind, &[]), kind)],
            of_type: false,
        });
        self.states.iter().map(of).chain(first).collect()
    }

    /// Returns the types of the arguments of a state that are open: its reference and its place if they are not given.
    pub fn open(&self, state: usize, given: [Option<&Term>; 2]) -> Vec<&str> {
        let named = &self.states[state];
        let place = named.places.as_ref().map(|(kind, _)| kind.as_str());
        let all = [named.frame.as_deref(), place].into_iter().zip(given);
        all.filter_map(|(kind, given)| kind.filter(|_| given.is_none())).collect()
    }

    /// Returns the atom that an object is in a state, with the terms of its open arguments. What is given and the state does
    /// not have is left out.
    pub fn atom(
        &self,
        state: usize,
        object: &Term,
        given: [Option<&Term>; 2],
        open: &[Term],
    ) -> Literal {
        let named = &self.states[state];
        let mut open = open.iter();
        let has = [named.frame.is_some(), named.places.is_some()];
        let rest = has.into_iter().zip(given);
        let rest =
            rest.filter_map(|(has, given)| if has { given.or_else(|| open.next()) } else { None });
        let arguments = [object].into_iter().chain(rest).cloned().collect();
        Literal { positive: true, atom: Atom { predicate: named.predicate.clone(), arguments } }
    }

    /// Returns the constant of a place of a state; `None` if it has one place.
    pub fn place(&self, state: usize, place: usize) -> Option<Term> {
        let (_, all) = self.states[state].places.as_ref()?;
        Some(Term::Constant(all[place].clone()))
    }

    /// Returns what is written for an object that is in a state. `objects` has the names of the objects.
    pub fn fact(&self, object: usize, fact: &domain::Fact, objects: &[String]) -> Fact {
        let state = &self.states[fact.state];
        let place = state.places.as_ref().map(|(_, all)| &all[fact.place]);
        let all = [Some(&objects[object]), fact.reference.map(|r| &objects[r]), place];
        let arguments = all.into_iter().flatten().cloned().collect();
        Fact { predicate: state.predicate.clone(), arguments }
    }

    /// Returns the originals whose names differ, with their names.
    pub fn renamed(&self) -> Vec<(String, String)> {
        [self.names.renamed(), self.renamed.clone()].concat()
    }
}
