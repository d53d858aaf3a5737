//! Stacks, rows, drawers of which one may be open, and things that ride: what comes before what, from five demonstrations.

use symbolt::robot::Pose;
use symbolt::task::classify::Classifier;
use symbolt::task::compile::Problem;
use symbolt::task::domain::RelationalDomain;
use symbolt::task::planner::{PlannerBuild, SceneEnd};
use symbolt::task::{ObjectPose, Snapshot};

use super::modes::{Draw, recording, shown};
use super::several_places::{flat, learned, noisy, objects, on, put};

/// The plan for a scene, as pairs of the object that moves and what it is put onto.
fn planned(domain: &RelationalDomain, objects: Vec<ObjectPose>) -> Vec<(String, String)> {
    let scene = Snapshot { objects, ..Snapshot::default() };
    let layout = Classifier::new(domain).classify(&scene);
    let problem = Problem::new(domain, &layout).expect("a problem");
    let build = PlannerBuild::default();
    let plan = build.plan(&problem, &layout, PlannerBuild::LIMIT).expect("a plan");
    assert_eq!(plan.end, SceneEnd::Met, "{:?}", plan.moves);
    let moves = plan.moves.into_iter();
    moves.map(|m| (m.object.to_string(), m.onto.unwrap_or_default().to_string())).collect()
}

/// A plate, some cubes and a flag.
fn cubes(draw: &mut Draw, count: usize) -> Vec<ObjectPose> {
    let mut all = vec![("plate", draw.fixture(0.0)), ("flag", draw.lying(0.03))];
    all.extend((0..count).map(|_| ("cube", draw.lying(0.02))));
    objects(&all)
}

fn is_cube(id: &str) -> bool {
    id.starts_with("cube")
}

#[test]
fn a_cube_is_not_put_onto_a_cube_that_lies_about_and_the_flag_goes_onto_the_top_of_all() {
    for (seed, noise) in [(0, 0.0), (1, 0.0), (2, 1.0), (3, 1.0)] {
        let mut draw = Draw(100 + seed);
        let demo = |number: usize| {
            let all = cubes(&mut draw, 2 + number % 2);
            let mut under = all[0].pose;
            let mut moves: Vec<(usize, Pose)> = Vec::new();
            for cube in 2..all.len() {
                let height = if cube == 2 { 0.022 } else { 0.04 };
                under = on(&under, &flat(0.0, 0.0, height, draw.yaw()));
                moves.push((cube, under));
            }
            moves.push((1, on(&under, &flat(0.0, 0.0, 0.05, draw.yaw()))));
            shown(all, &moves)
        };
        let domain = learned(&noisy(&recording((0..5).map(demo)), noise, seed));
        for count in [2, 3] {
            let plan = planned(&domain, cubes(&mut Draw(200 + seed), count));
            let told = format!("seed {seed}, {count} cubes: {plan:?}");
            assert_eq!(plan.len(), count + 1, "{told}");
            // Each goes onto what the last move put somewhere.
            let mut under = "plate_0".to_owned();
            for (object, onto) in &plan {
                assert_eq!(*onto, under, "{told}");
                under = object.clone();
            }
            assert!(plan[..count].iter().all(|(o, _)| is_cube(o)) && under == "flag_1", "{told}");
        }
    }
}

/// A tray and a thin, a middling and a thick slab.
fn slabs(draw: &mut Draw) -> Vec<ObjectPose> {
    let [thin, mid, thick] = SLABS.map(|half| draw.lying(half));
    objects(&[("tray", draw.fixture(0.005)), ("thin", thin), ("mid", mid), ("thick", thick)])
}

/// Half the heights of the slabs, in metres.
const SLABS: [f64; 3] = [0.004, 0.012, 0.025];

#[test]
fn slabs_of_two_heights_are_stacked_in_either_order_and_not_into_the_air() {
    for (seed, noise) in [(0, 0.0), (1, 0.0), (2, 1.0), (3, 2.0)] {
        let mut draw = Draw(300 + seed);
        let demo = |number: usize| {
            let all = slabs(&mut draw);
            let order = if number.is_multiple_of(2) { [2, 3, 1] } else { [3, 2, 1] };
            let (mut under, mut half) = (all[0].pose, 0.005);
            let moves = order.map(|slab| {
                let own = SLABS[slab - 1];
                let quarter = 90.0 * (draw.within(0.0, 4.0).floor());
                under = on(&under, &flat(0.0, 0.0, half + own, quarter));
                half = own;
                (slab, under)
            });
            shown(all, &moves)
        };
        let domain = learned(&noisy(&recording((0..5).map(demo)), noise, seed));
        let plan = planned(&domain, slabs(&mut Draw(400 + seed)));
        let told = format!("seed {seed}: {plan:?}");
        assert!(plan.len() == 3 && plan[0].1 == "tray_0" && plan[1].1 == plan[0].0, "{told}");
        assert_eq!(plan[2].0, "thin_1", "{told}");
    }
}

#[test]
fn what_rides_on_a_shuttle_is_capped_before_it_is_packed() {
    for seed in 0..3 {
        let mut draw = Draw(500 + seed);
        let scene = |draw: &mut Draw| {
            let shuttle = flat(draw.within(-0.4, 0.4), 0.2, 0.1, 0.0);
            let riding = [-0.08, 0.08].map(|x| on(&shuttle, &flat(x, 0.0, 0.02, draw.yaw())));
            let caps = [draw.lying(0.01), draw.lying(0.01)];
            let crate_ = flat(draw.within(-0.3, 0.3), 0.7, 0.0, draw.yaw());
            let all = [("crate", crate_), ("shuttle", shuttle), ("part", riding[0])];
            let more = [("part", riding[1]), ("cap", caps[0]), ("cap", caps[1])];
            objects(&[&all[..], &more[..]].concat())
        };
        let demo = |number: usize| {
            let mut all = scene(&mut draw);
            let mut shown = shown(all.clone(), &[]);
            let end = shown.snapshots.pop();
            let parts = if number.is_multiple_of(2) { [2, 3] } else { [3, 2] };
            for (step, part) in parts.into_iter().chain(parts).enumerate() {
                let (moved, carrier) = if step < 2 { (part + 2, part) } else { (part, 0) };
                let place = if step < 2 { 0.0 } else { 0.06 * (2.0 * (step % 2) as f64 - 1.0) };
                let height = if step < 2 { 0.03 } else { 0.02 };
                let before = Snapshot { objects: all.clone(), ..contact(&shown.snapshots, moved) };
                shown.snapshots.push(before);
                let to = on(&all[carrier].pose, &flat(place, 0.0, height, draw.yaw()));
                put_with_riders(&mut all, moved, to);
                // Another machine moves the shuttle on, with all that is on it.
                let y = all[1].pose.position[1];
                let next = flat(draw.within(-0.4, 0.4), y, 0.1, 0.0);
                put_with_riders(&mut all, 1, next);
                let after = Snapshot { objects: all.clone(), ..release(&shown.snapshots, moved) };
                shown.snapshots.push(after);
            }
            let number = shown.snapshots.len() as u64;
            shown.snapshots.extend(end.map(|end| Snapshot { number, objects: all, ..end }));
            shown
        };
        let domain = learned(&recording((0..5).map(demo)));
        let frames: Vec<&str> = put(&domain, "cap").iter().map(|s| s.frame.name()).collect();
        assert_eq!(frames, ["part"], "seed {seed}");
        let packing = domain.operators.iter().find(|o| domain.states[o.to].kind == "part");
        let needs = &packing.expect("parts are packed").needs;
        assert!(
            needs.iter().any(|n| n.is_positive() && domain.states[n.condition.state].kind == "cap"),
            "seed {seed}: {needs:?}"
        );
    }
}

fn contact(before: &[Snapshot], object: usize) -> Snapshot {
    let event = Some(symbolt::task::SnapshotEvent::Contact);
    Snapshot { number: before.len() as u64, event, object: Some(object), ..Snapshot::default() }
}

fn release(before: &[Snapshot], object: usize) -> Snapshot {
    let event = Some(symbolt::task::SnapshotEvent::Release);
    Snapshot { event, ..contact(before, object) }
}

/// Puts an object somewhere, with the parts above it and their caps.
fn put_with_riders(all: &mut [ObjectPose], object: usize, to: Pose) {
    let old = all[object].pose;
    let riders: Vec<(usize, Pose)> = (2..all.len())
        .filter(|i| *i != object && *i > object)
        .filter_map(|i| {
            let (here, there) = (all[i].pose.position, old.position);
            let aside = (here[0] - there[0]).hypot(here[1] - there[1]);
            (aside < 0.1 && here[2] > there[2]).then(|| (i, beside(&old, &all[i].pose)))
        })
        .collect();
    all[object].pose = to;
    for (rider, pose) in riders {
        all[rider].pose = on(&to, &pose);
    }
}

/// The pose of `pose` in the frame of `reference`, both upright.
fn beside(reference: &Pose, pose: &Pose) -> Pose {
    let [x, y, z, w] = reference.orientation;
    let inverse = Pose { position: [0.0; 3], orientation: [-x, -y, -z, w] };
    let off: [f64; 3] = std::array::from_fn(|i| pose.position[i] - reference.position[i]);
    on(&inverse, &Pose { position: off, orientation: pose.orientation })
}

/// A cabinet with an upper and a lower drawer, shut, and a cup and a dish on the table.
fn cabinet(draw: &mut Draw) -> Vec<ObjectPose> {
    let cabinet = draw.fixture(0.3);
    let [upper, lower] = [0.1, -0.1].map(|z| on(&cabinet, &flat(0.0, 0.0, z, 0.0)));
    let (cup, dish) = (draw.lying(0.04), draw.lying(0.01));
    let drawers = [("upper", upper), ("lower", lower), ("cup", cup), ("dish", dish)];
    objects(&[&[("cabinet", cabinet)], &drawers[..]].concat())
}

#[test]
fn of_two_drawers_of_which_one_may_be_open_each_is_opened_filled_and_shut() {
    let mut draw = Draw(600);
    let demo = |number: usize| {
        let all = cabinet(&mut draw);
        let cabinet = all[0].pose;
        let order = if number.is_multiple_of(2) { [1, 2] } else { [2, 1] };
        let moves = order.into_iter().flat_map(|drawer| {
            let z = if drawer == 1 { 0.1 } else { -0.1 };
            let open = on(&cabinet, &flat(0.0, -0.2, z, 0.0));
            let inside = flat(draw.within(-0.02, 0.02), draw.within(-0.02, 0.02), 0.03, draw.yaw());
            // The drawer takes along what is in it, once it is shut.
            let shut = on(&cabinet, &flat(0.0, 0.0, z, 0.0));
            [(drawer, open), (drawer + 2, on(&open, &inside)), (drawer, shut)]
        });
        let moves: Vec<(usize, Pose)> = moves.collect();
        let mut shown = shown(all, &moves);
        for drawer in [1, 2] {
            // From when it was shut on, what is in it is further in.
            let shut = shown.snapshots.iter().rposition(|s| s.object == Some(drawer));
            let by: Pose = shown.snapshots[0].objects[drawer].pose;
            let shut = shut.expect("it is shut");
            let open = shown.snapshots[shut - 1].objects[drawer].pose;
            let inside = beside(&open, &shown.snapshots[shut - 1].objects[drawer + 2].pose);
            for snapshot in &mut shown.snapshots[shut..] {
                snapshot.objects[drawer + 2].pose = on(&by, &inside);
            }
        }
        shown
    };
    let domain = learned(&recording((0..5).map(demo)));
    let plan = planned(&domain, cabinet(&mut Draw(601)));
    let moved: Vec<&str> = plan.iter().map(|(object, _)| &**object).collect();
    let (upper, lower) = (["upper_1", "cup_3", "upper_1"], ["lower_2", "dish_4", "lower_2"]);
    let either = [[upper, lower].concat(), [lower, upper].concat()];
    assert!(either.contains(&moved), "{moved:?}");
}

/// A tray and two red and two blue bricks.
fn bricks(draw: &mut Draw) -> Vec<ObjectPose> {
    let mut all = vec![("tray", draw.fixture(0.0))];
    all.extend(["red", "red", "blue", "blue"].map(|kind| (kind, draw.lying(0.02))));
    objects(&all)
}

#[test]
fn a_row_is_filled_from_one_end_whatever_the_colours() {
    let mut draw = Draw(700);
    let slot = |tray: &Pose, k: usize| on(tray, &flat(0.06 * k as f64 - 0.09, 0.0, 0.02, 0.0));
    let demo = |number: usize| {
        let all = bricks(&mut draw);
        let order = [[1, 3, 2, 4], [3, 4, 1, 2], [1, 2, 3, 4], [3, 1, 4, 2], [3, 1, 2, 4]][number];
        let tray = all[0].pose;
        let moves: Vec<(usize, Pose)> =
            order.into_iter().enumerate().map(|(k, brick)| (brick, slot(&tray, k))).collect();
        shown(all, &moves)
    };
    let domain = learned(&recording((0..5).map(demo)));
    let again = RelationalDomain::parse(domain.to_json().expect("JSON").as_bytes(), "a file");
    assert_eq!(again.expect("it is read").operators, domain.operators);
    let objects = bricks(&mut Draw(701));
    let tray = objects[0].pose;
    let scene = Snapshot { objects, ..Snapshot::default() };
    let layout = Classifier::new(&domain).classify(&scene);
    let problem = Problem::new(&domain, &layout).expect("a problem");
    let plan = PlannerBuild::default().plan(&problem, &layout, PlannerBuild::LIMIT);
    let plan = plan.expect("a plan");
    assert_eq!((plan.end, plan.moves.len()), (SceneEnd::Met, 4));
    for (k, step) in plan.moves.iter().enumerate() {
        let off = step.target.pose.distance(&slot(&tray, k));
        assert!(off < 2e-3, "move {k} is {off} m off");
    }
    // The program that plans without neurons keeps the order, too.
    let plan = problem.plan(&layout.situation(), &[]).expect("a plan");
    let off = |(k, step): (usize, &symbolt::task::compile::PlannedMove)| {
        problem.target(&step.action, &layout).pose.distance(&slot(&tray, k))
    };
    assert!(plan.iter().enumerate().map(off).all(|off| off < 2e-3), "{plan:?}");
}

#[test]
fn a_box_that_two_looks_show_turned_by_noise_is_still_where_things_were_put() {
    let mut draw = Draw(800);
    let demo = |number: usize| {
        let box_ = draw.fixture(0.0);
        let inside = |draw: &mut Draw| {
            let (x, y) = (draw.within(-0.04, 0.04), draw.within(-0.04, 0.04));
            on(&box_, &flat(x, y, 0.02, draw.yaw()))
        };
        let all =
            objects(&[("box", box_), ("brick", draw.lying(0.02)), ("brick", draw.lying(0.02))]);
        let moves = [(1, inside(&mut draw)), (2, inside(&mut draw))];
        (number, shown(all, &moves))
    };
    let demos: Vec<_> = (0..5).map(demo).collect();
    let mut noisy = noisy(&recording(demos.into_iter().map(|(_, demo)| demo)), 1.0, 3);
    // After the first brick, two looks at the box are turned by 3 degrees either way.
    for (snapshot, degrees) in [(2, 3.0), (3, -3.0)] {
        let pose = &mut noisy.demos[1].snapshots[snapshot].objects[0].pose;
        *pose = on(pose, &flat(0.0, 0.0, 0.0, degrees));
    }
    let domain = learned(&noisy);
    let frames: Vec<&str> = put(&domain, "brick").iter().map(|s| s.frame.name()).collect();
    assert_eq!(frames, ["box"]);
}

/// Returns the orders of places of all actions.
fn orders(domain: &RelationalDomain) -> usize {
    domain.operators.iter().map(|operator| operator.order.len()).sum()
}

#[test]
fn the_free_one_of_two_slots_is_filled_in_no_order() {
    let mut draw = Draw(710);
    let slot = |rack: &Pose, k: usize| on(rack, &flat(0.12 * k as f64 - 0.06, 0.0, 0.02, 0.0));
    let mut scene = |full: usize| {
        let rack = draw.fixture(0.0);
        let all = [("rack", rack), ("peg", slot(&rack, full)), ("peg", draw.lying(0.02))];
        (objects(&all), slot(&rack, 1 - full))
    };
    let demo = |number: usize| {
        let (all, free) = scene(number % 2);
        shown(all, &[(2, free)])
    };
    let domain = learned(&recording((0..8).map(demo)));
    // What lay there from the beginning had no turn: else each slot would wait for the other.
    assert_eq!(orders(&domain), 0, "{:?}", domain.operators);
    let (all, _) = scene(0);
    assert_eq!(planned(&domain, all).len(), 1);
}

#[test]
fn places_of_another_kind_that_were_always_filled_before_are_a_condition_and_no_order() {
    let mut draw = Draw(720);
    let slot = |tray: &Pose, k: usize| on(tray, &flat(0.06 * k as f64 - 0.09, 0.0, 0.02, 0.0));
    let demo = |_| {
        let all = bricks(&mut draw);
        let tray = all[0].pose;
        let moves: Vec<(usize, Pose)> =
            (1..5).map(|brick| (brick, slot(&tray, brick - 1))).collect();
        shown(all, &moves)
    };
    let domain = learned(&recording((0..6).map(demo)));
    // In each colour the second slot may have an order after the first one, but the blue ones have none after the red ones.
    let kind = |state: usize| &domain.states[state].kind;
    let mixed = domain.operators.iter().filter(|operator| {
        let mut all = operator.order.iter().flat_map(|before| &before.one_of);
        all.any(|(state, _)| kind(*state) != kind(operator.to))
    });
    assert_eq!(mixed.count(), 0, "{:?}", domain.operators);
}
