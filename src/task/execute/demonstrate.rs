//! Demonstrations: a task's demonstrator lets the robot act, and the recorder looks on.
//!
//! What comes of it is a recording of where everything was when the gripper touched a part and let go. The learner and
//! the executor know nothing else.

use super::recorder::Recorder;
use crate::sim::Seed;
use crate::task::domain::{Demonstration, Event, Recording};
use crate::task::error::TaskError;
use crate::task::scene::Scene;
use crate::task::skill::{Robot, SkillReport, Touch};
use crate::task::tasks::{Demonstrator, Task};

/// A recording of demonstrations, and what is not in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Demonstrated {
    /// What a learner gets.
    pub recording: Recording,
    /// Every skill of every demonstration.
    pub skills: Vec<Vec<SkillReport>>,
    /// How many demonstrations solved the task, as its judge says.
    pub solved: usize,
    /// Steps of the physics.
    pub steps: u64,
    /// Simulated seconds.
    pub simulated_s: f64,
}

/// Skills of one demonstration for each that the task needs at least; after so many the demonstrator gives up.
const PATIENCE: usize = 4;

/// Shows the task `demos` times, in a scene drawn anew each time. Costs about half a second a demonstration of a few
/// skills.
///
/// `watch` is called after every step of the physics with the number of the demonstration, from 0, and its simulated
/// seconds.
///
/// # Errors
/// As [`Task::scene`] and [`Scene::new`].
pub fn demonstrate(
    task: &dyn Task,
    demos: usize,
    seed: Seed,
    watch: &mut dyn FnMut(usize, f64),
) -> Result<Demonstrated, TaskError> {
    let mut out = Demonstrated {
        recording: Recording::default(),
        skills: Vec::new(),
        solved: 0,
        steps: 0,
        simulated_s: 0.0,
    };
    // Settings that make no scene are refused even where nothing is shown.
    task.scene(seed)?.check()?;
    for demo in 0..demos {
        let mut scene = Scene::new(task.scene(seed.derive_index("demonstration", demo as u64))?)?;
        let mut recorder = Recorder::default();
        let mut demonstrator = task.demonstrator(seed, demo);
        let mut watch = |time_s| watch(demo, time_s);
        out.skills.push(show(task, &mut *demonstrator, &mut scene, &mut recorder, &mut watch));
        out.solved += usize::from(task.judge(&scene).solved);
        out.steps += scene.steps();
        out.simulated_s += scene.time_s();
        let snapshots = recorder.into_snapshots();
        out.recording.demos.push(Demonstration { number: demo as u64, snapshots });
    }
    Ok(out)
}

/// One demonstration.
fn show(
    task: &dyn Task,
    demonstrator: &mut dyn Demonstrator,
    scene: &mut Scene,
    recorder: &mut Recorder,
    watch: &mut dyn FnMut(f64),
) -> Vec<SkillReport> {
    let mut robot = Robot::default();
    let mut reports = Vec::new();
    recorder.note(scene, Event::Start, None);
    while reports.len() < PATIENCE * task.min_actions() {
        let Some(step) = demonstrator.next(scene, &reports) else { break };
        let grasps = task.grasps(scene, step.part);
        match robot.begin(scene, step.part, step.target, &grasps, None) {
            Err(report) => reports.push(report),
            Ok(()) => loop {
                let stepped = robot.step(scene);
                watch(scene.time_s());
                match stepped.touch {
                    Some(Touch::Contact(part)) => recorder.note(scene, Event::Contact, Some(part)),
                    Some(Touch::Release(part)) => recorder.note(scene, Event::Release, Some(part)),
                    None => {}
                }
                if let Some(report) = stepped.ended {
                    reports.push(report);
                    break;
                }
            },
        }
    }
    recorder.note(scene, Event::End, None);
    reports
}
