//! `symbolt rename`: your own names for learned states and actions.

use anyhow::Error;
use serde_json::json;
use symbolt::files::Overwrite;
use symbolt::task::relational::RelationalDomain;

use super::Outcome;
use super::args::{BadArgument, RenameArgs};
use super::output::{Place, emit, emit_json};
use super::relational;

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
