//! Progress events of learning, demonstrations, episodes and experiments, and observers that receive them.
//!
//! Long-running functions, such as [`learn_observed`](super::learn::learn_observed), take an [`Observer`] and call it
//! with each [`Event`] as it happens. Progress lines, traces and live views are observers. An observer cannot change
//! the run, so the results are the same with or without it.
//!
//! To count dropped parts:
//!
//! ```
//! use symbolt::robot::SkillOutcome;
//! use symbolt::task::event::{Event, Observer};
//!
//! #[derive(Default)]
//! struct Drops(usize);
//! impl Observer for Drops {
//!     fn observe(&mut self, event: &Event<'_>) {
//!         if let Event::SkillEnded { report, .. } = event {
//!             self.0 += usize::from(report.outcome == SkillOutcome::Dropped);
//!         }
//!     }
//! }
//! ```

mod episode;
mod recovery;

use crate::robot::SkillReport;
#[cfg(feature = "physics")]
use crate::robot::scene::SceneFrame;
use crate::sim::SimView;

pub use episode::{
    Chosen, Decided, Displaced, Ended, EpisodeReport, InNoState, Landed, Touched, Undecided,
};
pub use recovery::{Recovery, RecoveryKind};

/// An event. Times are in simulated seconds, counted from the moment at which the parts have settled on the table.
#[derive(Clone, Copy)]
#[non_exhaustive]
pub enum Event<'a> {
    /// Learning begins a step.
    Learning(LearningStep<'a>),
    /// A demonstration begins.
    DemonstrationBegan {
        /// Number of the demonstration, from 0.
        number: usize,
        /// Number of demonstrations requested.
        of: usize,
    },
    /// A demonstration has ended.
    DemonstrationEnded {
        /// Number of the demonstration, from 0.
        number: usize,
        /// Number of demonstrations requested.
        of: usize,
        /// Whether the task's judge finds the task solved.
        solved: bool,
    },
    /// The physics of a demonstration or an episode made one step.
    Stepped {
        /// Time after the step.
        time_s: f64,
    },
    /// The fingers made contact with a part or released it.
    Touched(Touched),
    /// The robot begins a skill.
    SkillBegan {
        /// Time of the event.
        time_s: f64,
        /// The decision that the skill executes; `None` in a demonstration.
        decision: Option<&'a Decided>,
    },
    /// A skill has ended.
    ///
    /// In a demonstration, a skill that cannot begin ([`Unreachable`](crate::robot::SkillOutcome::Unreachable)) sends this event without a
    /// [`Event::SkillBegan`]. A skill that is still running when its episode reaches a limit does not send this event.
    SkillEnded {
        /// Time of the event.
        time_s: f64,
        /// The skill's report.
        report: &'a SkillReport,
        /// The decision that the skill executed, with [`Decided::skill`] set; `None` in a demonstration.
        decision: Option<&'a Decided>,
    },
    /// An episode begins.
    EpisodeBegan {
        /// Name of the goal state.
        goal: &'a str,
    },
    /// The planner graph made one tick.
    Ticked {
        /// The graph after the tick.
        view: &'a SimView<'a>,
        /// Current phase of the episode.
        doing: Doing<'a>,
    },
    /// The planner graph has reached a decision.
    Decided(&'a Decided),
    /// A picture frame was taken.
    #[cfg(feature = "physics")]
    Framed(&'a SceneFrame),
    /// An episode has ended.
    EpisodeEnded(&'a EpisodeReport),
    /// An experiment has finished some of its trials.
    Trials {
        /// Number of finished trials, including those of earlier runs.
        done: u64,
        /// Number of trials requested.
        of: u64,
    },
    /// A warning. The run continues.
    Warned(&'a str),
}

/// The learning step that begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LearningStep<'a> {
    /// Tracking objects from snapshot to snapshot.
    Following {
        /// Number of snapshots.
        snapshots: usize,
    },
    /// Clustering the poses of one kind. The time grows with the square of the number of poses.
    Clustering {
        /// Name of the kind.
        kind: &'a str,
        /// Number of poses.
        poses: usize,
    },
    /// Deciding which clusters are states, and counting preconditions and effects.
    Deciding,
}

/// Phase of an episode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Doing<'a> {
    /// Waiting before the next look at the scene.
    Looking,
    /// Waiting for the planner graph's decision.
    Deciding,
    /// The robot executes the action or the kind of recovery with this name.
    Acting(&'a str),
    /// The episode has ended.
    Over,
}

/// Receives events.
///
/// A closure that takes `&Event` is an observer. [`Ignore`] discards all events; [`Observers`] passes each event to
/// several observers.
pub trait Observer: Send {
    /// Receives one event.
    fn observe(&mut self, event: &Event<'_>);
}

impl<F: FnMut(&Event<'_>) + Send> Observer for F {
    fn observe(&mut self, event: &Event<'_>) {
        self(event);
    }
}

/// An observer that discards all events.
#[derive(Debug, Clone, Copy, Default)]
pub struct Ignore;

impl Observer for Ignore {
    fn observe(&mut self, _event: &Event<'_>) {}
}

/// An observer that passes each event to several observers, in order.
pub struct Observers<'o>(pub Vec<&'o mut dyn Observer>);

impl Observer for Observers<'_> {
    fn observe(&mut self, event: &Event<'_>) {
        for observer in &mut self.0 {
            observer.observe(event);
        }
    }
}
