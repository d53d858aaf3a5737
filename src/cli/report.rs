//! `symbolt report`: an HTML page about a run or experiments.

use std::path::PathBuf;

use anyhow::Error;
use serde_json::json;
use symbolt::files::{Overwrite, write_atomic};
use symbolt::report::report;

use super::Outcome;
use super::args::ReportArgs;
use super::output::{emit, emit_json, refuse_existing};

/// The name of the page in the folder that it shows.
pub(crate) const NAME: &str = "report.html";

pub(crate) fn make(args: &ReportArgs) -> Result<Outcome, Error> {
    refuse_existing(args.out.out.as_deref(), args.out.force)?;
    let report = report(&args.folder)?;
    // The page in the folder itself can be made again at any time.
    let (path, overwrite): (PathBuf, Overwrite) = match &args.out.out {
        Some(path) => (path.clone(), args.out.overwrite()),
        None => (args.folder.join(NAME), Overwrite::Allowed),
    };
    write_atomic(&path, &report.html, overwrite)?;
    if args.common.json {
        let bytes = report.html.len();
        let file = path.display().to_string();
        emit_json(&[json!({"file": file, "bytes": bytes, "missing": report.missing})])?;
        return Ok(Outcome::Done);
    }
    let mut text = format!("Wrote {} ({:.1} MB)", path.display(), report.html.len() as f64 / 1e6);
    for missing in &report.missing {
        text += &format!("\nMissing: {missing}");
    }
    emit(&text)?;
    Ok(Outcome::Done)
}
