//! The truth about a world: states, needs of actions and the goal. It serves scoring; a learner must not see it.

use crate::robot::Pose;

/// How an object's orientation in a state is fixed, relative to the state's frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Turn {
    /// Any orientation.
    Free,
    /// The object's z axis has the direction of the place's z axis. The angle about this axis is free.
    Axis,
    /// The orientation of the place.
    Full,
}

/// How far from a place an object may rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Extent {
    /// One point. Each place holds one object.
    Spot {
        /// Largest accepted distance of a target from the place, in metres. Up to [`TIGHT_M`] the object snaps into the
        /// place, otherwise it stays where it was put.
        tolerance_m: f64,
        /// Standard deviation of the demonstrator's targets in the horizontal plane, per coordinate, in metres.
        spread_m: f64,
    },
    /// A box around the place. It holds any number of objects.
    Area {
        /// Half of the box's length and width along the axes of the place, in metres.
        half_m: [f64; 2],
        /// Range of resting heights above the place, in metres. 0 for a flat surface.
        depth_m: f64,
    },
}

/// Largest tolerance of a place into which objects snap, in metres.
pub const TIGHT_M: f64 = 5e-3;

/// A state that objects of one kind can be in.
#[derive(Debug, Clone, PartialEq)]
pub struct TrueState {
    /// Name, such as `NUT_IN_POCKET`.
    pub name: &'static str,
    /// Kind of the objects.
    pub kind: &'static str,
    /// Kind of the reference object in whose frame the places are; `None` for the world frame.
    pub frame: Option<&'static str>,
    /// Places in the frame, at least one.
    pub places: Vec<Pose>,
    /// How far from a place an object may rest.
    pub extent: Extent,
    /// How the orientation is fixed.
    pub turn: Turn,
    /// Largest accepted deviation from the orientation that `turn` fixes, in degrees.
    pub tolerance_deg: f64,
}

impl TrueState {
    /// Returns whether the state has points as places, not areas.
    pub fn is_spot(&self) -> bool {
        matches!(self.extent, Extent::Spot { .. })
    }
}

/// A condition that the world demands before an object can enter a state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
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
            | Self::Clear(state) => state,
        }
    }
}

/// One condition of a goal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TrueGoal {
    /// The state.
    pub state: &'static str,
    /// Kind over whose objects the condition ranges. The frame's kind: each reference object has `at_least` objects in
    /// the state. The state's own kind: every object of the kind is in the state. `None`: the whole world is counted.
    pub each: Option<&'static str>,
    /// The least number of objects in the state.
    pub at_least: usize,
}
