//! `--stream`: what the planner's modules show, written to disk while the recorded episode goes on.

use std::io::Error;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, bail};
use symbolt::task::event::{Event, Observer};
use symbolt::task::execute::ActivityFiles;
use symbolt::task::planner::Decider;

use crate::cli::end::BadArgument;
use crate::cli::output::warn;

/// Creates the folder, if it is not there. Commands call it before they do any work.
///
/// # Errors
/// If it cannot be created, or is not empty.
pub(super) fn checked(folder: &Path) -> Result<(), anyhow::Error> {
    let shown = folder.display();
    if folder == Path::new("-") || folder.is_file() {
        bail!(BadArgument(format!("--stream {shown}: must be a folder; name a new one")));
    }
    std::fs::create_dir_all(folder).with_context(|| format!("--stream {shown}"))?;
    let mut files = std::fs::read_dir(folder).with_context(|| format!("--stream {shown}"))?;
    if files.next().is_some() {
        bail!(BadArgument(format!("--stream {shown}: has files already; name a new folder")));
    }
    Ok(())
}

/// Writes to the folder, and says at once if it cannot.
pub(super) struct Stream {
    folder: PathBuf,
    files: Option<ActivityFiles>,
    fault: Option<String>,
}

impl Stream {
    pub fn new(folder: &Path, planner: &Arc<dyn Decider>) -> Self {
        let mut own = Self { folder: folder.into(), files: None, fault: None };
        match ActivityFiles::create(folder, planner.clone()) {
            Ok(files) => own.files = Some(files),
            Err(fault) => own.tell("cannot", &fault),
        }
        own
    }

    /// Ends the files at a time, in seconds. Returns what is wrong with them, if they are not whole.
    pub fn end(mut self, time_s: f64) -> Option<String> {
        if let Some(files) = self.files.take()
            && let Err(fault) = files.finish(time_s)
        {
            self.tell("can no longer", &fault);
        }
        self.fault
    }

    fn tell(&mut self, can: &str, fault: &Error) {
        let folder = self.folder.display();
        warn(&format!("--stream {folder}: {can} be written: {fault}"));
        // A run that goes to another branch ends its files too, as its guide says: that is no failure.
        if fault.raw_os_error().is_some() {
            let end = if can == "cannot" { "" } else { " to the end" };
            self.fault = Some(format!("--stream {folder}: was not written{end}: {fault}"));
        }
    }
}

impl Observer for Stream {
    fn observe(&mut self, event: &Event<'_>) {
        let Some(files) = &mut self.files else { return };
        files.observe(event);
        if files.fault().is_none() {
            return;
        }
        if let Some(fault) = self.files.take().as_ref().and_then(ActivityFiles::fault) {
            self.tell("can no longer", fault);
        }
    }
}
