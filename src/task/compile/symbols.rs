//! Names of ground facts and actions: symbols, sentences, and the identities that their pointers are made of.
//!
//! A name says all that tells a fact or an action from others, so that it does not depend on which others there are.

use std::collections::{BTreeMap, BTreeSet};

use super::facts::{GroundAction, Test};
use super::problem::Problem;
use crate::task::domain::naming::{Statement, a, noun, object_names, upper, with_object};
use crate::task::propositional::{Composition, Factor, Part, is_symbol};

/// Longest symbol before a number is added, in characters.
const LONGEST: usize = 120;
/// Greatest number of states that a name lists.
const LISTED: usize = 4;

pub(super) struct Symbols<'p> {
    problem: &'p Problem<'p>,
    /// The names of the problem's objects, for people.
    objects: Vec<String>,
    symbols: BTreeSet<String>,
    sentences: BTreeSet<String>,
    factors: BTreeMap<String, Vec<Factor>>,
}

/// A symbol and a sentence.
pub(super) struct Name {
    pub symbol: String,
    pub words: String,
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
        let objects = object_names(problem.objects.iter().map(|o| (&*o.id, &*o.kind)));
        let (symbols, sentences) = (BTreeSet::new(), BTreeSet::new());
        Self { problem, objects, symbols, sentences, factors: BTreeMap::new() }
    }

    fn id(&self, object: usize) -> String {
        let id = upper(&self.problem.objects[object].id);
        if id.is_empty() { "X".into() } else { id }
    }

    fn kind(&self, object: usize) -> String {
        upper(&self.problem.objects[object].kind)
    }

    fn state_symbol(&self, state: usize) -> &'p str {
        &self.problem.domain.states[state].name
    }

    /// Returns the statement of a state, with a known reference in it.
    fn statement(&self, state: usize, reference: Option<Option<usize>>) -> Statement {
        let domain = self.problem.domain;
        let kind = &domain.states[state].kind;
        let statement = Statement::new(&domain.state_in_words(state), kind);
        match reference.flatten() {
            Some(reference) => {
                let frame = domain.states[state].frame.kind();
                statement.at(frame, &self.objects[reference])
            }
            None => statement,
        }
    }

    /// Returns these names, with numbers if they are taken: they were cut, or ids differ in small letters alone.
    fn take(&mut self, mut wanted: String, words: String) -> Name {
        wanted.truncate(LONGEST);
        if !is_symbol(&wanted) {
            wanted.insert_str(0, "S_");
        }
        let mut own = Name { symbol: wanted.clone(), words: words.clone() };
        let mut number = 1;
        while !self.symbols.insert(own.symbol.clone()) {
            number += 1;
            own.symbol = format!("{wanted}_{number}");
        }
        let mut number = 1;
        while !self.sentences.insert(own.words.clone()) {
            number += 1;
            own.words = format!("{words} ({number})");
        }
        own
    }

    /// Joins the symbols of states.
    fn joined(&self, states: &BTreeSet<usize>) -> String {
        let names: BTreeSet<&str> = states.iter().map(|s| self.state_symbol(*s)).collect();
        let base = names.iter().copied().collect::<Vec<_>>().join("_OR_");
        match names.len() > 1 && base.len() > LONGEST / 2 {
            false => base,
            true => {
                let state = states.first().map(|s| &self.problem.domain.states[*s]);
                let kind = state.map_or("object", |state| &state.kind);
                format!("{}_IN_{}_STATES", upper(kind), names.len())
            }
        }
    }

    /// Returns a name for a fact, in the words `told` if there are some.
    pub fn fact(&mut self, test: &Test, told: Option<&String>) -> Name {
        let states = &self.problem.domain.states;
        let mut parts: Vec<Factor> = Vec::new();
        let places: BTreeSet<usize> = test.of.iter().filter_map(|(_, p)| *p).collect();
        for (s, place) in &test.of {
            let mut filler = states[*s].name.clone();
            if let Some(place) = place.filter(|_| places.len() > 1) {
                filler = format!("{filler}_P{}", place + 1);
            }
            parts.push(Factor { part: Part::Symbol, filler });
        }
        if let Some(Some(r)) = test.reference {
            parts.push(Factor { part: Part::Reference, filler: self.id(r) });
        }
        if let Some(object) = test.object {
            parts.push(Factor { part: Part::Object, filler: self.id(object) });
        }
        if let (1, Some(place)) = (places.len(), places.first()) {
            parts.push(Factor { part: Part::Place, filler: format!("P{}", place + 1) });
        }
        if let Some(within) = test.within {
            let filler = format!("IN_{}", states[within].name);
            parts.push(Factor { part: Part::Symbol, filler });
        }
        for except in &test.except {
            parts.push(Factor { part: Part::Except, filler: self.id(*except) });
        }
        let count = match (test.most, test.least) {
            (Some(most), _) => Some(format!("UP_TO_{most}")),
            (None, 1) => None,
            (None, least) => Some(format!("X{least}")),
        };
        if let Some(filler) = count {
            parts.push(Factor { part: Part::Count, filler });
        }
        if test.given {
            parts.push(Factor { part: Part::Symbol, filler: "IN_THE_WAY".into() });
        }
        let words = told.cloned().unwrap_or_else(|| self.fact_words(test));
        let own = self.take(self.fact_symbol(test, &places), words);
        self.factors.insert(own.symbol.clone(), parts);
        own
    }

    fn fact_symbol(&self, test: &Test, places: &BTreeSet<usize>) -> String {
        let mut base = self.joined(&test.of.iter().map(|(s, _)| *s).collect());
        if let Some(Some(r)) = test.reference {
            base = with_last(&base, &self.kind(r), &self.id(r));
        }
        if let Some(object) = test.object {
            base = with_first(&base, &self.kind(object), &self.id(object));
        }
        if !places.is_empty() {
            let numbered = places.len() > 1 || test.of.iter().any(|(s, _)| self.is_several(*s));
            let numbers: Vec<String> = places.iter().map(|p| (p + 1).to_string()).collect();
            let number =
                if numbered { format!("_{}", numbers.join("_OR_")) } else { String::new() };
            base = format!("{base}_PLACE{number}");
        }
        if let Some(within) = test.within {
            base = format!("{base}_IN_{}", self.state_symbol(within));
        }
        let free = test.most == Some(0) && !places.is_empty();
        if !free {
            base += &self.except_symbol(test, "_OTHER_THAN_");
        }
        let mut symbol = match (test.most, test.least) {
            _ if free => format!("{base}_FREE{}", self.except_symbol(test, "_BUT_FOR_")),
            (Some(0), _) => format!("NO_{base}"),
            (Some(most), _) => format!("AT_MOST_{most}_{base}"),
            (None, 1) => base,
            (None, least) => format!("AT_LEAST_{least}_{base}"),
        };
        if test.given {
            symbol.push_str("_IN_THE_WAY");
        }
        symbol
    }

    /// Returns the objects that do not count although they are of the kind of one of these states.
    fn excepted(&self, test: &Test, states: &[(usize, Option<usize>)]) -> Vec<usize> {
        let kinds: Vec<&str> =
            states.iter().map(|(s, _)| &*self.problem.domain.states[*s].kind).collect();
        let own = |i: &&usize| kinds.contains(&&*self.problem.objects[**i].kind);
        test.except.iter().filter(own).copied().collect()
    }

    fn except_symbol(&self, test: &Test, but_for: &str) -> String {
        let but = self.excepted(test, &test.of).into_iter().map(|i| self.id(i));
        let but: Vec<String> = but.collect();
        if but.is_empty() { String::new() } else { but_for.to_owned() + &but.join("_OR_") }
    }

    fn except_words(
        &self,
        test: &Test,
        states: &[(usize, Option<usize>)],
        but_for: &str,
    ) -> String {
        let but: Vec<&str> =
            self.excepted(test, states).into_iter().map(|i| &*self.objects[i]).collect();
        if but.is_empty() { String::new() } else { but_for.to_owned() + &but.join(" or ") }
    }

    fn is_several(&self, state: usize) -> bool {
        self.problem.domain.states[state].places.len() > 1
    }

    fn fact_words(&self, test: &Test) -> String {
        let within = test.within.map(|within| {
            let kind = &self.problem.domain.states[within].kind;
            let of = Statement::new(&self.problem.domain.state_in_words(within), kind);
            (kind.as_str(), of.as_description())
        });
        let one = |of: &(usize, Option<usize>)| {
            let (state, place) = of;
            let except = self.except_words(test, std::slice::from_ref(of), " other than ");
            let mut statement = self.statement(*state, test.reference);
            if let (Some((kind, description)), None) = (&within, test.reference.flatten()) {
                statement = statement.at(Some(kind), description);
            }
            let number = place.filter(|_| self.is_several(*state)).map(|place| place + 1);
            let free = test.most == Some(0);
            if free && place.is_some() {
                let which = number.map_or("the place".into(), |number| format!("place {number}"));
                let but = self.except_words(test, std::slice::from_ref(of), " but for ");
                return format!("{which} {} is free{but}", statement.purpose());
            }
            let words = match (test.object, test.most, test.least) {
                (Some(object), _, _) if free => statement.not_about(&self.objects[object]),
                (Some(object), ..) => statement.about(&self.objects[object]),
                (_, Some(0), _) => statement.about_none(&except),
                (_, Some(most), _) => statement.about_some(&format!("at most {most}"), &except),
                (_, None, 1) => statement.about_any(&except),
                (_, None, least) => statement.about_some(&format!("at least {least}"), &except),
            };
            match (number, place) {
                (Some(number), _) => format!("{words}, at place {number}"),
                (None, Some(_)) if !test.given => format!("{words}, at its very place"),
                _ => words,
            }
        };
        let mut all: Vec<String> = test.of.iter().take(LISTED).map(one).collect();
        let more = test.of.len() - all.len();
        if more > 0 {
            all.push(format!("so for {more} more"));
        }
        let mut words = all.join(if test.most == Some(0) { " and " } else { " or " });
        if let (Some(within), Some(reference)) = (test.within, test.reference.flatten()) {
            let statement = self.statement(within, None);
            words = format!("{words}, and {}", statement.about(&self.objects[reference]));
        }
        let exact = test.of.iter().any(|(_, place)| place.is_some());
        match (test.given, exact) {
            (true, true) => format!("{words}, where something is to be put"),
            (true, false) => format!("{words}, in the way"),
            _ => words,
        }
    }

    /// Returns a name for an action.
    pub fn action(&mut self, action: &GroundAction) -> Name {
        let operator = &self.problem.domain.operators[action.operator];
        let to = &self.problem.domain.states[operator.to];
        let mut parts = vec![Factor { part: Part::Symbol, filler: operator.name.clone() }];
        if let Some(r) = action.reference {
            parts.push(Factor { part: Part::Reference, filler: self.id(r) });
        }
        if let Some(object) = action.object {
            parts.push(Factor { part: Part::Object, filler: self.id(object) });
        }
        if to.places.len() > 1 {
            parts.push(Factor { part: Part::Place, filler: format!("P{}", action.place + 1) });
        }
        let leaves: BTreeSet<&str> =
            action.source.of.iter().map(|(s, _)| self.state_symbol(*s)).collect();
        for state in &leaves {
            parts.push(Factor { part: Part::From, filler: (*state).to_owned() });
        }
        for (_, place) in &action.source.of {
            if let Some(place) = place {
                parts.push(Factor { part: Part::From, filler: format!("P{}", place + 1) });
            }
        }
        if let Some(origin) = action.origin() {
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
        let source_least = action.source.least;
        if (action.source.least, action.source.most) != (1, None) {
            let (least, most) = (action.source.least, action.source.most);
            let most = most.map_or_else(String::new, |m| format!("_TO_{m}"));
            parts.push(Factor { part: Part::Count, filler: format!("FROM_{least}{most}") });
        }
        if let Some(among) = action.among.filter(|n| *n > source_least) {
            parts.push(Factor { part: Part::Count, filler: format!("AMONG_{among}") });
        }
        let own = self.take(self.action_symbol(action), self.action_words(action));
        self.factors.insert(own.symbol.clone(), parts);
        own
    }

    /// Returns the states that an action leaves, if they are not all that its operator may leave, and if the object that it
    /// is taken from does not tell which.
    fn told_source(&self, action: &GroundAction) -> Option<BTreeSet<usize>> {
        let domain = self.problem.domain;
        let all: BTreeSet<usize> = domain.operators[action.operator].from.iter().copied().collect();
        let own: BTreeSet<usize> = action.source.of.iter().map(|(s, _)| *s).collect();
        let kind = action.origin().map(|origin| &*self.problem.objects[origin].kind);
        let there: BTreeSet<usize> = match kind {
            Some(kind) => all
                .iter()
                .copied()
                .filter(|s| domain.states[*s].frame.kind() == Some(kind))
                .collect(),
            None => all,
        };
        (own != there).then_some(own)
    }

    fn action_symbol(&self, action: &GroundAction) -> String {
        let domain = self.problem.domain;
        let operator = &domain.operators[action.operator];
        let mut symbol = operator.name.clone();
        if let Some(r) = action.reference {
            symbol = with_last(&symbol, &self.kind(r), &self.id(r));
        }
        if let Some(object) = action.object {
            symbol = with_first(&symbol, &self.kind(object), &self.id(object));
        }
        if self.is_several(operator.to) {
            symbol = format!("{symbol}_PLACE_{}", action.place + 1);
        }
        if let Some(origin) = action.origin() {
            symbol = format!("{symbol}_FROM_{}", self.id(origin));
        }
        if let Some(source) = self.told_source(action) {
            symbol = format!("{symbol}_OUT_OF_{}", self.joined(&source));
        }
        let source = &action.source;
        symbol += &self.except_symbol(source, "_OTHER_THAN_");
        let least = action.among.unwrap_or(source.least);
        if least != 1 {
            symbol = format!("{symbol}_LEAVING_{}", least.saturating_sub(1));
        }
        if let Some(most) = source.most {
            symbol = format!("{symbol}_OF_AT_MOST_{most}");
        }
        symbol + &self.clearing(source, ["_TO_FREE_PLACE", "_TO_CLEAR"], "_")
    }

    fn action_words(&self, action: &GroundAction) -> String {
        let domain = self.problem.domain;
        let (operator, source) = (&domain.operators[action.operator], &action.source);
        let kind = &domain.states[operator.to].kind;
        let mut who = match action.object {
            Some(object) => self.objects[object].clone(),
            None => a(&noun(kind)),
        };
        if let Some(told) = self.told_source(action) {
            let rest = |s: &usize| self.statement(*s, source.reference).rest().to_owned();
            let mut all: Vec<String> = told.iter().take(LISTED).map(rest).collect();
            if told.len() > LISTED {
                all.push(format!("in one of {} more states", told.len() - LISTED));
            }
            who = format!("{who} that is {}", all.join(" or "));
        } else if let Some(origin) = action.origin() {
            who = format!("{who} from {}", self.objects[origin]);
        }
        who += &self.except_words(source, &source.of, " other than ");
        let target = action.reference.map(|r| &*self.objects[r]);
        let mut words = domain.move_in_words(operator, None, target);
        words = with_object(&words, kind, &who);
        if self.is_several(operator.to) {
            words = format!("{words}, at place {}", action.place + 1);
        }
        let least = action.among.unwrap_or(source.least);
        if least != 1 {
            words = format!("{words}, leaving at least {} where it was", least.saturating_sub(1));
        }
        if let Some(most) = source.most {
            words = format!("{words}, of at most {most}");
        }
        words + &self.clearing(source, [", to free its place", ", to clear the way"], " ")
    }

    /// Returns why an action takes away what is in the way: of `why`, the first is for a place.
    fn clearing(&self, source: &Test, why: [&str; 2], separator: &str) -> String {
        if !source.given {
            return String::new();
        }
        let several = source.of.iter().filter(|(s, _)| self.is_several(*s));
        let numbers: BTreeSet<usize> = several.filter_map(|(_, place)| *place).collect();
        let numbers: Vec<String> = numbers.iter().map(|place| (place + 1).to_string()).collect();
        let exact = source.of.iter().any(|(_, place)| place.is_some());
        let number = if numbers.is_empty() { String::new() } else { separator.to_owned() };
        why[usize::from(!exact)].to_owned()
            + &number
            + &numbers.join("_OR_").replace('_', separator)
    }

    /// Returns the id and the name of each object, and what the names are made of.
    pub fn finish(self) -> (Vec<(String, String)>, Composition) {
        let ids = self.problem.objects.iter().map(|o| o.id.to_string());
        (ids.zip(self.objects).collect(), Composition::new(self.factors))
    }
}
