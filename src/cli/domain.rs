//! Domain files of both kinds: with frames (version 3) and without (versions 1 and 2).

use std::path::Path;

use serde::Deserialize;
use serde_json::Value;
use symbolt::files::{Limit, read_file};
use symbolt::task::relational::RelationalDomain;
use symbolt::task::{Domain, TaskError};

/// A domain as a command reads it.
pub(crate) enum AnyDomain {
    /// States in frames and operators with parameters.
    Relational(RelationalDomain),
    /// States in the world frame, or states without geometry.
    Plain(Domain),
}

/// The field that tells the kinds apart. The other fields are skipped without being kept.
#[derive(Deserialize)]
struct Head {
    version: Option<Value>,
}

impl AnyDomain {
    /// Reads a domain from a file, or from standard input if `path` is `-`.
    pub fn read(path: &Path) -> Result<Self, TaskError> {
        Self::parse(&read_file(path, Limit::DOMAIN)?, &path.display().to_string())
    }

    /// Reads a domain from the bytes of a file of any version.
    pub fn parse(bytes: &[u8], name: &str) -> Result<Self, TaskError> {
        match serde_json::from_slice(bytes).ok().and_then(|Head { version }| version?.as_u64()) {
            Some(1 | 2) => Domain::parse(bytes, name).map(Self::Plain),
            _ => RelationalDomain::parse(bytes, name).map(Self::Relational),
        }
    }

    pub fn states(&self) -> usize {
        match self {
            Self::Relational(domain) => domain.states.len(),
            Self::Plain(domain) => domain.states().len(),
        }
    }

    pub fn actions(&self) -> usize {
        match self {
            Self::Relational(domain) => domain.operators.len(),
            Self::Plain(domain) => domain.operators().len(),
        }
    }
}
