//! The choice among several causes of a state: a contest of utilities in which the fewest unmet preconditions win.
//!
//! ```text
//!  goal buffer -> which state -> its causes ---> contest -> items, pointer of the action
//!                     the states that hold ------^     ^-- inhibited: actions ruled out
//! ```
//!
//! A cause of the state in question has a utility of 0.8 to 1.6: less for every precondition that does not hold,
//! and, among causes that lack equally many, less the later it stands in [`Domain::causes`]. What causes something
//! else stays at 0.3 or below, where neurons do not take part in the contest. States with one cause have no part in
//! it.
//!
//! In direct mode the fewest unmet preconditions win, and a tie goes to the first of the causes. Neurons keep that
//! rule only as precisely as they represent utilities. With 50 neurons an item, over 8 seeds: where one cause could
//! be done and the others lacked one precondition, rates chose another in 0 of 16 cases with 2 causes of 1
//! precondition and in 0 of 24 with 3 causes of 2; spiking neurons in 0 of 16 and 1 of 24. Where all could be done,
//! rates did not take the first in 0 of 8 and 1 of 8, spiking neurons in 3 of 8 and 5 of 8: among equals, do not rely
//! on the order. The verdict does not suffer: a cause that turns out impossible is ruled out.

use std::sync::Arc;

use super::encode::{ActionSpace, Encoded, StateSpace};
use super::graph::RECOGNISED;
use crate::neurons::SelectRule;
use crate::sim::{AsPointer, Constant, In, Module, Out, Pointer, Real, Scope, Synapse, Vector};
use crate::spa::{CleanupMemory, Linear, PointerValue, Selection, VocabError};
use crate::task::domain::{ActionId, Domain, StateId};

/// Utility of a cause that lacks most and is preferred least.
const MIN_CAUSE_UTILITY: Real = 0.8;
/// By how much the utilities of the causes of one state can differ.
const RANGE: Real = 0.8;
/// What is taken from the utility of every action, and given back to the causes of the state in question: the
/// preconditions that hold count for all actions, and must not let others into the contest.
const REST: Real = 0.5;

/// The module.
pub(super) struct CauseContest {
    which: CleanupMemory<StateSpace>,
    actions: usize,
    /// A row an action for each state with several causes: the utilities of its causes.
    utilities: Vec<Real>,
    /// A row an action for each state: what its holding adds.
    support: Vec<Real>,
    /// A row for each action: its pointer.
    pointers: Vec<PointerValue<ActionSpace>>,
    encoded: Arc<Encoded>,
}

/// Its ports.
pub(super) struct CauseContestPorts {
    /// The state in question.
    pub state: In<Pointer<StateSpace>>,
    /// The states that hold.
    pub present: In<Vector>,
    /// The actions ruled out.
    pub ruled_out: In<Vector>,
    /// One number an action: 1 for the one chosen; none for a state with fewer than two causes.
    pub items: Out<Vector>,
    /// The pointer of the action chosen.
    pub action: Out<Pointer<ActionSpace>>,
}

/// The states that several actions cause.
pub(super) fn states_with_several_causes(domain: &Domain) -> Vec<StateId> {
    domain.state_ids().filter(|state| domain.causes(*state).len() > 1).collect()
}

impl CauseContest {
    /// The contest over a domain; `None` if no state has several causes.
    pub fn of(domain: &Domain, encoded: &Arc<Encoded>) -> Result<Option<Self>, VocabError> {
        let several = states_with_several_causes(domain);
        if several.is_empty() {
            return Ok(None);
        }
        let (states, actions) = (domain.states().len(), domain.operators().len());
        let causes = || several.iter().flat_map(|state| domain.causes(*state));
        let needs = |action: ActionId| domain[action].preconditions.len();
        // One step for each precondition; the orders of preference share the last one.
        let widest = causes().map(|a| needs(*a)).max().unwrap_or(0);
        let step = RANGE / (widest + 1) as Real;
        let mut utilities = vec![0.0; several.len() * actions];
        let mut support = vec![0.0; states * actions];
        for (row, state) in several.iter().enumerate() {
            let causes = domain.causes(*state);
            for (rank, action) in causes.iter().enumerate() {
                let preference = (causes.len() - 1 - rank) as Real / causes.len() as Real;
                let spared = (widest - needs(*action)) as Real;
                utilities[row * actions + action.index()] =
                    REST + MIN_CAUSE_UTILITY + step * (spared + preference);
            }
        }
        for action in causes() {
            for state in &domain[*action].preconditions {
                support[state.index() * actions + action.index()] = step;
            }
        }
        let named = domain.operators().iter().map(|o| encoded.actions.parse(&o.name));
        let pointers = named.collect::<Result<_, _>>()?;
        let winner = SelectRule::WinnerTakeAll { level: RECOGNISED };
        Ok(Some(Self {
            which: CleanupMemory::new(&encoded.states, domain.names(&several), winner)?,
            actions,
            utilities,
            support,
            pointers,
            encoded: encoded.clone(),
        }))
    }
}

impl Module for CauseContest {
    type Ports = CauseContestPorts;

    fn expand(self, scope: &mut Scope<'_>) -> CauseContestPorts {
        let none = Synapse::None;
        let winner = SelectRule::WinnerTakeAll { level: RECOGNISED };
        let which = scope.add("which", self.which);
        let causes = scope.add("causes", Linear::weighted_rows(self.actions, self.utilities));
        let support = scope.add("support", Linear::weighted_rows(self.actions, self.support));
        let contest = scope.add("contest", Selection::new(self.actions, winner));
        let space = self.encoded.actions.space();
        let actions = self.pointers.iter().map(PointerValue::as_pointer);
        let pointer = scope.add("pointer", Linear::combination(space, actions));
        scope.connect(&which.items, &causes.input, none);
        let rest = scope.add("rest", Constant::vector(&vec![-REST; self.actions]));
        scope.connect(&rest, &contest.utilities, none);
        scope.connect(&causes.output, &contest.utilities, none);
        scope.connect(&support.output, &contest.utilities, none);
        scope.connect(&contest.items, &pointer.input, none);
        CauseContestPorts {
            state: which.input,
            present: support.input,
            ruled_out: contest.inhibit,
            items: contest.items,
            action: pointer.output,
        }
    }
}
