//! The guide `docs/timing.md` as a program.
//!
//! `cargo run --example guide_timing`

use std::error::Error;

use symbolt::prelude::*;
use symbolt::study::statistics::Mean;
use symbolt::task::planner::Timing;

fn tea() -> Result<Domain, TaskError> {
    DomainBuilder::new()
        .action("BOIL_WATER", ["KETTLE_FULL"], ["WATER_HOT"])
        .action("BREW_TEA", ["WATER_HOT", "LEAVES_IN_POT"], ["TEA_READY"])
        .build()
}

fn milestones() -> Result<(), TaskError> {
    let domain = tea()?;
    let planner = Planner::new(&domain, PlannerSpec::default(), Seed::new(1))?;
    let world = domain.world(["KETTLE_FULL", "LEAVES_IN_POT"])?;
    let decision = planner.decide(&world, domain.state("TEA_READY")?)?;
    for m in &decision.milestones {
        let stage = m.stage.to_string();
        println!("{} {stage:<13} {:<9} {:>3.0} ms", m.question, m.subject, m.time_ms);
    }
    Ok(())
}

fn whole_plan() -> Result<(), TaskError> {
    let domain = tea()?;
    let planner = Planner::new(&domain, PlannerSpec::default(), Seed::new(1))?;
    let counts = domain.counts(["KETTLE_FULL", "LEAVES_IN_POT"])?;
    let plan = planner.plan(&counts, domain.state("TEA_READY")?)?;
    for step in &plan.steps {
        println!("{}: {} ms", domain[step.action].name, step.decision.time_ms);
    }
    let last_ms = plan.last.map(|decision| decision.time_ms);
    println!("{:?}: {} ms", plan.end, last_ms.unwrap_or_default());
    Ok(())
}

fn quicker() -> Result<(), TaskError> {
    let domain = tea()?;
    let ms = SimDuration::from_millis;
    let timing = Timing { load: ms(30), settle: ms(45), hold: ms(5), ..Timing::default() };
    let quick = PlannerSpec { timing, synapse: ms(2), ..PlannerSpec::default() };
    let world = domain.world(["KETTLE_FULL", "LEAVES_IN_POT"])?;
    for (name, spec) in [("default", PlannerSpec::default()), ("quick", quick)] {
        let planner = Planner::new(&domain, spec, Seed::new(1))?;
        let decision = planner.decide(&world, domain.state("TEA_READY")?)?;
        println!("{name}: {} ms", decision.time_ms);
    }
    Ok(())
}

fn over_seeds() -> Result<(), TaskError> {
    let domain = tea()?;
    let lif = PopulationPlan::lif();
    let world = domain.world(["KETTLE_FULL", "LEAVES_IN_POT"])?;
    let mut times_ms = Vec::new();
    for seed in 1..=3 {
        let planner = Planner::with_plan(&domain, PlannerSpec::default(), &lif, Seed::new(seed))?;
        times_ms.push(planner.decide(&world, domain.state("TEA_READY")?)?.time_ms);
    }
    let mean = Mean::of(times_ms.iter().copied());
    let [low, high] = mean.interval95();
    println!(
        "spiking: {:.0} ms, SD {:.0} ms, 95% interval {low:.0} to {high:.0} ms",
        mean.mean, mean.sd
    );
    Ok(())
}

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    milestones()?;
    whole_plan()?;
    quicker()?;
    over_seeds()?;
    Ok(())
}
