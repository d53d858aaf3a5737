//! Parts that have fallen off the table.

use rapier3d::math::{Pose as Frame, Vector};

use super::physics::{PartBody, Scene};

/// Depth below the table's top at which a part is lost, in metres. The table is 40 mm thick, so such a part falls.
const LOST_M: f64 = 0.08;
/// Depth at which lost parts stay, in metres.
const KEPT_M: f64 = 0.30;

impl Scene {
    /// Returns whether a part has fallen off the table; `false` if there is no such part. A part is lost once the
    /// origin of its frame is 8 cm below the table's top. From then on it stays 30 cm below the top, touches nothing,
    /// and costs no time. [`Scene::disturb`] brings it back.
    pub fn lost(&self, part: usize) -> bool {
        self.parts.get(part).is_some_and(|part| self.is_lost(part))
    }

    pub(super) fn is_lost(&self, part: &PartBody) -> bool {
        self.physics.bodies.get(part.body).is_none_or(|body| !body.is_enabled())
    }

    /// Takes the parts that have fallen off the table out of the physics.
    pub(super) fn freeze_lost(&mut self) {
        for part in 0..self.parts.len() {
            let own = &self.parts[part];
            let fallen = self.physics.bodies.get(own.body).is_some_and(|body| {
                body.is_enabled() && own.slider.is_none() && body.translation().z < -LOST_M
            });
            if fallen {
                self.take_away(part);
            }
        }
    }

    /// Takes a part out of the physics, as if it had fallen off the table. Does nothing if there is no such part. The robot
    /// never calls this.
    pub fn take_away(&mut self, part: usize) {
        let Some(part) = self.parts.get(part) else { return };
        if let Some(body) = self.physics.bodies.get_mut(part.body) {
            let at = body.translation();
            let kept = Vector::new(at.x, at.y, -KEPT_M);
            let kept = match kept.is_finite() && body.rotation().is_finite() {
                true => Frame::from_parts(kept, *body.rotation()),
                false => Frame::from_translation(-Vector::Z * KEPT_M),
            };
            body.set_linvel(Vector::ZERO, false);
            body.set_angvel(Vector::ZERO, false);
            body.set_position(kept, false);
            body.set_enabled(false);
        }
    }
}
