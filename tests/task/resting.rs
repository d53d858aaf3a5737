//! Rest and motion: what should lie still lies still, and nothing else is frozen.

#![cfg(feature = "physics")]
#![allow(clippy::unwrap_used)]

use symbolt::robot::Pose;
use symbolt::robot::arm::{BodyFrame, Turn};
use symbolt::robot::scene::{BodyKind, Fixture, Handling, Look, Part, Scene, SceneSpec, cuboid};
use symbolt::robot::skill::{
    Facing, MOST_PLACES, Robot, Target, any_grasps, free_places, turns_over,
};

const LOOK: Look = Look { colour: 0, ink: 0, roughness: 0.5 };

/// Returns a scene with blocks of one kind on the table.
fn blocks(half: [f64; 3], parts: Vec<Part>, fixtures: Vec<Fixture>) -> Scene {
    let kind = BodyKind {
        name: "block".into(),
        pieces: vec![cuboid([0.0; 3], half)],
        density: 2_000.0,
        friction: 0.5,
        handling: Handling::default(),
        look: LOOK,
    };
    let spec = SceneSpec { kinds: vec![kind], parts, fixtures, ..SceneSpec::default() };
    Scene::new(spec).expect("it is sound")
}

fn block(half: [f64; 3], fixtures: Vec<Fixture>) -> Scene {
    let part = Part::free(0, BodyFrame::at([0.42, 0.25, half[2] + 1e-4]));
    blocks(half, vec![part], fixtures)
}

/// Steps the scene while the robot waits.
fn run(scene: &mut Scene, seconds: f64) {
    let mut robot = Robot::default();
    for _ in 0..(seconds * 1e3 / scene.spec().step_ms as f64).round() as usize {
        robot.step(scene);
    }
}

fn place(scene: &Scene, part: usize) -> Pose {
    scene.part(part).unwrap()
}

#[test]
fn a_part_slides_down_an_incline_above_its_friction_and_stays_below_it() {
    // The angle of friction is 26.6 degrees. In steps of 4 ms parts begin to slide between 24 and 25 degrees.
    for (degrees, slides) in [(24.0f64, false), (28.0, true)] {
        let turn = Turn::about_y(degrees.to_radians());
        let at = |along: f64, up: f64| {
            let by = turn.apply([along, 0.0, up]);
            BodyFrame { position: [0.48 + by[0], -0.1, 0.12 + by[2]], turn }
        };
        let pieces = vec![cuboid([0.0; 3], [0.15, 0.05, 0.01])];
        let slope =
            Fixture { frame: at(0.0, -0.01), pieces, friction: 0.5, look: LOOK, movable: None };
        let mut scene = block([0.02, 0.02, 0.015], vec![slope]);
        scene.disturb(0, &at(-0.1, 0.015).pose());
        run(&mut scene, 0.1);
        let before = place(&scene, 0);
        run(&mut scene, 1.0);
        let moved = place(&scene, 0).distance(&before);
        assert!(if slides { moved > 0.05 } else { moved < 1e-6 }, "{degrees}: {moved} m");
    }
}

#[test]
fn a_tilted_part_falls_over_however_slowly_it_begins() {
    // The lower edge is half a degree past the point of balance.
    let tilt = (0.01f64 / 0.03).atan() + 0.5f64.to_radians();
    let height = -Turn::about_y(tilt).apply([0.01, 0.0, -0.03])[2];
    let frame = BodyFrame { position: [0.48, 0.0, height], turn: Turn::about_y(tilt) };
    let mut scene = block([0.01, 0.01, 0.03], Vec::new());
    scene.disturb(0, &frame.pose());
    run(&mut scene, 1.5);
    let height = place(&scene, 0).position[2];
    assert!((height - 0.01).abs() < 1e-3, "{height} m");
}

#[test]
fn a_part_at_rest_falls_when_its_support_is_taken_away() {
    let at = |z: f64| Part::free(0, BodyFrame::at([0.48, 0.0, z]));
    let mut scene = blocks([0.02; 3], vec![at(0.0201), at(0.0602)], Vec::new());
    run(&mut scene, 3.0);
    let before = place(&scene, 1);
    assert!((before.position[2] - 0.06).abs() < 1e-4);
    run(&mut scene, 0.5);
    assert_eq!(place(&scene, 1), before, "it sleeps");
    scene.disturb(0, &Pose::at([0.48, 0.2, 0.02]));
    run(&mut scene, 0.5);
    let height = place(&scene, 1).position[2];
    assert!((height - 0.02).abs() < 1e-4, "{height} m");
}

#[test]
fn a_block_that_stands_is_laid_down_the_lowest_way_first_and_stays_inside_the_rim() {
    let half = [0.010, 0.015, 0.025];
    let part = Part::free(0, BodyFrame::at([0.45, 0.0, half[2] + 1e-3]));
    let scene = blocks(half, vec![part], Vec::new());
    let places = free_places(&scene.sensed(), 0);
    assert!((4..=MOST_PLACES).contains(&places.len()), "{}", places.len());
    let heights: Vec<i64> =
        places.iter().map(|place| (place.position[2] * 1e3).round() as i64).collect();
    assert_eq!(heights[..2], [10, 15]);
    assert!(heights.iter().all(|height| half.iter().any(|h| (h * 1e3).round() as i64 == *height)));
    assert!(turns_over(&scene.sensed(), 0, &places[0]));
    assert!(!turns_over(&scene.sensed(), 0, &places[places.len() - 1]), "as it stands comes last");
    let [low, high] = scene.spec().table.rim;
    for place in &places {
        assert!((0..2).all(|i| place.position[i] > low[i] && place.position[i] < high[i]));
    }
    assert_eq!(places, free_places(&scene.sensed(), 0));
}

#[test]
fn a_target_without_a_direction_is_refused() {
    let half = [0.010, 0.015, 0.025];
    let part = Part::free(0, BodyFrame::at([0.45, 0.0, half[2] + 1e-3]));
    let scene = blocks(half, vec![part], Vec::new());
    let (grasps, at) = (any_grasps(&scene.sensed(), 0), [0.45, 0.1, half[2]]);
    let begins = |target| Robot::default().begin(&scene.sensed(), 0, target, &grasps, None).is_ok();
    assert!(begins(Target::anyhow(at)));
    let nowhere = Facing::Full([0.0; 4]);
    assert!(!begins(Target::along(at, [0.0; 3])));
    assert!(!begins(Target { position: at, facing: nowhere }));
}
