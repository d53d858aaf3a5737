//! The tasks in physics over relational domains: demonstrated, learned and done by the planner graph.

#![allow(clippy::unwrap_used, clippy::expect_used)]
#![cfg(feature = "physics")]

use std::time::Instant;

use symbolt::sim::Seed;
use symbolt::task::event::{Ended, Ignore};
use symbolt::task::execute::{EpisodeSpec, PlannerBuild, demonstrate_sensed, relational_episode};
use symbolt::task::learn::{Settings, learn_relational};
use symbolt::task::{Sensing, tasks};

/// Reads a number from the environment.
fn number(name: &str, default: f64) -> f64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

#[test]
#[ignore = "a measurement: minutes for each task; TASK, EPISODES, DROPS, NOISE_MM and OUTLIERS select"]
fn tasks_are_done_in_scenes_unlike_those_shown() {
    let only = std::env::var("TASK").ok();
    let noise = number("NOISE_MM", 0.0);
    let sensing = Sensing {
        pose_noise_m: noise * 1e-3,
        pose_noise_deg: noise,
        outlier_rate: number("OUTLIERS", 0.0),
        ..Sensing::default()
    };
    for task in tasks::all().iter().filter(|t| only.as_ref().is_none_or(|o| o == t.name())) {
        let began = Instant::now();
        let seed = Seed::new(number("SEED", 1.0) as u64);
        let demos = number("DEMOS", 5.0) as usize;
        let shown = demonstrate_sensed(&**task, demos, &sensing, seed, &mut Ignore);
        let shown = shown.expect("it can be shown");
        let shown_s = began.elapsed().as_secs_f64();
        let learned = learn_relational(&shown.recording, &Settings::default());
        let Ok(learned) = learned else {
            println!("{}: {}", task.name(), learned.expect_err("nothing"));
            continue;
        };
        let domain = learned.domain;
        println!(
            "{}: {} of {demos} shown in {shown_s:.0} s; states {:?}; goals {:?}",
            task.name(),
            shown.solved,
            domain.states.iter().map(|s| s.name.as_str()).collect::<Vec<_>>(),
            domain
                .goals
                .iter()
                .map(|g| format!("{} {:?}", domain.states[g.state].name, g.quantity))
                .collect::<Vec<_>>(),
        );
        let (mut solved, mut wrong, of) = (0, 0, number("EPISODES", 5.0) as u64);
        for n in 0..of {
            let perturbation = match number("DISTURB", 0.0) > 0.0 {
                true => task.perturbation(Seed::new(100 + n)),
                false => None,
            };
            let spec = EpisodeSpec {
                task: task.clone(),
                sensing,
                drop_rate: number("DROPS", 0.0),
                perturbation,
                ..EpisodeSpec::default()
            };
            let began = Instant::now();
            let over = relational_episode(
                &domain,
                &PlannerBuild::default(),
                &spec,
                Seed::new(100 + n),
                &mut Ignore,
            );
            let over = match over {
                Ok(over) => over,
                Err(error) => {
                    println!("   {n}: {error}");
                    continue;
                }
            };
            let report = &over.episode.report;
            solved += u32::from(report.solved);
            wrong += u32::from(report.false_goal());
            let d = over.grounds[0].domain();
            let done: Vec<String> =
                report.attempts().map(|(action, outcome)| format!("{action}:{outcome}")).collect();
            if !report.solved || report.ended != Ended::GoalMet {
                println!(
                    "   {n}: {:?} solved {} reference {:?} {done:?}",
                    report.ended, report.solved, over.reference_moves
                );
                if let (Ended::Stuck(_), Some(last)) = (&report.ended, over.grounds.last()) {
                    let holds = &report.decisions.last().expect("one").holds;
                    println!("      holds {holds:?}");
                    let d = last.domain();
                    for a in d.operators() {
                        let (needs, effects) = (d.names(&a.preconditions), d.names(&a.effects));
                        println!("      {} {needs:?} -> {effects:?}", a.name);
                    }
                }
            }
            if n == 0 {
                println!(
                    "   {} facts, {} actions, {:.0} ms to build, {:.1} s simulated, {:.1} s wall, {} compiled, {done:?}",
                    d.states().len(),
                    d.operators().len(),
                    over.build_wall.as_secs_f64() * 1e3,
                    report.simulated_s,
                    began.elapsed().as_secs_f64(),
                    over.grounds.len()
                );
            }
        }
        println!(
            "   {solved} of {of} solved, {wrong} false goals, {:.0} s",
            began.elapsed().as_secs_f64()
        );
    }
}
