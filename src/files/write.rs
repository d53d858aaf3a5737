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
    let refused = |why: &str| Err(failed(Error::new(ErrorKind::InvalidInput, why)));
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
