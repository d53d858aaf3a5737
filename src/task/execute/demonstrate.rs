//! Demonstrations: a task's demonstrator controls the robot, and the recorder takes snapshots.
//!
//! The recorder takes a snapshot of all poses whenever the gripper touches or releases a part. The learner and the
//! executor know the demonstrations only from this recording.

use super::recorder::Recorder;
use crate::robot::scene::Scene;
use crate::robot::skill::Robot;
use crate::robot::{SkillReport, Touch};
use crate::sim::{Seed, warn_if_unoptimised};
use crate::task::error::TaskError;
use crate::task::event::{Event, Ignore, Observer, Touched};
use crate::task::recording::{Demonstration, Recording, Sensing, SnapshotEvent};
use crate::task::tasks::{Demonstrator, Task};

/// A recording of demonstrations, with facts that the recording does not contain.
#[derive(Debug, Clone, PartialEq)]
pub struct Demonstrated {
    /// The recording for the learner.
    pub recording: Recording,
    /// Reports of all skills, one list for each demonstration.
    pub skills: Vec<Vec<SkillReport>>,
    /// Number of demonstrations that solved the task, according to its judge.
    pub solved: usize,
    /// Number of physics steps.
    pub steps: u64,
    /// Simulated time, in seconds.
    pub simulated_s: f64,
}

/// Number of skills after which the demonstrator gives up, as a multiple of [`Task::min_actions`].
const PATIENCE: usize = 4;

/// Demonstrates the task `demos` times, each time in a newly drawn scene. Costs about half a second for a
/// demonstration of a few skills.
///
/// # Errors
/// As [`Task::scene`] and [`Scene::new`]; [`TaskError::Setting`] for a task with [`Task::min_actions`] of 0.
pub fn demonstrate(task: &dyn Task, demos: usize, seed: Seed) -> Result<Demonstrated, TaskError> {
    demonstrate_observed(task, demos, seed, &mut Ignore)
}

/// Demonstrates the task, as [`demonstrate`] does, and sends events to `observer`: the beginning and end of each
/// demonstration, physics steps, skills, contacts and releases.
///
/// # Errors
/// As [`demonstrate`].
pub fn demonstrate_observed(
    task: &dyn Task,
    demos: usize,
    seed: Seed,
    observer: &mut dyn Observer,
) -> Result<Demonstrated, TaskError> {
    warn_if_unoptimised();
    let mut out = Demonstrated {
        recording: Recording::default(),
        skills: Vec::new(),
        solved: 0,
        steps: 0,
        simulated_s: 0.0,
    };
    if task.min_actions() == 0 {
        // With 0, the demonstrator would never be asked.
        let (name, expected) = ("min_actions", "at least 1 action");
        return Err(TaskError::Setting { name, value: "0".into(), expected });
    }
    // Refuse settings without a valid scene even if `demos` is 0.
    task.scene(seed)?.check()?;
    for demo in 0..demos {
        let mut scene = Scene::new(task.scene(seed.derive_index("demonstration", demo as u64))?)?;
        let mut recorder = Recorder::default();
        let mut demonstrator = task.demonstrator(seed, demo);
        observer.observe(&Event::DemonstrationBegan { number: demo, of: demos });
        out.skills.push(show(task, &mut *demonstrator, &mut scene, &mut recorder, observer));
        let solved = task.judge(&scene).solved;
        observer.observe(&Event::DemonstrationEnded { number: demo, of: demos, solved });
        out.solved += usize::from(solved);
        out.steps += scene.steps();
        out.simulated_s += scene.time_s();
        let snapshots = recorder.into_snapshots();
        out.recording.demos.push(Demonstration { number: demo as u64, snapshots });
    }
    Ok(out)
}

/// Demonstrates the task, as [`demonstrate_observed`] does, and passes every snapshot of the recording through
/// `sensing`. The demonstrator and the judge still see the exact scene.
///
/// # Errors
/// As [`demonstrate`]; [`TaskError::Setting`] for a rate or noise outside its range.
pub fn demonstrate_sensed(
    task: &dyn Task,
    demos: usize,
    sensing: &Sensing,
    seed: Seed,
    observer: &mut dyn Observer,
) -> Result<Demonstrated, TaskError> {
    sensing.check()?;
    let mut shown = demonstrate_observed(task, demos, seed, observer)?;
    if !sensing.is_exact() {
        shown.recording = sensing.apply_recording(&shown.recording, seed.derive("", "sensing"));
    }
    Ok(shown)
}

/// Runs one demonstration.
fn show(
    task: &dyn Task,
    demonstrator: &mut dyn Demonstrator,
    scene: &mut Scene,
    recorder: &mut Recorder,
    observer: &mut dyn Observer,
) -> Vec<SkillReport> {
    let mut robot = Robot::default();
    let mut reports = Vec::new();
    recorder.note(scene, SnapshotEvent::Start, None);
    while reports.len() < PATIENCE * task.min_actions() {
        let Some(step) = demonstrator.next(scene, &reports) else { break };
        let grasps = task.grasps(scene, step.part);
        match robot.begin(scene, step.part, step.target, &grasps, None) {
            Err(report) => {
                let time_s = scene.time_s();
                observer.observe(&Event::SkillEnded { time_s, report: &report, decision: None });
                reports.push(report);
            }
            Ok(()) => {
                let time_s = scene.time_s();
                observer.observe(&Event::SkillBegan { time_s, decision: None });
                reports.push(carry_out(&mut robot, scene, recorder, observer));
            }
        }
    }
    recorder.note(scene, SnapshotEvent::End, None);
    reports
}

/// Steps the scene until the robot's skill is over.
fn carry_out(
    robot: &mut Robot,
    scene: &mut Scene,
    recorder: &mut Recorder,
    observer: &mut dyn Observer,
) -> SkillReport {
    loop {
        let step = robot.step(scene);
        let time_s = scene.time_s();
        if let Some(touch) = step.touch {
            match touch {
                Touch::Contact(part) => recorder.note(scene, SnapshotEvent::Contact, Some(part)),
                Touch::Release(part) => recorder.note(scene, SnapshotEvent::Release, Some(part)),
            }
            observer.observe(&Event::Touched(Touched::at(time_s, touch)));
        }
        if let Some(report) = step.ended {
            observer.observe(&Event::SkillEnded { time_s, report: &report, decision: None });
            observer.observe(&Event::Stepped { time_s });
            return report;
        }
        observer.observe(&Event::Stepped { time_s });
    }
}
