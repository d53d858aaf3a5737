//! Fixtures and references as they stood in the demonstrations: level where noise tilts them, and the right way up.

use nalgebra::Vector3;

use super::classifier::Classifier;
use super::layout::Located;
use crate::robot::{Pose, quaternion_array};
use crate::task::domain::{Frame, Origin, Turn, levelled};
use crate::task::recording::{ObjectPose, Snapshot};

/// Greatest tilt of a fixture that is noise, in its standard deviations about one axis. An angle that is normal about an axis of any
/// direction has long tails: one look in 15 tilts more than three of these.
const TILTED: f64 = 6.0;
/// The same of a part that was put somewhere, which may really lean.
const LEANS: f64 = 3.0;

impl Classifier {
    /// Returns the axis of the world along which the sides point that are up of the fixtures that stand level, where no state shows what
    /// is up; `None` if there are none.
    fn upright_axis(&self, scene: &Snapshot) -> Option<usize> {
        let side = |object: &ObjectPose| {
            let side = self.level.get(&*object.kind)?;
            Some(object.pose.rotation() * Vector3::from(*side))
        };
        let sum = scene.objects.iter().filter_map(side).reduce(|a, b| a + b)?;
        Some(sum.imax())
    }

    /// Returns the scene with the fixtures level that stood level in every demonstration, unless they are tilted more than noise
    /// explains; `None` if there are none. A tilt would move all that stands high on them.
    pub(super) fn levelled(&self, scene: &Snapshot) -> Option<Snapshot> {
        let up = Vector3::ith(self.up.or_else(|| self.upright_axis(scene))?, 1.0);
        let mut scene = scene.clone();
        for object in &mut scene.objects {
            let Some(side) = self.level.get(&*object.kind) else { continue };
            let side = Vector3::from(*side);
            if (object.pose.rotation() * side).angle(&up) <= TILTED * self.noise_rad {
                object.pose = levelled(&object.pose, &side, &up);
            }
        }
        Some(scene)
    }

    /// Returns the scene in which references that lie upside down are turned over, and those that are tilted within the noise stand as
    /// they did in the demonstrations; `None` if there are none. A placed object may lie either way up along its constrained axis,
    /// but what is put onto it goes to its upper side.
    pub(super) fn righted(&self, scene: &Snapshot, located: &[Located]) -> Option<Snapshot> {
        let carries = |kind: &str| {
            self.states.iter().any(|s| matches!(&s.frame, Frame::Kind(own) if **own == *kind))
        };
        let mut over = Vec::new();
        for (index, (object, located)) in scene.objects.iter().zip(located).enumerate() {
            let Some(fact) = located.fact.filter(|_| carries(&object.kind)) else { continue };
            let state = &self.states[fact.state];
            let mean = state.places[fact.place].pose().rotation();
            let mean = match fact.reference {
                Some(reference) => scene.objects[reference].pose.rotation() * mean,
                None => mean,
            };
            let mean = Pose { orientation: quaternion_array(&mean), ..object.pose };
            let mean = state.turn.faced(&mean, &object.pose).rotation();
            let (axis, sd) = match (state.turn, self.up) {
                (Turn::Axis { axis, sd } | Turn::Line { axis, sd }, _) => (Vector3::from(axis), sd),
                (Turn::Full { sd } | Turn::Sides { sd, .. }, Some(up)) => {
                    (mean.inverse() * Vector3::ith(up, 1.0), sd)
                }
                _ => continue,
            };
            let (shown, seen) = (mean * axis, object.pose.rotation() * axis);
            let tilt = shown.angle(&seen);
            let stands =
                fact.reference.is_none_or(|r| self.level.contains_key(&*scene.objects[r].kind));
            if stands && sd <= self.noise_rad && tilt <= LEANS * self.noise_rad {
                let level = levelled(&object.pose, &axis, &shown);
                over.push((index, level.orientation));
            }
            let either_way = matches!(state.turn, Turn::Axis { .. })
                && state.origin == Origin::Placed
                && !state.turn_matters;
            if !either_way || shown.dot(&seen) >= 0.0 {
                continue;
            }
            let aside = if axis.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
            let about = nalgebra::Unit::new_normalize(axis.cross(&aside));
            let half = nalgebra::UnitQuaternion::from_axis_angle(&about, std::f64::consts::PI);
            let turned = (object.pose.rotation() * half).into_inner().coords;
            over.push((index, [turned.x, turned.y, turned.z, turned.w]));
        }
        if over.is_empty() {
            return None;
        }
        let mut scene = scene.clone();
        for (index, orientation) in over {
            scene.objects[index].pose.orientation = orientation;
        }
        Some(scene)
    }
}
