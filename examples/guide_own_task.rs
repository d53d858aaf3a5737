//! The guide `docs/own_task.md` as a program.
//!
//! `cargo run --example guide_own_task`

use std::error::Error;
use std::fmt::Write as _;
use std::fs;

use symbolt::prelude::*;
use symbolt::task::import::{Mapping, Streams};
use symbolt::task::learn::Settings;

/// Noise of a camera: a number that is about normal, with standard deviation 1, from a generator of whole numbers.
fn noise(state: &mut u64) -> f64 {
    let mut uniform = || {
        *state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (*state >> 11) as f64 / (1u64 << 53) as f64
    };
    (0..12).map(|_| uniform()).sum::<f64>() - 6.0
}

/// Where something is that goes from `from` to `to` from time `start` on, above what lies between, in metres.
fn carried(t: f64, start: f64, from: [f64; 3], to: [f64; 3]) -> [f64; 3] {
    let smooth = |begin: f64, lasts: f64| {
        let u = ((t - start - begin) / lasts).clamp(0.0, 1.0);
        u * u * (3.0 - 2.0 * u)
    };
    let (up, across, down) = (smooth(0.0, 1.0), smooth(1.0, 1.5), smooth(2.5, 1.0));
    let top = from[2].max(to[2]) + 0.1;
    let at = |axis: usize| from[axis] + (to[axis] - from[axis]) * across;
    [at(0), at(1), from[2] + (top - from[2]) * up + (to[2] - top) * down]
}

/// A log of four takes: a box is put on a stand, then a lid on the box. Cameras see the parts at 30 Hz, in millimetres,
/// with half a millimetre of noise; the gripper logs its width.
fn log() -> String {
    let mut text = String::from("take,time_s,body,x_mm,y_mm,z_mm,gripper_mm\n");
    let mut state = 1;
    for take in 0..4 {
        let k = f64::from(take);
        let (found, lid) =
            ([0.2 + 0.05 * k, 0.3 - 0.04 * k * k, 0.05], [0.1 + 0.03 * k, -0.3 + 0.07 * k, 0.01]);
        let (stood, covered) = ([0.5, 0.0, 0.15], [0.5, 0.0, 0.21]);
        for frame in 0..450 {
            let t = f64::from(frame) / 30.0;
            let boxed = carried(t, 2.0, found, stood);
            let lid = carried(t, 9.0, lid, covered);
            // The gripper closes before each carry and opens behind it.
            let closed = [2.0, 9.0].map(|start| {
                ((t - start + 0.4) / 0.4).clamp(0.0, 1.0)
                    - ((t - start - 3.5) / 0.4).clamp(0.0, 1.0)
            });
            let width = 80.0 - 50.0 * closed.iter().sum::<f64>();
            for (body, at) in [("box_1", boxed), ("lid_1", lid), ("stand_1", [0.5, 0.0, 0.1])] {
                // Now and then a part is not seen.
                if noise(&mut state) > 2.0 {
                    continue;
                }
                let [x, y, z] = at.map(|m| m * 1e3 + 0.5 * noise(&mut state));
                let width = width + 0.1 * noise(&mut state);
                let _ = writeln!(text, "{take},{t:.3},{body},{x:.2},{y:.2},{z:.2},{width:.1}");
            }
        }
    }
    text
}

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    let text = log();
    fs::write("packing.csv", &text)?;
    let mut streams = Streams::new(Mapping::unknown());
    streams.add_csv("packing.csv", text.as_bytes())?;
    let imported = streams.finish()?.import();
    for moment in imported.moments.iter().filter(|moment| moment.session == 0) {
        println!("{:5.2} s {:?} {}", moment.t, moment.event, moment.object);
    }

    let learned = learn(&imported.recording, &Settings::default())?;
    for state in &learned.domain.states {
        println!("state  {} in the frame of the {}", state.name, state.frame.name());
    }
    for action in &learned.domain.operators {
        for need in &action.needs {
            let condition = learned.domain.need_in_words(action, need);
            println!("action {}: {condition}, {}", action.name, need.verdict.name());
        }
    }
    let (failed, unexplained) = (learned.report.failed(), learned.report.unexplained.len());
    println!("{failed} attempts failed, {unexplained} groups of poses are in no state");

    let renames = [("LID_AT_STAND", "BOX_CLOSED"), ("PUT_LID_AT_STAND", "CLOSE_BOX")];
    let renames = renames.map(|(old, new)| (old.to_owned(), new.to_owned()));
    let domain = learned.domain.rename(&renames)?;

    // A scene that was not demonstrated: which state is each object in?
    let object = |id: &str, kind: &str, at: [f64; 3]| {
        format!(r#"{{"id":"{id}","kind":"{kind}","position":{at:?},"orientation":[0,0,0,1]}}"#)
    };
    let objects = [
        object("b", "box", [0.33, 0.21, 0.05]),
        object("l", "lid", [0.17, -0.13, 0.01]),
        object("s", "stand", [0.5, 0.0, 0.1]),
    ];
    let scene = format!(r#"{{"objects":[{}]}}"#, objects.join(","));
    fs::write("scene.json", &scene)?;
    let scene = Snapshot::parse(scene.as_bytes(), "scene.json")?;
    let layout = Classifier::new(&domain).classify(&scene);
    for (object, located) in layout.objects.iter().zip(&layout.located) {
        let state = located.fact.map(|fact| domain.states[fact.state].name.as_str());
        println!("object {} is in {}", object.id, state.unwrap_or("no state"));
    }

    // The whole plan, decided by spiking neurons.
    let goal = vec![domain.goal("BOX_CLOSED")?];
    let problem = Problem::with_goals(&domain, &layout, goal)?;
    let planner = PlannerBuild::new(PlannerKind::GoalSets, &"lif".parse()?, Seed::new(1))?;
    let plan = planner.plan(&problem, &layout, PlannerBuild::LIMIT)?;
    for step in &plan.moves {
        let [x, y, z] = step.target.pose.position;
        println!("move   {} with {}, to ({x:.2}, {y:.2}, {z:.2})", step.action, step.object);
    }
    println!("end    {:?}", plan.end);
    Ok(())
}
