//! Streams of poses as they were read, before units, axes and frames are applied.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use super::found::Found;
use super::mapping::{Length, Mapping, Rotation, TimeUnit};
use super::sessions::Home;
use crate::robot::Pose;

/// A reading of the log that its names and numbers suggest.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Guess {
    /// What was guessed, as the mapping calls it.
    pub what: String,
    /// The value.
    pub value: String,
    /// Why.
    pub reason: String,
    /// The file; empty if the guess is about all files.
    pub file: String,
}

/// A pose in a stream. An orientation that was not seen is not a number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Time, in seconds once the streams are finished.
    pub t: f64,
    /// Position, in metres once the streams are finished.
    pub position: [f64; 3],
    /// Orientation as a unit quaternion x, y, z, w.
    pub orientation: [f64; 4],
    /// Index of the file.
    pub(super) source: u32,
}

impl Sample {
    /// Returns whether the orientation was seen.
    pub fn oriented(&self) -> bool {
        !self.orientation[3].is_nan()
    }
}

/// The poses of one object in the order of time.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// Id of the object.
    pub id: Arc<str>,
    /// Kind of the object.
    pub kind: Arc<str>,
    /// The poses.
    pub samples: Vec<Sample>,
}

/// A signal of the gripper.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Signal {
    Width,
    Grasp,
    /// With the object that is touched; an empty id stands for any object.
    Contact(String),
}

/// A value of a signal as it was read; a flag is 0 or 1.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reading {
    pub t: f64,
    pub value: f64,
    /// Index of the file.
    pub source: u32,
}

/// One uninterrupted stretch of a session.
#[derive(Debug, Clone, Default)]
pub struct Part {
    /// Name of the session.
    pub session: String,
    /// Name of the part; empty in a session of one part.
    pub part: String,
    /// The objects, without the hand.
    pub tracks: Vec<Track>,
    /// The hand, if it was seen.
    pub hand: Option<Track>,
    /// Width of the gripper over time.
    pub width: Vec<(f64, f64)>,
    /// Whether the gripper holds something, over time.
    pub grasp: Vec<(f64, bool)>,
    /// Whether the gripper touches an object, over time, by the object's id. An empty id stands for any object.
    pub contacts: BTreeMap<String, Vec<(f64, bool)>>,
    /// Folder, or folder and session of the file in which the session begins.
    pub(super) origin: String,
    /// Folder and session of the file.
    pub(super) home: String,
    /// Whether a column, or a group of arrays, says that it is of this session.
    pub(super) told: bool,
    /// Times of the rows of tables to which others refer, by the index of the file.
    pub(super) row_times: Vec<(u32, Vec<f64>)>,
    /// Kinds that the log gives.
    pub(super) kinds: HashMap<String, String>,
    /// The signals of the gripper as they were read, until their times are known.
    pub(super) signals: BTreeMap<Signal, Vec<Reading>>,
}

impl Part {
    /// Returns the first and the last time of all streams, if there is any.
    pub fn span(&self) -> Option<(f64, f64)> {
        let tracks = self.tracks.iter().chain(&self.hand);
        let ends =
            tracks.filter_map(|track| Some((track.samples.first()?.t, track.samples.last()?.t)));
        let ends = ends.chain(self.width.first().zip(self.width.last()).map(|(a, b)| (a.0, b.0)));
        let ends = ends.chain(self.grasp.first().zip(self.grasp.last()).map(|(a, b)| (a.0, b.0)));
        let flags = self.contacts.values();
        let ends =
            ends.chain(flags.filter_map(|f| f.first().zip(f.last()).map(|(a, b)| (a.0, b.0))));
        ends.reduce(|(a, b), (c, d)| (a.min(c), b.max(d)))
    }
}

/// A file that was read.
#[derive(Debug, Clone)]
pub(super) struct Source {
    pub file: String,
    pub length: Option<Length>,
    pub time: Option<TimeUnit>,
    pub frame: Option<Pose>,
    pub row_of: Option<String>,
    /// Least and greatest coordinate.
    pub extent: [f64; 2],
    /// The first times.
    pub times: Vec<f64>,
    pub rows: u64,
}

impl Source {
    /// Returns the part of its name behind the last `/`, with which patterns are compared.
    pub fn short(&self) -> &str {
        self.file.rsplit('/').next().unwrap_or(&self.file)
    }
}

/// What was left out, and how often.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Dropped {
    /// What was left out and why.
    pub what: String,
    /// How often.
    pub count: u64,
}

/// Streams that grow with each file.
#[derive(Debug)]
pub struct Streams {
    pub(super) mapping: Mapping,
    pub(super) parts: Vec<Part>,
    /// The parts by origin, session and part.
    pub(super) index: HashMap<[String; 3], usize>,
    pub(super) tracks: HashMap<(usize, String), usize>,
    pub(super) sources: Vec<Source>,
    pub(super) guesses: Vec<Guess>,
    pub(super) dropped: Vec<Dropped>,
    /// Columns that are not used, by file.
    pub(super) unused: Vec<(String, Vec<String>)>,
    /// What was found without a mapping.
    pub(super) found: Found,
    /// Column of the session, once a table has one.
    pub(super) session: Option<String>,
    /// What three columns of a rotation were taken for.
    pub(super) rotations: Vec<Rotation>,
}

impl Streams {
    /// Makes streams without samples, to be read as a mapping says.
    pub fn new(mapping: Mapping) -> Self {
        Self {
            mapping,
            parts: Vec::new(),
            index: HashMap::new(),
            tracks: HashMap::new(),
            sources: Vec::new(),
            guesses: Vec::new(),
            dropped: Vec::new(),
            unused: Vec::new(),
            found: Found::default(),
            session: None,
            rotations: Vec::new(),
        }
    }

    /// Returns the index of a part. Sessions of the same name and of different origins are not the same.
    pub(super) fn part(&mut self, origin: &str, session: &str, part: &str) -> usize {
        let key = [origin, session, part].map(str::to_owned);
        if let Some(index) = self.index.get(&key) {
            return *index;
        }
        let index = self.parts.len();
        let [origin, session, part] = key.clone();
        self.parts.push(Part { origin, session, part, ..Part::default() });
        self.index.insert(key, index);
        index
    }

    /// Returns the index of the part of a file, or of a session that begins inside it.
    pub(super) fn part_of(&mut self, home: &Home, inner: Option<&str>) -> usize {
        let at = match inner {
            Some(session) => self.part(&home.inner(), session, &home.part),
            None => self.part(&home.folder, &home.session, &home.part),
        };
        self.parts[at].home = home.inner();
        at
    }

    /// Returns the index of an object's track in a part.
    pub(super) fn track(&mut self, part: usize, id: &str) -> usize {
        let key = (part, id.to_owned());
        if let Some(index) = self.tracks.get(&key) {
            return *index;
        }
        let tracks = &mut self.parts[part].tracks;
        tracks.push(Track { id: id.into(), kind: id.into(), samples: Vec::new() });
        let index = tracks.len() - 1;
        self.tracks.insert(key, index);
        index
    }

    pub(super) fn drop_one(&mut self, what: &str) {
        match self.dropped.iter_mut().find(|dropped| dropped.what == what) {
            Some(dropped) => dropped.count += 1,
            None => self.dropped.push(Dropped { what: what.into(), count: 1 }),
        }
    }
}
