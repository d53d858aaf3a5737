//! `symbolt import`: a recording from logs of poses.

mod tables;

use std::path::{Path, PathBuf};

use anyhow::{Error, bail};
use clap::Args;
use symbolt::files::{FileError, Limit};
use symbolt::report::import_page;
use symbolt::task::import::{
    Angle, Handed, Imported, Length, Mapping, QuaternionOrder, Rotation, Streams, TableMap,
    TimeUnit, Up, fits,
};
use symbolt::task::{Recording, TaskError};

use super::check::doubted;
use super::end::{BadArgument, Outcome};
use super::kind::{Given, Kind, parsed};
use super::options::{Common, OutFile, number};
use super::output::{Place, Progress, answer, answer_unless_quiet, use_threads};

#[derive(Debug, Clone, Args)]
pub(crate) struct ImportArgs {
    /// Logs: files, folders of CSV, MCAP or HDF5 files, or patterns such as
    /// 'runs/*.csv'; - for standard input
    #[arg(verbatim_doc_comment, required = true)]
    pub logs: Vec<PathBuf>,
    /// JSON file that says what the log means; --dry-run prints one
    #[arg(long, value_name = "FILE")]
    pub map: Option<PathBuf>,
    /// Show what would be taken, and print the mapping
    #[arg(long)]
    pub dry_run: bool,
    /// Write a page that shows the tracks and the events
    #[arg(long, value_name = "FILE")]
    pub page: Option<PathBuf>,
    #[command(flatten)]
    pub reading: ReadingArgs,
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    pub out: OutFile,
}

/// Options that say the same as a mapping, and go before it.
#[derive(Debug, Clone, Args)]
pub(crate) struct ReadingArgs {
    /// Unit of positions: m, mm, cm or inch
    #[arg(long, value_name = "UNIT")]
    pub length: Option<Length>,
    /// Unit of time: s, ms, us or ns
    #[arg(long, value_name = "UNIT")]
    pub time_unit: Option<TimeUnit>,
    /// Unit of angles: rad or deg
    #[arg(long, value_name = "UNIT")]
    pub angle: Option<Angle>,
    /// Order of quaternions whose columns do not say it: xyzw or wxyz
    #[arg(long, value_name = "ORDER")]
    pub quaternion: Option<QuaternionOrder>,
    /// Meaning of three numbers of a rotation: vector or euler
    #[arg(long, value_name = "FORM")]
    pub rotation: Option<Rotation>,
    /// Axis that points up: x, y, z, -x, -y or -z [default: z]
    #[arg(long, value_name = "AXIS")]
    pub up: Option<Up>,
    /// Handedness of the axes: right or left [default: right]
    #[arg(long, value_name = "HAND")]
    pub handed: Option<Handed>,
    /// Id of the robot's hand; * stands for any text
    #[arg(long, value_name = "ID")]
    pub hand: Option<String>,
    /// Kind of the objects whose id fits a pattern, such as 'm6_*=bolt'
    #[arg(long, value_name = "ID=KIND")]
    pub kind: Vec<String>,
    /// Column or id to leave out; * stands for any text
    #[arg(long, value_name = "NAME")]
    pub ignore: Vec<String>,
    /// Column of the session
    #[arg(long, value_name = "COLUMN")]
    pub session: Option<String>,
    /// Pattern of file names with {session} and, if there is one, {part}
    #[arg(long, value_name = "PATTERN")]
    pub sessions: Option<String>,
    /// Length of a gap in time that begins a new session, in seconds
    #[arg(long, value_name = "SECONDS", value_parser = number::<f64>)]
    pub gap: Option<f64>,
    /// Column of time
    #[arg(long, value_name = "COLUMN")]
    pub time: Option<String>,
    /// Column of the object's id, with one row a time and object
    #[arg(long, value_name = "COLUMN")]
    pub id: Option<String>,
    /// Frame in which poses are taken, in logs with several frames
    #[arg(long, value_name = "FRAME")]
    pub reference: Option<String>,
    /// Rows a second, in logs of arrays without times
    #[arg(long, value_name = "HZ", value_parser = number::<f64>)]
    pub rate: Option<f64>,
    /// Column of the gripper's width
    #[arg(long, value_name = "COLUMN")]
    pub width: Option<String>,
    /// Column that says whether something is grasped
    #[arg(long, value_name = "COLUMN")]
    pub grasp: Option<String>,
}

impl ReadingArgs {
    /// Puts what the options say into a mapping.
    fn apply(&self, mapping: &mut Mapping) -> Result<(), BadArgument> {
        fn set<T: Clone>(to: &mut Option<T>, from: &Option<T>) {
            if from.is_some() {
                to.clone_from(from);
            }
        }
        set(&mut mapping.length, &self.length);
        set(&mut mapping.time_unit, &self.time_unit);
        set(&mut mapping.angle, &self.angle);
        set(&mut mapping.quaternion, &self.quaternion);
        set(&mut mapping.rotation, &self.rotation);
        set(&mut mapping.up, &self.up);
        set(&mut mapping.handed, &self.handed);
        set(&mut mapping.hand, &self.hand);
        set(&mut mapping.session, &self.session);
        set(&mut mapping.sessions, &self.sessions);
        set(&mut mapping.gap_s, &self.gap);
        set(&mut mapping.reference, &self.reference);
        set(&mut mapping.rate_hz, &self.rate);
        if let Some(rate) = self.rate.filter(|rate| !(*rate > 0.0 && rate.is_finite())) {
            return Err(BadArgument::range("--rate", rate, "more than 0 Hz"));
        }
        if let Some(gap) = self.gap.filter(|gap| !(*gap > 0.0 && gap.is_finite())) {
            return Err(BadArgument::range("--gap", gap, "more than 0 seconds"));
        }
        if let Some(sessions) = self.sessions.as_ref().filter(|s| !s.contains("{session}")) {
            return Err(BadArgument::range("--sessions", sessions, "a pattern with {session}"));
        }
        for kind in &self.kind {
            let (pattern, kind) =
                kind.split_once('=').filter(|(_, kind)| !kind.is_empty()).ok_or_else(|| {
                    BadArgument::range("--kind", kind, "ID=KIND, such as 'm6_*=bolt'")
                })?;
            mapping.kinds.insert(pattern.into(), kind.into());
        }
        mapping.ignore.extend(self.ignore.iter().cloned());
        let own = [&self.time, &self.id, &self.width, &self.grasp];
        if own.iter().any(|column| column.is_some()) {
            if mapping.tables.is_empty() {
                mapping.tables.push(TableMap::default());
            }
            for table in &mut mapping.tables {
                set(&mut table.time, &self.time);
                set(&mut table.id, &self.id);
                set(&mut table.width, &self.width);
                set(&mut table.grasp, &self.grasp);
            }
        }
        Ok(())
    }
}

/// Greatest number of files of one import, and of entries of a folder.
const MOST_FILES: usize = 10_000;

/// Patterns of the files of a folder that are logs.
const LOGS: [&str; 4] = ["*.csv", "*.mcap", "*.h5", "*.hdf5"];

/// Returns the files that the arguments name, in order.
fn files(logs: &[PathBuf]) -> Result<Vec<PathBuf>, Error> {
    let mut files = Vec::new();
    for log in logs {
        let name = log.file_name().map(|name| name.to_string_lossy().into_owned());
        let pattern = name.filter(|name| name.contains('*') && !log.exists());
        let (folder, patterns) = match (log.is_dir(), pattern) {
            (true, _) => (log.as_path(), LOGS.map(str::to_owned).to_vec()),
            (false, Some(pattern)) => (log.parent().unwrap_or(Path::new("")), vec![pattern]),
            (false, None) => {
                files.push(log.clone());
                continue;
            }
        };
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let entries = std::fs::read_dir(folder).map_err(FileError::io("read", folder))?;
        let mut found: Vec<PathBuf> = Vec::new();
        for entry in entries.flatten() {
            if found.len() >= MOST_FILES {
                return Err(FileError::TooManyEntries {
                    folder: folder.into(),
                    max_entries: MOST_FILES,
                }
                .into());
            }
            let name = entry.file_name();
            if patterns.iter().any(|pattern| fits(pattern, &name.to_string_lossy())) {
                found.push(folder.join(entry.file_name()));
            }
        }
        if found.is_empty() {
            let expected = patterns.join(", ");
            let problem =
                format!("{}: no file fits; expected logs such as {expected}", log.display());
            bail!(BadArgument(problem));
        }
        found.sort();
        files.extend(found);
    }
    if files.len() > MOST_FILES {
        bail!(BadArgument(format!(
            "{} files are named; expected at most {MOST_FILES}",
            files.len()
        )));
    }
    Ok(files)
}

pub(crate) fn import(args: &ImportArgs) -> Result<Outcome, Error> {
    let out = args.out.place()?;
    let page = Place::checked(args.page.as_deref(), args.out.force)?;
    if matches!(page, Place::Stdout) {
        bail!(BadArgument::range("--page", "-", "a file"));
    }
    use_threads(&args.common)?;
    let mut mapping = match &args.map {
        Some(path) => {
            let map = Given { path, takes: &[Kind::Mapping] };
            parsed(map, Limit::SETTINGS, &[], Mapping::parse)?
        }
        None => Mapping::unknown(),
    };
    args.reading.apply(&mut mapping)?;
    let progress = Progress::new(&args.common);
    let mut streams = Streams::new(mapping);
    for file in files(&args.logs)? {
        progress.show(format!("reading {}", file.display()));
        let log = Given { path: &file, takes: &[Kind::Log("a log of poses (CSV, MCAP or HDF5)")] };
        parsed(log, Limit::LOG, &[], |bytes, name| streams.add(name, bytes))?;
    }
    progress.show("finding events".into());
    let imported = streams.finish().map_err(TaskError::from)?.import();
    drop(progress);
    let doubts = doubted(&imported.recording);
    let json = || tables::json(&imported, &doubts);
    let writes = !args.dry_run && !matches!(out, Place::Default);
    let recording = if writes { recording(&imported)? } else { String::new() };
    if !matches!(page, Place::Default) {
        page.write(import_page(&imported))?;
    }
    if args.dry_run {
        let mapping = imported.mapping.to_json()?;
        return answer(&args.common, json, || tables::text(&imported) + "\n" + &mapping);
    }
    match &out {
        Place::Default => answer(&args.common, json, || {
            tables::text(&imported) + "\nNo recording was written; `--out FILE` writes one."
        }),
        Place::Stdout => out.write(recording),
        Place::File(path, _) => {
            out.write(recording)?;
            let wrote = || format!("{}\nWrote {}", tables::text(&imported), path.display());
            answer_unless_quiet(&args.common, json, wrote)
        }
    }
}

/// Returns the recording as text that our own reader takes.
fn recording(imported: &Imported) -> Result<String, Error> {
    let text = imported.recording.to_jsonl(None)?;
    Recording::parse(text.as_bytes(), "the recording").map_err(TaskError::from)?;
    Ok(text)
}
