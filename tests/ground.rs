//! Ground problems: relational problems compiled for the planner graph.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::time::Instant;

use symbolt::neurons::PopulationPlan;
use symbolt::sim::{Seed, Threads};
use symbolt::study::worlds::{self, Stage};
use symbolt::task::Verdict;
use symbolt::task::learn::{Settings, learn_relational};
use symbolt::task::planner::{Planner, PlannerSpec};
use symbolt::task::relational::{GroundProblem, Grounder, Problem, Situation};

/// What became of a plan of the planner graph.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Rolled {
    Met { moves: usize },
    Stuck(String),
    NoMove(String),
    Endless,
}

fn planner(ground: &GroundProblem) -> Planner {
    let (spec, plan) = (PlannerSpec::default(), PopulationPlan::direct());
    let built = Planner::composed(ground.domain(), ground.composition(), spec, &plan, Seed::new(1));
    built.expect("it builds").with_threads(Threads::Serial)
}

/// Carries out the decisions of the planner graph by the rules of the domain. Compiles the problem anew if the graph is
/// stuck.
fn roll(
    problem: &Problem<'_>,
    mut ground: GroundProblem,
    start: &Situation,
    log: &mut Vec<String>,
) -> Rolled {
    let mut now = start.clone();
    let mut asked = planner(&ground);
    for moves in 0..40 {
        let Some(goal) = ground.goal(&now) else { return Rolled::Met { moves } };
        let decision = asked.decide(&ground.present(&now), goal).expect("it decides");
        match decision.verdict {
            Verdict::Act(action) => {
                let name = &ground.domain()[action].name;
                log.push(name.clone());
                let Some(first) = ground.moves_for(problem, action, &now).first().copied() else {
                    return Rolled::NoMove(name.clone());
                };
                now = problem.after(&first, &now);
            }
            Verdict::Met => return Rolled::Met { moves },
            Verdict::Stuck(why) => {
                let again = problem.ground(&now).expect("it compiles");
                if again.dropped() == ground.dropped() {
                    return Rolled::Stuck(format!("{} by {why:?}", ground.domain()[goal].name));
                }
                log.push("again".into());
                ground = again;
                asked = planner(&ground);
            }
        }
    }
    Rolled::Endless
}

#[test]
#[ignore = "a measurement"]
fn the_graph_agrees_with_the_reference_planner() {
    let only = std::env::var("WORLD").ok();
    let (mut agree, mut all, mut no_plan) = (0, 0, 0);
    for world in worlds::all() {
        if only.as_ref().is_some_and(|o| o != world.name()) {
            continue;
        }
        let (mut own, mut of, mut ms, mut size) = (0, 0, 0.0f64, (0, 0, 0));
        for seed in 1..=2 {
            let recording = world.record(5, Seed::new(seed));
            let Ok(learned) = learn_relational(&recording, &Settings::default()) else { continue };
            let domain = learned.domain;
            let grounder = Grounder::new(&domain);
            for test in 0..5 {
                let run = world.begin(Seed::new(seed).derive_index("test", test), Stage::Test);
                let layout = grounder.layout(&run.snapshot());
                let Ok(problem) = Problem::new(&domain, &layout) else { continue };
                let start = layout.situation();
                let Some(plan) = problem.plan(&start, &[]) else {
                    no_plan += 1;
                    continue;
                };
                let began = Instant::now();
                let ground = match problem.ground(&start) {
                    Ok(ground) => ground,
                    Err(error) => {
                        of += 1;
                        println!("   {} {error}", world.name());
                        continue;
                    }
                };
                let planner = planner(&ground);
                ms = ms.max(began.elapsed().as_secs_f64() * 1e3);
                let d = ground.domain();
                size = size.max((d.states().len(), d.operators().len(), planner.spec().dimensions));
                let mut log = Vec::new();
                let rolled = roll(&problem, ground.clone(), &start, &mut log);
                of += 1;
                match rolled {
                    Rolled::Met { moves } if moves <= plan.len() + 2 => own += 1,
                    other => {
                        println!(
                            "   {} {seed}/{test}: {other:?}, the plan has {} moves, dropped {:?} of {:?}",
                            world.name(),
                            plan.len(),
                            ground.dropped(),
                            problem.dropped()
                        );
                        if only.is_some() {
                            println!("{log:?}");
                            for m in &plan {
                                println!(
                                    "     {:?}",
                                    (&domain.operators[m.action.operator].name, m.action)
                                );
                            }
                            for s in d.state_ids() {
                                println!(
                                    "    fact {} {}",
                                    d[s].name,
                                    ground.present(&start).holds(s)
                                );
                            }
                            for a in d.action_ids() {
                                println!(
                                    "    {} {:?} -> {:?}",
                                    d[a].name,
                                    d.names(&d[a].preconditions),
                                    d.names(&d[a].effects)
                                );
                            }
                        }
                    }
                }
            }
        }
        println!(
            "{:28} {own}/{of} facts, actions, dimensions {size:?}, built within {ms:.0} ms",
            world.name()
        );
        agree += own;
        all += of;
    }
    println!("{agree} of {all}; no plan {no_plan}");
}
