//! The lock that keeps a second run out of a folder.

use std::fmt::{Display, Formatter};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Error, ErrorKind};
use std::path::{Path, PathBuf};

use crate::files::FileError;

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
pub(super) type TryLock = fn(&File) -> Result<(), TryLockError>;

/// The lock of a folder. Only its holder changes the folder's journal. Dropping the value releases the lock.
#[derive(Debug)]
pub(super) struct Lock {
    _file: File,
}

impl Lock {
    /// Takes the lock of a folder and creates the folder if necessary. On a file system without locks, returns a
    /// warning and a lock that has no effect.
    ///
    /// # Errors
    /// [`FileError::Io`] if another run holds the lock or the folder cannot be written.
    pub fn take(folder: &Path, try_lock: TryLock) -> Result<(Self, Option<Warning>), FileError> {
        std::fs::create_dir_all(folder).map_err(FileError::io("make", folder))?;
        let path = folder.join(".lock");
        let mut options = OpenOptions::new();
        let file = options.write(true).create(true).truncate(false).open(&path);
        let file = file.map_err(FileError::io("write", folder))?;
        let warning = match try_lock(&file) {
            Ok(()) => None,
            Err(TryLockError::WouldBlock) => {
                let source = Error::other("another run is using this folder");
                return Err(FileError::Io { what: "write", path: folder.into(), source });
            }
            Err(TryLockError::Error(error)) if unsupported(&error) => {
                Some(Warning::Unlocked { folder: folder.into(), reason: error.to_string() })
            }
            Err(TryLockError::Error(source)) => {
                return Err(FileError::Io { what: "write", path, source });
            }
        };
        Ok((Self { _file: file }, warning))
    }
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

    #[test]
    #[cfg(target_os = "linux")]
    fn errors_of_file_systems_without_locks_are_told_from_other_errors() {
        // ENOSYS, EOPNOTSUPP, EINVAL, ENOLCK; and EIO, EBADF, ENOSPC.
        assert!([38, 95, 22, 37].iter().all(|code| unsupported(&Error::from_raw_os_error(*code))));
        assert!(![5, 9, 28].iter().any(|code| unsupported(&Error::from_raw_os_error(*code))));
    }

    #[test]
    fn a_lock_keeps_others_out_until_it_is_dropped() {
        let folder = tempfile::tempdir().expect("a folder");
        let (held, warning) = Lock::take(folder.path(), File::try_lock).expect("it is free");
        assert_eq!(warning, None);
        let refused = Lock::take(folder.path(), File::try_lock).map(|_| ());
        let refused = refused.expect_err("it is held");
        let FileError::Io { source, .. } = refused else { panic!("{refused}") };
        assert_eq!(source.to_string(), "another run is using this folder");
        drop(held);
        Lock::take(folder.path(), File::try_lock).expect("it is free again");
    }
}
