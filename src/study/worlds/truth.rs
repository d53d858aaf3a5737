//! The truth about a world: states, needs of actions, habits and the goal. It serves scoring; a learner must not see it.

use crate::task::domain::Pose;

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
    /// Whether demonstrations show objects in this state. States that only mistakes reach are not shown.
    pub shown: bool,
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

/// An action of the demonstrator: an object is moved into a state.
#[derive(Debug, Clone, PartialEq)]
pub struct TrueAction {
    /// State that the object enters.
    pub to: &'static str,
    /// Kind of the moved object.
    pub kind: &'static str,
    /// Conditions that the world demands.
    pub needs: Vec<Need>,
    /// States that other objects enter because of the action, although no hand moves them.
    pub side_effects: Vec<&'static str>,
    /// Whether the position is left open: the object is only turned, wherever it lies.
    pub in_place: bool,
}

/// What an exploration found about an action.
///
/// A need that always held may be asserted: either the world demands it, or it follows from what the world demands. A
/// need that did not always hold must not be asserted.
#[derive(Debug, Clone, PartialEq)]
pub struct Explored {
    /// State that the object enters.
    pub to: &'static str,
    /// Needs that were met whenever the action was possible.
    pub always: Vec<Need>,
    /// States from which an object can enter the state.
    pub origins: Vec<&'static str>,
    /// States that some object had always been in before the action was possible, at least when the run began. An order
    /// of actions that is not among these is not needed.
    pub after: Vec<&'static str>,
    /// Number of situations in which the action was possible.
    pub situations: usize,
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

/// What is true about a world.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// All states, shown or not.
    pub states: Vec<TrueState>,
    /// The demonstrator's actions, one for each state that a hand moves objects into.
    pub actions: Vec<TrueAction>,
    /// Habits of the demonstrator: the first state is always completed before an object enters the second, but the
    /// world does not demand it.
    pub habits: Vec<(&'static str, &'static str)>,
    /// Conditions of the goal, all of which must hold, in an order in which they can be completed.
    pub goal: Vec<TrueGoal>,
}

impl Truth {
    /// Returns the state called `name`.
    pub fn state(&self, name: &str) -> Option<&TrueState> {
        self.states.iter().find(|s| s.name == name)
    }

    /// Returns the action that moves an object into the state called `to`.
    pub fn action(&self, to: &str) -> Option<&TrueAction> {
        self.actions.iter().find(|a| a.to == to)
    }
}
