//! The order of a plan's phases: units that hold the present phase, and the conditions on which the next one begins.

use super::wiring::{AND, Group, Weight, Wiring, each, spread};
use crate::sim::Real;

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
    Back, Begin, Check, Done, Fetch, Next, Race, Read, Settle, Show, Start, Step, Stuck, Wave,
    Write,
};

impl Phase {
    pub const ALL: [Self; 15] = [
        Start, Wave, Write, Settle, Race, Check, Back, Read, Begin, Step, Fetch, Show, Next, Done,
        Stuck,
    ];

    /// Returns the time from its beginning until [`When::After`] holds, in milliseconds.
    fn millis(self) -> f64 {
        match self {
            Next | Step => 7.0,
            Check => 9.0,
            Start => 10.0,
            Back | Wave => 12.0,
            Begin | Settle => 15.0,
            Write => 18.0,
            Read | Fetch => 26.0,
            Race | Show | Done | Stuck => 60.0,
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
}

use Signal::{
    Closed, Double, Eligible, First, Idle, Last, Left, Nobody, Open, Reached, Unreached, Unready,
    Won,
};

impl Signal {
    pub const ALL: [Self; 13] = [
        Open, Unreached, Eligible, Won, Double, First, Last, Unready, Closed, Nobody, Reached,
        Idle, Left,
    ];
}

/// What must be so before a transition, apart from its signals.
#[derive(Debug, Clone, Copy)]
enum When {
    /// The phase is active.
    In(Phase),
    /// The phase has been active for its time.
    After(Phase),
    /// The phase has been active for long.
    Long(Phase),
    /// No phase is active.
    Nothing,
}

/// Signals that must have lasted.
const LASTING: [(Signal, f64); 4] =
    [(Closed, 7.0), (Nobody, 25.0), (Reached, 4.0), (Unready, 40.0)];

/// A transition: when, to which phase, signals that must be active, those that must have lasted, those that must not
/// be active.
type Transition = (When, Phase, &'static [Signal], &'static [Signal], &'static [Signal]);

const TRANSITIONS: &[Transition] = &[
    (When::Nothing, Start, &[Idle], &[], &[]),
    (When::After(Start), Wave, &[], &[], &[]),
    (When::After(Wave), Race, &[], &[Reached], &[]),
    (When::Long(Wave), Stuck, &[Unreached], &[], &[]),
    (When::After(Stuck), Start, &[], &[], &[Unreached]),
    (When::After(Write), Settle, &[], &[], &[]),
    (When::After(Settle), Race, &[], &[], &[]),
    (When::In(Race), Check, &[Won], &[], &[]),
    (When::In(Race), Begin, &[], &[Closed], &[Won]),
    (When::In(Race), Back, &[Open], &[Nobody], &[Won]),
    (When::Long(Race), Back, &[Open], &[], &[Won]),
    (When::After(Check), Race, &[], &[], &[Won]),
    (When::After(Check), Start, &[Won, Last], &[], &[Double]),
    (When::After(Check), Write, &[Won], &[], &[Double, Last]),
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

/// Time constant of the clocks, in milliseconds.
const CLOCK_MS: u64 = 30;
/// Time constant of the slow clock, in milliseconds.
const SLOW_MS: u64 = 300;
/// Share of the full response of a unit that a clock must reach.
const HALF: f64 = 0.42;
/// Weight with which the slow clock reaches its level only if a phase has been active nearly all the time. Phases that
/// come again and again do not count as one that lasts.
const LONG: Real = 0.55;

/// The groups of the control.
pub(super) struct Control {
    pub phases: Group,
    pub signals: Group,
    /// One unit: the last search found no plan.
    pub restless: Group,
    /// Phases that have lasted for their time.
    pub elapsed: Group,
}

/// Returns the weight with which a clock reaches its level after `millis`.
fn gain(millis: f64, tau_ms: u64) -> Real {
    (HALF / (1.0 - (-millis / tau_ms as f64).exp())) as Real
}

impl Control {
    /// Adds the phases and their transitions. `ready` and `busy` have one item each.
    pub fn new(wiring: &mut Wiring<'_, '_>, ready: &Group, busy: &Group) -> Self {
        let (count, moves) = (Phase::ALL.len(), TRANSITIONS.len());
        let phases = wiring.latches("phases", count);
        let signals = wiring.units("signals", Signal::ALL.len());
        let place = |phase: Phase| phase as usize;
        let recent = wiring.slow("recent", &phases, CLOCK_MS);
        let elapsed = wiring.biased("elapsed", count, -1.0);
        wiring.link(&elapsed, &elapsed, each(count, 0.3));
        let gains = Phase::ALL.iter().map(|p| (place(*p), place(*p), gain(p.millis(), CLOCK_MS)));
        wiring.link(&recent, &elapsed, gains.collect::<Vec<_>>());
        wiring.link(&phases, &elapsed, each(count, 1.0));
        // A phase that waits for the motor does not grow long.
        let lasts = wiring.units("lasts", count);
        wiring.link(&phases, &lasts, each(count, 1.0));
        wiring.link(busy, &lasts, spread(0, count, -1.3));
        let slow = wiring.slow("slow", &lasts, SLOW_MS);
        let long = wiring.units("long", count);
        wiring.link(&slow, &long, each(count, LONG));

        let lasting = wiring.biased("lasting", LASTING.len(), -1.0);
        wiring.link(&lasting, &lasting, each(LASTING.len(), 0.3));
        let before = wiring.slow("before", &signals, CLOCK_MS);
        let rows = || LASTING.iter().enumerate();
        let held = rows().map(|(i, (signal, ms))| (*signal as usize, i, gain(*ms, CLOCK_MS)));
        wiring.link(&before, &lasting, held.collect::<Vec<_>>());
        let now = rows().map(|(i, (signal, _))| (*signal as usize, i, 1.0));
        wiring.link(&signals, &lasting, now.collect::<Vec<_>>());

        let enter = wiring.units("enter", moves);
        wiring.link(&enter, &enter, each(moves, 0.3));
        let mut from: [Vec<Weight>; 5] = std::array::from_fn(|_| Vec::new());
        let mut bias = Vec::new();
        for (i, (when, _, on, lasted, off)) in TRANSITIONS.iter().enumerate() {
            let mut needed = on.len() + lasted.len();
            match when {
                When::In(phase) => from[0].push((place(*phase), i, 1.0)),
                When::After(phase) => from[1].push((place(*phase), i, 1.0)),
                When::Long(phase) => {
                    from[0].push((place(*phase), i, 1.0));
                    from[2].push((place(*phase), i, 1.0));
                    needed += 1;
                }
                When::Nothing => needed -= 1,
            }
            from[3].extend(on.iter().map(|s| (*s as usize, i, 1.0)));
            from[3].extend(off.iter().map(|s| (*s as usize, i, -1.3)));
            let held = |s: &Signal| LASTING.iter().position(|(of, _)| of == s);
            from[4].extend(lasted.iter().filter_map(held).map(|s| (s, i, 1.0)));
            bias.push(AND * needed as Real);
        }
        for (group, weights) in [&phases, &elapsed, &long, &signals, &lasting].into_iter().zip(from)
        {
            wiring.link(group, &enter, weights);
        }
        wiring.bias(&enter, &bias);
        let mut weights = Vec::new();
        for (i, (_, to, ..)) in TRANSITIONS.iter().enumerate() {
            weights.extend((0..count).map(|p| (i, p, if p == place(*to) { 2.0 } else { -1.2 })));
        }
        wiring.link(&enter, &phases, weights);

        // A search that fills the slots, or leaves no slot to go on with, must not begin again as it was.
        let restless = wiring.latches("restless", 1);
        let failed = TRANSITIONS.iter().enumerate().filter(|(_, (when, to, ..))| {
            *to == Start && matches!(when, When::After(Check | Back))
        });
        wiring.link(&enter, &restless, failed.map(|(i, _)| (i, 0, 2.0)).collect::<Vec<_>>());
        wiring.link(&phases, &restless, [Begin, Stuck].map(|p| (place(p), 0, -4.0)));

        // Without a request, no phase is active.
        let unasked = wiring.tonic("unasked", 1);
        wiring.link(ready, &unasked, [(0, 0, -1.3)]);
        wiring.link(&unasked, &phases, spread(0, count, -4.0));
        let idle = Idle as usize;
        wiring.link(ready, &signals, [(0, idle, 1.0)]);
        let mut told: Vec<Weight> = (0..count).map(|p| (p, idle, -1.3)).collect();
        told.extend(
            [(Race, Nobody), (Wave, Reached), (Show, Unready)]
                .map(|(p, s)| (place(p), s as usize, 1.0)),
        );
        // Goals hold only once they are loaded.
        told.extend([Fetch, Read, Start].map(|p| (place(p), Closed as usize, -1.3)));
        wiring.link(&phases, &signals, told);
        wiring.link(
            &signals,
            &signals,
            [
                (Open as usize, Closed as usize, -1.3),
                (Eligible as usize, Nobody as usize, -1.3),
                (Unreached as usize, Reached as usize, -1.3),
            ],
        );
        let mut bias = [0.0; Signal::ALL.len()];
        bias[Closed as usize] = 1.0;
        bias[Double as usize] = -1.3;
        wiring.bias(&signals, &bias);
        Self { phases, signals, restless, elapsed }
    }
}
