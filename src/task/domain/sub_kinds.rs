//! Kinds that are divided by an attribute, because what is done to their objects differs by it.

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

/// Gives the objects of divided kinds in a snapshot their sub-kind. Returns the objects in no part, each with its kind and the
/// attribute that decides: they keep their kind, of which the domain knows nothing.
fn divide(
    sub_kinds: &[SubKinds],
    snapshot: &mut Snapshot,
    attributes: &Attributes,
    demo: usize,
) -> Vec<(String, String, String)> {
    let mut left = Vec::new();
    for object in &mut snapshot.objects {
        let Some(divided) = sub_kinds.iter().find(|s| *s.kind == *object.kind) else { continue };
        let value = attributes.get(demo, &object.id).and_then(|own| own.get(&divided.attribute));
        match value.and_then(|value| divided.of.iter().find(|part| part.has(value))) {
            Some(part) => object.kind = part.name.as_str().into(),
            None => {
                left.push((object.id.to_string(), divided.kind.clone(), divided.attribute.clone()));
            }
        }
    }
    left
}

impl SubKinds {
    /// Gives the objects of divided kinds in a recording their sub-kind.
    pub fn apply(all: &[Self], recording: &mut Recording, attributes: &Attributes) {
        for (demo, demonstration) in recording.demos.iter_mut().enumerate() {
            for snapshot in &mut demonstration.snapshots {
                divide(all, snapshot, attributes, demo);
            }
        }
    }

    /// Returns what is wrong with a division, if anything is.
    pub(super) fn fault(&self) -> Option<Fault> {
        let finite = |v: &Option<f64>| v.is_none_or(f64::is_finite);
        let usable = |part: &SubKind| {
            let number = part.from.is_some() || part.below.is_some();
            let text = !part.name.is_empty() && part.words.is_empty() == number;
            text && finite(&part.from) && finite(&part.below)
        };
        let sound = self.of.len() >= 2 && self.of.iter().all(usable);
        let problem = || format!("kind `{}` is not divided by `{}`", self.kind, self.attribute);
        let expected =
            "at least two parts, each with a name, and either `words` or `from` and `below`";
        (!sound).then(|| Fault::new(problem(), expected))
    }
}

impl RelationalDomain {
    /// Gives the objects of a scene the kinds that the domain knows, if it divides kinds by attributes. Returns the objects
    /// whose attribute is missing or has a value that no demonstration showed, each with its kind and the attribute.
    pub fn divide(
        &self,
        scene: &mut Snapshot,
        attributes: &Attributes,
    ) -> Vec<(String, String, String)> {
        divide(&self.sub_kinds, scene, attributes, 0)
    }
}
