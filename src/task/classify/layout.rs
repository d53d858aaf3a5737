//! Layouts: the objects of a scene with their states.

use serde::{Deserialize, Serialize};

use super::tolerance::Offset;
use crate::robot::Pose;
use crate::task::domain::naming::object_names;
use crate::task::domain::{Fact, RelationalDomain, Situation};
use crate::task::recording::ObjectPose;

/// The state of one object of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Located {
    /// The state, place and reference; `None` if the object is in no state.
    pub fact: Option<Fact>,
    /// Distance to that state, or to the nearest state if the object is in none, in standard deviations; for
    /// [`ClassifierRule::Nearest`](super::ClassifierRule::Nearest) in metres. `None` if the kind has no states.
    pub distance: Option<f64>,
    /// Whether a second reference is as likely as the one in `fact`.
    pub ambiguous: bool,
    /// Pose in which the state was found. An object that keeps its state keeps this pose.
    pub taken: Pose,
    /// The nearest place, for an object in no state; `None` if it is in a state, or if its kind has no states.
    pub miss: Option<Miss>,
}

/// The nearest place of an object in no state, and by how much the object misses it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Miss {
    /// State, place and reference.
    pub nearest: Fact,
    /// Distance, height and tilt.
    pub offset: Offset,
}

/// The objects of a scene, and the state of each.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Layout {
    /// The objects, in the order of the snapshot.
    pub objects: Vec<ObjectPose>,
    /// State of each object.
    pub located: Vec<Located>,
}

impl Layout {
    /// Returns the state of every object.
    pub fn situation(&self) -> Situation {
        self.located.iter().map(|l| l.fact).collect()
    }

    /// Returns the names of the objects for people, such as `cup 0`, or `the cup` for the only one of its kind.
    pub fn object_names(&self) -> Vec<String> {
        object_names(self.objects.iter().map(|o| (&*o.id, &*o.kind)))
    }

    /// Returns the statement that an object is in a state, such as `cup 0 is in the drawer`. This names all objects, so
    /// for many of them use [`RelationalDomain::fact_in_words`].
    ///
    /// # Panics
    /// If there is no such object or state.
    pub fn fact_in_words(&self, of: &RelationalDomain, object: usize, fact: &Fact) -> String {
        of.fact_in_words(fact, object, &self.object_names())
    }

    /// Returns the pose of the object with this id.
    #[cfg_attr(not(feature = "physics"), allow(dead_code))] // Episodes and their pages ask.
    pub(crate) fn pose(&self, id: &str) -> Option<&Pose> {
        self.object(id).map(|index| &self.objects[index].pose)
    }

    /// Returns the index of the object with this id.
    pub fn object(&self, id: &str) -> Option<usize> {
        self.objects.iter().position(|o| &*o.id == id)
    }
}
