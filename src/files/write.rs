//! Writes whole files atomically, and checks beforehand whether a file can be written.

use std::ffi::OsStr;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Error, ErrorKind, Result as IoResult, Write};
use std::path::{Path, PathBuf, is_separator};

use tempfile::NamedTempFile;

use super::{FileError, Overwrite};

/// Writes a file atomically: writes a temporary file in the same folder and renames it. A reader sees either the old
/// content or all of the new content. A symbolic link is followed: the file that it points to is replaced, or created
/// if it does not exist.
///
/// The temporary file is locked while its process runs. The next write into the folder removes the temporary files of
/// killed processes.
///
/// # Errors
/// [`FileError::Exists`] if the file or link exists and must not be replaced. [`FileError::Io`] if the file cannot be
/// written. After an error, no temporary file is left behind.
pub fn write_atomic(
    path: &Path,
    content: impl AsRef<[u8]>,
    overwrite: Overwrite,
) -> Result<(), FileError> {
    let target = target(path, overwrite)?;
    let failed = |error| FileError::io("write", path)(without_path(error));
    let folder = folder_of(&target);
    remove_stale(folder);
    let mut beside = temporary(folder).map_err(failed)?;
    beside.as_file_mut().write_all(content.as_ref()).map_err(failed)?;
    beside.as_file().sync_all().map_err(failed)?;
    match overwrite {
        Overwrite::Allowed => beside.persist(&target).map_err(|e| failed(e.error))?,
        Overwrite::Never => beside.persist_noclobber(&target).map_err(|e| {
            if e.error.kind() == ErrorKind::AlreadyExists {
                FileError::Exists { path: path.into() }
            } else {
                failed(e.error)
            }
        })?,
    };
    Ok(())
}

/// Checks whether [`write_atomic`] could write a file, without leaving anything behind. A command calls this function
/// before it does any work.
///
/// # Errors
/// As [`write_atomic`]. A disk that is full, or a folder that changes later, is only found by writing.
///
/// ```
/// use symbolt::files::{Overwrite, check_output};
/// use std::path::Path;
///
/// let error = check_output(Path::new("no/such/folder/file"), Overwrite::Never).unwrap_err();
/// assert_eq!(error.to_string(), "cannot write no/such/folder/file");
/// ```
pub fn check_output(path: &Path, overwrite: Overwrite) -> Result<(), FileError> {
    let target = target(path, overwrite)?;
    check_folder(folder_of(&target)).map_err(FileError::io("write", path))
}

/// Checks whether a file can be created in a folder. Leaves nothing behind.
pub(super) fn check_folder(folder: &Path) -> IoResult<()> {
    // The file has no name, so it is gone when it is closed.
    tempfile::tempfile_in(folder).map(drop).map_err(without_path)
}

/// Returns an error without the path of the temporary file, which `tempfile` appends and which means nothing to a user.
fn without_path(error: Error) -> Error {
    match error.to_string().rsplit_once(" at path ") {
        Some((plain, _)) => Error::new(error.kind(), plain),
        None => error,
    }
}

/// Returns the file to write: `path`, or the file that this link points to.
fn target(path: &Path, overwrite: Overwrite) -> Result<PathBuf, FileError> {
    let failed = FileError::io("write", path);
    let refused = |why: &str| Err(failed(Error::other(why)));
    if path.as_os_str().is_empty() {
        return refused("the name is empty");
    }
    let separator = path.as_os_str().as_encoded_bytes().last().map(|b| char::from(*b));
    if separator.is_some_and(is_separator) {
        return refused("the name is that of a folder; expected a file");
    }
    match path.metadata() {
        Ok(found) if found.is_dir() => return refused("it is a folder; expected a file"),
        Ok(found) if !found.is_file() => return refused("it is not a regular file"),
        Err(error) if error.kind() != ErrorKind::NotFound => return Err(failed(error)),
        _ => {}
    }
    if overwrite == Overwrite::Never && path.symlink_metadata().is_ok() {
        return Err(FileError::Exists { path: path.into() });
    }
    followed(path).map_err(failed)
}

/// Greatest number of symbolic links that are followed, as in Linux.
const MOST_LINKS: usize = 40;

/// Follows symbolic links to a file, which need not exist.
fn followed(path: &Path) -> IoResult<PathBuf> {
    let mut path = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        match path.symlink_metadata() {
            Ok(found) if found.is_symlink() => {
                let link = std::fs::read_link(&path)?;
                path = folder_of(&path).join(link);
            }
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
            _ => return Ok(path),
        }
    }
    Err(Error::other("too many symbolic links"))
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// The name of a temporary file is this prefix, [`RANDOM`] random letters and digits, and [`SUFFIX`].
const PREFIX: &str = ".symbolt-";
const RANDOM: usize = 16;
const SUFFIX: &str = ".tmp";

/// Creates a temporary file and locks it, so that [`remove_stale`] does not remove it.
fn temporary(folder: &Path) -> IoResult<NamedTempFile> {
    for _ in 0..16 {
        let made = tempfile::Builder::new()
            .prefix(PREFIX)
            .suffix(SUFFIX)
            .rand_bytes(RANDOM)
            .permissions_like_a_new_file()
            .tempfile_in(folder)?;
        match made.as_file().try_lock() {
            // Another process may have taken the file for a stale one before it was locked.
            Ok(()) if made.path().exists() => return Ok(made),
            Ok(()) | Err(TryLockError::WouldBlock) => {}
            // Without locks no process removes the file of another.
            Err(TryLockError::Error(_)) => return Ok(made),
        }
    }
    Err(Error::other("other processes remove every temporary file"))
}

/// Removes the temporary files in a folder whose processes were killed. The file of a running process is locked.
/// Errors are ignored: the files are only untidy.
pub(super) fn remove_stale(folder: &Path) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let ours = is_temporary(&entry.file_name());
        if !ours || !entry.file_type().is_ok_and(|kind| kind.is_file()) {
            continue;
        }
        let path = entry.path();
        let file: IoResult<File> = OpenOptions::new().write(true).open(&path);
        // The lock is held until the file is gone.
        if file.as_ref().is_ok_and(|file| file.try_lock().is_ok()) {
            let _ = std::fs::remove_file(&path);
        }
    }
}

fn is_temporary(name: &OsStr) -> bool {
    let random = name.to_str().and_then(|n| n.strip_prefix(PREFIX)?.strip_suffix(SUFFIX));
    random.is_some_and(|r| r.len() == RANDOM && r.bytes().all(|b| b.is_ascii_alphanumeric()))
}

/// Sets usual permissions for a temporary file that is renamed into place. Without this, only its owner could read it.
trait PermissionsLikeANewFile {
    fn permissions_like_a_new_file(&mut self) -> &mut Self;
}

impl PermissionsLikeANewFile for tempfile::Builder<'_, '_> {
    #[cfg(unix)]
    fn permissions_like_a_new_file(&mut self) -> &mut Self {
        use std::os::unix::fs::PermissionsExt;
        // The process's umask still applies.
        self.permissions(std::fs::Permissions::from_mode(0o666))
    }

    #[cfg(not(unix))]
    fn permissions_like_a_new_file(&mut self) -> &mut Self {
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = folder.read_dir().expect("a folder").flatten();
        let mut names: Vec<String> =
            entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn temporary_files_of_killed_processes_are_removed_and_no_others() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = |name: &str| folder.path().join(name);
        let (stale, used) = (".symbolt-0123456789abcdeF.tmp", ".symbolt-0123456789abcdeG.tmp");
        let others = [
            ".symbolt-config",
            ".symbolt-0123456789abcde.tmp",
            ".symbolt-0123456789abcd_F.tmp",
            ".symbolt-0123456789abcdeF",
            "symbolt-0123456789abcdeF.tmp",
        ];
        for name in others.iter().chain([&stale, &used]) {
            std::fs::write(path(name), "x").expect("writes");
        }
        let folder_of_that_name = ".symbolt-0123456789abcdeH.tmp";
        std::fs::create_dir(path(folder_of_that_name)).expect("makes");
        let running = OpenOptions::new().write(true).open(path(used)).expect("opens");
        running.lock().expect("locks");
        write_atomic(&path("file"), "new", Overwrite::Never).expect("writes");
        let mut left = others.to_vec();
        left.extend([used, folder_of_that_name, "file"]);
        left.sort_unstable();
        assert_eq!(names(folder.path()), left);
        drop(running);
        write_atomic(&path("file"), "newer", Overwrite::Allowed).expect("writes");
        assert!(!path(used).exists(), "its process is gone");
    }

    #[test]
    fn many_threads_that_write_and_tidy_up_do_not_disturb_each_other() {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |thread: usize| {
            (0..40).all(|round| {
                let path = folder.path().join(format!("{}", (thread + round) % 3));
                write_atomic(&path, thread.to_string(), Overwrite::Allowed).is_ok()
            })
        };
        let all = std::thread::scope(|scope| {
            let threads: Vec<_> = (0..8).map(|thread| scope.spawn(move || write(thread))).collect();
            threads.into_iter().filter_map(|thread| thread.join().ok()).filter(|ok| *ok).count()
        });
        assert_eq!((all, names(folder.path())), (8, vec!["0".into(), "1".into(), "2".into()]));
    }

    #[test]
    #[cfg(unix)]
    fn a_link_is_followed_and_never_replaced_even_if_it_points_nowhere() {
        use std::os::unix::fs::symlink;
        let folder = tempfile::tempdir().expect("a folder");
        let path = |name: &str| folder.path().join(name);
        std::fs::create_dir(path("deep")).expect("makes");
        symlink("deep/other", path("link")).expect("links");
        symlink("../file", path("deep/other")).expect("links");
        let refused = write_atomic(&path("link"), "new", Overwrite::Never);
        assert!(matches!(refused, Err(FileError::Exists { .. })), "{refused:?}");
        for content in ["one", "two"] {
            write_atomic(&path("link"), content, Overwrite::Allowed).expect("writes");
            assert_eq!(std::fs::read_to_string(path("file")).expect("a file"), content);
        }
        assert_eq!(path("link").read_link().expect("a link"), Path::new("deep/other"));
        symlink("no/such/folder/file", path("nowhere")).expect("links");
        symlink("circle", path("circle")).expect("links");
        for name in ["nowhere", "circle"] {
            let check = check_output(&path(name), Overwrite::Allowed);
            assert!(matches!(check, Err(FileError::Io { what: "write", .. })), "{check:?}");
            assert!(write_atomic(&path(name), "new", Overwrite::Allowed).is_err());
            assert!(path(name).symlink_metadata().expect("there").is_symlink());
        }
        assert_eq!(names(folder.path()), ["circle", "deep", "file", "link", "nowhere"]);
    }

    #[test]
    #[cfg(unix)]
    fn a_place_that_cannot_be_written_is_found_by_the_check_and_by_the_write() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("file"), "old").expect("writes");
        let long = "x".repeat(300);
        let cases = [
            ("", "the name is empty"),
            ("new/", "the name is that of a folder"),
            ("..", "it is a folder"),
            (".", "it is a folder"),
            ("no/file", "No such file"),
            ("file/file", "Not a directory"),
            (&long, "too long"),
            ("/dev/full", "it is not a regular file"),
            ("/proc/file", ""),
        ];
        for (name, why) in cases {
            let path = if name.is_empty() { PathBuf::new() } else { folder.path().join(name) };
            let check = check_output(&path, Overwrite::Never).expect_err(name);
            let write = write_atomic(&path, "new", Overwrite::Never).expect_err(name);
            for error in [check, write] {
                let FileError::Io { what: "write", source, .. } = error else { panic!("{error}") };
                let said = source.to_string();
                assert!(said.contains(why) && !said.contains("at path"), "{name}: {said}");
            }
        }
        check_output(&folder.path().join("new"), Overwrite::Never).expect("it can be written");
        assert_eq!(names(folder.path()), ["file"]);
    }
}
