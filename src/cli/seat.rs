//! The seat of this process among those that share the command.

use std::sync::OnceLock;

use symbolt::neurons::PopulationPlan;
use symbolt::sim::Ranks;

/// The seat of this process, if the command is shared.
static SEAT: OnceLock<Ranks> = OnceLock::new();

/// Returns the seat of this process, if several processes share the command.
pub(crate) fn seat() -> Option<&'static Ranks> {
    SEAT.get()
}

/// Sets the seat of this process, once.
#[cfg(feature = "mpi")]
pub(crate) fn take(ranks: Ranks) {
    let _ = SEAT.set(ranks);
}

/// Returns whether this process writes: it is alone, or the first.
pub(crate) fn leads() -> bool {
    seat().is_none_or(|seat| seat.rank() == 0)
}

/// Shares the neurons of a plan among the processes that share the command.
pub(crate) fn shared(plan: PopulationPlan) -> PopulationPlan {
    // The first process records the spikes of all.
    seat().into_iter().fold(plan, |plan, seat| plan.shared(&seat.clone().with_events()))
}
