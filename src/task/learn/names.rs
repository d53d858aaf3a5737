//! Readable names for learned states and actions, made from kinds and places. Users can rename them.

use std::collections::HashSet;

use crate::robot::Pose;
use crate::task::domain::Origin;
use crate::task::propositional::is_symbol;
use crate::task::recording::Recording;

/// A fixture: an object that never moved. States near it are named after it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Landmark {
    pub kind: String,
    pub pose: Pose,
}

/// Returns the objects of the first snapshot whose kind is `fixed`.
pub(crate) fn landmarks(recording: &Recording, fixed: impl Fn(&str) -> bool) -> Vec<Landmark> {
    let first = recording.demos.iter().flat_map(|d| d.snapshots.first()).next();
    let objects = first.into_iter().flat_map(|s| &s.objects).filter(|o| fixed(&o.kind));
    objects.map(|o| Landmark { kind: o.kind.to_string(), pose: o.pose }).collect()
}

/// Largest distance at which a landmark names a state, in metres.
const NEAR_M: f64 = 0.15;

/// Turns a kind into a valid part of a name: upper-case ASCII letters and digits, with `_` for everything else.
pub(crate) fn symbol(kind: &str) -> String {
    let mut name: String = kind
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_uppercase() } else { '_' })
        .collect();
    if !name.starts_with(|c: char| c.is_ascii_uppercase()) {
        name.insert_str(0, "KIND_");
    }
    name.truncate(60);
    name
}

/// Gives out unique names.
#[derive(Debug, Default)]
pub(crate) struct Names {
    taken: HashSet<String>,
}

impl Names {
    /// Returns `wanted`, or `wanted_2`, `wanted_3` and so on if the name is taken.
    pub fn take(&mut self, wanted: &str) -> String {
        let mut name = wanted.to_owned();
        let mut number = 2;
        while !is_symbol(&name) || !self.taken.insert(name.clone()) {
            name = format!("{wanted}_{number}");
            number += 1;
        }
        name
    }
}

/// Returns a name for a state: `KIND_AT_START` if its parts were found there, else `KIND_AT_LANDMARK` for the nearest
/// landmark within [`NEAR_M`], else `KIND_PLACED`.
pub(crate) fn state_name(
    kind: &str,
    origin: Origin,
    position: &Pose,
    landmarks: &[Landmark],
) -> String {
    let kind = symbol(kind);
    if origin == Origin::Found {
        return format!("{kind}_AT_START");
    }
    let nearest = landmarks
        .iter()
        .map(|l| (l.pose.distance(position), l))
        .filter(|(distance, _)| *distance <= NEAR_M)
        .min_by(|a, b| a.0.total_cmp(&b.0));
    match nearest {
        Some((_, landmark)) => format!("{kind}_AT_{}", symbol(&landmark.kind)),
        None => format!("{kind}_PLACED"),
    }
}

/// Returns a name for the action that puts a part into `state`.
pub(crate) fn action_name(state: &str) -> String {
    format!("PUT_{state}")
}

#[cfg(test)]
#[path = "../../../tests/unit/learn_names.rs"]
mod tests;
