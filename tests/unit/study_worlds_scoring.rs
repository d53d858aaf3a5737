use std::collections::BTreeSet;

use super::*;
use crate::robot::Pose;
use crate::task::recording::Sensing;

/// What the world demands of a move into a state, and what an exploration always found.
fn needs(world: &World, state: &str) -> (Vec<Need>, BTreeSet<Need>) {
    let at = world.0.jobs.iter().position(|job| job.to == state).unwrap();
    (world.0.needs_of(state).collect(), explore(&world.0).swap_remove(at))
}

#[test]
fn an_exploration_confirms_every_need_and_rejects_habits_and_distractors() {
    for world in all() {
        let explored = explore(&world.0);
        assert_eq!(explored.len(), world.0.jobs.len());
        for (job, always) in world.0.jobs.iter().zip(&explored) {
            let place = format!("{}: {}", world.name(), job.to);
            for need in world.0.needs_of(job.to) {
                let confirmed = always.iter().any(|always| always.says(&need));
                assert!(confirmed, "{place}: {need:?} is not in {always:?}");
            }
            // A part that was always on the table in demonstrations is not needed there.
            let table = |n: &Need| matches!(n, Need::Somewhere(s) if s.ends_with("_ON_TABLE"));
            if world.name().starts_with("nuts") {
                assert!(!always.iter().any(table), "{place}: {always:?}");
            }
        }
        for (first, then) in &world.0.habits {
            let (_, always) = needs(&world, then);
            assert!(!always.iter().any(|n| n.state() == *first
                && !matches!(n, Need::Nowhere(_) | Need::Clear(_))));
        }
    }
}

#[test]
fn the_truth_scores_full_marks_and_errors_cost() {
    let shown = of("table").show(4, Seed::new(1));
    let said =
        |rename: &dyn Fn(&Resting) -> Option<SaidState>| -> Vec<Vec<Vec<Option<SaidState>>>> {
            let object = |o: &Option<Resting>| o.as_ref().and_then(rename);
            let states = shown.states.iter();
            states.map(|d| d.iter().map(|s| s.iter().map(object).collect()).collect()).collect()
        };
    let right = |r: &Resting| {
        let reference = r.reference.as_deref().map(str::to_owned);
        Some(SaidState { state: format!("S_{}", r.state), reference })
    };
    let score = score_states(&shown, &said(&right));
    assert_eq!((score.states.precision(), score.states.recall()), (1.0, 1.0));
    assert_eq!((score.poses.precision(), score.poses.recall()), (1.0, 1.0));
    assert_eq!((score.states.due, score.names.len(), score.wrong_references), (6, 6, 0));
    assert!(score.poses.due > 300);
    // All forks in one state, knives unexplained, and no reference objects.
    let wrong = |r: &Resting| {
        let state = if r.state.starts_with("FORK") { "FORK" } else { r.state };
        (!r.state.starts_with("KNIFE")).then(|| SaidState { state: state.into(), reference: None })
    };
    let score = score_states(&shown, &said(&wrong));
    assert_eq!((score.states.said, score.states.right, score.states.due), (3, 3, 6));
    assert!(score.poses.precision() < 1.0 && score.poses.recall() < score.poses.precision());
    assert_eq!(score.wrong_references, score.poses.right);
}

#[test]
fn needs_are_scored_by_what_the_world_demands() {
    let (demanded, always) = needs(&of("nuts_distractors"), "BOLT_IN_NUT");
    let full = score_needs(&demanded, &always, &demanded, &[]);
    assert_eq!((full.rates.precision(), full.rates.recall(), full.rates.due), (1.0, 1.0, 2));
    let distracted = [Need::Object("BOLT_IN_HOLE"), Need::Somewhere("NUT_ON_TABLE")];
    let score = score_needs(&demanded, &always, &distracted, &[]);
    assert_eq!((score.rates.right, score.rates.said, score.rates.found), (1, 2, 1));
    assert_eq!(score.wrong, [Need::Somewhere("NUT_ON_TABLE")]);
    assert_eq!(score.missed, [Need::Reference("NUT_IN_POCKET")]);
    let open = score_needs(&demanded, &always, &distracted[..1], &demanded[1..]);
    assert_eq!((open.rates.precision(), open.rates.recall()), (1.0, 1.0));
    // An order of habit is wrong to assert.
    let (demanded, always) = needs(&of("nuts_nut_first"), "BOLT_IN_HOLE");
    let score = score_needs(&demanded, &always, &[Need::Somewhere("NUT_IN_POCKET")], &[]);
    assert_eq!(score.rates.precision(), 0.0);
}

#[test]
fn an_episode_is_judged_by_the_world() {
    let exact = Sensing::default();
    let world = of("nuts");
    // The demonstrator's moves of an equal run are a plan.
    let mut planner = world.begin(Seed::new(1), Stage::Test);
    let mut run = world.begin(Seed::new(1), Stage::Test);
    let (outcome, trouble) = carry_out(&mut run, 20, &exact, Seed::new(1), |_| {
        let next = planner.next_move();
        if let Some((object, target)) = &next {
            planner.act(object, target);
        }
        Ok(next.map(|(object, target)| (object.as_ref().to_owned(), target)))
    });
    assert_eq!(outcome, Outcome { solved: true, met: true, accepted: 3, refused: 0 });
    assert!(outcome.done() && trouble.is_none());
    let mut run = world.begin(Seed::new(1), Stage::Test);
    let (outcome, _) = carry_out(&mut run, 20, &exact, Seed::new(1), |_| Ok(None));
    assert!(outcome.met && !outcome.solved && !outcome.done());
    let mut run = world.begin(Seed::new(1), Stage::Test);
    let (outcome, trouble) = carry_out(&mut run, 20, &exact, Seed::new(1), |_| Err("no".into()));
    assert_eq!((outcome.met, trouble.as_deref()), (false, Some("no")));
    let mut run = world.begin(Seed::new(1), Stage::Test);
    let nowhere = |_: &Snapshot| Ok(Some(("nut_0".to_owned(), Pose::at([9.0, 9.0, 9.0]))));
    let (outcome, _) = carry_out(&mut run, 20, &exact, Seed::new(1), nowhere);
    assert_eq!(outcome, Outcome { solved: false, met: false, accepted: 0, refused: 20 });
}

#[test]
fn what_is_not_sensed_for_a_moment_lies_where_it_was_seen() {
    let sensing = Sensing { missing_rate: 0.5, ..Sensing::default() };
    let mut run = of("table").begin(Seed::new(1), Stage::Test);
    let all = run.snapshot().objects.len();
    let mut counts = Vec::new();
    carry_out(&mut run, 12, &sensing, Seed::new(1), |scene| {
        counts.push(scene.objects.len());
        Ok(Some((String::new(), Pose::at([0.0; 3]))))
    });
    assert!(counts.is_sorted() && counts[0] < all && counts.ends_with(&[all; 3]), "{counts:?}");
}
