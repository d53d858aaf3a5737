//! Putting shards together.

use std::path::PathBuf;

use super::journal::{self, Record};
use super::run::{JOURNAL, Run, Shard};
use super::{Results, TrialOutcome};
use crate::files::Overwrite;
use crate::task::TaskError;
use crate::task::event::Observer;

impl Run<'_> {
    /// Puts the shards in `folders` together in this run's folder, and returns the table. Trials that the folder
    /// already holds are replaced only if `overwrite` allows it. The run's own shard does not matter.
    ///
    /// # Errors
    /// [`TaskError::Input`] if the journal of a shard cannot be read; [`TaskError::Merge`] if its trials are damaged or
    /// belong to another experiment, seed or settings, if two shards contradict one another, or if trials are missing;
    /// [`TaskError::File`].
    pub fn merge(
        mut self,
        folders: &[PathBuf],
        overwrite: Overwrite,
        observer: &mut dyn Observer,
    ) -> Result<Results, TaskError> {
        self.shard = Shard::default();
        let whole = self;
        let records = whole.shards(folders)?;
        let refused = |reason| TaskError::Merge { folder: whole.folder.clone(), reason };
        if let Some(record) = contradiction(&records) {
            let Record { cell, trial, .. } = record;
            let reason = format!(
                "trial {trial} of cell {cell} has different outcomes in two of the folders"
            );
            return Err(refused(reason));
        }
        let outcomes = whole.outcomes(&records);
        let missing = outcomes.iter().flatten().filter(|o| o.is_none()).count();
        if missing > 0 {
            let all = whole.trials();
            return Err(refused(format!("{missing} of {all} trials are in none of the folders")));
        }
        let _lock = whole.lock(observer)?;
        let sorted = in_order(&outcomes);
        journal::write(&whole.journal(), &whole.header(), &sorted, overwrite)?;
        let results = whole.results(&outcomes);
        whole.write(&results)?;
        Ok(results)
    }

    /// The trials of all shards, sorted by cell and trial.
    fn shards(&self, folders: &[PathBuf]) -> Result<Vec<Record>, TaskError> {
        let mut records = Vec::new();
        for folder in folders {
            let contents = journal::read(&folder.join(JOURNAL))?;
            let [index, of] = contents.header.shard;
            let shard = Shard { index, of };
            let wanted = Run::new(self.experiment, self.seed, shard, folder).header();
            let refused = |reason| Err(TaskError::Merge { folder: folder.clone(), reason });
            if contents.header != wanted {
                return refused(
                    "its trials are of another experiment, seed, settings or number".into(),
                );
            }
            if contents.damaged > 0 {
                return refused(format!("{} bytes of its trials are damaged", contents.damaged));
            }
            records.extend(contents.records);
        }
        records.sort_by_key(|record| (record.cell, record.trial));
        Ok(records)
    }
}

/// A trial with two outcomes: the same trial gives the same bits on every machine. The records are sorted.
fn contradiction(records: &[Record]) -> Option<&Record> {
    let bits = |record: &Record| record.outcome.map(f64::to_bits);
    let contradict = |pair: &&[Record]| {
        let same = pair[0].cell == pair[1].cell && pair[0].trial == pair[1].trial;
        same && bits(&pair[0]) != bits(&pair[1])
    };
    records.windows(2).find(contradict).and_then(|pair| pair.first())
}

/// The finished trials as records, cell by cell.
fn in_order(outcomes: &[Vec<Option<TrialOutcome>>]) -> Vec<Record> {
    let mut records = Vec::new();
    for (cell, outcomes) in outcomes.iter().enumerate() {
        for (trial, outcome) in outcomes.iter().enumerate() {
            if let Some(outcome) = outcome {
                let (cell, trial) = (cell as u32, trial as u64);
                records.push(Record { cell, trial, outcome: *outcome });
            }
        }
    }
    records
}
