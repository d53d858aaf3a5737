//! `symbolt rename`: your own names and sentences for learned states and actions.

use std::path::PathBuf;

use anyhow::Error;
use clap::Args;
use serde_json::json;
use symbolt::files::{Limit, Overwrite};
use symbolt::task::domain::RelationalDomain;

use super::domain_tables::domain_tables;
use super::end::{BadArgument, Outcome};
use super::kind::{Given, Kind, parsed};
use super::options::Common;
use super::output::{Place, answer_unless_quiet};

#[derive(Debug, Clone, Args)]
pub(crate) struct RenameArgs {
    /// Learned domain; - for standard input
    pub domain: PathBuf,
    /// Old and new name of a state or action
    #[arg(required_unless_present = "words", value_name = "OLD=NEW")]
    pub names: Vec<String>,
    /// Name of a state or action, and a new sentence for it, such as
    /// "DRAWER_OPEN=a drawer is open"; before names are changed
    #[arg(verbatim_doc_comment, long, value_name = "NAME=SENTENCE")]
    pub words: Vec<String>,
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
    let renames = pairs(&args.names, "OLD=NEW")?;
    let sentences = pairs(&args.words, "NAME=SENTENCE")?;
    let domain = Given { path: &args.domain, takes: &[Kind::Domain] };
    let domain = parsed(domain, Limit::DOMAIN, &[], RelationalDomain::parse)?;
    let domain = domain.reword(&sentences)?.rename(&renames)?;
    out.write(&domain.to_json()?)?;
    // With the domain file, standard output holds nothing else.
    if !matches!(out, Place::Stdout) {
        let json = || json!({"renamed": renames.len(), "reworded": sentences.len()});
        answer_unless_quiet(&args.common, json, || domain_tables(&domain))?;
    }
    Ok(Outcome::Done)
}

/// Splits arguments at their first `=`.
fn pairs(all: &[String], form: &str) -> Result<Vec<(String, String)>, BadArgument> {
    let pair = |text: &String| match text.split_once('=') {
        Some((old, new)) => Ok((old.to_owned(), new.to_owned())),
        None => Err(BadArgument(format!("`{text}` is not of the form {form}"))),
    };
    all.iter().map(pair).collect()
}
