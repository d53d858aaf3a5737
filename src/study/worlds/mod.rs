//! Kinematic worlds with known truth: tasks in which what a learner should find is known exactly.
//!
//! A [`World`] generates recordings of demonstrations, and carries out moves by its own rules without physics: a move
//! that is blocked, out of order or out of tolerance changes nothing. So a learner can be scored in two ways: by
//! comparing what it learned with [`World::truth`], and by carrying out its plans move by move.
//!
//! * Objects that nobody touches keep their pose exactly. A placement by hand is off by about 0.2 mm and 0.2 degrees.
//! * A target within the tolerance of a place is accepted. Objects in a container follow when it moves.
//! * An action is named by the state that its object enters. Only one object can be at a place, which is not listed
//!   among the needs.
//! * The demonstrator draws the order of his moves wherever the world and his habits allow it.
//! * The number and poses of objects in tests can differ from those in demonstrations.
//!
//! ```
//! use symbolt::sim::Seed;
//! use symbolt::study::worlds::{self, Stage};
//!
//! for world in worlds::all() {
//!     let mut run = world.begin(Seed::new(1), Stage::Test);
//!     while let Some((object, target)) = run.next() {
//!         assert!(run.act(&object, &target), "{}", world.name());
//!     }
//!     assert!(run.solved());
//! }
//! ```

mod assembly;
mod bins;
mod blocks;
mod containers;
mod demonstrator;
mod episode;
mod evaluate;
mod explore;
mod kitchen;
mod rest;
mod run;
mod score;
mod spec;
#[cfg(test)]
mod tests;
mod truth;

use std::fmt::Debug;
use std::sync::Arc;

pub use episode::{Outcome, carry_out};
pub use evaluate::{Evaluation, Trial, evaluate};
pub use score::{NeedScore, Rates, SaidState, StateScore, score_needs, score_states};
pub use truth::{Explored, Extent, Need, TIGHT_M, TrueAction, TrueGoal, TrueState, Truth, Turn};

use crate::sim::Seed;
use crate::task::domain::{Demonstration, Labels, Pose, Recording, Snapshot, SnapshotEvent};

/// The purpose of a run. It determines the number of objects and how they lie at the beginning.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// The demonstration with this number, counted from 0.
    Demonstration(usize),
    /// A test, in which a learner's plan is carried out.
    Test,
}

/// A task with known truth.
pub trait World: Debug + Send + Sync {
    /// Returns the name of the world, in snake case.
    fn name(&self) -> &'static str;

    /// Returns the task and its difficulty, in one sentence.
    fn description(&self) -> &'static str;

    /// Begins a run in a scene drawn from `seed`. Runs with the same seed and stage are equal to the bit.
    fn begin(&self, seed: Seed, stage: Stage) -> Box<dyn Run>;

    /// Returns the truth, for scoring.
    fn truth(&self) -> Truth;

    /// Explores the world with random legal moves, mistakes included, and returns what always held when an action was
    /// possible, in the order of [`Truth::actions`]. Takes milliseconds.
    fn explore(&self) -> Vec<Explored>;

    /// Records demonstrations, with snapshots at the start, at each contact and release, and at the end.
    fn record(&self, demos: usize, seed: Seed) -> Recording {
        self.show(demos, seed).recording
    }

    /// Records the same demonstrations as [`World::record`], with the true states and actions beside them.
    fn show(&self, demos: usize, seed: Seed) -> Shown {
        let mut shown = Shown::default();
        for number in 0..demos {
            let mut run = self.begin(seed, Stage::Demonstration(number));
            shown.film(number as u64, run.as_mut());
        }
        shown
    }
}

/// The true state of an object.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Resting {
    /// Name of the state.
    pub state: &'static str,
    /// Id of the reference object; `None` in the world frame.
    pub reference: Option<Arc<str>>,
    /// Index of the place in [`TrueState::places`].
    pub place: usize,
}

/// A run of a world: a scene that moves change.
pub trait Run {
    /// Returns the current poses of all objects. `number` is the number of accepted moves; there is no event.
    fn snapshot(&self) -> Snapshot;

    /// Returns the true state of each object, in the order of [`Run::snapshot`]; `None` for a fixture without states.
    fn resting(&self) -> Vec<Option<Resting>>;

    /// Moves an object to a target pose in the world frame and returns whether the world accepted the move. A refused
    /// move changes nothing. An accepted move ends at a resting pose near the target.
    fn act(&mut self, object: &str, target: &Pose) -> bool;

    /// Returns whether the goal is reached.
    fn solved(&self) -> bool;

    /// Returns the demonstrator's next move, as an object's id and a target pose; `None` once he has nothing left
    /// to do.
    fn next(&mut self) -> Option<(Arc<str>, Pose)>;
}

/// A recording with the truth behind it, for scoring. A learner must see only the recording.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Shown {
    /// The recording.
    pub recording: Recording,
    /// True state of each object, by demonstration, snapshot and object; `None` for a fixture without states.
    pub states: Vec<Vec<Vec<Option<Resting>>>>,
    /// The action that begins after a snapshot, named by the state that the object enters.
    pub labels: Labels,
}

/// Maximum number of moves in one demonstration.
const MAX_MOVES: usize = 200;

/// Simulated time from one snapshot to the next, in seconds.
const SNAPSHOT_S: f64 = 1.5;

impl Shown {
    /// Lets the demonstrator act and adds what he shows.
    fn film(&mut self, number: u64, run: &mut dyn Run) {
        let mut snapshots: Vec<Snapshot> = Vec::new();
        let (mut states, mut labels) = (Vec::new(), Vec::new());
        let mut take = |run: &dyn Run, event, object: Option<&str>| {
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
            let Some((object, target)) = run.next() else { break };
            take(run, SnapshotEvent::Contact, Some(&object));
            run.act(&object, &target);
            labels.push(take(run, SnapshotEvent::Release, Some(&object)));
            labels.push(None);
        }
        take(run, SnapshotEvent::End, None);
        labels.push(None);
        self.recording.demos.push(Demonstration { number, snapshots });
        self.states.push(states);
        self.labels.push(labels);
    }
}

/// Returns all worlds.
pub fn all() -> Vec<Box<dyn World>> {
    [assembly::worlds(), blocks::worlds(), kitchen::worlds(), containers::worlds(), bins::worlds()]
        .into_iter()
        .flatten()
        .map(spec::Spec::boxed)
        .collect()
}

/// Returns the world called `name`, if there is one.
pub fn named(name: &str) -> Option<Box<dyn World>> {
    all().into_iter().find(|world| world.name() == name)
}
