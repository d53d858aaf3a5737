//! The session to which a file and its rows belong.

use std::collections::{BTreeSet, HashMap};

use super::pattern::Pattern;
use super::streams::{Part, Streams};
use crate::task::error::InputFault;

/// Words at the end of names that say what a table holds, not which session it is of.
const ROLES: [&str; 14] = [
    "objects", "object", "robot", "poses", "pose", "gripper", "hand", "parts", "tracking", "arm",
    "ee", "camera", "tf", "contacts",
];

fn is_role(word: &str) -> bool {
    ROLES.contains(&word.to_ascii_lowercase().as_str())
}

/// Where the rows of a file belong.
pub(super) struct Home {
    /// Its folder, without folders whose names only say what they hold.
    pub folder: String,
    pub session: String,
    pub part: String,
}

impl Home {
    /// Returns the origin of sessions that begin inside the file.
    pub fn inner(&self) -> String {
        join(&self.folder, &self.session)
    }
}

fn join(folder: &str, name: &str) -> String {
    [folder, name].into_iter().filter(|s| !s.is_empty()).collect::<Vec<_>>().join("/")
}

/// Returns the session that a file's name gives without a pattern; empty if the name only says what the file holds.
fn session_of(name: &str) -> &str {
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    match stem.rsplit_once(['_', '-', '.']) {
        Some((session, role)) if is_role(role) => session,
        _ if is_role(stem) => "",
        _ => stem,
    }
}

impl Streams {
    /// Returns where the rows of a file belong, by its name. A pattern of the mapping looks only at the name behind the
    /// last `/`.
    pub(super) fn home(&self, file: &str) -> Result<Home, InputFault> {
        let mut folders: Vec<&str> =
            file.split('/').filter(|folder| !matches!(*folder, "" | ".")).collect();
        let name = folders.pop().unwrap_or_default();
        let Some(pattern) = &self.mapping.sessions else {
            while folders.last().is_some_and(|folder| is_role(folder)) {
                folders.pop();
            }
            let session = session_of(name).to_owned();
            return Ok(Home { folder: folders.join("/"), session, part: String::new() });
        };
        let found = Pattern::captured(pattern, name).unwrap_or_default();
        let value = |key: &str| found.iter().find(|(k, _)| k == key).map(|(_, v)| (*v).to_owned());
        let problem = "its name does not fit the pattern of `sessions` in the mapping";
        let session = value("session").ok_or_else(|| InputFault {
            file: file.into(),
            line: None,
            field: String::new(),
            problem: problem.into(),
            expected: pattern.clone(),
        })?;
        Ok(Home { folder: String::new(), session, part: value("part").unwrap_or_default() })
    }
}

/// Makes one part of those that belong together, and gives each session a name of its own. Parts of the same name and of
/// different origins are of one session if at most one origin has poses of objects; otherwise the names say the origin.
pub(super) fn joined(parts: Vec<Part>, is_hand: impl Fn(&str) -> bool) -> Vec<Part> {
    let mut origins: HashMap<String, BTreeSet<String>> = HashMap::new();
    for part in &parts {
        let own = origins.entry(part.session.clone()).or_default();
        if part.tracks.iter().any(|track| !track.samples.is_empty() && !is_hand(&track.id)) {
            own.insert(part.origin.clone());
        }
    }
    let mut kept: Vec<Part> = Vec::new();
    let mut index: HashMap<(String, String), usize> = HashMap::new();
    for mut part in parts {
        let own = &origins[&part.session];
        if own.len() > 1 {
            part.session = join(behind(&part.origin, own), &part.session);
        } else if part.session.is_empty() {
            part.session = part.origin.rsplit('/').next().unwrap_or_default().to_owned();
        }
        match index.get(&(part.session.clone(), part.part.clone())) {
            Some(at) => kept[*at].absorb(part),
            None => {
                index.insert((part.session.clone(), part.part.clone()), kept.len());
                kept.push(part);
            }
        }
    }
    kept
}

/// Returns an origin without the folders that all origins share.
fn behind<'o>(origin: &'o str, all: &BTreeSet<String>) -> &'o str {
    let mut rest = origin;
    // Sorted texts share what the first and the last share.
    let (Some(first), Some(last)) = (all.first(), all.last()) else { return rest };
    for (one, other) in first.split('/').zip(last.split('/')) {
        match rest.strip_prefix(one) {
            Some(short) if one == other && short.starts_with('/') => rest = &short[1..],
            Some("") if one == other => rest = "",
            _ => break,
        }
    }
    rest
}

impl Part {
    /// Takes over the streams of another part.
    fn absorb(&mut self, other: Self) {
        for track in other.tracks {
            match self.tracks.iter_mut().find(|own| own.id == track.id) {
                Some(own) => own.samples.extend(track.samples),
                None => self.tracks.push(track),
            }
        }
        for (signal, readings) in other.signals {
            self.signals.entry(signal).or_default().extend(readings);
        }
        self.row_times.extend(other.row_times);
        self.kinds.extend(other.kinds);
    }
}
