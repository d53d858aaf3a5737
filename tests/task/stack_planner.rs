//! The planner of 2016, rebuilt: its size, what is not made of neurons, a plan of two actions, and parts without which it fails.

#![allow(clippy::expect_used)]

use std::collections::BTreeSet;

use symbolt::neurons::{LifSpec, Population, Tuning};
use symbolt::prelude::*;
use symbolt::study::stack_planner::{Kitchen, Part, StackCourse, StackPlanner, StackSpec};

fn built(kitchen: &Kitchen, spec: &StackSpec, seed: u64) -> StackPlanner {
    StackPlanner::new(kitchen, spec, Seed::new(seed)).expect("a planner")
}

/// The original in spiking neurons.
fn original() -> StackSpec {
    let limit = SimDuration::from_millis(1_500);
    StackSpec { limit, ..StackSpec::default() }
}

/// Runs the original without a part until its first plan is made and it has begun to act.
fn first_plan(kitchen: &Kitchen, without: Part, seed: u64) -> StackCourse {
    let limit = SimDuration::from_millis(800);
    let spec = StackSpec { without: Some(without), limit, ..original() };
    built(kitchen, &spec, seed).run().expect("a run")
}

#[test]
fn it_has_the_neurons_of_the_original_and_plans_two_actions() {
    let kitchen = Kitchen::kettle(2).expect("two actions");
    let planner = built(&kitchen, &original(), 1);
    let published = 341_380.0;
    let neurons = planner.neurons() as f64;
    assert!((neurons - published).abs() < 0.01 * published, "{neurons}");

    let course = planner.run().expect("a run");
    assert!(course.reached, "{course:?}");
    let done: Vec<&str> =
        course.begun.iter().filter(|b| b.done).map(|b| kitchen.names()[b.operator]).collect();
    assert_eq!(done.first(), Some(&"PLUG_IN_KETTLE"));
    assert_eq!(done.last(), Some(&"BOIL_KETTLE"));
    assert!(course.episodes >= 1);
    // The first plan counts up to the first action that is not next.
    assert!(course.stacked <= 2 && course.first <= course.begun.len());
    let in_order =
        course.begun.iter().zip([3, 4]).take_while(|(b, next)| b.done && b.operator == *next);
    assert!(course.first <= in_order.count(), "{course:?}");
    // Planning two actions takes some rules, and the motor is locked for 100 ms.
    assert!((300..1_500).contains(&course.ms), "{course:?}");

    // Everything else in the graph is a layer of neurons or a weight between two of them.
    let graph = planner.graph();
    let spiking: BTreeSet<&str> = graph.event_sources().map(|(path, _)| path).collect();
    let alone: BTreeSet<&str> =
        graph.paths().filter(|path| !path.contains('/') && !spiking.contains(path)).collect();
    assert_eq!(alone, BTreeSet::from(["begin", "goal", "here", "kitchen", "one"]));
}

#[test]
fn without_its_sensor_it_acts_before_it_has_a_plan() {
    let kitchen = Kitchen::kettle(2).expect("two actions");
    let course = first_plan(&kitchen, Part::Sensor, 1);
    // The first action that is pushed is the last of the plan.
    let first = course.begun.first().expect("an action");
    assert_eq!((kitchen.names()[first.operator], first.met), ("BOIL_KETTLE", false));
}

#[test]
fn without_the_shift_its_stack_holds_no_order() {
    let kitchen = Kitchen::kettle(2).expect("two actions");
    // With it both actions lie in order for each of three seeds.
    let courses = [1, 2, 3].map(|seed| first_plan(&kitchen, Part::Index, seed));
    let disordered = courses.iter().filter(|course| course.episodes >= 1 && course.stacked < 2);
    assert!(disordered.count() >= 2, "{courses:?}");
}

#[test]
fn in_direct_mode_no_push_leaks_and_it_begins_with_the_wrong_action() {
    let kitchen = Kitchen::kettle(2).expect("two actions");
    let spec = StackSpec { population: Population::Direct, ..original() };
    let course = built(&kitchen, &spec, 1).run().expect("a run");
    let first = course.begun.first().expect("an action");
    assert_eq!(kitchen.names()[first.operator], "BOIL_KETTLE", "{course:?}");
    assert_eq!((course.first, course.stacked), (0, 0), "{course:?}");
}

#[test]
fn one_graph_runs_in_every_mode() {
    let kitchen = Kitchen::chain(2).expect("two actions");
    let limit = SimDuration::from_millis(300);
    let rate = Population::Rate(LifSpec::tuned(Tuning { scale: 0.2, ..Tuning::default() }));
    for population in [Population::Direct, rate] {
        let spec = StackSpec {
            dimensions: 64,
            population: population.clone(),
            limit,
            ..StackSpec::default()
        };
        let planner = built(&kitchen, &spec, 1);
        assert_eq!(planner.neurons() == 0, population == Population::Direct);
        let course = planner.run().expect("a run");
        assert_eq!((course.ms, course.reached), (300, false));
    }
}

#[test]
fn kitchens_have_a_least_and_a_greatest_number_of_actions() {
    for refused in [Kitchen::kettle(1), Kitchen::kettle(6), Kitchen::chain(1), Kitchen::chain(13)] {
        assert!(refused.is_err());
    }
    assert_eq!(Kitchen::chain(8).expect("eight actions").steps(), 8);
}
