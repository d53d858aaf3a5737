//! Versions 1 and 2 of the domain file: states that are Gaussians in the world frame, and actions with counts.

use serde::Deserialize;
use serde_json::Value;

use super::check_counts;
use super::fields::{FieldFault, StateNames, faulty_entry, is_unreadable};
use crate::robot::Pose;
use crate::task::domain::gaussian::{CountedOperator, GaussianState, Gaussians, Geometry};
use crate::task::domain::{Origin, Provenance, RelationalDomain};
use crate::task::propositional::Fault;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DomainFile {
    #[serde(rename = "format")]
    _format: String,
    #[serde(rename = "version")]
    _version: u64,
    provenance: Provenance,
    goal: Option<String>,
    states: Vec<State>,
    operators: Vec<Operator>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct State {
    name: String,
    kind: String,
    learned: Option<Geometry>,
    // Version 1 has the geometry here.
    count: Option<usize>,
    distinct: Option<usize>,
    origin: Option<Origin>,
    mean: Option<Pose>,
    covariance: Option<[[f64; 6]; 6]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Operator {
    name: String,
    /// The kind of the object that moves, in versions 1 and 2. That of the state that it enters says the same.
    #[serde(rename = "kind", default)]
    _kind: Option<String>,
    #[serde(rename = "parameters", default)]
    _parameters: Vec<Parameter>,
    from: Option<String>,
    to: String,
    preconditions: Vec<String>,
    effects: Vec<String>,
    absent: Vec<String>,
    removes: Vec<String>,
    evidence: Evidence,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Parameter {
    #[serde(rename = "name")]
    _name: String,
    #[serde(rename = "kind")]
    _kind: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Evidence {
    instances: u32,
    before: Vec<u32>,
    change: Vec<i32>,
}

/// Returns the first field that cannot be read.
pub(super) fn faulty_field(file: &Value) -> String {
    if file.get("provenance").is_some_and(is_unreadable::<Provenance>) {
        return "provenance".into();
    }
    if file.get("goal").is_some_and(|goal| !goal.is_string() && !goal.is_null()) {
        return "goal".into();
    }
    let states = faulty_entry::<State>(file, "states");
    states.or_else(|| faulty_entry::<Operator>(file, "operators")).unwrap_or_default()
}

impl State {
    fn gaussian(self, at: usize) -> Result<GaussianState, FieldFault> {
        let Self { name, kind, learned, count, distinct, origin, mean, covariance } = self;
        let flat = || {
            let (count, distinct, origin) = (count?, distinct?, origin?);
            Some(Geometry { count, distinct, origin, mean: mean?, covariance: covariance? })
        };
        let Some(geometry) = learned.or_else(flat) else {
            let expected = "the geometry of a learned state";
            return Err(FieldFault::found(&format!("states[{at}].learned"), None, expected));
        };
        Ok(GaussianState { name, kind, geometry })
    }
}

impl DomainFile {
    /// Returns the domain as the present version has it.
    pub fn migrate(self) -> Result<RelationalDomain, FieldFault> {
        check_counts(self.states.len(), self.operators.len())?;
        let states = self.states.iter().map(|s| &s.name);
        let names = StateNames::new(states, self.operators.iter().map(|o| &o.name))?;
        let goal = self.goal.map(|g| names.find(&g, || "goal".into())).transpose()?;
        let mut operators = Vec::with_capacity(self.operators.len());
        for (index, entry) in self.operators.into_iter().enumerate() {
            let own = |what: &str| format!("operators[{index}].{what}");
            let one = |name: &str, what: &str| names.find(name, || own(what));
            let all = |list: &[String], what: &str| names.find_all(list, &own(what));
            let Evidence { instances, before, change } = entry.evidence;
            for (list, length) in [("before", before.len()), ("change", change.len())] {
                if length != names.len() {
                    let problem = format!("action `{}` has {length} counts", entry.name);
                    let expected = format!("{}, one for each state", names.len());
                    let fault = FieldFault::from(Fault::new(problem, expected));
                    return Err(fault.at(format!("operators[{index}].evidence.{list}")));
                }
            }
            let to = one(&entry.to, "to")?;
            let effects = all(&entry.effects, "effects")?.into_iter().filter(|s| *s != to);
            let effects = effects.map(|s| (s, usize::try_from(change[s]).unwrap_or(0)));
            all(&entry.removes, "removes")?;
            operators.push(CountedOperator {
                from: entry.from.map(|from| one(&from, "from")).transpose()?,
                to,
                effects: effects.collect(),
                preconditions: all(&entry.preconditions, "preconditions")?,
                absent: all(&entry.absent, "absent")?,
                name: entry.name,
                instances: instances as usize,
                before,
            });
        }
        let states = self.states.into_iter().enumerate();
        let states = states.map(|(at, s)| s.gaussian(at)).collect::<Result<_, _>>()?;
        // How many demonstrations reached the goal, the old versions do not say.
        let goal = goal.map(|goal| (goal, [1, 1]));
        let provenance = self.provenance;
        Ok(Gaussians { states, operators, goal, provenance }.domain()?)
    }
}
