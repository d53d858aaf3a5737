//! Results to standard output, progress to standard error, and the checks that all commands share.

use std::fmt::Display;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::available_parallelism;
use std::time::Duration;

use anyhow::{Context, Error};
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Map, Value};
use symbolt::files::{Overwrite, ResultFolder, check_output, write_atomic};
use symbolt::sim::plain;

use super::end::{BadArgument, Outcome};
use super::options::{OutFile, Seedless};
use super::rank::{leads, own};
use super::table::counted;

/// Writes a result to standard output, and ends its last line if there is one. Of several processes that share a command only the first
/// writes.
pub(crate) fn emit(result: impl Display) -> Result<(), Error> {
    if !leads() {
        return Ok(());
    }
    let write = || {
        let out = BufWriter::with_capacity(1 << 16, std::io::stdout().lock());
        let mut out = Lines { out, last: None };
        write!(out, "{result}")?;
        if out.last.is_some_and(|last| last != b'\n') {
            out.write_all(b"\n")?;
        }
        out.flush()
    };
    write().context("cannot write to standard output")
}

/// A writer that remembers its last byte.
struct Lines<W> {
    out: W,
    last: Option<u8>,
}

impl<W: Write> Write for Lines<W> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let written = self.out.write(bytes)?;
        self.last = bytes[..written].last().copied().or(self.last);
        Ok(written)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.out.flush()
    }
}

/// Writes a JSON object with `--json`, otherwise a text.
pub(crate) fn answer(
    common: &Seedless,
    json: impl FnOnce() -> Value,
    text: impl FnOnce() -> String,
) -> Result<Outcome, Error> {
    emit(&if common.json { json().to_string() } else { text() })?;
    Ok(Outcome::Done)
}

/// As [`answer`], but with `--quiet` without the text.
pub(crate) fn answer_unless_quiet(
    common: &Seedless,
    json: impl FnOnce() -> Value,
    text: impl FnOnce() -> String,
) -> Result<Outcome, Error> {
    if common.quiet && !common.json { Ok(Outcome::Done) } else { answer(common, json, text) }
}

/// Returns the keys of a JSON object.
pub(crate) fn keys(object: Value) -> Map<String, Value> {
    match object {
        Value::Object(keys) => keys,
        _ => Map::new(),
    }
}

/// The place for a command's result.
pub(crate) enum Place {
    /// `--out` was not given.
    Default,
    /// Standard output: `--out -`.
    Stdout,
    /// The file given with `--out`.
    File(PathBuf, Overwrite),
}

impl Place {
    /// Returns the place that `--out` and `--force` name. Commands call it before they do any work.
    ///
    /// # Errors
    /// If the file exists and must not be replaced, or if it cannot be written.
    pub fn checked(out: Option<&Path>, force: bool) -> Result<Self, Error> {
        match out {
            None => Ok(Self::Default),
            Some(path) if path.as_os_str() == "-" => Ok(Self::Stdout),
            Some(path) => {
                let overwrite = overwrite(force);
                check_output(path, overwrite)?;
                Ok(Self::File(path.into(), overwrite))
            }
        }
    }

    /// Writes a result to the file, or to standard output if there is none.
    pub fn write(&self, result: impl Display) -> Result<Outcome, Error> {
        match self {
            Self::File(path, overwrite) => write_atomic(path, result.to_string(), *overwrite)?,
            Self::Default | Self::Stdout => emit(result)?,
        }
        Ok(Outcome::Done)
    }
}

impl OutFile {
    /// As [`Place::checked`]. There is nothing to replace without a file.
    pub fn place(&self) -> Result<Place, Error> {
        if self.force && self.out.is_none() {
            let problem = "--force replaces the file of --out, which is not given; leave it out";
            return Err(BadArgument(problem.into()).into());
        }
        Place::checked(self.out.as_deref(), self.force)
    }
}

/// Refuses `-`, which elsewhere means standard output, as the folder of `--out`.
pub(crate) fn not_standard_output(folder: &Path) -> Result<(), BadArgument> {
    if folder.as_os_str() == "-" {
        let problem = "--out -: must be a folder; for a folder of this name write ./-";
        return Err(BadArgument(problem.into()));
    }
    Ok(())
}

/// Refuses two inputs, each with its name in the sentence, of which both come from standard input.
pub(crate) fn not_both_standard_input(
    (one, first): (&str, &Path),
    (other, second): (&str, &Path),
) -> Result<(), BadArgument> {
    if first.as_os_str() == "-" && second.as_os_str() == "-" {
        let problem = format!("the {one} and the {other} cannot both come from standard input (-)");
        return Err(BadArgument(problem));
    }
    Ok(())
}

/// Prints a warning about a folder, if there is one.
pub(crate) fn warn_of(folder: &ResultFolder) {
    if let Some(warning) = folder.warning() {
        warn(&warning.to_string());
    }
}

/// Returns whether files may be replaced, as `--force` says.
pub(crate) fn overwrite(force: bool) -> Overwrite {
    if force { Overwrite::Allowed } else { Overwrite::Never }
}

/// Shows progress on standard error: a spinner on a terminal, plain lines elsewhere.
pub(crate) struct Progress {
    /// It is hidden elsewhere than on a terminal, and with `--quiet`.
    bar: ProgressBar,
    lines: bool,
}

impl Progress {
    pub fn new(common: &Seedless) -> Self {
        let quiet = common.quiet || !leads();
        let bar = if quiet { ProgressBar::hidden() } else { ProgressBar::new_spinner() };
        let progress = Self { lines: !quiet && bar.is_hidden(), bar };
        if progress.lively() {
            if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed} {msg}") {
                progress.bar.set_style(style);
            }
            progress.bar.enable_steady_tick(Duration::from_millis(100));
        }
        progress
    }

    /// Returns whether progress goes to a terminal, where a line can change.
    pub fn lively(&self) -> bool {
        !self.bar.is_hidden()
    }

    /// Changes the line on a terminal. Elsewhere it does nothing.
    pub fn show(&self, what: String) {
        self.bar.set_message(what);
    }

    /// Prints a step: as a line of its own, or in the spinner's line on a terminal.
    pub fn say(&self, what: impl Into<String>) {
        let what = plain(&what.into()).into_owned();
        if self.lines {
            let _ = writeln!(std::io::stderr(), "{what}");
        }
        self.show(what);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// Greatest number of warnings of a command.
const MOST_WARNINGS: usize = 5;

static WARNINGS: AtomicUsize = AtomicUsize::new(0);

/// Prints a warning to standard error, even with `--quiet`. The first warnings are printed, the others counted.
pub(crate) fn warn(sentence: &str) {
    if WARNINGS.fetch_add(1, Ordering::Relaxed) < MOST_WARNINGS {
        tell(&format!("warning: {sentence}"));
    }
}

/// Says how many warnings were not printed.
pub(crate) fn warn_of_the_rest() {
    let rest = WARNINGS.load(Ordering::Relaxed).saturating_sub(MOST_WARNINGS);
    if rest > 0 {
        tell(&format!("warning: and {}", counted(rest, "more warning")));
    }
}

/// Greatest number of lines and of characters of a message.
const LONGEST: [usize; 2] = [10, 1_000];

/// What every message begins with. A terminal shows it in colour, unless `NO_COLOR` is set.
const PREFIX: &str = "symbolt: ";

/// Prints a message to standard error. All errors and warnings come here: they have one prefix, their control characters,
/// which may come from files, are escaped, and what is too long is cut.
pub(crate) fn tell(message: &str) {
    let mut text = PREFIX.to_owned();
    for (index, line) in message.trim_end().lines().enumerate() {
        if index == LONGEST[0] - 1 && message.trim_end().lines().nth(LONGEST[0]).is_some() {
            text += "\n...";
            break;
        }
        text += if index > 0 { "\n" } else { "" };
        text += &plain(line);
    }
    if let Some((at, _)) = text.char_indices().nth(LONGEST[1] - 1) {
        let at = text.char_indices().nth(LONGEST[1] - 5).map_or(at, |(at, _)| at);
        text.truncate(at);
        text += "...";
    }
    let (name, rest) = text.split_at(PREFIX.len() - 1);
    let name = console::style(name).for_stderr().bold();
    let name = if rest.starts_with(" warning: ") { name.yellow() } else { name.red() };
    // In one piece: messages of several processes may share standard error. If it is closed, the message is lost.
    let _ = std::io::stderr().write_all(format!("{name}{rest}\n").as_bytes());
}

/// Sets the number of worker threads.
pub(crate) fn use_threads(common: &Seedless) -> Result<(), Error> {
    warn_of_binding(common.threads);
    rayon::ThreadPoolBuilder::new().num_threads(common.threads).build_global()?;
    Ok(())
}

/// Warns if this process shares the command and may use fewer cores than `threads`, the number that the user asked for.
fn warn_of_binding(threads: usize) {
    let cores = available_parallelism().map_or(threads, usize::from);
    if own().is_some() && leads() && threads > cores {
        warn(&format!(
            "--threads is {threads}, but this process may use {} only; \
             Open MPI binds processes to cores unless it is started as `mpirun --bind-to none`",
            counted(cores, "core")
        ));
    }
}

/// Formats the counts of a JSON object: `3 demonstrations, 24 snapshots`. The key `kind` is left out.
pub(crate) fn facts(summary: &Value) -> String {
    let fact = |(key, value): (&String, &Value)| match (key.as_str(), value.as_u64()) {
        ("kind" | "unsolved" | "warnings", _) => None,
        ("failed", Some(count)) => Some(counted(count as usize, "failed attempt")),
        ("lost", Some(count)) => Some(counted(count as usize, "lost part")),
        ("simulated_s", _) => value.as_f64().map(|time_s| format!("{time_s:.1} simulated s")),
        (name, Some(1)) => Some(format!("1 {}", name.trim_end_matches('s'))),
        (name, _) => Some(format!("{value} {name}")),
    };
    let facts = summary.as_object().into_iter().flatten().filter_map(fact);
    facts.collect::<Vec<_>>().join(", ")
}
