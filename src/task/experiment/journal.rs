//! The journal of finished trials: a file to which each is appended, and which a kill at any moment leaves usable.
//!
//! A line of JSON says which experiment and settings it belongs to; then comes a record a trial, of equal
//! length, little-endian: cell, trial, the outcome's bits, and a checksum. A kill can leave a piece of a record at the end:
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

/// Length of a record with an outcome of `width` numbers.
fn length(width: usize) -> usize {
    4 + 8 + 8 * width + 4
}

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
    /// Numbers of an outcome.
    width: usize,
}

impl Header {
    pub fn new(
        experiment: &str,
        seed: u64,
        settings: Value,
        (shard, width): ([u64; 2], usize),
    ) -> Self {
        let experiment = experiment.into();
        Self { format: FORMAT.into(), version: VERSION, experiment, seed, settings, shard, width }
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
    fn to_bytes(self, width: usize) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(length(width));
        bytes.extend(self.cell.to_le_bytes());
        bytes.extend(self.trial.to_le_bytes());
        bytes.extend(self.outcome[..width].iter().flat_map(|v| v.to_bits().to_le_bytes()));
        bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
        bytes
    }

    fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (content, checksum) = bytes.split_last_chunk::<4>()?;
        let (cell, rest) = content.split_first_chunk::<4>()?;
        let (trial, rest) = rest.split_first_chunk::<8>()?;
        let mut outcome = [f64::NAN; WIDTH];
        for (value, bits) in outcome.iter_mut().zip(rest.as_chunks::<8>().0) {
            *value = f64::from_bits(u64::from_le_bytes(*bits));
        }
        (crc32fast::hash(content) == u32::from_le_bytes(*checksum)).then(|| Self {
            cell: u32::from_le_bytes(*cell),
            trial: u64::from_le_bytes(*trial),
            outcome,
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
    if header.format != FORMAT || header.version != VERSION || header.width > WIDTH {
        let problem = format!("it is a {} of version {}", header.format, header.version);
        return Err(fault(path, problem, format!("{FORMAT} of version {VERSION}")));
    }
    let start = end.map_or(bytes.len(), |end| end + 1);
    let each = length(header.width);
    let whole = bytes[start..].chunks_exact(each);
    let count = whole.len();
    let records: Vec<Record> = whole.filter_map(Record::from_bytes).collect();
    let damaged = (count - records.len()) * each;
    let whole = (start + count * each) as u64;
    Ok(Contents { header, records, damaged, whole })
}

/// A journal open for more trials.
#[derive(Debug)]
pub(super) struct Journal {
    file: File,
    path: PathBuf,
    width: usize,
}

impl Journal {
    /// Opens the journal at `path` for trials of `header`, or begins it; what it holds already. Damaged records
    /// are dropped if it is to `salvage`, else refused; so is whatever another process appends to.
    pub fn open(
        path: &Path,
        header: &Header,
        salvage: bool,
    ) -> Result<(Self, Vec<Record>), TaskError> {
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
        if contents.damaged > 0 && salvage {
            write(path, header, &contents.records, Overwrite::Allowed)?;
            // The whole file stands in the place of the one that is locked here.
            drop(file);
            return Self::open(path, header, false);
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
        Ok((Self { file, path: path.into(), width: header.width }, contents.records))
    }

    /// Appends a finished trial.
    pub fn append(&mut self, record: Record) -> Result<(), TaskError> {
        self.file.write_all(&record.to_bytes(self.width)).map_err(failed("write", &self.path))
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
    bytes.extend(records.iter().flat_map(|r| r.to_bytes(header.width)));
    write_whole(path, &bytes, overwrite)
}
