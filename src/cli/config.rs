//! `symbolt config`: the settings of a task, and the list of tasks.

use std::sync::Arc;

use anyhow::Error;
use clap::Args;
use serde_json::json;
use symbolt::task::{TaskError, tasks};

use super::end::Outcome;
use super::options::{OutFile, TaskArgs};
use super::output::emit;
use super::table::Grid;

#[derive(Debug, Clone, Args)]
pub(crate) struct ConfigArgs {
    #[command(flatten)]
    pub task: TaskArgs,
    #[command(flatten)]
    pub out: OutFile,
}

pub(crate) fn config(args: &ConfigArgs) -> Result<Outcome, Error> {
    let out = args.out.place()?;
    let text = match args.task.listed() {
        true => table()?,
        false => format!("{:#}\n", args.task.task()?.settings()),
    };
    out.write(&text)
}

/// Prints the tasks.
pub(crate) fn list(as_json: bool) -> Result<Outcome, Error> {
    let text = match as_json {
        true => {
            let tasks = tasks::all()?;
            let task = |task: &Arc<dyn tasks::Task>| {
                json!({"name": task.name(), "description": task.description()}).to_string()
            };
            tasks.iter().map(task).collect::<Vec<_>>().join("\n")
        }
        false => table()?,
    };
    emit(&text)?;
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
