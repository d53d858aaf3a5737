//! `symbolt report`: an HTML page about a run or experiments.

use std::path::{Path, PathBuf};

use anyhow::{Error, bail};
use clap::Args;
use serde_json::json;
use symbolt::files::{FileError, Overwrite, ResultFolder, check_output, read_beginning};
use symbolt::report::{TITLE, report};

use super::end::{BadArgument, Outcome};
use super::kind::{Kind, beginning};
use super::options::{Common, OutFile};
use super::output::{Place, answer, warn, warn_of};

#[derive(Debug, Clone, Args)]
pub(crate) struct ReportArgs {
    /// Folder of a run, of an experiment, or of several experiments' folders
    pub folder: PathBuf,
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    pub out: OutFile,
}

/// The name of the page in the folder that it shows.
pub(crate) const NAME: &str = "report.html";

pub(crate) fn make(args: &ReportArgs) -> Result<Outcome, Error> {
    if let Some(start) = beginning(&args.folder) {
        let (file, kind) = (args.folder.display(), Kind::of(&start).kind.name());
        let expected = "expected the folder of a run, of an experiment or of several experiments";
        bail!(BadArgument(format!("{file} is {kind}; {expected}")));
    }
    let (out, _held) = place(args)?;
    let report = report(&args.folder)?;
    out.write(&report.html)?;
    let Place::File(path, _) = &out else {
        // Standard output holds the page and nothing else.
        report.missing.iter().for_each(|missing| warn(&format!("missing: {missing}")));
        return Ok(Outcome::Done);
    };
    let bytes = report.html.len();
    let json = || {
        let file = path.display().to_string();
        json!({"file": file, "bytes": bytes, "missing": report.missing})
    };
    answer(&args.common, json, || {
        let mut text = format!("Wrote {} ({:.1} MB)", path.display(), bytes as f64 / 1e6);
        for missing in &report.missing {
            text += &format!("\nMissing: {missing}");
        }
        text
    })
}

/// Returns the place for the page. If that is the folder which the page shows, the folder is locked.
fn place(args: &ReportArgs) -> Result<(Place, Option<ResultFolder>), Error> {
    // Without `--out` the page lies in the folder that it shows, and `--force` replaces it there.
    let named = Place::checked(args.out.out.as_deref(), args.out.force)?;
    if !matches!(named, Place::Default) {
        return Ok((named, None));
    }
    // A folder that does not exist is not created.
    std::fs::read_dir(&args.folder).map_err(FileError::io("read", &args.folder))?;
    let page = args.folder.join(NAME);
    // Our own page can be made again at any time.
    if !args.out.force && page.symlink_metadata().is_ok() && !is_ours(&page) {
        let problem = format!(
            "{} was not written by symbolt; choose another file with --out, or add --force to replace it",
            page.display()
        );
        bail!(BadArgument(problem));
    }
    check_output(&page, Overwrite::Allowed)?;
    let held = ResultFolder::open(&args.folder)?;
    warn_of(&held);
    Ok((Place::File(page, Overwrite::Allowed), Some(held)))
}

/// Whether the page was written by this program, which is seen in its head.
fn is_ours(page: &Path) -> bool {
    let head = read_beginning(page, 1024).unwrap_or_default();
    String::from_utf8_lossy(&head).contains(TITLE)
}
