//! `symbolt config`: the settings of a task, and the list of tasks.

use anyhow::Error;
use clap::Args;
use serde_json::{Value, json};
use symbolt::task::{TaskError, tasks};

use super::end::Outcome;
use super::options::{OutFile, TaskArgs};
use super::output::{Grid, emit, emit_json};

#[derive(Debug, Clone, Args)]
#[command(next_line_help = true, allow_negative_numbers = true)]
pub(crate) struct ConfigArgs {
    #[command(flatten)]
    pub task: TaskArgs,
    #[command(flatten)]
    pub out: OutFile,
}

pub(crate) fn config(args: &ConfigArgs) -> Result<Outcome, Error> {
    let out = args.out.place()?;
    if args.task.listed() {
        out.write(&table()?)?;
        return Ok(Outcome::Done);
    }
    out.write(&format!("{:#}\n", args.task.task()?.settings()))?;
    Ok(Outcome::Done)
}

/// Prints the tasks.
pub(crate) fn list(as_json: bool) -> Result<Outcome, Error> {
    if as_json {
        let all = tasks::all()?;
        let task = |task: &std::sync::Arc<dyn tasks::Task>| json!({"name": task.name(), "description": task.description()});
        let lines: Vec<Value> = all.iter().map(task).collect();
        emit_json(&lines)?;
        return Ok(Outcome::Done);
    }
    emit(&table()?)?;
    Ok(Outcome::Done)
}

/// Returns the table of the tasks.
fn table() -> Result<String, TaskError> {
    let mut grid = Grid::new(&["task", "the robot has to"]);
    for task in tasks::all()? {
        grid.row([task.name().to_owned(), task.description().to_owned()]);
    }
    Ok(grid.to_string())
}
