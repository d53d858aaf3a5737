//! Reads whole files, writes them atomically, and opens folders for results.
//!
//! Every module of the crate may use this module. It uses no other module.

mod folder;
pub mod npz;
mod write;

use std::io::Read;
use std::path::{Path, PathBuf};

use thiserror::Error;

#[cfg(test)]
pub(crate) use folder::TryLock;
pub use folder::{ResultFolder, Warning};
pub use write::{check_output, write_atomic};

/// A file that cannot be read or written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum FileError {
    /// The operating system refused an operation.
    #[error("cannot {what} {}", path.display())]
    Io {
        /// Operation: `read`, `write`, `write to`, `make` or `remove`.
        what: &'static str,
        /// File or folder.
        path: PathBuf,
        /// Reason of the operating system.
        source: std::io::Error,
    },
    /// The output file already exists.
    #[error("{} exists already; choose another name, or allow overwriting", path.display())]
    Exists {
        /// Output file.
        path: PathBuf,
    },
    /// Another run holds the lock of the output folder.
    #[error("another run is writing to {}; choose another folder, or wait until it ends", folder.display())]
    Busy {
        /// Output folder.
        folder: PathBuf,
    },
}

impl FileError {
    /// Returns a function that turns an operating-system error into a [`FileError`] with operation and path.
    ///
    /// ```
    /// use symbolt::files::FileError;
    /// use std::path::Path;
    ///
    /// let file = Path::new("no/such/file");
    /// let error = std::fs::read(file).map_err(FileError::io("read", file)).unwrap_err();
    /// assert_eq!(error.to_string(), "cannot read no/such/file");
    /// ```
    pub fn io(what: &'static str, path: &Path) -> impl Fn(std::io::Error) -> Self {
        move |source| Self::Io { what, path: path.into(), source }
    }
}

/// Whether an existing file may be replaced.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Overwrite {
    /// Keep the file and return an error.
    #[default]
    Never,
    /// Replace the file.
    Allowed,
}

/// Reads a file, or standard input for the path `-`.
///
/// # Errors
/// [`FileError::Io`] if the file cannot be read.
pub fn read_file(path: &Path) -> Result<Vec<u8>, FileError> {
    let failed = FileError::io("read", path);
    if path.as_os_str() == "-" {
        let mut bytes = Vec::new();
        std::io::stdin().lock().read_to_end(&mut bytes).map_err(&failed)?;
        return Ok(bytes);
    }
    std::fs::read(path).map_err(failed)
}

/// Reads a regular file, or standard input for the path `-`. Refuses devices and pipes, which might never end.
///
/// # Errors
/// [`FileError::Io`] if the path is a device, a pipe or a socket, or if the file cannot be read.
pub fn read_ordinary_file(path: &Path) -> Result<Vec<u8>, FileError> {
    let special = path.metadata().is_ok_and(|m| !m.is_file() && !m.is_dir());
    if special && path.as_os_str() != "-" {
        let source = std::io::Error::other("it is not a regular file");
        return Err(FileError::Io { what: "read", path: path.into(), source });
    }
    read_file(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(unix)]
    fn a_device_that_never_ends_is_refused_instead_of_read() {
        let refused = read_ordinary_file(Path::new("/dev/zero"));
        assert!(matches!(refused, Err(FileError::Io { what: "read", .. })), "{refused:?}");
    }

    #[test]
    fn a_file_is_replaced_only_if_that_is_allowed_and_nothing_else_is_left_in_its_folder() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("file");
        write_atomic(&path, "one", Overwrite::Never).expect("it is new");
        let refused = write_atomic(&path, "two", Overwrite::Never);
        assert!(matches!(refused, Err(FileError::Exists { .. })), "{refused:?}");
        assert_eq!(read_file(&path).expect("a file"), b"one");
        write_atomic(&path, "three", Overwrite::Allowed).expect("it may be replaced");
        assert_eq!(read_file(&path).expect("a file"), b"three");
        assert_eq!(folder.path().read_dir().expect("a folder").count(), 1);
    }
}
