//! The guide `docs/own_task.md` as a program.
//!
//! `cargo run --example guide_own_task`

use std::error::Error;
use std::fs;

use symbolt::prelude::*;
use symbolt::task::learn::Settings;

/// One snapshot with a box, a lid and a stand.
fn line(demo: usize, number: usize, event: &str, boxed: [f64; 3], lid: [f64; 3]) -> String {
    let object = |id: &str, kind: &str, at: [f64; 3]| {
        format!(r#"{{"id":"{id}","kind":"{kind}","position":{at:?},"orientation":[0,0,0,1]}}"#)
    };
    let stand = object("s", "stand", [0.5, 0.0, 0.1]);
    let objects = [object("b", "box", boxed), object("l", "lid", lid), stand].join(",");
    format!(r#"{{"demo":{demo},"snapshot":{number},{event}"objects":[{objects}]}}"#)
}

fn record() -> String {
    let mut text = String::new();
    for demo in 0..4 {
        let k = demo as f64;
        // Parts lie anywhere on the table, and on the stand within a fraction of a millimetre.
        let found = [0.2 + 0.05 * k, 0.3 - 0.04 * k * k, 0.05];
        let lid = [0.1 + 0.03 * k, -0.3 + 0.07 * k, 0.01];
        let (stood, covered) = ([0.5, 0.0001 * k, 0.15], [0.5 - 0.0001 * k, 0.0, 0.21]);
        let steps = [
            (r#""event":"start","#, found, lid),
            (r#""event":"contact","object":"b","#, found, lid),
            (r#""event":"release","object":"b","#, stood, lid),
            (r#""event":"contact","object":"l","#, stood, lid),
            (r#""event":"release","object":"l","#, stood, covered),
            (r#""event":"end","#, stood, covered),
        ];
        for (number, (event, boxed, lid)) in steps.into_iter().enumerate() {
            text += &line(demo, number, event, boxed, lid);
            text.push('\n');
        }
    }
    text
}

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    let text = record();
    fs::write("packing.jsonl", &text)?;
    let (recording, _labels) = Recording::parse(text.as_bytes(), "packing.jsonl")?;
    let learned = learn(&recording, &Settings::default())?;
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
    let scene = line(0, 0, "", [0.33, 0.21, 0.05], [0.17, -0.13, 0.01]);
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
        println!("move   {} with {}, to ({x:.3}, {y:.3}, {z:.3})", step.action, step.object);
    }
    println!("end    {:?}", plan.end);
    Ok(())
}
