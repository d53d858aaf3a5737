//! `symbolt man`: manual pages, made from the help of the commands.

use anyhow::Error;
use clap::{Args, Command};

use super::end::{BadArgument, Outcome};
use super::output::emit;
use super::unknown;

#[derive(Debug, Clone, Args)]
pub(crate) struct ManArgs {
    /// Command whose page is printed [default: the page of the program]
    pub command: Option<String>,
}

/// Prints the page of `program`, or of one of its commands.
pub(crate) fn man(args: &ManArgs, mut program: Command) -> Result<Outcome, Error> {
    program.build();
    let page = match &args.command {
        None => program,
        Some(name) => match program.find_subcommand(name) {
            Some(command) => command.clone(),
            None => return Err(BadArgument(unknown(name, &mut program)).into()),
        },
    };
    let mut text = Vec::new();
    // Only the program has a version of its own.
    let source = concat!("symbolt ", env!("CARGO_PKG_VERSION"));
    clap_mangen::Man::new(page).source(source).render(&mut text)?;
    emit(String::from_utf8_lossy(&text))?;
    Ok(Outcome::Done)
}
