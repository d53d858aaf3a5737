//! The vocabularies of the stack planner.

use std::ops::Range;
use std::sync::Arc;

use super::kitchen::{Action, Kitchen, OTHER_GOAL, THINGS, Thing};
use crate::sim::{Real, Seed, VocabTag};
use crate::spa::{Algebra, VocabError, Vocabulary, VocabularyBuilder, dot, norm};

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

    /// Returns what exact maths needs to read the stack.
    pub fn names_of_actions(&self, kitchen: &Kitchen) -> Result<Names, VocabError> {
        let names = kitchen.names().into_iter().map(|name| Ok(self.acts.get(name)?.to_vec()));
        let (dim, algebra) = (self.acts.dim(), self.acts.algebra().clone());
        let mut higher = vec![0.0; dim];
        algebra.inverse_into(&self.acts.get(INDEX)?, &mut higher);
        let actions = names.collect::<Result<_, VocabError>>()?;
        Ok(Names { actions, steps: kitchen.steps(), higher, algebra })
    }

    fn unit(&self, expression: &str) -> Result<String, VocabError> {
        let length = norm(&self.base.parse(expression)?);
        Ok(format!("{} * ({expression})", 1.0 / length))
    }
}

/// Reads a stack in exact maths: no part of the planner, a measure of it.
pub(super) struct Names {
    actions: Vec<Vec<Real>>,
    /// Number of actions of the shortest plan.
    steps: usize,
    /// The inverse of [`INDEX`], which brings each action up by one.
    higher: Vec<Real>,
    algebra: Arc<dyn Algebra>,
}

impl Names {
    /// Returns the positions of the actions of the shortest plan: the last ones of the kitchen.
    pub fn shortest(&self) -> Range<usize> {
        self.actions.len().saturating_sub(self.steps)..self.actions.len()
    }

    /// Returns how many actions from the top of a stack on are those of the shortest plan: at each depth the action whose
    /// name is most similar counts.
    pub fn in_order(&self, stack: &[Real]) -> usize {
        let (mut stack, mut next) = (stack.to_vec(), vec![0.0; stack.len()]);
        let mut work = self.algebra.scratch(stack.len());
        let is_there = |wanted: &usize| {
            let similarity = |action: usize| dot(&self.actions[action], &stack);
            let all = 0..self.actions.len();
            let best = all.max_by(|a, b| similarity(*a).total_cmp(&similarity(*b)));
            self.algebra.bind_into(&stack, &self.higher, &mut next, &mut work);
            std::mem::swap(&mut stack, &mut next);
            best == Some(*wanted)
        };
        self.shortest().take_while(is_there).count()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stack_is_read_from_its_top_up_to_the_first_action_that_is_not_next() {
        let kitchen = Kitchen::kettle(4).expect("four actions");
        let symbols = Symbols::new(&kitchen, 256, Seed::new(1)).expect("symbols");
        let names = symbols.names_of_actions(&kitchen).expect("names");
        let read = |stack: &str| {
            let stack = symbols.acts.parse(stack).expect("a stack").to_vec();
            names.in_order(&stack)
        };
        let [put, fill, plug, boil] =
            ["PUT_KETTLE_UNDER_TAP", "FILL_KETTLE_FROM_TAP", "PLUG_IN_KETTLE", "BOIL_KETTLE"];
        let third = format!("{plug} * INDEX * INDEX");
        let fourth = format!("{boil} * INDEX * INDEX * INDEX");
        assert_eq!(read(&format!("{put} + {fill} * INDEX + {third} + {fourth}")), 4);
        // A stack that lost an action, one in the wrong order, and one without its top.
        assert_eq!(read(&format!("{put} + {fill} * INDEX + {fourth}")), 2);
        assert_eq!(read(&format!("{put} + {plug} * INDEX + {fill} * INDEX * INDEX")), 1);
        assert_eq!(read(&format!("{fill} * INDEX + {third} + {fourth}")), 0);
    }
}
