//! Doubts about recordings: what is implausible in the data, or disagrees within it, and which reading would make sense.
//!
//! [`doubts`] examines a [`Recording`] and changes nothing.
//! Each [`Doubt`] says what was seen, with figures, which reading would make sense, and how to ask for it.
//!
//! Thresholds come from the spread of the data itself, whose noise is estimated, and from what is possible where one hand works;
//! the constants give their reasons.

mod compare;
mod frame;
mod kind;
mod moves;
mod scale;
mod turns;
mod view;

use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;

use crate::task::recording::Recording;
pub use kind::DoubtKind;
use view::View;

/// Something doubtful in a recording. It displays as one sentence.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Doubt {
    /// What is doubtful.
    pub kind: DoubtKind,
    /// Where: demonstration, snapshot, object. Empty if it is everywhere.
    pub place: String,
    /// What was seen, with figures.
    pub seen: String,
    /// The reading that would make sense.
    pub reading: String,
    /// How to ask for that reading.
    pub ask: String,
}

impl Doubt {
    fn new(kind: DoubtKind, place: impl Into<String>, seen: impl Into<String>) -> Self {
        let (_, reading, ask) = kind.words();
        let (place, seen) = (place.into(), seen.into());
        Self { kind, place, seen, reading: reading.into(), ask: ask.into() }
    }

    fn reading(self, reading: impl Into<String>) -> Self {
        Self { reading: reading.into(), ..self }
    }

    fn ask(self, ask: impl Into<String>) -> Self {
        Self { ask: ask.into(), ..self }
    }
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.place.is_empty() {
            write!(f, "{}: ", self.place)?;
        }
        write!(f, "{}; {}; {}", self.seen, self.reading, self.ask)
    }
}

/// Greatest number of doubts of one kind that are returned. More of them say nothing new, so the last says how many there are.
const MOST_OF_A_KIND: usize = 5;

/// Returns what is doubtful in a recording. The cost grows with the number of poses, and with the square of the number of
/// objects in a snapshot. At least the first 30 demonstrations are compared with all others, and the first 200 where together
/// they begin with up to 15,000 objects. Of each kind of doubt, the first five are returned, of which the fifth says how many
/// more there are.
///
/// ```
/// use symbolt::sim::Seed;
/// use symbolt::study::worlds;
/// use symbolt::doubt::{DoubtKind, doubts};
///
/// let mut recording = worlds::named("tower").expect("a world").record(5, Seed::new(1));
/// assert!(doubts(&recording).is_empty());
/// for demo in &mut recording.demos {
///     for object in demo.snapshots.iter_mut().flat_map(|s| &mut s.objects) {
///         object.pose.position = object.pose.position.map(|metres| 1000.0 * metres);
///     }
/// }
/// assert_eq!(doubts(&recording)[0].kind, DoubtKind::LengthUnit);
/// ```
pub fn doubts(recording: &Recording) -> Vec<Doubt> {
    let mut found = Found::default();
    examine(&View::of(recording), &mut found);
    found.doubts()
}

fn examine(view: &View<'_>, found: &mut Found) {
    // In a wrong unit, lengths say nothing else.
    if !scale::units(view, found) {
        let before = found.count();
        found.extend(frame::up(view));
        if found.count() == before {
            found.extend(turns::order(view));
        }
        // What follows takes the frame for right.
        let upright = found.count() == before;
        found.extend(frame::camera(view));
        if upright {
            found.extend(turns::handed(view));
        }
        if !found.has(DoubtKind::MovingCamera) {
            moves::moves(view, found);
            compare::demonstrations(view, found);
        }
    }
    let metric = !found.has(DoubtKind::LengthUnit);
    scale::times(view, metric, found);
    // A single snapshot is a scene.
    if view.demos.len() == 1 && view.demos[0].len() > 1 {
        let seen = "there is one demonstration";
        found.extend([Doubt::new(DoubtKind::FewDemonstrations, "", seen)]);
    }
}

/// The doubts found: the first of each kind, and how many more there are.
#[derive(Default)]
struct Found {
    kept: Vec<Doubt>,
    more: BTreeMap<DoubtKind, usize>,
}

impl Found {
    fn has(&self, kind: DoubtKind) -> bool {
        self.kept.iter().any(|doubt| doubt.kind == kind)
    }

    /// Takes a doubt, or counts it if there are many of its kind. A recording can give millions, so only those that are kept
    /// are put into words.
    fn push(&mut self, kind: DoubtKind, doubt: impl FnOnce() -> Doubt) {
        if self.kept.iter().filter(|d| d.kind == kind).count() == MOST_OF_A_KIND {
            *self.more.entry(kind).or_default() += 1;
            return;
        }
        let doubt = doubt();
        if !self.kept.contains(&doubt) {
            self.kept.push(doubt);
        }
    }

    fn extend(&mut self, doubts: impl IntoIterator<Item = Doubt>) {
        doubts.into_iter().for_each(|doubt| self.push(doubt.kind, || doubt));
    }

    fn count(&self) -> usize {
        self.kept.len() + self.more.values().sum::<usize>()
    }

    fn take(&mut self, other: Self) {
        self.extend(other.kept);
        for (kind, more) in other.more {
            *self.more.entry(kind).or_default() += more;
        }
    }

    /// Returns the doubts. The last of a kind says how many more there are.
    fn doubts(mut self) -> Vec<Doubt> {
        for (kind, more) in self.more {
            if let Some(last) = self.kept.iter_mut().rev().find(|doubt| doubt.kind == kind) {
                last.seen += &format!(", and there are {more} more such");
            }
        }
        self.kept
    }
}
