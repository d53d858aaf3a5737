//! Lets the planner of goal sets boil water in its world, in spikes, and shows when it commands each action.
//!
//! `cargo run --example plan_tea`

use std::error::Error;

use symbolt::plan::goal_sets::{
    Directions, PlannerGraph, Regression, StripsWorld, populations, slots,
};
use symbolt::plan::strips::{Bodies, Domain, Grounded, Problem};
use symbolt::prelude::*;
use symbolt::sim::{InputSpec, OutputSpec, WorldLink};

const DOMAIN: &str = include_str!("kitchen.pddl");
const PROBLEM: &str = include_str!("tea.pddl");

/// Returns the command of each action over 1.4 s.
pub fn run() -> Result<TimeSeries, Box<dyn Error>> {
    let domain = Domain::parse(DOMAIN.as_bytes(), "kitchen.pddl", Bodies::Read)?;
    let problem = Problem::parse(PROBLEM.as_bytes(), "tea.pddl", &domain)?;
    let problem = Grounded::new(&domain, &problem)?;
    let (fluents, operators) = (problem.fluents.len(), problem.operators.len());

    let mut graph = GraphBuilder::new();
    let rules = Regression::new(&problem).into();
    let planner = PlannerGraph::new(&problem, rules, Directions::Both, slots(fluents));
    let planner = graph.add("planner", planner);
    let link = WorldLink::new()
        .sense("holds", OutputSpec::vector(fluents))
        .command("actions", InputSpec::vector(operators));
    let world = graph.world("kitchen", link);
    graph.connect(&world.output::<Vector>("holds"), &planner.holds, Synapse::None);
    graph.connect(&planner.actions, &world.input::<Vector>("actions"), Synapse::None);
    let goal: Vec<f32> =
        (0..fluents).map(|fluent| f32::from(problem.goal.contains(&fluent))).collect();
    let given = [
        ("ready", vec![1.0], &planner.ready),
        ("busy", vec![0.0], &planner.busy),
        ("goal", goal, &planner.goal),
    ];
    for (name, values, input) in given {
        let constant = graph.add(name, Constant::vector(&values));
        graph.connect(&constant, input, Synapse::None);
    }
    let probe =
        graph.probe(&planner.actions, ProbeSpec::default().filtered(Synapse::lowpass_ms(5)));

    let plan = populations(&Population::Lif(LifSpec::default()))?;
    let graph = graph.build(Timebase::default(), &plan, Seed::new(1))?;
    let kitchen = StripsWorld::new(&problem, SimDuration::from_millis(100));
    let config = RunConfig::seeded(Seed::new(1)).in_world(kitchen);
    let mut sim = Simulator::new(graph.into(), config)?;
    sim.run_for(SimDuration::from_millis(1400))?;
    let names = problem.operators.iter().map(|operator| operator.name.trim_matches(['(', ')']));
    Ok(sim.samples(&probe).series(names))
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    let commands = run()?;
    for (s, action) in commands.switches(0.4) {
        println!("{:4.0} ms  {action}", 1e3 * s);
    }
    Ok(())
}
