//! The journal of finished trials: a file to which each is appended, and which a kill at any moment leaves usable.
//!
//! A line of JSON says which experiment and settings it belongs to; then comes a record of 48 bytes a trial,
//! little-endian: cell, trial, the outcome's bits, and a checksum. A kill can leave a piece of a record at the end:
//! that trial was not finished. A record whose checksum is wrong is damage, and is said.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{Outcome, WIDTH};
use crate::task::error::{InputFault, TaskError};
use crate::task::files::{Overwrite, write_whole};

const FORMAT: &str = "symbolt-trials";
const VERSION: u64 = 1;
const RECORD: usize = 4 + 8 + 8 * WIDTH + 4;

/// What a journal's trials belong to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Header {
    format: String,
    version: u64,
    pub experiment: String,
    pub seed: u64,
    pub settings: Value,
    pub shard: [u64; 2],
}

impl Header {
    pub fn new(experiment: &str, seed: u64, settings: Value, shard: [u64; 2]) -> Self {
        let experiment = experiment.into();
        Self { format: FORMAT.into(), version: VERSION, experiment, seed, settings, shard }
    }
}

/// A finished trial.
#[derive(Debug, Clone, Copy)]
pub(super) struct Record {
    pub cell: u32,
    pub trial: u64,
    pub outcome: Outcome,
}

impl Record {
    fn to_bytes(self) -> [u8; RECORD] {
        let mut bytes = [0; RECORD];
        bytes[..4].copy_from_slice(&self.cell.to_le_bytes());
        bytes[4..12].copy_from_slice(&self.trial.to_le_bytes());
        for (at, value) in bytes[12..RECORD - 4].chunks_exact_mut(8).zip(self.outcome) {
            at.copy_from_slice(&value.to_bits().to_le_bytes());
        }
        let checksum = crc32fast::hash(&bytes[..RECORD - 4]);
        bytes[RECORD - 4..].copy_from_slice(&checksum.to_le_bytes());
        bytes
    }

    fn from_bytes(bytes: &[u8; RECORD]) -> Option<Self> {
        let word = |at: usize| -> [u8; 8] { std::array::from_fn(|i| bytes[at + i]) };
        let short = |at: usize| -> [u8; 4] { std::array::from_fn(|i| bytes[at + i]) };
        let sound = crc32fast::hash(&bytes[..RECORD - 4]) == u32::from_le_bytes(short(RECORD - 4));
        sound.then(|| Self {
            cell: u32::from_le_bytes(short(0)),
            trial: u64::from_le_bytes(word(4)),
            outcome: std::array::from_fn(|i| f64::from_bits(u64::from_le_bytes(word(12 + 8 * i)))),
        })
    }
}

/// What a journal's file holds.
pub(super) struct Contents {
    pub header: Header,
    pub records: Vec<Record>,
    /// Bytes of records that are not what was written.
    pub damaged: usize,
    /// Length of the header and of all whole records.
    whole: u64,
}

fn fault(path: &Path, problem: impl Into<String>, expected: impl Into<String>) -> TaskError {
    TaskError::Input(InputFault {
        file: path.display().to_string(),
        line: None,
        field: String::new(),
        problem: problem.into(),
        expected: expected.into(),
    })
}

fn failed(what: &'static str, path: &Path) -> impl Fn(std::io::Error) -> TaskError {
    move |source| TaskError::Io { what, path: path.into(), source }
}

/// Reads a journal.
pub(super) fn read(path: &Path) -> Result<Contents, TaskError> {
    let mut bytes = Vec::new();
    File::open(path)
        .and_then(|mut file| file.read_to_end(&mut bytes))
        .map_err(failed("read", path))?;
    let end = bytes.iter().position(|b| *b == b'\n');
    let line = end.map_or(&bytes[..], |end| &bytes[..end]);
    let header: Header = serde_json::from_slice(line).map_err(|e| {
        fault(path, format!("its first line is not a journal's ({e})"), "a journal")
    })?;
    if header.format != FORMAT || header.version != VERSION {
        let problem = format!("it is a {} of version {}", header.format, header.version);
        return Err(fault(path, problem, format!("{FORMAT} of version {VERSION}")));
    }
    let start = end.map_or(bytes.len(), |end| end + 1);
    let (whole, _) = bytes[start..].as_chunks::<RECORD>();
    let records: Vec<Record> = whole.iter().filter_map(Record::from_bytes).collect();
    let damaged = (whole.len() - records.len()) * RECORD;
    let whole = (start + whole.len() * RECORD) as u64;
    Ok(Contents { header, records, damaged, whole })
}

/// A journal open for more trials.
#[derive(Debug)]
pub(super) struct Journal {
    file: File,
    path: PathBuf,
}

impl Journal {
    /// Opens the journal at `path` for trials of `header`, or begins it; what it holds already. Whatever
    /// another process appends to is refused.
    pub fn open(path: &Path, header: &Header) -> Result<(Self, Vec<Record>), TaskError> {
        if !path.exists() {
            let mut line = serde_json::to_vec(header).unwrap_or_default();
            line.push(b'\n');
            write_whole(path, &line, Overwrite::Never)?;
        }
        let mut file =
            OpenOptions::new().read(true).write(true).open(path).map_err(failed("write", path))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                let source = std::io::Error::other("another run appends to it");
                return Err(TaskError::Io { what: "write", path: path.into(), source });
            }
            Err(TryLockError::Error(source)) => return Err(failed("write", path)(source)),
        }
        let contents = read(path)?;
        if contents.header != *header {
            let problem = "it holds trials of another experiment, seed or settings";
            return Err(fault(path, problem, "another folder, or --force to begin anew"));
        }
        if contents.damaged > 0 {
            let problem = format!(
                "{} bytes of it are damaged; {} trials beside them are sound",
                contents.damaged,
                contents.records.len()
            );
            let expected = "an undamaged journal, or --salvage to keep the sound trials and do the \
                            others again";
            return Err(fault(path, problem, expected));
        }
        file.set_len(contents.whole).map_err(failed("write", path))?;
        file.seek(SeekFrom::End(0)).map_err(failed("write", path))?;
        Ok((Self { file, path: path.into() }, contents.records))
    }

    /// Appends a finished trial.
    pub fn append(&mut self, record: Record) -> Result<(), TaskError> {
        self.file.write_all(&record.to_bytes()).map_err(failed("write", &self.path))
    }
}

/// Writes a journal of these trials whole.
pub(super) fn write(
    path: &Path,
    header: &Header,
    records: &[Record],
    overwrite: Overwrite,
) -> Result<(), TaskError> {
    let mut bytes = serde_json::to_vec(header).unwrap_or_default();
    bytes.push(b'\n');
    bytes.extend(records.iter().flat_map(|r| r.to_bytes()));
    write_whole(path, &bytes, overwrite)
}
