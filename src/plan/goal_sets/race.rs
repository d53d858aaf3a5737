//! The race among operators: what makes it easier to win, accumulators, latches that hold the winner, and what breaks ties.

use super::wiring::{Group, Wiring, behind, each, gather, spread};
use crate::neurons::Map;
use crate::sim::{Real, SimDuration, Synapse};

/// Weight with which a winner holds the accumulators of all others down. With less, those that come a few milliseconds later
/// win as well.
const HOLD: Real = 8.0;
/// Units that make a race easier to win the longer it lasts, so that the best of operators that cost much is found as well.
/// Without them it lasts until it is taken for a dead end.
const RUNGS: usize = 8;
/// Synapse from one of them to the next, in milliseconds.
const RUNG_MS: u64 = 12;

/// Weight with which a veto keeps an operator out of the race. It must outweigh the greatest gain in the longest race.
pub(super) const BAR: Real = -16.0;
/// Time constant with which the race becomes easier to win, in milliseconds.
const URGENCY_MS: u64 = 60;
/// Weight of an operator that is favoured by chance, after a search that found no plan.
const STIRS: Real = 0.6;
/// Weight with which such a search lets chance through. Without it, noise of six standard deviations would be needed.
const STIRRED: Real = 3.0;
/// Standard deviation of the noise behind it, and the time constant of its changes in milliseconds: about that of a step.
const STIR_NOISE: Real = 0.5;
const STIR_MS: u64 = 100;

/// The phases in which a race is run, and the signals that tell of winners.
pub(super) struct Turns {
    pub race: usize,
    /// Only the first of several winners is left in this phase.
    pub check: usize,
    /// The winner is forgotten in these phases.
    pub clear: &'static [usize],
    /// Signals of a winner, and of several.
    pub told: [usize; 2],
}

/// Adds utilities of operators, with a bias for each, that grow with time: in the phases of `urges` with their weights, step by
/// step while a race lasts, and by chance after a search that found no plan (`restless`).
pub(super) fn utilities(
    w: &mut Wiring<'_, '_>,
    (phases, elapsed, restless): (&Group, &Group, &Group),
    (race, urges): (usize, &[(usize, Real)]),
    bias: &[Real],
) -> Group {
    let operators = bias.len();
    let utility = Map::each(operators, |x| x.max(0.0)).radius(2.5).above(0.0);
    let utilities = w.analog("utilities", operators, utility);
    w.bias(&utilities, bias);
    let urgency = w.slow("urgency", phases, URGENCY_MS);
    let urges = urges.iter().flat_map(|(phase, urge)| spread(*phase, operators, *urge));
    w.link(&urgency, &utilities, urges);
    impatience(w, phases, elapsed, race, &utilities);
    // Half of the operators, others from race to race.
    let stir = w.biased("stir", operators, 0.5 - STIRRED);
    let chance = w.noisy("chance", operators, STIR_NOISE, STIR_MS);
    w.link(restless, &chance, spread(0, operators, STIRRED));
    w.link_by(&chance, &stir, each(operators, 1.0), Synapse::lowpass_ms(STIR_MS));
    w.link(&stir, &utilities, each(operators, STIRS));
    utilities
}

/// Adds a row of units that become active one after the other while a race lasts, and fall silent with it.
fn impatience(
    w: &mut Wiring<'_, '_>,
    phases: &Group,
    elapsed: &Group,
    race: usize,
    utilities: &Group,
) {
    let rungs = w.both("impatience", RUNGS);
    w.link(phases, &rungs, spread(race, RUNGS, 1.0));
    w.link(elapsed, &rungs, [(race, 0, 1.0)]);
    let later = (1..RUNGS).map(|rung| (rung - 1, rung, 1.0));
    w.link_by(&rungs, &rungs, later, Synapse::lowpass_ms(RUNG_MS));
    w.link(&rungs, utilities, (0..RUNGS).flat_map(|rung| spread(rung, utilities.count, 1.0)));
}

/// Adds the race of accumulators, and latches that hold the winner. A winner holds the other accumulators down.
pub(super) fn race(
    w: &mut Wiring<'_, '_>,
    (phases, signals): (&Group, &Group),
    turns: &Turns,
    utilities: &Group,
) -> Group {
    let operators = utilities.count;
    let race = w.race("race", operators, SimDuration::from_millis(5));
    w.link(utilities, &race, each(operators, 1.0));
    let rest = w.tonic("rest", 1);
    w.link(phases, &rest, [(turns.race, 0, -1.3)]);
    w.link(&rest, &race, spread(0, operators, -8.0));
    let winner = w.latches("winner", operators);
    w.link(&race, &winner, each(operators, 1.0));
    let rivals = w.sum("rivals", 1);
    w.link(&winner, &rivals, gather(operators, 0, 1.0));
    let own = w.sum("own", operators);
    w.link(&winner, &own, each(operators, 1.0));
    w.link(&rivals, &race, spread(0, operators, -HOLD));
    w.link(&own, &race, each(operators, HOLD));
    let cleared = turns.clear.iter().flat_map(|p| spread(*p, operators, -4.0));
    w.link(phases, &winner, cleared);
    break_ties(w, phases, turns.check, &winner);
    let told = turns.told.map(|signal| (0, signal, 1.0));
    w.link(&rivals, signals, told);
    winner
}

/// Lets every winner give way to those before it, while they are checked.
fn break_ties(w: &mut Wiring<'_, '_>, phases: &Group, check: usize, winner: &Group) {
    let operators = winner.count;
    let later = w.both("give_way", operators);
    behind(w, "winner_rows", winner, &later, &[operators], 1.3);
    w.link(phases, &later, spread(check, operators, 1.0));
    w.link(&later, winner, each(operators, -4.0));
}
