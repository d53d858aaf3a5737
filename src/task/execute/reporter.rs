//! Reports what happens in an episode as events.

use super::world::EpisodeWorld;
use crate::task::event::{Event, Observer};

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
        // A run that went back has fewer entries. What it repeats is reported again.
        for decision in log.decisions.iter().skip(self.decisions) {
            observer.observe(&Event::Decided(decision));
            if decision.begun {
                self.acting = true;
                observer.observe(&Event::SkillBegan { time_s, decision: Some(decision) });
            }
        }
        self.decisions = log.decisions.len();
        for touch in log.touches.iter().skip(self.touches) {
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
        for frame in log.frames.iter().skip(self.frames) {
            observer.observe(&Event::Framed(frame));
        }
        self.frames = log.frames.len();
        observer.observe(&Event::Stepped { time_s });
    }
}
