//! `symbolt rename`: your own names for learned states and actions.

use std::path::PathBuf;

use anyhow::Error;
use clap::Args;
use serde_json::json;
use symbolt::files::Overwrite;
use symbolt::task::domain::RelationalDomain;

use super::end::{BadArgument, Outcome};
use super::options::Common;
use super::output::{Place, emit, emit_json};
use super::relational;

#[derive(Debug, Clone, Args)]
#[command(next_line_help = true, allow_negative_numbers = true)]
pub(crate) struct RenameArgs {
    /// Learned domain; - for standard input
    pub domain: PathBuf,
    /// Old and new name of a state or action
    #[arg(required = true, value_name = "OLD=NEW")]
    pub names: Vec<String>,
    #[command(flatten)]
    pub common: Common,
    /// File to write; it must not exist; - for standard output
    /// [default: the domain file itself, which is replaced]
    #[arg(verbatim_doc_comment, long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Replace the file of --out if it exists
    #[arg(long)]
    pub force: bool,
}

pub(crate) fn rename(args: &RenameArgs) -> Result<Outcome, Error> {
    let from_input = args.domain.as_os_str() == "-";
    let out = match &args.out {
        None if from_input => Place::Stdout,
        None => Place::File(args.domain.clone(), Overwrite::Allowed),
        named => Place::checked(named.as_deref(), args.force)?,
    };
    let mut renames = Vec::new();
    for pair in &args.names {
        let Some((old, new)) = pair.split_once('=') else {
            let problem = format!("`{pair}` is not of the form OLD=NEW");
            return Err(BadArgument(problem).into());
        };
        renames.push((old.to_owned(), new.to_owned()));
    }
    let domain = RelationalDomain::read(&args.domain)?.rename(&renames)?;
    let text = domain.to_json()?;
    out.write(&text)?;
    if matches!(out, Place::Stdout) {
        // Standard output holds the domain file and nothing else.
    } else if args.common.json {
        emit_json(&[json!({"renamed": renames.len()})])?;
    } else if !args.common.quiet {
        emit(&relational::domain_tables(&domain))?;
    }
    Ok(Outcome::Done)
}
