//! Kinematic worlds with known truth: tasks for which the states, needs and goal are known exactly.
//!
//! A [`World`] generates recordings of demonstrations. It also carries out moves by its own rules, without physics: a
//! move that is blocked, out of order or out of tolerance is refused and changes nothing. A learner is scored in two
//! ways: its states and needs are compared with the truth, and its plans are carried out move by move.
//!
//! The worlds are data, in `kinds/plain.json` and `kinds/varied.json`: a new world is an entry there, often one that says
//! in what it differs from another. [`World::about`] says what is difficult about it. The plain worlds are what the learner
//! grew up with. The varied ones have what those lack: they are open or closed at the start, moves are shown once or
//! twice, placements use the whole tolerance, sizes differ within a kind, areas have one height, either of two things
//! suffices, every object counts, demonstrations end differently, and another hand moves things.
//!
//! # Rules
//!
//! * An action is named by the state that its object enters. A place of a spot holds one object; this is not listed
//!   among the needs.
//! * A target within the tolerance of a place is accepted. Where the tolerance is at most 5 mm, the object snaps
//!   into the place. Otherwise it rests where it was put. On a table it also turns flat, and in a heap it rests at a
//!   height that the hand does not choose.
//! * A placement by hand is off by about 0.2 mm and 0.2 degrees. Objects that nobody touches keep their pose exactly.
//! * Objects in a drawer follow it. Other objects cannot be moved while something rests on them.
//! * The demonstrator draws the order of moves wherever the world and the habits allow it.
//! * The numbers and poses of objects differ from run to run.
//! * A bystander moves only what lies loose, within the area that it lies in.
//!
//! # Carrying out and scoring
//!
//! [`evaluate`] demonstrates a world, learns it, compares what was learned with the truth, and carries out plans move by
//! move, with [`Sensing`](crate::task::Sensing) if it should be imperfect. The moves are decided by the symbolic planner
//! unless [`Planning`] says otherwise. A stated need is right if it held whenever random legal moves, mistakes included, made
//! the action possible.
//!
//! `symbolt experiment worlds` ([`catalogue`](crate::study::catalogue)) runs [`evaluate`], so that anybody can repeat what is
//! said of the learner. It is an experiment and not test support because its rates belong in a table with intervals, and need
//! more episodes than a test has time for.
//!
//! ```
//! use symbolt::sim::Seed;
//! use symbolt::study::worlds::{self, Stage};
//!
//! for world in worlds::all() {
//!     let mut run = world.begin(Seed::new(1), Stage::Test);
//!     while let Some((object, target)) = run.next_move() {
//!         assert!(run.act(&object, &target), "{}", world.name());
//!     }
//!     assert!(run.solved());
//! }
//! ```

mod demonstrator;
mod episode;
mod evaluate;
mod explore;
mod planning;
mod rest;
mod run;
mod score;
mod spec;
#[cfg(test)]
#[path = "../../../tests/unit/study_worlds.rs"]
mod tests;
mod truth;

use std::sync::Arc;

pub use episode::Outcome;
pub(super) use evaluate::MOST_MOVES;
pub use evaluate::{Evaluation, Trial, episodes, evaluate};
pub use planning::Planning;
pub use run::Run;
pub use score::{Rates, StateScore};
pub use truth::Need;

use spec::Spec;

use crate::sim::Seed;
use crate::task::recording::{Demonstration, Labels, Recording, Snapshot, SnapshotEvent};

/// The purpose of a run. It determines the number of objects and how they lie at the beginning.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// The demonstration with this number, counted from 0.
    Demonstration(usize),
    /// A test, in which a learner's plan is carried out.
    Test,
}

/// A task with known truth.
#[derive(Debug, Clone)]
pub struct World(Arc<Spec>);

impl World {
    /// Returns the name of the world, in snake case.
    pub fn name(&self) -> &'static str {
        self.0.name
    }

    /// Returns what is difficult about the world.
    pub fn about(&self) -> &'static str {
        self.0.about
    }

    /// Begins a run in a scene drawn from `seed`. Runs with the same seed and stage are equal to the bit.
    pub fn begin(&self, seed: Seed, stage: Stage) -> Run {
        Run::begin(self.0.clone(), seed, stage)
    }

    /// Returns whether the world demands something of an action, beyond a free place.
    pub(super) fn demands(&self) -> bool {
        self.0.jobs.iter().any(|job| self.0.needs_of(job.to).next().is_some())
    }

    /// Records demonstrations, with snapshots at the start, at each contact and release, and at the end.
    pub fn record(&self, demos: usize, seed: Seed) -> Recording {
        self.show(demos, seed).recording
    }

    /// Records the same demonstrations as [`World::record`], with the true states and actions beside them.
    fn show(&self, demos: usize, seed: Seed) -> Shown {
        let mut shown = Shown::default();
        for number in 0..demos {
            let mut run = self.begin(seed, Stage::Demonstration(number));
            shown.film(number as u64, &mut run);
        }
        shown
    }
}

/// The true state of an object.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Resting {
    /// Name of the state.
    state: &'static str,
    /// Id of the reference object; `None` in the world frame.
    reference: Option<Arc<str>>,
}

/// A recording with the truth behind it, for scoring. A learner must see only the recording.
#[derive(Debug, Clone, PartialEq, Default)]
struct Shown {
    /// The recording.
    recording: Recording,
    /// True state of each object, by demonstration, snapshot and object; `None` for a fixture without states.
    states: Vec<Vec<Vec<Option<Resting>>>>,
    /// The action that begins after a snapshot, named by the state that the object enters.
    labels: Labels,
}

/// Maximum number of moves in one demonstration.
const MAX_MOVES: usize = 200;

/// Simulated time from one snapshot to the next, in seconds.
const SNAPSHOT_S: f64 = 1.5;

impl Shown {
    /// Lets the demonstrator act and adds the snapshots.
    fn film(&mut self, number: u64, run: &mut Run) {
        let mut snapshots: Vec<Snapshot> = Vec::new();
        let (mut states, mut labels) = (Vec::new(), Vec::new());
        let mut take = |run: &Run, event, object: Option<&str>| {
            let mut snapshot = run.snapshot();
            snapshot.number = snapshots.len() as u64;
            snapshot.time_s = Some(SNAPSHOT_S * snapshots.len() as f64);
            snapshot.event = Some(event);
            let touched = object.and_then(|id| snapshot.objects.iter().position(|o| *o.id == *id));
            snapshot.object = touched;
            snapshots.push(snapshot);
            states.push(run.resting());
            touched.and_then(|t| run.resting().swap_remove(t)).map(|r| r.state.to_owned())
        };
        take(run, SnapshotEvent::Start, None);
        labels.push(None);
        for _ in 0..MAX_MOVES {
            let Some((object, target)) = run.next_move() else { break };
            take(run, SnapshotEvent::Contact, Some(&object));
            run.act(&object, &target);
            labels.push(take(run, SnapshotEvent::Release, Some(&object)));
            run.disturb();
            labels.push(None);
        }
        take(run, SnapshotEvent::End, None);
        labels.push(None);
        self.recording.demos.push(Demonstration { number, snapshots });
        self.states.push(states);
        self.labels.push(labels);
    }
}

/// Returns the twenty plain worlds, in a fixed order.
pub fn plain() -> Vec<World> {
    Spec::read(false).map(|spec| World(Arc::new(spec))).collect()
}

/// Returns the worlds with the variety that the plain ones lack, in a fixed order.
pub fn varied() -> Vec<World> {
    Spec::read(true).map(|spec| World(Arc::new(spec))).collect()
}

/// Returns all worlds, the plain ones first.
pub fn all() -> Vec<World> {
    [plain(), varied()].concat()
}

/// Returns the world called `name`, if there is one.
pub fn named(name: &str) -> Option<World> {
    all().into_iter().find(|world| world.name() == name)
}
