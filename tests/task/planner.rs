//! Compares the planner graph with the reference planner.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::collections::BTreeSet;

use rand::RngExt;
use symbolt::sim::{Seed, SimError};
use symbolt::task::planner::{Decider, Planner, PlannerSpec, Unbinding};
use symbolt::task::tasks::nuts_and_bolts::{Order, SyntheticDemonstrations};
use symbolt::task::{
    ActionId, Commitment, Domain, DomainBuilder, Obstacle, StateId, TaskError, Verdict, WorldState,
    learn,
};

use crate::propositional::propositional;
use crate::tally::{Tally, check};

/// Returns the paper's domain (section II.E): two actions with one precondition each, and the assembly with two.
fn paper_domain() -> Domain {
    DomainBuilder::of_the_paper().build().expect("the paper's domain is sound")
}

/// Returns the start of the paper's task and its goal.
fn both_on_the_table(domain: &Domain) -> (WorldState, StateId) {
    let world = domain.world(["NUT_ON_TABLE", "BOLT_ON_TABLE"]).expect("states");
    (world, domain.state("BOLT_ASSEMBLED").expect("a state"))
}

/// Returns a domain learned from nut-first demonstrations, whose preconditions form a chain.
fn nut_first_domain() -> Domain {
    let synthetic =
        SyntheticDemonstrations { order: Order::NutFirst, ..SyntheticDemonstrations::default() };
    let recording = synthetic.record(Seed::new(1)).expect("the settings are valid").recording;
    let learned = learn::learn(&recording, &learn::Settings::paper());
    propositional(&learned.expect("it can be learned from").domain)
}

/// Checks that the reference planner accepts the answer for every goal in every world state.
fn agree_everywhere(domain: &Domain, planner: &Planner, tally: &mut Tally) {
    let states = domain.states().len();
    for bits in 0..1u32 << states {
        let world: WorldState = (0..states).map(|s| bits >> s & 1 == 1).collect();
        for goal in domain.state_ids() {
            check(domain, planner, &world, goal, tally);
        }
    }
}

#[test]
fn the_graph_agrees_with_the_reference_planner_on_the_papers_domain_over_20_seeds() {
    let domain = paper_domain();
    let mut tally = Tally::default();
    for seed in 0..20 {
        let planner =
            Planner::new(&domain, PlannerSpec::default(), Seed::new(seed)).expect("builds");
        agree_everywhere(&domain, &planner, &mut tally);
    }
    println!("paper's domain, 32 states x 5 goals x 20 seeds: {tally:?}");
    assert_eq!(tally.act + tally.met + tally.stuck, 32 * 5 * 20);
    // Counted by hand, for the 16 worlds in which the goal does not hold: each jig state can be reached in 8, the
    // assembly in 3 x 3 = 9, and states on the table in none.
    assert_eq!(
        tally,
        Tally { act: 20 * (8 + 8 + 9), met: 20 * 80, stuck: 20 * (16 + 16 + 8 + 8 + 7) }
    );
}

#[test]
fn the_graph_agrees_with_the_reference_planner_on_a_learned_domain_over_20_seeds() {
    let domain = nut_first_domain();
    assert_eq!((domain.states().len(), domain.operators().len()), (5, 3));
    let mut tally = Tally::default();
    for seed in 0..20 {
        let planner =
            Planner::new(&domain, PlannerSpec::default(), Seed::new(seed)).expect("builds");
        agree_everywhere(&domain, &planner, &mut tally);
    }
    println!("learned domain, 32 states x 5 goals x 20 seeds: {tally:?}");
    assert_eq!(tally.act + tally.met + tally.stuck, 32 * 5 * 20);
    assert!(tally.act > 0 && tally.stuck > 0);
}

/// Returns a random domain. In a chain, each action has the previous state as its precondition; in a tree, up to four
/// earlier states. With `circles`, some actions have a later state as a precondition.
fn generated_domain(seed: u64, states: usize, actions: usize, circles: bool) -> Domain {
    let mut rng = Seed::new(seed).derive("tests", "generated domain").rng();
    let name = |s: usize| format!("S{s}");
    let chain = seed.is_multiple_of(2);
    let mut domain = DomainBuilder::new();
    for state in 0..states {
        domain = domain.state(&name(state));
    }
    for state in states - actions..states {
        let mut needs = BTreeSet::new();
        let count = if chain { 1 } else { rng.random_range(0..=4) };
        for _ in 0..count {
            let upward = circles && rng.random::<f64>() < 0.15;
            let pool = match (upward, chain) {
                (true, _) => state..states,
                (false, true) => state - 1..state,
                (false, false) => 0..state,
            };
            needs.insert(rng.random_range(pool));
        }
        let needs: Vec<String> = needs.into_iter().map(name).collect();
        let action = format!("MAKE_S{state}");
        domain = domain.action(&action, needs.iter().map(String::as_str), [name(state).as_str()]);
    }
    domain.build().expect("a generated domain is sound")
}

#[test]
fn the_graph_agrees_with_the_reference_planner_on_generated_domains() {
    let mut tally = Tally::default();
    let mut longest = 0;
    let (mut chained, mut branching, mut circular) = (0, 0, 0);
    for seed in 0..48u64 {
        let states = [5, 12, 20, 30][seed as usize % 4];
        let domain = generated_domain(seed, states, states * 2 / 3, seed % 3 == 0);
        assert!(domain.states().len() <= 30 && domain.operators().len() <= 20);
        let spec = PlannerSpec { dimensions: 512, ..PlannerSpec::default() };
        let planner = Planner::new(&domain, spec, Seed::new(seed)).expect("builds");
        let mut rng = Seed::new(seed).derive("tests", "worlds").rng();
        for _ in 0..12 {
            let density: f64 = rng.random();
            let world: WorldState =
                (0..states).map(|_| rng.random::<f64>() < density * 0.4).collect();
            let goal = StateId::new(states - 1 - rng.random_range(0..states / 3));
            let decision = check(&domain, &planner, &world, goal, &mut tally);
            longest = longest.max(decision.questions);
            if let Verdict::Stuck(Obstacle::NeedsItself { .. }) = decision.verdict {
                circular += 1;
            }
        }
        let widest = domain.operators().iter().map(|o| o.preconditions.len()).max().unwrap_or(0);
        assert!(widest <= 4);
        if widest > 1 { branching += 1 } else { chained += 1 }
    }
    println!(
        "generated domains: {tally:?}, {chained} chains, {branching} trees, {circular} circles, longest {longest} questions"
    );
    assert_eq!(tally.act + tally.met + tally.stuck, 48 * 12);
    assert!(tally.act >= 50 && tally.met >= 50 && tally.stuck >= 50, "{tally:?}");
    assert!(circular >= 10 && longest >= 20 && chained >= 20 && branching >= 20);
}

#[test]
fn a_chain_of_thirty_states_is_walked_to_its_end() {
    let mut domain = DomainBuilder::new();
    for step in 1..30 {
        let (needs, causes) = (format!("S{}", step - 1), format!("S{step}"));
        domain = domain.action(&format!("GO_{step}"), [needs.as_str()], [causes.as_str()]);
    }
    let domain = domain.build().expect("sound");
    let spec = PlannerSpec { dimensions: 512, ..PlannerSpec::default() };
    let planner = Planner::new(&domain, spec, Seed::new(1)).expect("builds");
    let (bottom, goal) = (StateId::new(0), domain.state("S29").expect("a state"));
    let stuck = planner.decide(&domain.empty_world(), goal).expect("decides");
    assert_eq!(stuck.verdict, Verdict::Stuck(Obstacle::NothingCauses { state: bottom }));
    assert_eq!(stuck.questions, 30);
    let mut counts = vec![0; 30];
    counts[0] = 1;
    let plan = planner.plan(&counts, goal).expect("plans");
    let actions: Vec<ActionId> = plan.steps.iter().map(|s| s.action).collect();
    assert_eq!(actions, domain.action_ids().collect::<Vec<_>>());
    assert_eq!(plan.end, symbolt::task::planner::PlanEnd::Met);
}

#[test]
fn circular_preconditions_end_in_an_answer() {
    let domain = DomainBuilder::new()
        .action("A", ["Q", "OPEN"], ["P"])
        .action("B", ["P"], ["Q"])
        .action("C", ["P", "EASY"], ["GOAL"])
        .action("D", [], ["EASY"])
        .action("E", ["SELF"], ["SELF"])
        .build()
        .expect("sound");
    let planner = Planner::new(&domain, PlannerSpec::default(), Seed::new(3)).expect("builds");
    let mut tally = Tally::default();
    agree_everywhere(&domain, &planner, &mut tally);
    assert!(tally.act > 0 && tally.stuck > 0);
    let world = domain.world(["OPEN"]).expect("a state");
    let goal = domain.state("GOAL").expect("there");
    let decision = planner.decide(&world, goal).expect("decides");
    assert!(
        matches!(decision.verdict, Verdict::Stuck(Obstacle::NeedsItself { .. })),
        "{decision:?}"
    );
    let own = domain.state("SELF").expect("there");
    let decision = planner.decide(&world, own).expect("decides");
    assert_eq!(decision.verdict, Verdict::Stuck(Obstacle::NeedsItself { state: own }));
}

#[test]
fn the_papers_rule_acts_on_the_first_action_that_can_be_done() {
    let domain = paper_domain();
    let spec = PlannerSpec { commitment: Commitment::First, ..PlannerSpec::default() };
    let mut tally = Tally::default();
    let mut differs = 0;
    for seed in 0..5 {
        let planner = Planner::new(&domain, spec, Seed::new(seed)).expect("builds");
        agree_everywhere(&domain, &planner, &mut tally);
        // With only a nut on the table, the assembly cannot be reached, but the nut can be put into the jig.
        let world = domain.world(["NUT_ON_TABLE"]).expect("a state");
        let goal = domain.state("BOLT_ASSEMBLED").expect("there");
        let bolt = domain.state("BOLT_ON_TABLE").expect("there");
        let first = planner.decide(&world, goal).expect("decides").verdict;
        let proven =
            Planner::new(&domain, PlannerSpec::default(), Seed::new(seed)).expect("builds");
        let proven = proven.decide(&world, goal).expect("decides").verdict;
        assert_eq!(proven, Verdict::Stuck(Obstacle::NothingCauses { state: bolt }));
        differs += usize::from(first == Verdict::Act(ActionId::new(0)));
    }
    assert_eq!(tally.act + tally.met + tally.stuck, 5 * 160);
    assert!(differs > 0);
}

#[test]
fn a_state_that_must_be_absent_blocks_an_occupied_jig() {
    let domain = nut_first_domain();
    let spec = PlannerSpec { absent: true, ..PlannerSpec::default() };
    let planner = Planner::new(&domain, spec, Seed::new(1)).expect("builds");
    let mut tally = Tally::default();
    agree_everywhere(&domain, &planner, &mut tally);
    assert!(tally.act > 0 && tally.stuck > 0);
    // In the demonstrations, no bolt was in the jig when the nut was put in. Here one is.
    let holds = ["NUT_AT_START", "BOLT_AT_START", "BOLT_AT_BOLT_HOLE"];
    let world = domain.world(holds).expect("states");
    let goal = domain.state("NUT_AT_NUT_POCKET").expect("there");
    let blocked = planner.decide(&world, goal).expect("decides").verdict;
    let nut_action = *domain.causes(goal).first().expect("there");
    let jig = domain.state("BOLT_AT_BOLT_HOLE").expect("there");
    let expected = Obstacle::MustBeAbsent { action: nut_action, state: jig };
    assert_eq!(blocked, Verdict::Stuck(expected));
    let free = Planner::new(&domain, PlannerSpec::default(), Seed::new(1)).expect("builds");
    assert_eq!(free.decide(&world, goal).expect("decides").verdict, Verdict::Act(nut_action));
}

#[test]
fn unbinding_by_products_answers_the_same_and_takes_longer() {
    let domain = paper_domain();
    let spec = PlannerSpec { unbinding: Unbinding::Products, ..PlannerSpec::default() };
    let products = Planner::new(&domain, spec, Seed::new(4)).expect("builds");
    let fixed = Planner::new(&domain, PlannerSpec::default(), Seed::new(4)).expect("builds");
    let mut tally = Tally::default();
    agree_everywhere(&domain, &products, &mut tally);
    let (world, goal) = both_on_the_table(&domain);
    let time = |planner: &Planner| {
        let decision = planner.decide(&world, goal).expect("decides");
        let found = decision.milestones.iter().find(|m| m.stage.to_string() == "preconditions");
        found.map(|m| m.time_ms).expect("preconditions were reached")
    };
    assert!(time(&products) > time(&fixed), "{} {}", time(&products), time(&fixed));
}

#[test]
fn milestones_come_in_order_and_name_their_states() {
    let domain = paper_domain();
    let planner = Planner::new(&domain, PlannerSpec::default(), Seed::new(1)).expect("builds");
    let (world, goal) = both_on_the_table(&domain);
    let decision = planner.decide(&world, goal).expect("decides");
    let times: Vec<f64> = decision.milestones.iter().map(|m| m.time_ms).collect();
    assert!(times.windows(2).all(|w| w[0] <= w[1]), "{times:?}");
    let stages: Vec<String> =
        decision.milestones[..5].iter().map(|m| m.stage.to_string()).collect();
    assert_eq!(stages, ["goal", "action", "preconditions", "comparison", "conclusion"]);
    assert!(
        decision.milestones[..5].iter().all(|m| m.subject == "BOLT_ASSEMBLED" && m.question == 1)
    );
    assert!(times[0] > 0.0 && times[3] < 100.0, "{times:?}");
    assert_eq!(decision.milestones.last().map(|m| m.time_ms), Some(decision.time_ms));
}

#[test]
fn the_same_seed_gives_the_same_bits_and_another_seed_others() {
    let domain = paper_domain();
    let run = |seed: u64| {
        let planner =
            Planner::new(&domain, PlannerSpec::default(), Seed::new(seed)).expect("builds");
        let (world, goal) = both_on_the_table(&domain);
        let mut sim = planner.simulator(&world, goal).expect("starts");
        sim.run_for(symbolt::sim::SimDuration::from_millis(150)).expect("runs");
        sim.checkpoint().expect("it can be saved")
    };
    assert_eq!(run(1), run(1));
    assert_ne!(run(1), run(2));
}

#[test]
fn a_question_refuses_the_checkpoint_of_another() {
    let domain = paper_domain();
    let planner = Planner::new(&domain, PlannerSpec::default(), Seed::new(1)).expect("builds");
    let (world, goal) = both_on_the_table(&domain);
    let start = |world: &WorldState, goal| planner.simulator(world, goal).expect("starts");
    let checkpoint = start(&world, goal).checkpoint().expect("it can be saved");
    start(&world, goal).restore(&checkpoint).expect("the same question");
    let fewer = domain.world(["NUT_ON_TABLE"]).expect("states");
    let another = domain.state("NUT_IN_JIG").expect("a state");
    for (world, goal) in [(&fewer, goal), (&world, another)] {
        let refused = start(world, goal).restore(&checkpoint).expect_err("another question");
        assert!(matches!(refused, SimError::World { .. }), "{refused:?}");
        assert!(refused.to_string().contains("another world state or goal"), "{refused}");
    }
}

#[test]
fn what_cannot_be_asked_is_an_error_with_the_choices() {
    let domain = paper_domain();
    let planner = Planner::new(&domain, PlannerSpec::default(), Seed::new(1)).expect("builds");
    let error = domain.state("BOLT_ASSEMBLD").map_err(|e| e.to_string());
    let text = error.err().unwrap_or_default();
    assert!(
        text.contains("did you mean `BOLT_ASSEMBLED`?") && text.contains("NUT_IN_JIG"),
        "{text}"
    );
    let jig = domain.state("NUT_IN_JIG").expect("there");
    let refused =
        |world, goal| matches!(planner.decide(&world, goal), Err(TaskError::Setting { .. }));
    assert!(refused(WorldState::empty(4), jig) && refused(domain.empty_world(), StateId::new(5)));
    let misspelt = planner.domain().world(["NUT_ON_TABEL"]).map_err(|e| e.to_string());
    assert!(misspelt.is_err_and(|e| e.contains("NUT_ON_TABEL") && e.contains("NUT_ON_TABLE")));
    for dimensions in [0, 1, 2, 8] {
        let spec = PlannerSpec { dimensions, ..PlannerSpec::default() };
        let error = Planner::new(&domain, spec, Seed::new(1)).err().map(|e| e.to_string());
        let text = error.unwrap_or_default();
        assert!(text.contains("dimensions"), "{dimensions}: {text}");
    }
    let none = DomainBuilder::new().state("ALONE").build().expect("sound");
    assert!(matches!(
        Planner::new(&none, PlannerSpec::default(), Seed::new(1)),
        Err(TaskError::BadDomain { .. })
    ));
}

#[test]
fn an_action_with_two_effects_is_planned_with() {
    let domain = DomainBuilder::new()
        .action("OPEN_BOX", ["BOX_SHUT"], ["BOX_OPEN", "LID_ON_TABLE"])
        .action("TAKE_OUT", ["BOX_OPEN"], ["THING_OUT"])
        .action("COVER", ["LID_ON_TABLE", "THING_OUT"], ["THING_COVERED"])
        .build()
        .expect("sound");
    let planner = Planner::new(&domain, PlannerSpec::default(), Seed::new(1)).expect("builds");
    let mut tally = Tally::default();
    agree_everywhere(&domain, &planner, &mut tally);
    assert_eq!(tally.act + tally.met + tally.stuck, 32 * 5);
    assert!(tally.act > 20 && tally.met == 80, "{tally:?}");
}

#[test]
fn too_few_dimensions_for_many_preconditions_are_refused_and_never_planned_with() {
    let names: Vec<String> = (0..30).map(|i| format!("NEEDED_{i}")).collect();
    let domain = |needs: usize| {
        let needs = names[..needs].iter().map(String::as_str);
        let spare = ["SPARE_1", "SPARE_2", "SPARE_3", "SPARE_4", "SPARE_5", "SPARE_6"];
        let domain = DomainBuilder::new().action("DO", needs, ["DONE"]);
        spare.iter().fold(domain, |d, s| d.state(s)).build().expect("sound")
    };
    let (mut refused, mut right) = (0, 0);
    for needs in [1, 5, 15, 30] {
        for dimensions in [32, 128, 256, 1024] {
            let spec = PlannerSpec { dimensions, max_similarity: 0.5, ..PlannerSpec::default() };
            let domain = domain(needs);
            match Planner::new(&domain, spec, Seed::new(4)) {
                Ok(planner) => {
                    let mut tally = Tally::default();
                    let done = domain.state("DONE").expect("there");
                    let mut world: WorldState =
                        domain.states().iter().map(|s| s.name.starts_with("NEEDED")).collect();
                    check(&domain, &planner, &world, done, &mut tally);
                    assert_eq!(tally, Tally { act: 1, ..Tally::default() });
                    world.remove(domain.state("NEEDED_0").expect("there"));
                    check(&domain, &planner, &world, done, &mut tally);
                    assert_eq!(tally, Tally { act: 1, stuck: 1, met: 0 });
                    right += 1;
                }
                Err(TaskError::TooFewDimensions { .. } | TaskError::Vocabulary(_)) => refused += 1,
                Err(error) => panic!("{error}"),
            }
        }
    }
    println!("{right} planned rightly, {refused} refused");
    assert!(right >= 7 && refused >= 4, "{right} {refused}");
}
