//! The rank of this process among those that share the command.

use std::sync::OnceLock;

use symbolt::neurons::PopulationPlan;
use symbolt::sim::Ranks;

/// The rank of this process, if the command is shared.
static RANK: OnceLock<Ranks> = OnceLock::new();

/// Returns the rank of this process, if several processes share the command.
pub(crate) fn own() -> Option<&'static Ranks> {
    RANK.get()
}

/// Sets the rank of this process, once.
#[cfg(feature = "mpi")]
pub(crate) fn set(ranks: Ranks) {
    let _ = RANK.set(ranks);
}

/// Returns whether this process writes: it is alone, or the first.
pub(crate) fn leads() -> bool {
    own().is_none_or(|ranks| ranks.rank() == 0)
}

/// Shares the neurons of a plan among the processes that share the command.
pub(crate) fn shared(plan: PopulationPlan) -> PopulationPlan {
    // The first process records the spikes of all.
    own().into_iter().fold(plan, |plan, ranks| plan.shared(&ranks.clone().with_events()))
}
