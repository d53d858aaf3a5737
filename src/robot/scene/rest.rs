//! Tests of rest and motion: what should lie still lies still without sleeping, and nothing else is frozen.

use std::f64::consts::{FRAC_PI_2, TAU};

use rapier3d::math::Vector;

use super::Scene;
use super::physics::CONTACT_M;
use super::shapes::{Piece, cuboid};
use super::spec::{BodyKind, Fixture, Handling, Look, Part, SceneSpec, Slider};
use crate::robot::Pose;
use crate::robot::arm::{BodyFrame, Turn};

const LOOK: Look = Look { colour: 0, ink: 0, roughness: 0.5 };

fn kind(name: &str, pieces: Vec<Piece>) -> BodyKind {
    let (density, friction, handling) = (2_000.0, 0.5, Handling::default());
    BodyKind { name: name.into(), pieces, density, friction, handling, look: LOOK }
}

/// Returns a prism with `sides` corners at each end.
fn prism(sides: u32, radius: f64, low: f64, high: f64) -> Piece {
    let corner = |n: u32| {
        let angle = TAU * f64::from(n % sides) / f64::from(sides);
        [radius * angle.cos(), radius * angle.sin(), if n < sides { low } else { high }]
    };
    (0..2 * sides).map(corner).collect()
}

/// Returns a rod with a hexagonal head. When it lies down, its head and the far end of its shaft touch the table.
fn headed_rod() -> BodyKind {
    kind("rod", vec![prism(6, 0.0173, 0.0, 0.012), prism(24, 0.008, -0.05, 0.0)])
}

fn block(half: [f64; 3]) -> BodyKind {
    kind("block", vec![cuboid([0.0; 3], half)])
}

fn scene(kinds: Vec<BodyKind>, parts: Vec<Part>, fixtures: Vec<Fixture>) -> Scene {
    Scene::new(SceneSpec { kinds, parts, fixtures, ..SceneSpec::default() }).expect("it is sound")
}

fn run(scene: &mut Scene, seconds: f64) {
    for _ in 0..(seconds * 1e3 / scene.spec().step_ms as f64).round() as usize {
        scene.refine(false);
        scene.step();
    }
}

fn place(scene: &Scene, part: usize) -> Vector {
    scene.part_frame(part).translation
}

fn never_sleeps(scene: &mut Scene) {
    for part in 0..scene.parts.len() {
        let body = &mut scene.physics.bodies[scene.parts[part].body];
        body.activation_mut().normalized_linear_threshold = -1.0;
        body.activation_mut().angular_threshold = -1.0;
        body.wake_up(true);
    }
}

/// Returns the greatest distance that one of three lying rods moves in `seconds`, in metres, after two seconds of rest.
/// The rods never sleep. Contacts are found within `within_m` metres.
fn drift_m(within_m: f64, seconds: f64) -> f64 {
    let lying = |n: u32| {
        let n = f64::from(n);
        let turn = Turn::about_z(0.7 + 1.9 * n) * Turn::about_x(FRAC_PI_2);
        Part::free(0, BodyFrame { position: [0.48, -0.15 + 0.15 * n, 0.018], turn })
    };
    let mut scene = scene(vec![headed_rod()], (0..3).map(lying).collect(), Vec::new());
    scene.physics.integration_parameters.normalized_prediction_distance = within_m;
    never_sleeps(&mut scene);
    run(&mut scene, 2.0);
    let before: Vec<Vector> = (0..3).map(|part| place(&scene, part)).collect();
    run(&mut scene, seconds);
    let moved = (0..3).map(|part| (place(&scene, part) - before[part]).length());
    moved.fold(0.0, f64::max)
}

/// 0.1 mm in an hour.
const STILL_M_S: f64 = 1e-4 / 3600.0;

#[test]
fn a_lying_part_rests_without_sleeping_and_slides_if_far_contacts_count() {
    let still = drift_m(CONTACT_M, 10.0);
    assert!(still < 10.0 * STILL_M_S, "{still} m in 10 s");
    let far = drift_m(2.0 * CONTACT_M, 10.0);
    assert!(far > 2e-5, "{far} m in 10 s");
}

/// Returns a scene with one block on the table.
fn with_block(half: [f64; 3], fixtures: Vec<Fixture>) -> Scene {
    let part = Part::free(0, BodyFrame::at([0.42, 0.25, half[2] + 1e-4]));
    scene(vec![block(half)], vec![part], fixtures)
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
        let mut scene = with_block([0.02, 0.02, 0.015], vec![slope]);
        scene.disturb(0, &at(-0.1, 0.015).pose());
        run(&mut scene, 0.1);
        let before = place(&scene, 0);
        run(&mut scene, 1.0);
        let moved = (place(&scene, 0) - before).length();
        assert!(if slides { moved > 0.05 } else { moved < 1e-6 }, "{degrees}: {moved} m");
    }
}

#[test]
fn a_tilted_part_falls_over_however_slowly_it_begins() {
    // The lower edge is half a degree past the point of balance.
    let tilt = (0.01f64 / 0.03).atan() + 0.5f64.to_radians();
    let height = -Turn::about_y(tilt).apply([0.01, 0.0, -0.03])[2];
    let frame = BodyFrame { position: [0.48, 0.0, height], turn: Turn::about_y(tilt) };
    let mut scene = with_block([0.01, 0.01, 0.03], Vec::new());
    scene.disturb(0, &frame.pose());
    run(&mut scene, 1.5);
    let height = place(&scene, 0).z;
    assert!((height - 0.01).abs() < 1e-3, "{height} m");
}

#[test]
fn a_sleeping_part_falls_when_its_support_is_taken_away() {
    let at = |z: f64| Part::free(0, BodyFrame::at([0.48, 0.0, z]));
    let mut scene = scene(vec![block([0.02; 3])], vec![at(0.0201), at(0.0602)], Vec::new());
    run(&mut scene, 3.0);
    let sleeping =
        |scene: &Scene, part: usize| scene.physics.bodies[scene.parts[part].body].is_sleeping();
    assert_eq!([0, 1].map(|part| sleeping(&scene, part)), [true; 2]);
    assert!((place(&scene, 1).z - 0.06).abs() < 1e-4);
    scene.disturb(0, &Pose::at([0.48, 0.2, 0.02]));
    run(&mut scene, 0.5);
    assert!((place(&scene, 1).z - 0.02).abs() < 1e-4, "{}", place(&scene, 1).z);
}

#[test]
fn a_sleeping_part_moves_with_the_tray_under_it() {
    let slider =
        Slider { fixture: None, axis: [1.0, 0.0, 0.0], range_m: [0.0, 0.2], friction_n: 0.0 };
    let frame = BodyFrame::at([0.40, 0.0, 0.03]);
    let tray = Part { kind: 0, frame, slider: Some(slider) };
    let tray_kind = kind("tray", vec![cuboid([0.0; 3], [0.05, 0.05, 0.01])]);
    let kinds = vec![tray_kind, block([0.02; 3])];
    let content = Part::free(1, BodyFrame::at([0.40, 0.0, 0.0601]));
    let mut scene = scene(kinds, vec![tray, content], Vec::new());
    run(&mut scene, 1.0);
    let before = [0, 1].map(|part| place(&scene, part).x);
    assert!(scene.physics.bodies[scene.parts[1].body].is_sleeping());
    let tray = scene.parts[0].body;
    for _ in 0..75 {
        scene.physics.bodies[tray].set_linvel(Vector::X * 0.1, true);
        run(&mut scene, 0.004);
    }
    let moved = [0, 1].map(|part| place(&scene, part).x - before[part]);
    assert!((moved[0] - 0.03).abs() < 2e-3, "{moved:?}");
    assert!((moved[1] - moved[0]).abs() < 3e-3, "{moved:?}");
}
