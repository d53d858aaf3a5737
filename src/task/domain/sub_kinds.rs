//! Kinds that are divided by an attribute, because what is done to their objects differs by it.

use std::collections::BTreeSet;
use std::fmt;

use serde::{Deserialize, Serialize};

use super::RelationalDomain;
use crate::task::propositional::Fault;
use crate::task::recording::{Attribute, Attributes, Recording, Snapshot};

/// Objects of a kind whose attribute has certain values.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SubKind {
    /// Name, the kind of these objects in the domain.
    pub name: String,
    /// The words of which the attribute is one; empty for a number.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub words: Vec<String>,
    /// The attribute is a number of at least this.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<f64>,
    /// The attribute is a number below this.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub below: Option<f64>,
    /// Number of objects that showed it, counted in each demonstration.
    pub count: usize,
}

/// A kind that is divided by an attribute.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SubKinds {
    /// The kind in recordings and scenes.
    pub kind: String,
    /// Name of the attribute.
    pub attribute: String,
    /// The parts, at least two.
    pub of: Vec<SubKind>,
    /// Other attributes that divide the demonstrated objects in the same way.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub also: Vec<String>,
}

impl SubKind {
    /// Returns whether a value is one of this part.
    pub fn has(&self, value: &Attribute) -> bool {
        match value {
            Attribute::Word(word) => self.words.contains(word),
            Attribute::Number(number) => {
                let bounded = self.from.is_some() || self.below.is_some();
                let inside = self.from.is_none_or(|from| from <= *number);
                bounded && inside && self.below.is_none_or(|below| *number < below)
            }
        }
    }

    /// Returns the values in words, such as `red or blue` or `below 0.045`.
    pub fn values(&self) -> String {
        match (self.from, self.below) {
            (None, None) => self.words.join(" or "),
            (Some(from), None) => format!("at least {from}"),
            (None, Some(below)) => format!("below {below}"),
            (Some(from), Some(below)) => format!("at least {from}, below {below}"),
        }
    }
}

/// An object of a divided kind that is in no part, as its attribute is missing or has a value that no demonstration showed. It
/// keeps its kind, of which the domain knows nothing.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Undivided {
    /// Id of the object.
    pub id: String,
    /// Its kind.
    pub kind: String,
    /// The attribute that divides the kind.
    pub attribute: String,
}

impl fmt::Display for Undivided {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { id, kind, attribute } = self;
        write!(
            f,
            "`{id}` is in no state: its kind `{kind}` is divided by `{attribute}`, which it lacks or which has a value that \
             no demonstration showed"
        )
    }
}

/// Gives the objects of divided kinds in a snapshot their sub-kind. Returns those in no part.
fn divide(
    sub_kinds: &[SubKinds],
    snapshot: &mut Snapshot,
    attributes: &Attributes,
    demo: usize,
) -> Vec<Undivided> {
    let mut left = Vec::new();
    for object in &mut snapshot.objects {
        let Some(divided) = sub_kinds.iter().find(|s| *s.kind == *object.kind) else { continue };
        let value = attributes.get(demo, &object.id).and_then(|own| own.get(&divided.attribute));
        match value.and_then(|value| divided.of.iter().find(|part| part.has(value))) {
            Some(part) => object.kind = part.name.as_str().into(),
            None => {
                let (id, kind) = (object.id.to_string(), divided.kind.clone());
                left.push(Undivided { id, kind, attribute: divided.attribute.clone() });
            }
        }
    }
    left
}

/// Returns whether no text occurs twice.
fn differ<'a>(mut all: impl Iterator<Item = &'a str>) -> bool {
    let mut known = BTreeSet::new();
    all.all(|text| known.insert(text))
}

impl SubKinds {
    /// Gives the objects of divided kinds in a recording their sub-kind. Returns those in no part, each once.
    pub fn apply(
        all: &[Self],
        recording: &mut Recording,
        attributes: &Attributes,
    ) -> BTreeSet<Undivided> {
        let mut left = BTreeSet::new();
        for (demo, demonstration) in recording.demos.iter_mut().enumerate() {
            for snapshot in &mut demonstration.snapshots {
                left.extend(divide(all, snapshot, attributes, demo));
            }
        }
        left
    }

    /// Returns what is wrong with a division, if anything is.
    fn fault(&self) -> Option<Fault> {
        let finite = |v: &Option<f64>| v.is_none_or(f64::is_finite);
        let ends = |part: &SubKind| {
            (part.from.unwrap_or(f64::NEG_INFINITY), part.below.unwrap_or(f64::INFINITY))
        };
        let usable = |part: &SubKind| {
            let number = part.from.is_some() || part.below.is_some();
            let text = !part.name.is_empty() && part.words.is_empty() == number;
            text && finite(&part.from) && finite(&part.below) && ends(part).0 < ends(part).1
        };
        let numbers = self.of.iter().filter(|part| part.words.is_empty());
        let mut ranges: Vec<(f64, f64)> = numbers.map(ends).collect();
        ranges.sort_by(|a, b| a.0.total_cmp(&b.0));
        let words = self.of.iter().flat_map(|part| &part.words);
        let sound = self.of.len() >= 2
            && !self.kind.is_empty()
            && !self.attribute.is_empty()
            && self.of.iter().all(usable)
            && differ(self.of.iter().map(|part| &*part.name))
            && differ(words.map(|word| &**word))
            && ranges.windows(2).all(|two| two[0].1 <= two[1].0);
        let problem = || format!("kind `{}` is not divided by `{}`", self.kind, self.attribute);
        let expected = "a kind, an attribute, and at least two parts, each with a name of its own and either `words` or \
                        `from` below `below`, of which no two share a value";
        (!sound).then(|| Fault::new(problem(), expected))
    }

    /// Returns what is wrong with the divisions of a domain, if anything is.
    pub(super) fn fault_of(all: &[Self]) -> Option<Fault> {
        let twice = || Fault::new("a kind is divided twice", "one division for each kind");
        let parts = || Fault::new("two parts have one name", "a name of its own for each part");
        let names = all.iter().flat_map(|divided| &divided.of).map(|part| &*part.name);
        (all.iter().find_map(Self::fault))
            .or_else(|| (!differ(all.iter().map(|divided| &*divided.kind))).then(twice))
            .or_else(|| (!differ(names)).then(parts))
    }
}

impl RelationalDomain {
    /// Gives the objects of a scene the kinds that the domain knows, if it divides kinds by attributes. Returns those in no
    /// part.
    pub fn divide(&self, scene: &mut Snapshot, attributes: &Attributes) -> Vec<Undivided> {
        divide(&self.sub_kinds, scene, attributes, 0)
    }

    /// Returns whether two kinds are the same, or parts of one kind.
    pub(crate) fn are_alike(&self, one: &str, other: &str) -> bool {
        let has = |divided: &SubKinds, kind: &str| divided.of.iter().any(|part| part.name == kind);
        one == other || self.sub_kinds.iter().any(|own| has(own, one) && has(own, other))
    }
}
