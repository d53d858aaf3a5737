//! The order of the phases of forward search.

use crate::plan::goal_sets::machine::{Item, Machine, Timed, Transition, When, items};
use crate::plan::goal_sets::wiring::{Group, Wiring};

/// A phase. Exactly one is active while the search works.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::plan::goal_sets) enum Phase {
    /// Forgets everything, takes what holds.
    Start,
    /// Writes the state to its slot, and takes over the state after the winner.
    Write,
    /// Moves to the slot and lets everything settle.
    Settle,
    /// Forgets the wave.
    Look,
    /// The wave runs from the state.
    Wave,
    /// Operators race.
    Race,
    /// Waits until only the first of several winners is left, and compares the state after it with all that were visited.
    Check,
    /// The winner leads to a visited state: it is barred until the state changes.
    Veto,
    /// Finds the slot to go on with, after a dead end.
    Back,
    /// Loads the state of that slot.
    Read,
    /// The goal holds in the present slot, or on the way to one where it does. Marks the slot, and finds the one before.
    Mark,
    /// Lets the last phase end.
    Rest,
    /// Moves to the slot before.
    Up,
    /// Finds the marked slot after the present one, to act.
    Step,
    /// Loads the state of that slot, and shows the action that leads to it.
    Fetch,
    /// Shows the action until the state holds.
    Show,
    /// Moves to that slot.
    Next,
    /// The goal holds.
    Done,
    /// Some goal cannot be reached from what holds, even if nothing were ever deleted.
    Stuck,
    /// There were many dead ends. Waits until the phase before has ended: the next one forgets the dead ends, and without them the
    /// phase before would lead elsewhere.
    Tired,
    /// No slot is left. Forgets the dead ends, and goes on with all operators that can be applied.
    Widen,
}

use Phase::{
    Back, Check, Done, Fetch, Look, Mark, Next, Race, Read, Rest, Settle, Show, Start, Step, Stuck,
    Tired, Up, Veto, Wave, Widen, Write,
};

impl Phase {
    pub const ALL: [Self; 21] = [
        Start, Write, Settle, Look, Wave, Race, Check, Veto, Back, Read, Mark, Rest, Up, Step,
        Fetch, Show, Next, Done, Stuck, Tired, Widen,
    ];
}

items!(Phase: Widen, Signal: Idle);

impl Timed for Phase {
    fn millis(self) -> f64 {
        match self {
            Next | Rest => 9.0,
            Veto => 9.0,
            Back | Look | Up => 12.0,
            Start | Wave => 14.0,
            Settle => 15.0,
            Write | Mark | Step => 18.0,
            Read | Fetch | Tired | Widen => 26.0,
            Check => 24.0,
            Race | Show | Done | Stuck => 60.0,
        }
    }
}

/// A condition of a transition.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::plan::goal_sets) enum Signal {
    /// Some goal is not in the state.
    Unmet,
    /// All goals are in the state.
    Solved,
    /// Something of the state does not hold.
    Open,
    /// All of the state holds.
    Closed,
    /// Some goal is not reached by the wave.
    Unreached,
    /// All goals are.
    Reached,
    /// Some goal is not reached even by the wave that waits for no costs.
    Beyond,
    /// That wave goes on.
    News,
    /// It runs and does not go on.
    Stalled,
    /// The relaxed plan grows.
    Grows,
    /// Some operator may win the race.
    Eligible,
    /// The race has no candidates.
    Nobody,
    /// An operator has won.
    Won,
    /// Several operators have won.
    Double,
    /// The state after the winner was visited.
    Seen,
    /// The state has changed since the wave.
    Stale,
    /// It is one that the search came back to while operators outside the relaxed plan are tried, and no wave has run since.
    Returned,
    /// The present slot is the first.
    First,
    /// The present slot is the last.
    Last,
    /// Some slot is taken and no dead end, apart from the present one.
    Left,
    /// So many slots are dead ends that it pays to begin anew.
    Weary,
    /// Operators outside the relaxed plan are tried as well.
    Wide,
    /// A marked slot follows.
    Follows,
    /// No action is shown, or one of its preconditions does not hold, or all its effects do.
    Unready,
    /// The plan is requested, and no phase is active.
    Idle,
}

use Signal::{
    Beyond, Closed, Double, Eligible, First, Follows, Grows, Idle, Last, Left, News, Nobody, Open,
    Reached, Returned, Seen, Solved, Stale, Stalled, Unmet, Unreached, Unready, Weary, Wide, Won,
};

/// Signals that must have lasted, and for how many milliseconds.
const LASTING: [(Signal, f64); 6] = [
    (Closed, 7.0),
    (Solved, 7.0),
    (Nobody, 25.0),
    (Reached, 8.0),
    (Stalled, 25.0),
    (Unready, 40.0),
];

const TRANSITIONS: &[Transition<Phase, Signal>] = &[
    (When::Nothing, Start, &[Idle], &[], &[]),
    (When::After(Start), Write, &[], &[], &[]),
    (When::After(Write), Settle, &[], &[], &[]),
    (When::After(Settle), Race, &[], &[], &[Returned]),
    (When::After(Settle), Look, &[Returned], &[], &[]),
    (When::In(Race), Check, &[Won], &[], &[]),
    (When::In(Race), Mark, &[], &[Solved], &[Won]),
    (When::In(Race), Look, &[Stale, Unmet], &[Nobody], &[Won]),
    (When::In(Race), Back, &[Unmet], &[Nobody], &[Won, Stale]),
    (When::Long(Race), Back, &[Unmet], &[], &[Won]),
    (When::After(Look), Wave, &[], &[], &[]),
    (When::After(Wave), Race, &[], &[Reached], &[]),
    (When::In(Wave), Stuck, &[First, Beyond], &[Stalled], &[]),
    (When::In(Wave), Back, &[Beyond], &[Stalled], &[First]),
    (When::After(Check), Race, &[], &[], &[Won]),
    (When::After(Check), Start, &[Won, Last], &[], &[Double]),
    (When::After(Check), Veto, &[Won, Seen], &[], &[Double, Last]),
    (When::After(Check), Write, &[Won], &[], &[Double, Last, Seen]),
    (When::After(Veto), Race, &[], &[], &[Won]),
    (When::After(Back), Read, &[Left], &[], &[Weary]),
    (When::After(Back), Tired, &[Weary], &[], &[]),
    (When::After(Tired), Start, &[], &[], &[]),
    (When::After(Back), Widen, &[], &[], &[Left, Weary, Wide]),
    (When::After(Widen), Read, &[], &[], &[]),
    (When::After(Back), Start, &[Wide], &[], &[Left, Weary]),
    (When::After(Read), Settle, &[], &[], &[]),
    (When::After(Mark), Rest, &[], &[], &[First]),
    (When::After(Mark), Step, &[First], &[], &[]),
    (When::After(Rest), Up, &[], &[], &[]),
    (When::After(Up), Mark, &[], &[], &[]),
    (When::After(Step), Fetch, &[Follows], &[], &[]),
    (When::After(Step), Done, &[], &[], &[Follows]),
    (When::After(Fetch), Show, &[], &[], &[]),
    (When::In(Show), Next, &[], &[Closed], &[]),
    (When::In(Show), Start, &[Open], &[Unready], &[]),
    (When::Long(Show), Start, &[Open], &[], &[]),
    (When::After(Next), Step, &[], &[], &[]),
    (When::After(Done), Start, &[Open], &[], &[]),
    (When::After(Stuck), Start, &[Open], &[], &[]),
];

/// The groups of the control.
pub(super) struct Control {
    pub phases: Group,
    pub signals: Group,
    /// Phases that have lasted for their time.
    pub elapsed: Group,
    /// One unit: the last search found no plan.
    pub restless: Group,
    /// One unit: operators outside the relaxed plan are tried as well.
    pub wide: Group,
}

impl Control {
    /// Adds the phases and their transitions. `ready` and `busy` have one item each.
    pub fn new(w: &mut Wiring<'_, '_>, ready: &Group, busy: &Group) -> Self {
        let machine = Machine::new(w, &Phase::ALL, TRANSITIONS, &LASTING, busy);
        let restless =
            machine.restless(w, TRANSITIONS, (Start, &[Check, Back, Tired]), [Mark, Stuck]);
        machine.obey(w, ready);
        // A state holds only once it is loaded.
        let closed = [Fetch, Read, Start].map(|phase| (phase, Closed));
        let solved = [Read, Start, Write].map(|phase| (phase, Solved));
        let never = [closed, solved].concat();
        let during = [(Race, Nobody), (Wave, Reached), (Wave, Stalled), (Show, Unready)];
        let against = [
            (Open, Closed),
            (Unmet, Solved),
            (Eligible, Nobody),
            (Grows, Nobody),
            (Unreached, Reached),
            (News, Stalled),
        ];
        machine.tell(w, (ready, Idle), (&during, &[Closed, Solved]), &never, &against, Double);

        // The state has changed since the last wave.
        let Machine { phases, signals, elapsed, .. } = machine;
        let stale = w.latches("stale", 1);
        let changes = [(Write, 1.2), (Read, 1.2), (Wave, -4.0)];
        w.link(&phases, &stale, changes.map(|(phase, weight)| (phase.place(), 0, weight)));
        w.link(&stale, &signals, [(0, Stale.place(), 1.0)]);
        let returned = w.latches("returned", 1);
        w.link(
            &phases,
            &returned,
            [(Read.place(), 0, 1.2), (Look.place(), 0, -4.0), (Start.place(), 0, -4.0)],
        );
        let wide = w.latches("wide", 1);
        w.link(&phases, &wide, [(Widen.place(), 0, 1.2), (Start.place(), 0, -4.0)]);
        w.link(&wide, &signals, [(0, Wide.place(), 1.0)]);
        // In a state that the search comes back to, the relaxed plan of the state that it left goes on, with other operators than
        // were tried there. Only where operators outside the relaxed plan are tried, a new one is needed to tell which they are.
        let anew = w.both("anew", 1);
        w.link(&returned, &anew, [(0, 0, 1.0)]);
        w.link(&wide, &anew, [(0, 0, 1.0)]);
        w.link(&anew, &signals, [(0, Returned.place(), 1.0)]);
        Self { phases, signals, elapsed, restless, wide }
    }
}
