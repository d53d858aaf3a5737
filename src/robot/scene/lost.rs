//! Parts that have fallen off the table, and the solid shape of a part.

use rapier3d::geometry::ConvexPolyhedron;
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
        for part in &self.parts {
            let Some(body) = self.physics.bodies.get(part.body) else { continue };
            let at = body.translation();
            if !body.is_enabled() || part.slider.is_some() || at.z >= -LOST_M {
                continue;
            }
            let kept = Vector::new(at.x, at.y, -KEPT_M);
            let kept = match kept.is_finite() && body.rotation().is_finite() {
                true => Frame::from_parts(kept, *body.rotation()),
                false => Frame::from_translation(-Vector::Z * KEPT_M),
            };
            if let Some(body) = self.physics.bodies.get_mut(part.body) {
                body.set_linvel(Vector::ZERO, false);
                body.set_angvel(Vector::ZERO, false);
                body.set_position(kept, false);
                body.set_enabled(false);
            }
        }
    }

    /// Returns whether a point is above the table, inside the rim.
    pub(crate) fn is_over_table(&self, at: Vector) -> bool {
        let [low, high] = self.spec().table.rim;
        (low[0]..=high[0]).contains(&at.x) && (low[1]..=high[1]).contains(&at.y)
    }

    /// Returns the convex pieces of a part, in the part's frame; none if there is no such part.
    pub(crate) fn pieces(&self, part: usize) -> Vec<&ConvexPolyhedron> {
        let collider = self.parts.get(part).and_then(|p| self.physics.colliders.get(p.collider));
        let compound = collider.and_then(|collider| collider.shape().as_compound());
        let shapes = compound.map(|compound| compound.shapes()).unwrap_or_default();
        shapes.iter().filter_map(|(_, shape)| shape.as_convex_polyhedron()).collect()
    }

    /// Returns a part's centre of mass in the part's frame, and its mass in kilograms.
    pub(crate) fn mass(&self, part: usize) -> (Vector, f64) {
        let body = self.parts.get(part).and_then(|p| self.physics.bodies.get(p.body));
        body.map_or((Vector::ZERO, 0.0), |body| (body.local_center_of_mass(), body.mass()))
    }
}
