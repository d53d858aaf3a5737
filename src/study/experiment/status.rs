//! Which trials of a sharded experiment are done. Nothing is locked or written, so shards may still be running.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};

use super::journal::{self, CellSettings, Contents};
use super::merge::{MAX_TRIALS_READ, SHARD_ADVICE, belong_together};
use super::run::JOURNAL;
use super::{Cell, MAX_TRIALS, Shard, write_settings};
use crate::files::FileError;
use crate::sim::Seed;
use crate::task::TaskError;

/// The state of a shard or of a folder.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ShardState {
    /// All trials are done.
    Complete,
    /// Trials are missing: the shard runs, waits or was killed.
    Unfinished,
    /// Some records have a wrong checksum. Their trials count as missing.
    Damaged,
    /// The folder's journal cannot be read.
    Unreadable,
    /// There is no folder, or no journal in it.
    #[default]
    Absent,
}

impl ShardState {
    /// Returns the state's name, such as `unfinished`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Complete => "complete",
            Self::Unfinished => "unfinished",
            Self::Damaged => "damaged",
            Self::Unreadable => "unreadable",
            Self::Absent => "absent",
        }
    }
}

/// Missing trials of a cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Missing {
    /// Index of the cell.
    pub cell: usize,
    /// Numbers of the trials, counted from 0, in ascending order; never empty.
    pub trials: Vec<u64>,
}

/// A shard, or a folder whose shard is not known.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ShardStatus {
    /// The shard; `None` for a folder without a readable journal whose name does not end in `-I-of-N`.
    pub shard: Option<Shard>,
    /// Its folder; `None` if none of the folders given is that of this shard.
    pub folder: Option<PathBuf>,
    /// Its state.
    pub state: ShardState,
    /// Number of its trials that are done, in any folder.
    pub done: u64,
    /// Number of its trials.
    pub trials: u64,
    /// Its missing trials.
    pub missing: Vec<Missing>,
    /// Bytes of an incomplete record at the end of the journal, as a kill leaves it. It is no damage.
    pub torn_bytes: usize,
    /// Bytes of records with a wrong checksum.
    pub damaged_bytes: usize,
    /// Why the journal cannot be read.
    pub reason: Option<String>,
}

impl ShardStatus {
    /// Returns whether a merge needs this shard to run once more: trials are missing, or its folder cannot be read.
    fn must_run(&self) -> bool {
        self.done < self.trials
            || match self.state {
                ShardState::Damaged | ShardState::Unreadable => true,
                ShardState::Absent => self.folder.is_some(),
                ShardState::Complete | ShardState::Unfinished => false,
            }
    }
}

/// The trials of a cell, over all shards.
#[derive(Debug, Clone, PartialEq)]
pub struct CellStatus {
    /// Settings by name.
    pub settings: Map<String, Value>,
    /// Number of trials that are done.
    pub done: u64,
    /// Number of trials.
    pub trials: u64,
    /// Numbers of the missing trials, counted from 0, in ascending order.
    pub missing: Vec<u64>,
}

impl std::fmt::Display for CellStatus {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write_settings(&self.settings, f)
    }
}

/// Which trials of an experiment's shards are done.
#[derive(Debug, Clone, PartialEq)]
pub struct Status {
    /// Name of the experiment.
    pub experiment: String,
    /// Seed of the run.
    pub seed: Seed,
    /// The shards in order, then the folders whose shard is not known.
    pub shards: Vec<ShardStatus>,
    /// All cells in order.
    pub cells: Vec<CellStatus>,
}

/// What is expected if no folder holds a journal yet.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Seed of the run.
    pub seed: Seed,
    /// Number of trials of every cell; `None` for each cell's own.
    pub trials: Option<u64>,
    /// Cells of the experiment.
    pub cells: Vec<Cell>,
}

/// The content of a folder.
enum Found {
    Journal(Box<Contents>),
    Unreadable(String),
    Absent,
}

impl Status {
    /// Reads the journals in `folders`, of the experiment with this name. The folders may be absent, and runs may be
    /// writing to them. Number of trials and shards come from the journals. `plan` is called if there is none; the
    /// number of shards then comes from the folders' names, as in `table-4-2-of-8`.
    ///
    /// # Errors
    /// [`TaskError::Merge`] if the folders do not belong together, or if they list too many trials; errors of `plan`.
    pub fn read(
        experiment: &str,
        folders: &[PathBuf],
        plan: impl FnOnce() -> Result<Plan, TaskError>,
    ) -> Result<Self, TaskError> {
        let found: Vec<(&Path, Found)> =
            folders.iter().map(|folder| (folder.as_path(), find(folder))).collect();
        let first = found.iter().find_map(|(folder, found)| match found {
            Found::Journal(contents) => Some((*folder, &contents.header)),
            _ => None,
        });
        let (seed, cells) = match first {
            Some((_, header)) => (Seed::new(header.seed), header.settings.cells.clone()),
            None => {
                let Plan { seed, trials, cells } = plan()?;
                let cell = |Cell { settings: cell, trials: own, .. }| CellSettings {
                    cell,
                    trials: trials.unwrap_or(own),
                };
                (seed, cells.into_iter().map(cell).collect())
            }
        };
        let refused = |folder: &Path, reason| TaskError::Merge { folder: folder.into(), reason };
        if let Some((folder, header)) = first {
            if header.experiment != experiment {
                let reason =
                    format!("its experiment is `{}`; expected `{experiment}`", header.experiment);
                return Err(refused(folder, reason));
            }
            let trials = cells.iter().fold(0, |sum: u64, cell| sum.saturating_add(cell.trials));
            let most = cells.iter().map(|cell| cell.trials).max().unwrap_or(0);
            if trials > MAX_TRIALS_READ as u64 || most > MAX_TRIALS {
                let reason = format!(
                    "it lists {trials} trials and {most} of one cell; expected at most {MAX_TRIALS_READ} and \
                     {MAX_TRIALS}"
                );
                return Err(refused(folder, reason));
            }
            for (other, contents) in journals(&found) {
                belong_together((folder, header), (other, &contents.header))?;
            }
        }
        let mut done: Vec<Vec<bool>> =
            cells.iter().map(|cell| vec![false; cell.trials as usize]).collect();
        for record in journals(&found).flat_map(|(_, contents)| &contents.records) {
            let cell = done.get_mut(record.cell as usize);
            if let Some(slot) = cell.and_then(|cell| cell.get_mut(record.trial as usize)) {
                *slot = true;
            }
        }
        let shards = shards(&found, &done);
        let cells = cells.into_iter().zip(&done).map(|(cell, done)| {
            let missing = missing(done, Shard::default());
            let trials = cell.trials;
            CellStatus { settings: cell.cell, done: trials - missing.len() as u64, trials, missing }
        });
        Ok(Self { experiment: experiment.into(), seed, shards, cells: cells.collect() })
    }

    /// Returns the number of trials, over all shards.
    pub fn trials(&self) -> u64 {
        self.cells.iter().map(|cell| cell.trials).sum()
    }

    /// Returns the number of trials that are done.
    pub fn done(&self) -> u64 {
        self.cells.iter().map(|cell| cell.done).sum()
    }

    /// Returns whether the shards can be merged: no trial is missing and no journal is damaged or unreadable.
    pub fn is_complete(&self) -> bool {
        self.done() == self.trials() && !self.shards.iter().any(ShardStatus::must_run)
    }

    /// Returns the numbers, counted from 1, of the shards that have to run again, in order. `None` if the shards do not
    /// have a common number.
    pub fn rerun(&self) -> Option<Vec<u64>> {
        let shards: Vec<Shard> = self.shards.iter().filter_map(|shard| shard.shard).collect();
        let of = shards.first()?.of;
        if shards.iter().any(|shard| shard.of != of) {
            return None;
        }
        let again = self.shards.iter().filter(|shard| shard.must_run());
        let again = again.filter_map(|shard| Some(shard.shard?.index.saturating_add(1)));
        let mut again: Vec<u64> = again.collect();
        again.dedup();
        Some(again)
    }

    /// Returns the status as a JSON object.
    pub fn to_json(&self) -> Value {
        let cells = self.cells.iter().map(|cell| {
            json!({
                "cell": cell.settings, "done": cell.done, "trials": cell.trials, "missing": cell.missing,
            })
        });
        let shards = self.shards.iter().map(|shard| {
            let missing = shard.missing.iter().map(|missing| {
                let settings = self.cells.get(missing.cell).map(|cell| &cell.settings);
                json!({"cell": settings, "trials": missing.trials})
            });
            let mut value = json!({
                "shard": shard.shard.map(|shard| [shard.index.saturating_add(1), shard.of]),
                "folder": shard.folder.as_ref().map(|folder| folder.display().to_string()),
                "state": shard.state.name(), "done": shard.done, "trials": shard.trials,
                "missing": missing.collect::<Vec<_>>(),
                "torn_bytes": shard.torn_bytes, "damaged_bytes": shard.damaged_bytes,
            });
            if let Some(reason) = &shard.reason {
                value["reason"] = json!(reason);
            }
            value
        });
        json!({
            "name": self.experiment, "seed": self.seed.value(), "complete": self.is_complete(),
            "done": self.done(), "trials": self.trials(), "rerun": self.rerun(),
            "shards": shards.collect::<Vec<_>>(), "cells": cells.collect::<Vec<_>>(),
        })
    }
}

fn find(folder: &Path) -> Found {
    match journal::read(&folder.join(JOURNAL), SHARD_ADVICE) {
        Ok(contents) if contents.header.shard[0] >= contents.header.shard[1] => {
            let [index, of] = contents.header.shard;
            Found::Unreadable(format!("its first line names part {index} of {of}, counted from 0"))
        }
        Ok(contents) => Found::Journal(Box::new(contents)),
        Err(TaskError::File(FileError::Io { source, .. }))
            if source.kind() == std::io::ErrorKind::NotFound =>
        {
            Found::Absent
        }
        Err(error) => Found::Unreadable(error.to_string()),
    }
}

fn journals<'f>(found: &'f [(&'f Path, Found)]) -> impl Iterator<Item = (&'f Path, &'f Contents)> {
    found.iter().filter_map(|(folder, found)| match found {
        Found::Journal(contents) => Some((*folder, &**contents)),
        _ => None,
    })
}

/// Returns the shard that a folder is named after, as `experiment` names its default folders: `table-4-2-of-8`.
fn named(folder: &Path) -> Option<Shard> {
    let (rest, of) = folder.file_name()?.to_str()?.rsplit_once("-of-")?;
    let (_, index) = rest.rsplit_once('-')?;
    format!("{index}/{of}").parse().ok()
}

/// Returns the numbers of a cell's trials that belong to a shard and are not done.
fn missing(done: &[bool], shard: Shard) -> Vec<u64> {
    own(done.len(), shard).filter(|trial| !done[*trial as usize]).collect()
}

fn own(trials: usize, shard: Shard) -> impl Iterator<Item = u64> {
    let step = usize::try_from(shard.of).unwrap_or(usize::MAX).max(1);
    (shard.index..trials as u64).step_by(step)
}

/// Lists the shards and the folders whose shard is not known.
fn shards(found: &[(&Path, Found)], done: &[Vec<bool>]) -> Vec<ShardStatus> {
    let most = done.iter().map(Vec::len).max().unwrap_or(0) as u64;
    let of_folder = |folder: &Path, found: &Found| match found {
        Found::Journal(contents) => {
            let [index, of] = contents.header.shard;
            Some(Shard { index, of })
        }
        _ => named(folder),
    };
    let mut known: BTreeMap<(u64, u64), Vec<ShardStatus>> = BTreeMap::new();
    let mut unknown = Vec::new();
    for (folder, found) in found {
        let shard = of_folder(folder, found);
        let mut status = of_shard(shard, done);
        status.folder = Some((*folder).into());
        match found {
            Found::Absent => {}
            Found::Unreadable(reason) => {
                status.state = ShardState::Unreadable;
                status.reason = Some(reason.clone());
            }
            Found::Journal(contents) => {
                (status.torn_bytes, status.damaged_bytes) = (contents.torn, contents.damaged);
                status.state = match (contents.damaged, status.missing.is_empty()) {
                    (0, true) => ShardState::Complete,
                    (0, false) => ShardState::Unfinished,
                    _ => ShardState::Damaged,
                };
            }
        }
        match shard {
            Some(shard) => known.entry((shard.of, shard.index)).or_default().push(status),
            None => unknown.push(status),
        }
    }
    // Shards of one number complete each other. Without a common number nothing tells which others there are.
    let mut numbers = known.keys().map(|(of, _)| *of);
    let common = numbers.next().filter(|of| numbers.all(|other| other == *of));
    for index in 0..common.unwrap_or(0).min(most) {
        let of = common.unwrap_or(1);
        known.entry((of, index)).or_insert_with(|| vec![of_shard(Some(Shard { index, of }), done)]);
    }
    known.into_values().flatten().chain(unknown).collect()
}

/// Returns the status of a shard whose folder is absent.
fn of_shard(shard: Option<Shard>, done: &[Vec<bool>]) -> ShardStatus {
    let mut status = ShardStatus { shard, ..ShardStatus::default() };
    let Some(shard) = shard else { return status };
    for (cell, done) in done.iter().enumerate() {
        let trials = missing(done, shard);
        let own = own(done.len(), shard).count() as u64;
        status.trials += own;
        status.done += own - trials.len() as u64;
        if !trials.is_empty() {
            status.missing.push(Missing { cell, trials });
        }
    }
    status
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_named_after_its_shard() {
        let shard = |name: &str| named(Path::new(name)).map(|shard| shard.to_string());
        assert_eq!(shard("experiments/table-4-2-of-8"), Some("2/8".into()));
        for name in ["table-4", "a-0-of-3", "a-4-of-3", "a-of-3", "2-of-8/x", "", "a-2-of-"] {
            assert_eq!(shard(name), None, "{name}");
        }
    }

    #[test]
    fn a_shard_without_trials_is_nothing_to_wait_for() {
        let done = vec![vec![true, true]];
        let found: [(&Path, Found); 1] = [(Path::new("a-1-of-9"), Found::Absent)];
        let all = shards(&found, &done);
        // Only shards that have trials are listed.
        assert_eq!(all.len(), 2);
        assert!(all.iter().all(|shard| shard.missing.is_empty()));
        // The folder that was given has to be there for a merge; the other shard's trials are done elsewhere.
        let must: Vec<bool> = all.iter().map(ShardStatus::must_run).collect();
        assert_eq!(must, [true, false]);
    }
}
