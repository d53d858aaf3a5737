//! The planner of goal sets over learned domains: in all situations of small domains, and with the robot in a scene.

#![allow(clippy::expect_used)]
#![cfg(feature = "physics")]

use std::sync::Arc;

use symbolt::neurons::{LifSpec, Population, PopulationPlan};
use symbolt::plan::goal_sets::{
    GoalSetError, GoalSetSpec, MAX_UNITS, StripsWorld, populations, pursue,
};
use symbolt::prelude::*;
use symbolt::sim::{Graph, Real, World, WorldError, WorldSave};
use symbolt::task::compile::GroundProblem;
use symbolt::task::event::{Ended, Ignore};
use symbolt::task::execute::{EpisodeSpec, PreparedEpisode, demonstrate, episode};
use symbolt::task::learn::{Settings, learn};
use symbolt::task::planner::{
    Counts, Decider, GoalSetPlanner, ModuleView, PlanEnd, PlannerBuild, PlannerInput, PlannerKind,
    Prediction, Request, RolledOut, Stage, strips_problem,
};
use symbolt::task::propositional::{Rules, acceptable_answers};
use symbolt::task::tasks::nuts_and_bolts::NutsAndBolts;
use symbolt::task::{Domain, DomainBuilder, Obstacle, StateId, TaskError, Verdict, WorldState};

/// A world that tells a planner one thing after another, and keeps its commands.
struct ScriptedSenses {
    /// What is told, and from which millisecond on.
    script: Vec<(u64, Vec<Real>)>,
    now: u64,
    commands: Vec<Real>,
}

impl World for ScriptedSenses {
    fn period(&self) -> SimDuration {
        SimDuration::from_millis(1)
    }
    fn sense_width(&self) -> usize {
        self.script[0].1.len()
    }
    fn command_width(&self) -> usize {
        self.commands.len()
    }
    fn sense(&self, out: &mut [Real]) {
        let (_, told) = self.script.iter().rfind(|(from, _)| *from <= self.now).expect("a first");
        out.copy_from_slice(told);
    }
    fn advance(&mut self, command: &[Real]) -> Result<(), WorldError> {
        self.commands.copy_from_slice(command);
        self.now += 1;
        Ok(())
    }
    fn reset(&mut self, _seed: Seed) -> Result<(), WorldError> {
        Ok(())
    }
    fn save(&self) -> Result<WorldSave, WorldError> {
        Ok(WorldSave(Vec::new()))
    }
    fn restore(&mut self, _saved: &WorldSave) -> Result<(), WorldError> {
        Ok(())
    }
}

/// Tells a planner one thing after another, from the given milliseconds on. Calls `shown` each millisecond with the
/// verdict, until it returns a value or two seconds have passed.
fn tell<T>(
    planner: &dyn Decider,
    script: &[(u64, PlannerInput<'_>)],
    mut shown: impl FnMut(u64, Option<Verdict>) -> Option<T>,
) -> Option<T> {
    let senses = script.iter().map(|(from, told)| {
        let mut senses = vec![0.0; planner.sense_width()];
        planner.sense(told, &mut senses);
        (*from, senses)
    });
    let commands = vec![0.0; planner.command_width()];
    let world = ScriptedSenses { script: senses.collect(), now: 0, commands };
    let config = RunConfig::default().in_world(world);
    let mut sim = Simulator::new(planner.graph().clone(), config).expect("starts");
    (1..2_000).find_map(|ms| {
        sim.run_for(SimDuration::from_millis(1)).expect("runs");
        let world: &dyn std::any::Any = sim.world().expect("a world");
        let world = world.downcast_ref::<ScriptedSenses>().expect("its own world");
        let (_, told) = script.iter().rfind(|(from, _)| *from < ms).expect("a first");
        shown(ms, planner.verdict(&world.commands, told))
    })
}

/// Returns the first verdict that lasts, and when.
fn decide(planner: &dyn Decider, told: &PlannerInput<'_>) -> Option<(Verdict, u64)> {
    let (mut last, mut since) = (None, 0);
    tell(planner, &[(0, *told)], |ms, verdict| {
        since = if verdict.is_some() && verdict == last { since + 1 } else { 1 };
        last = verdict;
        Some((verdict.filter(|v| since >= planner.steady_ms(v))?, ms))
    })
}

fn check_all_situations(domain: &Domain, plan: &PopulationPlan) {
    let planner = GoalSetPlanner::new(domain, Rules::default(), &[], plan, Seed::new(3));
    let planner = planner.expect("a planner");
    let states = domain.states().len();
    let mut counts = [0; 3];
    for bits in 0..1_usize << states {
        let present: WorldState = (0..states).map(|s| bits >> s & 1 == 1).collect();
        for goal in domain.state_ids() {
            let request = Request::Decide;
            let told =
                PlannerInput { request, present: &present, pretended: &[], goal, goals: &[goal] };
            let (verdict, ms) = decide(&planner, &told).expect("an answer");
            let right = acceptable_answers(domain, &present, goal, Rules::default());
            assert!(right.accepts(verdict), "{bits:b} {goal:?}: {verdict:?} after {ms} ms");
            counts[match verdict {
                Verdict::Act(_) => 0,
                Verdict::Met => 1,
                Verdict::Stuck(_) => 2,
            }] += 1;
        }
    }
    assert!(counts.iter().all(|count| *count > 0), "{counts:?}");
}

#[test]
fn every_answer_in_every_situation_is_one_that_the_symbolic_planner_accepts() {
    let domain = DomainBuilder::of_the_paper().build().expect("the paper's domain");
    check_all_situations(&domain, &PopulationPlan::direct());
    let domain = DomainBuilder::new()
        .action("FETCH", ["AT_HOME"], ["AT_SHOP"])
        .action("BUY", ["AT_SHOP", "MONEY"], ["BREAD"])
        .build()
        .expect("a domain");
    let lif = populations(&Population::Lif(LifSpec::default())).expect("patterns");
    check_all_situations(&domain, &lif);
}

#[test]
fn a_planner_that_is_told_to_forget_forgets_and_one_that_waits_keeps_its_plan() {
    let domain = DomainBuilder::of_the_paper().build().expect("the paper's domain");
    let plan = PopulationPlan::direct();
    let planner = GoalSetPlanner::new(&domain, Rules::default(), &[], &plan, Seed::new(3));
    let planner = planner.expect("a planner");
    let goal = domain.state("BOLT_ASSEMBLED").expect("the goal");
    let present = domain.world(["NUT_ON_TABLE", "BOLT_ON_TABLE"]).expect("states");
    let goals = [goal];
    let told =
        |request| PlannerInput { request, present: &present, pretended: &[], goal, goals: &goals };
    assert_eq!(decide(&planner, &told(Request::Forget)), None);
    let (verdict, ms) = decide(&planner, &told(Request::Decide)).expect("an action");
    // While it waits, its clocks stand still, and everything else goes on.
    assert_eq!(decide(&planner, &told(Request::Wait)).map(|(v, _)| v), Some(verdict));
    assert!((200..800).contains(&ms), "{ms}");
}

#[test]
fn that_there_is_no_way_is_shown_for_a_while_after_it_has_ceased_to_be_true_but_does_not_count() {
    let domain = DomainBuilder::of_the_paper().build().expect("the paper's domain");
    let lif = populations(&Population::Lif(LifSpec::default())).expect("patterns");
    let planner = GoalSetPlanner::new(&domain, Rules::default(), &[], &lif, Seed::new(3));
    let planner = planner.expect("a planner");
    let goal = domain.state("BOLT_ASSEMBLED").expect("the goal");
    let goals = [goal];
    let nothing = domain.empty_world();
    let parts = domain.world(["NUT_ON_TABLE", "BOLT_ON_TABLE"]).expect("states");
    let request = Request::Decide;
    let told = |present| PlannerInput { request, present, pretended: &[], goal, goals: &goals };
    let change = 1_300;
    let (mut before, mut stale) = (0, 0);
    let script = [(0, told(&nothing)), (change, told(&parts))];
    let action = tell(&planner, &script, |ms, verdict| match verdict {
        Some(Verdict::Stuck(_)) if ms <= change => {
            before += 1;
            None
        }
        Some(Verdict::Stuck(_)) => {
            stale += 1;
            None
        }
        Some(Verdict::Act(action)) => Some(action),
        _ => None,
    });
    let action = action.map(|action| domain[action].name.as_str());
    assert!(matches!(action, Some("PUT_NUT_IN_JIG" | "PUT_BOLT_IN_JIG")), "{action:?}");
    let counts = planner.steady_ms(&Verdict::Stuck(Obstacle::NothingCauses { state: goal }));
    // Actions count sooner; at their time, the verdict that is out of date would end the episode.
    let sooner = planner.steady_ms(&Verdict::Met);
    assert!(before > counts && (sooner..counts).contains(&stale), "{before} {stale} {counts}");
}

#[test]
fn a_situation_of_a_learned_domain_is_a_strips_problem() {
    let domain = DomainBuilder::of_the_paper().build().expect("the paper's domain");
    let present = domain.world(["NUT_ON_TABLE", "BOLT_ON_TABLE"]).expect("states");
    let goal = domain.state("BOLT_ASSEMBLED").expect("the goal");
    let problem = strips_problem(&domain, Rules::default(), &present, &[goal]);
    let world = StripsWorld::new(&problem, SimDuration::from_millis(100));
    let population = Population::Lif(LifSpec::default());
    let spec = GoalSetSpec { population, ..GoalSetSpec::default() };
    let course = pursue(&problem, world, &spec, Seed::new(4)).expect("it runs");
    assert!(course.reached && course.begun.iter().all(|begun| begun.met));
    assert_eq!(course.plan().count(), 3);
}

#[test]
fn a_domain_without_actions_is_refused_and_a_goal_of_another_domain_too() {
    let domain = DomainBuilder::of_the_paper().build().expect("the paper's domain");
    let plan = PopulationPlan::direct();
    let planner = GoalSetPlanner::new(&domain, Rules::default(), &[], &plan, Seed::new(3));
    let planner = planner.expect("a planner");
    let error = planner.check_goal(StateId::new(99)).expect_err("no such state").to_string();
    assert!(error.contains("99") && error.contains("5 states"), "{error}");
    let present = domain.empty_world();
    let goal = domain.state("BOLT_ASSEMBLED").expect("the goal");
    let request = Request::Decide;
    let told = PlannerInput { request, present: &present, pretended: &[], goal, goals: &[goal] };
    let verdict = decide(&planner, &told).map(|(verdict, _)| verdict);
    assert!(matches!(verdict, Some(Verdict::Stuck(Obstacle::NothingCauses { .. }))));
}

#[test]
fn a_domain_that_needs_too_many_neurons_is_refused_before_they_are_made() {
    let name = |n: usize| format!("S{n}");
    let long = (0..5000).fold(DomainBuilder::new(), |builder, n| {
        let (from, to) = (name(n), name(n + 1));
        builder.action(&format!("GO{n}"), [from.as_str()], [to.as_str()])
    });
    let domain = long.build().expect("a chain");
    let plan = PopulationPlan::direct();
    let refused = GoalSetPlanner::new(&domain, Rules::default(), &[], &plan, Seed::new(3));
    let Err(TaskError::GoalSets(GoalSetError::TooLarge { operators, units, .. })) = refused else {
        panic!("it is built, or refused for another reason");
    };
    assert!(operators == 5000 && units > MAX_UNITS);
}

/// A planner that never answers.
struct Silent(GoalSetPlanner);

impl Decider for Silent {
    fn domain(&self) -> &Domain {
        self.0.domain()
    }
    fn graph(&self) -> &Arc<Graph> {
        self.0.graph()
    }
    fn modules(&self) -> &[ModuleView] {
        &[]
    }
    fn sense_width(&self) -> usize {
        self.0.sense_width()
    }
    fn command_width(&self) -> usize {
        self.0.command_width()
    }
    fn sense(&self, told: &PlannerInput<'_>, out: &mut [Real]) {
        self.0.sense(told, out);
    }
    fn verdict(&self, _command: &[Real], _told: &PlannerInput<'_>) -> Option<Verdict> {
        None
    }
    fn patience_ms(&self) -> Option<u64> {
        Some(600)
    }
    fn roll_out(
        &self,
        prediction: &mut dyn Prediction,
        limit: SimDuration,
    ) -> Result<RolledOut, TaskError> {
        self.0.roll_out(prediction, limit)
    }
}

#[test]
fn an_episode_whose_planner_finds_no_plan_ends_stuck_and_not_at_the_limit_of_time() {
    let task = NutsAndBolts::default();
    let shown = demonstrate(&task, 3, Seed::new(1)).expect("a valid scene");
    let domain = learn(&shown.recording, &Settings::paper()).expect("it teaches").domain;
    let build = |ground: &GroundProblem| {
        let plan = PopulationPlan::direct();
        let (domain, rules) = (ground.domain(), Rules::default());
        let planner = GoalSetPlanner::new(domain, rules, &[], &plan, Seed::new(3))?;
        Ok(Arc::new(Silent(planner)) as Arc<dyn Decider>)
    };
    let spec = EpisodeSpec::of(task);
    let prepared = PreparedEpisode::with_decider(&domain, build, &spec, Seed::new(5));
    let over = prepared.expect("it is built").run(&mut Ignore).expect("it runs");
    let state = over.grounds[0].goals()[0];
    assert_eq!(over.report.ended, Ended::Stuck(Obstacle::NoPlan { state }));
    assert_eq!(over.report.decisions[0].took_ms, 600.0);
    assert!(over.report.simulated_s < 2.0, "{}", over.report.simulated_s);
}

#[test]
fn a_plan_that_is_rolled_out_tells_when_each_goal_set_was_written() {
    let domain = DomainBuilder::of_the_paper().build().expect("the paper's domain");
    let lif = populations(&Population::Lif(LifSpec::default())).expect("patterns");
    let planner = GoalSetPlanner::new(&domain, Rules::default(), &[], &lif, Seed::new(3));
    let planner = planner.expect("a planner");
    let goal = domain.state("BOLT_ASSEMBLED").expect("the goal");
    let objects = domain.counts(["NUT_ON_TABLE", "BOLT_ON_TABLE"]).expect("states");
    let limit = SimDuration::from_millis(3_000);
    let rolled = planner.roll_out(&mut Counts::new(&domain, &objects, goal), limit);
    let rolled = rolled.expect("it decides");
    assert_eq!((rolled.steps.len(), rolled.end), (3, PlanEnd::Met));
    assert_eq!(domain[rolled.steps[2].action].name, "ASSEMBLE");
    let first = &rolled.steps[0].decision;
    let stages: Vec<Stage> = first.milestones.iter().map(|m| m.stage).collect();
    use Stage::{Costs, Decision, GoalSet, Plan, Start};
    assert_eq!(stages, [Start, Costs, GoalSet, GoalSet, GoalSet, Plan, Decision]);
    // The plan is found backwards.
    let written = first.milestones.iter().filter(|m| m.stage == GoalSet);
    let written: Vec<&str> = written.map(|m| m.subject.as_str()).collect();
    let done: Vec<&str> = rolled.steps.iter().rev().map(|s| &*domain[s.action].name).collect();
    assert_eq!(written, done);
    assert!(first.milestones.is_sorted_by(|a, b| a.time_ms <= b.time_ms));
    assert_eq!(first.time_ms, first.milestones.last().map_or(0.0, |m| m.time_ms));
    // The plan is kept.
    assert!(rolled.steps[1].decision.questions == 0 && rolled.steps[1].decision.time_ms < 150.0);

    // What can be reached only as long as nothing is made false has no plan.
    let mut operators = domain.operators().to_vec();
    operators[0].removes = vec![domain.state("BOLT_ON_TABLE").expect("a state")];
    operators[1].preconditions.push(domain.state("NUT_IN_JIG").expect("a state"));
    let hopeless = Domain::new(domain.states().to_vec(), operators).expect("valid");
    let planner = GoalSetPlanner::new(&hopeless, Rules::default(), &[], &lif, Seed::new(3));
    let mut counts = Counts::new(&hopeless, &objects, goal);
    let rolled = planner.expect("a planner").roll_out(&mut counts, limit).expect("it ends");
    assert_eq!(rolled.end, PlanEnd::Stuck(Obstacle::NoPlan { state: goal }));
    assert_eq!(rolled.last.map(|decision| decision.time_ms), Some(3_000.0));
}

#[test]
fn in_spikes_it_assembles_a_nut_and_a_bolt_and_keeps_its_plan_while_the_robot_moves() {
    let task = NutsAndBolts::default();
    let shown = demonstrate(&task, 5, Seed::new(1)).expect("a valid scene");
    let learned = learn(&shown.recording, &Settings::default()).expect("it teaches");
    let plan = populations(&Population::Lif(LifSpec::default())).expect("patterns");
    let build = PlannerBuild { kind: PlannerKind::GoalSets, plan, ..PlannerBuild::default() };
    let spec = EpisodeSpec { drop_rate: 0.1, ..EpisodeSpec::of(task) };
    let mut times = Vec::new();
    for seed in [60, 61] {
        let over = episode(&learned.domain, &build, &spec, Seed::new(seed));
        let report = over.expect("runs").report;
        assert!(report.solved && report.ended == Ended::GoalMet, "{seed}: {:?}", report.ended);
        times.extend(report.decisions.iter().map(|decision| decision.took_ms));
    }
    times.sort_by(f64::total_cmp);
    // A planner that plans anew for every action takes 250 ms and more.
    assert!(times.len() >= 8 && times[times.len() / 2] <= 200.0, "{times:?}");
}
