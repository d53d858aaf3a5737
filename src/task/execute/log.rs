//! The log of an episode: what has happened so far.

use serde::{Deserialize, Serialize};

use crate::robot::SkillReport;
use crate::robot::scene::SceneFrame;
use crate::task::event::{Decided, Displaced, Touched};

/// What has happened so far.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Log {
    #[serde(with = "as_text")]
    pub decisions: Vec<Decided>,
    pub in_no_state: usize,
    pub unexplained: usize,
    pub touches: Vec<Touched>,
    pub displaced: Vec<Displaced>,
    pub frames: Vec<SceneFrame>,
}

impl Log {
    /// A log in which nothing has happened.
    pub const EMPTY: Self = Self {
        decisions: Vec::new(),
        in_no_state: 0,
        unexplained: 0,
        touches: Vec::new(),
        displaced: Vec::new(),
        frames: Vec::new(),
    };

    /// Returns every finished skill, in order.
    fn skills(&self) -> impl Iterator<Item = &SkillReport> {
        self.decisions.iter().filter_map(|d| d.skill.as_ref())
    }

    /// Returns the number of finished skills.
    pub fn skill_count(&self) -> usize {
        self.skills().count()
    }
}

/// Saves decisions as JSON. Their optional fields are left out of the text, which a binary format cannot do.
mod as_text {
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serializer, ser};

    use crate::task::event::Decided;

    pub fn serialize<S: Serializer>(all: &[Decided], to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(&serde_json::to_string(all).map_err(ser::Error::custom)?)
    }

    pub fn deserialize<'d, D: Deserializer<'d>>(from: D) -> Result<Vec<Decided>, D::Error> {
        serde_json::from_str(&String::deserialize(from)?).map_err(D::Error::custom)
    }
}
