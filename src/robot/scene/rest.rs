//! Tests of rest and motion that need the physics: what should lie still lies still without sleeping, and a sleeping part
//! wakes up. The others are in `tests/task/resting.rs`.

use std::f64::consts::{FRAC_PI_2, TAU};

use rapier3d::math::Vector;

use super::Scene;
use super::physics::CONTACT_M;
use super::shapes::{Piece, cuboid};
use super::spec::{BodyKind, Handling, Look, Part, SceneSpec, Slider};
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

fn scene(kinds: Vec<BodyKind>, parts: Vec<Part>) -> Scene {
    Scene::new(SceneSpec { kinds, parts, ..SceneSpec::default() }).expect("it is sound")
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
    let mut scene = scene(vec![headed_rod()], (0..3).map(lying).collect());
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

#[test]
fn a_sleeping_part_moves_with_the_tray_under_it() {
    let slider =
        Slider { fixture: None, axis: [1.0, 0.0, 0.0], range_m: [0.0, 0.2], friction_n: 0.0 };
    let frame = BodyFrame::at([0.40, 0.0, 0.03]);
    let tray = Part { kind: 0, frame, slider: Some(slider) };
    let tray_kind = kind("tray", vec![cuboid([0.0; 3], [0.05, 0.05, 0.01])]);
    let kinds = vec![tray_kind, kind("block", vec![cuboid([0.0; 3], [0.02; 3])])];
    let content = Part::free(1, BodyFrame::at([0.40, 0.0, 0.0601]));
    let mut scene = scene(kinds, vec![tray, content]);
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
