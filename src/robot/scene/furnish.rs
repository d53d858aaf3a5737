//! What the physics holds besides parts and robot: the table, the fixtures, and the sliders of parts.

use rapier3d::dynamics::{
    GenericJointBuilder, ImpulseJointHandle, JointAxesMask, JointAxis, MotorModel,
    RigidBodyBuilder, RigidBodyHandle,
};
use rapier3d::geometry::{ColliderBuilder, SharedShape};
use rapier3d::math::{Pose as Frame, Rotation, Vector};
use rapier3d::prelude::PhysicsWorld;

use super::shapes;
use super::spec::{Fixture, SceneSpec, Slider, TableSpec};

/// Damping of a slider that is strong enough to reach the limit of its friction at once, in newton seconds per metre.
const SLIDER_DAMPING: f64 = 2e3;

/// Returns the table and its rim.
pub(super) fn table_shapes(spec: &TableSpec) -> Vec<(Frame, SharedShape)> {
    let [low, high] = spec.rim;
    let middle = |i: usize| (low[i] + high[i]) / 2.0;
    let half = |i: usize| (high[i] - low[i]) / 2.0;
    let (thick, wall, height) = (0.02, 0.006, spec.rim_height_m / 2.0);
    let block = |at: Vector, [x, y, z]: [f64; 3]| {
        (Frame::from_translation(at), SharedShape::cuboid(x, y, z))
    };
    let (x, y) = (middle(0), middle(1));
    let mut table = vec![block(Vector::new(x, y, -thick), [half(0) + 0.02, half(1) + 0.02, thick])];
    for side in [-1.0, 1.0] {
        let at = Vector::new(x, y + side * (half(1) + wall), height);
        table.push(block(at, [half(0) + 2.0 * wall, wall, height]));
        let at = Vector::new(x + side * (half(0) + wall), y, height);
        table.push(block(at, [wall, half(1) + 2.0 * wall, height]));
    }
    table
}

/// Returns a fixture's shapes with their frames in the scene.
pub(super) fn fixture_shapes(spec: &Fixture) -> impl Iterator<Item = (Frame, SharedShape)> {
    let at = spec.frame.frame();
    shapes::hulls(&spec.pieces).into_iter().map(move |shape| (at, shape))
}

/// Adds the table, its rim and the fixtures that never move.
pub(super) fn still(physics: &mut PhysicsWorld, spec: &SceneSpec) {
    let table = table_shapes(&spec.table).into_iter().map(|piece| (piece, spec.table.friction));
    let fixtures = spec.fixtures.iter().filter(|fixture| fixture.movable.is_none());
    let fixtures = fixtures.flat_map(|f| fixture_shapes(f).map(|piece| (piece, f.friction)));
    for ((at, shape), friction) in table.chain(fixtures) {
        let collider = ColliderBuilder::new(shape).position(at).friction(friction);
        physics.insert_collider(collider, None);
    }
}

/// Adds the movable fixtures.
pub(super) fn movable(
    physics: &mut PhysicsWorld,
    spec: &SceneSpec,
) -> Vec<Option<RigidBodyHandle>> {
    let mut add = |fixture: &Fixture| {
        fixture.movable.as_ref()?;
        let body = physics.insert_body(RigidBodyBuilder::fixed().pose(fixture.frame.frame()));
        for shape in shapes::hulls(&fixture.pieces) {
            let collider = ColliderBuilder::new(shape).friction(fixture.friction);
            physics.insert_collider(collider, Some(body));
        }
        Some(body)
    };
    spec.fixtures.iter().map(&mut add).collect()
}

/// Adds the joint of a slider between `base`, or the table, and a part's body.
pub(super) fn guide(
    physics: &mut PhysicsWorld,
    slider: &Slider,
    base: Option<RigidBodyHandle>,
    part: RigidBodyHandle,
) -> ImpulseJointHandle {
    let base = base.unwrap_or_else(|| physics.insert_body(RigidBodyBuilder::fixed()));
    let (at, from) = (*physics.bodies[part].position(), *physics.bodies[base].position());
    let along = Frame::from_rotation(Rotation::from_rotation_arc(
        Vector::X,
        Vector::from(slider.axis).normalize(),
    ));
    let data = GenericJointBuilder::new(JointAxesMask::LOCKED_PRISMATIC_AXES)
        .local_frame1(from.inv_mul(&at) * along)
        .local_frame2(along)
        .limits(JointAxis::LinX, slider.range_m)
        .motor_model(JointAxis::LinX, MotorModel::ForceBased)
        .set_motor(JointAxis::LinX, 0.0, 0.0, 0.0, SLIDER_DAMPING)
        .motor_max_force(JointAxis::LinX, slider.friction_n)
        .contacts_enabled(false)
        .build();
    physics.insert_impulse_joint(base, part, data)
}
