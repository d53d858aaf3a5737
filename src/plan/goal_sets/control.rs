//! The order of a plan's phases: units that hold the present phase, and the conditions on which the next one begins.

use super::machine::{Machine, Timed, Transition, When, items};
use super::wiring::{Group, Wiring};

/// A phase. Exactly one is active while the planner works.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Phase {
    /// Forgets everything, takes the goal.
    Start,
    /// Finds how far each fluent is from what holds, and writes the goal to the first slot.
    Wave,
    /// Writes the goal set to its slot and makes it the present one.
    Write,
    /// Moves to the slot and lets everything settle.
    Settle,
    /// Operators race.
    Race,
    /// Waits until only the first of several winners is left, and finds the goal set before it.
    Check,
    /// The winner leads to a visited goal set: it is barred until the goal set changes.
    Veto,
    /// Finds the slot to go on with, after a dead end.
    Back,
    /// Loads the goal set of that slot.
    Read,
    /// Shows the action of the present slot, whose goal set holds, and finds the slot before.
    Begin,
    /// Finds the slot before the present one, to act.
    Step,
    /// Loads the goal set of that slot, and shows the action of the present one as soon as a goal is open.
    Fetch,
    /// Shows the action of the present slot until the goal set holds.
    Show,
    /// Moves to the slot before.
    Next,
    /// The goal holds.
    Done,
    /// Some goal cannot be reached, even if nothing were ever deleted.
    Stuck,
}

use Phase::{
    Back, Begin, Check, Done, Fetch, Next, Race, Read, Settle, Show, Start, Step, Stuck, Veto,
    Wave, Write,
};

impl Phase {
    pub const ALL: [Self; 16] = [
        Start, Wave, Write, Settle, Race, Check, Veto, Back, Read, Begin, Step, Fetch, Show, Next,
        Done, Stuck,
    ];
}

items!(Phase: Stuck, Signal: Stalled);

impl Timed for Phase {
    fn millis(self) -> f64 {
        match self {
            Next | Step => 5.6,
            Start => 8.0,
            Veto => 7.2,
            Back | Wave => 9.6,
            Begin | Settle => 12.0,
            Write => 14.4,
            Read | Fetch => 20.8,
            Check => 17.6,
            Race | Show | Done | Stuck => 48.0,
        }
    }
}

/// A condition of a transition.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Signal {
    /// Some goal does not hold.
    Open,
    /// Some goal cannot be reached yet.
    Unreached,
    /// Some operator may win the race.
    Eligible,
    /// An operator has won.
    Won,
    /// Several operators have won.
    Double,
    /// The goal set before the winner contains one that was visited.
    Seen,
    /// The present slot is the first.
    First,
    /// The present slot is the last.
    Last,
    /// No action is shown, or one of its preconditions does not hold, or all its effects do.
    Unready,
    /// All goals hold.
    Closed,
    /// The race has no candidates.
    Nobody,
    /// All goals can be reached.
    Reached,
    /// The plan is requested, and no phase is active.
    Idle,
    /// Some slot is taken and no dead end, apart from the present one.
    Left,
    /// Some goal is not reached even by the wave that waits for no costs.
    Beyond,
    /// That wave goes on.
    News,
    /// It runs and does not go on.
    Stalled,
}

use Signal::{
    Beyond, Closed, Double, Eligible, First, Idle, Last, Left, News, Nobody, Open, Reached, Seen,
    Stalled, Unreached, Unready, Won,
};

/// Signals that must have lasted.
const LASTING: [(Signal, f64); 5] =
    [(Closed, 7.0), (Nobody, 25.0), (Reached, 4.0), (Stalled, 25.0), (Unready, 40.0)];

const TRANSITIONS: &[Transition<Phase, Signal>] = &[
    (When::Nothing, Start, &[Idle], &[], &[]),
    (When::After(Start), Wave, &[], &[], &[]),
    (When::After(Wave), Race, &[], &[Reached], &[]),
    (When::In(Wave), Stuck, &[Beyond], &[Stalled], &[]),
    (When::After(Stuck), Start, &[], &[], &[Beyond]),
    (When::After(Write), Settle, &[], &[], &[]),
    (When::After(Settle), Race, &[], &[], &[]),
    (When::In(Race), Check, &[Won], &[], &[]),
    (When::In(Race), Begin, &[], &[Closed], &[Won]),
    (When::In(Race), Back, &[Open], &[Nobody], &[Won]),
    (When::Long(Race), Back, &[Open], &[], &[Won]),
    (When::After(Check), Race, &[], &[], &[Won]),
    (When::After(Check), Start, &[Won, Last], &[], &[Double]),
    (When::After(Check), Veto, &[Won, Seen], &[], &[Double, Last]),
    (When::After(Check), Write, &[Won], &[], &[Double, Last, Seen]),
    (When::After(Veto), Race, &[], &[], &[Won]),
    (When::After(Back), Start, &[], &[], &[Left]),
    (When::After(Back), Start, &[Last], &[], &[]),
    (When::After(Back), Read, &[Left], &[], &[Last]),
    (When::After(Read), Settle, &[], &[], &[]),
    (When::After(Begin), Done, &[First], &[], &[]),
    (When::After(Begin), Fetch, &[], &[], &[First]),
    (When::After(Step), Done, &[First], &[], &[]),
    (When::After(Step), Fetch, &[], &[], &[First]),
    (When::After(Fetch), Show, &[], &[], &[]),
    (When::In(Show), Next, &[], &[Closed], &[]),
    (When::In(Show), Start, &[Open], &[Unready], &[]),
    (When::Long(Show), Start, &[Open], &[], &[]),
    (When::After(Next), Step, &[], &[], &[]),
    (When::After(Done), Start, &[Open], &[], &[]),
];

/// The groups of the control.
pub(super) struct Control {
    pub phases: Group,
    pub signals: Group,
    /// One unit: the last search found no plan.
    pub restless: Group,
    /// Phases that have lasted for their time.
    pub elapsed: Group,
}

impl Control {
    /// Adds the phases and their transitions. `ready` and `busy` have one item each.
    pub fn new(wiring: &mut Wiring<'_, '_>, ready: &Group, busy: &Group) -> Self {
        let machine = Machine::new(wiring, &Phase::ALL, TRANSITIONS, &LASTING, busy);
        let restless =
            machine.restless(wiring, TRANSITIONS, (Start, &[Check, Back]), [Begin, Stuck]);
        machine.obey(wiring, ready);
        // Goals hold only once they are loaded.
        let never = [Fetch, Read, Start].map(|phase| (phase, Closed));
        let during = [(Race, Nobody), (Wave, Reached), (Wave, Stalled), (Show, Unready)];
        let against = [(Open, Closed), (Eligible, Nobody), (Unreached, Reached), (News, Stalled)];
        machine.tell(wiring, (ready, Idle), (&during, &[Closed]), &never, &against, Double);
        let Machine { phases, signals, elapsed, .. } = machine;
        Self { phases, signals, restless, elapsed }
    }
}
