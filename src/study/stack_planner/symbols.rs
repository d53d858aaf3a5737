//! The vocabularies of the stack planner.

use super::kitchen::{Action, Kitchen, OTHER_GOAL, THINGS, Thing};
use crate::sim::{Real, Seed, VocabTag};
use crate::spa::{VocabError, Vocabulary, VocabularyBuilder, norm};

/// Tag of places, goals, things and effects.
pub(super) struct Base;

impl VocabTag for Base {
    const NAME: &'static str = "base";
}

/// Tag of the names of actions, which the stack holds.
pub(super) struct Acts;

impl VocabTag for Acts {
    const NAME: &'static str = "acts";
}

/// Tag of the steps of control.
pub(super) struct Control;

impl VocabTag for Control {
    const NAME: &'static str = "control";
}

/// Tag of the signals between planning and acting.
pub(super) struct Signals;

impl VocabTag for Signals {
    const NAME: &'static str = "signals";
}

/// Steps of control, in the order of the rules.
pub(super) const STEPS: [&str; 8] =
    ["PLAN", "GET_ACTION", "GET_PRECON", "SET_GOAL", "TOP", "POP", "SET", "DONE"];

/// Names that every kitchen has.
const ROLES: [&str; 4] = ["LOCATION", "GOAL", "EFFECTS", "OBJECT"];

/// All vocabularies. Those of one seed have the same pointers.
pub(super) struct Symbols {
    pub base: Vocabulary<Base>,
    pub acts: Vocabulary<Acts>,
    pub control: Vocabulary<Control>,
    pub signals: Vocabulary<Signals>,
}

impl Symbols {
    /// Draws the pointers. Below 256 dimensions they may be more similar than 0.1.
    pub fn new(kitchen: &Kitchen, dimensions: usize, seed: Seed) -> Result<Self, VocabError> {
        let mut places: Vec<&str> = Vec::new();
        for place in THINGS.iter().flat_map(|thing| thing.places) {
            if !places.contains(place) {
                places.push(place);
            }
        }
        let fluents = kitchen.fluents.iter().map(String::as_str);
        let names: Vec<&str> =
            ROLES.into_iter().chain(places).chain([OTHER_GOAL]).chain(fluents).collect();
        let things = THINGS.iter().map(|thing| thing.name);
        let base = drawn(dimensions, seed).pointers(names.iter().copied()).pointers(things);
        // The original keeps the names of actions in a copy of the base vocabulary.
        let acts = drawn(dimensions, seed).pointers(names).pointers(kitchen.names());
        Ok(Self {
            base: base.build()?,
            acts: acts.unitary(INDEX).build()?,
            control: drawn(dimensions, seed).pointers(STEPS).build()?,
            signals: drawn(dimensions, seed).pointers(["PLAN", "ACT", "DONE"]).build()?,
        })
    }

    /// Writes the pointer of a thing as an expression: its places and the goal that it serves, at length 1.
    pub fn thing(&self, thing: &Thing, goal: &str) -> Result<String, VocabError> {
        let goal = if thing.useful { goal } else { OTHER_GOAL };
        let places = thing.places.join(" + ");
        self.unit(&format!("LOCATION * ({places}) + GOAL * {goal}"))
    }

    /// Writes the pointer of an action as an expression: its thing and its effect, at length 1.
    pub fn action(&self, action: &Action, kitchen: &Kitchen) -> Result<String, VocabError> {
        let (thing, effect) = (THINGS[action.thing].name, &kitchen.fluents[action.adds]);
        self.unit(&format!("OBJECT * {thing} + EFFECTS * {effect}"))
    }

    fn unit(&self, expression: &str) -> Result<String, VocabError> {
        let length = norm(&self.base.parse(expression)?);
        Ok(format!("{} * ({expression})", 1.0 / length))
    }
}

/// The pointer whose powers are the depths of the stack.
pub(super) const INDEX: &str = "INDEX";

/// Greatest similarity of two names of a vocabulary of 256 dimensions or more.
const CEILING: Real = 0.1;

fn drawn<V: VocabTag>(dimensions: usize, seed: Seed) -> VocabularyBuilder<V> {
    let vocabulary = VocabularyBuilder::new(dimensions, seed);
    if dimensions < 256 { vocabulary.any_similarity() } else { vocabulary.max_similarity(CEILING) }
}
