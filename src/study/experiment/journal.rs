//! The journal of finished trials: an append-only file that stays usable if the program is killed at any moment.
//!
//! The first line is JSON and names the experiment and its settings. One record follows for each trial. Records have
//! equal length and are little-endian: cell, trial, the bits of the outcome, and a checksum. A kill can leave an
//! incomplete record at the end; its trial counts as not done. A complete record with a wrong checksum is reported as
//! damage.

use std::collections::BTreeSet;
use std::fmt;
use std::fs::{File, OpenOptions};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use super::{MAX_READINGS, TrialOutcome, write_settings};
use crate::files::{FileError, Limit, Overwrite, read_regular_file, write_atomic};
use crate::task::{InputFault, TaskError};

const FORMAT: &str = "symbolt-trials";
const VERSION: u64 = 1;
/// Maximum length of the first line, in bytes. A cell takes about 100.
const MAX_HEADER: usize = 2 << 20;

/// Returns the length of a record, in bytes, if an outcome has `width` numbers.
fn length(width: usize) -> usize {
    4 + 8 + 8 * width + 4
}

/// A journal's first line: the run that its trials belong to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Header {
    format: String,
    version: u64,
    pub experiment: String,
    pub seed: u64,
    pub settings: Settings,
    /// Index of the shard, counted from 0, and the number of shards.
    pub shard: [u64; 2],
    /// Number of values in an outcome.
    width: usize,
}

/// The settings that determine the outcomes of trials together with the seed, and the number of trials.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Settings {
    pub experiment: Value,
    pub revision: u32,
    pub cells: Vec<CellSettings>,
}

/// Settings and number of trials of a cell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CellSettings {
    pub cell: Map<String, Value>,
    pub trials: u64,
}

impl fmt::Display for CellSettings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_settings(&self.cell, f)
    }
}

impl Settings {
    /// Returns the greatest number of trials of any cell.
    pub fn max_trials(&self) -> u64 {
        self.cells.iter().map(|cell| cell.trials).max().unwrap_or(0)
    }

    /// Returns the name and both values of each setting. Of the cells, only the first that differs is included.
    fn pairs(&self, other: &Self) -> Vec<(String, Value, Value)> {
        let mut pairs = vec![("revision".to_owned(), json!(self.revision), json!(other.revision))];
        match (&self.experiment, &other.experiment) {
            (Value::Object(own), Value::Object(theirs)) => {
                let names: BTreeSet<&String> = own.keys().chain(theirs.keys()).collect();
                let value = |of: &Map<String, Value>, name: &String| {
                    of.get(name).cloned().unwrap_or_default()
                };
                pairs.extend(
                    names
                        .into_iter()
                        .map(|name| (format!("`{name}`"), value(own, name), value(theirs, name))),
                );
            }
            (own, theirs) => pairs.push(("settings".into(), own.clone(), theirs.clone())),
        }
        let trials = [self.max_trials(), other.max_trials()];
        pairs.push(("number of trials".into(), json!(trials[0]), json!(trials[1])));
        let counts = [self.cells.len(), other.cells.len()];
        pairs.push(("number of cells".into(), json!(counts[0]), json!(counts[1])));
        let mut cells = self.cells.iter().zip(&other.cells).enumerate();
        let differing = cells.find_map(|(index, (a, b))| match a.cell == b.cell {
            false => Some((format!("cell {index}"), json!(a.cell), json!(b.cell))),
            true if trials[0] == trials[1] && a.trials != b.trials => Some((
                format!("number of trials of the cell `{a}`"),
                json!(a.trials),
                json!(b.trials),
            )),
            true => None,
        });
        pairs.extend(differing);
        pairs
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

    /// Returns the journal's first line.
    fn line(&self, path: &Path) -> Result<Vec<u8>, FileError> {
        let line = serde_json::to_vec(self);
        let mut line = line.map_err(|error| FileError::io("write", path)(error.into()))?;
        line.push(b'\n');
        Ok(line)
    }

    /// Returns why this journal's trials cannot be used for `wanted`; `None` if they can. `wanted` may have more
    /// trials.
    fn mismatch(&self, wanted: &Self) -> Option<String> {
        if self.shard != wanted.shard {
            let [index, of] = self.shard;
            return Some(format!("it holds trials of shard {}/{of}", index.saturating_add(1)));
        }
        let mut more = self.clone();
        for (held, wanted) in more.settings.cells.iter_mut().zip(&wanted.settings.cells) {
            held.trials = held.trials.max(wanted.trials);
        }
        let differences = more.differences(wanted, &["the folder".into(), "this run".into()])?;
        Some(format!("it does not fit this run: {differences}"))
    }

    /// Lists the settings that differ from those of `other`, with both values; `None` if all are equal. The shard is
    /// not compared. `places` are the names of the two folders.
    pub fn differences(&self, other: &Self, places: &[String; 2]) -> Option<String> {
        let mut pairs: Vec<(String, Value, Value)> =
            vec![("experiment".into(), json!(self.experiment), json!(other.experiment))];
        if self.experiment == other.experiment {
            // Settings of different experiments would only be noise.
            pairs.push(("seed".into(), json!(self.seed), json!(other.seed)));
            pairs.extend(self.settings.pairs(&other.settings));
            pairs.push(("length of an outcome".into(), json!(self.width), json!(other.width)));
        }
        let [one, two] = places;
        let differing: Vec<String> = pairs
            .iter()
            .filter(|(_, a, b)| a != b)
            .map(|(name, a, b)| format!("{name} is {a} in {one} and {b} in {two}"))
            .collect();
        (!differing.is_empty()).then(|| differing.join("; "))
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
    /// Length of the header and all complete records, in bytes.
    complete: u64,
    /// Bytes of an incomplete record at the end.
    pub torn: usize,
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

/// Reads a journal. `advice` tells the user what to do with a file that is not a journal.
pub(super) fn read(path: &Path, advice: &str) -> Result<Contents, TaskError> {
    let bytes = read_regular_file(path, Limit::JOURNAL)?;
    let bad = |why: String| {
        let problem = format!("the first line is not that of a journal of trials ({why})");
        fault(path, problem, format!("a journal of trials; {advice}"))
    };
    let end = bytes.iter().position(|b| *b == b'\n');
    let end = end.ok_or_else(|| bad("the file has no line break".into()))?;
    if end > MAX_HEADER {
        return Err(bad(format!("it has {end} bytes; expected at most {MAX_HEADER}")));
    }
    let header: Header = serde_json::from_slice(&bytes[..end]).map_err(|e| bad(e.to_string()))?;
    let usable = (1..=MAX_READINGS).contains(&header.width);
    if header.format != FORMAT || header.version != VERSION || !usable {
        let problem = format!("the file is a {} of version {}", header.format, header.version);
        return Err(fault(path, problem, format!("a {FORMAT} of version {VERSION}")));
    }
    let start = end + 1;
    let each = length(header.width);
    let chunks = bytes[start..].chunks_exact(each);
    let torn = chunks.remainder().len();
    let count = chunks.len();
    let records: Vec<Record> = chunks.filter_map(Record::from_bytes).collect();
    let damaged = (count - records.len()) * each;
    let complete = (start + count * each) as u64;
    Ok(Contents { header, records, damaged, complete, torn })
}

/// A journal that is open for further trials.
#[derive(Debug)]
pub(super) struct Journal {
    file: File,
    path: PathBuf,
    width: usize,
    /// Offset of the end of the last complete record, in bytes.
    complete: u64,
    /// Whether the last record was written only in part. Nothing may follow it.
    torn: bool,
}

impl Journal {
    /// Opens or creates the journal at `path` for trials of `header`, and returns it with the trials that it holds. An
    /// existing journal may have been created for fewer trials. With `salvage`, damaged records are dropped; without
    /// it, they are an error. The caller holds the lock of the journal's folder.
    pub fn open(
        path: &Path,
        header: &Header,
        salvage: bool,
    ) -> Result<(Self, Vec<Record>), TaskError> {
        if !path.exists() {
            write_atomic(path, header.line(path)?, Overwrite::Never)?;
        }
        let failed = FileError::io("write", path);
        let mut file = OpenOptions::new().read(true).write(true).open(path).map_err(&failed)?;
        let contents = read(path, "--force starts again")?;
        if let Some(problem) = contents.header.mismatch(header) {
            return Err(fault(path, problem, "another folder; --force starts again"));
        }
        let more = contents.header != *header;
        if contents.damaged == 0 && more || contents.damaged > 0 && salvage {
            write(path, header, &contents.records, Overwrite::Allowed)?;
            return Self::open(path, header, false);
        }
        if contents.damaged > 0 {
            let (damaged, intact) = (contents.damaged, contents.records.len());
            let problem = format!("{damaged} bytes are damaged and {intact} trials are intact");
            let expected =
                "an undamaged journal; --salvage keeps the intact trials and reruns the others";
            return Err(fault(path, problem, expected));
        }
        file.set_len(contents.complete).map_err(&failed)?;
        file.seek(SeekFrom::End(0)).map_err(&failed)?;
        let (path, width, complete) = (path.into(), header.width, contents.complete);
        Ok((Self { file, path, width, complete, torn: false }, contents.records))
    }

    /// Appends a finished trial. After a failure nothing more is appended, because a record after an incomplete record
    /// could not be found again.
    pub fn append(&mut self, record: Record) -> Result<(), FileError> {
        let failed = FileError::io("write", &self.path);
        if self.torn {
            let source = std::io::Error::other("an earlier trial could not be written");
            return Err(failed(source));
        }
        // A deleted file takes all bytes, and nothing is kept.
        if !self.path.exists() {
            let source =
                std::io::Error::other("it was deleted while the trials ran, so they are lost");
            return Err(failed(source));
        }
        let bytes = record.to_bytes(self.width);
        self.file.write_all(&bytes).map_err(|source| {
            self.torn = true;
            // If truncating fails too, an incomplete record remains at the end, as after a kill.
            let _ = self.file.set_len(self.complete);
            failed(source)
        })?;
        self.complete += bytes.len() as u64;
        Ok(())
    }
}

/// Writes a whole journal with these trials.
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
