//! Writes the zip archives of `.npz` files: deflated members, and the directory at the end.

use std::collections::BTreeSet;
use std::io::Write;

use flate2::Compression;
use flate2::write::DeflateEncoder;

use super::NpzError;
use super::archive::{END, ENTRY, LOCAL};

/// Version of the zip format that a reader needs: that of Deflate, 2.0.
const NEEDED: u32 = 20;
/// Method of compression: Deflate.
const DEFLATED: u32 = 8;
/// What the directory says of who wrote a member: Unix, and the version of the format.
const MADE_BY: u32 = 0x0314;
/// Date of all members, 1980-01-01, so that an archive does not depend on the clock.
const DATE: u32 = 0x21;
/// Unix mode of all members.
const MODE: u32 = 0o100_644 << 16;

/// An archive that grows in memory.
#[derive(Default)]
pub(super) struct ArchiveWriter {
    members: Vec<u8>,
    directory: Vec<u8>,
    names: BTreeSet<String>,
}

/// Appends numbers in little-endian order, each with its number of bytes.
fn append(bytes: &mut Vec<u8>, numbers: &[(u32, usize)]) {
    numbers.iter().for_each(|(number, size)| bytes.extend(&number.to_le_bytes()[..*size]));
}

/// Returns a length or an offset, of which the format has 32 bits.
fn length(length: usize) -> Result<u32, NpzError> {
    let reason = "it would be larger than 4 GiB".to_owned();
    u32::try_from(length).map_err(|_| NpzError::Archive { reason })
}

impl ArchiveWriter {
    /// Adds a member.
    ///
    /// # Errors
    /// [`NpzError::Archive`] if there is a member of this name, or if the archive becomes too large for the format;
    /// [`NpzError::Io`] if the content cannot be compressed.
    pub fn add(&mut self, name: String, content: &[u8]) -> Result<(), NpzError> {
        let refused = |reason: String| Err(NpzError::Archive { reason });
        if name.len() > usize::from(u16::MAX) || self.names.len() == usize::from(u16::MAX) {
            return refused("its names are too long or too many".into());
        }
        if !self.names.insert(name.clone()) {
            return refused(format!("it has two members called `{name}`"));
        }
        let mut packed = DeflateEncoder::new(Vec::new(), Compression::default());
        packed.write_all(content)?;
        let packed = packed.finish()?;
        let at = length(self.members.len())?;
        let utf8 = if name.is_ascii() { 0 } else { 1 << 11 };
        let common = [
            (NEEDED, 2),
            (utf8, 2),
            (DEFLATED, 2),
            (0, 2),
            (DATE, 2),
            (crc32fast::hash(content), 4),
            (length(packed.len())?, 4),
            (length(content.len())?, 4),
            (length(name.len())?, 2),
            (0, 2),
        ];
        self.members.extend(LOCAL);
        append(&mut self.members, &common);
        self.members.extend(name.bytes());
        self.members.extend(packed);
        self.directory.extend(ENTRY);
        append(&mut self.directory, &[(MADE_BY, 2)]);
        append(&mut self.directory, &common);
        append(&mut self.directory, &[(0, 2), (0, 2), (0, 2), (MODE, 4), (at, 4)]);
        self.directory.extend(name.bytes());
        Ok(())
    }

    /// Returns the archive's bytes.
    ///
    /// # Errors
    /// [`NpzError::Archive`] if the archive is too large for the format.
    pub fn finish(self) -> Result<Vec<u8>, NpzError> {
        let Self { members: mut bytes, directory, names } = self;
        let (at, size) = (length(bytes.len())?, length(directory.len())?);
        let count = length(names.len())?;
        bytes.extend(directory);
        bytes.extend(END);
        append(&mut bytes, &[(0, 4), (count, 2), (count, 2), (size, 4), (at, 4), (0, 2)]);
        Ok(bytes)
    }
}
