//! A state machine of units: one latch for each phase, and units that watch for the conditions of each transition.

use super::wiring::{AND, Group, Weight, Wiring, each, spread};
use crate::sim::Real;

/// A phase or a signal of a machine.
pub(super) trait Item: Copy + PartialEq + 'static {
    /// How many there are.
    const COUNT: usize;

    /// Returns its place among them.
    fn place(self) -> usize;
}

/// Counts the variants of enumerations, whose last one is named.
macro_rules! items {
    ($($kind:ident: $last:ident),*) => {
        $(impl $crate::plan::goal_sets::machine::Item for $kind {
            const COUNT: usize = $kind::$last as usize + 1;

            fn place(self) -> usize {
                let item = self;
                item as usize
            }
        })*
    };
}
pub(super) use items;

/// A phase of a machine.
pub(super) trait Timed: Item {
    /// Returns the time from its beginning until [`When::After`] holds, in milliseconds.
    fn millis(self) -> f64;
}

/// What must be so before a transition, apart from its signals.
#[derive(Debug, Clone, Copy)]
pub(super) enum When<P> {
    /// The phase is active.
    In(P),
    /// The phase has been active for its time.
    After(P),
    /// The phase has been active for long.
    Long(P),
    /// No phase is active.
    Nothing,
}

/// A transition: when, to which phase, signals that must be active, those that must have lasted, those that must not
/// be active.
pub(super) type Transition<P, S> = (When<P>, P, &'static [S], &'static [S], &'static [S]);

/// Time constant of the clocks, in milliseconds.
const CLOCK_MS: u64 = 30;
/// Time constant of the slow clock, in milliseconds.
const SLOW_MS: u64 = 300;
/// Share of the full response of a unit that a clock must reach.
const HALF: f64 = 0.42;
/// Weight with which the slow clock reaches its level only if a phase has been active nearly all the time. Phases that
/// come again and again do not count as one that lasts.
const LONG: Real = 0.55;

/// Returns the weight with which a clock reaches its level after `millis`.
fn gain(millis: f64, tau_ms: u64) -> Real {
    (HALF / (1.0 - (-millis / tau_ms as f64).exp())) as Real
}

/// The groups of a machine.
pub(super) struct Machine {
    pub phases: Group,
    pub signals: Group,
    /// One unit for each transition: it happens now.
    pub enter: Group,
    /// Phases that have lasted for their time.
    pub elapsed: Group,
}

impl Machine {
    /// Adds the phases and their transitions. `busy` has one item; while it is active, no phase grows long. `lasting` are
    /// the signals that may be asked to have lasted, with their time in milliseconds.
    pub fn new<P: Timed, S: Item>(
        wiring: &mut Wiring<'_, '_>,
        all: &[P],
        transitions: &[Transition<P, S>],
        lasting_ms: &[(S, f64)],
        busy: &Group,
    ) -> Self {
        let (count, moves) = (P::COUNT, transitions.len());
        let phases = wiring.latches("phases", count);
        let signals = wiring.units("signals", S::COUNT);
        let recent = wiring.slow("recent", &phases, CLOCK_MS);
        let elapsed = wiring.biased("elapsed", count, -1.0);
        wiring.link(&elapsed, &elapsed, each(count, 0.3));
        let gains = all.iter().map(|p| (p.place(), p.place(), gain(p.millis(), CLOCK_MS)));
        wiring.link(&recent, &elapsed, gains.collect::<Vec<_>>());
        wiring.link(&phases, &elapsed, each(count, 1.0));
        // A phase that waits for the motor does not grow long.
        let lasts = wiring.units("lasts", count);
        wiring.link(&phases, &lasts, each(count, 1.0));
        wiring.link(busy, &lasts, spread(0, count, -1.3));
        let slow = wiring.slow("slow", &lasts, SLOW_MS);
        let long = wiring.units("long", count);
        wiring.link(&slow, &long, each(count, LONG));

        let lasting = wiring.biased("lasting", lasting_ms.len(), -1.0);
        wiring.link(&lasting, &lasting, each(lasting_ms.len(), 0.3));
        let before = wiring.slow("before", &signals, CLOCK_MS);
        let rows = || lasting_ms.iter().enumerate();
        let held = rows().map(|(i, (signal, ms))| (signal.place(), i, gain(*ms, CLOCK_MS)));
        wiring.link(&before, &lasting, held.collect::<Vec<_>>());
        let now = rows().map(|(i, (signal, _))| (signal.place(), i, 1.0));
        wiring.link(&signals, &lasting, now.collect::<Vec<_>>());

        let enter = wiring.units("enter", moves);
        wiring.link(&enter, &enter, each(moves, 0.3));
        let mut from: [Vec<Weight>; 5] = std::array::from_fn(|_| Vec::new());
        let mut bias = Vec::new();
        for (i, (when, _, on, lasted, off)) in transitions.iter().enumerate() {
            let mut needed = on.len() + lasted.len();
            match when {
                When::In(phase) => from[0].push((phase.place(), i, 1.0)),
                When::After(phase) => from[1].push((phase.place(), i, 1.0)),
                When::Long(phase) => {
                    from[0].push((phase.place(), i, 1.0));
                    from[2].push((phase.place(), i, 1.0));
                    needed += 1;
                }
                When::Nothing => needed -= 1,
            }
            from[3].extend(on.iter().map(|s| (s.place(), i, 1.0)));
            from[3].extend(off.iter().map(|s| (s.place(), i, -1.3)));
            let held = |s: &S| lasting_ms.iter().position(|(of, _)| of == s);
            from[4].extend(lasted.iter().filter_map(held).map(|s| (s, i, 1.0)));
            bias.push(AND * needed as Real);
        }
        for (group, weights) in [&phases, &elapsed, &long, &signals, &lasting].into_iter().zip(from)
        {
            wiring.link(group, &enter, weights);
        }
        wiring.bias(&enter, &bias);
        let mut weights = Vec::new();
        for (i, (_, to, ..)) in transitions.iter().enumerate() {
            weights.extend((0..count).map(|p| (i, p, if p == to.place() { 2.0 } else { -1.2 })));
        }
        wiring.link(&enter, &phases, weights);

        Self { phases, signals, enter, elapsed }
    }

    /// Adds one unit that remembers that a search found no plan, so that the next one takes another way. It becomes active when
    /// the search begins anew, in the phase `start`, after one of the phases `failed`, and falls silent in the phases `calm`.
    pub fn restless<P: Timed, S: Item>(
        &self,
        wiring: &mut Wiring<'_, '_>,
        transitions: &[Transition<P, S>],
        (start, failed): (P, &[P]),
        calm: [P; 2],
    ) -> Group {
        let restless = wiring.latches("restless", 1);
        let fails = transitions.iter().enumerate().filter(|(_, (when, to, ..))| {
            *to == start && matches!(when, When::After(phase) if failed.contains(phase))
        });
        wiring.link(&self.enter, &restless, fails.map(|(i, _)| (i, 0, 2.0)).collect::<Vec<_>>());
        wiring.link(&self.phases, &restless, calm.map(|p| (p.place(), 0, -4.0)));
        restless
    }

    /// Adds the signals that come from phases and from other signals: `idle` while `ready` asks and no phase is active; each
    /// of `during` in its phase, unless another signal is `against` it, and each of `unless` as long as none is. They are silent in the
    /// phases of `never`. `double` tells of more than one.
    pub fn tell<P: Timed, S: Item>(
        &self,
        wiring: &mut Wiring<'_, '_>,
        (ready, idle): (&Group, S),
        (during, unless): (&[(P, S)], &[S]),
        never: &[(P, S)],
        against: &[(S, S)],
        double: S,
    ) {
        wiring.link(ready, &self.signals, [(0, idle.place(), 1.0)]);
        let mut told: Vec<Weight> = (0..P::COUNT).map(|p| (p, idle.place(), -1.3)).collect();
        told.extend(during.iter().map(|(p, s)| (p.place(), s.place(), 1.0)));
        told.extend(never.iter().map(|(p, s)| (p.place(), s.place(), -1.3)));
        wiring.link(&self.phases, &self.signals, told);
        let against = against.iter().map(|(a, b)| (a.place(), b.place(), -1.3));
        wiring.link(&self.signals, &self.signals, against.collect::<Vec<_>>());
        let mut bias = vec![0.0; S::COUNT];
        unless.iter().for_each(|s| bias[s.place()] = 1.0);
        bias[double.place()] = -1.3;
        wiring.bias(&self.signals, &bias);
    }

    /// Silences all phases while `ready`, which has one item, is not active.
    pub fn obey(&self, wiring: &mut Wiring<'_, '_>, ready: &Group) {
        let unasked = wiring.tonic("unasked", 1);
        wiring.link(ready, &unasked, [(0, 0, -1.3)]);
        wiring.link(&unasked, &self.phases, spread(0, self.phases.count, -4.0));
    }
}
