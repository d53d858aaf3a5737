//! Runs the plan of `two_step_plan` in direct mode and in spiking neurons: same graph, same steps.
//!
//! `cargo run --release --example same_plan_spiking`

use std::error::Error;

use symbolt::prelude::*;
use symbolt::task::ActionId;
use symbolt::task::planner::PlanEnd;

/// A plan: its actions, each with the simulated ms of its decision.
pub type Steps = Vec<(String, f64)>;

/// Returns the plan in direct mode and in leaky integrate-and-fire neurons.
pub fn run() -> Result<[Steps; 2], Box<dyn Error>> {
    let domain = DomainBuilder::new()
        .action("BOIL_WATER", ["KETTLE_FULL"], ["WATER_HOT"])
        .action("BREW_TEA", ["WATER_HOT", "LEAVES_IN_POT"], ["TEA_READY"])
        .build()?;
    let scene = domain.counts(["KETTLE_FULL", "LEAVES_IN_POT"])?;

    // The two plans differ only in the population of each layer.
    let plan_in = |population: Population| -> Result<Steps, Box<dyn Error>> {
        let plan = PopulationPlan::all(population);
        let planner = Planner::with_plan(&domain, PlannerSpec::default(), &plan, Seed::new(1))?;
        let plan = planner.plan(&scene, domain.state("TEA_READY")?)?;
        assert_eq!(plan.end, PlanEnd::Met);
        let name = |action: ActionId| domain[action].name.clone();
        Ok(plan.steps.iter().map(|s| (name(s.action), s.decision.time_ms)).collect())
    };
    Ok([plan_in(Population::Direct)?, plan_in(Population::Lif(LifSpec::default()))?])
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    let [direct, spiking] = run()?;
    println!("{:<10}  direct mode  spiking neurons", "decided");
    for ((action, direct), (_, spiking)) in direct.iter().zip(&spiking) {
        println!("{action:<10}  {direct:>8.0} ms  {spiking:>12.0} ms");
    }
    Ok(())
}
