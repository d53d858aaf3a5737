//! The truth about a world: states, needs of actions and the goal. It serves scoring; a learner must not see it.

use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Deserializer};

use crate::robot::Pose;
use crate::robot::pose::quaternion_array;

/// How an object's orientation in a state is fixed, relative to the state's frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Turn {
    /// Any orientation.
    Free,
    /// The object's z axis has the direction of the place's z axis. The angle about this axis is free.
    #[default]
    Axis,
    /// The orientation of the place.
    Full,
}

/// How far from a place an object may rest.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Extent {
    /// One point. Each place holds one object.
    Spot {
        /// Largest accepted distance of a target from the place, in metres. Up to [`TIGHT_M`] the object snaps into the
        /// place, otherwise it stays where it was put.
        tolerance_m: f64,
    },
    /// A box around the place. It holds any number of objects.
    Area {
        /// Half of the box's length and width along the axes of the place, in metres.
        half_m: [f64; 2],
        /// Range of resting heights above the place, in metres. 0 for a flat surface.
        #[serde(default)]
        depth_m: f64,
    },
}

impl Default for Extent {
    fn default() -> Self {
        Self::Spot { tolerance_m: 3e-3 }
    }
}

/// Largest tolerance of a place into which objects snap, in metres.
pub const TIGHT_M: f64 = 5e-3;

/// A state that objects of one kind can be in, and the rules of entering it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrueState {
    /// Name, such as `NUT_IN_POCKET`.
    pub name: &'static str,
    /// Kind of the objects.
    pub kind: &'static str,
    /// Kind of the reference object in whose frame the places are; `None` for the world frame.
    #[serde(default)]
    pub frame: Option<&'static str>,
    /// Places in the frame, at least one.
    #[serde(deserialize_with = "places")]
    pub places: Vec<Pose>,
    /// How far from a place an object may rest.
    #[serde(default)]
    pub extent: Extent,
    /// How the orientation is fixed.
    #[serde(default)]
    pub turn: Turn,
    /// Largest accepted deviation from the orientation that `turn` fixes, in degrees.
    #[serde(default = "five")]
    pub tolerance_deg: f64,
    /// The one size of objects that may enter, by its number; every size may if `None`.
    #[serde(default)]
    pub size: Option<usize>,
    /// Conditions for entering the state.
    #[serde(default)]
    pub needs: Vec<Need>,
    /// Conditions of which at least one must hold for entering the state, if there are any.
    #[serde(default)]
    pub either: Vec<Need>,
    /// Conditions for entering and leaving the state.
    #[serde(default)]
    pub reach: Vec<Need>,
}

fn five() -> f64 {
    5.0
}

/// Reads places: a point, and an orientation by an axis and an angle.
fn places<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<Pose>, D::Error> {
    #[derive(Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Place {
        at: [f64; 3],
        #[serde(default)]
        axis: Option<[f64; 3]>,
        #[serde(default)]
        degrees: f64,
    }
    let pose = |place: Place| {
        let axis = place.axis.map_or(Vector3::z(), Vector3::from);
        let turn = UnitQuaternion::new(axis * place.degrees.to_radians());
        Pose { orientation: quaternion_array(&turn), ..Pose::at(place.at) }
    };
    Ok(Vec::deserialize(from)?.into_iter().map(pose).collect())
}

impl TrueState {
    /// Returns whether the state has points as places, not areas.
    pub fn is_spot(&self) -> bool {
        matches!(self.extent, Extent::Spot { .. })
    }
}

/// A condition that the world demands before an object can enter a state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Need {
    /// The moved object is in this state.
    Object(&'static str),
    /// The reference object is in this state.
    Reference(&'static str),
    /// At least so many objects are in the state relative to the reference object.
    Holds {
        /// The state.
        state: &'static str,
        /// The least number of objects.
        at_least: usize,
    },
    /// Some object other than the moved and the reference object is in this state.
    Somewhere(&'static str),
    /// No object other than the moved and the reference object is in this state.
    Nowhere(&'static str),
    /// No other object is in this state relative to the reference object.
    Clear(&'static str),
    /// Every other object of the state's kind is in the state.
    Every(&'static str),
}

impl Need {
    /// Returns the state that the need is about.
    pub fn state(&self) -> &'static str {
        match self {
            Self::Object(state)
            | Self::Reference(state)
            | Self::Holds { state, .. }
            | Self::Somewhere(state)
            | Self::Nowhere(state)
            | Self::Clear(state)
            | Self::Every(state) => state,
        }
    }
}

/// One condition of a goal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrueGoal {
    /// The state.
    pub state: &'static str,
    /// Kind over whose objects the condition ranges. The frame's kind: each reference object has `at_least` objects in
    /// the state. The state's own kind: every object of the kind is in the state. `None`: the whole world is counted.
    #[serde(default)]
    pub each: Option<&'static str>,
    /// The least number of objects in the state.
    #[serde(default = "one")]
    pub at_least: usize,
}

fn one() -> usize {
    1
}
