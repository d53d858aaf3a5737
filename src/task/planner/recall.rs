//! Recalling the action that causes the state in question: from a memory, or by a contest among several causes.

use std::sync::Arc;

use super::alternatives::CauseContest;
use super::encode::{ActionSpace, Encoded, StateSpace};
use super::graph::RECOGNISED;
use crate::neurons::SelectRule;
use crate::sim::{Add, Out, Pointer, Real, Scope, Synapse, Vector};
use crate::spa::{AssociativeMemory, Linear, VocabError};
use crate::task::domain::Domain;
use crate::task::error::TaskError;

/// How actions are recalled.
pub(super) enum Recall {
    /// Every state has one cause at most.
    Memory(CauseMemory),
    /// Some states have one cause, some several.
    Both(CauseMemory, CauseContest),
    /// No state has just one cause.
    Contest(CauseContest),
}

/// The action recalled.
pub(super) struct Recalled {
    /// Its pointer.
    pub pointer: Out<Pointer<ActionSpace>>,
    /// One number an action: 1 for the one recalled.
    pub actions: Out<Vector>,
    /// What becomes active when an action is recalled, to be timed.
    pub watched: Out<Vector>,
}

/// The states with one cause, and their causes.
pub(super) struct CauseMemory {
    memory: AssociativeMemory<StateSpace, ActionSpace>,
    /// Which action each item of the memory stands for, a row of flags each: several states can have one cause.
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
        let winner = SelectRule::WinnerTakeAll { level: RECOGNISED };
        let memory = AssociativeMemory::new(&encoded.states, &encoded.actions, names, winner)?;
        Ok(Some(Self { memory, rows, actions }))
    }

    fn expand(self, scope: &mut Scope<'_>, state: &Out<Pointer<StateSpace>>) -> Recalled {
        let cause = scope.add("cause", self.memory);
        let caused = scope.add("caused", Linear::weighted_rows(self.actions, self.rows));
        scope.connect(state, &cause.input, Synapse::None);
        scope.connect(&cause.items, &caused.input, Synapse::None);
        Recalled { pointer: cause.output, actions: caused.output, watched: cause.items }
    }
}

/// What a contest is told.
pub(super) struct Circumstances<'a> {
    pub state: &'a Out<Pointer<StateSpace>>,
    pub present: &'a Out<Vector>,
    pub ruled_out: Option<&'a Out<Vector>>,
}

impl Recall {
    /// The causes of a domain that has an action.
    pub fn of(domain: &Domain, encoded: &Arc<Encoded>) -> Result<Self, TaskError> {
        let memory = CauseMemory::of(domain, encoded)?;
        let contest = CauseContest::of(domain, encoded)?;
        match (memory, contest) {
            (Some(memory), None) => Ok(Self::Memory(memory)),
            (Some(memory), Some(contest)) => Ok(Self::Both(memory, contest)),
            (None, Some(contest)) => Ok(Self::Contest(contest)),
            (None, None) => {
                let reason = "it has no action, so nothing can be planned".into();
                Err(TaskError::BadDomain { reason })
            }
        }
    }

    pub fn expand(
        self,
        scope: &mut Scope<'_>,
        told: &Circumstances<'_>,
        all: &Encoded,
    ) -> Recalled {
        let (memory, contest) = match self {
            Self::Memory(memory) => return memory.expand(scope, told.state),
            Self::Both(memory, contest) => (Some(memory), contest),
            Self::Contest(contest) => (None, contest),
        };
        let none = Synapse::None;
        let contest = scope.add("alternatives", contest);
        scope.connect(told.state, &contest.state, none);
        scope.connect(told.present, &contest.present, none);
        if let Some(ruled_out) = told.ruled_out {
            scope.connect(ruled_out, &contest.ruled_out, none);
        }
        let Some(memory) = memory else {
            let (pointer, actions) = (contest.action, contest.items.clone());
            return Recalled { pointer, actions, watched: contest.items };
        };
        let known = memory.expand(scope, told.state);
        let pointer = scope.add("recalled", Add::pointer(all.actions.space()));
        let actions = scope.add("recalled_items", Add::vector(all.actions.len()));
        scope.connect(&known.pointer, &pointer.input, none);
        scope.connect(&contest.action, &pointer.input, none);
        scope.connect(&known.actions, &actions.input, none);
        scope.connect(&contest.items, &actions.input, none);
        let (pointer, actions) = (pointer.output, actions.output);
        Recalled { pointer, watched: actions.clone(), actions }
    }
}
