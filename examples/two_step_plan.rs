//! Plans in a domain that is written in code.
//!
//! `cargo run --example two_step_plan`

use std::error::Error;

use symbolt::prelude::*;
use symbolt::task::ActionId;
use symbolt::task::planner::PlanEnd;

/// Returns the plan's actions, each with the simulated ms of its decision.
pub fn run() -> Result<Vec<(String, f64)>, Box<dyn Error>> {
    let domain = DomainBuilder::new()
        .action("BOIL_WATER", ["KETTLE_FULL"], ["WATER_HOT"])
        .action("BREW_TEA", ["WATER_HOT", "LEAVES_IN_POT"], ["TEA_READY"])
        .build()?;
    let planner = Planner::new(&domain, PlannerSpec::default(), Seed::new(1))?;

    // One kettle, one pot.
    let scene = domain.counts(["KETTLE_FULL", "LEAVES_IN_POT"])?;
    let plan = planner.plan(&scene, domain.state("TEA_READY")?)?;
    assert_eq!(plan.end, PlanEnd::Met);
    let name = |action: ActionId| domain[action].name.clone();
    Ok(plan.steps.iter().map(|s| (name(s.action), s.decision.time_ms)).collect())
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    for (action, ms) in run()? {
        println!("{action:<10} decided in {ms:.0} simulated ms");
    }
    Ok(())
}
