//! Worlds as data: kinds of objects, states, rules, and the demonstrator's jobs. The worlds stand in `kinds/*.json`.

use std::sync::LazyLock;

use serde::Deserialize;
use serde_json::Value;

use super::truth::{Need, TrueGoal, TrueState};

/// How many objects of a kind there are.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum Count {
    /// A number drawn from a range, the same in demonstrations and tests.
    Any(usize, usize),
    /// A number drawn from one range in demonstrations and from another in tests.
    Differs { shown: (usize, usize), test: (usize, usize) },
    /// As many as there are objects of another kind, and up to `more` more.
    Like { kind: &'static str, more: usize },
}

impl Default for Count {
    fn default() -> Self {
        Self::Any(1, 1)
    }
}

/// Where an object is when a run begins.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum Start {
    /// In a state, relative to a drawn reference object.
    In(&'static str),
    /// Alternately in the first and the second state; drawn in tests.
    Either(&'static str, &'static str),
    /// In one state in the first `demos` demonstrations and in the usual state in the others; drawn in tests.
    Seldom { usual: &'static str, other: &'static str, demos: usize },
    /// Always at the same point, in no state.
    Fixed([f64; 3]),
    /// Anywhere in a rectangle of the world `[[x, x], [y, y]]`, turned by any angle, in no state.
    Anywhere { x: [f64; 2], y: [f64; 2], z: f64 },
}

/// How an object lies on a surface if its orientation is free.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Lie {
    /// With its z axis upwards.
    #[default]
    Flat,
    /// On its side, with its z axis horizontal.
    Side,
    /// In any orientation.
    Tumbled,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Kind {
    pub name: &'static str,
    #[serde(default)]
    pub count: Count,
    /// The kind is there in every second run: 0 in even demonstrations, 1 in odd ones; drawn in tests.
    #[serde(default)]
    pub in_turn: Option<usize>,
    pub start: Start,
    /// Whether no hand can move the object.
    #[serde(default)]
    pub fixture: bool,
    /// Whether the object can be moved while something rests on it or in it.
    #[serde(default)]
    pub carries: bool,
    #[serde(default)]
    pub lie: Lie,
    /// Radius of the footprint, in metres.
    #[serde(default = "small")]
    pub radius_m: f64,
    /// Half of the heights that objects of the kind have in turn, in metres. An object stands so much above its place.
    #[serde(default)]
    pub half_heights_m: Vec<f64>,
}

fn small() -> f64 {
    0.025
}

/// When a job is complete.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Quota {
    /// So many objects are in the state.
    Total(usize),
    /// A number of objects between these two is in the state. The number is drawn for each run.
    Drawn(usize, usize),
    /// Every reference object has an object in the state.
    EachReference,
    /// Every object of the kind is in the state.
    EachObject,
    /// No object is left in the given state.
    Empty(&'static str),
    /// An object is in the state or in the given one, whichever came first.
    Unless(&'static str),
}

/// Something that the demonstrator does.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Job {
    pub to: &'static str,
    pub quota: Quota,
    /// States of the jobs that must be complete before this one begins.
    #[serde(default)]
    pub after: Vec<&'static str>,
    /// The object stays where it is and is only turned.
    #[serde(default)]
    pub in_place: bool,
    /// The job is done in every second run, as [`Kind::in_turn`].
    #[serde(default)]
    pub in_turn: Option<usize>,
}

/// An object that moves without a hand: while some object is in `when`, objects of the kind are in `then`, otherwise in
/// `otherwise`.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Trigger {
    pub when: &'static str,
    pub then: &'static str,
    pub otherwise: &'static str,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Spec {
    pub name: &'static str,
    /// What is difficult about the world.
    pub about: &'static str,
    pub kinds: Vec<Kind>,
    /// The states. An object enters a state by its rules alone.
    pub states: Vec<TrueState>,
    pub jobs: Vec<Job>,
    #[serde(default)]
    pub triggers: Vec<Trigger>,
    /// The demonstrator always completes the job for the first state before the job for the second.
    #[serde(default)]
    pub habits: Vec<(&'static str, &'static str)>,
    pub goal: Vec<TrueGoal>,
    /// A second goal; either of the two suffices. Empty if there is one.
    #[serde(default)]
    pub or_goal: Vec<TrueGoal>,
    /// Whether the demonstrator uses the whole tolerance of a place.
    #[serde(default)]
    pub careless: bool,
    /// Probability that another hand moves a loose object between two moves.
    #[serde(default)]
    pub bystander: f64,
}

/// The entries of the worlds, in their order: the plain ones and those with variety.
static ENTRIES: LazyLock<[Vec<Value>; 2]> = LazyLock::new(|| {
    let mut entries: Vec<Value> = Vec::new();
    [include_str!("kinds/plain.json"), include_str!("kinds/varied.json")].map(|text| {
        let own: Vec<Value> = sound(serde_json::from_str(text));
        let from = entries.len();
        for entry in own {
            let like = entries.iter().find(|e| entry.get("like") == e.get("name"));
            let mut world = like.cloned().unwrap_or(Value::Null);
            patch(&mut world, entry);
            if let Value::Object(fields) = &mut world {
                fields.remove("like");
            }
            entries.push(world);
        }
        entries[from..].to_vec()
    })
});

/// Returns what was read. The files are part of the program, and tests read each entry.
fn sound<T>(read: Result<T, serde_json::Error>) -> T {
    read.unwrap_or_else(|error| panic!("an entry of a world is not sound: {error}"))
}

/// Changes an entry: an item of a list changes the item of the same name or is added; other fields are replaced.
fn patch(value: &mut Value, change: Value) {
    let key = |item: &Value| ["name", "to"].iter().find_map(|key| item.get(key).cloned());
    match (value, change) {
        (Value::Object(fields), change @ Value::Object(_)) if key(&change).is_some() => {
            for (name, change) in change.as_object().cloned().unwrap_or_default() {
                patch(fields.entry(name).or_insert(Value::Null), change);
            }
        }
        (Value::Array(items), Value::Array(changes))
            if changes.iter().all(|c| key(c).is_some()) =>
        {
            for change in changes {
                match items.iter_mut().find(|item| key(item) == key(&change)) {
                    Some(item) => patch(item, change),
                    None => items.push(change),
                }
            }
        }
        (value, change) => *value = change,
    }
}

impl Spec {
    /// The worlds of one of the two files.
    pub fn read(varied: bool) -> impl Iterator<Item = Self> {
        let entries = &ENTRIES[usize::from(varied)];
        entries.iter().map(|entry| sound(Self::deserialize(entry)))
    }

    /// What the world demands of a move into a state.
    pub fn needs_of(&self, state: &str) -> impl Iterator<Item = Need> {
        let rules = self.states.iter().filter(move |rule| rule.name == state);
        rules.flat_map(|rule| rule.needs.iter().chain(&rule.reach).copied())
    }
}
