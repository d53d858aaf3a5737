//! A plain symbolic planner: the ground truth that the planner graph is tested against.
//!
//! What is right is defined here once. Let `W` be the states that hold, `g` the goal, and let each state
//! be caused by one action ([`Domain::cause`](super::Domain::cause)).
//!
//! * If `g` is in `W`, the goal is met.
//! * The *needed* states are the least set that contains `g` and, for each of its states outside `W`, the
//!   preconditions of the action that causes it. All of them have to be brought about.
//! * The goal is stuck if a needed state outside `W` is caused by nothing, if needed states outside
//!   `W` depend on each other in a circle, or (where absence is asked for) if an action whose preconditions
//!   all hold needs a state to be absent that holds.
//! * Otherwise right next actions are those that cause a needed state and whose preconditions all
//!   hold.
//!
//! That is commitment [`Proven`](Commitment::Proven). With [`First`](Commitment::First), the paper's rule,
//! a planner follows one open precondition and acts as soon as an action can be done, whatever stands in the way of
//! others; then every end of every such way is right.

use serde::{Deserialize, Serialize};

use std::collections::BTreeSet;

use crate::task::domain::Domain;

/// When a planner commits to an action.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Commitment {
    /// When it is shown that everything needed for the goal can be brought about.
    #[default]
    Proven,
    /// When the first action that can be done is found (section II.F of the paper).
    First,
}

/// Why a goal cannot be had.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Obstacle {
    /// No action causes this state.
    NothingCauses {
        /// The state's place in the domain.
        state: usize,
    },
    /// The action could be done but for a state that holds and must not.
    MustBeAbsent {
        /// The action's place in the domain.
        action: usize,
        /// The state that would have to be absent.
        state: usize,
    },
    /// The state is needed to bring itself about.
    NeedsItself {
        /// The state's place in the domain.
        state: usize,
    },
}

/// All that a right planner may answer.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Outlook {
    /// Whether the goal holds already; then nothing else is right.
    pub met: bool,
    /// Actions that are right to do next.
    pub actions: BTreeSet<usize>,
    /// Obstacles that are right to report.
    pub obstacles: BTreeSet<Obstacle>,
}

/// What a planner may look at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Rules {
    /// When it commits.
    pub commitment: Commitment,
    /// Whether states that never held before an action must be absent.
    pub absent: bool,
}

/// The right answers for `goal` when the states flagged in `world` hold. Costs O(states x
/// preconditions).
///
/// # Panics
/// If `world` has not one flag a state, or `goal` is no state's place.
pub fn outlook(domain: &Domain, world: &[bool], goal: usize, rules: Rules) -> Outlook {
    assert_eq!(world.len(), domain.states().len(), "one flag a state");
    assert!(goal < world.len(), "the goal is a state");
    let mut search = Search {
        domain,
        world,
        rules,
        path: Vec::new(),
        done: BTreeSet::new(),
        found: Outlook::default(),
    };
    if world[goal] {
        search.found.met = true;
        return search.found;
    }
    search.visit(goal);
    let mut found = search.found;
    if rules.commitment == Commitment::Proven && !found.obstacles.is_empty() {
        found.actions.clear();
    }
    found
}

struct Search<'d> {
    domain: &'d Domain,
    world: &'d [bool],
    rules: Rules,
    path: Vec<usize>,
    done: BTreeSet<usize>,
    found: Outlook,
}

impl Search<'_> {
    fn visit(&mut self, state: usize) {
        if let Some(at) = self.path.iter().position(|s| *s == state) {
            // Any state of the circle may be the one at which a planner notices.
            for on_circle in &self.path[at..] {
                self.found.obstacles.insert(Obstacle::NeedsItself { state: *on_circle });
            }
            return;
        }
        if self.done.contains(&state) {
            return;
        }
        let Some(action) = self.domain.cause(state) else {
            self.found.obstacles.insert(Obstacle::NothingCauses { state });
            self.done.insert(state);
            return;
        };
        let operator = &self.domain.operators()[action];
        let open: Vec<usize> = self
            .domain
            .indices(&operator.preconditions)
            .into_iter()
            .filter(|p| !self.world[*p])
            .collect();
        if open.is_empty() {
            let barred: Vec<usize> = if self.rules.absent {
                let absent = self.domain.indices(&operator.absent);
                absent.into_iter().filter(|s| self.world[*s]).collect()
            } else {
                Vec::new()
            };
            for state in &barred {
                self.found.obstacles.insert(Obstacle::MustBeAbsent { action, state: *state });
            }
            if barred.is_empty() {
                self.found.actions.insert(action);
            }
        }
        self.path.push(state);
        for precondition in open {
            self.visit(precondition);
        }
        self.path.pop();
        self.done.insert(state);
    }
}
