//! The log of an episode: what has happened so far, and the events that report it.

use serde::{Deserialize, Serialize};

use super::world::EpisodeWorld;
use crate::robot::SkillReport;
use crate::robot::scene::SceneFrame;
use crate::task::event::{Decided, Event, Observer, Touched};

/// What has happened so far.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Log {
    #[serde(with = "as_text")]
    pub decisions: Vec<Decided>,
    pub in_no_state: usize,
    pub unexplained: usize,
    pub touches: Vec<Touched>,
    pub frames: Vec<SceneFrame>,
}

impl Log {
    /// A log in which nothing has happened.
    pub const EMPTY: Self = Self {
        decisions: Vec::new(),
        in_no_state: 0,
        unexplained: 0,
        touches: Vec::new(),
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

/// Reports new entries of a world's log as events.
#[derive(Default)]
pub(super) struct LogReporter {
    steps: u64,
    decisions: usize,
    touches: usize,
    frames: usize,
    /// Whether the end of the last decision's skill has not been reported yet.
    acting: bool,
}

impl LogReporter {
    pub fn report(&mut self, world: &EpisodeWorld, observer: &mut dyn Observer) {
        let Some(scene) = world.scene() else { return };
        if scene.steps() == self.steps {
            return;
        }
        self.steps = scene.steps();
        let (log, time_s) = (world.log(), scene.time_s());
        for decision in &log.decisions[self.decisions..] {
            observer.observe(&Event::Decided(decision));
            if decision.begun {
                self.acting = true;
                observer.observe(&Event::SkillBegan { time_s, decision: Some(decision) });
            }
        }
        self.decisions = log.decisions.len();
        for touch in &log.touches[self.touches..] {
            observer.observe(&Event::Touched(*touch));
        }
        self.touches = log.touches.len();
        if self.acting
            && let Some(decision) = log.decisions.last()
            && let Some(report) = &decision.skill
        {
            self.acting = false;
            observer.observe(&Event::SkillEnded { time_s, report, decision: Some(decision) });
        }
        for frame in &log.frames[self.frames..] {
            observer.observe(&Event::Framed(frame));
        }
        self.frames = log.frames.len();
        observer.observe(&Event::Stepped { time_s });
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
