//! The folder of a run: its files, and whether they may be replaced.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use anyhow::{Error, bail};
use serde_json::Value;
use symbolt::files::{FileError, Limit, Overwrite, ResultFolder, read_regular_file, write_atomic};
use symbolt::report::RunFacts;

use super::args::RunArgs;
use crate::cli::end::BadArgument;
use crate::cli::output::{not_standard_output, warn_of};
use crate::cli::report;

/// The files that a run writes.
pub(super) const FILES: [&str; 7] = [
    "recording.jsonl",
    "domain.json",
    "scene.json",
    "trace.jsonl",
    "arrays.npz",
    FACTS,
    report::NAME,
];

/// The file by which a folder is recognised as a run's.
const FACTS: &str = "run.json";

/// The folder that a run writes if `--out` names no other.
const DEFAULT: &str = "out";

/// Opens the folder to write. If the default folder has to be created, git ignores it.
///
/// # Errors
/// If the folder must not be replaced. A folder named with `--out` must hold none of the files. The default `out` must
/// be empty or hold an earlier run. `--force` lifts both conditions. If another run is writing to the folder, or if it
/// cannot be written.
pub(super) fn open(args: &RunArgs) -> Result<ResultFolder, Error> {
    let folder = args.out.as_deref().unwrap_or(Path::new(DEFAULT));
    not_standard_output(folder)?;
    let root = args.out.is_none().then_some(folder);
    let folder = ResultFolder::open_if(folder, root, |folder| may_write(args, folder))?;
    warn_of(&folder);
    Ok(folder)
}

/// Checks that a run may write to the folder.
fn may_write(args: &RunArgs, folder: &Path) -> Result<(), Error> {
    // What is there and no folder is refused when it is opened.
    if !folder.is_dir() {
        return Ok(());
    }
    let facts = folder.join(FACTS);
    if facts.symlink_metadata().is_ok_and(|found| !found.is_file()) {
        bail!(BadArgument(format!("{} is not an ordinary file; remove it first", facts.display())));
    }
    if args.force {
        return Ok(());
    }
    if args.out.is_some() {
        return match FILES.iter().map(|file| folder.join(file)).find(|path| path.exists()) {
            Some(path) => Err(FileError::Exists { path }.into()),
            None => Ok(()),
        };
    }
    if let Some(what) = foreign(folder)? {
        let advice = "choose another folder with --out, or add --force to write there anyway";
        bail!(BadArgument(format!("{what}; {advice}")));
    }
    Ok(())
}

/// Returns a sentence on why a folder cannot have been written by a run; `None` if it can.
fn foreign(folder: &Path) -> Result<Option<String>, FileError> {
    let failed = FileError::io("read", folder);
    let entries = match std::fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(failed(error)),
    };
    let mut empty = true;
    for entry in entries {
        // Hidden files, such as those that keep a folder in a repository, are ignored.
        empty &= entry.map_err(&failed)?.file_name().to_string_lossy().starts_with('.');
    }
    if empty {
        return Ok(None);
    }
    let path = folder.join(FACTS);
    Ok(match path.exists() {
        false => Some(format!("the folder {} holds files but no {FACTS}", folder.display())),
        true if is_facts(&path) => None,
        true => Some(format!("{} was not written by `symbolt run`", path.display())),
    })
}

fn is_facts(path: &Path) -> bool {
    let content = read_regular_file(path, Limit::FACTS).unwrap_or_default();
    serde_json::from_slice::<Value>(&content)
        .is_ok_and(|facts| facts["format"] == RunFacts::FORMAT.0 && facts["version"].is_u64())
}

/// Replaces the files of a folder. `contents` are the contents of [`FILES`] without the page, in the same order.
///
/// # Errors
/// [`FileError`] if a file cannot be removed or written.
pub(super) fn write(folder: &ResultFolder, contents: [Vec<u8>; 6]) -> Result<(), FileError> {
    let folder = folder.path();
    // First the file that marks the folder as a run's. A full disk then leaves the earlier run, and a kill at any moment
    // a folder that is still recognised.
    let mut files: Vec<(&str, Vec<u8>)> = FILES.into_iter().zip(contents).collect();
    files.sort_by_key(|(file, _)| *file != FACTS);
    for (file, content) in files.drain(..1) {
        write_atomic(&folder.join(file), content, Overwrite::Allowed)?;
    }
    let plain = |path: &PathBuf| path.symlink_metadata().is_ok_and(|m| m.is_file());
    let others = FILES.iter().filter(|file| **file != FACTS).map(|file| folder.join(file));
    for path in others.filter(plain) {
        std::fs::remove_file(&path).map_err(FileError::io("remove", &path))?;
    }
    for (file, content) in files {
        write_atomic(&folder.join(file), content, Overwrite::Allowed)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_foreign(files: &[(&str, &str)]) -> bool {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in files {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        foreign(folder.path()).unwrap().is_some()
    }

    #[test]
    fn a_folder_is_replaced_only_if_it_is_empty_or_a_run_s() {
        let ours = r#"{"format": "symbolt-run", "version": 1, "seed": 3}"#;
        assert!(!is_foreign(&[]));
        assert!(!is_foreign(&[(".gitkeep", "")]));
        assert!(!is_foreign(&[("run.json", ours)]), "a killed run wrote nothing else yet");
        assert!(!is_foreign(&[("run.json", ours), ("notes.txt", "mine")]));
        assert!(is_foreign(&[("notes.txt", "mine")]));
        assert!(is_foreign(&[("domain.json", r#"{"format": "symbolt-domain", "version": 2}"#)]));
        assert!(is_foreign(&[("run.json", "")]));
        assert!(is_foreign(&[("run.json", r#"{"format": "symbolt-run"}"#)]));
        assert!(is_foreign(&[("run.json", r#"{"format": "other", "version": 1}"#)]));
        assert!(foreign(Path::new("no/such/folder")).unwrap().is_none());
    }

    #[test]
    fn writing_keeps_what_a_run_does_not_write() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["notes.txt", "report.html", "run.json"] {
            std::fs::write(folder.path().join(name), "old").unwrap();
        }
        let opened = ResultFolder::open(folder.path()).unwrap();
        write(&opened, [(); 6].map(|()| b"new".to_vec())).unwrap();
        let text = |name: &str| std::fs::read_to_string(folder.path().join(name)).ok();
        assert_eq!(text("notes.txt").as_deref(), Some("old"));
        assert_eq!(text("run.json").as_deref(), Some("new"));
        assert_eq!(text("report.html"), None, "the page of another run is gone");
    }
}
