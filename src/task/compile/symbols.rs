//! Readable names of ground facts and actions, and the identities that their pointers are made of.

use std::collections::{BTreeMap, BTreeSet};

use super::facts::{GroundAction, Test};
use super::problem::Problem;
use crate::task::propositional::{Composition, Factor, Part, is_symbol};

/// Longest name before a number is added, in characters.
const LONGEST: usize = 120;

pub(super) struct Symbols<'p> {
    problem: &'p Problem<'p>,
    taken: BTreeSet<String>,
    factors: BTreeMap<String, Vec<Factor>>,
}

/// Returns `text` as part of a symbol.
fn symbol(text: &str) -> String {
    let part: String = text
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_uppercase() } else { '_' })
        .collect();
    if part.is_empty() { "X".into() } else { part }
}

/// Replaces the last word of `name` that is `word` by `by`; appends `_AT_by` if there is none.
fn with_last(name: &str, word: &str, by: &str) -> String {
    match name.strip_suffix(word) {
        Some(start) if start.is_empty() || start.ends_with('_') => format!("{start}{by}"),
        _ => format!("{name}_AT_{by}"),
    }
}

/// Replaces the first word of `name` that is `word` by `by`; appends `_BY_by` if there is none.
fn with_first(name: &str, word: &str, by: &str) -> String {
    let padded = format!("_{name}_");
    match padded.find(&format!("_{word}_")) {
        Some(at) => {
            let end = at + word.len();
            format!("{}{by}{}", &name[..at], &name[end.min(name.len())..])
        }
        None => format!("{name}_BY_{by}"),
    }
}

impl<'p> Symbols<'p> {
    pub fn new(problem: &'p Problem<'p>) -> Self {
        Self { problem, taken: BTreeSet::new(), factors: BTreeMap::new() }
    }

    fn id(&self, object: usize) -> String {
        symbol(&self.problem.objects[object].id)
    }

    fn kind(&self, object: usize) -> String {
        symbol(&self.problem.objects[object].kind)
    }

    /// Returns `wanted`, with a number if it is taken.
    fn take(&mut self, mut wanted: String) -> String {
        wanted.truncate(LONGEST);
        if !is_symbol(&wanted) {
            wanted.insert_str(0, "S_");
        }
        let mut name = wanted.clone();
        let mut number = 1;
        while !self.taken.insert(name.clone()) {
            number += 1;
            name = format!("{wanted}_N{number}");
        }
        name
    }

    /// Returns a name for a fact.
    pub fn fact(&mut self, test: &Test) -> String {
        let states = &self.problem.domain.states;
        let mut parts: Vec<Factor> = Vec::new();
        let names: BTreeSet<&str> = test.of.iter().map(|(s, _)| &*states[*s].name).collect();
        let places: BTreeSet<usize> = test.of.iter().filter_map(|(_, p)| *p).collect();
        let mut base = names.iter().copied().collect::<Vec<_>>().join("_OR_");
        for (s, place) in &test.of {
            let mut filler = states[*s].name.clone();
            if let Some(place) = place.filter(|_| places.len() > 1) {
                filler = format!("{filler}_P{}", place + 1);
            }
            parts.push(Factor { part: Part::Symbol, filler });
        }
        if base.len() > LONGEST / 2 {
            let kind = test.of.first().map_or("object", |(s, _)| &states[*s].kind);
            base = format!("{}_IN_{}_STATES", symbol(kind), names.len());
        }
        if let Some(Some(r)) = test.reference {
            base = with_last(&base, &self.kind(r), &self.id(r));
            parts.push(Factor { part: Part::Reference, filler: self.id(r) });
        }
        if let Some(object) = test.object {
            base = with_first(&base, &self.kind(object), &self.id(object));
            parts.push(Factor { part: Part::Object, filler: self.id(object) });
        }
        for place in &places {
            base = format!("{base}_P{}", place + 1);
            if places.len() == 1 {
                parts.push(Factor { part: Part::Place, filler: format!("P{}", place + 1) });
            }
        }
        if let Some(within) = test.within {
            let filler = format!("IN_{}", states[within].name);
            base = format!("{base}_{filler}");
            parts.push(Factor { part: Part::Symbol, filler });
        }
        for except in &test.except {
            parts.push(Factor { part: Part::Except, filler: self.id(*except) });
        }
        let mut name = match (test.most, test.least) {
            (Some(0), _) => format!("NO_{base}"),
            (Some(most), _) => format!("AT_MOST_{most}_{base}"),
            (None, 1) => base,
            (None, least) => format!("{base}_X{least}"),
        };
        let count = match (test.most, test.least) {
            (Some(most), _) => Some(format!("UP_TO_{most}")),
            (None, 1) => None,
            (None, least) => Some(format!("X{least}")),
        };
        if let Some(filler) = count {
            parts.push(Factor { part: Part::Count, filler });
        }
        if test.given {
            name.push_str("_IN_THE_WAY");
            parts.push(Factor { part: Part::Symbol, filler: "IN_THE_WAY".into() });
        }
        if !test.except.is_empty() && self.taken.contains(&name) {
            let but: Vec<String> = test.except.iter().map(|i| self.id(*i)).collect();
            name = format!("{name}_BUT_{}", but.join("_"));
        }
        let name = self.take(name);
        self.factors.insert(name.clone(), parts);
        name
    }

    /// Returns a name for an action.
    pub fn action(&mut self, action: &GroundAction) -> String {
        let operator = &self.problem.domain.operators[action.operator];
        let to = &self.problem.domain.states[operator.to];
        let mut name = operator.name.clone();
        let mut parts = vec![Factor { part: Part::Symbol, filler: operator.name.clone() }];
        if let Some(r) = action.reference {
            name = with_last(&name, &self.kind(r), &self.id(r));
            parts.push(Factor { part: Part::Reference, filler: self.id(r) });
        }
        if let Some(object) = action.object {
            name = with_first(&name, &self.kind(object), &self.id(object));
            parts.push(Factor { part: Part::Object, filler: self.id(object) });
        }
        if to.places.len() > 1 {
            name = format!("{name}_P{}", action.place + 1);
            parts.push(Factor { part: Part::Place, filler: format!("P{}", action.place + 1) });
        }
        let states = &self.problem.domain.states;
        let leaves: BTreeSet<&str> =
            action.source.of.iter().map(|(s, _)| &*states[*s].name).collect();
        for state in &leaves {
            parts.push(Factor { part: Part::From, filler: (*state).to_owned() });
        }
        for (_, place) in &action.source.of {
            if let Some(place) = place {
                parts.push(Factor { part: Part::From, filler: format!("P{}", place + 1) });
            }
        }
        if let Some(origin) = action.origin() {
            name = format!("{name}_FROM_{}", self.id(origin));
            parts.push(Factor { part: Part::Origin, filler: self.id(origin) });
        }
        if action.source.given {
            parts.push(Factor { part: Part::Symbol, filler: "IN_THE_WAY".into() });
        }
        // Actions that differ only in the objects that do not count, or in their number, need pointers of their own.
        if !action.source.except.is_empty() {
            let but: Vec<String> = action.source.except.iter().map(|i| self.id(*i)).collect();
            parts.push(Factor { part: Part::Count, filler: format!("BUT_{}", but.join("_")) });
        }
        if (action.source.least, action.source.most) != (1, None) {
            let (least, most) = (action.source.least, action.source.most);
            let most = most.map_or_else(String::new, |m| format!("_TO_{m}"));
            parts.push(Factor { part: Part::Count, filler: format!("FROM_{least}{most}") });
        }
        if self.taken.contains(&name) {
            name = format!("{name}_OUT_OF_{}", leaves.into_iter().collect::<Vec<_>>().join("_OR_"));
        }
        let name = self.take(name);
        self.factors.insert(name.clone(), parts);
        name
    }

    /// Returns what the names are made of.
    pub fn composition(self) -> Composition {
        Composition::new(self.factors)
    }
}
