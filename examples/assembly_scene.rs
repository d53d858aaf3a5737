//! The guide `docs/scene.md` as a program.
//!
//! `cargo run --release --example assembly_scene`

use std::error::Error;

use symbolt::prelude::*;
use symbolt::task::demonstrate;
use symbolt::task::execute::{EpisodeSpec, episode};
use symbolt::task::tasks::nuts_and_bolts::NutsAndBolts;

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    let mut task = NutsAndBolts::default();
    task.jig.hole = [0.58, -0.16];
    task.part.friction = 0.3;
    task.check()?;

    let shown = demonstrate(&task, 1, Seed::new(1))?;
    let domain = learn(&shown.recording, &Default::default())?.domain;
    let planner = PlannerBuild::new(PlannerKind::GoalSets, &Population::Direct, Seed::new(1))?;

    let spec = EpisodeSpec::of(task);
    let report = episode(&domain, &planner, &spec, Seed::new(2))?.report;
    for (action, outcome) in report.attempts() {
        println!("{action}: {outcome}");
    }
    println!("solved: {}", report.solved);

    let mut far = NutsAndBolts::default();
    far.jig.pocket = [0.9, 0.0];
    if let Err(error) = far.check() {
        println!("refused: {error}");
    }
    Ok(())
}
