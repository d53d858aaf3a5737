//! The folder for the results of one run at a time.

use std::fmt::{Display, Formatter};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Error, ErrorKind, Result as IoResult};
use std::path::{Path, PathBuf};

use super::FileError;
use super::write::{check_folder, remove_stale};

/// A condition that the user should know about but that does not stop the run.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Warning {
    /// The file system has no locks, so nothing keeps a second run out of the folder.
    Unlocked {
        /// Folder that could not be locked.
        folder: PathBuf,
        /// Message of the operating system.
        reason: String,
    },
}

impl Display for Warning {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Unlocked { folder, reason } => write!(
                f,
                "cannot lock {} ({reason}); make sure that no other run writes to this folder",
                folder.display()
            ),
        }
    }
}

/// The function that tries to lock a file: [`File::try_lock`], except in tests.
pub(crate) type TryLock = fn(&File) -> Result<(), TryLockError>;

/// Name of the file that is locked.
const LOCK: &str = ".symbolt-lock";
/// Name of the file that hides a folder from git, and its content.
const IGNORE: (&str, &str) =
    (".gitignore", "# Written by symbolt: everything here can be computed again.\n*\n");

/// A folder for results, locked for one run.
///
/// While this value lives, no other process can open the folder. The lock is an advisory lock on the file
/// `.symbolt-lock` and vanishes with its process, however the process ends. Opening the folder removes the temporary
/// files of killed processes.
///
/// Dropping the value releases the lock. A folder that was created for it and is still empty is removed.
///
/// ```
/// use symbolt::files::{FileError, Overwrite, ResultFolder, write_atomic};
///
/// let place = tempfile::tempdir()?;
/// let folder = ResultFolder::open(&place.path().join("results"))?;
/// write_atomic(&folder.path().join("table.csv"), "1,2\n", Overwrite::Never)?;
/// let second = ResultFolder::open(folder.path());
/// assert!(matches!(second, Err(FileError::Busy { .. })));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct ResultFolder {
    path: PathBuf,
    /// The locked file; `None` before it is locked.
    lock: Option<File>,
    /// Folders that were created, the innermost first.
    made: Vec<PathBuf>,
    /// The `.gitignore` that was created.
    ignore: Option<PathBuf>,
    warning: Option<Warning>,
}

impl ResultFolder {
    /// Opens a folder. Creates it and its parents if necessary.
    ///
    /// # Errors
    /// [`FileError::Busy`] if another run is writing to the folder; [`FileError::Io`] if the folder cannot be created,
    /// locked or written.
    pub fn open(path: &Path) -> Result<Self, FileError> {
        Self::open_if(path, None, |_| Ok(()))
    }

    /// As [`open`](Self::open), for a folder in `root`, which may be the folder itself. If `root` has to be created, it
    /// gets a `.gitignore` that hides all of it. `may` decides whether the folder may be written. It is asked before
    /// anything is created, and again once the folder is locked.
    ///
    /// # Errors
    /// As [`open`](Self::open), and the errors of `may`.
    pub fn open_if<E: From<FileError>>(
        path: &Path,
        root: Option<&Path>,
        may: impl Fn(&Path) -> Result<(), E>,
    ) -> Result<Self, E> {
        may(path)?;
        let folder = Self::lock(path, root, File::try_lock)?;
        may(path)?;
        Ok(folder)
    }

    /// Opens a folder with this lock function.
    pub(crate) fn lock(
        path: &Path,
        root: Option<&Path>,
        try_lock: TryLock,
    ) -> Result<Self, FileError> {
        if path.metadata().is_ok_and(|found| !found.is_dir()) {
            let source = Error::new(ErrorKind::InvalidInput, "it is a file; expected a folder");
            return Err(FileError::Io { what: "write to", path: path.into(), source });
        }
        // The folder or its lock disappears meanwhile if a run ends that created the folder and wrote nothing.
        for attempt in 1..=ATTEMPTS {
            let mut folder = Self {
                path: path.into(),
                lock: None,
                made: Vec::new(),
                ignore: None,
                warning: None,
            };
            match folder.make().and_then(|()| folder.take(try_lock)) {
                Ok(true) => {}
                Ok(false) => continue,
                Err(error) if attempt < ATTEMPTS && is_not_found(&error) => continue,
                Err(error) => return Err(error),
            }
            if let Some(root) = root.filter(|root| folder.made.iter().any(|made| made == root)) {
                let file = root.join(IGNORE.0);
                std::fs::write(&file, IGNORE.1).map_err(FileError::io("write", &file))?;
                folder.ignore = Some(file);
            }
            check_folder(path).map_err(FileError::io("write to", path))?;
            remove_stale(path);
            return Ok(folder);
        }
        Err(FileError::Busy { folder: path.into() })
    }

    /// Returns the folder's path, as it was given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns a warning if the folder could not be locked because its file system has no locks.
    pub fn warning(&self) -> Option<&Warning> {
        self.warning.as_ref()
    }

    /// Creates the folder and its parents.
    fn make(&mut self) -> Result<(), FileError> {
        let failed = FileError::io("make", &self.path);
        let missing = |path: &&Path| !path.as_os_str().is_empty() && !path.exists();
        let mut missing: Vec<PathBuf> =
            self.path.ancestors().take_while(missing).map(Path::to_path_buf).collect();
        while let Some(path) = missing.pop() {
            match std::fs::create_dir(&path) {
                Ok(()) => self.made.insert(0, path),
                // Another process has just created it.
                Err(_) if path.is_dir() => {}
                Err(error) => return Err(failed(error)),
            }
        }
        Ok(())
    }

    /// Locks the folder. Returns false if the lock file was removed meanwhile.
    fn take(&mut self, try_lock: TryLock) -> Result<bool, FileError> {
        let path = self.path.join(LOCK);
        let failed = FileError::io("write to", &self.path);
        if path.symlink_metadata().is_ok_and(|found| !found.is_file()) {
            return Err(failed(Error::other(format!("{LOCK} is not a regular file"))));
        }
        let mut options = OpenOptions::new();
        let file = options.write(true).create(true).truncate(false).open(&path).map_err(failed)?;
        match try_lock(&file) {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                return Err(FileError::Busy { folder: self.path.clone() });
            }
            Err(TryLockError::Error(error)) if unsupported(&error) => {
                let (folder, reason) = (self.path.clone(), error.to_string());
                self.warning = Some(Warning::Unlocked { folder, reason });
            }
            Err(TryLockError::Error(source)) => {
                return Err(FileError::Io { what: "write", path, source });
            }
        }
        if !is_at(&file, &path) {
            return Ok(false);
        }
        self.lock = Some(file);
        Ok(true)
    }

    /// Removes the lock file if it is still the locked one, and empty as we made it.
    fn release(&self, lock: &File) {
        let path = self.path.join(LOCK);
        if cfg!(unix) && is_at(lock, &path) && lock.metadata().is_ok_and(|found| found.len() == 0) {
            let _ = std::fs::remove_file(path);
        }
    }

    /// Removes the folders that were created, from the inside, as long as they hold nothing.
    fn remove_empty(&self) {
        for folder in &self.made {
            let hidden = self.ignore.as_deref().filter(|ignore| ignore.parent() == Some(folder));
            let empty = std::fs::read_dir(folder).is_ok_and(|entries| {
                entries.flatten().all(|entry| hidden == Some(entry.path().as_path()))
            });
            if let Some(ignore) = hidden.filter(|_| empty) {
                let _ = std::fs::remove_file(ignore);
            }
            // Fails if the folder is not empty.
            if !empty || std::fs::remove_dir(folder).is_err() {
                return;
            }
        }
    }
}

impl Drop for ResultFolder {
    fn drop(&mut self) {
        // The lock is held until its file is gone, so no other run can hold the same file.
        let lock = self.lock.take();
        if let Some(lock) = &lock {
            self.release(lock);
        }
        // After a failure before the lock was taken, an empty folder of ours may already be another run's.
        self.remove_empty();
    }
}

/// Number of attempts to lock a folder that other runs create and remove.
const ATTEMPTS: usize = 100;

fn is_not_found(error: &FileError) -> bool {
    matches!(error, FileError::Io { source, .. } if source.kind() == ErrorKind::NotFound)
}

/// Whether the open file is the file at this path.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let of = |found: IoResult<std::fs::Metadata>| found.map(|m| (m.dev(), m.ino())).ok();
    let own = of(file.metadata());
    own.is_some() && own == of(path.symlink_metadata())
}

/// Whether the open file is the file at this path. Here no lock file is ever removed.
#[cfg(not(unix))]
fn is_at(_file: &File, _path: &Path) -> bool {
    true
}

/// ENOLCK, which a network file system returns if no lock server answers. The standard library has no error kind for
/// ENOLCK.
const ENOLCK: Option<i32> = if cfg!(any(target_os = "linux", target_os = "android")) {
    Some(37)
} else if cfg!(unix) {
    // macOS and the BSDs.
    Some(77)
} else {
    None
};

/// ENOTSUP on systems where the standard library does not map it to [`ErrorKind::Unsupported`].
const ENOTSUP: Option<i32> = if cfg!(target_os = "macos") { Some(45) } else { None };

/// Whether locking failed because the file system has no locks. Such file systems return ENOSYS, EOPNOTSUPP, EINVAL or
/// ENOLCK.
fn unsupported(error: &Error) -> bool {
    matches!(error.kind(), ErrorKind::Unsupported | ErrorKind::InvalidInput)
        || error.raw_os_error().is_some_and(|code| [ENOLCK, ENOTSUP].contains(&Some(code)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place() -> tempfile::TempDir {
        tempfile::tempdir().expect("a folder")
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn errors_of_file_systems_without_locks_are_told_from_other_errors() {
        // ENOSYS, EOPNOTSUPP, EINVAL, ENOLCK; and EIO, EBADF, ENOSPC.
        assert!([38, 95, 22, 37].iter().all(|code| unsupported(&Error::from_raw_os_error(*code))));
        assert!(![5, 9, 28].iter().any(|code| unsupported(&Error::from_raw_os_error(*code))));
    }

    #[test]
    fn a_file_system_without_locks_gives_a_warning_and_a_failing_lock_an_error() {
        let folder = place();
        let by = |try_lock: TryLock| ResultFolder::lock(folder.path(), None, try_lock);
        let unlocked = by(|_| Err(TryLockError::Error(ErrorKind::Unsupported.into())));
        let warning = unlocked.expect("opens").warning().map(ToString::to_string);
        assert!(warning.is_some_and(|w| w.contains("no other run writes to this folder")));
        let denied = by(|_| Err(TryLockError::Error(ErrorKind::PermissionDenied.into())));
        assert!(matches!(denied, Err(FileError::Io { what: "write", .. })), "{denied:?}");
        let held = by(|_| Err(TryLockError::WouldBlock));
        assert!(matches!(held, Err(FileError::Busy { .. })), "{held:?}");
    }
}
