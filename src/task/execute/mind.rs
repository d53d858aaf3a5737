//! Minds: how the executor understands a snapshot, and how it carries out an action.
//!
//! The closed loop is the same for all domains. A [`Mind`] says which states hold, which goal to ask for, and which
//! parts an action can move where. [`Propositional`] is the mind for a [`Domain`](crate::task::domain::Domain);
//! `relational` has the mind for a relational domain.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::choose;
use super::recovery::attempts::{Attempts, What};
use crate::task::domain::{ActionId, Classifier, Grounding, Pose, Snapshot, StateId, WorldState};
use crate::task::error::TaskError;
use crate::task::event::{Chosen, InNoState};
use crate::task::planner::Decider;
use crate::task::scene::Scene;
use crate::task::skill::Target;

/// A snapshot of the scene, as sensed.
pub(super) struct Seen {
    pub snapshot: Snapshot,
    /// For each object of the snapshot, the index of its part; `None` for a landmark.
    pub parts: Vec<Option<usize>>,
}

/// What a mind remembers of one object from look to look.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Remembered {
    pub pose: Pose,
    /// State, place and reference.
    pub fact: Option<(usize, usize, Option<usize>)>,
    /// Pose in which the state was found.
    pub taken: Pose,
}

/// What a mind remembers from look to look. Empty before the first look.
pub(super) type Memory = Vec<Remembered>;

/// What a mind makes of a snapshot.
pub(super) struct Belief {
    /// The states that hold.
    pub present: WorldState,
    /// The goal to ask for. If it holds, the episode's goal is met.
    pub goal: StateId,
    /// The parts that are in a state, or of a kind without states.
    pub explained: Vec<usize>,
    /// The parts in no state of kinds with states.
    pub in_no_state: Vec<InNoState>,
    /// Whether the scene has objects that the planner graph does not know.
    pub outgrown: bool,
}

/// A part that an action can move, and its target.
pub(super) struct Choice {
    pub part: usize,
    pub target: Target,
    /// What is tried, for the failure memory.
    pub what: What,
    /// Part that the part is put onto, into or beside.
    pub reference: Option<usize>,
    /// The choice in words; `None` for a propositional domain.
    pub chosen: Option<Chosen>,
}

/// The choices for an action, the best first.
#[derive(Default)]
pub(super) struct Choices {
    pub all: Vec<Choice>,
    /// Choices that were left out because their target is occupied.
    pub blocked: Vec<Choice>,
}

pub(super) trait Mind: Send + Sync {
    fn planner(&self) -> &dyn Decider;

    /// Returns every goal that the mind may ask for.
    fn goals(&self) -> Vec<StateId>;

    /// Finds the states that hold in a snapshot.
    fn look(&self, seen: &Seen, memory: &mut Memory) -> Belief;

    /// Returns the parts that an action can move, and their targets. Those that failed least come first.
    fn choices(
        &self,
        action: ActionId,
        scene: &Scene,
        seen: &Seen,
        memory: &Memory,
        attempts: &Attempts,
    ) -> Choices;

    /// Returns whether an attempt that placed its part achieved the intended state.
    fn took_effect(&self, what: &What, seen: &Seen, memory: &Memory) -> bool;

    /// Returns the parts whose states forbid a fact, and those that are in a state of the goal at a reference out of place,
    /// with their references. Each comes with the fact's name. The planner is stuck because no action takes them away.
    fn in_the_way(&self, fact: StateId, memory: &Memory) -> Vec<(usize, String)> {
        let _ = (fact, memory);
        Vec::new()
    }

    /// Returns whether compiling the domain anew would give the planner graph other needs, now that it is stuck.
    fn can_relent(&self, memory: &Memory) -> bool {
        let _ = memory;
        false
    }
}

/// The mind for a domain without objects: the states are those of the classifier, and the goal is always the same.
pub(super) struct Propositional {
    planner: Arc<dyn Decider>,
    classifier: Classifier,
    goal: StateId,
}

impl Propositional {
    pub fn new(
        planner: Arc<dyn Decider>,
        grounding: Grounding,
        goal: StateId,
    ) -> Result<Self, TaskError> {
        // Refuses a goal of another domain.
        planner.check_goal(goal)?;
        let classifier = Classifier::new(planner.domain(), grounding)?;
        Ok(Self { planner, classifier, goal })
    }
}

impl Mind for Propositional {
    fn planner(&self) -> &dyn Decider {
        &*self.planner
    }

    fn goals(&self) -> Vec<StateId> {
        vec![self.goal]
    }

    fn look(&self, seen: &Seen, _memory: &mut Memory) -> Belief {
        let states = self.classifier.classify_all(&seen.snapshot);
        let found = states.iter().zip(&seen.parts);
        let domain = self.planner.domain();
        let objects = seen.snapshot.objects.iter().zip(&states);
        let lost = objects.filter(|(_, s)| s.state.is_none()).filter_map(|(object, _)| {
            let (state, offset) = self.classifier.nearest(&object.kind, &object.pose)?;
            Some(InNoState::new(&object.id, &domain[state].name, &offset))
        });
        let in_no_state = lost.collect();
        Belief {
            in_no_state,
            present: self.classifier.world_of(&states),
            goal: self.goal,
            // Parts only: landmarks have no states.
            explained: found.filter_map(|(s, part)| s.state.and(*part)).collect(),
            outgrown: false,
        }
    }

    fn choices(
        &self,
        action: ActionId,
        scene: &Scene,
        seen: &Seen,
        _memory: &Memory,
        attempts: &Attempts,
    ) -> Choices {
        let domain = self.planner.domain();
        let operator = &domain[action];
        let mut choices = Choices::default();
        let Some(target) = choose::target(domain, operator) else { return choices };
        let states = self.classifier.classify_all(&seen.snapshot);
        let mut candidates = choose::candidates(operator, &seen.snapshot, &states);
        let what =
            |part: usize| What { action: operator.name.clone(), part, reference: None, place: 0 };
        // After a failure, another part may succeed.
        candidates.sort_by_key(|o| seen.parts[*o].map_or(0, |part| attempts.weight(&what(part))));
        for object in candidates {
            let Some(part) = seen.parts[object] else { continue };
            let within_m = scene.kind(part).map_or(0.0, |kind| kind.handling.in_the_way_m);
            let choice = Choice { part, target, what: what(part), reference: None, chosen: None };
            if choose::occupied(&seen.snapshot, operator, object, &target, within_m) {
                choices.blocked.push(choice);
            } else {
                choices.all.push(choice);
            }
        }
        choices
    }

    fn took_effect(&self, what: &What, seen: &Seen, _memory: &Memory) -> bool {
        let domain = self.planner.domain();
        let Some(operator) = domain.operators().iter().find(|o| o.name == what.action) else {
            return true;
        };
        let states = self.classifier.classify_all(&seen.snapshot);
        let own = seen.parts.iter().position(|part| *part == Some(what.part));
        own.is_some_and(|own| states[own].state == Some(operator.to))
    }
}
