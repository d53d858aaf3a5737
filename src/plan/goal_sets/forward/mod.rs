//! Search forward, from what holds towards the goal, along relaxed plans.
//!
//! The other search of this room goes back from the goal. Each solves problems that the other does not: regression meets sets
//! that no state has, and progression dead ends. So both run at once, and the first that finds a plan acts.
//!
//! | file | contents |
//! |---|---|
//! | `control` | phases and signals, and the table of transitions |
//! | `agenda` | which goals come before which |
//! | `relaxed` | the wave from a state, what supports what, and which operators the goals need |
//! | `memory` | slots for states; the way back to the first and forth again |
//! | `graph` | all parts as one module |
//!
//! A wave runs from the state through all operators at once, as slowly as what they need costs, and latches for each fluent the
//! operator that reaches it first (additive costs in place of the layers of Hoffmann and Nebel, "The FF planning system",
//! 2001, as in Keyder and Geffner, "Heuristics for planning with action costs revisited", 2008). From the goals back, units mark what is
//! needed: its support, their preconditions, and so on, down to what holds. So the relaxed plan is there at once, and changes
//! with the state while its operators are applied one after the other (lookahead, as in Vidal, "A lookahead strategy for
//! heuristic search planning", 2004). When none is left to apply, a new wave runs. A goal that would have to be undone for
//! another one waits for it: fixed synapses, found from what excludes what (the goal agenda). Of operators that are worth the
//! same, those go first that use up least of what no operator makes again, in proportion to how many operators need it.

mod agenda;
pub(super) mod control;
mod graph;
mod memory;
mod relaxed;

pub(super) use graph::acting_phases;
pub use graph::{ForwardGraph, ForwardPorts, Progression};
