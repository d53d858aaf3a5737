//! Levelled frames and directions.

use std::f64::consts::PI;

use super::frame::{BodyFrame, Turn};
use super::vector::{add, cross, scale, sub, unit};

pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Returns the angle between two directions, in degrees.
pub(crate) fn angle_deg(a: [f64; 3], b: [f64; 3]) -> f64 {
    dot(unit(a), unit(b)).clamp(-1.0, 1.0).acos().to_degrees()
}

/// Returns the smallest rotation that takes direction `from` to direction `to`.
pub(crate) fn arc(from: [f64; 3], to: [f64; 3]) -> Turn {
    let (from, to) = (unit(from), unit(to));
    let axis = cross(from, to);
    let (sin, cos) = (dot(axis, axis).sqrt(), dot(from, to));
    if sin > 1e-9 {
        return Turn::about(scale(axis, 1.0 / sin), sin.atan2(cos));
    }
    if cos > 0.0 {
        return Turn::NONE;
    }
    let any = if from[0].abs() < 0.9 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    Turn::about(unit(cross(from, any)), PI)
}

/// A frame whose z axis points up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Level {
    origin: [f64; 3],
    axes: [[f64; 3]; 3],
}

impl Level {
    /// The frame of the scene.
    pub const WORLD: Self =
        Self { origin: [0.0; 3], axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] };

    /// Returns the levelled frame of a body. Its x axis follows the horizontal direction of the body's x axis, or of
    /// its y axis if the x axis is vertical.
    pub fn of(frame: &BodyFrame) -> Self {
        let flat = |axis: [f64; 3]| {
            let [x, y, _] = frame.turn.apply(axis);
            (x.hypot(y) > 0.3).then(|| unit([x, y, 0.0]))
        };
        let x = flat([1.0, 0.0, 0.0]).or_else(|| flat([0.0, 1.0, 0.0])).unwrap_or([1.0, 0.0, 0.0]);
        let z = [0.0, 0.0, 1.0];
        Self { origin: frame.position, axes: [x, cross(z, x), z] }
    }

    /// Returns a direction of this frame in the scene.
    pub fn direction(&self, local: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = self.axes;
        add(add(scale(x, local[0]), scale(y, local[1])), scale(z, local[2]))
    }

    /// Returns a point of this frame in the scene.
    pub fn point(&self, local: [f64; 3]) -> [f64; 3] {
        add(self.origin, self.direction(local))
    }

    /// Returns a point of the scene in this frame.
    pub fn local(&self, point: [f64; 3]) -> [f64; 3] {
        let by = sub(point, self.origin);
        self.axes.map(|axis| dot(axis, by))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_goes_into_a_frame_and_back() {
        let turn = Turn::about_z(2.0) * Turn::about_x(PI);
        let level = Level::of(&BodyFrame { position: [0.4, 0.1, 0.02], turn });
        let point = level.point([0.1, -0.2, 0.03]);
        let back = level.local(point);
        assert!((0..3).all(|i| (back[i] - [0.1, -0.2, 0.03][i]).abs() < 1e-12), "{back:?}");
        assert!((point[2] - 0.05).abs() < 1e-12, "the body is upside down, its frame is not");
    }

    #[test]
    fn the_arc_takes_one_direction_to_the_other() {
        for to in [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.6, -0.5, 0.2]] {
            let turned = arc([0.0, 0.0, 1.0], to).apply([0.0, 0.0, 1.0]);
            assert!(angle_deg(turned, to) < 1e-5, "{to:?}: {turned:?}");
        }
    }
}
