//! Layouts: the objects of a scene with their states.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::classifier::Located;
use crate::robot::Pose;
use crate::task::domain::Situation;
use crate::task::recording::Snapshot;

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
