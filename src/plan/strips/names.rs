//! Names for PDDL: legal, and different where the originals are.

use std::collections::{BTreeMap, BTreeSet};

use super::pddl::Typed;

/// Words that mean something in PDDL.
const TAKEN: [&str; 9] =
    ["object", "and", "not", "or", "either", "exists", "forall", "imply", "when"];

/// Gives each original name one name in PDDL.
pub(crate) struct Names {
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

    /// Returns the originals whose names in PDDL differ by more than the case of letters.
    pub fn renamed(&self) -> Vec<(String, String)> {
        let differ = self.given.iter().filter(|(o, name)| o.to_ascii_lowercase() != **name);
        differ.map(|(original, name)| (original.clone(), name.clone())).collect()
    }
}

/// Returns a name for a variable of a type that no other has.
pub(crate) fn variable(kind: &str, taken: &[Typed]) -> String {
    let further = (3..).map(|number| format!("?other_{kind}_{number}"));
    let mut all = [format!("?{kind}"), format!("?other_{kind}")].into_iter().chain(further);
    all.find(|name| taken.iter().all(|t| t.name != *name)).unwrap_or_default()
}

#[cfg(test)]
#[path = "../../../tests/unit/pddl_names.rs"]
mod tests;
