//! Merging the shards of an experiment.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::journal::{self, Contents, Header, Record};
use super::run::{JOURNAL, Run};
use super::{Results, Shard, TrialOutcome};
use crate::files::Overwrite;
use crate::sim::Seed;
use crate::task::TaskError;
use crate::task::event::Observer;

/// What to do with a shard whose journal is not a journal.
pub(super) const SHARD_ADVICE: &str =
    "rerun this shard with `symbolt experiment --shard I/N --force`";
/// What to do with a shard whose journal is damaged.
const DAMAGE_ADVICE: &str =
    "rerun this shard with `symbolt experiment --shard I/N --salvage`, which keeps the intact ones";

/// The run to which a folder's trials belong, as recorded in its journal.
#[derive(Debug, Clone, PartialEq)]
pub struct Origin {
    /// Name of the experiment.
    pub experiment: String,
    /// Seed of the run.
    pub seed: Seed,
    /// Number of trials of each cell, over all shards.
    pub trials: u64,
    /// The experiment's settings ([`About::settings`](super::About::settings)).
    pub settings: Value,
}

impl Origin {
    /// Reads the journal in `folder`.
    ///
    /// # Errors
    /// [`TaskError::File`] if there is no journal or it cannot be read; [`TaskError::Input`] if its first line is not a
    /// journal's.
    pub fn read(folder: &Path) -> Result<Self, TaskError> {
        let header = journal::read(&folder.join(JOURNAL), SHARD_ADVICE)?.header;
        let trials = header.settings.max_trials();
        let (experiment, settings) = (header.experiment, header.settings.experiment);
        Ok(Self { experiment, seed: Seed::new(header.seed), trials, settings })
    }
}

impl Run<'_> {
    /// Merges the shards in `folders` into this run's folder and returns the table. Trials that this run's folder
    /// already holds are replaced only if `overwrite` allows it. The run's own shard is ignored.
    ///
    /// # Errors
    /// [`TaskError::Input`] if the journal of a shard cannot be read. [`TaskError::Merge`] if trials are damaged or
    /// missing, if two shards contradict each other, or if the experiment, the seed or a setting differs between two
    /// folders or between a folder and this run; the message names each difference. [`TaskError::File`] if a file
    /// cannot be read or written.
    pub fn merge(
        mut self,
        folders: &[PathBuf],
        overwrite: Overwrite,
        observer: &mut dyn Observer,
    ) -> Result<Results, TaskError> {
        self.shard = Shard::default();
        let whole = self;
        if overwrite == Overwrite::Never {
            whole.refuse_foreign()?;
        }
        let shards = whole.shards(folders)?;
        let mut records: Vec<Record> =
            shards.iter().flat_map(|(_, contents)| &contents.records).copied().collect();
        records.sort_by_key(|record| (record.cell, record.trial));
        let refused = |reason| TaskError::Merge { folder: whole.folder.path().into(), reason };
        if let Some(record) = contradiction(&records) {
            let trial = record.trial;
            let cell = whole.cells.get(record.cell as usize).map(ToString::to_string);
            let cell = cell.unwrap_or_default();
            let reason = format!(
                "trial {trial} of the cell `{cell}` has different outcomes in two of the folders"
            );
            return Err(refused(reason));
        }
        let outcomes = whole.outcomes(&records);
        if let Some(reason) = missing(&outcomes, whole.trials(), &shards) {
            return Err(refused(reason));
        }
        whole.warn(observer);
        let trials = |cell: u32| whole.cells.get(cell as usize).map_or(0, |cell| cell.trials);
        records.dedup_by_key(|record| (record.cell, record.trial));
        records.retain(|record| record.trial < trials(record.cell));
        journal::write(&whole.journal(), &whole.header(), &records, overwrite)?;
        let results = whole.results(&outcomes);
        whole.write(&results)?;
        Ok(results)
    }

    /// Reads the journals of all shards and checks that they belong together and to this run.
    fn shards<'f>(&self, folders: &'f [PathBuf]) -> Result<Vec<(&'f Path, Contents)>, TaskError> {
        let (mut shards, mut trials): (Vec<(&Path, Contents)>, usize) = (Vec::new(), 0);
        for folder in folders {
            let contents = journal::read(&folder.join(JOURNAL), SHARD_ADVICE)?;
            let refused = |reason| Err(TaskError::Merge { folder: folder.clone(), reason });
            if contents.damaged > 0 {
                let damaged = contents.damaged;
                return refused(format!(
                    "{damaged} bytes of its trials are damaged; {DAMAGE_ADVICE}"
                ));
            }
            if let Some((first, held)) = shards.first() {
                belong_together((first, &held.header), (folder, &contents.header))?;
            }
            trials += contents.records.len();
            if trials > MAX_TRIALS_READ {
                let reason = format!(
                    "it and the folders before it hold {trials} trials; expected at most {MAX_TRIALS_READ}"
                );
                return refused(reason);
            }
            shards.push((folder.as_path(), contents));
        }
        // This check comes last, because a difference between two folders helps the reader more.
        if let Some((first, held)) = shards.first() {
            let places = [first.display().to_string(), "this merge".into()];
            if let Some(differences) = held.header.differences(&self.header(), &places) {
                let reason = format!("it does not fit this merge: {differences}");
                return Err(TaskError::Merge { folder: first.into(), reason });
            }
        }
        Ok(shards)
    }
}

/// Refuses a folder with trials of another run than the first one's.
pub(super) fn belong_together(
    (first, held): (&Path, &Header),
    (folder, other): (&Path, &Header),
) -> Result<(), TaskError> {
    let places = [first, folder].map(|folder| folder.display().to_string());
    let Some(differences) = held.differences(other, &places) else { return Ok(()) };
    let reason = format!("it does not belong with {}: {differences}", places[0]);
    Err(TaskError::Merge { folder: folder.into(), reason })
}

/// Greatest number of trials in all shards, of 80 bytes each in memory.
pub(super) const MAX_TRIALS_READ: usize = 4_000_000;

/// Returns a sentence on the number of missing trials and their shards; `None` if no trial is missing.
fn missing(
    outcomes: &[Vec<Option<TrialOutcome>>],
    all: u64,
    shards: &[(&Path, Contents)],
) -> Option<String> {
    let without = outcomes.iter().flat_map(|cell| {
        cell.iter().enumerate().filter(|(_, o)| o.is_none()).map(|(trial, _)| trial as u64)
    });
    let count = without.clone().count();
    if count == 0 {
        return None;
    }
    let mut reason = format!("{count} of {all} trials are in none of the folders");
    // Shards of different partitions have no common name for a missing part.
    let of = shards.first().map_or(1, |(_, contents)| contents.header.shard[1]).max(1);
    if shards.iter().any(|(_, contents)| contents.header.shard[1] != of) {
        return Some(reason);
    }
    let parts: BTreeSet<u64> = without.map(|trial| trial % of).collect();
    for part in parts.iter().take(5) {
        let name = format!("shard {}/{of}", part + 1);
        let folder = shards.iter().find(|(_, contents)| contents.header.shard[0] == *part);
        reason += &match folder {
            Some((folder, _)) => format!("; {name} in {} is unfinished", folder.display()),
            None => format!("; {name} was not given"),
        };
    }
    if parts.len() > 5 {
        reason += &format!("; and {} more", parts.len() - 5);
    }
    Some(reason)
}

/// Finds a trial with two outcomes. The records are sorted by cell and trial. A trial has the same outcome, bit for
/// bit, on every machine.
fn contradiction(records: &[Record]) -> Option<&Record> {
    let bits = |record: &Record| record.outcome.map(f64::to_bits);
    let contradict = |pair: &&[Record]| {
        let same = pair[0].cell == pair[1].cell && pair[0].trial == pair[1].trial;
        same && bits(&pair[0]) != bits(&pair[1])
    };
    records.windows(2).find(contradict).and_then(|pair| pair.first())
}
