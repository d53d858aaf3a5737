//! Running an experiment's trials, going on with them, and putting shards together.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;
use serde_json::{Value, json};

use super::journal::{self, Header, Journal, Lock, Record};
use super::{Cell, Experiment, Measure, Outcome, Results, Row, WIDTH};
use crate::files::{FileError, Overwrite, write_atomic};
use crate::sim::Seed;
use crate::study::statistics::{Mean, Rate, Statistic};
use crate::task::TaskError;

/// One part of the trials: those whose number leaves `index` when divided by `of`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Which part, counted from 0.
    pub index: u64,
    /// Of how many.
    pub of: u64,
}

impl Default for Shard {
    fn default() -> Self {
        Self { index: 0, of: 1 }
    }
}

impl FromStr for Shard {
    type Err = TaskError;

    fn from_str(text: &str) -> Result<Self, TaskError> {
        let parts =
            text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        match parts {
            Some((index, of)) if (1..=of).contains(&index) => Ok(Self { index: index - 1, of }),
            _ => Err(TaskError::Setting {
                name: "shard",
                value: text.into(),
                expected: "I/N with I from 1 to N, such as 2/4",
            }),
        }
    }
}

/// An experiment with the folder that its trials and results stand in.
///
/// A folder holds `trials.bin`, the journal, and once all trials are done `results.json`, `results.csv` and, where
/// there is one, `figure.svg`.
pub struct Run<'a> {
    experiment: &'a dyn Experiment,
    cells: Vec<Cell>,
    seed: Seed,
    shard: Shard,
    folder: PathBuf,
    salvage: bool,
    anew: bool,
}

const JOURNAL: &str = "trials.bin";

/// The number of an outcome at a place; NaN where it has none.
fn number(outcome: &Outcome, at: usize) -> f64 {
    outcome.get(at).copied().unwrap_or(f64::NAN)
}

impl<'a> Run<'a> {
    /// Trials of `experiment` in `folder`.
    pub fn new(experiment: &'a dyn Experiment, seed: Seed, shard: Shard, folder: &Path) -> Self {
        let (cells, folder) = (experiment.cells(), folder.into());
        Self { experiment, cells, seed, shard, folder, salvage: false, anew: false }
    }

    /// Whether what is damaged in the journal is dropped, so that its trials are done again, instead of refused.
    pub fn salvaging(mut self, salvage: bool) -> Self {
        self.salvage = salvage;
        self
    }

    /// The number of trials of this shard.
    pub fn trials(&self) -> u64 {
        self.cells.iter().map(|cell| self.own(cell).count() as u64).sum()
    }

    fn own(&self, cell: &Cell) -> impl Iterator<Item = u64> + use<> {
        (self.shard.index..cell.trials).step_by(self.shard.of.max(1) as usize)
    }

    fn header(&self) -> Header {
        let shard = [self.shard.index, self.shard.of];
        let widths = self.cells.iter().map(|cell| cell.readings.len());
        let width = widths.max().unwrap_or(0).min(WIDTH);
        Header::new(self.experiment.name(), self.seed.value(), self.settings(), (shard, width))
    }

    fn settings(&self) -> Value {
        let cells: Vec<Value> = self
            .cells
            .iter()
            .map(|cell| json!({"cell": cell.settings, "trials": cell.trials}))
            .collect();
        json!({
            "experiment": self.experiment.settings(), "revision": self.experiment.revision(),
            "cells": cells,
        })
    }

    fn journal(&self) -> PathBuf {
        self.folder.join(JOURNAL)
    }

    /// Whether the folder's trials are forgotten first.
    pub fn anew(mut self, anew: bool) -> Self {
        self.anew = anew;
        self
    }

    fn forget(&self) -> Result<(), TaskError> {
        for name in [JOURNAL, "results.json", "results.csv", "figure.svg"] {
            let path = self.folder.join(name);
            match std::fs::remove_file(&path) {
                Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
                    return Err(FileError::Io { what: "remove", path, source }.into());
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Does all trials that the journal does not have, on the threads of the pool. `watch` is told how many
    /// are done. Gives the table, and writes it, if this is the only shard.
    ///
    /// # Errors
    /// [`TaskError::Input`] if the journal is damaged or another experiment's, [`TaskError::File`] if it cannot be
    /// written, and whatever a trial fails with. Finished trials are kept.
    pub fn go(&self, watch: &(dyn Fn(u64) + Sync)) -> Result<Option<Results>, TaskError> {
        let lock = Lock::take(&self.folder)?;
        if self.anew {
            self.forget()?;
        }
        let (journal, before) = Journal::open(&self.journal(), &self.header(), self.salvage, lock)?;
        let outcomes = self.outcomes(&before);
        drop(before);
        let mut missing: Vec<(u32, u64)> = Vec::new();
        for (index, cell) in self.cells.iter().enumerate() {
            let cell_outcomes = &outcomes[index];
            missing.extend(
                self.own(cell)
                    .filter(|t| cell_outcomes[*t as usize].is_none())
                    .map(|t| (index as u32, t)),
            );
        }
        // What the cells of a trial share is made once, and threads begin at trials far apart.
        missing.sort_unstable_by_key(|(cell, trial)| (*trial, *cell));
        let done = AtomicU64::new(self.trials() - missing.len() as u64);
        watch(done.load(Ordering::Relaxed));
        let kept = Mutex::new((journal, outcomes));
        // What the first failure brings about elsewhere is not what is told.
        let failure = Mutex::new(None);
        let failed = |error: TaskError| {
            failure.lock().unwrap_or_else(|e| e.into_inner()).get_or_insert(error);
        };
        let tried = missing.par_iter().try_for_each(|(cell, trial)| {
            let seed = self.seed.derive_index("trial", *trial);
            let outcome = self.experiment.trial(*cell as usize, seed).map_err(failed)?;
            let record = Record { cell: *cell, trial: *trial, outcome };
            {
                // A lock that a panic has broken holds a file that is still whole.
                let (journal, outcomes) = &mut *kept.lock().unwrap_or_else(|e| e.into_inner());
                journal.append(record).map_err(failed)?;
                outcomes[*cell as usize][*trial as usize] = Some(outcome);
            }
            watch(done.fetch_add(1, Ordering::Relaxed) + 1);
            Ok::<_, ()>(())
        });
        if let Some(error) = failure.into_inner().unwrap_or_else(|e| e.into_inner()) {
            return Err(error);
        }
        debug_assert!(tried.is_ok(), "every failure is kept");
        let (_, outcomes) = kept.into_inner().unwrap_or_else(|e| e.into_inner());
        if self.shard.of != 1 {
            return Ok(None);
        }
        let results = self.results(&outcomes);
        self.write(&results)?;
        Ok(Some(results))
    }

    fn outcomes(&self, records: &[Record]) -> Vec<Vec<Option<Outcome>>> {
        let mut outcomes: Vec<Vec<Option<Outcome>>> =
            self.cells.iter().map(|cell| vec![None; cell.trials as usize]).collect();
        for record in records {
            let cell = outcomes.get_mut(record.cell as usize);
            if let Some(slot) = cell.and_then(|cell| cell.get_mut(record.trial as usize)) {
                *slot = Some(record.outcome);
            }
        }
        outcomes
    }

    fn results(&self, outcomes: &[Vec<Option<Outcome>>]) -> Results {
        let mut rows = Vec::new();
        for (cell, outcomes) in self.cells.iter().zip(outcomes) {
            for (at, reading) in cell.readings.iter().enumerate().take(WIDTH) {
                let done = outcomes.iter().flatten();
                let values = done.clone().map(|outcome| outcome[at]);
                let statistic = match reading.measure {
                    Measure::Rate => Statistic::Rate(Rate::new(
                        values.clone().filter(|v| *v == 1.0).count() as u64,
                        values.filter(|v| !v.is_nan()).count() as u64,
                    )),
                    Measure::RateWithin(key) => {
                        let mut clusters: BTreeMap<u64, [u64; 2]> = BTreeMap::new();
                        for outcome in done.filter(|outcome| !outcome[at].is_nan()) {
                            let key = number(outcome, key).to_bits();
                            let [own, of] = clusters.entry(key).or_default();
                            (*own, *of) = (*own + u64::from(outcome[at] == 1.0), *of + 1);
                        }
                        Statistic::Rate(Rate::of_clusters(clusters.values().copied()))
                    }
                    Measure::Share(of) => {
                        let cluster =
                            |o: &Outcome| [o[at], number(o, of)].map(|count| count as u64);
                        Statistic::Rate(Rate::of_clusters(done.map(cluster)))
                    }
                    Measure::Mean => Statistic::Mean(Mean::of(values)),
                    Measure::MeanWithin(key) => {
                        Statistic::Mean(Mean::of_clusters(done.map(|o| (number(o, key), o[at]))))
                    }
                    Measure::Difference => Statistic::Mean(Mean::of_differences(values)),
                    Measure::Beside => continue,
                };
                let mut settings = cell.settings.clone();
                settings.extend(reading.settings.clone());
                rows.push(Row { settings, statistic });
            }
        }
        let mut settings = match self.experiment.settings() {
            settings @ Value::Object(_) => settings,
            other => json!({"settings": other}),
        };
        settings["seed"] = json!(self.seed.value());
        settings["trials"] = json!(self.cells.iter().map(|cell| cell.trials).max());
        let (name, question) = (self.experiment.name(), self.experiment.question());
        Results { name, question, settings, rows }
    }

    fn write(&self, results: &Results) -> Result<(), TaskError> {
        let text = format!("{:#}\n", results.to_json());
        write_atomic(&self.folder.join("results.json"), &text, Overwrite::Allowed)?;
        write_atomic(&self.folder.join("results.csv"), results.to_csv(), Overwrite::Allowed)?;
        if let Some(figure) = self.experiment.figure(results) {
            write_atomic(&self.folder.join("figure.svg"), figure.to_svg()?, Overwrite::Allowed)?;
        }
        Ok(())
    }
}

/// Puts the shards in `folders` together in `folder` and gives the table. Trials that `folder` holds already are
/// replaced only if `overwrite` allows it.
///
/// # Errors
/// [`TaskError::Input`] if a folder's trials are not of this experiment with these settings and seed, or are
/// damaged, contradict one another, or some are missing; [`TaskError::File`].
pub fn merge(
    experiment: &dyn Experiment,
    seed: Seed,
    folders: &[PathBuf],
    folder: &Path,
    overwrite: Overwrite,
) -> Result<Results, TaskError> {
    let whole = Run::new(experiment, seed, Shard::default(), folder);
    let mut records = Vec::new();
    for part in folders {
        let path = part.join(JOURNAL);
        let contents = journal::read(&path)?;
        let shard = Shard { index: contents.header.shard[0], of: contents.header.shard[1] };
        if contents.header != Run::new(experiment, seed, shard, part).header() {
            return Err(TaskError::Merge {
                folder: part.clone(),
                reason: "its trials are of another experiment, seed, settings or number".into(),
            });
        }
        if contents.damaged > 0 {
            let reason = format!("{} bytes of its trials are damaged", contents.damaged);
            return Err(TaskError::Merge { folder: part.clone(), reason });
        }
        records.extend(contents.records);
    }
    // The same trial gives the same bits wherever it is done.
    let key = |r: &Record| (r.cell, r.trial);
    records.sort_by_key(key);
    let bits = |r: &Record| r.outcome.map(f64::to_bits);
    let differ =
        |pair: &&[Record]| key(&pair[0]) == key(&pair[1]) && bits(&pair[0]) != bits(&pair[1]);
    if let Some([one, ..]) = records.windows(2).find(differ) {
        return Err(TaskError::Merge {
            folder: folder.into(),
            reason: format!(
                "trial {} of cell {} came out otherwise in two of the folders",
                one.trial, one.cell
            ),
        });
    }
    let outcomes = whole.outcomes(&records);
    let missing = outcomes.iter().flatten().filter(|o| o.is_none()).count();
    if missing > 0 {
        return Err(TaskError::Merge {
            folder: folder.into(),
            reason: format!("{missing} of {} trials are in none of the folders", whole.trials()),
        });
    }
    let _lock = Lock::take(folder)?;
    let mut sorted = Vec::new();
    for (cell, outcomes) in outcomes.iter().enumerate() {
        for (trial, outcome) in outcomes.iter().enumerate() {
            if let Some(outcome) = outcome {
                sorted.push(Record { cell: cell as u32, trial: trial as u64, outcome: *outcome });
            }
        }
    }
    journal::write(&whole.journal(), &whole.header(), &sorted, overwrite)?;
    let results = whole.results(&outcomes);
    whole.write(&results)?;
    Ok(results)
}
