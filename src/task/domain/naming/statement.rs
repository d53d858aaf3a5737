//! Variants of a sentence: of one object, of several, of none, and at one reference.

use super::nouns::{a, noun, plural};

/// Greatest length of a sentence, in characters. Two kinds of the greatest length fit in.
pub(crate) const MAX_SENTENCE: usize = 600;

/// A statement about an object of a kind. The sentences of this module have the form `a KIND is ...`. Others, given by a
/// person, are kept whole.
pub(crate) struct Statement {
    noun: String,
    /// What follows `is`, or the whole sentence.
    rest: Result<String, String>,
    /// Whether it is about another object of the kind than one that is known.
    other: bool,
}

impl Statement {
    pub fn new(sentence: &str, kind: &str) -> Self {
        let noun = noun(kind);
        let rest = sentence.strip_prefix(&format!("{} is ", a(&noun)));
        Self {
            rest: rest.map(str::to_owned).ok_or_else(|| sentence.to_owned()),
            noun,
            other: false,
        }
    }

    /// Puts the name of one reference in the place of any of its kind. A thing that is open does not name what it belongs to;
    /// the reference then comes last.
    pub fn at(self, kind: Option<&str>, reference: &str) -> Self {
        let place = |text: String| match kind {
            Some(kind) => with_reference(&text, kind, reference)
                .unwrap_or_else(|| format!("{text} at {reference}")),
            None => text,
        };
        Self { rest: self.rest.map(place).map_err(place), ..self }
    }

    /// Returns whether the statement names an object of a kind as the reference.
    pub fn names(&self, kind: Option<&str>) -> bool {
        kind.is_some_and(|kind| references(self.rest(), kind).next().is_some())
    }

    /// Returns the statement about the object of this name.
    pub fn about(&self, object: &str) -> String {
        match &self.rest {
            Ok(rest) => format!("{object} is {rest}"),
            Err(whole) => with_object(whole, &self.noun, object),
        }
    }

    /// Returns the denial of the statement about the object of this name.
    pub fn not_about(&self, object: &str) -> String {
        match &self.rest {
            Ok(rest) => format!("{object} is not {rest}"),
            Err(_) => format!("not: {}", self.about(object)),
        }
    }

    /// Returns the statement about another object of the kind.
    pub fn other(self) -> Self {
        Self { other: true, ..self }
    }

    /// Returns a description of an object of which the statement holds, such as `a cup that is in a drawer`.
    pub fn as_description(&self) -> String {
        match &self.rest {
            Ok(rest) => format!("{} that is {rest}", a(&self.noun)),
            Err(whole) => format!("{} of which holds: {whole}", a(&self.noun)),
        }
    }

    /// Returns the statement about any object of the kind, with a further description of it, such as ` other than cup 1`.
    pub fn about_any(&self, further: &str) -> String {
        match &self.rest {
            Err(whole) if further.is_empty() && !self.other => whole.clone(),
            _ if self.other => self.about(&format!("another {}{further}", self.noun)),
            _ => self.about(&(a(&self.noun) + further)),
        }
    }

    /// Returns the statement about several objects, such as `at least 2` of the kind.
    pub fn about_some(&self, how_many: &str, further: &str) -> String {
        let other = if self.other { "other " } else { "" };
        match &self.rest {
            Ok(rest) => {
                let rest = rest.replacen(" its ", " their ", 1);
                format!("{how_many} {other}{}{further} are {rest}", plural(&self.noun))
            }
            Err(whole) => format!("{how_many} times{further}: {whole}"),
        }
    }

    /// Returns the statement about no object of the kind.
    pub fn about_none(&self, further: &str) -> String {
        let other = if self.other { "other " } else { "" };
        match &self.rest {
            Ok(rest) => format!("no {other}{}{further} is {rest}", self.noun),
            Err(whole) => format!("never{further}: {whole}"),
        }
    }

    /// Returns for what a place of the state is, such as `for a cup in a drawer`.
    pub fn purpose(&self) -> String {
        match &self.rest {
            Ok(rest) => format!("for {} {rest}", a(&self.noun)),
            Err(whole) => format!("where {whole}"),
        }
    }

    /// Returns what follows `is`, or what a person wrote.
    pub fn rest(&self) -> &str {
        match &self.rest {
            Ok(rest) | Err(rest) => rest,
        }
    }
}

/// Puts `by` in the place of the first `a KIND` of a sentence; behind the sentence if there is none.
pub(crate) fn with_object(sentence: &str, kind: &str, by: &str) -> String {
    match places(sentence, kind).next() {
        Some((from, to)) => format!("{}{by}{}", &sentence[..from], &sentence[to..]),
        None => format!("{sentence} ({by})"),
    }
}

/// Puts `by` in the place of the last `a KIND` of a sentence; returns `None` if there is none.
pub(super) fn with_reference(sentence: &str, kind: &str, by: &str) -> Option<String> {
    let (from, to) = references(sentence, kind).last()?;
    Some(format!("{}{by}{}", &sentence[..from], &sentence[to..]))
}

/// Returns where `a KIND` stands and no further noun follows: `a cup` is no reference in "on a cup rack".
fn references(sentence: &str, kind: &str) -> impl Iterator<Item = (usize, usize)> {
    let ends = |rest: &str| {
        rest.is_empty()
            || [",", ".", " (", " that ", " is "].iter().any(|end| rest.starts_with(end))
    };
    places(sentence, kind).filter(move |(_, to)| ends(&sentence[*to..]))
}

/// Returns where `a KIND` stands as whole words.
fn places(sentence: &str, kind: &str) -> impl Iterator<Item = (usize, usize)> {
    let wanted = a(&noun(kind));
    let at = sentence.match_indices(&wanted).map(|(from, _)| from).collect::<Vec<_>>();
    let whole = |from: &usize| {
        let to = from + wanted.len();
        let inside = |c: char| c.is_alphanumeric() || c == '_' || c == '-';
        !sentence[..*from].ends_with(inside) && !sentence[to..].starts_with(inside)
    };
    let long = wanted.len();
    at.into_iter()
        .filter(whole)
        .map(move |from| (from, from + long))
        .collect::<Vec<_>>()
        .into_iter()
}
