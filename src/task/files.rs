//! Reading and writing whole files: nothing is left half-written, nothing is overwritten unasked.

use std::io::{Read, Write};
use std::path::Path;

use super::error::TaskError;
use crate::neurons::SolvedModel;

/// Whether an existing file may be replaced.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Overwrite {
    /// Refuse.
    #[default]
    Never,
    /// Replace it.
    Allowed,
}

/// All bytes of a file, or of standard input for `-`.
///
/// # Errors
/// [`TaskError::Io`] if it cannot be read.
pub fn read_file(path: &Path) -> Result<Vec<u8>, TaskError> {
    let failed = |source| TaskError::Io { what: "read", path: path.into(), source };
    if path.as_os_str() == "-" {
        let mut bytes = Vec::new();
        std::io::stdin().lock().read_to_end(&mut bytes).map_err(failed)?;
        return Ok(bytes);
    }
    std::fs::read(path).map_err(failed)
}

/// Reads a file of solved populations.
///
/// # Errors
/// [`TaskError::Io`] if it cannot be read, [`TaskError::Solved`] if it is not such a file, of this version and
/// undamaged.
pub fn read_solved(path: &Path) -> Result<SolvedModel, TaskError> {
    let special = path.metadata().is_ok_and(|m| !m.is_file() && !m.is_dir());
    if special && path.as_os_str() != "-" {
        let source = std::io::Error::other("it is no ordinary file");
        return Err(TaskError::Io { what: "read", path: path.into(), source });
    }
    let bytes = read_file(path)?;
    SolvedModel::decode(&bytes).map_err(|source| TaskError::Solved { file: path.into(), source })
}

/// Writes a file whole: beside it first, then under its name.
///
/// # Errors
/// [`TaskError::Exists`] if it exists and must not be replaced; [`TaskError::Io`] if it cannot be
/// written. Nothing is left behind in either case.
pub fn write_whole(
    path: &Path,
    content: impl AsRef<[u8]>,
    overwrite: Overwrite,
) -> Result<(), TaskError> {
    let failed = |source| TaskError::Io { what: "write", path: path.into(), source };
    if overwrite == Overwrite::Never && path.exists() {
        return Err(TaskError::Exists { path: path.into() });
    }
    // Through a link, its target is written; what is no ordinary file is left alone.
    let resolved = path.canonicalize().ok();
    let path = resolved.as_deref().unwrap_or(path);
    if path.exists() && !path.is_file() {
        let source = std::io::Error::other("it is no ordinary file");
        return Err(TaskError::Io { what: "write", path: path.into(), source });
    }
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut beside = tempfile::Builder::new()
        .prefix(".symbolt-")
        .permissions_like_a_new_file()
        .tempfile_in(folder)
        .map_err(failed)?;
    beside.write_all(content.as_ref()).map_err(failed)?;
    beside.as_file().sync_all().map_err(failed)?;
    match overwrite {
        Overwrite::Allowed => beside.persist(path).map_err(|e| failed(e.error))?,
        Overwrite::Never => beside.persist_noclobber(path).map_err(|e| {
            if e.error.kind() == std::io::ErrorKind::AlreadyExists {
                TaskError::Exists { path: path.into() }
            } else {
                failed(e.error)
            }
        })?,
    };
    Ok(())
}

/// Ordinary permissions for a file that will keep its place, instead of a temporary file's private ones.
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
