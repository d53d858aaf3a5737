//! The scripted demonstrator: the only code that knows the task.
//!
//! It follows the three rules of the paper (section II.C): a nut on the table and an empty pocket, put the nut in; a bolt
//! on the table and an empty hole, put the bolt in; both in the jig, put the bolt through the nut.
//! Nut first or bolt first is drawn for each demonstration. What it leaves behind is a recording of where
//! everything was when the gripper touched and let go; the learner and the executor know nothing else.

use rand::RngExt;

use super::witness::{Assembly, Recorder};
use crate::sim::Seed;
use crate::task::domain::{Demonstration, Event as Noted, Recording};
use crate::task::error::TaskError;
use crate::task::event::{Event, Ignore, Observer, SkillOutcome, SkillReport, Touch, Touched};
use crate::task::scene::{PartKind, Scene, SceneSpec};
use crate::task::skill::{Robot, Target};

/// A recording of demonstrations, and what only the demonstrator knows.
#[derive(Debug, Clone, PartialEq)]
pub struct Demonstrated {
    /// What a learner gets.
    pub recording: Recording,
    /// Every skill of every demonstration.
    pub skills: Vec<Vec<SkillReport>>,
    /// How many demonstrations ended with a bolt through a nut in the pocket.
    pub assembled: usize,
    /// Steps of the physics.
    pub steps: u64,
    /// Simulated seconds.
    pub simulated_s: f64,
}

/// Most skills in one demonstration; then the demonstrator gives up.
const MOST_SKILLS: usize = 12;

/// Shows the task `demos` times, in a scene drawn anew each time.
///
/// # Errors
/// As [`Scene::new`].
pub fn demonstrate(spec: &SceneSpec, demos: usize, seed: Seed) -> Result<Demonstrated, TaskError> {
    demonstrate_observed(spec, demos, seed, &mut Ignore)
}

/// [`demonstrate`], telling `observer` when a demonstration begins and ends, of every step of the physics, of skills
/// and of touches.
///
/// # Errors
/// As [`demonstrate`].
pub fn demonstrate_observed(
    spec: &SceneSpec,
    demos: usize,
    seed: Seed,
    observer: &mut dyn Observer,
) -> Result<Demonstrated, TaskError> {
    spec.check()?;
    let mut out = Demonstrated {
        recording: Recording::default(),
        skills: Vec::new(),
        assembled: 0,
        steps: 0,
        simulated_s: 0.0,
    };
    let flip = seed.derive("demonstrator", "order").rng().random::<bool>();
    for demo in 0..demos {
        let own = seed.derive_index("demonstration", demo as u64);
        let mut scene = Scene::new(spec, own)?;
        let mut recorder = Recorder::new(spec);
        // Alternating from a drawn start, so that few demonstrations show both orders.
        let nut_first = (demo % 2 == 0) == flip;
        observer.observe(&Event::DemonstrationBegan { number: demo, of: demos });
        out.skills.push(show(&mut scene, &mut recorder, nut_first, observer));
        let solved = Assembly::judge(&scene).is_assembled();
        observer.observe(&Event::DemonstrationEnded { number: demo, of: demos, solved });
        out.assembled += usize::from(solved);
        out.steps += scene.steps();
        out.simulated_s += scene.time_s();
        let snapshots = recorder.into_snapshots();
        out.recording.demos.push(Demonstration { number: demo as u64, snapshots });
    }
    Ok(out)
}

/// One demonstration.
fn show(
    scene: &mut Scene,
    recorder: &mut Recorder,
    nut_first: bool,
    observer: &mut dyn Observer,
) -> Vec<SkillReport> {
    let mut robot = Robot::default();
    let mut reports = Vec::new();
    recorder.note(scene, Noted::Start, None);
    while reports.len() < MOST_SKILLS {
        let Some((part, target)) = next(scene, nut_first, &reports) else { break };
        match robot.begin(scene, part, target, None) {
            Err(report) => reports.push(report),
            Ok(()) => {
                let time_s = scene.time_s();
                observer.observe(&Event::SkillBegan { time_s, decision: None });
                reports.push(carry_out(&mut robot, scene, recorder, observer));
            }
        }
    }
    recorder.note(scene, Noted::End, None);
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
                Touch::Contact(part) => recorder.note(scene, Noted::Contact, Some(part)),
                Touch::Release(part) => recorder.note(scene, Noted::Release, Some(part)),
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

/// The rule that applies: which part, and where to; `None` when the task is done or nothing can be.
fn next(scene: &Scene, nut_first: bool, so_far: &[SkillReport]) -> Option<(usize, Target)> {
    let assembly = Assembly::judge(scene);
    if assembly.is_assembled() {
        return None;
    }
    let spec = scene.spec();
    let jig = &spec.jig;
    let at = |[x, y]: [f64; 2], z: f64| Target { position: [x, y, z], axis: [0.0, 0.0, 1.0] };
    if let (Some(nut), Some(bolt)) = (assembly.nut_in_pocket, assembly.bolt_in_hole) {
        let [x, y, _] = scene.part(nut)?.position;
        return Some((bolt, at([x, y], jig.pocket_floor_m + spec.part.nut_height_m)));
    }
    // A part that could not be taken is left for another.
    let stuck = |part: usize| {
        so_far.iter().any(|r| r.part == part && r.outcome == SkillOutcome::Unreachable)
    };
    let free = |kind: PartKind| {
        scene.kinds().enumerate().position(|(i, k)| k == kind && !stuck(i) && !assembly.holds(i))
    };
    let nut = assembly.nut_in_pocket.is_none().then(|| free(PartKind::Nut)).flatten();
    let bolt = assembly.bolt_in_hole.is_none().then(|| free(PartKind::Bolt)).flatten();
    let put_nut =
        nut.map(|nut| (nut, at(jig.pocket, jig.pocket_floor_m + spec.part.nut_height_m / 2.0)));
    let put_bolt = bolt.map(|bolt| (bolt, at(jig.hole, jig.hole_top_m)));
    if nut_first { put_nut.or(put_bolt) } else { put_bolt.or(put_nut) }
}
