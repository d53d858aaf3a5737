//! Checks a planner against the reference planner.

use symbolt::task::planner::{Decision, Planner};
use symbolt::task::{Domain, StateId, Verdict, WorldState, acceptable_answers};

/// Number of answers with each verdict.
#[derive(Debug, Default, PartialEq)]
pub struct Tally {
    pub act: usize,
    pub met: usize,
    pub stuck: usize,
}

/// Asks the planner once and adds the verdict to `tally`.
///
/// # Panics
/// If the reference planner does not accept the verdict.
pub fn check(
    domain: &Domain,
    planner: &Planner,
    world: &WorldState,
    goal: StateId,
    tally: &mut Tally,
) -> Decision {
    let right = acceptable_answers(domain, world, goal, planner.spec().rules());
    let name = &domain[goal].name;
    let decision = planner.decide(world, goal).expect("the planner decides");
    match decision.verdict {
        Verdict::Met => tally.met += 1,
        Verdict::Act(_) => tally.act += 1,
        Verdict::Stuck(_) => tally.stuck += 1,
    }
    let accepted = right.accepts(decision.verdict);
    assert!(accepted, "{name} in {world:?}: {:?}, right is {right:?}", decision.verdict);
    decision
}
