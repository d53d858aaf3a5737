//! Tasks unlike those with which the learner grew up: queues, optional parts, sides, tools that change parts, and several places to
//! choose from.

use symbolt::robot::Pose;
use symbolt::task::classify::Classifier;
use symbolt::task::compile::Problem;
use symbolt::task::domain::{Origin, Quantity, RelationalDomain};
use symbolt::task::planner::PlannerBuild;
use symbolt::task::{Demonstration, Snapshot};

use super::modes::{Draw, acted, recording, shown};
use super::several_places::{flat, learned, noisy, objects, on, put};

/// Objects with their kinds and poses.
type Things = Vec<(&'static str, Pose)>;

/// The moved objects of a plan, each with the name of its action.
fn planned(domain: &RelationalDomain, things: &Things) -> Vec<(usize, String)> {
    let scene = Snapshot { objects: objects(things), ..Snapshot::default() };
    let layout = Classifier::new(domain).classify(&scene);
    let problem = Problem::new(domain, &layout).expect("a problem");
    let plan = problem.plan(&layout.situation(), &[]).expect("a plan");
    let name = |operator: usize| domain.operators[operator].name.clone();
    plan.iter().map(|step| (step.action.object, name(step.action.operator))).collect()
}

/// The actions of the plan that the planner of goal sets decides on.
fn decided(domain: &RelationalDomain, things: &Things) -> Vec<String> {
    let scene = Snapshot { objects: objects(things), ..Snapshot::default() };
    let layout = Classifier::new(domain).classify(&scene);
    let problem = Problem::new(domain, &layout).expect("a problem");
    let plan = PlannerBuild::default().plan(&problem, &layout, PlannerBuild::LIMIT);
    plan.expect("a plan").moves.iter().map(|step| step.action.to_string()).collect()
}

/// Cans stand in a chute. The first goes into a crate, and those behind it slide up.
fn queue(draw: &mut Draw, cans: usize) -> Demonstration {
    let (chute, crate_) = (draw.fixture(0.1), flat(draw.within(-0.3, 0.3), -0.3, 0.0, draw.yaw()));
    let spot = |k: usize| on(&chute, &flat(0.08 * k as f64, 0.0, 0.05 + 0.02 * k as f64, 0.0));
    let mut things = vec![("chute", chute), ("crate", crate_)];
    things.extend((0..cans).map(|k| ("can", spot(k))));
    let moves = (0..cans).map(|k| {
        let place = flat(0.08 * ((k + cans) % 3) as f64 - 0.08, 0.0, 0.05, draw.yaw());
        let slid = (k + 1..cans).map(|behind| (2 + behind, spot(behind - k - 1)));
        [(2 + k, on(&crate_, &place))].into_iter().chain(slid).collect()
    });
    let moves: Vec<Vec<(usize, Pose)>> = moves.collect();
    acted(objects(&things), &moves)
}

#[test]
fn what_slides_up_in_a_queue_is_not_taken_for_exchanged_ids() {
    for (mm_deg, seed) in [(0.0, 1), (1.0, 2), (2.0, 3)] {
        let mut draw = Draw(100 + seed);
        let shown = recording([2, 3, 3, 2, 3].into_iter().map(|cans| queue(&mut draw, cans)));
        let domain = learned(&noisy(&shown, mm_deg, seed));
        let [operator] = &domain.operators[..] else { panic!("{:#?}", domain.operators) };
        assert_eq!(operator.instances, 13, "{mm_deg} mm");
        let front = &domain.states[operator.from[0]];
        assert_eq!((operator.from.len(), front.frame.name()), (1, "chute"), "{mm_deg} mm");
        assert!(front.places[0].pose().position[0].abs() < 0.01, "the foremost: {front:?}");
    }
}

/// A box and its cover, with an insert or without.
fn boxed(draw: &mut Draw, insert: bool) -> (Things, Vec<(usize, Pose)>) {
    let place = draw.fixture(0.04);
    let mut things = vec![("box", place), ("cover", draw.lying(0.01))];
    let mut moves = Vec::new();
    if insert {
        things.push(("insert", draw.lying(0.02)));
        moves.push((2, on(&place, &flat(0.0, 0.0, 0.0, 0.0))));
    }
    moves.push((1, on(&place, &flat(0.0, 0.0, 0.05, 0.0))));
    (things, moves)
}

#[test]
fn a_part_that_is_not_always_there_is_put_in_its_turn_where_it_is() {
    let mut draw = Draw(7);
    let domain = learned(&recording([true, false, true, false, true].into_iter().map(|insert| {
        let (things, moves) = boxed(&mut draw, insert);
        shown(objects(&things), &moves)
    })));
    let moved = |insert: bool| -> Vec<usize> {
        let plan = planned(&domain, &boxed(&mut Draw(70), insert).0);
        plan.into_iter().map(|(object, _)| object).collect()
    };
    assert_eq!(moved(true), [2, 1], "the insert, then the cover");
    assert_eq!(moved(false), [1], "there is nothing to put in");
    let optional = |g: &&_| matches!(g, (Quantity::EachObject, 3, 3));
    let goals: Vec<_> = domain.goals.iter().map(|g| (g.quantity.clone(), g.held, g.of)).collect();
    assert_eq!(goals.iter().filter(optional).count(), 1, "{goals:?}");
}

/// Tiles lie face up or face down. One that lies face down goes over a block. All end on a tray.
fn tiles(draw: &mut Draw, down: &[bool]) -> (Things, Vec<(usize, Pose)>) {
    let (tray, block) = (draw.fixture(0.0), flat(0.5, draw.within(-0.3, 0.1), 0.02, draw.yaw()));
    let (mut things, mut moves) = (vec![("tray", tray), ("block", block)], Vec::new());
    for (k, down) in down.iter().enumerate() {
        let lying = draw.lying(0.005);
        let over = Pose { position: [0.0; 3], orientation: [1.0, 0.0, 0.0, 0.0] };
        things.push(("tile", if *down { on(&lying, &over) } else { lying }));
        if *down {
            moves.push((2 + k, on(&block, &flat(0.0, 0.0, 0.03, draw.yaw()))));
        }
        let slot = flat(0.09 * k as f64 - 0.09, 0.0, 0.01, draw.yaw());
        moves.push((2 + k, on(&tray, &slot)));
    }
    (things, moves)
}

#[test]
fn what_lies_face_down_is_turned_over_before_it_is_used() {
    let all = [[true, false, true], [false, true, true], [true, true, false], [false, false, true]];
    for mm_deg in [0.0, 2.0] {
        let mut draw = Draw(11);
        let shown = recording(all.iter().cycle().take(5).map(|down| {
            let (things, moves) = tiles(&mut draw, down);
            shown(objects(&things), &moves)
        }));
        let domain = learned(&noisy(&shown, mm_deg, 5));
        // Two tiles where three were shown are all that there are.
        for down in [&[true, false][..], &[false, false], &[true, true, false]] {
            let (things, moves) = tiles(&mut Draw(13), down);
            let plan = planned(&domain, &things);
            assert_eq!(plan.len(), moves.len(), "{mm_deg} mm: {plan:?}");
            for (k, down) in down.iter().enumerate() {
                let own = plan.iter().filter(|(object, _)| *object == 2 + k).count();
                assert_eq!(own, 1 + usize::from(*down), "{mm_deg} mm: {plan:?}");
            }
        }
    }
}

/// Balls go into two cups of a holder; where there are more, the others go somewhere into a basket.
fn balls(draw: &mut Draw, count: usize) -> (Things, Vec<(usize, Pose)>) {
    let holder = flat(draw.within(-0.4, -0.1), 0.35, 0.0, draw.yaw());
    let basket = flat(draw.within(0.2, 0.5), draw.within(0.2, 0.5), 0.0, draw.yaw());
    let (mut things, mut moves) = (vec![("holder", holder), ("basket", basket)], Vec::new());
    for k in 0..count {
        things.push(("ball", draw.lying(0.02)));
        let place = match k {
            0 | 1 => on(&holder, &flat(0.1 * k as f64 - 0.05, 0.0, 0.05, draw.yaw())),
            _ => {
                let (x, y) = (draw.within(-0.06, 0.06), draw.within(-0.06, 0.06));
                on(&basket, &flat(x, y, 0.02, draw.yaw()))
            }
        };
        moves.push((2 + k, place));
    }
    (things, moves)
}

#[test]
fn every_object_ends_in_one_of_several_places() {
    let mut draw = Draw(21);
    let domain = learned(&recording([4, 2, 3, 4, 3].into_iter().map(|count| {
        let (things, moves) = balls(&mut draw, count);
        shown(objects(&things), &moves)
    })));
    // The holder was full each time, so that is a goal as well.
    let [full, goal] = &domain.goals[..] else { panic!("{:#?}", domain.goals) };
    assert_eq!((full.states().count(), &full.quantity), (1, &Quantity::AtLeast(2)));
    assert_eq!((goal.states().count(), &goal.quantity), (2, &Quantity::EachObject));
    let words = domain.goal_in_words(goal);
    assert!(words.starts_with("every ball is ") && words.contains(" or "), "{words}");
    // The file keeps the goal.
    let text = domain.to_json().expect("it can be written");
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("balls.json");
    std::fs::write(&path, text).expect("it can be written");
    assert_eq!(RelationalDomain::read(&path).expect("a domain").goals, domain.goals);
    for count in [1, 2, 4] {
        let plan = planned(&domain, &balls(&mut Draw(23), count).0);
        let basket = plan.iter().filter(|(_, action)| !action.contains("HOLDER")).count();
        assert_eq!((plan.len(), basket), (count, count.saturating_sub(2)), "{plan:?}");
        let decided = decided(&domain, &balls(&mut Draw(23), count).0);
        let basket = decided.iter().filter(|action| !action.contains("HOLDER")).count();
        assert_eq!((decided.len(), basket), (count, count.saturating_sub(2)), "{decided:?}");
    }
}

#[test]
fn either_key_opens_and_one_that_is_left_over_is_no_goal() {
    let scene = |draw: &mut Draw, keys: &[&'static str]| {
        let (vault, key) = (draw.fixture(0.0), flat(0.0, 0.12, 0.03, 0.0));
        let mut things = vec![("vault", vault), ("box", draw.lying(0.03))];
        things.extend(keys.iter().map(|key| (*key, draw.lying(0.01))));
        let moves = vec![(2, on(&vault, &key)), (1, on(&vault, &flat(0.15, 0.0, 0.03, 0.0)))];
        (things, moves)
    };
    let mut draw = Draw(31);
    let demos = (0..10).map(|number| {
        let (things, moves) = scene(&mut draw, &[["red", "blue"][number % 2]]);
        shown(objects(&things), &moves)
    });
    let domain = learned(&recording(demos));
    let [goal] = &domain.goals[..] else { panic!("{:#?}", domain.goals) };
    assert_eq!(domain.states[goal.state].kind, "box");
    // A key is used first; the other one may lie where it is.
    let (things, _) = scene(&mut Draw(33), &["blue", "red"]);
    let actions = decided(&domain, &things);
    assert!(actions.len() == 2 && actions[1].contains("BOX"), "{actions:?}");
}

/// Two screws are set into a plate, and a driver drives each in by 15 mm.
fn screws(draw: &mut Draw, number: usize) -> (Things, Vec<Vec<(usize, Pose)>>) {
    let (plate, holder) = (draw.fixture(0.0), flat(0.6, 0.3, 0.0, draw.yaw()));
    let home = on(&holder, &flat(0.0, 0.0, 0.06, draw.yaw()));
    let things = vec![
        ("plate", plate),
        ("holder", holder),
        ("driver", home),
        ("screw", draw.lying(0.01)),
        ("screw", draw.lying(0.01)),
    ];
    let at = |k: usize, z: f64| on(&plate, &flat(0.12 * k as f64 - 0.06, 0.0, z, 0.0));
    let set = |i: usize, k: usize| vec![(3 + i, at(k, 0.02))];
    let drive = |i: usize, k: usize| vec![(2, at(k, 0.08)), (3 + i, at(k, 0.005))];
    let (a, b) = (number % 2, 1 - number % 2);
    let mut moves = match number % 3 {
        0 => vec![set(0, a), set(1, b), drive(0, a), drive(1, b)],
        _ => vec![set(0, a), drive(0, a), set(1, b), drive(1, b)],
    };
    moves.push(vec![(2, home)]);
    (things, moves)
}

#[test]
fn what_a_tool_drives_in_was_not_nudged() {
    for mm_deg in [0.0, 1.0] {
        let mut draw = Draw(31);
        let shown = recording((0..6).map(|number| {
            let (things, moves) = screws(&mut draw, number);
            acted(objects(&things), &moves)
        }));
        let domain = learned(&noisy(&shown, mm_deg, 9));
        let screws_in = put(&domain, "screw");
        let heights = screws_in.iter().flat_map(|s| &s.places).map(|p| p.pose().position[2]);
        let (deep, high): (Vec<f64>, Vec<f64>) = heights.partition(|z| *z < 0.0125);
        assert_eq!((deep.len(), high.len()), (2, 2), "{mm_deg} mm: {screws_in:#?}");
        let sunk = |s: usize| domain.states[s].places.iter().all(|p| p.pose().position[2] < 0.0125);
        let asked = domain.goals.iter().filter(|goal| goal.states().all(sunk)).count();
        assert!(asked >= 1, "{mm_deg} mm: {:?}", domain.goals);
    }
}

#[test]
fn bricks_beside_each_other_lie_on_the_tray_and_not_on_each_other() {
    // The fourth slot is blue twice, and both times the third is.
    let rows = ["rrbb", "brrb", "brbr", "rbbr", "rbrb"];
    for seed in 0..5 {
        let mut draw = Draw(41 + seed);
        let domain = learned(&recording(rows.iter().map(|row| {
            let tray = draw.fixture(0.0);
            let mut things = vec![("tray", tray)];
            let kind = |c: char| if c == 'r' { "red" } else { "blue" };
            things.extend(row.chars().map(|c| (kind(c), draw.lying(0.02))));
            let slot = |k: usize| on(&tray, &flat(0.06 * k as f64 - 0.09, 0.0, 0.02, 0.0));
            let moves: Vec<(usize, Pose)> = (0..4).map(|k| (1 + k, slot(k))).collect();
            shown(objects(&things), &moves)
        })));
        let placed = domain.states.iter().filter(|s| s.origin == Origin::Placed);
        let frames: Vec<&str> = placed.map(|s| s.frame.name()).collect();
        assert_eq!(frames, ["tray", "tray"], "seed {seed}");
    }
}

#[test]
fn a_hook_that_was_used_once_faces_another_one_and_is_no_end_of_a_rail() {
    let used: [&[usize]; 5] = [&[0, 1], &[2, 0], &[1, 2], &[0, 3], &[2]];
    for mm_deg in [0.0, 1.0] {
        let mut draw = Draw(61);
        let shown = recording(used.iter().map(|hooks| {
            let tree = draw.fixture(0.2);
            let hook = |k: usize| {
                let (sin, cos) = (90.0 * k as f64).to_radians().sin_cos();
                let z = if k % 2 == 1 { 0.05 } else { -0.05 };
                on(&tree, &flat(0.06 * cos, 0.06 * sin, z, 90.0 * k as f64))
            };
            let mut things = vec![("tree", tree)];
            things.extend(hooks.iter().map(|_| ("mug", draw.lying(0.05))));
            let moves: Vec<(usize, Pose)> =
                hooks.iter().enumerate().map(|(i, k)| (1 + i, hook(*k))).collect();
            shown(objects(&things), &moves)
        }));
        let domain = learned(&noisy(&shown, mm_deg, 4));
        let states = put(&domain, "mug");
        assert_eq!((states.len(), states[0].places.len()), (1, 4), "{mm_deg} mm: {states:#?}");
        let mut open = states[0].places.iter().flat_map(|p| p.coordinates).filter(|c| c.is_open());
        assert!(open.next().is_none(), "{mm_deg} mm: {states:#?}");
    }
}

#[test]
fn what_lay_far_away_in_one_direction_of_a_fixture_by_chance_lies_about() {
    let mut draw = Draw(71);
    let domain = learned(&recording((0..5).map(|_| {
        let bracket = flat(draw.within(0.0, 0.4), draw.within(0.2, 0.5), 0.05, 0.0);
        // The scene is wide, and the area narrow.
        let lying = flat(draw.within(-0.28, 0.0), draw.within(-0.68, -0.57), -0.04, draw.yaw());
        let things = vec![
            ("bracket", bracket),
            ("cover", on(&bracket, &lying)),
            ("plug", flat(draw.within(-0.8, 0.8), draw.within(-0.8, 0.0), 0.01, draw.yaw())),
        ];
        let moves = [
            (2, on(&bracket, &flat(0.06, 0.02, 0.0, draw.yaw()))),
            (1, on(&bracket, &flat(0.06, 0.02, 0.03, 90.0))),
        ];
        shown(objects(&things), &moves)
    })));
    let found = domain.states.iter().find(|s| s.kind == "cover" && s.origin == Origin::Found);
    assert_eq!(found.expect("a state").frame.name(), "world");
}
