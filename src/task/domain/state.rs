//! States in a frame: places, open coordinates and constrained orientations.

use nalgebra::{Unit, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::frame::Frame;
use crate::robot::{Pose, quaternion_array, rotation_between};

/// How objects came into a state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Origin {
    /// The objects lay there when a demonstration began, or were knocked there.
    Found,
    /// The objects were put there.
    Placed,
}

/// One coordinate of a place, in its frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum Coordinate {
    /// The coordinate agrees between the demonstrations.
    Tight {
        /// Robust mean, in metres.
        mean: f64,
        /// Standard deviation, in metres.
        sd: f64,
    },
    /// The coordinate is open: objects lay anywhere in this range.
    Open {
        /// Smallest value, in metres.
        low: f64,
        /// Greatest value, in metres.
        high: f64,
    },
}

impl Coordinate {
    /// Returns the mean, or the middle of the range, in metres.
    pub fn middle(&self) -> f64 {
        match *self {
            Self::Tight { mean, .. } => mean,
            Self::Open { low, high } => 0.5 * (low + high),
        }
    }

    /// Returns the range in which objects lie if the coordinate has room for several: its own, or the better part of a wide
    /// spread; `None` if the coordinate fixes its object.
    pub(crate) fn room(&self) -> Option<(f64, f64)> {
        match *self {
            Self::Open { low, high } => Some((low, high)),
            Self::Tight { mean, sd } => {
                (sd > ROOMY_M).then_some((mean - 1.2 * sd, mean + 1.2 * sd))
            }
        }
    }

    /// Returns whether the coordinate is open.
    pub fn is_open(&self) -> bool {
        matches!(self, Self::Open { .. })
    }
}

/// A place of a state, in the state's frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Place {
    /// The three coordinates.
    pub coordinates: [Coordinate; 3],
    /// Mean orientation, a unit quaternion `[x, y, z, w]`. [`FrameState::turn`] says how much of it matters.
    pub orientation: [f64; 4],
    /// Number of distinct poses that the place was learned from.
    pub count: usize,
}

/// Standard deviation, or width of a range, above which a place holds any number of objects, in metres. No recording
/// tells how large an object is. What a gripper takes is a few centimetres wide: positions that scatter more than this
/// were not all those of one object put down with care.
pub(crate) const ROOMY_M: f64 = 0.015;
/// Distance below which two places exclude each other, in metres: objects of this size would overlap.
const SAME_PLACE_M: f64 = 0.008;

impl Place {
    /// Returns the mean pose, in the place's frame. Open coordinates have the middle of their range.
    pub fn pose(&self) -> Pose {
        Pose { position: self.coordinates.map(|c| c.middle()), orientation: self.orientation }
    }

    /// Returns whether the place holds any number of objects.
    pub(crate) fn is_roomy(&self) -> bool {
        self.coordinates.iter().any(|c| c.room().is_some())
    }

    /// Returns whether there is room for one object alone at this place and another in the same frame.
    pub(crate) fn excludes(&self, other: &Self) -> bool {
        let near = self.pose().distance(&other.pose()) < SAME_PLACE_M;
        near && !self.is_roomy() && !other.is_roomy()
    }
}

/// How a state constrains the orientation of its object.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum Turn {
    /// Not at all.
    Free,
    /// One axis of the object points in a fixed direction; the object may be turned about this axis.
    Axis {
        /// The axis, a unit vector in the object's frame.
        axis: [f64; 3],
        /// Standard deviation of the direction about each of two perpendicular axes, in radians.
        sd: f64,
    },
    /// One axis of the object lies along a fixed line, with either end ahead; the object may be turned about this axis.
    Line {
        /// The axis, a unit vector in the object's frame.
        axis: [f64; 3],
        /// Standard deviation of the direction about each of two perpendicular axes, in radians.
        sd: f64,
    },
    /// Fully.
    Full {
        /// Standard deviation about each axis, in radians.
        sd: f64,
    },
    /// Fully, but for an object that looks alike from several sides: it may be turned by parts of a full turn about an axis.
    Sides {
        /// The axis, a unit vector in the object's frame.
        axis: [f64; 3],
        /// Number of equal parts of a full turn, 2 to 12.
        sides: u8,
        /// Standard deviation about each axis, in radians.
        sd: f64,
    },
}

/// Greatest number of sides from which an object may look alike.
pub(crate) const MOST_SIDES: u8 = 12;

impl Turn {
    /// Returns `free`, `axis` or `full`.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Free => "free",
            Self::Axis { .. } | Self::Line { .. } => "axis",
            Self::Full { .. } | Self::Sides { .. } => "full",
        }
    }

    /// Returns the standard deviation of the constrained directions, in radians; `None` if the orientation is free.
    pub fn sd(&self) -> Option<f64> {
        match *self {
            Self::Free => None,
            Self::Axis { sd, .. }
            | Self::Line { sd, .. }
            | Self::Full { sd }
            | Self::Sides { sd, .. } => Some(sd),
        }
    }

    /// Returns `mean`, turned to the side from which an object that looks alike from several sides is nearest to `pose`, or with the end
    /// ahead that is nearer. Both are in one frame.
    pub fn faced(&self, mean: &Pose, pose: &Pose) -> Pose {
        if let Self::Line { axis, .. } = *self {
            let [line, own] = [mean, pose].map(|p| p.rotation() * Vector3::from(axis));
            let line = if line.dot(&own) < 0.0 { -line } else { line };
            let least = UnitQuaternion::rotation_between(&own, &line).unwrap_or_default();
            return Pose { orientation: quaternion_array(&(least * pose.rotation())), ..*mean };
        }
        let Self::Sides { axis, sides, .. } = *self else { return *mean };
        let axis = Unit::new_normalize(Vector3::from(axis));
        let alike = (0..sides).map(|k| {
            let angle = std::f64::consts::TAU * f64::from(k) / f64::from(sides);
            let turned = mean.rotation() * UnitQuaternion::from_axis_angle(&axis, angle);
            (turned.angle_to(&pose.rotation()), turned)
        });
        let nearest = alike.min_by(|a, b| a.0.total_cmp(&b.0));
        let orientation = nearest.map_or(mean.orientation, |(_, q)| quaternion_array(&q));
        Pose { orientation, ..*mean }
    }

    /// Returns the angle by which `pose` deviates from `mean` in the constrained directions, in radians, and its
    /// standard deviation; `None` if the orientation is free.
    pub fn deviation(&self, mean: &Pose, pose: &Pose) -> Option<(f64, f64)> {
        match self {
            Self::Free => None,
            Self::Axis { axis, sd } | Self::Line { axis, sd } => {
                let axis = Vector3::from(*axis);
                let mean = self.faced(mean, pose);
                let (a, b) = (mean.rotation() * axis, pose.rotation() * axis);
                Some((a.angle(&b), *sd))
            }
            Self::Full { sd } | Self::Sides { sd, .. } => {
                let turn = rotation_between(&self.faced(mean, pose), pose);
                Some((turn.iter().map(|v| v * v).sum::<f64>().sqrt(), *sd))
            }
        }
    }
}

/// A state that an object of one kind can be in, in a frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrameState {
    /// Name of the state: an upper-case letter, then letters, digits and `_`.
    pub name: String,
    /// Kind of the objects that can be in the state.
    pub kind: String,
    /// Frame of the places.
    pub frame: Frame,
    /// The places, at least one.
    pub places: Vec<Place>,
    /// How the orientation is constrained.
    pub turn: Turn,
    /// Whether the orientation tells this state from others: some attempts only turned an object of this kind.
    pub turn_matters: bool,
    /// How most objects came into the state.
    pub origin: Origin,
    /// Number of poses that the state was learned from.
    pub count: usize,
    /// Whether agreement in a single tight coordinate is enough. This holds for objects that were found in so few
    /// poses that no demonstration has varied every coordinate.
    pub any_coordinate: bool,
}
