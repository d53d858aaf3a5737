//! Attributes of objects: words and numbers that a recording or a scene gives beside the poses.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use serde::Serialize;
use serde_json::Value;

use super::{MAX_NAME, unfit};

/// Greatest number of attributes of an object.
const MAX_ATTRIBUTES: usize = 32;

/// The value of an attribute.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Attribute {
    /// A word, such as a colour.
    Word(String),
    /// A finite number, such as a length in metres.
    Number(f64),
}

/// The attributes of one object, by name.
pub type ObjectAttributes = BTreeMap<String, Attribute>;

/// The attributes of the objects of a recording or a scene, as [`Labels`](super::Labels) stand beside it: by the index of the
/// demonstration, 0 for a scene, and the id.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Attributes {
    of: HashMap<usize, HashMap<Arc<str>, ObjectAttributes>>,
}

impl Attributes {
    /// Returns the attributes of an object; `None` if it has none.
    pub fn get(&self, demo: usize, id: &str) -> Option<&ObjectAttributes> {
        self.of.get(&demo)?.get(id)
    }

    /// Sets an attribute of an object. Returns the value that it had before.
    pub fn set(
        &mut self,
        demo: usize,
        id: &str,
        name: &str,
        value: Attribute,
    ) -> Option<Attribute> {
        let own = self.of.entry(demo).or_default();
        own.entry(id.into()).or_default().insert(name.into(), value)
    }

    /// Returns whether no object has an attribute.
    pub fn is_empty(&self) -> bool {
        self.of.is_empty()
    }

    /// Takes the attributes of an object from a file. On a fault, returns the name, the problem and what was expected.
    pub(super) fn read(
        &mut self,
        demo: usize,
        id: &Arc<str>,
        raw: BTreeMap<String, Value>,
    ) -> Result<(), (String, String, String)> {
        if raw.len() > MAX_ATTRIBUTES {
            let problem = format!("it has {} attributes", raw.len());
            return Err((String::new(), problem, format!("at most {MAX_ATTRIBUTES}")));
        }
        let fits = |text: &str| unfit(text).is_none();
        for (name, value) in raw {
            let value = match value {
                _ if !fits(&name) => None,
                Value::String(word) if fits(&word) => Some(Attribute::Word(word)),
                Value::Number(number) => number.as_f64().map(Attribute::Number),
                _ => None,
            };
            let name: String = name.chars().take(MAX_NAME).collect();
            let Some(value) = value else {
                let expected = format!(
                    "a word of 1 to {MAX_NAME} characters or a number, and a name as long, without control characters"
                );
                let problem =
                    "it is neither a word nor a number, or too long, or has control characters";
                return Err((name, problem.into(), expected));
            };
            let before = self.set(demo, id, &name, value.clone());
            if before.is_some_and(|before| before != value) {
                let expected = "the same value for an id in all snapshots of a demonstration";
                return Err((name, format!("`{id}` had another value before"), expected.into()));
            }
        }
        Ok(())
    }
}
