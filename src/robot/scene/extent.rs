//! The space that a body takes, as a rectangle on the table and a range of heights.

use crate::robot::arm::BodyFrame;

/// The space that a body takes: a rectangle on the table, in any direction, and a range of heights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Extent {
    middle: [f64; 2],
    /// Direction of the rectangle's first side.
    along: [f64; 2],
    half: [f64; 2],
    /// Lowest and highest point.
    pub z: [f64; 2],
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

impl Extent {
    /// Returns the space that `corners` (in the body's frame) take at `frame`.
    pub fn of(corners: &[[f64; 3]], frame: &BodyFrame) -> Self {
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let flat = axes.map(|axis| {
            let [x, y, _] = frame.turn.apply(axis);
            [x, y]
        });
        let long = flat.into_iter().max_by(|a, b| dot(*a, *a).total_cmp(&dot(*b, *b)));
        let [x, y] = long.unwrap_or([1.0, 0.0]);
        let length = x.hypot(y);
        let along = [x / length, y / length];
        let across = [-along[1], along[0]];
        let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
        for corner in corners {
            let [x, y, z] = frame.turn.apply(*corner);
            for ([low, high], value) in
                range.iter_mut().zip([dot([x, y], along), dot([x, y], across), z])
            {
                *low = low.min(value);
                *high = high.max(value);
            }
        }
        let [u, v] = [0, 1].map(|i| (range[i][0] + range[i][1]) / 2.0);
        let middle = std::array::from_fn(|i| frame.position[i] + u * along[i] + v * across[i]);
        let half = [0, 1].map(|i| (range[i][1] - range[i][0]) / 2.0);
        let z = range[2].map(|z| frame.position[2] + z);
        Self { middle, along, half, z }
    }

    fn axes(&self) -> [[f64; 2]; 2] {
        [self.along, [-self.along[1], self.along[0]]]
    }

    fn reach(&self, axis: [f64; 2]) -> f64 {
        let [a, b] = self.axes();
        self.half[0] * dot(a, axis).abs() + self.half[1] * dot(b, axis).abs()
    }

    /// Returns whether the rectangles are closer than `gap` (or, for a negative gap, overlap by more).
    pub fn near(&self, other: &Self, gap: f64) -> bool {
        let apart = [self.middle[0] - other.middle[0], self.middle[1] - other.middle[1]];
        let axes = self.axes().into_iter().chain(other.axes());
        // Convex shapes are apart if and only if some direction of an edge separates them.
        axes.into_iter()
            .all(|axis| dot(apart, axis).abs() < self.reach(axis) + other.reach(axis) + gap)
    }

    /// Returns whether the two bodies take the same space, by more than `depth` in every direction.
    pub fn meets(&self, other: &Self, depth: f64) -> bool {
        let [low, high] = [self.z[0].max(other.z[0]), self.z[1].min(other.z[1])];
        high - low > depth && self.near(other, -depth)
    }

    /// Returns whether this body lies on the other.
    pub fn is_on(&self, other: &Self) -> bool {
        const SUNK_M: f64 = 4e-3;
        const ABOVE_M: f64 = 4e-3;
        let height = self.z[0] - other.z[1];
        (-SUNK_M..ABOVE_M).contains(&height) && self.near(other, -2e-3)
    }

    /// Returns the corners of the rectangle.
    pub fn corners(&self) -> [[f64; 2]; 4] {
        let [a, b] = self.axes();
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(u, v)| {
            let [u, v] = [u * self.half[0], v * self.half[1]];
            std::array::from_fn(|i| self.middle[i] + u * a[i] + v * b[i])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::arm::Turn;
    use crate::robot::scene::cuboid;

    #[test]
    fn rectangles_that_cross_at_an_angle_are_near_and_others_are_not() {
        let bar = |at: [f64; 2], degrees: f64| {
            let turn = Turn::about_z(degrees.to_radians());
            let corners = cuboid([0.0; 3], [0.05, 0.006, 0.006]);
            Extent::of(&corners, &BodyFrame { position: [at[0], at[1], 0.006], turn })
        };
        let one = bar([0.4, 0.0], 0.0);
        assert!(one.near(&bar([0.4, 0.03], 90.0), 0.0));
        assert!(!one.near(&bar([0.4, 0.03], 0.0), 0.01));
        assert!(one.near(&bar([0.4, 0.03], 0.0), 0.02));
        // The circles around these bars meet, and so do the boxes along the axes.
        assert!(!bar([0.4, 0.0], 45.0).near(&bar([0.42, -0.02], 45.0), 0.01));
        assert!((one.z[0]).abs() < 1e-12 && (one.z[1] - 0.012).abs() < 1e-12);
    }
}
