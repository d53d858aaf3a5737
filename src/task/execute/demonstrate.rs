//! Demonstrations: a task's demonstrator controls the robot, and the recorder takes snapshots.
//!
//! The recorder takes a snapshot of all poses whenever the gripper touches or releases a part. The learner and the
//! executor know the demonstrations only from this recording.

use std::fmt;

use super::recorder::Recorder;
use super::senses;
use crate::robot::scene::Scene;
use crate::robot::skill::Robot;
use crate::robot::{SkillOutcome, SkillReport, Touch};
use crate::sim::{Seed, warn_if_unoptimised};
use crate::task::error::TaskError;
use crate::task::event::{Event, Ignore, Observer, Touched};
use crate::task::recording::{Demonstration, Recording, Sensing, SnapshotEvent};
use crate::task::tasks::{Demonstrator, Judgement, Task};

/// A recording of demonstrations, with facts that the recording does not contain.
#[derive(Debug, Clone, PartialEq)]
pub struct Demonstrated {
    /// The recording for the learner.
    pub recording: Recording,
    /// Reports of all skills, one list for each demonstration.
    pub skills: Vec<Vec<SkillReport>>,
    /// The demonstrations of the recording that did not solve the task.
    pub unsolved: Vec<Unsolved>,
    /// Demonstrations that did not solve the task and were therefore shown again. They are not in the recording.
    pub shown_again: Vec<Unsolved>,
    /// Number of demonstrations that solved the task, according to its judge.
    pub solved: usize,
    /// Number of physics steps.
    pub steps: u64,
    /// Simulated time, in seconds.
    pub simulated_s: f64,
}

/// A demonstration that did not solve the task, with the reasons.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unsolved {
    /// Index of the demonstration.
    pub demonstration: usize,
    /// The moves that did not put their part at its target, in order.
    pub failed: Vec<FailedMove>,
    /// What was achieved nevertheless, according to the task's judge.
    pub achieved: Vec<String>,
}

/// A move of a demonstration that failed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FailedMove {
    /// Number of the move in its demonstration, counted from 1.
    pub number: usize,
    /// Id of the part, as in the first snapshot.
    pub part: String,
    /// How the move ended.
    pub outcome: SkillOutcome,
    /// The limit of the robot that rules the move out or comes nearest, in words.
    pub why: String,
}

impl fmt::Display for Unsolved {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "demonstration {}: ", self.demonstration + 1)?;
        // The demonstrator tries again and again; the first and the last say enough.
        let last = self.failed.last().filter(|_| self.failed.len() > 1);
        for (index, failed) in self.failed.first().into_iter().chain(last).enumerate() {
            let FailedMove { number, part, outcome, why } = failed;
            let between = if index > 0 { "; " } else { "" };
            write!(f, "{between}{part} in move {number}: {outcome} ({why})")?;
        }
        if self.failed.is_empty() {
            let achieved = match self.achieved.is_empty() {
                true => "nothing".into(),
                false => self.achieved.join(", "),
            };
            write!(f, "every move placed its part, and the task's judge finds {achieved}")?;
        }
        Ok(())
    }
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
    show_all(task, (demos, 0), seed, observer)
}

/// Demonstrates the task `demos` times. `again` is how many demonstrations in all are shown again if they did not solve the
/// task.
fn show_all(
    task: &dyn Task,
    (demos, mut again): (usize, usize),
    seed: Seed,
    observer: &mut dyn Observer,
) -> Result<Demonstrated, TaskError> {
    warn_if_unoptimised();
    let mut out = Demonstrated {
        recording: Recording::default(),
        skills: Vec::new(),
        unsolved: Vec::new(),
        shown_again: Vec::new(),
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
    let (mut demo, mut tries) = (0, 0);
    while demo < demos {
        let drawn = match tries {
            0 => seed.derive_index("demonstration", demo as u64),
            tries => seed.derive_index("demonstration", demo as u64).derive_index("again", tries),
        };
        let mut scene = Scene::new(task.scene(drawn)?)?;
        let mut recorder = Recorder::default();
        let mut demonstrator = task.demonstrator(seed, demo);
        observer.observe(&Event::DemonstrationBegan { number: demo, of: demos });
        let (skills, failed) = show(task, &mut *demonstrator, &mut scene, &mut recorder, observer);
        let Judgement { solved, achieved } = task.judge(&scene);
        observer.observe(&Event::DemonstrationEnded { number: demo, of: demos, solved });
        out.steps += scene.steps();
        out.simulated_s += scene.time_s();
        let unsolved = Unsolved { demonstration: demo, failed, achieved };
        if !solved && again > 0 {
            (again, tries) = (again - 1, tries + 1);
            out.shown_again.push(unsolved);
            continue;
        }
        out.solved += usize::from(solved);
        if !solved {
            out.unsolved.push(unsolved);
        }
        out.skills.push(skills);
        let snapshots = recorder.into_snapshots();
        out.recording.demos.push(Demonstration { number: demo as u64, snapshots });
        (demo, tries) = (demo + 1, 0);
    }
    Ok(out)
}

/// Demonstrates the task, as [`demonstrate_observed`] does, and passes every snapshot of the recording through
/// `sensing`: one frame for each touch; at the start and the end, where the scene rests, the mean of 25 frames. The
/// demonstrator and the judge still see the exact scene.
///
/// Nobody teaches with what went wrong: a demonstration that did not solve the task is shown again in another scene, up to
/// `demos` times in all ([`Demonstrated::shown_again`]).
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
    let mut shown = show_all(task, (demos, demos), seed, observer)?;
    if !sensing.is_exact() {
        let (exact, seed) = (shown.recording, seed.derive("", "sensing"));
        shown.recording = sensing.apply_recording(&exact, seed);
        // At both ends of a demonstration the scene rests, and there is time to look.
        for (demo, exact) in shown.recording.demos.iter_mut().zip(&exact.demos) {
            let seed = seed.derive_index("look", demo.number);
            for (seen, exact) in demo.snapshots.iter_mut().zip(&exact.snapshots) {
                if matches!(exact.event, Some(SnapshotEvent::Start | SnapshotEvent::End)) {
                    *seen = senses::look(exact, sensing, seed, exact.number);
                }
            }
        }
    }
    Ok(shown)
}

/// Runs one demonstration. Returns the reports of its skills, and the moves that failed.
fn show(
    task: &dyn Task,
    demonstrator: &mut dyn Demonstrator,
    scene: &mut Scene,
    recorder: &mut Recorder,
    observer: &mut dyn Observer,
) -> (Vec<SkillReport>, Vec<FailedMove>) {
    let mut robot = Robot::default();
    let (mut reports, mut failed) = (Vec::new(), Vec::new());
    recorder.note(scene, SnapshotEvent::Start, None);
    let (first, parts) = recorder.look(scene);
    let id = |part: usize| {
        let object = parts.iter().position(|p| *p == Some(part)).map(|o| &first.objects[o]);
        object.map_or_else(|| format!("part {part}"), |object| object.id.to_string())
    };
    while reports.len() < PATIENCE * task.min_actions() {
        let Some(step) = demonstrator.next(scene, &reports) else { break };
        let grasps = task.grasps(&scene.sensed(), step.part);
        match robot.begin(&scene.sensed(), step.part, step.target, &grasps, None) {
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
        let outcome = reports.last().map(|report: &SkillReport| report.outcome);
        if let Some(outcome) = outcome.filter(|o| *o != SkillOutcome::Placed) {
            let why = scene.sensed().limits_in_words(step.part, &step.target, &grasps, outcome);
            failed.push(FailedMove { number: reports.len(), part: id(step.part), outcome, why });
        }
    }
    recorder.note(scene, SnapshotEvent::End, None);
    (reports, failed)
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
