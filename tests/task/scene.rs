//! The assembly scene, the robot's skills and the closed loop, simulated in physics.

#![allow(clippy::unwrap_used, clippy::expect_used)]
#![cfg(feature = "physics")]

use std::f64::consts::{FRAC_PI_3, FRAC_PI_6};
use std::sync::{Arc, OnceLock};

use rayon::prelude::*;
use symbolt::robot::Pose;
use symbolt::robot::arm::{BodyFrame, GripperSpec};
use symbolt::robot::scene::{BodyId, Scene, SceneSpec, Sensed};
use symbolt::robot::skill::{Grasp, Robot, Target, any_grasps, free_places, pushes, turns_over};
use symbolt::robot::{SkillOutcome, SkillReport};
use symbolt::sim::{
    Live, LiveError, LiveOptions, RunConfig, Seed, SimDuration, SimError, SimView, Simulator, Stop,
    StopReason,
};
use symbolt::task::classify::Classifier;
use symbolt::task::domain::RelationalDomain;
use symbolt::task::event::{Doing, Ended, EpisodeReport, Ignore, RecoveryKind};
use symbolt::task::execute::{
    Driver, Episode, EpisodeSpec, EpisodeWorld, Perturbation, PreparedEpisode, episode,
};
use symbolt::task::learn::{Settings, learn};
use symbolt::task::planner::{PlannerBuild, PlannerKind};
use symbolt::task::tasks::nuts_and_bolts::{MAX_OF_A_KIND, NutsAndBolts, PartSpec};
use symbolt::task::tasks::{Demonstrator, Judgement, Task};
use symbolt::task::{TaskError, demonstrate};

/// A domain learned from two demonstrations with one nut and one bolt.
fn taught() -> &'static RelationalDomain {
    static TAUGHT: OnceLock<RelationalDomain> = OnceLock::new();
    TAUGHT.get_or_init(|| taught_in(&NutsAndBolts::default(), 2))
}

fn taught_in(spec: &NutsAndBolts, demos: usize) -> RelationalDomain {
    let shown = demonstrate(spec, demos, Seed::new(1)).expect("a valid scene");
    assert_eq!(shown.solved, demos);
    learn(&shown.recording, &Settings::paper()).expect("it teaches").domain
}

/// The paper's planner.
fn chain() -> PlannerBuild {
    PlannerBuild { kind: PlannerKind::Chain, ..PlannerBuild::default() }
}

fn run(domain: &RelationalDomain, spec: &EpisodeSpec, seed: Seed) -> Episode {
    episode(domain, &chain(), spec, seed).expect("runs")
}

fn prepared<'d>(
    domain: &'d RelationalDomain,
    spec: &EpisodeSpec,
    seed: Seed,
) -> PreparedEpisode<'d> {
    PreparedEpisode::new(domain, &chain(), spec, seed).expect("sound")
}

fn pocket(spec: &NutsAndBolts) -> Target {
    let [x, y] = spec.jig.pocket;
    let z = spec.jig.pocket_floor_m + spec.part.nut_height_m / 2.0;
    Target::upright([x, y, z])
}

fn hole(spec: &NutsAndBolts) -> Target {
    let [x, y] = spec.jig.hole;
    Target::upright([x, y, spec.jig.hole_top_m])
}

fn built(spec: &NutsAndBolts, seed: u64) -> Scene {
    Scene::new(spec.scene(Seed::new(seed)).expect("it can be drawn")).expect("it can be built")
}

/// Begins a skill with the grasps of the default settings, which the tests' settings do not change.
fn begin(robot: &mut Robot, scene: &Scene, part: usize, target: Target) -> Result<(), SkillReport> {
    robot.begin(
        &scene.sensed(),
        part,
        target,
        &NutsAndBolts::default().grasps(&scene.sensed(), part),
        None,
    )
}

fn put(scene: &mut Scene, robot: &mut Robot, part: usize, target: Target) -> SkillReport {
    if let Err(report) = begin(robot, scene, part, target) {
        return report;
    }
    for _ in 0..30_000 {
        if let Some(report) = robot.step(scene).ended {
            return report;
        }
    }
    panic!("a skill that does not end");
}

#[test]
fn parts_lie_on_the_table_and_the_only_joints_are_the_robots() {
    let spec = NutsAndBolts { nuts: 3, bolts: 3, ..NutsAndBolts::default() };
    let scene = built(&spec, 1);
    // Seven joints and two fingers, and no joint that could hold a part.
    assert_eq!(scene.joint_counts(), (9, 0));
    let kinds: Vec<usize> = scene.kinds().collect();
    assert_eq!(kinds, [0, 0, 0, 1, 1, 1]);
    for index in 0..kinds.len() {
        let (kind, pose) = (scene.kind(index).expect("there"), scene.part(index).expect("there"));
        let (z, rest) = (pose.position[2], if kind.name == "nut" { 0.0080 } else { 0.0149 });
        assert!((z - rest).abs() < 5e-4, "{} at {z}", kind.name);
    }
}

#[test]
fn the_fullest_table_has_room_whatever_the_seed() {
    let spec =
        NutsAndBolts { nuts: MAX_OF_A_KIND, bolts: MAX_OF_A_KIND, ..NutsAndBolts::default() };
    for seed in 0..10 {
        let scene = built(&spec, seed);
        assert_eq!(scene.part_count(), 2 * MAX_OF_A_KIND, "seed {seed}");
    }
}

#[test]
fn a_part_is_held_by_friction_and_without_it_the_lift_fails() {
    let spec = NutsAndBolts::default();
    let mut scene = built(&spec, 1);
    let report = put(&mut scene, &mut Robot::default(), 0, pocket(&spec));
    assert_eq!(report.outcome, SkillOutcome::Placed);
    assert!(report.picked && report.slip_m < 1e-3, "{report:?}");
    assert_eq!(spec.assembly(&scene).nut_in_pocket, Some(0));
    assert_eq!(scene.joint_counts(), (9, 0));

    let slippery = NutsAndBolts {
        part: PartSpec { friction: 0.01, ..PartSpec::default() },
        gripper: GripperSpec { friction: 0.01, ..GripperSpec::default() },
        ..NutsAndBolts::default()
    };
    let mut scene = built(&slippery, 1);
    let report = put(&mut scene, &mut Robot::default(), 0, pocket(&spec));
    assert_ne!(report.outcome, SkillOutcome::Placed, "{report:?}");
    assert_eq!(spec.assembly(&scene).nut_in_pocket, None);
}

#[test]
fn what_cannot_be_reached_is_said_at_once_and_nothing_hangs() {
    let spec = NutsAndBolts::default();
    let mut scene = built(&spec, 1);
    let far = Target::upright([1.5, 0.0, 0.05]);
    let before = scene.steps();
    let report = put(&mut scene, &mut Robot::default(), 0, far);
    assert_eq!((report.outcome, scene.steps()), (SkillOutcome::Unreachable, before));
    // A bolt on its head has no flats that can be grasped from above.
    let upside_down = Pose { position: [0.45, 0.1, 0.0125], orientation: [1.0, 0.0, 0.0, 0.0] };
    scene.disturb(1, &upside_down);
    for _ in 0..100 {
        scene.step();
    }
    let report = put(&mut scene, &mut Robot::default(), 1, pocket(&spec));
    assert_eq!(report.outcome, SkillOutcome::Unreachable);
}

#[test]
fn the_robot_does_what_it_was_shown_and_the_same_seed_gives_the_same_bits() {
    let domain = taught();
    assert_eq!((domain.states.len(), domain.operators.len()), (5, 3));
    let twice = || {
        let spec = EpisodeSpec { frame_ms: Some(200), ..EpisodeSpec::default() };
        run(domain, &spec, Seed::new(5))
    };
    let (first, second) = (twice(), twice());
    assert_eq!(first.report.ended, Ended::GoalMet);
    assert!(first.report.solved && !first.report.false_goal());
    assert_eq!(first.report.skills().count(), 3);
    assert!(first.frames.len() > 100);
    assert_eq!(first.report, second.report);
    assert_eq!(first.frames, second.frames);
}

#[test]
fn a_snapshot_in_mid_grasp_goes_on_as_if_nothing_had_happened() {
    let domain = taught();
    let start = || {
        let spec = EpisodeSpec { frame_ms: Some(40), ..EpisodeSpec::default() };
        let prepared = prepared(domain, &spec, Seed::new(3));
        let graph = prepared.planner().graph().clone();
        let world = prepared.into_world().expect("sound");
        let run = RunConfig::seeded(Seed::new(3)).in_world(world);
        Simulator::new(graph, run).expect("starts")
    };
    let poses = |sim: &Simulator| {
        let scene = EpisodeWorld::of(sim.world()).and_then(EpisodeWorld::scene).expect("there");
        (scene.tool(), scene.part(0), scene.part(1), scene.steps())
    };
    let mut original = start();
    original.run_for(SimDuration::from_millis(6_000)).expect("runs");
    let doing = EpisodeWorld::of(original.world()).expect("there").doing();
    assert!(matches!(doing, Doing::Acting(_)), "{doing:?}");
    let checkpoint = original.checkpoint().expect("it can be saved");
    let held = poses(&original);
    original.run_for(SimDuration::from_millis(4_000)).expect("runs");
    let mut copy = start();
    copy.restore(&checkpoint).expect("it is of the same graph and world");
    assert_eq!(poses(&copy), held);
    copy.run_for(SimDuration::from_millis(4_000)).expect("runs");
    assert_eq!(poses(&copy), poses(&original));
    assert_ne!(poses(&copy), held);
}

#[test]
fn a_world_refuses_the_save_of_a_scene_with_another_number_of_parts() {
    let domain = taught();
    let graph = prepared(domain, &EpisodeSpec::default(), Seed::new(3)).planner().graph().clone();
    let start = |nuts: usize| {
        let task = Arc::new(NutsAndBolts { nuts, ..NutsAndBolts::default() });
        let spec = EpisodeSpec { task, ..EpisodeSpec::default() };
        let prepared = prepared(domain, &spec, Seed::new(3));
        let world = prepared.into_world().expect("sound");
        // The graph is the same for both.
        let run = RunConfig::seeded(Seed::new(3)).in_world(world);
        Simulator::new(graph.clone(), run).expect("starts")
    };
    let (mut one, two) = (start(1), start(2));
    let own = one.checkpoint().expect("it can be saved");
    let others = two.checkpoint().expect("it can be saved");
    let refused = one.restore(&others).expect_err("another scene");
    assert!(matches!(refused, SimError::World { .. }), "{refused:?}");
    let expected = "the checkpoint's scene has 3 parts; expected 2, as in this world's task";
    assert!(refused.to_string().contains(expected), "{refused}");
    assert_eq!(one.checkpoint().expect("it can be saved"), own);
    one.restore(&own).expect("its own");
}

#[test]
fn a_bolt_that_another_hand_puts_into_the_jig_is_used() {
    let domain = taught();
    let scene = NutsAndBolts { nuts: 1, bolts: 2, ..NutsAndBolts::default() };
    let [x, y] = scene.jig.hole;
    let pose = Pose::at([x, y, scene.jig.hole_top_m + 1e-3]);
    let perturbation = Some(Perturbation { at_s: 1.0, body: BodyId::Part(2), pose });
    let spec = EpisodeSpec { perturbation, ..EpisodeSpec::of(scene) };
    let over = run(domain, &spec, Seed::new(2));
    assert!(over.report.perturbed() && over.report.solved, "{:?}", over.report);
}

/// With longer substeps the bolt rattled in the nut and moved half a millimetre.
#[test]
fn an_assembly_comes_to_rest() {
    let spec = NutsAndBolts::default();
    let mut scene = built(&spec, 1);
    let mut robot = Robot::default();
    assert_eq!(put(&mut scene, &mut robot, 0, pocket(&spec)).outcome, SkillOutcome::Placed);
    assert_eq!(put(&mut scene, &mut robot, 1, hole(&spec)).outcome, SkillOutcome::Placed);
    let [x, y] = spec.jig.pocket;
    let top = spec.jig.pocket_floor_m + spec.part.nut_height_m;
    let nut = Target::upright([x, y, top]);
    assert_eq!(put(&mut scene, &mut robot, 1, nut).outcome, SkillOutcome::Placed);
    assert!(spec.assembly(&scene).is_assembled());
    let places = |scene: &Scene| [0, 1].map(|i| scene.part(i).expect("there").position);
    let before = places(&scene);
    for _ in 0..500 {
        robot.step(&mut scene);
    }
    for (was, is) in before.iter().zip(places(&scene)) {
        let moved = was.iter().zip(is).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        assert!(moved < 5e-5, "{moved} m in two seconds");
    }
}

#[test]
fn a_part_is_not_put_where_another_has_come_to_be() {
    let spec = NutsAndBolts { bolts: 2, ..NutsAndBolts::default() };
    let mut scene = built(&spec, 1);
    let mut robot = Robot::default();
    let began = scene.part(1).expect("there").position;
    begin(&mut robot, &scene, 1, hole(&spec)).expect("it is within reach");
    for _ in 0..500 {
        robot.step(&mut scene);
    }
    let [x, y] = spec.jig.hole;
    scene.disturb(2, &Pose::at([x, y, spec.jig.hole_top_m + 1e-3]));
    let report = (0..20_000).find_map(|_| robot.step(&mut scene).ended).expect("it ends");
    assert_eq!(report.outcome, SkillOutcome::Occupied);
    // The part is back where it was.
    let ended = scene.part(1).expect("there").position;
    assert!((ended[0] - began[0]).hypot(ended[1] - began[1]) < 0.02, "{began:?} {ended:?}");
    assert_eq!(spec.assembly(&scene).bolt_in_hole, Some(2));
}

#[test]
fn another_hand_waits_while_there_is_no_room() {
    let domain = taught();
    // A place inside the table is never free.
    let perturbation =
        Some(Perturbation { at_s: 0.0, body: BodyId::Part(1), pose: Pose::at([0.45, 0.1, -0.01]) });
    let spec = EpisodeSpec { perturbation, ..EpisodeSpec::default() };
    let over = run(domain, &spec, Seed::new(2));
    assert!(!over.report.perturbed() && over.report.solved, "{:?}", over.report);
}

/// With the arm low beside the jig and the hand level, every straight path to the next part touched
/// something.
#[test]
fn after_a_bolt_has_been_put_there_is_a_way_to_the_next_part() {
    let domain = taught();
    for index in [5, 128] {
        let seed = Seed::new(101).derive_index("episode", index);
        let report = run(domain, &EpisodeSpec::default(), seed).report;
        assert_eq!((report.solved, report.replans()), (true, 0), "{index}: {report:?}");
    }
}

#[test]
fn drops_are_followed_by_new_decisions() {
    let domain = taught();
    let scene = NutsAndBolts { nuts: 2, bolts: 2, ..NutsAndBolts::default() };
    let spec = EpisodeSpec { drop_rate: 0.5, ..EpisodeSpec::of(scene) };
    let over = run(domain, &spec, Seed::new(4));
    let report = over.report;
    assert!(report.drops() > 0, "at this rate one of the first grasps slips: {report:?}");
    assert!(report.replans() >= report.drops());
    assert!(report.decisions.len() > report.skills().count());
    assert!(!report.false_goal());
    // Taking another part, another grasp or the same part again is told as a recovery.
    let kinds = [RecoveryKind::Again, RecoveryKind::Grasp, RecoveryKind::Part];
    let told = |report: &EpisodeReport| kinds.map(|kind| count(report, kind));
    assert!(told(&report).iter().sum::<usize>() >= report.drops(), "{report:?}");
    let alone = EpisodeSpec { drop_rate: 0.5, ..EpisodeSpec::of(NutsAndBolts::default()) };
    let over = run(domain, &alone, Seed::new(4));
    assert!(over.report.drops() > 0 && told(&over.report)[0] > 0, "{:?}", over.report);
}

/// Only the demonstrator knows the task: in a mirrored scene with the jig elsewhere and other names for
/// everything, the rest works as before.
#[test]
fn other_names_another_jig_and_a_mirror_change_nothing() {
    let mut spec = NutsAndBolts {
        nut_kind: "washer".into(),
        bolt_kind: "peg".into(),
        ..NutsAndBolts::default().mirrored()
    };
    spec.jig.pocket = [0.50, 0.24];
    spec.jig.hole = [0.40, 0.16];
    let domain = taught_in(&spec, 2);
    assert_eq!((domain.states.len(), domain.operators.len()), (5, 3));
    assert!(domain.states.iter().all(|s| s.kind == "washer" || s.kind == "peg"));
    let spec = EpisodeSpec::of(spec);
    let over = run(&domain, &spec, Seed::new(7));
    assert!(over.report.solved, "{:?}", over.report);
}

/// A part with a side or its head below.
const OVER: [f64; 4] = [1.0, 0.0, 0.0, 0.0];
const ON_SIDE: [f64; 4] =
    [0.0, std::f64::consts::FRAC_1_SQRT_2, 0.0, std::f64::consts::FRAC_1_SQRT_2];

/// Puts a part into a pose and lets it settle.
fn drop_at(scene: &mut Scene, robot: &mut Robot, part: usize, pose: &Pose) {
    scene.disturb(part, pose);
    for _ in 0..500 {
        robot.step(scene);
    }
}

fn finish(scene: &mut Scene, robot: &mut Robot) -> SkillReport {
    (0..30_000).find_map(|_| robot.step(scene).ended).expect("a skill ends")
}

/// Puts a part at a target as the task would, and, where its grasps do not do, lays the part down elsewhere or pushes
/// it. Returns what was done.
fn recover(scene: &mut Scene, part: usize, target: Target) -> Vec<&'static str> {
    let (mut robot, mut done) = (Robot::default(), Vec::new());
    for attempt in 0..6 {
        if begin(&mut robot, scene, part, target).is_ok() {
            done.push("put");
            finish(scene, &mut robot);
            return done;
        }
        let grasps = any_grasps(&scene.sensed(), part);
        let places = free_places(&scene.sensed(), part);
        let mut over = places.iter().filter(|place| turns_over(&scene.sensed(), part, place));
        if over.any(|place| robot.begin(&scene.sensed(), part, *place, &grasps, None).is_ok()) {
            done.push("laid down");
        } else {
            let all = pushes(&scene.sensed(), part);
            let push =
                all.iter().skip(attempt).find(|p| robot.begin_push(&scene.sensed(), p).is_ok());
            done.push(if push.is_some() { "pushed" } else { "nothing" });
        }
        if robot.busy() {
            finish(scene, &mut robot);
        }
    }
    done
}

#[test]
fn a_part_on_its_edge_or_head_for_which_the_task_has_no_grasp_is_put_at_its_target() {
    let spec = NutsAndBolts::default();
    for (part, target, height, orientation) in
        [(0, pocket(&spec), 0.0155, ON_SIDE), (1, hole(&spec), 0.0125, OVER)]
    {
        let mut scene = built(&spec, 1);
        let pose = Pose { position: [0.45, 0.1, height], orientation };
        let away = Pose::at([0.45, 0.28, 0.06]);
        drop_at(&mut scene, &mut Robot::default(), 1 - part, &away);
        drop_at(&mut scene, &mut Robot::default(), part, &pose);
        assert!(spec.grasps(&scene.sensed(), part).is_empty(), "it must lie oddly");
        let done = recover(&mut scene, part, target);
        assert!(done.len() > 1 && done.ends_with(&["put"]), "part {part}: {done:?}");
        let is = spec.assembly(&scene);
        assert_eq!([is.nut_in_pocket, is.bolt_in_hole][part], Some(part));
    }
}

#[test]
fn a_part_against_the_rim_or_leaning_against_it_is_put_at_its_target() {
    let spec = NutsAndBolts::default();
    let [low, high] = spec.table.rim;
    let tilt = (0.45f64).sin_cos();
    let poses = [
        Pose::at([high[0] - 0.0152, 0.1, 0.0085]),
        Pose::at([low[0] + 0.04, high[1] - 0.0155, 0.0085]),
        Pose { position: [high[0] - 0.020, 0.1, 0.026], orientation: [0.0, tilt.0, 0.0, tilt.1] },
    ];
    for pose in poses {
        let mut scene = built(&spec, 1);
        drop_at(&mut scene, &mut Robot::default(), 0, &pose);
        let done = recover(&mut scene, 0, pocket(&spec));
        assert_eq!(spec.assembly(&scene).nut_in_pocket, Some(0), "{pose:?}: {done:?}");
    }
}

#[test]
fn grasps_from_the_shape_are_the_same_each_time_and_within_the_gripper() {
    let spec = NutsAndBolts::default();
    let scene = built(&spec, 3);
    for part in 0..2 {
        let grasps = any_grasps(&scene.sensed(), part);
        assert!((8..=48).contains(&grasps.len()), "{}", grasps.len());
        assert_eq!(grasps, any_grasps(&scene.sensed(), part));
        let fits = |opening: f64| opening > 0.0 && opening <= spec.gripper.stroke_m;
        assert!(grasps.iter().all(|grasp| fits(grasp.opening_m) && grasp.approach[2] < 0.0));
    }
    assert!(any_grasps(&scene.sensed(), 2).is_empty() && pushes(&scene.sensed(), 2).is_empty());
}

/// A part that fell off the table fell for ever.
#[test]
fn a_part_off_the_table_is_lost_and_the_rest_goes_on() {
    let spec = NutsAndBolts { nuts: 2, ..NutsAndBolts::default() };
    let mut scene = built(&spec, 1);
    let mut robot = Robot::default();
    drop_at(&mut scene, &mut robot, 1, &Pose::at([0.80, 0.1, 0.02]));
    assert!(scene.lost(1) && !scene.lost(0) && !scene.lost(9));
    let place = scene.part(1).expect("there").position;
    assert!(place[2] < -0.1 && place[2] > -1.0, "{place:?}");
    assert!(
        any_grasps(&scene.sensed(), 1).is_empty() && free_places(&scene.sensed(), 1).is_empty()
    );
    assert!(pushes(&scene.sensed(), 1).is_empty());
    let refused = begin(&mut robot, &scene, 1, pocket(&spec)).expect_err("out of reach");
    assert_eq!(refused.outcome, SkillOutcome::Unreachable);

    let saved = postcard::to_stdvec(&scene).expect("it can be saved");
    let mut copy: Scene = postcard::from_bytes(&saved).expect("it can be restored");
    assert!(copy.lost(1));
    let report = put(&mut scene, &mut robot, 0, pocket(&spec));
    assert_eq!(report.outcome, SkillOutcome::Placed);
    assert_eq!(scene.part(1).expect("there").position, place);

    let back = Pose::at([0.45, 0.1, 0.01]);
    drop_at(&mut copy, &mut Robot::default(), 1, &back);
    assert!(!copy.lost(1) && !any_grasps(&copy.sensed(), 1).is_empty());
}

#[test]
fn a_push_never_throws_a_part_off_the_table() {
    let spec = NutsAndBolts::default();
    let ([low, high], mut count) = (spec.table.rim, 0);
    for seed in 0..16u32 {
        let mut scene = built(&spec, u64::from(seed));
        let mut robot = Robot::default();
        let part = seed as usize % 2;
        let along = f64::from(seed) / 16.0;
        let edge = [low[0] + 0.02, high[0] - 0.02][seed as usize / 2 % 2];
        let position = [edge, low[1] + 0.03 + along * (high[1] - low[1] - 0.06), 0.05];
        let orientation = if seed % 3 == 0 { OVER } else { ON_SIDE };
        drop_at(&mut scene, &mut robot, part, &Pose { position, orientation });
        if scene.lost(part) {
            // It fell off by itself.
            continue;
        }
        for _ in 0..2 {
            let all = pushes(&scene.sensed(), part);
            if all.iter().any(|push| robot.begin_push(&scene.sensed(), push).is_ok()) {
                let report = finish(&mut scene, &mut robot);
                assert!(!report.picked);
                count += u32::from(report.outcome == SkillOutcome::Placed);
            }
            assert!((0..2).all(|part| !scene.lost(part)), "seed {seed}");
        }
    }
    assert!(count >= 16, "{count} pushes moved the part");
}

#[test]
fn impossible_episodes_are_refused() {
    let domain = taught();
    let mut spec = EpisodeSpec { drop_rate: 1.5, ..EpisodeSpec::default() };
    let refused =
        |spec: &EpisodeSpec| episode(domain, &chain(), spec, Seed::new(1)).unwrap_err().to_string();
    assert!(refused(&spec).contains("drop_rate"));
    spec.drop_rate = 0.0;
    let many = NutsAndBolts { nuts: 100, ..NutsAndBolts::default() };
    spec.task = Arc::new(many);
    assert!(refused(&spec).contains("nuts"));
}

/// A finger that passed the corner of a nut between two tests of its path knocked it off the table.
#[test]
fn the_hand_strikes_no_part_between_two_tests_of_its_path() {
    let shown = demonstrate(&NutsAndBolts::default(), 1, Seed::new(220_064)).expect("runs");
    assert_eq!(shown.solved, 1, "{:?}", shown.skills);
}

#[test]
fn bolts_shown_alike_in_one_coordinate_by_chance_are_on_the_table_elsewhere_too() {
    // In these five demonstrations the bolt's positions spread by 8 mm along x.
    let seed = Seed::new(1).derive_index("trial", 16);
    let shown = demonstrate(&NutsAndBolts::default(), 5, seed).expect("runs");
    let domain = learn(&shown.recording, &Settings::paper()).expect("learns").domain;
    let state = domain.state("BOLT_AT_START").expect("there");
    let place = &domain.states[state].places[0];
    assert!(place.coordinates[0].spread() < 0.03, "{place:?}");
    let classifier = Classifier::new(&domain);
    let [x, y, z] = place.pose().position;
    let said = |at| classifier.classify_alone("bolt", &Pose::at(at)).fact.map(|fact| fact.state);
    let table = Some(state);
    assert_eq!((said([x - 0.09, y, z]), said([x + 0.09, y - 0.1, z])), (table, table));
    assert_eq!(said([x - 0.09, y, z + 0.03]), None, "not above it");
}

/// Nuts and bolts with other grasps for the nuts.
#[derive(Debug, Clone)]
struct OtherGrasps {
    inner: NutsAndBolts,
    nut: fn(Vec<Grasp>) -> Vec<Grasp>,
}

impl Task for OtherGrasps {
    fn name(&self) -> &str {
        self.inner.name()
    }

    fn description(&self) -> &str {
        self.inner.description()
    }

    fn settings(&self) -> serde_json::Value {
        self.inner.settings()
    }

    fn with_settings(&self, text: &[u8], file: &str) -> Result<Arc<dyn Task>, TaskError> {
        self.inner.with_settings(text, file)
    }

    fn scene(&self, seed: Seed) -> Result<SceneSpec, TaskError> {
        self.inner.scene(seed)
    }

    fn grasps(&self, scene: &Sensed<'_>, part: usize) -> Vec<Grasp> {
        let own = self.inner.grasps(scene, part);
        if scene.kind(part).is_some_and(|k| k.name == "nut") { (self.nut)(own) } else { own }
    }

    fn demonstrator(&self, seed: Seed, demo: usize) -> Box<dyn Demonstrator> {
        self.inner.demonstrator(seed, demo)
    }

    fn judge(&self, scene: &Scene) -> Judgement {
        self.inner.judge(scene)
    }

    fn min_actions(&self) -> usize {
        self.inner.min_actions()
    }
}

/// Returns a grasp that closes 4 cm above the part, in the air.
fn in_the_air(grasp: &Grasp) -> Grasp {
    let [x, y, z] = grasp.at;
    Grasp { at: [x, y, z + 0.04], ..*grasp }
}

fn recovered(spec: &EpisodeSpec, seed: u64) -> EpisodeReport {
    let domain = taught();
    let over = run(domain, spec, Seed::new(seed));
    assert!(!over.report.false_goal(), "{:?}", over.report);
    over.report
}

fn count(report: &EpisodeReport, kind: RecoveryKind) -> usize {
    report.recoveries().filter(|r| r.kind == kind).count()
}

/// A single failed grasp was tried again and again until the episode was given up.
#[test]
fn a_grasp_that_misses_is_not_tried_a_third_time() {
    let nut = |own: Vec<Grasp>| -> Vec<Grasp> {
        let first = own.first().map(in_the_air);
        first.into_iter().chain(own).collect()
    };
    let spec = EpisodeSpec::of(OtherGrasps { inner: NutsAndBolts::default(), nut });
    let report = recovered(&spec, 5);
    assert!(report.solved, "{report:?}");
    let missed = report.attempts().filter(|(_, o)| *o == SkillOutcome::Missed).count();
    assert!((1..=2).contains(&missed), "{report:?}");
    assert!(count(&report, RecoveryKind::Grasp) > 0, "{report:?}");
}

/// A bolt on its head has no grasp of the task: the episode ended at once.
#[test]
fn a_bolt_on_its_head_is_put_down_anew_or_pushed_over() {
    let pose = Pose { position: [0.45, 0.16, 0.0125], orientation: [1.0, 0.0, 0.0, 0.0] };
    let perturbation = Some(Perturbation { at_s: 0.0, body: BodyId::Part(1), pose });
    let spec = EpisodeSpec { perturbation, ..EpisodeSpec::default() };
    let report = recovered(&spec, 2);
    assert!(report.perturbed() && report.solved, "{report:?}");
    let detours = report.decisions.iter().filter(|d| d.is_detour()).count();
    assert!((1..=8).contains(&detours), "{report:?}");
}

/// A part off the table ended the episode even if another one could take its place.
#[test]
fn a_lost_part_is_reported_and_the_rest_goes_on_without_it() {
    for (bolts, solved) in [(2, true), (1, false)] {
        let pose = Pose::at([0.5, 1.4, 0.2]);
        let perturbation = Some(Perturbation { at_s: 0.0, body: BodyId::Part(1), pose });
        let scene = NutsAndBolts { bolts, ..NutsAndBolts::default() };
        let report = recovered(&EpisodeSpec { perturbation, ..EpisodeSpec::of(scene) }, 2);
        assert_eq!((report.perturbed(), report.solved), (true, solved), "{report:?}");
        assert_eq!(report.lost, ["bolt_0"]);
        if !solved {
            assert_eq!(report.ended, Ended::Lost { objects: vec!["bolt_0".into()] });
        }
    }
}

/// Returns the greatest distance that a part moves in `seconds` of the robot's idling, in metres, after one second.
fn drift_m(seed: u64, seconds: f64) -> f64 {
    let spec =
        NutsAndBolts { nuts: MAX_OF_A_KIND, bolts: MAX_OF_A_KIND, ..NutsAndBolts::default() };
    let mut scene = built(&spec, seed);
    let mut robot = Robot::default();
    let mut idle = |scene: &mut Scene, seconds: f64| {
        for _ in 0..(seconds * 1e3 / scene.spec().step_ms as f64) as usize {
            robot.step(scene);
        }
    };
    let places = |scene: &Scene| -> Vec<Pose> {
        (0..scene.part_count()).map(|part| scene.part(part).expect("there")).collect()
    };
    idle(&mut scene, 1.0);
    let before = places(&scene);
    idle(&mut scene, seconds);
    let moved = before.iter().zip(places(&scene)).map(|(was, is)| apart_m(was, &is));
    moved.fold(0.0, f64::max)
}

fn apart_m(a: &Pose, b: &Pose) -> f64 {
    let squares = a.position.iter().zip(b.position).map(|(a, b)| (a - b).powi(2));
    squares.sum::<f64>().sqrt()
}

/// At 0.1 mm an hour a part moves 1.7 micrometres in a minute. Lying bolts slid 5 to 40 mm in that time.
#[test]
fn nothing_moves_on_the_table_in_a_minute() {
    for seed in 41..44 {
        let moved = drift_m(seed, 60.0);
        assert!(moved < 1e-4 / 60.0, "seed {seed}: {moved} m");
    }
}

#[test]
#[ignore = "long: two simulated hours"]
fn nothing_moves_on_the_table_in_an_hour() {
    let moved: Vec<f64> = (41..43).into_par_iter().map(|seed| drift_m(seed, 3_600.0)).collect();
    println!("{moved:?}");
    assert!(moved.iter().all(|moved| *moved < 1e-4), "{moved:?} m");
}

/// Puts a nut into its pocket and lets a bolt fall into it, both a little beside their places. Returns how far either
/// part moves between 2 and 7 seconds later, in metres.
fn rattle_m(seed: u64) -> f64 {
    let mut scene = built(&NutsAndBolts::default(), seed);
    let mut robot = Robot::default();
    let part = |scene: &Scene, part: usize| scene.part(part).expect("there");
    let yaw = |angle: f64| [0.0, 0.0, (angle / 2.0).sin(), (angle / 2.0).cos()];
    let aside = (seed as f64 * 0.7).sin_cos();
    let at = |by: f64, z: f64| [0.42 + by * aside.0, -0.22 + by * aside.1, z];
    scene.disturb(1, &Pose { position: [0.5, 0.25, 0.08], orientation: yaw(0.0) });
    let turn = FRAC_PI_6 + FRAC_PI_3 * seed as f64 + 0.01 * aside.0;
    scene.disturb(0, &Pose { position: at(5e-5, 0.0503), orientation: yaw(turn) });
    let mut idle = |scene: &mut Scene, steps: usize| {
        for _ in 0..steps {
            robot.step(scene);
        }
    };
    idle(&mut scene, 125);
    scene.disturb(1, &Pose { position: at(-2e-4, 0.0593), orientation: yaw(seed as f64) });
    idle(&mut scene, 500);
    let before = [part(&scene, 0), part(&scene, 1)];
    assert!((before[1].position[2] - 0.058).abs() < 5e-4, "it is not in the nut: {before:?}");
    let mut moved = 0.0f64;
    for _ in 0..1_250 {
        idle(&mut scene, 1);
        moved = (0..2).map(|p| apart_m(&before[p], &part(&scene, p))).fold(moved, f64::max);
    }
    moved
}

/// Two of three rattled for ever, and one in twenty sprang out.
#[test]
fn a_bolt_in_its_nut_comes_to_rest() {
    let moved: Vec<f64> = (0..12).map(rattle_m).collect();
    assert!(moved.iter().all(|moved| *moved < 1e-4), "{moved:?} m");
    let still = moved.iter().filter(|moved| **moved < 1e-9).count();
    assert!(still >= 10, "{moved:?} m");
}

/// Takes a part, holds it still after the lift, and returns how fast it creeps in the hand, in metres per second.
fn creep_m_s(spec: &NutsAndBolts, seed: u64, part: usize, target: Target) -> f64 {
    let mut scene = built(spec, seed);
    let mut robot = Robot::default();
    begin(&mut robot, &scene, part, target).expect("it is within reach");
    let touched = (0..30_000).find(|_| robot.step(&mut scene).touch.is_some());
    touched.expect("it is grasped");
    // The arm has lifted the part by then.
    for _ in 0..625 {
        robot.step(&mut scene);
    }
    // Without its skill, the robot holds the pose and the grip.
    let mut held = serde_json::to_value(&robot).expect("it can be saved");
    held["skill"] = serde_json::Value::Null;
    let mut robot: Robot = serde_json::from_value(held).expect("it can be restored");
    assert!(!robot.busy());
    let mut in_hand = |scene: &mut Scene, seconds: usize| {
        for _ in 0..250 * seconds {
            robot.step(scene);
        }
        let part = scene.part(part).expect("there");
        assert!(part.position[2] > 0.05, "it is not in the air: {part:?}");
        let Pose { position, orientation: [x, y, z, w] } = scene.tool();
        let back = BodyFrame::from(&Pose { position, orientation: [-x, -y, -z, w] }).turn;
        back.apply(std::array::from_fn(|i| part.position[i] - position[i]))
    };
    // Parts settle in the hand for up to 6 s.
    let before = in_hand(&mut scene, 8);
    let after = in_hand(&mut scene, 10);
    (0..3).map(|i| (after[i] - before[i]).powi(2)).sum::<f64>().sqrt() / 10.0
}

#[test]
fn a_part_does_not_creep_in_a_hand_that_holds_still() {
    let spec = NutsAndBolts::default();
    for seed in 42..46 {
        for (part, target) in [(0, pocket(&spec)), (1, hole(&spec))] {
            let creep = creep_m_s(&spec, seed, part, target);
            // Without the fingers' compensation bolts crept by 5 to 43 µm/s.
            assert!(creep < 1e-6, "seed {seed}, part {part}: {creep} m/s");
        }
    }
}

/// An action whose grasps all miss was repeated until the episode was given up.
#[test]
fn grasps_that_all_miss_are_given_up_after_a_few() {
    let nut = |own: Vec<Grasp>| -> Vec<Grasp> { own.iter().map(in_the_air).collect() };
    let spec = EpisodeSpec::of(OtherGrasps { inner: NutsAndBolts::default(), nut });
    let report = recovered(&spec, 5);
    assert_ne!(report.ended, Ended::GaveUp, "{report:?}");
    let missed = report.attempts().filter(|(_, o)| *o == SkillOutcome::Missed).count();
    assert!((1..=6).contains(&missed), "{missed} of {report:?}");
}

/// The closed loop over many seeds. With 40 of 40 the Wilson interval begins at 91%, so a loop that fails one
/// time in five passes with a probability below 1 in 7,000.
#[test]
#[ignore = "long statistics"]
fn forty_episodes_are_assembled() {
    let domain = taught();
    let (mut assembled, mut slip_m) = (0, 0.0f64);
    for seed in 0..40 {
        let spec = EpisodeSpec::default();
        let over = run(domain, &spec, Seed::new(seed));
        assert!(!over.report.false_goal(), "seed {seed}: {:?}", over.report);
        assembled += u32::from(over.report.solved);
        slip_m = over.report.skills().map(|s| s.slip_m).fold(slip_m, f64::max);
    }
    println!("{assembled} of 40 assembled, parts slipped {:.2} mm at most", 1e3 * slip_m);
    assert!(slip_m > 0.0 && slip_m < 1e-3, "{slip_m} m");
    assert!(assembled >= 39, "{assembled}");
}

/// Goes back while the robot acts, and from the end.
#[derive(Default)]
struct BackAndForth {
    /// Ticks at which the run went back.
    turns: Vec<u64>,
}

impl Driver for BackAndForth {
    fn options(&self) -> LiveOptions {
        LiveOptions { spacing_ticks: 500, ..LiveOptions::default() }
    }

    fn drive(
        &mut self,
        live: &mut Live,
        stop: &mut dyn FnMut(SimView<'_>) -> Stop,
    ) -> Result<bool, LiveError> {
        for (until, back) in [(3_000, 1_300), (u64::MAX, 2_000), (u64::MAX, 0)] {
            live.run_until(SimDuration::from_secs(600), |view| {
                let due = view.tick() >= until;
                match stop(view) {
                    Stop::Continue(()) if due => Stop::Break(StopReason::TimeUp),
                    goes_on => goes_on,
                }
            })?;
            self.turns.push(live.tick());
            live.back(back)?;
        }
        Ok(true)
    }
}

#[test]
fn an_episode_that_goes_back_and_on_ends_as_one_that_does_not() {
    let (spec, seed) = (EpisodeSpec::default(), Seed::new(3));
    let straight = run(taught(), &spec, seed);
    let mut driver = BackAndForth::default();
    let turned = prepared(taught(), &spec, seed).run_driven(&mut Ignore, &mut driver).unwrap();
    assert!(driver.turns[1] > 3_000 && driver.turns[1] == driver.turns[2], "{:?}", driver.turns);
    assert!(straight.report.solved && straight.report == turned.report);
}
