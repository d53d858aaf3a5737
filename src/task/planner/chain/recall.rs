//! Recalls the action that causes the examined state: from a memory, or by a contest among several causes.

use std::sync::Arc;

use super::alternatives::CauseContest;
use super::encode::{ActionSpace, Encoded, StateSpace, WINNER};
use crate::sim::{Add, Out, Pointer, Real, Scope, Vector};
use crate::spa::{AssociativeMemory, Linear, Routes, VocabError};
use crate::task::error::TaskError;
use crate::task::propositional::Domain;

/// How actions are recalled.
pub(in crate::task::planner) enum Recall {
    /// No state has more than one cause.
    Memory(CauseMemory),
    /// Some states have one cause and some have several.
    Both(CauseMemory, Box<CauseContest>),
    /// No state has exactly one cause.
    Contest(Box<CauseContest>),
}

/// The recalled action.
pub(in crate::task::planner) struct Recalled {
    /// Pointer of the action.
    pub pointer: Out<Pointer<ActionSpace>>,
    /// One number for each action: 1 for the recalled action.
    pub actions: Out<Vector>,
    /// Items that become active when an action is recalled; their times give the milestone.
    pub watched: Out<Vector>,
}

/// Memory of the states with one cause.
pub(in crate::task::planner) struct CauseMemory {
    memory: AssociativeMemory<StateSpace, ActionSpace>,
    /// For each item of the memory, a row with 1 for its action. Several states can share a cause.
    rows: Vec<Real>,
    actions: usize,
}

impl CauseMemory {
    fn of(domain: &Domain, encoded: &Encoded) -> Result<Option<Self>, VocabError> {
        let pairs: Vec<_> = domain
            .state_ids()
            .filter_map(|state| match domain.causes(state) {
                [only] => Some((state, *only)),
                _ => None,
            })
            .collect();
        if pairs.is_empty() {
            return Ok(None);
        }
        let (items, actions) = (pairs.len(), domain.operators().len());
        let mut rows = vec![0.0; items * actions];
        for (item, (_, action)) in pairs.iter().enumerate() {
            rows[item * actions + action.index()] = 1.0;
        }
        let names = pairs.iter().map(|(s, a)| (&*domain[*s].name, &*domain[*a].name));
        let memory = AssociativeMemory::new(&encoded.states, &encoded.actions, names, WINNER)?;
        Ok(Some(Self { memory, rows, actions }))
    }

    fn expand(self, scope: &mut Scope<'_>, state: &Out<Pointer<StateSpace>>) -> Recalled {
        let cause = scope.add("cause", self.memory);
        let caused = scope.add("caused", Linear::weighted_rows(self.actions, self.rows));
        scope.route(state >> &cause);
        scope.route(&cause.items >> &caused);
        Recalled { pointer: cause.output, actions: caused.output, watched: cause.items }
    }
}

impl Recall {
    /// Builds the recall for a domain.
    pub fn of(domain: &Domain, encoded: &Arc<Encoded>) -> Result<Self, TaskError> {
        let memory = CauseMemory::of(domain, encoded)?;
        let contest = CauseContest::of(domain, encoded)?;
        match (memory, contest) {
            (Some(memory), None) => Ok(Self::Memory(memory)),
            (Some(memory), Some(contest)) => Ok(Self::Both(memory, Box::new(contest))),
            (None, Some(contest)) => Ok(Self::Contest(Box::new(contest))),
            (None, None) => {
                let reason = "it has no action; planning needs at least one".into();
                Err(TaskError::BadDomain { reason })
            }
        }
    }

    /// Adds the recall of the action that causes a state, where these states hold and these actions are ruled out.
    pub fn expand(
        self,
        scope: &mut Scope<'_>,
        state: &Out<Pointer<StateSpace>>,
        present: &Out<Vector>,
        ruled_out: Option<&Out<Vector>>,
        all: &Encoded,
    ) -> Recalled {
        let (memory, contest) = match self {
            Self::Memory(memory) => return memory.expand(scope, state),
            Self::Both(memory, contest) => (Some(memory), contest),
            Self::Contest(contest) => (None, contest),
        };
        let contest = scope.add("alternatives", *contest);
        scope.route(state >> &contest.state);
        scope.route(present >> &contest.present);
        if let Some(ruled_out) = ruled_out {
            scope.route(ruled_out >> &contest.ruled_out);
        }
        let Some(memory) = memory else {
            let (pointer, actions) = (contest.action, contest.items.clone());
            return Recalled { pointer, actions, watched: contest.items };
        };
        let known = memory.expand(scope, state);
        let pointer = scope.add("recalled", Add::pointer(all.actions.space()));
        let actions = scope.add("recalled_items", Add::vector(all.actions.len()));
        scope.route(&known.pointer + &contest.action >> &pointer);
        scope.route(&known.actions + &contest.items >> &actions);
        let (pointer, actions) = (pointer.output, actions.output);
        Recalled { pointer, watched: actions.clone(), actions }
    }
}
