//! The choice among several causes of a state: a contest of utilities. The cause with the fewest unmet
//! preconditions wins.
//!
//! ```text
//!  goal buffer -> which state -> its causes ---> contest -> items, pointer of the action
//!                     the states that hold ------^     ^-- inhibited: actions ruled out
//! ```
//!
//! A cause of the examined state has a utility of 0.8 to 1.6. Every precondition that does not hold lowers
//! it. Among causes with equally many unmet preconditions, the utility is lower for causes that come later in
//! [`Domain::causes`]. All other actions have a utility of 0.3 or less, at which neurons stay silent in the
//! contest. States with one cause do not take part.
//!
//! In direct mode the cause with the fewest unmet preconditions wins, and a tie goes to the first of the
//! causes. In neurons this holds only up to the precision of the represented utilities. The following was
//! measured with 50 neurons an item over 8 seeds:
//!
//! - One cause had no unmet precondition, the others had one each. With 2 causes of 1 precondition each, rate and
//!   spiking neurons chose another cause in 0 of 16 cases. With 3 causes of 2 preconditions each, rate neurons chose
//!   another cause in 0 of 24 cases, and spiking neurons in 1 of 24.
//! - No cause had an unmet precondition. With the same 2 and 3 causes, rate neurons missed the first cause in 0 of 8
//!   and 1 of 8 cases, and spiking neurons in 3 of 8 and 5 of 8. In neurons, do not rely on the order among equal
//!   causes.
//!
//! The verdict is still correct: a cause that turns out to be impossible is ruled out, and another is tried.

use std::sync::Arc;

use super::encode::{ActionSpace, Encoded, StateSpace, WINNER};
use crate::sim::{AsPointer, Constant, In, Module, Out, Pointer, Real, Scope, Vector};
use crate::spa::{CleanupMemory, Linear, PointerValue, Routes, Selection, VocabError};
use crate::task::propositional::{ActionId, Domain, StateId};

/// Utility of the least preferred cause with the most unmet preconditions.
const MIN_CAUSE_UTILITY: Real = 0.8;
/// Greatest difference between the utilities of one state's causes.
const RANGE: Real = 0.8;
/// Constant subtracted from every action's utility and added back for the causes of the examined state.
/// Preconditions that hold support every action that has them; without this offset, actions that do not cause
/// the state would enter the contest.
const REST: Real = 0.5;

/// The contest as a module.
pub(in crate::task::planner) struct CauseContest {
    which: CleanupMemory<StateSpace>,
    actions: usize,
    /// Utilities of the causes: one row for each state with several causes, one column for each action.
    utilities: Vec<Real>,
    /// Support that each state gives to each action while the state holds: one row for each state, one column for each
    /// action.
    support: Vec<Real>,
    /// Pointer of each action.
    pointers: Vec<PointerValue<ActionSpace>>,
    encoded: Arc<Encoded>,
}

/// Ports of the contest.
pub(in crate::task::planner) struct CauseContestPorts {
    /// The examined state.
    pub state: In<Pointer<StateSpace>>,
    /// The states that hold.
    pub present: In<Vector>,
    /// The actions ruled out.
    pub ruled_out: In<Vector>,
    /// One number for each action: 1 for the chosen action. All are 0 for a state with fewer than two causes.
    pub items: Out<Vector>,
    /// The pointer of the chosen action.
    pub action: Out<Pointer<ActionSpace>>,
}

impl CauseContest {
    /// Builds the contest over a domain; `None` if no state has several causes.
    pub fn of(domain: &Domain, encoded: &Arc<Encoded>) -> Result<Option<Self>, VocabError> {
        let several = domain.state_ids().filter(|state| domain.causes(*state).len() > 1);
        let several: Vec<StateId> = several.collect();
        if several.is_empty() {
            return Ok(None);
        }
        let (states, actions) = (domain.states().len(), domain.operators().len());
        let causes = || several.iter().flat_map(|state| domain.causes(*state));
        let needs = |action: ActionId| domain[action].preconditions.len();
        // Each unmet precondition costs one step; the order of preference divides the last step.
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
        Ok(Some(Self {
            which: CleanupMemory::new(&encoded.states, domain.names(&several), WINNER)?,
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
        let which = scope.add("which", self.which);
        let causes = scope.add("causes", Linear::weighted_rows(self.actions, self.utilities));
        let support = scope.add("support", Linear::weighted_rows(self.actions, self.support));
        let contest = scope.add("contest", Selection::new(self.actions, WINNER));
        let space = self.encoded.actions.space();
        let actions = self.pointers.iter().map(PointerValue::as_pointer);
        let pointer = scope.add("pointer", Linear::combination(space, actions));
        let rest = scope.add("rest", Constant::vector(&vec![-REST; self.actions]));
        scope.route(&which.items >> &causes);
        scope.route(&rest + &causes + &support >> &contest.utilities);
        scope.route(&contest.items >> &pointer);
        CauseContestPorts {
            state: which.input,
            present: support.input,
            ruled_out: contest.inhibit,
            items: contest.items,
            action: pointer.output,
        }
    }
}
