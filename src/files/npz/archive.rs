//! Reads the zip archives of `.npz` files: the directory at the end, and stored or deflated members.
//!
//! The reader trusts no number of the archive. It reads the directory once, allocates nothing on the word of a header,
//! and checks the length and the checksum of each member. Its cost grows linearly with the length of the archive and
//! of the members that are read. Archives of more than 4 GiB (zip64) are not supported.

use std::collections::BTreeMap;
use std::io::Read;

use flate2::read::DeflateDecoder;

/// Greatest number of members of an archive.
pub(super) const MAX_MEMBERS: usize = 4096;

/// Greatest length of a member's name, in bytes.
const MAX_NAME: usize = 256;

/// Greatest number of bytes to which Deflate can expand one byte.
const MAX_EXPANSION: usize = 1032;

const END: &[u8] = b"PK\x05\x06";
const END_LENGTH: usize = 22;
const ENTRY: &[u8] = b"PK\x01\x02";
const ENTRY_LENGTH: usize = 46;
const LOCAL: &[u8] = b"PK\x03\x04";
const LOCAL_LENGTH: usize = 30;

/// An archive in memory.
#[derive(Debug)]
pub(super) struct Archive<'b> {
    bytes: &'b [u8],
    /// Names of the members, in the order of the directory.
    names: Vec<String>,
    members: BTreeMap<String, Member>,
}

/// An entry of the directory.
#[derive(Debug, Clone, Copy)]
struct Member {
    method: u16,
    checksum: u32,
    packed: usize,
    length: usize,
    /// Offset of the local header.
    at: usize,
}

fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

fn length_at(bytes: &[u8], at: usize) -> Option<usize> {
    u16_at(bytes, at).map(usize::from)
}

fn offset_at(bytes: &[u8], at: usize) -> Option<usize> {
    usize::try_from(u32_at(bytes, at)?).ok()
}

/// Finds the record at the end, which is followed only by a comment of the length that it states.
fn end_of(bytes: &[u8]) -> Option<&[u8]> {
    let last = bytes.len().checked_sub(END_LENGTH)?;
    let first = last.saturating_sub(usize::from(u16::MAX));
    let ends = |at: &usize| {
        let comment = length_at(bytes, at + 20);
        bytes[*at..].starts_with(END) && comment == Some(bytes.len() - at - END_LENGTH)
    };
    (first..=last).rev().find(ends).map(|at| &bytes[at..])
}

impl<'b> Archive<'b> {
    /// Reads the directory.
    ///
    /// # Errors
    /// A sentence on the fault.
    pub fn new(bytes: &'b [u8]) -> Result<Self, String> {
        let end = end_of(bytes).ok_or("it has no directory at its end, or ends too early")?;
        let cut = || "its directory ends too early".to_owned();
        let count = length_at(end, 10).ok_or_else(cut)?;
        if count > MAX_MEMBERS {
            return Err(format!("it has {count} members; expected at most {MAX_MEMBERS}"));
        }
        let mut rest = offset_at(end, 16).and_then(|at| bytes.get(at..)).ok_or_else(cut)?;
        let (mut names, mut members) = (Vec::with_capacity(count), BTreeMap::new());
        for _ in 0..count {
            let (name, member, length) = Self::entry(rest).ok_or_else(cut)??;
            rest = &rest[length..];
            if members.insert(name.clone(), member).is_some() {
                return Err(format!("it has two members called `{name}`"));
            }
            names.push(name);
        }
        Ok(Self { bytes, names, members })
    }

    /// Reads an entry of the directory. Returns its name, its content and its length; `None` if it ends too early.
    fn entry(bytes: &[u8]) -> Option<Result<(String, Member, usize), String>> {
        if !bytes.starts_with(ENTRY) {
            return None;
        }
        let name = bytes.get(ENTRY_LENGTH..)?.get(..length_at(bytes, 28)?)?;
        let length = ENTRY_LENGTH + name.len() + length_at(bytes, 30)? + length_at(bytes, 32)?;
        if length > bytes.len() {
            return None;
        }
        if name.len() > MAX_NAME {
            let long = name.len();
            return Some(Err(format!("a name has {long} bytes; expected at most {MAX_NAME}")));
        }
        let member = Member {
            method: u16_at(bytes, 10)?,
            checksum: u32_at(bytes, 16)?,
            packed: offset_at(bytes, 20)?,
            length: offset_at(bytes, 24)?,
            at: offset_at(bytes, 42)?,
        };
        Some(Ok((String::from_utf8_lossy(name).into_owned(), member, length)))
    }

    /// Returns the names of the members, in the order of the directory.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Opens a member; `None` if the archive has no such member.
    ///
    /// # Errors
    /// A sentence on the fault.
    pub fn open(&self, name: &str) -> Option<Result<Content<'b>, String>> {
        let member = *self.members.get(name)?;
        Some(self.content(member))
    }

    fn content(&self, member: Member) -> Result<Content<'b>, String> {
        let packed = || {
            let local = self.bytes.get(member.at..)?;
            let own = LOCAL_LENGTH + length_at(local, 26)? + length_at(local, 28)?;
            local.starts_with(LOCAL).then(|| local.get(own..)?.get(..member.packed))?
        };
        let packed = packed().ok_or("it has no data in the archive")?;
        let stream: Box<dyn Read + 'b> = match member.method {
            0 => Box::new(packed),
            8 => Box::new(DeflateDecoder::new(packed)),
            other => return Err(format!("it is compressed by method {other}; expected Deflate")),
        };
        Ok(Content {
            stream,
            length: member.length,
            reachable: packed.len().saturating_mul(MAX_EXPANSION),
            taken: 0,
            expected: member.checksum,
            hasher: crc32fast::Hasher::new(),
        })
    }
}

/// The decompressed bytes of a member.
pub(super) struct Content<'b> {
    stream: Box<dyn Read + 'b>,
    length: usize,
    reachable: usize,
    taken: usize,
    expected: u32,
    hasher: crc32fast::Hasher,
}

impl Content<'_> {
    /// Returns the stated length, in bytes.
    pub fn length(&self) -> usize {
        self.length
    }

    /// Returns the greatest length that the compressed bytes can have when decompressed.
    pub fn reachable(&self) -> usize {
        self.reachable
    }

    /// Returns the number of bytes taken so far.
    pub fn taken(&self) -> usize {
        self.taken
    }

    /// Fills `buffer`.
    ///
    /// # Errors
    /// [`std::io::Error`] if the content is damaged or ends within the buffer.
    pub fn fill(&mut self, buffer: &mut [u8]) -> std::io::Result<()> {
        self.stream.read_exact(buffer)?;
        self.taken += buffer.len();
        self.hasher.update(buffer);
        Ok(())
    }

    /// Checks that all stated bytes were taken, that no others follow, and that the checksum is right.
    pub fn ends_soundly(mut self) -> bool {
        let ended = matches!(self.stream.read(&mut [0]), Ok(0));
        ended && self.taken == self.length && self.hasher.finalize() == self.expected
    }
}
