//! What was found in logs without a mapping, and the mapping that takes the same.

use super::mapping::{Mapping, TableMap};
use crate::logs::{DatasetMap, TopicMap, fits};

/// What is said of files, with the names of those of which it is said.
pub(super) type OfFiles<T> = Vec<(T, Vec<String>)>;

/// What was found in logs without a mapping.
#[derive(Debug, Default)]
pub(super) struct Found {
    pub tables: OfFiles<TableMap>,
    pub topics: Vec<TopicMap>,
    pub datasets: OfFiles<DatasetMap>,
    /// The frames of reference, one if all files have the same.
    pub references: Vec<String>,
}

impl Found {
    /// Writes what was found into the mapping that found it.
    pub fn write(self, mapping: &mut Mapping) {
        if mapping.tables.is_empty() {
            mapping.tables = told(self.tables, |table, files| table.files = files);
        }
        if mapping.topics.is_empty() {
            mapping.topics = self.topics;
        }
        if mapping.datasets.is_empty() {
            mapping.datasets = told(self.datasets, |map, files| map.files = files);
        }
        if let ([reference], None) = (&*self.references, &mapping.reference) {
            mapping.reference = Some(reference.clone());
        }
    }
}

/// Notes that something is said of a file.
pub(super) fn say<T: PartialEq>(of: &mut OfFiles<T>, own: T, file: &str) {
    match of.iter_mut().find(|(known, _)| *known == own) {
        Some((_, files)) => files.push(file.into()),
        None => of.push((own, vec![file.into()])),
    }
}

/// Gives each the pattern of its files, or their names one by one if the pattern fits other files.
fn told<T: Clone>(all: OfFiles<T>, name: impl Fn(&mut T, String)) -> Vec<T> {
    let mut found: Vec<(String, &T)> = Vec::new();
    for (own, files) in &all {
        let pattern = common(files);
        let others = all.iter().filter(|(_, others)| !std::ptr::eq(others, files));
        match () {
            () if all.len() == 1 => found.push((String::new(), own)),
            () if others.flat_map(|(_, others)| others).any(|other| fits(&pattern, other)) => {
                found.extend(files.iter().map(|file| (file.clone(), own)));
            }
            () => found.push((pattern, own)),
        }
    }
    let set = |(files, own): (String, &T)| {
        let mut own = own.clone();
        name(&mut own, files);
        own
    };
    found.into_iter().map(set).collect()
}

/// Returns a pattern that fits some names: their common end behind a wildcard.
fn common(files: &[String]) -> String {
    let [first, others @ ..] = files else { return String::new() };
    if others.is_empty() {
        return first.clone();
    }
    let starts = first.char_indices().map(|(at, _)| &first[at..]);
    let end = starts.into_iter().find(|end| others.iter().all(|other| other.ends_with(end)));
    format!("*{}", end.unwrap_or_default())
}
