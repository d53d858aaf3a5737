//! Reads whole files, up to a maximum size, and writes them atomically.
//!
//! Every module of the crate may use this module. It uses no other module.

mod input;
pub mod npz;

use std::io::Write;
use std::path::{Path, PathBuf};

use thiserror::Error;

pub use input::{Limit, read_beginning, read_file, read_regular_file};

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
    /// The file is larger than its kind allows.
    #[error("{} has {}; expected at most {} for {what}", path.display(), size(*bytes, *max_bytes), in_mib(*max_bytes))]
    TooLarge {
        /// File.
        path: PathBuf,
        /// Size in bytes; `None` for a stream, whose length is unknown.
        bytes: Option<u64>,
        /// Kind of file with its article, such as `a recording`.
        what: &'static str,
        /// Maximum size, in bytes.
        max_bytes: u64,
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

fn size(bytes: Option<u64>, max_bytes: u64) -> String {
    bytes.map_or_else(|| format!("more than {}", in_mib(max_bytes)), in_mib)
}

/// Returns a number of bytes in words: in MiB if it is a whole number of MiB.
fn in_mib(bytes: u64) -> String {
    match bytes {
        1.. if bytes.is_multiple_of(1 << 20) => format!("{} MiB", bytes >> 20),
        _ => format!("{bytes} bytes"),
    }
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
    fn a_file_is_replaced_only_if_that_is_allowed_and_nothing_else_is_left_in_its_folder() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("file");
        write_atomic(&path, "one", Overwrite::Never).expect("it is new");
        let refused = write_atomic(&path, "two", Overwrite::Never);
        assert!(matches!(refused, Err(FileError::Exists { .. })), "{refused:?}");
        assert_eq!(std::fs::read(&path).expect("a file"), b"one");
        write_atomic(&path, "three", Overwrite::Allowed).expect("it may be replaced");
        assert_eq!(std::fs::read(&path).expect("a file"), b"three");
        assert_eq!(folder.path().read_dir().expect("a folder").count(), 1);
    }
}
