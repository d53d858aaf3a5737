//! Bodies that move without the robot: fixtures that another hand moves, landmarks attached to a body, and the sliders
//! of parts.

use rapier3d::dynamics::RigidBodyHandle;
use rapier3d::geometry::ColliderHandle;
use rapier3d::math::{Pose as Frame, Vector};

use super::physics::Scene;
use super::spec::BodyId;
use crate::robot::Pose;
use crate::robot::arm::frame::{frame_of, pose_of};

/// Height above the table at which the room for a fixture is tested, in metres. A fixture touches the table.
const ABOVE_M: f64 = 1e-3;

impl Scene {
    /// Returns the handle of a part or a movable fixture; `None` if there is no such body.
    pub(super) fn handle(&self, body: BodyId) -> Option<RigidBodyHandle> {
        match body {
            BodyId::Part(part) => self.parts.get(part).map(|part| part.body),
            BodyId::Fixture(fixture) => self.movable.get(fixture).copied().flatten(),
        }
    }

    /// Returns the pose of a part or a movable fixture; `None` if there is no such body.
    pub fn body(&self, body: BodyId) -> Option<Pose> {
        Some(pose_of(self.physics.bodies[self.handle(body)?].position()))
    }

    /// Returns the pose of a landmark, by its index in [`SceneSpec::landmarks`](super::SceneSpec::landmarks), in the scene; `None` if there is no
    /// such landmark.
    pub fn landmark(&self, index: usize) -> Option<Pose> {
        let landmark = self.spec().landmarks.get(index)?;
        match landmark.body {
            None => Some(landmark.pose),
            Some(body) => {
                let on = frame_of(&self.body(body)?);
                Some(pose_of(&(on * frame_of(&landmark.pose))))
            }
        }
    }

    /// Returns the number of sliders: joints that the scene's description demands between a part and the table or a
    /// fixture. None of them belongs to the robot.
    pub fn sliders(&self) -> usize {
        let joint = |handle| self.physics.impulse_joints.get(handle);
        let joints = self.parts.iter().filter_map(|part| part.slider.and_then(joint));
        joints.filter(|j| !self.robot_body(j.body1()) && !self.robot_body(j.body2())).count()
    }

    /// Returns the coordinate of a part on its slider, in metres; `None` for a part that moves freely.
    pub fn slid_m(&self, part: usize) -> Option<f64> {
        self.sensed().slider(part).map(|slider| slider.at_m)
    }

    /// Moves a body to `pose`, at rest, as a person might do. A fixture takes along what lies in it. Does nothing if
    /// there is no such body. The robot never calls this.
    pub fn displace(&mut self, body: BodyId, pose: &Pose) {
        let fixture = match body {
            BodyId::Part(part) => return self.disturb(part, pose),
            BodyId::Fixture(fixture) => fixture,
        };
        let Some(handle) = self.handle(body) else { return };
        let carried = self.carried(fixture);
        let (from, to) = (*self.physics.bodies[handle].position(), frame_of(pose));
        self.physics.bodies[handle].set_position(to, true);
        for part in carried {
            let place = to * from.inv_mul(&self.part_frame(part));
            self.disturb(part, &pose_of(&place));
        }
    }

    /// Returns whether a body at `pose` would touch nothing, the robot included; `false` if there is no such body. For
    /// a fixture, this includes the parts that it takes along.
    pub fn room_for(&self, body: BodyId, pose: &Pose) -> bool {
        let fixture = match body {
            BodyId::Part(part) => return self.has_room(part, pose),
            BodyId::Fixture(fixture) => fixture,
        };
        let Some(handle) = self.handle(body) else { return false };
        let carried = self.carried(fixture);
        let (from, to) = (*self.physics.bodies[handle].position(), frame_of(pose));
        let mut own = self.physics.bodies[handle].colliders().to_vec();
        own.extend(carried.iter().map(|part| self.parts[*part].collider));
        let up = Frame::from_translation(Vector::Z * ABOVE_M);
        own.iter().all(|handle| {
            let collider = &self.physics.colliders[*handle];
            let place = up * to * from.inv_mul(&self.place_of(collider));
            !self.touches(&place, collider.shared_shape(), &own)
        })
    }

    /// Returns the parts that a movable fixture takes along: those that touch it, that slide on it, or that touch such
    /// a part.
    pub fn carried(&self, fixture: usize) -> Vec<usize> {
        let Some(handle) = self.handle(BodyId::Fixture(fixture)) else { return Vec::new() };
        let guided = |part: &usize| {
            let slider = self.spec().parts[*part].slider;
            slider.is_some_and(|slider| slider.fixture == Some(fixture))
        };
        let mut carried: Vec<usize> = (0..self.parts.len()).filter(guided).collect();
        let mut touching = self.physics.bodies[handle].colliders().to_vec();
        touching.extend(carried.iter().map(|part| self.parts[*part].collider));
        loop {
            let touches = |part: &usize| {
                let own = self.parts[*part].collider;
                let touch = |other: &ColliderHandle| {
                    let pair = self.physics.contact_pair(own, *other);
                    pair.is_some_and(|pair| pair.has_any_active_contact())
                };
                !carried.contains(part) && touching.iter().any(touch)
            };
            let more: Vec<usize> = (0..self.parts.len()).filter(touches).collect();
            if more.is_empty() {
                return carried;
            }
            touching.extend(more.iter().map(|part| self.parts[*part].collider));
            carried.extend(more);
        }
    }
}
