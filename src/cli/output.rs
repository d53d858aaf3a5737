//! Tables, JSON and progress: results to standard output, progress to standard error.

use std::io::{IsTerminal, Write};
use std::path::Path;
use std::time::Duration;

use anyhow::Error;
use comfy_table::{CellAlignment, Table, presets};
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::Value;
use symbolt::files::{FileError, write_atomic};

use super::args::{BadArgument, Common, OutFile};

/// Writes a result to standard output, all at once.
pub(crate) fn emit(text: &str) -> Result<(), Error> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes())?;
    if !text.ends_with('\n') {
        out.write_all(b"\n")?;
    }
    out.flush()?;
    Ok(())
}

/// Writes one JSON object a line.
pub(crate) fn emit_json(values: &[Value]) -> Result<(), Error> {
    let lines: Vec<String> = values.iter().map(Value::to_string).collect();
    emit(&lines.join("\n"))
}

/// Writes a result to the file asked for, or to standard output if none is.
pub(crate) fn emit_or_write(text: &str, out: &OutFile) -> Result<(), Error> {
    match &out.out {
        Some(path) => Ok(write_atomic(path, text, out.overwrite())?),
        None => emit(text),
    }
}

/// A table in the form of Markdown, numbers to the right.
pub(crate) struct Grid {
    table: Table,
    right: Vec<bool>,
}

impl Grid {
    /// A table with the given columns; those that begin with `>` stand to the right.
    pub fn new(columns: &[&str]) -> Self {
        let mut table = Table::new();
        table.load_style(presets::ASCII_MARKDOWN);
        let right = columns.iter().map(|c| c.starts_with('>')).collect();
        table.set_header(columns.iter().map(|c| c.trim_start_matches('>')));
        Self { table, right }
    }

    pub fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        self.table.add_row(cells);
    }

    pub fn is_empty(&self) -> bool {
        self.table.row_count() == 0
    }
}

impl std::fmt::Display for Grid {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut table = self.table.clone();
        for (index, right) in self.right.iter().enumerate() {
            if let (true, Some(column)) = (*right, table.column_mut(index)) {
                column.set_cell_alignment(CellAlignment::Right);
            }
        }
        writeln!(f, "{table}")
    }
}

/// Says on standard error what is going on: a spinner on a terminal, plain lines elsewhere.
pub(crate) struct Progress {
    bar: Option<ProgressBar>,
    lines: bool,
}

impl Progress {
    pub fn new(common: &Common) -> Self {
        let terminal = std::io::stderr().is_terminal();
        let bar = (terminal && !common.quiet).then(|| {
            let bar = ProgressBar::new_spinner();
            if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed} {msg}") {
                bar.set_style(style);
            }
            bar.enable_steady_tick(Duration::from_millis(100));
            bar
        });
        Self { bar, lines: !terminal && !common.quiet }
    }

    /// Whether there is a terminal to show changing lines on.
    pub fn lively(&self) -> bool {
        self.bar.is_some()
    }

    /// Changes the line on a terminal; says nothing elsewhere.
    pub fn show(&self, what: String) {
        if let Some(bar) = &self.bar {
            bar.set_message(what);
        }
    }

    pub fn say(&self, what: impl Into<String>) {
        let what = what.into();
        if self.lines {
            let _ = writeln!(std::io::stderr(), "{what}");
        }
        if let Some(bar) = &self.bar {
            bar.set_message(what);
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// Sets the number of worker threads.
pub(crate) fn use_threads(common: &Common) -> Result<(), Error> {
    if common.threads > 1024 {
        let problem = format!("--threads is {}; expected at most 1024", common.threads);
        return Err(BadArgument(problem).into());
    }
    rayon::ThreadPoolBuilder::new().num_threads(common.threads).build_global()?;
    Ok(())
}

/// Refuses an output that exists before any work is done for it.
pub(crate) fn refuse_existing(out: Option<&Path>, force: bool) -> Result<(), Error> {
    match out {
        Some(path) if path.as_os_str() == "-" => {
            Err(BadArgument("`-` is standard output; expected the name of a file to write".into())
                .into())
        }
        Some(path) if !force && path.exists() => {
            Err(FileError::Exists { path: path.into() }.into())
        }
        _ => Ok(()),
    }
}

/// Metres as millimetres, short.
pub(crate) fn mm(metres: f64) -> String {
    let mm = metres * 1e3;
    if mm.abs() >= 100.0 { format!("{mm:.0}") } else { format!("{mm:.3}") }
}

/// `1 nut`, `2 nuts`.
pub(crate) fn counted(number: usize, what: &str) -> String {
    if number == 1 { format!("1 {what}") } else { format!("{number} {what}s") }
}
