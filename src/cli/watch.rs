//! What is going on while a run goes on: one line that changes on a terminal, plain lines elsewhere.

use std::time::{Duration, Instant};

use symbolt::sim::SimView;
use symbolt::task::execute::{AssemblyWorld, Doing};

use super::output::Progress;

/// Between two changes of the line.
const EVERY: Duration = Duration::from_millis(100);

/// Follows demonstrations, for [`demonstrate`](symbolt::task::demonstrate).
pub(crate) fn demonstrations(progress: &Progress, count: usize) -> impl FnMut(usize, f64) {
    let (mut said, mut shown) = (None, Instant::now());
    move |demo, time_s| {
        let name = format!("demonstration {} of {count}", demo + 1);
        if said != Some(demo) {
            progress.say(name);
            said = Some(demo);
        } else if progress.lively() && shown.elapsed() >= EVERY {
            progress.show(format!("{name}, {time_s:.1} simulated s"));
            shown = Instant::now();
        }
    }
}

/// Follows one episode.
pub(crate) struct Watch<'p> {
    progress: &'p Progress,
    name: String,
    /// What was said last: deciding, or an action.
    said: Option<String>,
    shown: Instant,
}

impl<'p> Watch<'p> {
    pub fn new(progress: &'p Progress, name: String) -> Self {
        Self { progress, name, said: None, shown: Instant::now() }
    }

    /// A tick of an episode.
    pub fn tick(&mut self, view: &SimView<'_>, world: &AssemblyWorld) {
        let time_s = view.time().as_millis_f64() / 1e3;
        let doing = world.doing();
        if let Doing::Acting(action) = doing
            && self.said.as_deref() != Some(action)
        {
            self.progress.say(format!("{}: {time_s:.2} s: {action}", self.name));
            self.said = Some(action.into());
        }
        if doing == Doing::Looking {
            self.said = None;
        }
        if self.progress.lively() && self.shown.elapsed() >= EVERY {
            let what = match doing {
                Doing::Looking => "looking",
                Doing::Deciding => "deciding",
                Doing::Acting(action) => action,
                Doing::Over => "over",
            };
            self.progress.show(format!("{}, {time_s:.1} simulated s: {what}", self.name));
            self.shown = Instant::now();
        }
    }
}
