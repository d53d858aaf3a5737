//! The journal of finished trials: an append-only file that stays usable when the program is killed at any moment.
//!
//! Its first line is JSON and says which experiment and settings it belongs to. Then comes one record for each trial,
//! all of equal length, little-endian: cell, trial, the outcome's bits, and a checksum. A kill can leave an
//! incomplete record at the end; its trial counts as not done. A complete record with a wrong checksum is damage and
//! is reported.

use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::lock::Lock;
use super::{MAX_READINGS, TrialOutcome};
use crate::files::{FileError, Overwrite, write_atomic};
use crate::task::{InputFault, TaskError};

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
    pub settings: Settings,
    /// The shard's index, counted from 0, and the number of shards.
    pub shard: [u64; 2],
    /// Numbers of an outcome.
    width: usize,
}

/// What decides the outcomes of trials beside the seed, and how many trials there are.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Settings {
    pub experiment: Value,
    pub revision: u32,
    pub cells: Vec<CellSettings>,
}

/// A cell of the settings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CellSettings {
    pub cell: Map<String, Value>,
    pub trials: u64,
}

impl Settings {
    /// Whether trials with these settings have the same outcomes as with `other`, however many there are.
    fn same_but_for_trials(&self, other: &Self) -> bool {
        let cells = |of: &Self| of.cells.len();
        self.experiment == other.experiment
            && self.revision == other.revision
            && cells(self) == cells(other)
            && self.cells.iter().zip(&other.cells).all(|(a, b)| a.cell == b.cell)
    }

    /// The most trials of a cell.
    fn max_trials(&self) -> u64 {
        self.cells.iter().map(|cell| cell.trials).max().unwrap_or(0)
    }
}

impl Header {
    pub fn new(
        experiment: &str,
        seed: u64,
        settings: Settings,
        shard: [u64; 2],
        width: usize,
    ) -> Self {
        let experiment = experiment.into();
        Self { format: FORMAT.into(), version: VERSION, experiment, seed, settings, shard, width }
    }

    /// The journal's first line.
    fn line(&self, path: &Path) -> Result<Vec<u8>, FileError> {
        let line = serde_json::to_vec(self);
        let mut line = line.map_err(|error| FileError::io("write", path)(error.into()))?;
        line.push(b'\n');
        Ok(line)
    }

    /// Why trials of this header cannot be used for `wanted`, in words; `None` if they can, which includes that only
    /// more trials are wanted.
    fn mismatch(&self, wanted: &Self) -> Option<String> {
        if self.experiment != wanted.experiment {
            let (held, wanted) = (&self.experiment, &wanted.experiment);
            return Some(format!("it holds trials of `{held}`, not of `{wanted}`"));
        }
        if self.seed != wanted.seed {
            return Some(format!(
                "it holds trials of the seed {}, not of {}",
                self.seed, wanted.seed
            ));
        }
        if self.shard != wanted.shard {
            let [index, of] = self.shard;
            return Some(format!("it holds trials of shard {}/{of}", index.saturating_add(1)));
        }
        if !self.settings.same_but_for_trials(&wanted.settings) || self.width != wanted.width {
            return Some(
                "it holds trials of other settings, or of another version of the program".into(),
            );
        }
        let mut cells = self.settings.cells.iter().zip(&wanted.settings.cells);
        if cells.any(|(held, wanted)| held.trials > wanted.trials) {
            let (held, wanted) = (self.settings.max_trials(), wanted.settings.max_trials());
            return Some(format!("it holds {held} trials a cell, and {wanted} are asked for"));
        }
        None
    }
}

/// A finished trial.
#[derive(Debug, Clone, Copy)]
pub(super) struct Record {
    pub cell: u32,
    pub trial: u64,
    pub outcome: TrialOutcome,
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
        let mut outcome = [f64::NAN; MAX_READINGS];
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

/// The content of a journal.
pub(super) struct Contents {
    pub header: Header,
    pub records: Vec<Record>,
    /// Bytes of records with a wrong checksum.
    pub damaged: usize,
    /// Length in bytes of the header and of all complete records.
    complete: u64,
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

/// Reads a journal.
pub(super) fn read(path: &Path) -> Result<Contents, TaskError> {
    let mut bytes = Vec::new();
    File::open(path)
        .and_then(|mut file| file.read_to_end(&mut bytes))
        .map_err(FileError::io("read", path))?;
    let bad = |why: String| {
        fault(path, format!("its first line is not a journal's ({why})"), "a journal, or --force")
    };
    let end = bytes.iter().position(|b| *b == b'\n').ok_or_else(|| bad("it has no end".into()))?;
    let header: Header = serde_json::from_slice(&bytes[..end]).map_err(|e| bad(e.to_string()))?;
    if header.format != FORMAT || header.version != VERSION || header.width > MAX_READINGS {
        let problem = format!("it is a {} of version {}", header.format, header.version);
        return Err(fault(path, problem, format!("{FORMAT} of version {VERSION}")));
    }
    let start = end + 1;
    let each = length(header.width);
    let chunks = bytes[start..].chunks_exact(each);
    let count = chunks.len();
    let records: Vec<Record> = chunks.filter_map(Record::from_bytes).collect();
    let damaged = (count - records.len()) * each;
    let complete = (start + count * each) as u64;
    Ok(Contents { header, records, damaged, complete })
}

/// A journal open for more trials.
#[derive(Debug)]
pub(super) struct Journal {
    file: File,
    path: PathBuf,
    width: usize,
    /// Where the last complete record ends.
    complete: u64,
    /// Whether a record could be written only in part. Nothing may follow it.
    torn: bool,
    _lock: Lock,
}

impl Journal {
    /// Opens the journal at `path` for trials of `header`, or creates it; with the trials that it holds. It may have
    /// been created for fewer trials. With `salvage` damaged records are dropped, otherwise they are an error. `lock`
    /// is that of the folder.
    pub fn open(
        path: &Path,
        header: &Header,
        salvage: bool,
        lock: Lock,
    ) -> Result<(Self, Vec<Record>), TaskError> {
        if !path.exists() {
            write_atomic(path, header.line(path)?, Overwrite::Never)?;
        }
        let failed = FileError::io("write", path);
        let mut file = OpenOptions::new().read(true).write(true).open(path).map_err(&failed)?;
        let contents = read(path)?;
        if let Some(problem) = contents.header.mismatch(header) {
            return Err(fault(path, problem, "another folder, or --force to start again"));
        }
        let more = contents.header != *header;
        if contents.damaged == 0 && more || contents.damaged > 0 && salvage {
            write(path, header, &contents.records, Overwrite::Allowed)?;
            return Self::open(path, header, false, lock);
        }
        if contents.damaged > 0 {
            let problem = format!(
                "{} bytes of it are damaged; {} trials are intact",
                contents.damaged,
                contents.records.len()
            );
            let expected = "an undamaged journal, or --salvage to keep the intact trials and run the \
                            others again";
            return Err(fault(path, problem, expected));
        }
        file.set_len(contents.complete).map_err(&failed)?;
        file.seek(SeekFrom::End(0)).map_err(&failed)?;
        let (path, width, complete) = (path.into(), header.width, contents.complete);
        Ok((Self { file, path, width, complete, torn: false, _lock: lock }, contents.records))
    }

    /// Appends a finished trial. After a failure nothing more is appended, because a record behind an incomplete one
    /// could not be found again.
    pub fn append(&mut self, record: Record) -> Result<(), FileError> {
        let failed = FileError::io("write", &self.path);
        if self.torn {
            let source = std::io::Error::other("an earlier trial could not be written");
            return Err(failed(source));
        }
        let bytes = record.to_bytes(self.width);
        self.file.write_all(&bytes).map_err(|source| {
            self.torn = true;
            // If this fails too, an incomplete record stays at the end, as after a kill.
            let _ = self.file.set_len(self.complete);
            failed(source)
        })?;
        self.complete += bytes.len() as u64;
        Ok(())
    }
}

/// Writes a journal of these trials at once.
pub(super) fn write(
    path: &Path,
    header: &Header,
    records: &[Record],
    overwrite: Overwrite,
) -> Result<(), FileError> {
    let mut bytes = header.line(path)?;
    bytes.extend(records.iter().flat_map(|r| r.to_bytes(header.width)));
    write_atomic(path, &bytes, overwrite)
}
