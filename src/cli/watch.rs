//! Progress of demonstrations, learning and episodes: a changing line on a terminal, plain lines elsewhere.

use std::time::{Duration, Instant};

use symbolt::task::event::{Doing, Event, LearningStep, Observer};

use super::output::Progress;

/// The shortest time between two changes of the line.
const PERIOD: Duration = Duration::from_millis(100);

/// An observer that shows the progress on standard error.
pub(crate) struct ProgressLine<'p> {
    progress: &'p Progress,
    /// The running demonstration or episode, such as `episode 2 of 5`.
    name: String,
    /// What was decided last, in words.
    decided: Option<String>,
    /// Whether this was printed.
    told: bool,
    /// The time of the last change on a terminal.
    shown: Instant,
}

impl<'p> ProgressLine<'p> {
    pub fn new(progress: &'p Progress) -> Self {
        Self { progress, name: String::new(), decided: None, told: false, shown: Instant::now() }
    }

    /// Makes a line for the episode of this name.
    pub fn of_episode(progress: &'p Progress, name: String) -> Self {
        Self { name, ..Self::new(progress) }
    }

    /// Changes the line on a terminal, at most once per [`PERIOD`].
    fn show(&mut self, what: impl FnOnce(&Self) -> String) {
        if self.progress.lively() && self.shown.elapsed() >= PERIOD {
            self.progress.show(what(self));
            self.shown = Instant::now();
        }
    }
}

impl Observer for ProgressLine<'_> {
    fn observe(&mut self, event: &Event<'_>) {
        match event {
            Event::Learning(step) => self.progress.say(match step {
                LearningStep::Following { snapshots } => {
                    format!("tracking objects through {snapshots} snapshots")
                }
                LearningStep::Clustering { kind, poses } => {
                    format!("clustering {poses} poses of `{kind}`")
                }
                LearningStep::Deciding => "inferring states and actions".into(),
            }),
            Event::DemonstrationBegan { number, of } => {
                self.name = format!("demonstration {} of {of}", number + 1);
                self.progress.say(&self.name);
            }
            Event::EpisodeBegan { .. } => self.progress.say(&self.name),
            Event::Decided(decided) => (self.decided, self.told) = (decided.done_in_words(), false),
            Event::Ticked { view, doing } => {
                let time_s = view.time().as_millis_f64() / 1e3;
                let acting = matches!(doing, Doing::Acting(_));
                if let Some(decided) = self.decided.as_ref().filter(|_| acting && !self.told) {
                    self.progress.say(format!("{}: {time_s:.2} s: {decided}", self.name));
                    self.told = true;
                }
                self.show(|own| {
                    let what = match doing {
                        Doing::Looking => "looking",
                        Doing::Deciding => "deciding",
                        Doing::Acting(action) => own.decided.as_deref().unwrap_or(action),
                        Doing::Over => "over",
                    };
                    format!("{}, {time_s:.1} simulated s: {what}", own.name)
                });
            }
            Event::Stepped { time_s } => {
                self.show(|own| format!("{}, {time_s:.1} simulated s", own.name));
            }
            Event::Warned(warning) => self.progress.say(format!("warning: {warning}")),
            _ => {}
        }
    }
}
