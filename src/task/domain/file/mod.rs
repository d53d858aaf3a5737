//! The domain file: JSON with a format and a version, checked completely when it is read.
//!
//! Operators refer to states by name, so that people can read the file. Version 2 is written. Version 1, in which every
//! state had geometry, can still be read.

pub(crate) mod fields;
mod shape;
mod v1;

use std::collections::HashMap;
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::files::{Limit, read_file};
use crate::task::domain::check::{check_counts, check_names};
use crate::task::domain::{
    Domain, Evidence, LearnedState, Operator, Parameter, Provenance, State, StateId,
};
use crate::task::error::{InputFault, TaskError, json_problem};
use fields::FieldFault;

/// Value of the `format` field.
const FORMAT: &str = "symbolt-domain";

/// Version of the layout that is written.
const VERSION: u64 = 2;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct DomainFile {
    format: String,
    version: u64,
    /// Omitted if the domain was not learned.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    provenance: Option<Provenance>,
    goal: Option<String>,
    states: Vec<StateEntry>,
    operators: Vec<OperatorEntry>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StateEntry {
    name: String,
    kind: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    learned: Option<LearnedState>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct OperatorEntry {
    name: String,
    parameters: Vec<Parameter>,
    from: Option<String>,
    to: String,
    preconditions: Vec<String>,
    effects: Vec<String>,
    absent: Vec<String>,
    removes: Vec<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    evidence: Option<Evidence>,
}

impl Domain {
    /// Writes the domain as JSON text.
    ///
    /// # Errors
    /// [`TaskError::Json`] if serialisation fails. This is not known to happen.
    pub fn to_json(&self) -> Result<String, TaskError> {
        let file = DomainFile::from(self);
        let failed = |source| TaskError::Json { what: "the domain", source };
        let mut text = serde_json::to_string_pretty(&file).map_err(failed)?;
        text.push('\n');
        Ok(text)
    }

    /// Reads a domain from a file, or from standard input if `path` is `-`.
    ///
    /// # Errors
    /// [`TaskError::File`] if the file cannot be read; [`TaskError::Input`] if it is not a valid domain file of version
    /// 1 or 2.
    pub fn read(path: &Path) -> Result<Self, TaskError> {
        Self::parse(&read_file(path, Limit::DOMAIN)?, &path.display().to_string())
    }

    /// Reads a domain from the bytes of a domain file. `file` is the file's name in error messages. Never panics.
    ///
    /// # Errors
    /// [`TaskError::Input`] if the bytes are not a valid domain file of version 1 or 2.
    pub fn parse(bytes: &[u8], file: &str) -> Result<Self, TaskError> {
        let fault = |line, field: &str, problem: String, expected: &str| InputFault {
            file: file.into(),
            line,
            field: field.into(),
            problem,
            expected: expected.into(),
        };
        let json = |error: serde_json::Error, field: String| {
            let problem = format!("{} (column {})", json_problem(&error), error.column());
            fault(
                Some(error.line()),
                &field,
                problem,
                "a domain file as written by `symbolt learn`",
            )
        };
        let value: Value = serde_json::from_slice(bytes).map_err(|e| json(e, String::new()))?;
        let shaped = |f: FieldFault| fault(None, &f.field, f.problem, &f.expected);
        let version = shape::check(&value).map_err(shaped)?;
        // Parse the text again instead of using `value`: only the text gives line numbers, and `value` silently keeps
        // the last of two fields with the same name.
        let parsed: DomainFile = if version == v1::VERSION {
            let parsed = serde_json::from_slice::<v1::DomainFile>(bytes);
            parsed.map_err(|e| json(e, v1::faulty_field(&value)))?.into()
        } else {
            let faulty = || shape::faulty_field::<StateEntry, OperatorEntry>(&value);
            serde_json::from_slice(bytes).map_err(|e| json(e, faulty()))?
        };
        let invalid = |reason: String| {
            // Most reasons already say what was expected.
            let (problem, expected) = reason
                .split_once("; expected ")
                .unwrap_or((reason.as_str(), "a consistent domain"));
            TaskError::from(fault(None, "", problem.into(), expected))
        };
        check_counts(parsed.states.len(), parsed.operators.len()).map_err(invalid)?;
        // Names first: an invalid name must not be reported as a reference to an unknown state.
        let states = parsed.states.iter().map(|s| &s.name);
        check_names(states.chain(parsed.operators.iter().map(|o| &o.name))).map_err(invalid)?;
        let Resolved { states, operators, goal, provenance } = parsed.resolve().map_err(shaped)?;
        Self::new(states, operators, goal, provenance).map_err(|error| match error {
            TaskError::BadDomain { reason } => invalid(reason),
            other => other,
        })
    }
}

impl From<&Domain> for DomainFile {
    fn from(domain: &Domain) -> Self {
        let name = |state: StateId| domain[state].name.clone();
        let names = |states: &[StateId]| states.iter().map(|s| name(*s)).collect();
        let state = |s: &State| StateEntry {
            name: s.name.clone(),
            kind: s.kind.clone(),
            learned: s.learned.clone(),
        };
        let operator = |o: &Operator| OperatorEntry {
            name: o.name.clone(),
            parameters: o.parameters.clone(),
            from: o.from.map(name),
            to: name(o.to),
            preconditions: names(&o.preconditions),
            effects: names(&o.effects),
            absent: names(&o.absent),
            removes: names(&o.removes),
            evidence: o.evidence.clone(),
        };
        Self {
            format: FORMAT.into(),
            version: VERSION,
            provenance: domain.provenance().cloned(),
            goal: domain.goal().map(name),
            states: domain.states().iter().map(state).collect(),
            operators: domain.operators().iter().map(operator).collect(),
        }
    }
}

/// The tables with ids in place of names.
struct Resolved {
    states: Vec<State>,
    operators: Vec<Operator>,
    goal: Option<StateId>,
    provenance: Option<Provenance>,
}

impl DomainFile {
    fn resolve(self) -> Result<Resolved, FieldFault> {
        let names: Vec<String> = self.states.iter().map(|s| s.name.clone()).collect();
        let places: HashMap<&str, usize> =
            names.iter().enumerate().map(|(at, name)| (name.as_str(), at)).collect();
        let find = |name: &str, field: &dyn Fn() -> String| {
            let at = places.get(name).copied();
            at.map(StateId::new).ok_or_else(|| FieldFault::no_state(name, field(), &names))
        };
        let goal = self.goal.map(|g| find(&g, &|| "goal".into())).transpose()?;
        let mut operators = Vec::with_capacity(self.operators.len());
        for (index, entry) in self.operators.into_iter().enumerate() {
            let one = |name: &str, what| find(name, &|| format!("operators[{index}].{what}"));
            let all = |list: &[String], what| -> Result<Vec<StateId>, FieldFault> {
                let place = |i| move || format!("operators[{index}].{what}[{i}]");
                list.iter().enumerate().map(|(i, name)| find(name, &place(i))).collect()
            };
            operators.push(Operator {
                from: entry.from.map(|from| one(&from, "from")).transpose()?,
                to: one(&entry.to, "to")?,
                preconditions: all(&entry.preconditions, "preconditions")?,
                effects: all(&entry.effects, "effects")?,
                absent: all(&entry.absent, "absent")?,
                removes: all(&entry.removes, "removes")?,
                name: entry.name,
                parameters: entry.parameters,
                evidence: entry.evidence,
            });
        }
        let states = self.states.into_iter();
        let states = states.map(|s| State { name: s.name, kind: s.kind, learned: s.learned });
        Ok(Resolved { states: states.collect(), operators, goal, provenance: self.provenance })
    }
}
