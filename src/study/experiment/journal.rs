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

    /// Trials of each cell, and the settings without them.
    fn parted(&self) -> (Vec<u64>, Value) {
        let mut settings = self.settings.clone();
        let cells = settings.get_mut("cells").and_then(Value::as_array_mut);
        let trials = cells.into_iter().flatten().filter_map(|cell| cell.get_mut("trials"));
        let trials = trials.map(|trials| trials.take().as_u64().unwrap_or_default()).collect();
        (trials, settings)
    }

    /// What of this is not as in `wanted`, in words; `None` if all is, or if only more trials are wanted.
    fn differs(&self, wanted: &Self) -> Option<String> {
        let of = |it: &Self| (it.experiment.clone(), it.seed, it.shard, it.width, it.parted());
        let (name, seed, [index, shards], width, (trials, settings)) = of(self);
        let (name_wanted, seed_wanted, shard_wanted, width_wanted, (more, settings_wanted)) =
            of(wanted);
        let most = |of: &[u64]| of.iter().copied().max().unwrap_or(0);
        if name != name_wanted {
            Some(format!("it holds trials of `{name}`, not of `{name_wanted}`"))
        } else if seed != seed_wanted {
            Some(format!("it holds trials of the seed {seed}, not of {seed_wanted}"))
        } else if [index, shards] != shard_wanted {
            Some(format!("it holds trials of shard {}/{shards}", index.saturating_add(1)))
        } else if settings != settings_wanted || width != width_wanted {
            Some("it holds trials of other settings, or of another version of the program".into())
        } else if trials.iter().zip(&more).any(|(held, wanted)| held > wanted) {
            let (held, wanted) = (most(&trials), most(&more));
            Some(format!("it holds {held} trials a cell, and {wanted} are asked for"))
        } else {
            None
        }
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
    move |source| FileError::Io { what, path: path.into(), source }.into()
}

/// Reads a journal.
pub(super) fn read(path: &Path) -> Result<Contents, TaskError> {
    let mut bytes = Vec::new();
    File::open(path)
        .and_then(|mut file| file.read_to_end(&mut bytes))
        .map_err(failed("read", path))?;
    let bad = |why: String| {
        fault(path, format!("its first line is not a journal's ({why})"), "a journal, or --force")
    };
    let end = bytes.iter().position(|b| *b == b'\n').ok_or_else(|| bad("it has no end".into()))?;
    let header: Header = serde_json::from_slice(&bytes[..end]).map_err(|e| bad(e.to_string()))?;
    if header.format != FORMAT || header.version != VERSION || header.width > WIDTH {
        let problem = format!("it is a {} of version {}", header.format, header.version);
        return Err(fault(path, problem, format!("{FORMAT} of version {VERSION}")));
    }
    let start = end + 1;
    let each = length(header.width);
    let whole = bytes[start..].chunks_exact(each);
    let count = whole.len();
    let records: Vec<Record> = whole.filter_map(Record::from_bytes).collect();
    let damaged = (count - records.len()) * each;
    let whole = (start + count * each) as u64;
    Ok(Contents { header, records, damaged, whole })
}

/// A folder's lock: who has it is the only one that changes the folder's journal. It ends with its holder.
#[derive(Debug)]
pub(super) struct Lock {
    _file: File,
}

impl Lock {
    /// Takes the lock of a folder, making the folder if there is none.
    pub fn take(folder: &Path) -> Result<Self, TaskError> {
        std::fs::create_dir_all(folder).map_err(failed("make", folder))?;
        let path = folder.join(".lock");
        let mut options = OpenOptions::new();
        let file = options.write(true).create(true).truncate(false).open(&path);
        let file = file.map_err(failed("write", folder))?;
        match file.try_lock() {
            Ok(()) => Ok(Self { _file: file }),
            Err(TryLockError::WouldBlock) => {
                let source = std::io::Error::other("another run works in it");
                Err(failed("write", folder)(source))
            }
            Err(TryLockError::Error(source)) => Err(failed("write", &path)(source)),
        }
    }
}

/// A journal open for more trials.
#[derive(Debug)]
pub(super) struct Journal {
    file: File,
    path: PathBuf,
    width: usize,
    /// Where the last whole record ends.
    whole: u64,
    /// Whether a record was written in part: nothing may follow it.
    torn: bool,
    _lock: Lock,
}

impl Journal {
    /// Opens the journal at `path` for trials of `header`, or begins it; what it holds already. It may have been begun
    /// for fewer trials. Damaged records are dropped if it is to `salvage`, else refused. The lock is that of the
    /// folder.
    pub fn open(
        path: &Path,
        header: &Header,
        salvage: bool,
        lock: Lock,
    ) -> Result<(Self, Vec<Record>), TaskError> {
        if !path.exists() {
            let mut line = serde_json::to_vec(header).unwrap_or_default();
            line.push(b'\n');
            write_atomic(path, &line, Overwrite::Never)?;
        }
        let mut file =
            OpenOptions::new().read(true).write(true).open(path).map_err(failed("write", path))?;
        let contents = read(path)?;
        if let Some(problem) = contents.header.differs(header) {
            return Err(fault(path, problem, "another folder, or --force to begin anew"));
        }
        let more = contents.header != *header;
        if contents.damaged == 0 && more || contents.damaged > 0 && salvage {
            write(path, header, &contents.records, Overwrite::Allowed)?;
            return Self::open(path, header, false, lock);
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
        let (width, whole) = (header.width, contents.whole);
        let path = path.into();
        Ok((Self { file, path, width, whole, torn: false, _lock: lock }, contents.records))
    }

    /// Appends a finished trial. Once that has failed, nothing more is appended: a record behind a torn one could
    /// not be found again.
    pub fn append(&mut self, record: Record) -> Result<(), TaskError> {
        if self.torn {
            let source = std::io::Error::other("an earlier trial could not be written");
            return Err(failed("write", &self.path)(source));
        }
        let bytes = record.to_bytes(self.width);
        self.file.write_all(&bytes).map_err(|source| {
            self.torn = true;
            // What is left if this fails too is a piece of a record at the end, as after a kill.
            let _ = self.file.set_len(self.whole);
            failed("write", &self.path)(source)
        })?;
        self.whole += bytes.len() as u64;
        Ok(())
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
    Ok(write_atomic(path, &bytes, overwrite)?)
}
