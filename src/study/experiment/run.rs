//! Runs and resumes the trials of an experiment.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;
use serde_json::{Value, json};

use super::journal::{CellSettings, Header, Journal, Record, Settings};
use super::{About, Cell, Experiment, MAX_READINGS, Measure, Results, Row, Shard, TrialOutcome};
use crate::files::{FileError, Overwrite, ResultFolder, write_atomic};
use crate::sim::Seed;
use crate::study::statistics::{Mean, Rate, Statistic};
use crate::task::TaskError;
use crate::task::event::{Event, Observer};

/// An experiment and the folder for its trials and results.
///
/// The folder holds the journal `trials.bin`. Once all trials are done, it also holds `results.json`, `results.csv`
/// and, if the experiment draws a figure, `figure.svg`. A second run with the same folder resumes the first.
pub struct Run<'a> {
    experiment: &'a dyn Experiment,
    about: About,
    pub(super) cells: Vec<Cell>,
    pub(super) seed: Seed,
    pub(super) shard: Shard,
    pub(super) folder: ResultFolder,
    salvage: bool,
    restart: bool,
}

pub(super) const JOURNAL: &str = "trials.bin";
/// Files that are written when all trials are done.
const TABLES: [&str; 3] = ["results.json", "results.csv", "figure.svg"];

/// Returns the number at index `at` of an outcome, or NaN if there is none.
fn number(outcome: &TrialOutcome, at: usize) -> f64 {
    outcome.get(at).copied().unwrap_or(f64::NAN)
}

impl<'a> Run<'a> {
    /// Prepares the trials of `experiment` in `folder`, which is locked as long as this value lives. Nothing is read or
    /// written yet.
    pub fn new(
        experiment: &'a dyn Experiment,
        seed: Seed,
        shard: Shard,
        folder: ResultFolder,
    ) -> Self {
        let (about, cells) = (experiment.about(), experiment.cells());
        Self { experiment, about, cells, seed, shard, folder, salvage: false, restart: false }
    }

    /// Sets the number of trials of every cell. By default, each cell has its own.
    pub fn with_trials(mut self, trials: Option<u64>) -> Self {
        for cell in &mut self.cells {
            cell.trials = trials.unwrap_or(cell.trials);
        }
        self
    }

    /// Sets whether damaged records of the journal are dropped and their trials run again. By default they are an
    /// error.
    pub fn salvaging(mut self, salvage: bool) -> Self {
        self.salvage = salvage;
        self
    }

    /// Sets whether the folder's earlier trials and results are deleted first. By default they are kept.
    pub fn restarting(mut self, restart: bool) -> Self {
        self.restart = restart;
        self
    }

    /// Returns the number of trials of this shard.
    pub fn trials(&self) -> u64 {
        self.cells.iter().map(|cell| self.own(cell).count() as u64).sum()
    }

    /// Returns the trials of a cell that belong to this shard.
    fn own(&self, cell: &Cell) -> impl Iterator<Item = u64> + use<> {
        (self.shard.index..cell.trials).step_by(self.shard.of.max(1) as usize)
    }

    pub(super) fn header(&self) -> Header {
        let shard = [self.shard.index, self.shard.of];
        let widths = self.cells.iter().map(|cell| cell.readings.len());
        let width = widths.max().unwrap_or(0).min(MAX_READINGS);
        Header::new(self.about.name, self.seed.value(), self.settings(), shard, width)
    }

    fn settings(&self) -> Settings {
        let cell = |cell: &Cell| CellSettings { cell: cell.settings.clone(), trials: cell.trials };
        Settings {
            experiment: self.about.settings.clone(),
            revision: self.about.revision,
            cells: self.cells.iter().map(cell).collect(),
        }
    }

    pub(super) fn journal(&self) -> PathBuf {
        self.folder.path().join(JOURNAL)
    }

    /// Reports a warning if the folder's file system has no locks.
    pub(super) fn warn(&self, observer: &mut dyn Observer) {
        if let Some(warning) = self.folder.warning() {
            observer.observe(&Event::Warned(&warning.to_string()));
        }
    }

    /// Refuses a folder with results but without a journal: another program wrote them.
    pub(super) fn refuse_foreign(&self) -> Result<(), FileError> {
        if self.journal().exists() {
            return Ok(());
        }
        let tables = TABLES.iter().map(|name| self.folder.path().join(name));
        match tables.into_iter().find(|path| path.symlink_metadata().is_ok()) {
            Some(path) => Err(FileError::Exists { path }),
            None => Ok(()),
        }
    }

    fn delete_earlier(&self) -> Result<(), TaskError> {
        for name in [JOURNAL].iter().chain(&TABLES) {
            let path = self.folder.path().join(name);
            match std::fs::remove_file(&path) {
                Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
                    return Err(FileError::Io { what: "remove", path, source }.into());
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Runs the trials that are not in the journal yet, on the threads of the pool. Reports progress to `observer`
    /// ([`Event::Trials`]). If this is the only shard, writes the table and returns it; otherwise returns `None`.
    ///
    /// # Errors
    /// [`TaskError::Input`] if the journal is damaged or belongs to another experiment, seed or settings;
    /// [`TaskError::File`] if it cannot be written, or if the folder has results but no journal; otherwise the first error of a trial. Finished trials are kept.
    pub fn go(&self, observer: &mut dyn Observer) -> Result<Option<Results>, TaskError> {
        self.warn(observer);
        if self.restart {
            self.delete_earlier()?;
        }
        self.refuse_foreign()?;
        let (journal, before) = Journal::open(&self.journal(), &self.header(), self.salvage)?;
        let outcomes = self.outcomes(&before);
        drop(before);
        let missing = self.missing(&outcomes);
        let done = AtomicU64::new(self.trials() - missing.len() as u64);
        let of = self.trials();
        observer.observe(&Event::Trials { done: done.load(Ordering::Relaxed), of });
        let observer = Mutex::new((observer, 0));
        let kept = Mutex::new((journal, outcomes));
        // A failure can cause further failures on other threads. Only the first is reported.
        let failure = Mutex::new(None);
        let failed = |error: TaskError| {
            failure.lock().unwrap_or_else(|e| e.into_inner()).get_or_insert(error);
        };
        let tried = missing.par_iter().try_for_each(|(cell, trial)| {
            let seed = self.seed.derive_index("trial", *trial);
            let outcome =
                self.experiment.trial(&self.cells[*cell as usize], seed).map_err(failed)?;
            let record = Record { cell: *cell, trial: *trial, outcome };
            {
                // A panic in another trial poisons the mutex but leaves the journal sound.
                let (journal, outcomes) = &mut *kept.lock().unwrap_or_else(|e| e.into_inner());
                journal.append(record).map_err(TaskError::from).map_err(failed)?;
                outcomes[*cell as usize][*trial as usize] = Some(outcome);
            }
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            // A thread skips its report while another thread reports. Only the last trial must be reported.
            let mut told = if done == of { observer.lock().ok() } else { observer.try_lock().ok() };
            if let Some((observer, last)) = told.as_deref_mut()
                && done > *last
            {
                *last = done;
                observer.observe(&Event::Trials { done, of });
            }
            Ok::<_, ()>(())
        });
        if let Some(error) = failure.into_inner().unwrap_or_else(|e| e.into_inner()) {
            return Err(error);
        }
        debug_assert!(tried.is_ok(), "a failed trial left no error");
        let (_, outcomes) = kept.into_inner().unwrap_or_else(|e| e.into_inner());
        if self.shard.of != 1 {
            return Ok(None);
        }
        let results = self.results(&outcomes);
        self.write(&results)?;
        Ok(Some(results))
    }

    /// Returns the trials of this shard without an outcome, as cell and trial.
    fn missing(&self, outcomes: &[Vec<Option<TrialOutcome>>]) -> Vec<(u32, u64)> {
        let mut missing: Vec<(u32, u64)> = Vec::new();
        for (index, (cell, outcomes)) in self.cells.iter().zip(outcomes).enumerate() {
            let own = self.own(cell).filter(|trial| outcomes[*trial as usize].is_none());
            missing.extend(own.map(|trial| (index as u32, trial)));
        }
        // Sorted by trial: the cells of a trial may share work, and threads start at trials far apart.
        missing.sort_unstable_by_key(|(cell, trial)| (*trial, *cell));
        missing
    }

    /// Returns the outcomes of records, indexed by cell and trial.
    pub(super) fn outcomes(&self, records: &[Record]) -> Vec<Vec<Option<TrialOutcome>>> {
        let mut outcomes: Vec<Vec<Option<TrialOutcome>>> =
            self.cells.iter().map(|cell| vec![None; cell.trials as usize]).collect();
        for record in records {
            let cell = outcomes.get_mut(record.cell as usize);
            if let Some(slot) = cell.and_then(|cell| cell.get_mut(record.trial as usize)) {
                *slot = Some(record.outcome);
            }
        }
        outcomes
    }

    pub(super) fn results(&self, outcomes: &[Vec<Option<TrialOutcome>>]) -> Results {
        let mut rows = Vec::new();
        for (cell, outcomes) in self.cells.iter().zip(outcomes) {
            for (at, reading) in cell.readings.iter().enumerate().take(MAX_READINGS) {
                let Some(statistic) = statistic(reading.measure, at, outcomes) else { continue };
                let mut settings = cell.settings.clone();
                settings.extend(reading.settings.clone());
                rows.push(Row { settings, statistic });
            }
        }
        let mut settings = match self.about.settings.clone() {
            settings @ Value::Object(_) => settings,
            other => json!({"settings": other}),
        };
        settings["seed"] = json!(self.seed.value());
        settings["trials"] = json!(self.cells.iter().map(|cell| cell.trials).max());
        let About { name, question, .. } = self.about;
        Results { name, question, settings, rows }
    }

    pub(super) fn write(&self, results: &Results) -> Result<(), TaskError> {
        let [json, csv, svg] = TABLES.map(|name| self.folder.path().join(name));
        write_atomic(&json, format!("{:#}\n", results.to_json()), Overwrite::Allowed)?;
        write_atomic(&csv, results.to_csv(), Overwrite::Allowed)?;
        if let Some(figure) = self.experiment.figure(results) {
            write_atomic(&svg, figure.to_svg()?, Overwrite::Allowed)?;
        }
        Ok(())
    }
}

/// Computes the statistic of the numbers at index `at` of finished trials. `None` for [`Measure::Auxiliary`], which has
/// no row in the table.
fn statistic(measure: Measure, at: usize, outcomes: &[Option<TrialOutcome>]) -> Option<Statistic> {
    let done = outcomes.iter().flatten();
    let values = done.clone().map(|outcome| outcome[at]);
    Some(match measure {
        Measure::Rate => Statistic::Rate(Rate::new(
            values.clone().filter(|v| *v == 1.0).count() as u64,
            values.filter(|v| !v.is_nan()).count() as u64,
        )),
        Measure::ClusteredRate(key) => {
            let mut clusters: BTreeMap<u64, [u64; 2]> = BTreeMap::new();
            for outcome in done.filter(|outcome| !outcome[at].is_nan()) {
                let key = number(outcome, key).to_bits();
                let [own, of] = clusters.entry(key).or_default();
                (*own, *of) = (*own + u64::from(outcome[at] == 1.0), *of + 1);
            }
            Statistic::Rate(Rate::of_clusters(clusters.values().copied()))
        }
        Measure::Share(of) => {
            let cluster = |o: &TrialOutcome| [o[at], number(o, of)].map(|count| count as u64);
            Statistic::Rate(Rate::of_clusters(done.map(cluster)))
        }
        Measure::Mean => Statistic::Mean(Mean::of(values)),
        Measure::ClusteredMean(key) => {
            Statistic::Mean(Mean::of_clusters(done.map(|o| (number(o, key), o[at]))))
        }
        Measure::Difference => Statistic::Mean(Mean::of_differences(values)),
        Measure::Auxiliary => return None,
    })
}

#[cfg(test)]
mod tests {
    use std::fs::{File, TryLockError};
    use std::io::ErrorKind;

    use super::*;
    use crate::files::TryLock;
    use crate::study::experiment::{Reading, outcome};
    use crate::task::event::Ignore;

    /// An experiment in which half of the trials succeed.
    struct Coin;

    impl Experiment for Coin {
        fn about(&self) -> About {
            let settings = json!({});
            About { name: "coin", question: "How often is the seed even?", revision: 1, settings }
        }

        fn cells(&self) -> Vec<Cell> {
            vec![Cell::new(json!({}), 50, vec![Reading::new(Measure::Rate, json!({}))])]
        }

        fn trial(&self, _cell: &Cell, seed: Seed) -> Result<TrialOutcome, TaskError> {
            Ok(outcome([f64::from(u8::from(seed.value().is_multiple_of(2)))]))
        }
    }

    /// Runs in a fresh folder with this lock function. Returns the result and the warnings.
    fn locked_by(try_lock: TryLock) -> (Result<Option<Results>, TaskError>, Vec<String>) {
        let place = tempfile::tempdir().expect("a folder");
        let folder = ResultFolder::lock(place.path(), None, try_lock).expect("opens");
        let mut warnings = Vec::new();
        let run = Run::new(&Coin, Seed::new(1), Shard::default(), folder);
        let end = run.go(&mut |event: &Event<'_>| {
            if let Event::Warned(warning) = event {
                warnings.push((*warning).to_owned());
            }
        });
        (end, warnings)
    }

    #[test]
    fn without_locks_a_run_warns_once_and_continues() {
        let (locked, warnings) = locked_by(File::try_lock);
        let locked = locked.expect("runs");
        assert!(locked.is_some() && warnings.is_empty(), "{warnings:?}");
        let (unlocked, warnings) =
            locked_by(|_| Err(TryLockError::Error(ErrorKind::Unsupported.into())));
        assert_eq!(unlocked.expect("runs"), locked);
        assert!(warnings.len() == 1 && warnings[0].contains("lock"), "{warnings:?}");
    }

    #[test]
    fn a_journal_with_text_as_number_of_trials_is_refused() {
        let place = tempfile::tempdir().expect("a folder");
        let folder = ResultFolder::open(place.path()).expect("opens");
        let run = Run::new(&Coin, Seed::new(1), Shard::default(), folder);
        run.go(&mut Ignore).expect("runs");
        let bytes = std::fs::read(run.journal()).expect("a journal");
        let end = bytes.iter().position(|b| *b == b'\n').expect("a first line");
        let line = String::from_utf8_lossy(&bytes[..end]).replace("50", "\"50\"");
        std::fs::write(run.journal(), [line.as_bytes(), &bytes[end..]].concat()).expect("written");
        let refused = run.go(&mut Ignore);
        assert!(matches!(refused, Err(TaskError::Input(_))), "{refused:?}");
    }
}
