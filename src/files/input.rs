//! Reads input files. Every input of the crate comes through this module.
//!
//! Each kind of input has a maximum size ([`Limit`]). A device, a socket or a folder is refused at once. A pipe is read
//! only where a user names the file ([`read_file`]), never as a file of a result folder ([`read_regular_file`]).

use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use super::FileError;

/// A kind of input and the maximum size of its files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limit {
    /// Kind of input with its article, such as `a recording`.
    pub what: &'static str,
    /// Maximum size, in bytes.
    pub max_bytes: u64,
}

impl Limit {
    /// Settings of a task and task files: 4 MiB.
    pub const SETTINGS: Self = Self::new("a settings or task file", 4);
    /// A single scene: 8 MiB.
    pub const SCENE: Self = Self::new("a scene", 8);
    /// A domain of any version: 4 MiB.
    pub const DOMAIN: Self = Self::new("a domain", 4);
    /// A recording: 256 MiB, a million snapshots of one object.
    pub const RECORDING: Self = Self::new("a recording", 256);
    /// A log of poses to import: 320 MiB.
    pub const LOG: Self = Self::new("a log", 320);
    /// A PDDL file, or a file of trajectories: 64 MiB.
    pub const PDDL: Self = Self::new("a PDDL file or trajectory", 64);
    /// A model of solved populations: 160 MiB.
    pub const MODEL: Self = Self::new("a model of solved populations", 160);
    /// Any of the files that `symbolt check` recognises: 256 MiB.
    pub const ANY: Self = Self::new("a file that can be checked", 256);
    /// The settings and results of a run, or the table of an experiment: 2 MiB.
    pub const FACTS: Self = Self::new("a table of results", 2);
    /// The trace of a run: 32 MiB.
    pub const TRACE: Self = Self::new("a trace", 32);
    /// An archive of arrays: 64 MiB.
    pub const ARCHIVE: Self = Self::new("an archive of arrays", 64);
    /// The figure of an experiment: 8 MiB.
    pub const FIGURE: Self = Self::new("a figure", 8);
    /// A log of interventions in a run: 64 MiB.
    pub const INTERVENTIONS: Self = Self::new("a log of interventions", 64);
    /// A journal of trials: 96 MiB.
    pub const JOURNAL: Self = Self::new("a journal of trials", 96);

    const fn new(what: &'static str, mebibytes: u64) -> Self {
        Self { what, max_bytes: mebibytes << 20 }
    }

    /// Returns an error if a file of `bytes` bytes is larger than the maximum size.
    ///
    /// # Errors
    /// [`FileError::TooLarge`].
    pub fn check(self, path: &Path, bytes: u64) -> Result<(), FileError> {
        let Self { what, max_bytes } = self;
        if bytes <= max_bytes {
            return Ok(());
        }
        Err(FileError::TooLarge { path: path.into(), bytes: Some(bytes), what, max_bytes })
    }
}

/// Time for which a named pipe may have no writer.
const WAIT_FOR_WRITER: Duration = Duration::from_secs(5);

/// Reads a file that the user names, or standard input for the path `-`. The file may be a pipe, such as that of
/// `<(command)`.
///
/// # Errors
/// [`FileError::TooLarge`] if the file has more bytes than `limit` allows. [`FileError::Io`] if the path is a device, a
/// socket or a folder, if nothing writes to a named pipe within 5 seconds, or if the file cannot be read.
pub fn read_file(path: &Path, limit: Limit) -> Result<Vec<u8>, FileError> {
    if path.as_os_str() == "-" || path == Path::new("/dev/stdin") {
        return take(std::io::stdin().lock(), path, limit);
    }
    let metadata = path.metadata().map_err(FileError::io("read", path))?;
    if is_pipe(&metadata) {
        return take(open_pipe(path)?, path, limit);
    }
    read_regular_file(path, limit)
}

/// Reads a regular file, such as a file of a result folder.
///
/// # Errors
/// [`FileError::TooLarge`] if the file has more bytes than `limit` allows. [`FileError::Io`] if the path is no regular
/// file, or if the file cannot be read.
pub fn read_regular_file(path: &Path, limit: Limit) -> Result<Vec<u8>, FileError> {
    let (file, length) = open_regular(path)?;
    limit.check(path, length)?;
    take(file, path, limit)
}

/// Reads the first bytes of a regular file, at most `most`, to recognise its format.
///
/// # Errors
/// [`FileError::Io`] if the path is no regular file, or if the file cannot be read.
pub fn read_beginning(path: &Path, most: usize) -> Result<Vec<u8>, FileError> {
    let (file, _) = open_regular(path)?;
    let mut bytes = Vec::new();
    file.take(most as u64).read_to_end(&mut bytes).map_err(FileError::io("read", path))?;
    Ok(bytes)
}

/// Opens a regular file. Returns it with its length.
fn open_regular(path: &Path) -> Result<(File, u64), FileError> {
    let failed = FileError::io("read", path);
    let metadata = path.metadata().map_err(&failed)?;
    if metadata.is_dir() {
        return Err(failed(std::io::ErrorKind::IsADirectory.into()));
    }
    if !metadata.is_file() {
        return Err(failed(std::io::Error::other("it is not a regular file")));
    }
    Ok((File::open(path).map_err(failed)?, metadata.len()))
}

/// Reads a stream up to the limit. The length of a stream is unknown, and a file can grow while it is read.
fn take(stream: impl Read, path: &Path, limit: Limit) -> Result<Vec<u8>, FileError> {
    let mut bytes = Vec::new();
    let taken = stream.take(limit.max_bytes + 1).read_to_end(&mut bytes);
    taken.map_err(FileError::io("read", path))?;
    if bytes.len() as u64 > limit.max_bytes {
        let Limit { what, max_bytes } = limit;
        return Err(FileError::TooLarge { path: path.into(), bytes: None, what, max_bytes });
    }
    Ok(bytes)
}

#[cfg(unix)]
fn is_pipe(metadata: &std::fs::Metadata) -> bool {
    use std::os::unix::fs::FileTypeExt;
    metadata.file_type().is_fifo()
}

#[cfg(not(unix))]
fn is_pipe(_: &std::fs::Metadata) -> bool {
    false
}

/// Opens a pipe. Opening a named pipe blocks until something writes to it, so it happens in another thread, which ends
/// with the program if there is never a writer.
fn open_pipe(path: &Path) -> Result<File, FileError> {
    let failed = FileError::io("read", path);
    let (send, opened) = channel();
    let own = path.to_path_buf();
    let opening = std::thread::Builder::new().spawn(move || {
        // The receiver is gone if the time is over.
        let _ = send.send(File::open(own));
    });
    opening.map_err(&failed)?;
    opened
        .recv_timeout(WAIT_FOR_WRITER)
        .unwrap_or_else(|error| {
            Err(std::io::Error::other(match error {
                RecvTimeoutError::Timeout => "it is a pipe, and nothing writes to it",
                RecvTimeoutError::Disconnected => "it is a pipe that could not be opened",
            }))
        })
        .map_err(failed)
}
