//! The domain file. Version 3 is written.
//!
//! States are referred to by name, so that people can read the file. Versions 1 and 2 hold domains without frames. They
//! are read, too, and migrated.

mod fields;
mod old;
mod shape;

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{
    Before, Condition, Displacement, FrameState, GoalTerm, Need, NeedVerdict, Provenance, Quantity,
    RelationalDomain, RelationalOperator, SideEffect, SubKinds, Subject,
};
use crate::files::{Limit, read_file};
use crate::sim::plain;
use crate::task::error::{InputFault, TaskError, json_problem};
use crate::task::propositional::Fault;
use fields::{FieldFault, StateNames};

/// Value of the `format` field.
const FORMAT: &str = "symbolt-domain";
/// Greatest number of states and of actions.
const MAX_COUNT: usize = 2_000;
/// Greatest number of places of all states. Planning compares each with every other.
const MAX_PLACES: usize = 2_000;
/// Version of the layout that is written.
const VERSION: u64 = 3;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct DomainFile {
    format: String,
    version: u64,
    provenance: Provenance,
    noise_m: f64,
    noise_rad: f64,
    /// Kinds of fixtures that stand level, each with the side that is up.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    level: BTreeMap<String, [f64; 3]>,
    goals: Vec<GoalEntry>,
    states: Vec<FrameState>,
    operators: Vec<OperatorEntry>,
    /// Kinds that are divided by an attribute.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    sub_kinds: Vec<SubKinds>,
    /// Sentences by symbol. Older files have none.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    words: BTreeMap<String, String>,
}

/// For each of which objects a term of the goal asks.
#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Each {
    Reference,
    Object,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct GoalEntry {
    state: String,
    /// Further states that count as well.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    or: Vec<String>,
    /// `null`: the term asks for a number of objects in all.
    each: Option<Each>,
    at_least: usize,
    /// State in which a reference has to be for its objects to count.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    references_in: Option<String>,
    held: usize,
    of: usize,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct NeedEntry {
    state: String,
    /// Further states that fulfil the condition.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    or: Vec<String>,
    subject: Subject,
    verdict: NeedVerdict,
    holds: bool,
    least: usize,
    /// Whether all objects of the kind have to be in the state.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    every: bool,
    held: usize,
    of: usize,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SideEffectEntry {
    state: String,
    subject: Subject,
    begins: bool,
    changed: usize,
    of: usize,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct BeforeEntry {
    place: usize,
    one_of: Vec<PlaceEntry>,
}

/// A place of a state, by its index.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PlaceEntry {
    state: String,
    place: usize,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct OperatorEntry {
    name: String,
    from: Vec<String>,
    to: String,
    needs: Vec<NeedEntry>,
    /// What has to be at the target before an object is put at a place.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    order: Vec<BeforeEntry>,
    side_effects: Vec<SideEffectEntry>,
    displacement: Option<Displacement>,
    instances: usize,
    never_seen: Vec<String>,
}

impl RelationalDomain {
    /// Writes the domain as JSON text, version 3 of the domain file.
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
    /// [`TaskError::File`] if the file cannot be read; otherwise as [`RelationalDomain::parse`].
    pub fn read(path: &Path) -> Result<Self, TaskError> {
        Self::parse(&read_file(path, Limit::DOMAIN)?, &path.display().to_string())
    }

    /// Reads a domain from the bytes of a domain file of version 1, 2 or 3. `file` is the file's name in error messages.
    /// Never panics.
    ///
    /// # Errors
    /// [`TaskError::Input`] if the bytes are not a valid domain file.
    pub fn parse(bytes: &[u8], file: &str) -> Result<Self, TaskError> {
        let fault = |line, FieldFault { field, problem, expected }: FieldFault| InputFault {
            file: file.into(),
            line,
            field,
            problem,
            expected,
        };
        let json = |error: serde_json::Error, field: String| {
            let problem = format!("{} (column {})", json_problem(&error), error.column());
            let expected = "a domain file as written by `symbolt learn`".into();
            fault(Some(error.line()), FieldFault { field, problem, expected })
        };
        let value: Value = serde_json::from_slice(bytes).map_err(|e| json(e, String::new()))?;
        // Parse the text again: only the text gives line numbers, and `value` silently keeps the last of two fields
        // with the same name.
        let domain = if shape::check(&value).map_err(|f| fault(None, f))? == VERSION {
            let parsed = serde_json::from_slice::<DomainFile>(bytes);
            parsed.map_err(|e| json(e, shape::faulty_field(&value)))?.resolve()
        } else {
            let parsed = serde_json::from_slice::<old::DomainFile>(bytes);
            parsed.map_err(|e| json(e, old::faulty_field(&value)))?.migrate()
        };
        Ok(domain.map_err(|f| fault(None, f))?)
    }
}

impl From<&RelationalDomain> for DomainFile {
    fn from(domain: &RelationalDomain) -> Self {
        let name = |state: usize| domain.states[state].name.clone();
        let names = |states: &[usize]| states.iter().map(|s| name(*s)).collect();
        let need = |n: &Need| NeedEntry {
            state: name(n.condition.state),
            or: names(&n.or),
            subject: n.condition.subject,
            verdict: n.verdict,
            holds: n.holds,
            least: n.least,
            every: n.every,
            held: n.held,
            of: n.of,
        };
        let effect = |e: &SideEffect| SideEffectEntry {
            state: name(e.condition.state),
            subject: e.condition.subject,
            begins: e.begins,
            changed: e.changed,
            of: e.of,
        };
        let place =
            |(state, place): &(usize, usize)| PlaceEntry { state: name(*state), place: *place };
        let before = |b: &Before| BeforeEntry {
            place: b.place,
            one_of: b.one_of.iter().map(place).collect(),
        };
        let operator = |o: &RelationalOperator| OperatorEntry {
            name: o.name.clone(),
            from: names(&o.from),
            to: name(o.to),
            needs: o.needs.iter().map(need).collect(),
            order: o.order.iter().map(before).collect(),
            side_effects: o.side_effects.iter().map(effect).collect(),
            displacement: o.displacement,
            instances: o.instances,
            never_seen: names(&o.never_seen),
        };
        let goal = |g: &GoalTerm| {
            let (each, at_least) = match g.quantity {
                Quantity::AtLeast(n) => (None, n),
                Quantity::EachReference(n) => (Some(Each::Reference), n),
                Quantity::EachObject => (Some(Each::Object), 1),
            };
            let references_in = g.reference.map(name);
            GoalEntry {
                state: name(g.state),
                or: names(&g.or),
                each,
                at_least,
                references_in,
                held: g.held,
                of: g.of,
            }
        };
        Self {
            format: FORMAT.into(),
            version: VERSION,
            provenance: domain.provenance.clone(),
            noise_m: domain.noise_m,
            noise_rad: domain.noise_rad,
            level: domain.level.clone(),
            goals: domain.goals.iter().map(goal).collect(),
            states: domain.states.clone(),
            operators: domain.operators.iter().map(operator).collect(),
            sub_kinds: domain.sub_kinds.clone(),
            words: domain.words.clone(),
        }
    }
}

impl DomainFile {
    fn resolve(self) -> Result<RelationalDomain, FieldFault> {
        check_counts(self.states.len(), self.operators.len())?;
        let places: usize = self.states.iter().map(|state| state.places.len()).sum();
        if places > MAX_PLACES {
            let problem = format!("its states have {places} places");
            return Err(Fault::new(problem, format!("at most {MAX_PLACES}")).into());
        }
        let states = self.states.iter().map(|s| &s.name);
        let names = StateNames::new(states, self.operators.iter().map(|o| &o.name))?;
        let mut goals = Vec::with_capacity(self.goals.len());
        for (index, entry) in self.goals.iter().enumerate() {
            let quantity = match entry.each {
                None => Quantity::AtLeast(entry.at_least),
                Some(Each::Reference) => Quantity::EachReference(entry.at_least),
                Some(Each::Object) => Quantity::EachObject,
            };
            let state = names.find(&entry.state, || format!("goals[{index}].state"))?;
            let field = || format!("goals[{index}].references_in");
            let reference = entry.references_in.as_ref().map(|name| names.find(name, field));
            let reference = reference.transpose()?;
            let or = names.find_all(&entry.or, &format!("goals[{index}].or"))?;
            let (held, of) = (entry.held, entry.of);
            goals.push(GoalTerm { state, or, quantity, reference, held, of });
        }
        let mut operators = Vec::with_capacity(self.operators.len());
        for (index, entry) in self.operators.into_iter().enumerate() {
            let own = |what: &str| format!("operators[{index}].{what}");
            let need = |(i, n): (usize, &NeedEntry)| {
                let state = names.find(&n.state, || own(&format!("needs[{i}].state")))?;
                let condition = Condition { state, subject: n.subject };
                let or = names.find_all(&n.or, &own(&format!("needs[{i}].or")))?;
                let NeedEntry { verdict, holds, least, every, held, of, .. } = *n;
                Ok::<_, FieldFault>(Need { condition, or, verdict, holds, least, every, held, of })
            };
            let effect = |(i, e): (usize, &SideEffectEntry)| {
                let state = names.find(&e.state, || own(&format!("side_effects[{i}].state")))?;
                let condition = Condition { state, subject: e.subject };
                Ok::<_, FieldFault>(SideEffect {
                    condition,
                    begins: e.begins,
                    changed: e.changed,
                    of: e.of,
                })
            };
            let before = |(i, b): (usize, &BeforeEntry)| {
                let place = |(j, p): (usize, &PlaceEntry)| {
                    let field = || own(&format!("order[{i}].one_of[{j}].state"));
                    Ok::<_, FieldFault>((names.find(&p.state, field)?, p.place))
                };
                let one_of = b.one_of.iter().enumerate().map(place).collect::<Result<_, _>>()?;
                Ok::<_, FieldFault>(Before { place: b.place, one_of })
            };
            operators.push(RelationalOperator {
                from: names.find_all(&entry.from, &own("from"))?,
                to: names.find(&entry.to, || own("to"))?,
                needs: entry.needs.iter().enumerate().map(need).collect::<Result<_, _>>()?,
                order: entry.order.iter().enumerate().map(before).collect::<Result<_, _>>()?,
                side_effects: {
                    let effects = entry.side_effects.iter().enumerate().map(effect);
                    effects.collect::<Result<_, _>>()?
                },
                never_seen: names.find_all(&entry.never_seen, &own("never_seen"))?,
                name: entry.name,
                displacement: entry.displacement,
                instances: entry.instances,
            });
        }
        let known = |name: &String| {
            let mut operators = operators.iter().map(|o| &o.name);
            self.states.iter().any(|s| s.name == *name) || operators.any(|o| o == name)
        };
        if let Some(name) = self.words.keys().find(|name| !known(name)) {
            let problem = format!("`{}` is no state and no action", plain(name));
            let field = "words".to_owned();
            return Err(FieldFault { field, problem, expected: "their names".into() });
        }
        let mut domain = RelationalDomain {
            states: self.states,
            operators,
            goals,
            noise_m: self.noise_m,
            noise_rad: self.noise_rad,
            level: self.level,
            provenance: self.provenance,
            sub_kinds: self.sub_kinds,
            words: self.words,
        };
        if let Some(fault) = domain.fault() {
            return Err(fault.into());
        }
        domain.complete_words();
        Ok(domain)
    }
}

/// Refuses a domain file with too many states or actions.
fn check_counts(states: usize, operators: usize) -> Result<(), Fault> {
    let counts = [("states", states), ("actions", operators)];
    match counts.into_iter().find(|(_, count)| *count > MAX_COUNT) {
        Some((what, count)) => {
            Err(Fault::new(format!("it has {count} {what}"), format!("at most {MAX_COUNT}")))
        }
        None => Ok(()),
    }
}
