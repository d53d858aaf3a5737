//! What a robot senses of a scene.
//!
//! A robot knows the shapes of all bodies, and where the fixtures are that never move: its cell is calibrated. It feels its
//! joints and the forces on its pads. Where the other bodies are, it knows from what it has seen, a [`Percept`]. A [`Sensed`]
//! scene is all of this together. Skills and grasps are computed from it and cannot read where a body is in truth.

use rapier3d::dynamics::RigidBodyHandle;
use rapier3d::geometry::{Collider, ColliderHandle, ConvexPolyhedron, SharedShape};
use rapier3d::math::{Pose as Frame, Vector};
use rapier3d::parry::bounding_volume::BoundingVolume;
use rapier3d::prelude::QueryFilter;
use serde::{Deserialize, Serialize};

use super::physics::Scene;
use super::spec::{BodyId, BodyKind, Handling, Landmark, TableSpec};
use crate::robot::Pose;
use crate::robot::arm::bodies;
use crate::robot::arm::frame::{frame_of, pose_of};
use crate::robot::arm::kinematics::{self, Angles};
use crate::robot::arm::{ArmSpec, BodyFrame, GripperSpec};

/// Greatest apparent overlap, in metres, of two parts when one is put into the other.
const MEETING_M: f64 = 1.5e-3;

/// Where a robot takes the parts and movable fixtures of a scene to be. The default knows every pose exactly.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Percept {
    seen: Option<Bodies>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
struct Bodies {
    /// The frames of the parts; `None` for a part that is not there.
    parts: Vec<Option<Frame>>,
    fixtures: Vec<Frame>,
}

impl Percept {
    const EXACT: Self = Self { seen: None };

    /// Returns the percept of a robot that has seen nothing yet: no part is there, and the fixtures stand where they were set
    /// up.
    pub fn before_looking(scene: &Scene) -> Self {
        let fixtures = scene.spec().fixtures.iter().map(|f| f.frame.frame()).collect();
        Self { seen: Some(Bodies { parts: vec![None; scene.part_count()], fixtures }) }
    }

    /// Notes where a part was seen; `None` if it is not there any more. Does nothing if there is no such part.
    pub fn part(&mut self, index: usize, pose: Option<&Pose>) {
        if let Some(part) = self.seen.as_mut().and_then(|seen| seen.parts.get_mut(index)) {
            *part = pose.map(frame_of);
        }
    }

    /// Notes where a landmark was seen. The fixture that carries it, if any, is then where it must be for that.
    pub fn landmark(&mut self, landmark: &Landmark, pose: &Pose) {
        if let (Some(BodyId::Fixture(index)), Some(seen)) = (landmark.body, &mut self.seen)
            && let Some(fixture) = seen.fixtures.get_mut(index)
        {
            *fixture = frame_of(pose) * frame_of(&landmark.pose).inverse();
        }
    }
}

/// A part's slider as it is sensed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SliderState {
    /// Direction of positive coordinates in the scene.
    pub axis: Vector,
    /// Least and greatest coordinate, in metres.
    pub range_m: [f64; 2],
    /// Coordinate, in metres.
    pub at_m: f64,
}

/// A scene as a robot senses it.
#[derive(Clone, Copy)]
pub struct Sensed<'s> {
    scene: &'s Scene,
    percept: &'s Percept,
}

impl Scene {
    /// Returns the scene for a robot that sees every pose exactly.
    pub fn sensed(&self) -> Sensed<'_> {
        self.sensed_by(&Percept::EXACT)
    }

    /// Returns the scene for a robot with this percept.
    pub fn sensed_by<'s>(&'s self, percept: &'s Percept) -> Sensed<'s> {
        Sensed { scene: self, percept }
    }
}

impl<'s> Sensed<'s> {
    /// Returns the number of parts.
    pub fn part_count(&self) -> usize {
        self.scene.part_count()
    }

    /// Returns the kind of each part, by its index in [`SceneSpec::kinds`](super::SceneSpec::kinds).
    pub fn kinds(&self) -> impl Iterator<Item = usize> + use<'s> {
        self.scene.kinds()
    }

    /// Returns a part's kind; `None` if there is no such part.
    pub fn kind(&self, index: usize) -> Option<&'s BodyKind> {
        self.scene.kind(index)
    }

    /// Returns a part's pose; `None` if there is no such part.
    pub fn part(&self, index: usize) -> Option<Pose> {
        (index < self.part_count()).then(|| pose_of(&self.part_frame(index)))
    }

    /// Returns a part's frame; `None` if there is no such part.
    pub fn body_frame(&self, index: usize) -> Option<BodyFrame> {
        (index < self.part_count()).then(|| BodyFrame::of(&self.part_frame(index)))
    }

    /// Returns whether a part has fallen off the table: it is not seen any more.
    pub fn lost(&self, part: usize) -> bool {
        match &self.percept.seen {
            None => self.scene.lost(part),
            Some(seen) => seen.parts.get(part).is_some_and(Option::is_none),
        }
    }

    /// Returns whether all parts are slower than `speed_m_s`, or `None` if the speeds cannot be seen.
    pub(crate) fn is_still(&self, speed_m_s: f64) -> Option<bool> {
        let slow = |part| self.scene.part_speed(part) < speed_m_s;
        self.percept.seen.is_none().then(|| (0..self.part_count()).all(slow))
    }

    pub(crate) fn part_frame(&self, index: usize) -> Frame {
        self.place(self.scene.parts[index].body)
    }

    /// Returns the frame of a body.
    fn place(&self, body: RigidBodyHandle) -> Frame {
        let of = |handle| self.scene.physics.bodies.get(handle).map(|body| *body.position());
        let seen = self.percept.seen.as_ref().and_then(|seen| {
            if let Some(part) = self.scene.parts.iter().position(|part| part.body == body) {
                // A part that is not there is below the table.
                return seen.parts[part].or(Some(Frame::from_translation(-Vector::Z)));
            }
            let fixture = self.scene.movable.iter().position(|fixture| *fixture == Some(body));
            fixture.map(|fixture| seen.fixtures[fixture])
        });
        seen.or_else(|| of(body)).unwrap_or_default()
    }

    /// Returns the positions of the landmarks of other bodies than a part, in metres.
    pub(crate) fn marks(&self, part: usize) -> impl Iterator<Item = Vector> + '_ {
        let others = self.scene.spec().landmarks.iter();
        let others = others.filter(move |own| own.body != Some(BodyId::Part(part)));
        others.map(|mark| {
            let body = mark.body.and_then(|body| self.scene.handle(body));
            let on = body.map_or(Frame::IDENTITY, |body| self.place(body));
            on * Vector::from(mark.pose.position)
        })
    }

    /// Returns a part's slider; `None` for a part that moves freely.
    pub(crate) fn slider(&self, part: usize) -> Option<SliderState> {
        let joint = self.scene.parts.get(part)?.slider?;
        let joint = self.scene.physics.impulse_joints.get(joint)?;
        let base = self.place(joint.body1()) * joint.data.local_frame1;
        let now = self.place(joint.body2()) * joint.data.local_frame2;
        let axis = base.rotation * Vector::X;
        let range_m = self.scene.spec().parts[part].slider?.range_m;
        Some(SliderState { axis, range_m, at_m: (now.translation - base.translation).dot(axis) })
    }

    /// Returns how the robot puts down a part of this kind.
    pub(crate) fn handling(&self, index: usize) -> &'s Handling {
        &self.scene.spec().kinds[self.scene.parts[index].kind].handling
    }

    pub(crate) fn table(&self) -> &'s TableSpec {
        &self.scene.spec().table
    }

    pub(crate) fn arm(&self) -> &'s ArmSpec {
        &self.scene.spec().arm
    }

    pub(crate) fn gripper(&self) -> &'s GripperSpec {
        &self.scene.spec().gripper
    }

    /// Returns whether a point is above the table, inside the rim.
    pub(crate) fn is_over_table(&self, at: Vector) -> bool {
        let [low, high] = self.table().rim;
        (low[0]..=high[0]).contains(&at.x) && (low[1]..=high[1]).contains(&at.y)
    }

    /// Returns the convex pieces of a part, in the part's frame; none if there is no such part.
    pub(crate) fn pieces(&self, part: usize) -> Vec<&'s ConvexPolyhedron> {
        let collider = self.scene.parts.get(part);
        let collider = collider.and_then(|p| self.scene.physics.colliders.get(p.collider));
        let compound = collider.and_then(|collider| collider.shape().as_compound());
        let shapes = compound.map(|compound| compound.shapes()).unwrap_or_default();
        shapes.iter().filter_map(|(_, shape)| shape.as_convex_polyhedron()).collect()
    }

    /// Returns a part's centre of mass in the part's frame, and its weight in newtons.
    pub(crate) fn mass(&self, part: usize) -> (Vector, f64) {
        let bodies = &self.scene.physics.bodies;
        let body = self.scene.parts.get(part).and_then(|p| bodies.get(p.body));
        let middle = body.map_or(Vector::ZERO, |body| body.local_center_of_mass());
        (middle, self.scene.weight_n(part).unwrap_or_default())
    }

    /// Returns the joint angles.
    pub(crate) fn angles(&self) -> Angles {
        self.scene.angles()
    }

    /// Returns the greater distance of a finger from the middle of the gripper, in metres.
    pub(crate) fn opening(&self) -> f64 {
        self.scene.frame().fingers.into_iter().fold(0.0, f64::max)
    }

    pub(crate) fn tool_frame(&self) -> Frame {
        self.scene.tool_frame()
    }

    /// Returns the force with which each pad presses on a part, in newtons.
    pub(crate) fn pad_forces(&self, index: usize) -> [f64; 2] {
        self.scene.pad_forces(index)
    }

    /// Returns whether the arm at `angles`, with its fingers at `opening`, would touch anything except the
    /// parts in `ignored`.
    pub(crate) fn collides(&self, angles: &Angles, opening: f64, ignored: &[usize]) -> bool {
        self.comes_near(angles, opening, ignored, 0.0)
    }

    /// Returns whether the arm at `angles`, with its fingers at `opening`, would come within about `within_m` metres of
    /// anything except the parts in `ignored`.
    pub(crate) fn comes_near(
        &self,
        angles: &Angles,
        opening: f64,
        ignored: &[usize],
        within_m: f64,
    ) -> bool {
        self.touches(bodies::outline(angles, opening, within_m), ignored)
    }

    /// Returns whether the hand alone, with the end effector at `tool` and its fingers at `opening`, would touch
    /// anything except the parts in `ignored`.
    pub(crate) fn hand_collides(&self, tool: &Frame, opening: f64, ignored: &[usize]) -> bool {
        self.touches(bodies::hand_outline(tool, opening), ignored)
    }

    /// Returns whether any of part `index` lies between the fingers, with the end effector at `tool` and its fingers at
    /// `opening`. Otherwise they close on nothing.
    pub(crate) fn is_between_fingers(&self, index: usize, tool: &Frame, opening: f64) -> bool {
        let (at, space) = bodies::between_fingers(tool, opening);
        meet((&at, &space), (&self.part_frame(index), self.shape(index)))
    }

    /// Returns whether part `index` at `frame` would touch anything except the robot.
    pub(crate) fn part_collides(&self, index: usize, frame: &Frame) -> bool {
        self.touches(std::iter::once((*frame, self.shape(index).clone())), &[index])
    }

    /// Returns whether the hand, or the held part with its frame, would run into the arm at `angles` itself.
    pub(crate) fn folds(
        &self,
        angles: &Angles,
        opening: f64,
        held: Option<(usize, Frame)>,
    ) -> bool {
        let part = held.map(|(index, frame)| (frame, self.shape(index).clone()));
        let mut outer: Vec<_> = bodies::hand_outline(&kinematics::tool(angles), opening).collect();
        outer.extend(part);
        let meets = |(at, link): (Frame, SharedShape)| {
            outer.iter().any(|(frame, shape)| meet((frame, shape), (&at, &link)))
        };
        bodies::near_links(angles).any(meets)
    }

    /// Returns whether part `index` at `frame` would overlap another part by more than [`MEETING_M`].
    pub(crate) fn part_meets_part(&self, index: usize, frame: &Frame) -> bool {
        let shape = self.shape(index);
        (0..self.part_count()).filter(|other| *other != index).any(|other| {
            let (place, theirs) = (self.part_frame(other), self.shape(other));
            parry3d::query::contact(frame, &**shape, &place, &**theirs, 0.0)
                .is_ok_and(|c| c.is_some_and(|c| c.dist < -MEETING_M))
        })
    }

    fn shape(&self, part: usize) -> &'s SharedShape {
        self.scene.physics.colliders[self.scene.parts[part].collider].shared_shape()
    }

    /// Returns whether shapes touch anything except the robot and the parts in `ignored`.
    fn touches(
        &self,
        mut shapes: impl Iterator<Item = (Frame, SharedShape)>,
        ignored: &[usize],
    ) -> bool {
        let Self { scene, percept } = *self;
        let known = percept.seen.is_none();
        let others: Vec<(Frame, &SharedShape)> =
            if known { Vec::new() } else { self.seen_shapes(ignored).collect() };
        let skip = |handle: ColliderHandle| {
            ignored.iter().any(|part| scene.parts[*part].collider == handle)
        };
        let filter = |handle: ColliderHandle, collider: &Collider| {
            let own = |body| scene.robot_body(body);
            collider.parent().is_none_or(|body| known && !own(body)) && !skip(handle)
        };
        let filter = QueryFilter::new().predicate(&filter);
        let query = scene.physics.query_pipeline_with_filter(filter);
        shapes.any(|(frame, shape)| {
            query.intersect_shape(frame, &*shape).next().is_some()
                || others.iter().any(|(at, other)| meet((&frame, &shape), (at, other)))
        })
    }

    /// Returns the shapes of parts and movable fixtures where they are seen, except for the parts in `ignored`.
    fn seen_shapes(&self, ignored: &[usize]) -> impl Iterator<Item = (Frame, &'s SharedShape)> {
        let Self { scene, .. } = *self;
        let parts = (0..scene.parts.len()).filter(|part| !ignored.contains(part));
        let parts = parts.map(|part| scene.parts[part].body);
        let bodies = parts.chain(scene.movable.iter().copied().flatten());
        bodies.flat_map(move |body| {
            let at = self.place(body);
            scene.physics.bodies[body].colliders().iter().map(move |handle| {
                let collider = &scene.physics.colliders[*handle];
                let on = collider.position_wrt_parent().copied().unwrap_or_default();
                (at * on, collider.shared_shape())
            })
        })
    }
}

/// Returns whether two shapes in their frames touch.
pub(super) fn meet(
    (at, shape): (&Frame, &SharedShape),
    (place, other): (&Frame, &SharedShape),
) -> bool {
    shape.compute_aabb(at).intersects(&other.compute_aabb(place))
        && parry3d::query::intersection_test(at, &**shape, place, &**other)
            .is_ok_and(|met| met.intersecting)
}
