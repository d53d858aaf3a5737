//! Every module of the planners' graphs has a name for people, so that no page shows one of the engine's.

use std::collections::BTreeSet;
use std::sync::Arc;

use symbolt::neurons::PopulationPlan;
use symbolt::plan::goal_sets::{Directions, PlannerGraph, Regression};
use symbolt::plan::strips::{Bodies, Domain, Grounded, Problem};
use symbolt::prelude::*;
use symbolt::sim::GraphOutline;
use symbolt::task::planner::{Decider, GoalSetPlanner, Planner, PlannerSpec, Unbinding};
use symbolt::task::{DomainBuilder, Rules};

/// Blocks on a table: an order of goals lets the search forward keep an agenda.
const BLOCKS: &str = "(define (domain blocks) (:predicates (on ?a ?b) (clear ?a) (floor ?a))
    (:action lift :parameters (?a ?b) :precondition (and (on ?a ?b) (clear ?a))
        :effect (and (floor ?a) (clear ?b) (not (on ?a ?b))))
    (:action put :parameters (?a ?b) :precondition (and (floor ?a) (clear ?a) (clear ?b))
        :effect (and (on ?a ?b) (not (floor ?a)) (not (clear ?b)))))";
const TOWER: &str = "(define (problem tower) (:domain blocks) (:objects a b c)
    (:init (on a b) (floor b) (floor c) (clear a) (clear c)) (:goal (and (on a b) (on b c))))";

/// Returns the parts inside modules that the pages name alike for all graphs.
fn parts() -> BTreeSet<String> {
    let code = include_str!("../../assets/graph/names.js");
    let (_, list) = code.split_once("const PARTS = {\n").expect("a list");
    let (list, _) = list.split_once("};").expect("its end");
    list.lines().filter_map(|line| Some(line.split_once(':')?.0.trim().to_owned())).collect()
}

/// Returns the modules and nodes without a name for people.
fn unnamed(outline: &GraphOutline, parts: &BTreeSet<String>) -> BTreeSet<String> {
    let mut unnamed = BTreeSet::new();
    for node in &outline.nodes {
        let ends = node.path.match_indices('/').map(|(at, _)| at).chain([node.path.len()]);
        for path in ends.map(|end| &node.path[..end]) {
            let last = path.rsplit('/').next().unwrap_or_default();
            // What carries an expression to a module goes by the module's name.
            let carries = last.strip_prefix("to.").is_some_and(|to| {
                let ends = to.match_indices('.').map(|(at, _)| at);
                ends.skip(1).any(|end| outline.notes.contains_key(&to[..end].replace('.', "/")))
            });
            if !(outline.notes.contains_key(path) || parts.contains(last) || carries) {
                unnamed.insert(path.to_owned());
            }
        }
    }
    unnamed
}

fn both_searches() -> GraphOutline {
    let domain = Domain::parse(BLOCKS.as_bytes(), "domain", Bodies::Read).expect("a domain");
    let problem = Problem::parse(TOWER.as_bytes(), "problem", &domain).expect("a problem");
    let grounded = Grounded::new(&domain, &problem).expect("a small problem");
    let rules = Arc::new(Regression::new(&grounded));
    let mut graph = GraphBuilder::new();
    let planner = PlannerGraph::new(&grounded, rules, Directions::Both, [9, 9]);
    let ports = graph.add("planner", planner);
    graph.describe("planner", "planner", "Searches backward and forward.");
    for (name, input, width) in [
        ("ready", &ports.ready, 1),
        ("busy", &ports.busy, 1),
        ("holds", &ports.holds, grounded.fluents.len()),
        ("goal", &ports.goal, grounded.fluents.len()),
    ] {
        let zero = graph.add(name, Constant::vector(&vec![0.0; width]));
        graph.connect(&zero, input, Synapse::None);
        graph.describe(name, name, "An input.");
    }
    graph.start(&PopulationPlan::direct(), Seed::new(1)).expect("a graph").graph().outline()
}

#[test]
fn every_module_of_the_planners_has_a_name_for_people() {
    let domain = DomainBuilder::of_the_paper().build().expect("the paper's domain");
    // Two causes of one state, and a state that must be absent.
    let rich = DomainBuilder::new()
        .state("A")
        .state("B")
        .state("C")
        .action("MAKE_B", ["A"], ["B"])
        .action_unless("MAKE_C", ["B"], ["A"], ["C"])
        .action("MAKE_C_TOO", ["A"], ["C"])
        .build()
        .expect("a domain");
    let chain = |domain, spec| {
        let planner = Planner::new(domain, spec, Seed::new(1)).expect("a planner");
        planner.graph().outline()
    };
    let goal_sets = |domain| {
        let direct = PopulationPlan::direct();
        let rules = Rules { absent: true, ..Rules::default() };
        GoalSetPlanner::new(domain, rules, &[], &direct, Seed::new(1)).expect("a planner")
    };
    let products = PlannerSpec { unbinding: Unbinding::Products, ..PlannerSpec::default() };
    let absent = PlannerSpec { absent: true, ..PlannerSpec::default() };
    let graphs = [
        ("chain", chain(&domain, PlannerSpec::default())),
        ("chain with products", chain(&domain, products)),
        ("chain with alternatives", chain(&rich, absent)),
        ("goal sets", goal_sets(&rich).graph().outline()),
        ("both searches", both_searches()),
    ];
    let parts = parts();
    let mut missing: BTreeSet<String> = BTreeSet::new();
    let mut modules = 0;
    for (name, outline) in &graphs {
        modules += outline.nodes.len();
        missing.extend(unnamed(outline, &parts).into_iter().map(|path| format!("{name}: {path}")));
    }
    assert!(missing.is_empty(), "{missing:#?}");
    assert!(modules > 600, "{modules} nodes");
    // A module that nobody describes is found.
    let mut odd = graphs[3].1.clone();
    assert!(odd.notes.remove("planner/hindrance").is_some());
    assert_eq!(unnamed(&odd, &parts), BTreeSet::from(["planner/hindrance".to_owned()]));
}

#[test]
fn the_modules_that_pages_plot_go_by_these_names() {
    let domain = DomainBuilder::of_the_paper().build().expect("the paper's domain");
    let direct = PopulationPlan::direct();
    let goal_sets =
        GoalSetPlanner::new(&domain, Rules::default(), &[], &direct, Seed::new(1)).expect("builds");
    let chain = Planner::new(&domain, PlannerSpec::default(), Seed::new(1)).expect("builds");
    let said = |planner: &dyn Decider| -> Vec<String> {
        let modules = planner.modules().iter();
        modules.map(|module| format!("{}: {}", module.name, module.note.name)).collect()
    };
    assert_eq!(
        said(&goal_sets),
        [
            "phase: phase",
            "goal_set: goal set",
            "cost: cost of each fact",
            "utility: utility",
            "winner: winner",
            "slot: place in memory",
            "motor: action to do",
        ]
    );
    assert_eq!(
        said(&chain),
        [
            "goal_buffer: goal buffer",
            "cause: cause",
            "unbind: preconditions, unbound",
            "required: preconditions",
            "open: unmet preconditions",
            "chosen: precondition to examine",
            "motor_gate: motor gate",
            "motor: action to do",
        ]
    );
}
