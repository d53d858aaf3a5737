//! Reads whole files, up to a maximum size, writes them atomically, and opens folders for results.
//!
//! Every module of the crate may use this module. It uses no other module.

mod folder;
mod input;
pub mod npz;
mod write;

use std::path::{Path, PathBuf};

use thiserror::Error;

#[cfg(test)]
pub(crate) use folder::TryLock;
pub use folder::{ResultFolder, Warning};
pub use input::{Limit, read_beginning, read_file, read_regular_file};
pub use write::{check_output, write_atomic};

/// A file that cannot be read or written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum FileError {
    /// The operating system refused an operation.
    #[error("cannot {what} {}", shown(path))]
    Io {
        /// Operation: `read`, `write`, `write to`, `make` or `remove`.
        what: &'static str,
        /// File or folder.
        path: PathBuf,
        /// Reason of the operating system.
        source: std::io::Error,
    },
    /// The file is larger than its kind allows.
    #[error("{} has {}; expected at most {} for {what}", shown(path), size(*bytes, *max_bytes), in_mib(*max_bytes))]
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
    /// A folder has too many entries to look for files in it.
    #[error("{} has more than {max_entries} entries; name a folder with fewer", folder.display())]
    TooManyEntries {
        /// Folder.
        folder: PathBuf,
        /// Greatest number of entries.
        max_entries: usize,
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

/// Returns a path in words; `-` is standard input.
fn shown(path: &Path) -> String {
    match path.as_os_str() == "-" {
        true => "standard input".into(),
        false => path.display().to_string(),
    }
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
