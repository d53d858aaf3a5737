//! What a set of latches takes over, and the motor units that show an action.

use super::wiring::{Group, Weight, Wiring, each, gather, spread};
use crate::sim::Real;

/// Replaces the contents of a set by the beginning of a source in some phases.
pub(super) fn load(
    w: &mut Wiring<'_, '_>,
    name: &str,
    source: &Group,
    set: &Group,
    phases: &Group,
    when: &[usize],
) {
    let fluents = set.count;
    let now = || when.iter().flat_map(|p| spread(*p, fluents, 1.0)).collect::<Vec<_>>();
    let on = w.both(&format!("{name}_set"), fluents);
    w.link(source, &on, each(fluents, 1.0));
    w.link(phases, &on, now());
    w.link(&on, set, each(fluents, 1.2));
    let off = w.units(&format!("{name}_reset"), fluents);
    w.link(source, &off, each(fluents, -1.3));
    w.link(phases, &off, now());
    w.link(&off, set, each(fluents, -2.5));
}

/// When an action may be shown.
pub(super) struct Acting<'a> {
    /// Phases in which it is, with their weights. One of weight 1 needs a goal that does not hold as well.
    pub phases: &'a [(usize, Real)],
    /// The signal of a goal that does not hold.
    pub open: usize,
    /// The signal that no action can be shown.
    pub unready: usize,
}

/// Adds the motor units: the shown action, while its preconditions hold, its effects do not, and some goal is open. `needs`
/// and `adds` link fluents to operators.
pub(super) fn act(
    w: &mut Wiring<'_, '_>,
    (needs, adds): (&[Weight], &[Weight]),
    (phases, signals): (&Group, &Group),
    acting: &Acting<'_>,
    holds: &Group,
    shown: &Group,
) -> Group {
    let operators = shown.count;
    let counts = |links: &[Weight]| {
        let mut counts = vec![0.0; operators];
        links.iter().for_each(|(_, operator, _)| counts[*operator] += 1.0);
        counts
    };
    let of = |links: &[Weight], weight: Real| {
        links.iter().map(|(f, a, _)| (*f, *a, weight)).collect::<Vec<_>>()
    };
    let lacking = w.units("lacking", operators);
    w.link(holds, &lacking, of(needs, -1.0));
    w.bias(&lacking, &counts(needs));
    // All that the operator adds holds: it is not done again, even if another goal was lost meanwhile.
    let done = w.units("done", operators);
    w.link(holds, &done, of(adds, 1.0));
    w.bias(&done, &counts(adds).iter().map(|count| 1.0 - count).collect::<Vec<_>>());
    let now = w.both("acting", 1);
    w.link(signals, &now, [(acting.open, 0, 1.0)]);
    w.link(phases, &now, acting.phases.iter().map(|(phase, weight)| (*phase, 0, *weight)));
    let motor = w.both("motor", operators);
    w.link(shown, &motor, each(operators, 1.0));
    w.link(&lacking, &motor, each(operators, -1.5));
    w.link(&done, &motor, each(operators, -1.5));
    w.link(&now, &motor, spread(0, operators, 1.0));
    w.link(&motor, signals, gather(operators, acting.unready, -1.3));
    motor
}
