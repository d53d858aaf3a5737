//! `symbolt completions`: a completion script for a shell.

use anyhow::Error;
use clap::{Args, Command};

use super::end::Outcome;
use super::output::emit;

#[derive(Debug, Clone, Args)]
pub(crate) struct CompletionsArgs {
    /// Shell
    pub shell: clap_complete::Shell,
}

/// Prints the script for the commands of `program`.
pub(crate) fn completions(args: &CompletionsArgs, mut program: Command) -> Result<Outcome, Error> {
    let mut text = Vec::new();
    clap_complete::generate(args.shell, &mut program, "symbolt", &mut text);
    emit(String::from_utf8_lossy(&text))?;
    Ok(Outcome::Done)
}
