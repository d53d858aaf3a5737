//! Reads whole files and writes them atomically.
//!
//! Every module of the crate may use this module. It uses no other module.

pub mod npz;

use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use thiserror::Error;

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

/// Writes a file atomically: writes a temporary file in the same folder and renames it. A reader sees either the old
/// content or all of the new content. If `path` is a symbolic link, the file that it points to is replaced.
///
/// # Errors
/// [`FileError::Exists`] if the file exists and must not be replaced. [`FileError::Io`] if the file cannot be written.
/// After an error, no temporary file is left behind.
pub fn write_atomic(
    path: &Path,
    content: impl AsRef<[u8]>,
    overwrite: Overwrite,
) -> Result<(), FileError> {
    if overwrite == Overwrite::Never && path.exists() {
        return Err(FileError::Exists { path: path.into() });
    }
    // Replace the target of a link, not the link.
    let resolved = path.canonicalize().ok();
    let path = resolved.as_deref().unwrap_or(path);
    if path.exists() && !path.is_file() {
        let source = std::io::Error::other("it is not a regular file");
        return Err(FileError::Io { what: "write", path: path.into(), source });
    }
    let failed = FileError::io("write", path);
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut beside = tempfile::Builder::new()
        .prefix(".symbolt-")
        .permissions_like_a_new_file()
        .tempfile_in(folder)
        .map_err(&failed)?;
    beside.write_all(content.as_ref()).map_err(&failed)?;
    beside.as_file().sync_all().map_err(&failed)?;
    match overwrite {
        Overwrite::Allowed => beside.persist(path).map_err(|e| failed(e.error))?,
        Overwrite::Never => beside.persist_noclobber(path).map_err(|e| {
            if e.error.kind() == std::io::ErrorKind::AlreadyExists {
                FileError::Exists { path: path.into() }
            } else {
                failed(e.error)
            }
        })?,
    };
    Ok(())
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
