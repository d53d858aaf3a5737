//! Names for PDDL: legal, and different where the originals are.

use std::collections::{BTreeMap, BTreeSet};

/// Words that mean something in PDDL.
const TAKEN: [&str; 9] =
    ["object", "and", "not", "or", "either", "exists", "forall", "imply", "when"];

/// Gives each original name one name in PDDL.
pub(super) struct Names {
    used: BTreeSet<String>,
    given: BTreeMap<String, String>,
}

impl Names {
    pub fn new() -> Self {
        Self { used: TAKEN.map(str::to_owned).into(), given: BTreeMap::new() }
    }

    /// Returns the name of an original: in lower case, with `-` in place of what is not allowed, and with a number if
    /// another original has the name already.
    pub fn of(&mut self, original: &str) -> String {
        if let Some(name) = self.given.get(original) {
            return name.clone();
        }
        let name = self.fresh(original);
        self.given.insert(original.to_owned(), name.clone());
        name
    }

    /// Returns a name that is not used yet, made from a proposal.
    pub fn fresh(&mut self, proposal: &str) -> String {
        let legal = |c: char| if c.is_ascii_alphanumeric() || c == '_' { c } else { '-' };
        let mut name: String = proposal.chars().map(|c| legal(c.to_ascii_lowercase())).collect();
        if !name.starts_with(|c: char| c.is_ascii_lowercase()) {
            name.insert_str(0, "n-");
        }
        let mut unique = name.clone();
        let mut number = 1;
        while !self.used.insert(unique.clone()) {
            number += 1;
            unique = format!("{name}-{number}");
        }
        unique
    }

    /// Returns the names that were given to originals.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.given.values().map(String::as_str)
    }

    /// Returns the originals whose names in PDDL differ by more than the case of letters.
    pub fn renamed(self) -> Vec<(String, String)> {
        self.given.into_iter().filter(|(o, name)| o.to_ascii_lowercase() != *name).collect()
    }
}

#[cfg(test)]
#[path = "../../../tests/unit/pddl_names.rs"]
mod tests;
