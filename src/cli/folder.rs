//! The folder of a run: its files, and whether they may be replaced.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use anyhow::Error;
use serde_json::Value;
use symbolt::files::{FileError, Overwrite, write_atomic};
use symbolt::report::RunFacts;

use super::args::{BadArgument, RunArgs};
use super::report;

/// The files that a run writes.
pub(crate) const FILES: [&str; 7] = [
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

/// Returns the folder to write, which may not exist yet.
///
/// # Errors
/// If the folder must not be replaced. A folder named with `--out` must hold none of the files. The default `out` must
/// be empty or hold an earlier run. `--force` lifts both conditions.
pub(crate) fn folder(args: &RunArgs) -> Result<PathBuf, Error> {
    let folder = args.out.clone().unwrap_or_else(|| PathBuf::from("out"));
    if folder.exists() && !folder.is_dir() {
        let problem = format!("{} is a file; a run needs a folder to write to", folder.display());
        return Err(BadArgument(problem).into());
    }
    let facts = folder.join(FACTS);
    if facts.symlink_metadata().is_ok_and(|found| !found.is_file()) {
        let problem = format!("{} is not an ordinary file; remove it first", facts.display());
        return Err(BadArgument(problem).into());
    }
    if args.force {
        return possible(folder);
    }
    if args.out.is_some() {
        return match FILES.iter().map(|file| folder.join(file)).find(|path| path.exists()) {
            Some(path) => Err(FileError::Exists { path }.into()),
            None => possible(folder),
        };
    }
    match foreign(&folder)? {
        Some(what) => {
            let advice = "choose another folder with --out, or add --force to write there anyway";
            Err(BadArgument(format!("{what}; {advice}")).into())
        }
        None => possible(folder),
    }
}

/// Tries whether the folder can be made and written to, before any work. Leaves nothing behind.
fn possible(folder: PathBuf) -> Result<PathBuf, Error> {
    let missing: Vec<&Path> = folder.ancestors().take_while(|path| !path.exists()).collect();
    let made = std::fs::create_dir_all(&folder).map_err(FileError::io("make", &folder));
    let made = made.and_then(|()| {
        // The file has no name, so it is gone when it is closed.
        tempfile::tempfile_in(&folder).map(drop).map_err(FileError::io("write to", &folder))
    });
    for path in missing.iter().filter(|path| !path.as_os_str().is_empty()) {
        // A folder that another program has filled meanwhile stays.
        let _ = std::fs::remove_dir(path);
    }
    made?;
    Ok(folder)
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
    let content = std::fs::read(path).unwrap_or_default();
    serde_json::from_slice::<Value>(&content)
        .is_ok_and(|facts| facts["format"] == RunFacts::FORMAT.0 && facts["version"].is_u64())
}

/// Replaces the files of a folder. `contents` are the contents of [`FILES`] without the page, in the same order.
///
/// # Errors
/// [`FileError`] if a file cannot be removed or written.
pub(crate) fn write(folder: &Path, contents: [Vec<u8>; 6]) -> Result<(), FileError> {
    std::fs::create_dir_all(folder).map_err(FileError::io("make", folder))?;
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
    fn a_place_that_cannot_be_written_is_refused_before_the_work() {
        let place = tempfile::tempdir().unwrap();
        std::fs::write(place.path().join("file"), "").unwrap();
        assert!(possible(place.path().join("file/out")).is_err());
        assert!(possible(place.path().join("a/b")).is_ok());
        assert!(!place.path().join("a").exists());
    }

    #[test]
    fn writing_keeps_what_a_run_does_not_write() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["notes.txt", "report.html", "run.json"] {
            std::fs::write(folder.path().join(name), "old").unwrap();
        }
        write(folder.path(), [(); 6].map(|()| b"new".to_vec())).unwrap();
        let text = |name: &str| std::fs::read_to_string(folder.path().join(name)).ok();
        assert_eq!(text("notes.txt").as_deref(), Some("old"));
        assert_eq!(text("run.json").as_deref(), Some("new"));
        assert_eq!(text("report.html"), None, "the page of another run is gone");
    }
}
