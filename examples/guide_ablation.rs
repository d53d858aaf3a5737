//! The guide `docs/ablation.md` as a program.
//!
//! `cargo run --example guide_ablation`

use std::error::Error;
use std::path::Path;

use serde_json::json;
use symbolt::files::ResultFolder;
use symbolt::prelude::*;
use symbolt::study::experiment::{
    About, Cell, Experiment, Measure, Reading, Run, Shard, TrialOutcome, outcome,
};
use symbolt::task::event::Ignore;
use symbolt::task::planner::Part;
use symbolt::task::{WorldState, acceptable_answers};

fn tea() -> Result<Domain, TaskError> {
    DomainBuilder::new()
        .action("BOIL_WATER", ["KETTLE_FULL"], ["WATER_HOT"])
        .action("BREW_TEA", ["WATER_HOT", "LEAVES_IN_POT"], ["TEA_READY"])
        .build()
}

fn leave_out() -> Result<(), TaskError> {
    let domain = tea()?;
    let world = domain.world(["KETTLE_FULL", "LEAVES_IN_POT"])?;
    let goal = domain.state("TEA_READY")?;
    for (name, without) in [("whole planner", None), ("without gate", Some(Part::Gate))] {
        let spec = PlannerSpec { without, ..PlannerSpec::default() };
        let planner = Planner::new(&domain, spec, Seed::new(1))?;
        let shown = planner.first_shown(&world, goal, SimDuration::from_millis(400))?;
        if let Some((action, ms)) = shown {
            println!("{name}: {} after {ms} ms", domain[action].name);
        }
    }
    Ok(())
}

fn compute_otherwise() -> Result<(), Box<dyn Error>> {
    let domain = tea()?;
    let few = LifSpec::tuned(Tuning { per_item: 10, ..Tuning::default() });
    let plan = PopulationPlan::lif()
        .with("planner/required/**".parse()?, Population::Lif(few))
        .with("planner/motor_gate/**".parse()?, Population::Direct);
    let planner = Planner::with_plan(&domain, PlannerSpec::default(), &plan, Seed::new(1))?;
    // The names that a pattern can match.
    for path in planner.graph().paths().filter(|path| path.starts_with("planner/motor_gate")) {
        println!("{path}");
    }
    let world = domain.world(["KETTLE_FULL", "LEAVES_IN_POT"])?;
    let decision = planner.decide(&world, domain.state("TEA_READY")?)?;
    if let Verdict::Act(action) = decision.verdict {
        println!("decided: {}", domain[action].name);
    }

    let plan = PopulationPlan::direct().with("planner/requird/**".parse()?, Population::Direct);
    if let Err(error) = Planner::with_plan(&domain, PlannerSpec::default(), &plan, Seed::new(1)) {
        let message = error.to_string();
        // The rest of the message lists the paths that exist.
        println!("refused: {}", message.split(';').next().unwrap_or_default());
    }
    Ok(())
}

struct GateAblation;

impl Experiment for GateAblation {
    fn about(&self) -> About {
        About {
            name: "gate",
            question: "Is the first action at the motor output a right one?",
            revision: 1,
            settings: json!({"goal": "BOLT_ASSEMBLED"}),
        }
    }

    fn cells(&self) -> Vec<Cell> {
        let first = || Reading::new(Measure::Rate, json!({"first action": "accepted"}));
        vec![
            Cell::new(json!({"gate": "in"}), 40, vec![first()]),
            Cell::new(json!({"gate": "out"}), 40, vec![first()]),
        ]
    }

    fn trial(&self, cell: &Cell, seed: Seed) -> Result<TrialOutcome, TaskError> {
        let domain = DomainBuilder::of_the_paper().build()?;
        let without = cell.choice("gate", &[("in", None), ("out", Some(Part::Gate))])?;
        let spec = PlannerSpec { without, ..PlannerSpec::default() };
        let planner = Planner::new(&domain, spec, seed)?;
        // A random world: each state holds with probability one half.
        let bits = seed.derive("", "world").value();
        let world: WorldState = (0..domain.states().len()).map(|s| bits >> s & 1 == 1).collect();
        // The answers that the symbolic reference planner accepts.
        let goal = domain.state("BOLT_ASSEMBLED")?;
        let right = acceptable_answers(&domain, &world, goal, spec.rules());

        let shown = planner.first_shown(&world, goal, SimDuration::from_millis(400))?;
        let accepted = match shown {
            Some((action, _)) => right.actions.contains(&action),
            None => right.actions.is_empty(),
        };
        // A trial returns one number for each reading of its cell, eight at most.
        Ok(outcome([f64::from(u8::from(accepted))]))
    }
}

fn count() -> Result<(), TaskError> {
    // For the journal and the results. No other run can open the folder meanwhile.
    let folder = ResultFolder::open(Path::new("gate-ablation"))?;
    let run = Run::new(&GateAblation, Seed::new(1), Shard::default(), folder);
    // Only one shard of several gives no results.
    let Some(results) = run.go(&mut Ignore)? else { return Ok(()) };
    for row in &results.rows {
        let [low, high] = row.statistic.interval95().map(|share| 100.0 * share);
        let (gate, share) = (&row.settings["gate"], 100.0 * row.statistic.value());
        println!("gate {gate}: {share:.0}% accepted, 95% interval {low:.0} to {high:.0}%");
    }
    Ok(())
}

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    leave_out()?;
    compute_otherwise()?;
    count()?;
    Ok(())
}
