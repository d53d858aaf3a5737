//! Bodies that move besides free parts: a jig that another hand moves, a drawer on its guide, a cup that is turned
//! over.

#![allow(clippy::unwrap_used, clippy::expect_used)]
#![cfg(feature = "physics")]

use std::f64::consts::FRAC_PI_2;

use symbolt::robot::Pose;
use symbolt::robot::arm::BodyFrame;
use symbolt::robot::scene::{BodyId, Scene, SceneSpec};
use symbolt::robot::skill::{Robot, Target};
use symbolt::robot::{SkillOutcome, SkillReport};
use symbolt::sim::Seed;
use symbolt::task::execute::{EpisodeSpec, Perturbation, episode};
use symbolt::task::learn::{Settings, learn};
use symbolt::task::planner::{PlannerBuild, PlannerKind};
use symbolt::task::tasks::file::{DataTask, Quantity, Region};
use symbolt::task::tasks::{self, Task};
use symbolt::task::{SnapshotEvent, demonstrate};

const JIG: BodyId = BodyId::Fixture(0);

const CUP: &str = include_str!("../../src/task/tasks/files/cup.json");
const DRAWER: &str = include_str!("../../src/task/tasks/files/drawer.json");
const MOVABLE: &str = include_str!("../../src/task/tasks/files/movable-jig.json");

fn file(text: &str) -> DataTask {
    DataTask::parse(text.as_bytes(), "task.json").expect("it is valid")
}

/// Returns the drawer task with one or two blocks.
fn drawer(blocks: usize) -> DataTask {
    let mut file = file(DRAWER).file().clone();
    if blocks == 2 {
        file.parts[1].starts[0].count = 2;
        let inside = &mut file.goal[0];
        inside.quantity = Quantity::AtLeast(2);
        let [first, second] = [-0.022, 0.022].map(|y| {
            let mut place = inside.places[0];
            place.position[1] = y;
            place
        });
        inside.places = vec![first, second];
        inside.within_m[1] = Some(0.02);
    }
    DataTask::new(file).expect("it is valid")
}

fn built(task: &dyn Task, seed: u64) -> Scene {
    Scene::new(task.scene(Seed::new(seed)).expect("it can be drawn")).expect("it can be built")
}

fn put(task: &dyn Task, scene: &mut Scene, part: usize, target: Target) -> SkillReport {
    put_with(&mut Robot::default(), task, scene, part, target)
}

fn put_with(
    robot: &mut Robot,
    task: &dyn Task,
    scene: &mut Scene,
    part: usize,
    target: Target,
) -> SkillReport {
    let grasps = task.grasps(&scene.sensed(), part);
    if let Err(report) = robot.begin(&scene.sensed(), part, target, &grasps, None) {
        return report;
    }
    let ended = (0..30_000).find_map(|_| robot.step(scene).ended);
    ended.expect("a skill ends")
}

fn rest(scene: &mut Scene) {
    for _ in 0..300 {
        scene.step();
    }
}

/// Returns the angle about z of a body that stands on the table, in radians.
fn yaw(pose: &Pose) -> f64 {
    let [x, y, _] = BodyFrame::from(pose).turn.apply([1.0, 0.0, 0.0]);
    y.atan2(x)
}

/// Returns how far two angles are apart if quarter turns do not count.
fn apart(a: f64, b: f64) -> f64 {
    let rest = (a - b).rem_euclid(FRAC_PI_2);
    rest.min(FRAC_PI_2 - rest)
}

fn distance(a: &Pose, b: &Pose) -> f64 {
    let squares = a.position.iter().zip(b.position).map(|(a, b)| (a - b).powi(2));
    squares.sum::<f64>().sqrt()
}

#[test]
fn a_drawer_is_opened_filled_and_closed_by_friction_alone() {
    for blocks in [1, 2] {
        let task = drawer(blocks);
        let scene = built(&task, 1);
        assert_eq!((scene.joint_counts(), scene.sliders()), ((9, 0), 1));
        let shown = demonstrate(&task, 1, Seed::new(1)).expect("it can be shown");
        assert_eq!(shown.solved, 1, "{:?}", shown.skills);
        assert_eq!(shown.skills[0].len(), 2 + blocks);
        // Contact and release of the drawer are recorded as for any other part, and the blocks move along.
        let snapshots = &shown.recording.demos[0].snapshots;
        let count = |event| snapshots.iter().filter(|s| s.event == Some(event)).count();
        assert_eq!(count(SnapshotEvent::Contact), 2 + blocks);
        assert_eq!(count(SnapshotEvent::Release), 2 + blocks);
        let last = snapshots.len() - 1;
        let moved = |object: usize, from: usize| {
            distance(&snapshots[from].objects[object].pose, &snapshots[last].objects[object].pose)
        };
        for object in 0..=blocks {
            // From the contact before closing to the end.
            assert!((moved(object, last - 2) - 0.105).abs() < 8e-3, "object {object}");
        }
    }
}

#[test]
fn a_drawer_goes_no_farther_than_its_guide_and_not_beside_it() {
    let task = drawer(1);
    let mut scene = built(&task, 2);
    let at = scene.body_frame(0).expect("there");
    let to = |by: [f64; 3]| {
        let by = at.turn.apply(by);
        Target::anyhow(std::array::from_fn(|i| at.position[i] + by[i]))
    };
    for beside in [[0.05, 0.04, 0.0], [0.05, 0.0, 0.05], [0.2, 0.0, 0.0]] {
        let report = put(&task, &mut scene, 0, to(beside));
        assert_eq!(report.outcome, SkillOutcome::Unreachable, "{beside:?}");
    }
    let report = put(&task, &mut scene, 0, to([0.07, 0.0, 0.0]));
    assert!(report.picked && report.outcome == SkillOutcome::Placed, "{report:?}");
    assert!((scene.slid_m(0).expect("it slides") - 0.07).abs() < 3e-3);
    assert_eq!(scene.slid_m(1), None);
    // The guide turns nothing and lifts nothing.
    let now = scene.body_frame(0).expect("there");
    let axes = [at, now].map(|frame| frame.turn.apply([1.0, 0.0, 0.0]));
    assert!((0..3).all(|i| (axes[0][i] - axes[1][i]).abs() < 1e-3));
    assert!((at.position[2] - now.position[2]).abs() < 1e-3);
}

#[test]
fn an_open_drawer_with_everything_in_it_is_not_solved() {
    let task = drawer(1);
    let mut scene = built(&task, 3);
    let inside = |scene: &Scene| {
        let [x, y, z] = scene.part(0).expect("there").position;
        Pose::at([x, y, z + 0.017])
    };
    assert!(!task.judge(&scene).solved);
    let at = scene.body_frame(0).expect("there");
    let by = at.turn.apply([0.105, 0.0, 0.0]);
    let open = Target::anyhow(std::array::from_fn(|i| at.position[i] + by[i]));
    let mut robot = Robot::default();
    assert_eq!(put_with(&mut robot, &task, &mut scene, 0, open).outcome, SkillOutcome::Placed);
    let pose = inside(&scene);
    scene.disturb(1, &pose);
    rest(&mut scene);
    assert!(!task.judge(&scene).solved, "{:?}", task.judge(&scene));
    let closed = Target::anyhow(at.position);
    assert_eq!(put_with(&mut robot, &task, &mut scene, 0, closed).outcome, SkillOutcome::Placed);
    assert!(task.judge(&scene).solved, "{:?}", task.judge(&scene));
}

#[test]
fn a_target_may_say_the_whole_orientation_or_nothing_about_it() {
    let task = drawer(1);
    for angle in [0.3f64, 1.1] {
        let mut scene = built(&task, 4);
        let (sin, cos) = (angle / 2.0).sin_cos();
        let pose = Pose { position: [0.46, 0.05, 0.016], orientation: [0.0, 0.0, sin, cos] };
        assert_eq!(put(&task, &mut scene, 1, Target::pose(&pose)).outcome, SkillOutcome::Placed);
        let now = scene.part(1).expect("there");
        assert!(distance(&now, &pose) < 3e-3, "{now:?}");
        assert!(apart(yaw(&now), angle) < 0.02, "{} for {angle}", yaw(&now));
    }
    let mut scene = built(&task, 4);
    let before = yaw(&scene.part(1).expect("there"));
    let report = put(&task, &mut scene, 1, Target::anyhow([0.46, 0.05, 0.016]));
    assert_eq!(report.outcome, SkillOutcome::Placed);
    let turned = yaw(&scene.part(1).expect("there")) - before;
    // It was turned by a whole number of steps of 15 degrees, if at all.
    let step = 15f64.to_radians();
    let off = turned.rem_euclid(step);
    assert!(off.min(step - off) < 0.02, "{turned}");
}

#[test]
fn a_jig_takes_along_what_lies_in_it_and_its_places_follow() {
    let task = file(MOVABLE);
    let mut scene = built(&task, 1);
    let [pocket, hole] = [0, 1].map(|i| scene.landmark(i).expect("there"));
    assert_ne!(pocket, built(&task, 2).landmark(0).expect("there"), "another place in each scene");
    // A nut is put into the pocket by another hand.
    let [x, y, z] = pocket.position;
    scene.disturb(0, &Pose { position: [x, y, z + 0.009], ..pocket });
    rest(&mut scene);
    let held = |scene: &Scene| task.judge(scene).achieved;
    assert_eq!(held(&scene), ["nut in the pocket: part 0, jig_0"]);
    assert_eq!(scene.carried(0), [0]);
    let bystander = scene.part(1).expect("there");
    let before = scene.body(JIG).expect("it moves");
    let pose = task.perturbation(Seed::new(7)).expect("there is one").pose;
    assert!(distance(&before, &pose) > 5e-3 && scene.room_for(JIG, &pose));
    scene.displace(JIG, &pose);
    rest(&mut scene);
    assert!(distance(&scene.body(JIG).expect("it moves"), &pose) < 1e-9);
    assert_eq!(held(&scene), ["nut in the pocket: part 0, jig_0"]);
    let moved = [0, 1].map(|i| scene.landmark(i).expect("there"));
    assert!(distance(&moved[0], &pocket) > 5e-3);
    assert!((distance(&moved[0], &moved[1]) - distance(&pocket, &hole)).abs() < 1e-9);
    assert!(distance(&scene.part(1).expect("there"), &bystander) < 1e-4);
    // Pictures list the parts and then the jig.
    assert_eq!(scene.frame().parts.len(), scene.part_count() + 1);
    assert_eq!(scene.frame().parts.len(), scene.spec().pictured());
    // There is no room where a part lies.
    let [x, y, _] = bystander.position;
    let on_part = Pose { position: [x, y, 0.0], ..pose };
    assert!(!scene.room_for(JIG, &on_part) && !scene.room_for(BodyId::Fixture(1), &pose));
}

/// The places of this jig never differ, so that states learned in the scene's frame hold.
#[test]
fn a_hand_that_moves_the_jig_during_an_episode_takes_along_what_lies_in_it() {
    let mut still = file(MOVABLE).file().clone();
    still.parts.truncate(2);
    for part in &mut still.parts {
        part.starts[0].count = 1;
    }
    let region = Region {
        low: [0.47, -0.16],
        high: None,
        yaw_deg: [0.0; 2],
        ..still.perturbations[0].to.clone()
    };
    still.references[0].starts[0].region = Some(region.clone());
    still.perturbations[0].to = region;
    let task = DataTask::new(still).expect("it is valid");
    let shown = demonstrate(&task, 2, Seed::new(1)).expect("it can be shown");
    assert_eq!(shown.solved, 2, "{:?}", shown.skills);
    let domain = learn(&shown.recording, &Settings::paper()).expect("it teaches").domain;
    let perturbation = task.perturbation(Seed::new(1));
    let spec = EpisodeSpec { perturbation, ..EpisodeSpec::of(task) };
    let build = PlannerBuild { kind: PlannerKind::Chain, ..PlannerBuild::default() };
    let report = episode(&domain, &build, &spec, Seed::new(5)).expect("it runs").report;
    assert!(report.perturbed() && report.solved && !report.false_goal(), "{report:?}");
    // A body that does not move is refused.
    let body = BodyId::Fixture(1);
    let perturbation = spec.perturbation.map(|p| Perturbation { body, ..p });
    let refused = EpisodeSpec { perturbation, ..spec }.check().expect_err("no such body");
    assert!(refused.to_string().starts_with("`perturbation.body` is Fixture(1)"), "{refused}");
}

#[test]
fn the_tasks_are_demonstrated_in_scenes_that_differ() {
    for name in ["movable-jig", "drawer", "cup"] {
        let task = tasks::by_name(name).expect("it is built in");
        let shown = demonstrate(&*task, 2, Seed::new(3)).expect("it can be shown");
        assert_eq!(shown.solved, 2, "{name}: {:?}", shown.skills);
        assert!(shown.skills.iter().all(|skills| skills.len() >= task.min_actions()));
        let text = task.settings().to_string();
        let same = task.with_settings(text.as_bytes(), "own.json").expect("its own settings");
        assert_eq!(same.settings(), task.settings());
    }
}

#[test]
fn a_cup_upside_down_over_the_cube_is_not_filled() {
    let task = file(CUP);
    let mut scene = built(&task, 1);
    let pose = scene.part(0).expect("there");
    let [x, y, z] = pose.position;
    scene.disturb(1, &Pose::at([x, y, 0.011]));
    rest(&mut scene);
    let judged = task.judge(&scene);
    assert!(!judged.solved && !judged.achieved.iter().any(|a| a.starts_with("cup upright")));
    // Upright with the cube in it, it is.
    scene.disturb(1, &Pose::at([0.45, 0.25, 0.011]));
    scene.disturb(0, &Pose::at([x, y, z + 1e-3]));
    scene.disturb(1, &Pose::at([x, y, 0.03]));
    rest(&mut scene);
    assert!(task.judge(&scene).solved, "{:?}", task.judge(&scene));
}

#[test]
fn landmarks_and_guides_without_a_body_are_refused() {
    let refused = |change: fn(&mut SceneSpec)| {
        let mut spec = drawer(1).scene(Seed::new(1)).expect("drawn");
        change(&mut spec);
        Scene::new(spec).map(|_| ()).expect_err("it is refused").to_string()
    };
    let cases: [(&str, String); 5] = [
        // The cabinet never moves.
        ("landmarks", refused(|s| s.landmarks[0].body = Some(JIG))),
        ("landmarks", refused(|s| s.landmarks[0].body = Some(BodyId::Part(9)))),
        ("slider", refused(|s| s.parts[0].slider.as_mut().unwrap().axis = [0.0; 3])),
        ("slider", refused(|s| s.parts[0].slider.as_mut().unwrap().range_m = [0.1, 0.0])),
        ("slider", refused(|s| s.parts[0].slider.as_mut().unwrap().fixture = Some(4))),
    ];
    for (name, message) in cases {
        assert!(message.starts_with(&format!("`{name}` is ")), "{name}: {message}");
    }
}
