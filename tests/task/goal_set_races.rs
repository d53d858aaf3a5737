//! The race of the planner of goal sets: how ties are broken, and how operators of little worth win.

#![allow(clippy::expect_used)]

use std::sync::Arc;

use symbolt::neurons::{LifSpec, Population};
use symbolt::plan::goal_sets::{
    Directions, GoalSetGraph, GoalSetSpec, Regression, StripsWorld, phase_names, populations,
    pursue,
};
use symbolt::plan::strips::{Bodies, Domain, Grounded, Problem};
use symbolt::prelude::*;

fn grounded(domain: &str, problem: &str) -> Grounded {
    let domain = Domain::parse(domain.as_bytes(), "domain", Bodies::Read).expect("a domain");
    let problem = Problem::parse(problem.as_bytes(), "problem", &domain).expect("a problem");
    Grounded::new(&domain, &problem).expect("a small problem")
}

/// Returns how many winners there are when the first goal set is written, in spikes.
///
/// Nine operators achieve the goal, and each is worth the same.
fn winners_of_a_tie(seed: u64) -> usize {
    let operators: String = (0..9)
        .map(|a| format!("(:action a{a} :parameters () :precondition (p) :effect (g))"))
        .collect();
    let domain = format!("(define (domain twins) (:predicates (p) (g)) {operators})");
    let problem = "(define (problem p) (:domain twins) (:init (p)) (:goal (g)))";
    let problem = grounded(&domain, problem);
    let mut graph = GraphBuilder::new();
    let rules = Arc::new(Regression::new(&problem));
    let planner = graph.add("planner", GoalSetGraph::new(rules, 4));
    let row = |facts: &[usize]| -> Vec<f32> {
        (0..problem.fluents.len()).map(|f| if facts.contains(&f) { 1.0 } else { 0.0 }).collect()
    };
    let ready = graph.add("ready", Constant::vector(&[1.0]));
    let busy = graph.add("busy", Constant::vector(&[0.0]));
    let holds = graph.add("holds", Constant::vector(&row(&problem.start)));
    let goal = graph.add("goal", Constant::vector(&row(&problem.goal)));
    graph.connect(&ready, &planner.ready, Synapse::None);
    graph.connect(&busy, &planner.busy, Synapse::None);
    graph.connect(&holds, &planner.holds, Synapse::None);
    graph.connect(&goal, &planner.goal, Synapse::None);
    let phases = graph.probe(&planner.phases, ProbeSpec::default());
    let winner = graph.probe(&planner.winner, ProbeSpec::default());
    let plan = populations(&Population::Lif(LifSpec::default())).expect("patterns");
    let seed = Seed::new(seed);
    let graph = graph.build(Timebase::default(), &plan, seed).expect("a graph");
    let mut sim = Simulator::new(graph.into(), RunConfig::seeded(seed)).expect("a run");
    sim.run_for(SimDuration::from_millis(400)).expect("time");
    let write = phase_names().iter().position(|name| name == "Write").expect("the phase");
    let both = sim.samples(&phases).iter().zip(sim.samples(&winner).iter());
    let written = both.map(|((_, phase), (_, won))| (phase[write], won));
    let (_, won) = written.into_iter().find(|(phase, _)| *phase > 0.5).expect("a goal set");
    won.iter().filter(|activity| **activity > 0.25).count()
}

#[test]
fn of_equal_operators_one_wins() {
    for seed in 1..=8 {
        assert_eq!(winners_of_a_tie(seed), 1, "seed {seed}");
    }
}

/// The cheap way to the goal destroys another goal for good. The other way needs twelve steps, so it is worth ten levels of
/// cost less than nothing.
#[test]
fn an_operator_that_costs_much_is_taken_if_no_other_is_left() {
    let steps = 12;
    let facts: String = (0..=steps).map(|k| format!("(q{k})")).collect();
    let chain: String = (1..=steps)
        .map(|k| format!("(:action q{k} :parameters () :precondition (q{}) :effect (q{k}))", k - 1))
        .collect();
    let domain = format!(
        "(define (domain detour) (:predicates (g) (h) {facts}) {chain}
        (:action cheap :parameters () :precondition (q0) :effect (and (g) (not (h))))
        (:action dear :parameters () :precondition (q{steps}) :effect (g)))"
    );
    let problem = "(define (problem p) (:domain detour) (:init (q0) (h)) (:goal (and (g) (h))))";
    let problem = grounded(&domain, problem);
    for population in [Population::Direct, Population::Lif(LifSpec::default())] {
        let world = StripsWorld::new(&problem, SimDuration::from_millis(100));
        let spec = GoalSetSpec {
            slots: Some(20),
            population,
            directions: Directions::Backward,
            ..GoalSetSpec::default()
        };
        let course = pursue(&problem, world, &spec, Seed::new(1)).expect("a run");
        assert!(course.reached, "{course:?}");
        assert_eq!((course.plan().count(), course.dead_ends(), course.starts()), (steps + 1, 0, 1));
    }
}
