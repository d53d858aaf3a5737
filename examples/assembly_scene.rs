//! The scene in physics: the task is shown once, learned, and done by the robot in another scene.
//!
//! `cargo run --release --example assembly_scene`

use std::error::Error;
use std::sync::Arc;

use symbolt::sim::Seed;
use symbolt::task::event::EpisodeReport;
use symbolt::task::execute::{EpisodeSpec, episode};
use symbolt::task::learn::{Settings, learn};
use symbolt::task::planner::{Planner, PlannerSpec};
use symbolt::task::tasks::nuts_and_bolts::NutsAndBolts;
use symbolt::task::{Grounding, demonstrate};

/// What happened in the robot's own episode.
pub fn run() -> Result<EpisodeReport, Box<dyn Error>> {
    let task = NutsAndBolts::default();
    let shown = demonstrate(&task, 1, Seed::new(1))?;
    let domain = learn(&shown.recording, &Settings::default())?.domain;

    // The goal is what the last action of the demonstration brought about.
    let goal = domain.goal().ok_or("nothing was brought about")?;
    let planner = Arc::new(Planner::new(&domain, PlannerSpec::default(), Seed::new(1))?);
    let spec = EpisodeSpec::of(task);
    Ok(episode(&planner, Grounding::default(), goal, &spec, Seed::new(2))?.report)
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    let report = run()?;
    for (action, outcome) in report.attempts() {
        println!("{action:<24} {outcome}");
    }
    println!("assembled: {}, after {:.1} simulated s", report.solved, report.simulated_s);
    Ok(())
}
