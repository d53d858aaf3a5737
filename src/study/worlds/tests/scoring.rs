use super::*;
use crate::task::domain::Sensing;

#[test]
fn an_exploration_confirms_every_need_and_rejects_habits_and_distractors() {
    for world in all() {
        let (truth, explored) = (world.truth(), world.explore());
        assert_eq!(explored.len(), truth.actions.len());
        for (action, explored) in truth.actions.iter().zip(&explored) {
            let place = format!("{}: {}", world.name(), action.to);
            assert_eq!(explored.to, action.to);
            assert!(explored.situations >= 30, "{place}: {}", explored.situations);
            assert!(!explored.origins.is_empty(), "{place}");
            for need in &action.needs {
                let confirmed = explored.always.iter().any(|always| always.says(need));
                assert!(confirmed, "{place}: {need:?} is not in {:?}", explored.always);
            }
            // A part that was always on the table in demonstrations is not needed there.
            let table = |n: &Need| matches!(n, Need::Somewhere(s) if s.ends_with("_ON_TABLE"));
            if world.name().starts_with("nuts") {
                assert!(!explored.always.iter().any(table), "{place}: {:?}", explored.always);
            }
        }
        for (first, then) in &truth.habits {
            let explored = explored.iter().find(|e| e.to == *then).unwrap();
            assert!(!explored.after.contains(first));
            assert!(!explored.always.iter().any(|n| n.state() == *first
                && !matches!(n, Need::Nowhere(_) | Need::Clear(_))));
        }
    }
}

#[test]
fn an_exploration_finds_the_orders_that_are_needed() {
    let needed = [
        ("tower", "BLUE_ON_GREEN", "RED_ON_BASE"),
        ("flange", "COVER_ON_FLANGE", "BOLT_IN_FLANGE"),
        ("drawer", "BOX_IN_DRAWER", "DRAWER_OPEN"),
        ("gate", "PARCEL_BEHIND_GATE", "WEIGHT_ON_BUTTON"),
        ("cup_turned", "BALL_IN_CUP", "CUP_UPRIGHT"),
    ];
    for (name, then, first) in needed {
        let explored = of(name).explore();
        let after = |to| &explored.iter().find(|e| e.to == to).unwrap().after;
        assert!(after(then).contains(&first), "{name}: {:?}", after(then));
        assert!(!after(first).contains(&then), "{name}: {:?}", after(first));
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
    let world = of("nuts_distractors");
    let (truth, explored) = (world.truth(), world.explore());
    let action = truth.action("BOLT_IN_NUT").unwrap();
    let explored = explored.iter().find(|e| e.to == "BOLT_IN_NUT").unwrap();
    let full = score_needs(action, explored, &action.needs, &[]);
    assert_eq!((full.rates.precision(), full.rates.recall(), full.rates.due), (1.0, 1.0, 2));
    assert_eq!(full.demanded, 2);
    let distracted = [Need::Object("BOLT_IN_HOLE"), Need::Somewhere("NUT_ON_TABLE")];
    let score = score_needs(action, explored, &distracted, &[]);
    assert_eq!((score.rates.right, score.rates.said, score.rates.found), (1, 2, 1));
    assert_eq!(score.wrong, [Need::Somewhere("NUT_ON_TABLE")]);
    assert_eq!(score.missed, [Need::Reference("NUT_IN_POCKET")]);
    let open = score_needs(action, explored, &distracted[..1], &action.needs[1..]);
    assert_eq!((open.rates.precision(), open.rates.recall()), (1.0, 1.0));
    // An order of habit is wrong to assert.
    let world = of("nuts_nut_first");
    let truth = world.truth();
    let action = truth.action("BOLT_IN_HOLE").unwrap();
    let explored = world.explore();
    let explored = explored.iter().find(|e| e.to == "BOLT_IN_HOLE").unwrap();
    let score = score_needs(action, explored, &[Need::Somewhere("NUT_IN_POCKET")], &[]);
    assert_eq!(score.rates.precision(), 0.0);
}

#[test]
fn an_episode_is_judged_by_the_world() {
    let exact = Sensing::default();
    let world = of("nuts");
    // The demonstrator's moves of an equal run are a plan.
    let mut planner = world.begin(Seed::new(1), Stage::Test);
    let mut run = world.begin(Seed::new(1), Stage::Test);
    let outcome = carry_out(run.as_mut(), 20, &exact, Seed::new(1), |_| {
        let (object, target) = planner.next()?;
        planner.act(&object, &target);
        Some((object.as_ref().to_owned(), target))
    });
    assert_eq!(outcome, Outcome { solved: true, stopped: true, accepted: 3, refused: 0 });
    let mut run = world.begin(Seed::new(1), Stage::Test);
    let outcome = carry_out(run.as_mut(), 20, &exact, Seed::new(1), |_| None);
    assert!(outcome.gave_up());
    let mut run = world.begin(Seed::new(1), Stage::Test);
    let nowhere = |_: &Snapshot| Some(("nut_0".to_owned(), Pose::at([9.0, 9.0, 9.0])));
    let outcome = carry_out(run.as_mut(), 20, &exact, Seed::new(1), nowhere);
    assert_eq!(outcome, Outcome { solved: false, stopped: false, accepted: 0, refused: 20 });
}
