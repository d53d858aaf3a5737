//! `symbolt rename`: your own names for learned states and actions.

use anyhow::Error;
use serde_json::json;
use symbolt::files::{Overwrite, write_atomic};

use super::Outcome;
use super::args::{BadArgument, RenameArgs};
use super::domain::AnyDomain;
use super::output::{emit, emit_json, refuse_existing};
use super::{learn, relational};

pub(crate) fn rename(args: &RenameArgs) -> Result<Outcome, Error> {
    refuse_existing(args.out.as_deref(), args.force)?;
    let mut renames = Vec::new();
    for pair in &args.names {
        let Some((old, new)) = pair.split_once('=') else {
            let problem = format!("`{pair}` is not of the form OLD=NEW");
            return Err(BadArgument(problem).into());
        };
        renames.push((old.to_owned(), new.to_owned()));
    }
    let (text, tables) = match AnyDomain::read(&args.domain)? {
        AnyDomain::Relational(domain) => {
            let domain = domain.rename(&renames)?;
            (domain.to_json()?, relational::domain_tables(&domain))
        }
        AnyDomain::Plain(domain) => {
            let domain = domain.rename(&renames)?;
            (domain.to_json()?, learn::domain_tables(&domain))
        }
    };
    let from_input = args.domain.as_os_str() == "-";
    match &args.out {
        None if from_input => return emit(&text).map(|()| Outcome::Done),
        None => write_atomic(&args.domain, text, Overwrite::Allowed)?,
        Some(path) => {
            let overwrite = if args.force { Overwrite::Allowed } else { Overwrite::Never };
            write_atomic(path, text, overwrite)?;
        }
    }
    if args.common.json {
        emit_json(&[json!({"renamed": renames.len()})])?;
    } else if !args.common.quiet {
        emit(&tables)?;
    }
    Ok(Outcome::Done)
}
