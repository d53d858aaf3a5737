//! Layouts: the objects of a scene with their states, and the abstract situations that a plan passes through.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::classifier::Located;
use crate::robot::Pose;
use crate::task::recording::Snapshot;

/// The state of one object: a place of a state, and the reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Fact {
    /// Index of the state.
    pub state: usize,
    /// Index of the place.
    pub place: usize,
    /// Index of the reference among the objects; `None` in the world frame.
    pub reference: Option<usize>,
}

/// The state of every object, by index; `None` for objects in no state, such as fixtures.
pub type Situation = Vec<Option<Fact>>;

/// Returns whether a reference is in the state `within`; `true` if that is `None`.
pub(super) fn is_within(
    within: Option<usize>,
    reference: Option<usize>,
    situation: &Situation,
) -> bool {
    let of = || situation.get(reference?)?.map(|fact| fact.state);
    within.is_none_or(|state| of() == Some(state))
}

/// An object of a layout.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LaidOut {
    /// Id of the object in the snapshot.
    pub id: Arc<str>,
    /// Kind of the object.
    pub kind: Arc<str>,
    /// Pose of the object.
    pub pose: Pose,
}

/// The objects of a scene, and the state of each.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Layout {
    /// The objects, in the order of the snapshot.
    pub objects: Vec<LaidOut>,
    /// State of each object.
    pub located: Vec<Located>,
}

impl Layout {
    pub(super) fn new(scene: &Snapshot, located: Vec<Located>) -> Self {
        let objects = scene.objects.iter();
        let objects =
            objects.map(|o| LaidOut { id: o.id.clone(), kind: o.kind.clone(), pose: o.pose });
        Self { objects: objects.collect(), located }
    }

    /// Returns the state of every object.
    pub fn situation(&self) -> Situation {
        self.located.iter().map(|l| l.fact).collect()
    }

    /// Returns the index of the object with this id.
    pub fn object(&self, id: &str) -> Option<usize> {
        self.objects.iter().position(|o| &*o.id == id)
    }
}
