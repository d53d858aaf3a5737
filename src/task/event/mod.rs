//! What happens, told to whoever listens: one [`Event`] for learning, demonstrations, episodes and experiments.
//!
//! Whatever runs for long takes an [`Observer`] and tells it of each event as it happens. A progress line, a trace, a
//! report's arrays and a live view are observers. Observers cannot change what they are told of, so a run gives
//! the same results whoever listens.
//!
//! ```
//! use symbolt::task::event::{Event, Observer};
//!
//! #[derive(Default)]
//! struct Drops(usize);
//! impl Observer for Drops {
//!     fn observe(&mut self, event: &Event<'_>) {
//!         if let Event::SkillEnded { report, .. } = event {
//!             self.0 += usize::from(report.outcome == symbolt::task::event::SkillOutcome::Dropped);
//!         }
//!     }
//! }
//! ```

mod episode;
mod skill;

use crate::sim::SimView;

pub use episode::{Decided, Ended, EpisodeReport, SceneFrame, Touched};
pub use skill::{SkillOutcome, SkillReport, Touch};

/// Something that happened. Times are simulated seconds since the parts had settled.
#[derive(Clone, Copy)]
#[non_exhaustive]
pub enum Event<'a> {
    /// The learner begins a step.
    Learning(LearningStep<'a>),
    /// A demonstration begins.
    DemonstrationBegan {
        /// Its number, from 0.
        number: usize,
        /// How many are asked for.
        of: usize,
    },
    /// A demonstration is over.
    DemonstrationEnded {
        /// Its number, from 0.
        number: usize,
        /// How many are asked for.
        of: usize,
        /// Whether the task's judge takes the task for done.
        solved: bool,
    },
    /// The physics of a demonstration or an episode made one step.
    Stepped {
        /// The time after the step.
        time_s: f64,
    },
    /// The fingers and a part came together, or parted.
    Touched(Touched),
    /// The robot begins to move a part.
    SkillBegan {
        /// The time.
        time_s: f64,
        /// The decision that is carried out; `None` in a demonstration.
        decision: Option<&'a Decided>,
    },
    /// The robot is done with a part.
    ///
    /// In a demonstration it comes without [`Event::SkillBegan`] for a part that cannot be taken or put there. It does not
    /// come for a skill that is under way when an episode is given up.
    SkillEnded {
        /// The time.
        time_s: f64,
        /// How it ended.
        report: &'a SkillReport,
        /// The decision that was carried out, with its [`Decided::skill`]; `None` in a demonstration.
        decision: Option<&'a Decided>,
    },
    /// An episode begins.
    EpisodeBegan {
        /// The state that is wanted.
        goal: &'a str,
    },
    /// The planner graph made one tick.
    Ticked {
        /// The graph after the tick.
        view: &'a SimView<'a>,
        /// What the episode's world is doing.
        doing: Doing<'a>,
    },
    /// The planner graph has answered.
    Decided(&'a Decided),
    /// A frame for pictures was taken.
    Framed(&'a SceneFrame),
    /// An episode is over.
    EpisodeEnded(&'a EpisodeReport),
    /// So many of an experiment's trials are done.
    Trials {
        /// Trials done, those of earlier runs included.
        done: u64,
        /// Trials wanted.
        of: u64,
    },
    /// Something is not as it should be, but the work goes on.
    Warned(&'a str),
}

/// What the learner is about to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LearningStep<'a> {
    /// It follows objects through the snapshots.
    Following {
        /// How many snapshots.
        snapshots: usize,
    },
    /// It clusters the poses of a kind. The time grows with the square of their number.
    Clustering {
        /// The kind.
        kind: &'a str,
        /// How many poses.
        poses: usize,
    },
    /// It decides what is a state, and counts what actions do.
    Deciding,
}

/// What an episode's world is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Doing<'a> {
    /// It waits for a look at the scene.
    Looking,
    /// It asks the planner graph what to do.
    Deciding,
    /// The robot does this action.
    Acting(&'a str),
    /// The episode is over.
    Over,
}

/// Is told of events.
///
/// A closure that takes `&Event` is one. [`Ignore`] ignores all. Several observers are told one after
/// the other by [`Observers`].
pub trait Observer: Send {
    /// Takes note of an event.
    fn observe(&mut self, event: &Event<'_>);
}

impl<F: FnMut(&Event<'_>) + Send> Observer for F {
    fn observe(&mut self, event: &Event<'_>) {
        self(event);
    }
}

/// Ignores everything.
#[derive(Debug, Clone, Copy, Default)]
pub struct Ignore;

impl Observer for Ignore {
    fn observe(&mut self, _event: &Event<'_>) {}
}

/// Tells several observers, in order.
pub struct Observers<'o>(pub Vec<&'o mut dyn Observer>);

impl Observer for Observers<'_> {
    fn observe(&mut self, event: &Event<'_>) {
        for observer in &mut self.0 {
            observer.observe(event);
        }
    }
}
