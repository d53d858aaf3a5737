//! A recording as the doubts see it: the pose of each object in each snapshot, when it rests, and how noisy poses are.

use std::collections::BTreeMap;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::robot::Pose;
use crate::task::recording::{Demonstration, Recording, SnapshotEvent};

/// A pose with its rotation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Seen {
    pub at: Vector3<f64>,
    pub turn: UnitQuaternion<f64>,
}

/// An object in a demonstration.
pub(super) struct Object<'a> {
    pub id: &'a str,
    pub kind: &'a str,
    /// Its pose in each snapshot; `None` where it is missing.
    pub seen: Vec<Option<Seen>>,
}

/// A demonstration.
pub(super) struct Demo<'a> {
    pub number: u64,
    /// Number of each snapshot, as recorded.
    pub numbers: Vec<u64>,
    pub times_s: Vec<Option<f64>>,
    pub events: Vec<Option<SnapshotEvent>>,
    /// Index of the named object of each snapshot, if any.
    pub named: Vec<Option<usize>>,
    pub objects: Vec<Object<'a>>,
    /// The holds, in order.
    pub holds: Vec<Hold>,
}

/// A time for which the hand held an object, as recorded.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hold {
    /// Index of the named object, if any.
    pub object: Option<usize>,
    /// Snapshot of the contact.
    pub from: usize,
    /// Snapshot of the release.
    pub released: usize,
    /// Snapshot after the release, when the object had come to rest.
    pub to: usize,
}

/// All demonstrations.
pub(super) struct View<'a> {
    pub demos: Vec<Demo<'a>>,
    /// Whether the recording has events.
    pub events: bool,
    /// The poses at the start, by kind, each with the index of its demonstration.
    pub starts_by_kind: BTreeMap<&'a str, Vec<(usize, Seen)>>,
    /// Standard deviation of the coordinates of objects that rest, in metres.
    pub noise_m: f64,
    /// Standard deviation of the angle of objects that rest, in radians.
    pub noise_rad: f64,
}

/// Greatest noise of a pose that is of use, in metres and radians.
const NOISIEST_M: f64 = 5e-3;
const NOISIEST_RAD: f64 = 0.1;

impl Seen {
    pub fn of(pose: &Pose) -> Self {
        let [x, y, z, w] = pose.orientation;
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        Self { at: Vector3::from(pose.position), turn }
    }
}

impl Object<'_> {
    pub fn first(&self) -> Option<Seen> {
        self.seen.iter().copied().flatten().next()
    }

    pub fn last(&self) -> Option<Seen> {
        self.seen.iter().rev().copied().flatten().next()
    }

    /// Pose in a snapshot or, if the object is missing, the last one before it.
    pub fn by(&self, snapshot: usize) -> Option<Seen> {
        self.seen[..=snapshot].iter().rev().copied().flatten().next()
    }

    /// Pose in a snapshot or the first one after it.
    pub fn since(&self, snapshot: usize) -> Option<Seen> {
        self.seen[snapshot..].iter().copied().flatten().next()
    }
}

impl<'a> Demo<'a> {
    fn new(demo: &'a Demonstration) -> Self {
        let count = demo.snapshots.len();
        let mut objects: Vec<Object<'a>> = Vec::new();
        let mut known: BTreeMap<&str, usize> = BTreeMap::new();
        for (s, snapshot) in demo.snapshots.iter().enumerate() {
            for o in &snapshot.objects {
                let index = *known.entry(&o.id).or_insert_with(|| {
                    objects.push(Object { id: &o.id, kind: &o.kind, seen: vec![None; count] });
                    objects.len() - 1
                });
                objects[index].seen[s] = Some(Seen::of(&o.pose));
            }
        }
        let named = |s: usize| {
            let snapshot = &demo.snapshots[s];
            known.get(&*snapshot.objects.get(snapshot.object?)?.id).copied()
        };
        let named: Vec<Option<usize>> = (0..count).map(named).collect();
        let mut holds = Vec::new();
        // Two hands hold two things at a time, if each is named.
        let mut open: Vec<(Option<usize>, usize)> = Vec::new();
        for (s, snapshot) in demo.snapshots.iter().enumerate() {
            let own = named[s];
            match snapshot.event {
                Some(SnapshotEvent::Contact) => {
                    open.retain(|(held, _)| own.is_some() && held.is_some() && *held != own);
                    open.push((own, s));
                }
                Some(SnapshotEvent::Release) => {
                    let of = open.iter().rposition(|(held, _)| own.is_some() && *held == own);
                    let Some(index) = of.or(open.len().checked_sub(1)) else { continue };
                    let (object, from) = open.remove(index);
                    holds.push(Hold { object, from, released: s, to: (s + 1).min(count - 1) });
                }
                _ => {}
            }
        }
        Self {
            number: demo.number,
            numbers: demo.snapshots.iter().map(|s| s.number).collect(),
            times_s: demo.snapshots.iter().map(|s| s.time_s).collect(),
            events: demo.snapshots.iter().map(|s| s.event).collect(),
            named,
            objects,
            holds,
        }
    }

    pub fn len(&self) -> usize {
        self.times_s.len()
    }

    /// Returns the place of a snapshot, as the file counts.
    pub fn place(&self, snapshot: usize) -> String {
        format!("demo {}, snapshot {}", self.number, self.numbers[snapshot])
    }

    /// Returns whether the hand holds something between a snapshot and the next.
    pub fn held(&self, snapshot: usize) -> bool {
        self.holds.iter().any(|h| h.from <= snapshot && snapshot < h.released)
    }
}

impl<'a> View<'a> {
    pub fn of(recording: &'a Recording) -> Self {
        let demos: Vec<Demo<'a>> =
            recording.demos.iter().filter(|d| !d.snapshots.is_empty()).map(Demo::new).collect();
        let events = demos.iter().any(|d| d.events.iter().any(Option::is_some));
        Self::with_noise(demos, events)
    }

    fn with_noise(demos: Vec<Demo<'a>>, events: bool) -> Self {
        let (mut steps, mut turns) = (Vec::new(), Vec::new());
        for object in demos.iter().flat_map(|d| &d.objects) {
            for pair in object.seen.windows(2) {
                if let [Some(a), Some(b)] = pair {
                    steps.push((a.at - b.at).norm());
                    turns.push(a.turn.angle_to(&b.turn));
                }
            }
        }
        // Most objects rest, so the median difference of two poses is noise. It is about 2.2 standard deviations.
        // More than the limits is no noise of a pose: everything moves.
        let noise_m = (middle(&mut steps) / 2.2).min(NOISIEST_M);
        let noise_rad = (middle(&mut turns) / 2.2).min(NOISIEST_RAD);
        let mut view = Self { demos, events, starts_by_kind: BTreeMap::new(), noise_m, noise_rad };
        let mut kinds: BTreeMap<&str, Vec<(usize, Seen)>> = BTreeMap::new();
        for (d, object, seen) in view.starts() {
            kinds.entry(object.kind).or_default().push((d, seen));
        }
        view.starts_by_kind = kinds;
        view
    }

    /// Distance within which two poses are the same, in metres.
    pub fn same_m(&self) -> f64 {
        1e-3 + 6.0 * self.noise_m
    }

    /// Distance beyond which an object was moved on purpose or by mistake, in metres: a hand does not slip so far.
    pub fn far_m(&self) -> f64 {
        0.03 + 6.0 * self.noise_m
    }

    /// The poses at the start of all demonstrations: demonstration, object and pose.
    pub fn starts(&self) -> impl Iterator<Item = (usize, &Object<'a>, Seen)> {
        let demos = self.demos.iter().enumerate();
        demos.flat_map(|(d, demo)| {
            demo.objects.iter().filter_map(move |o| Some((d, o, (*o.seen.first()?)?)))
        })
    }
}

/// The median; 0 of nothing.
pub(super) fn middle(values: &mut [f64]) -> f64 {
    let half = values.len() / 2;
    if values.is_empty() { 0.0 } else { *values.select_nth_unstable_by(half, f64::total_cmp).1 }
}

/// The difference of the ninth and the first decile: a spread that a few strangers do not change.
pub(super) fn spread(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    let Some(last) = values.len().checked_sub(1) else { return 0.0 };
    let mut at = |share: f64| {
        let index = (share * last as f64).round() as usize;
        *values.select_nth_unstable_by(index, f64::total_cmp).1
    };
    at(0.9) - at(0.1)
}
