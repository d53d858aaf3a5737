//! The domain's file: JSON with a format and a version, checked whole when it is read.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::files::read_file;
use crate::task::domain::{Domain, Operator, Provenance, State};
use crate::task::error::{InputFault, TaskError};

/// What the file calls itself.
const FORMAT: &str = "symbolt-domain";

/// The version of the file's layout.
const VERSION: u64 = 1;

#[derive(Deserialize)]
struct Header {
    format: Option<String>,
    version: Option<u64>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    format: String,
    version: u64,
    provenance: Provenance,
    goal: Option<String>,
    states: Vec<State>,
    operators: Vec<Operator>,
}

impl Domain {
    /// The domain as JSON text.
    pub fn to_json(&self) -> String {
        let file = File {
            format: FORMAT.into(),
            version: VERSION,
            provenance: self.provenance().clone(),
            goal: self.goal().map(str::to_owned),
            states: self.states().to_vec(),
            operators: self.operators().to_vec(),
        };
        // Numbers were checked to be finite and keys are strings: nothing here can fail.
        let mut text = serde_json::to_string_pretty(&file).unwrap_or_default();
        text.push('\n');
        text
    }

    /// Reads a domain from a file (`-` for standard input).
    ///
    /// # Errors
    /// If the file cannot be read or is not a sound domain of this version.
    pub fn read(path: &Path) -> Result<Self, TaskError> {
        Self::parse(&read_file(path)?, &path.display().to_string())
    }

    /// Reads a domain from bytes; `file` names them in messages. Never panics, whatever the
    /// bytes.
    ///
    /// # Errors
    /// If they are not a sound domain of this version.
    pub fn parse(bytes: &[u8], file: &str) -> Result<Self, TaskError> {
        let fault = |line, field: &str, problem: String, expected: &str| InputFault {
            file: file.into(),
            line,
            field: field.into(),
            problem,
            expected: expected.into(),
        };
        let json = |error: serde_json::Error| {
            let mut text = error.to_string();
            if let Some(at) = text.rfind(" at line ") {
                text.truncate(at);
            }
            let problem = format!("{text} (column {})", error.column());
            fault(Some(error.line()), "", problem, "a domain as `learn` writes it")
        };
        // The header first: another version may have other fields.
        let header: Header = serde_json::from_slice(bytes).map_err(json)?;
        if header.format.as_deref() != Some(FORMAT) {
            let problem = header.format.map_or("it is missing".into(), |f| format!("it is `{f}`"));
            return Err(fault(None, "format", problem, &format!("`{FORMAT}`")).into());
        }
        if header.version != Some(VERSION) {
            let problem = header.version.map_or("it is missing".into(), |v| format!("it is {v}"));
            let expected = format!("{VERSION}, the version that this program reads and writes");
            return Err(fault(None, "version", problem, &expected).into());
        }
        let parsed: File = serde_json::from_slice(bytes).map_err(json)?;
        Self::new(parsed.states, parsed.operators, parsed.goal, parsed.provenance).map_err(
            |error| match error {
                TaskError::BadDomain { reason } => {
                    fault(None, "", reason, "a domain that does not contradict itself").into()
                }
                other => other,
            },
        )
    }
}
