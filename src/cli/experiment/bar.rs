//! The progress of trials.

use std::io::Write;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use symbolt::task::event::{Event, Observer};

use crate::cli::options::Seedless;
use crate::cli::output::warn;

/// Shows progress and the remaining time: a bar on a terminal, a line every 10 seconds elsewhere.
pub(crate) struct Bar {
    /// It is hidden elsewhere than on a terminal, and with `--quiet`.
    bar: ProgressBar,
    lines: Option<Lines>,
    total: u64,
}

/// State of the progress lines.
struct Lines {
    /// Time at which timing began, and number of trials that were already done.
    begun: Option<(Instant, u64)>,
    /// Time at which the last line was printed.
    last: Instant,
}

/// Time between two progress lines.
const EVERY: Duration = Duration::from_secs(10);

impl Bar {
    pub fn new(common: &Seedless, total: u64) -> Self {
        let bar = if common.quiet { ProgressBar::hidden() } else { ProgressBar::new(total) };
        let template = "{wide_bar} {pos} of {len} trials, {eta} left";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        let lines = !common.quiet && bar.is_hidden();
        let lines = lines.then(|| Lines { begun: None, last: Instant::now() });
        Self { bar, lines, total }
    }

    fn at(&mut self, done: u64) {
        if self.bar.position() == 0 {
            // Trials of an earlier run must not count towards the speed of this run.
            self.bar.set_position(done);
            self.bar.reset_eta();
        }
        self.bar.set_position(done);
        let Some(lines) = &mut self.lines else { return };
        let (begun, before) = *lines.begun.get_or_insert_with(|| (Instant::now(), done));
        if lines.last.elapsed() >= EVERY {
            let spent = begun.elapsed().as_secs_f64();
            let left =
                spent * (self.total - done) as f64 / done.saturating_sub(before).max(1) as f64;
            let _ = writeln!(
                std::io::stderr(),
                "{done} of {} trials done, about {left:.0} s left",
                self.total
            );
            lines.last = Instant::now();
        }
    }
}

impl Observer for Bar {
    fn observe(&mut self, event: &Event<'_>) {
        match event {
            Event::Trials { done, .. } => self.at(*done),
            Event::Warned(warning) => self.bar.suspend(|| warn(warning)),
            _ => {}
        }
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
