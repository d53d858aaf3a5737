//! The session to which a file and its rows belong.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use super::finish::fault;
use super::streams::{Part, Streams, Track};
use crate::logs::captured;
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
        let found = captured(pattern, name).unwrap_or_default();
        let value = |key: &str| found.iter().find(|(k, _)| k == key).map(|(_, v)| (*v).to_owned());
        let problem = "its name does not fit the pattern of `sessions` in the mapping";
        let session = value("session").ok_or_else(|| fault(file, "", problem, &**pattern))?;
        Ok(Home { folder: String::new(), session, part: value("part").unwrap_or_default() })
    }
}

/// Makes one part of those that belong together, and gives each session a name of its own. Parts of the same name and of
/// different origins are of one session if at most one origin has poses of objects; otherwise the names say the origin.
pub(super) fn joined(parts: Vec<Part>, is_hand: impl Fn(&str) -> bool) -> Vec<Part> {
    let mut origins: HashMap<String, BTreeSet<String>> = HashMap::new();
    for part in &parts {
        let own = origins.entry(part.session.clone()).or_default();
        if shows(part, &is_hand) {
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

/// Returns whether a part has poses of objects.
fn shows(part: &Part, is_hand: &impl Fn(&str) -> bool) -> bool {
    part.tracks.iter().any(|track| !track.samples.is_empty() && !is_hand(&track.id))
}

/// Gives the streams of tables without the session's column to the sessions whose spans of time hold them: those of the
/// same file name, or else of any if the table shows no objects. Returns how many values no session, or more than one,
/// holds.
pub(super) fn scattered(parts: Vec<Part>, is_hand: impl Fn(&str) -> bool) -> (Vec<Part>, u64) {
    let told = parts.iter().filter(|part| part.told);
    let homes: HashSet<String> = told.map(|part| part.home.clone()).collect();
    let (others, mut kept): (Vec<Part>, Vec<Part>) = parts.into_iter().partition(|part| {
        !part.told && (homes.contains(&part.home) || !homes.is_empty() && !shows(part, &is_hand))
    });
    let mut lost = 0;
    for part in others {
        let same = homes.contains(&part.home);
        let mut spans: Vec<(f64, f64, usize)> = (kept.iter().enumerate())
            .filter(|(_, own)| own.told && (!same || own.home == part.home))
            .filter_map(|(at, own)| bounds(own).map(|(from, to)| (from, to, at)))
            .collect();
        spans.sort_by(|a, b| a.0.total_cmp(&b.0));
        let apart = spans.windows(2).all(|two| two[0].1 <= two[1].0);
        let find = |t: f64| match spans[..] {
            [(.., only)] => Some(only),
            _ => {
                let at = spans.partition_point(|span| span.0 <= t).checked_sub(1)?;
                (apart && t <= spans[at].1).then_some(spans[at].2)
            }
        };
        let mut pieces: BTreeMap<Option<usize>, Part> = BTreeMap::new();
        for Track { id, kind, samples } in part.tracks {
            for (at, samples) in split(samples, |sample| find(sample.t)) {
                let own = Track { id: id.clone(), kind: kind.clone(), samples };
                pieces.entry(at).or_default().tracks.push(own);
            }
        }
        for (at, own) in split(part.width, |(t, _)| find(*t)) {
            pieces.entry(at).or_default().width = own;
        }
        for (at, own) in split(part.grasp, |(t, _)| find(*t)) {
            pieces.entry(at).or_default().grasp = own;
        }
        for (id, flags) in part.contacts {
            for (at, own) in split(flags, |(t, _)| find(*t)) {
                pieces.entry(at).or_default().contacts.insert(id.clone(), own);
            }
        }
        for (at, piece) in pieces {
            match at {
                Some(at) => kept[at].absorb(piece),
                None => lost += times(&piece).count() as u64,
            }
        }
    }
    (kept, lost)
}

/// Splits values by the session that holds them.
fn split<T>(values: Vec<T>, find: impl Fn(&T) -> Option<usize>) -> BTreeMap<Option<usize>, Vec<T>> {
    let mut found: BTreeMap<Option<usize>, Vec<T>> = BTreeMap::new();
    for value in values {
        found.entry(find(&value)).or_default().push(value);
    }
    found
}

/// Returns the times of all streams of a part.
fn times(part: &Part) -> impl Iterator<Item = f64> {
    let poses = part.tracks.iter().flat_map(|track| &track.samples).map(|sample| sample.t);
    let flags = part.contacts.values().flatten().chain(&part.grasp).map(|(t, _)| *t);
    poses.chain(flags).chain(part.width.iter().map(|(t, _)| *t))
}

fn bounds(part: &Part) -> Option<(f64, f64)> {
    times(part).map(|t| (t, t)).reduce(|(a, b), (c, d)| (a.min(c), b.max(d)))
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
        for (id, flags) in other.contacts {
            self.contacts.entry(id).or_default().extend(flags);
        }
        self.width.extend(other.width);
        self.grasp.extend(other.grasp);
        self.told |= other.told;
        self.row_times.extend(other.row_times);
        self.kinds.extend(other.kinds);
    }
}
