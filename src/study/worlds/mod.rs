//! Kinematic worlds with known truth: tasks in which what a learner should find is known exactly.
//!
//! A [`World`] generates recordings of demonstrations, and carries out moves by its own rules without physics: a move
//! that is blocked, out of order or out of tolerance changes nothing. So a learner can be scored in two ways: by
//! comparing what it learned with [`World::truth`], and by carrying out its plans move by move.
//!
//! * Objects that nobody touches keep their pose exactly. A placement by hand is off by about 0.2 mm and 0.2 degrees.
//! * A target within the tolerance of a place is accepted. Objects in a container follow when it moves.
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
mod kitchen;
mod rest;
mod run;
mod spec;
#[cfg(test)]
mod tests;
mod truth;

use std::fmt::Debug;
use std::sync::Arc;

pub use truth::{Extent, Need, TIGHT_M, TrueAction, TrueGoal, TrueState, Truth, Turn};

use crate::sim::Seed;
use crate::task::domain::{Demonstration, Pose, Recording, Snapshot, SnapshotEvent};

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

    /// Records demonstrations, with snapshots at the start, at each contact and release, and at the end.
    fn record(&self, demos: usize, seed: Seed) -> Recording {
        let demos = (0..demos).map(|number| {
            let mut run = self.begin(seed, Stage::Demonstration(number));
            Demonstration { number: number as u64, snapshots: film(run.as_mut()) }
        });
        Recording { demos: demos.collect() }
    }
}

/// A run of a world: a scene that moves change.
pub trait Run {
    /// Returns the current poses of all objects. `number` is the number of accepted moves; there is no event.
    fn snapshot(&self) -> Snapshot;

    /// Moves an object to a target pose in the world frame and returns whether the world accepted the move. A refused
    /// move changes nothing. An accepted move ends at a resting pose near the target.
    fn act(&mut self, object: &str, target: &Pose) -> bool;

    /// Returns whether the goal is reached.
    fn solved(&self) -> bool;

    /// Returns the demonstrator's next move, as an object's id and a target pose; `None` once he has nothing left
    /// to do.
    fn next(&mut self) -> Option<(Arc<str>, Pose)>;
}

/// Maximum number of moves in one demonstration.
const MAX_MOVES: usize = 200;

/// Simulated time from one snapshot to the next, in seconds.
const SNAPSHOT_S: f64 = 1.5;

/// Lets the demonstrator act and returns the snapshots.
fn film(run: &mut dyn Run) -> Vec<Snapshot> {
    let mut snapshots: Vec<Snapshot> = Vec::new();
    let mut take = |run: &dyn Run, event, object: Option<&str>| {
        let number = snapshots.len() as u64;
        let mut snapshot = run.snapshot();
        snapshot.number = number;
        snapshot.time_s = Some(SNAPSHOT_S * number as f64);
        snapshot.event = Some(event);
        snapshot.object = object.and_then(|id| snapshot.objects.iter().position(|o| *o.id == *id));
        snapshots.push(snapshot);
    };
    take(run, SnapshotEvent::Start, None);
    for _ in 0..MAX_MOVES {
        let Some((object, target)) = run.next() else { break };
        take(run, SnapshotEvent::Contact, Some(&object));
        run.act(&object, &target);
        take(run, SnapshotEvent::Release, Some(&object));
    }
    take(run, SnapshotEvent::End, None);
    snapshots
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
