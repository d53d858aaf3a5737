//! The file of a relational domain: version 3 of the domain file.

use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{FrameState, GoalTerm, RelationalDomain, RelationalOperator};
use crate::files::read_file;
use crate::task::domain::{Domain, Provenance};
use crate::task::error::{InputFault, TaskError, json_problem};

/// Value of the `format` field.
const FORMAT: &str = "symbolt-domain";
/// Version of the layout that is written.
const VERSION: u64 = 3;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RelationalFile {
    format: String,
    version: u64,
    provenance: Provenance,
    noise_m: f64,
    noise_rad: f64,
    goals: Vec<GoalTerm>,
    states: Vec<FrameState>,
    operators: Vec<RelationalOperator>,
}

impl RelationalDomain {
    /// Writes the domain as JSON text.
    ///
    /// # Errors
    /// [`TaskError::Json`] if serialisation fails. This is not known to happen.
    pub fn to_json(&self) -> Result<String, TaskError> {
        let file = RelationalFile {
            format: FORMAT.into(),
            version: VERSION,
            provenance: self.provenance.clone(),
            noise_m: self.noise_m,
            noise_rad: self.noise_rad,
            goals: self.goals.clone(),
            states: self.states.clone(),
            operators: self.operators.clone(),
        };
        let failed = |source| TaskError::Json { what: "the domain", source };
        let mut text = serde_json::to_string_pretty(&file).map_err(failed)?;
        text.push('\n');
        Ok(text)
    }

    /// Reads a domain from a file, or from standard input if `path` is `-`.
    ///
    /// # Errors
    /// [`TaskError::File`] if the file cannot be read; otherwise as [`RelationalDomain::parse`].
    pub fn read(path: &Path) -> Result<Self, TaskError> {
        Self::parse(&read_file(path)?, &path.display().to_string())
    }

    /// Reads a domain from the bytes of a domain file of version 3. Files of versions 1 and 2 are converted. `file` is
    /// the file's name in error messages. Never panics.
    ///
    /// # Errors
    /// [`TaskError::Input`] if the bytes are not a valid domain file; [`TaskError::BadDomain`] for a file of an older
    /// version with a state without geometry.
    pub fn parse(bytes: &[u8], file: &str) -> Result<Self, TaskError> {
        let version = serde_json::from_slice::<Value>(bytes)
            .ok()
            .and_then(|value| value.get("version")?.as_u64());
        if version != Some(VERSION) {
            return Self::from_domain(&Domain::parse(bytes, file)?);
        }
        let fault = |line, problem: String, expected: &str| InputFault {
            file: file.into(),
            line,
            field: String::new(),
            problem,
            expected: expected.into(),
        };
        let read: RelationalFile = serde_json::from_slice(bytes).map_err(|error| {
            let expected = "a domain file as written by `symbolt learn`";
            fault(Some(error.line()), json_problem(&error), expected)
        })?;
        if read.format != FORMAT {
            let problem = format!("the format is `{}`", read.format);
            return Err(fault(None, problem, "`symbolt-domain`").into());
        }
        let domain = Self {
            states: read.states,
            operators: read.operators,
            goals: read.goals,
            noise_m: read.noise_m,
            noise_rad: read.noise_rad,
            provenance: read.provenance,
        };
        domain.check().map_err(|error| match error {
            TaskError::BadDomain { reason } => fault(None, reason, "a consistent domain").into(),
            other => other,
        })?;
        Ok(domain)
    }
}
