//! The choice of an operator: which ones achieve a goal, what they are worth, and the race among them.

use super::control::{Control, Phase, Signal};
use super::costs::{Costs, summed};
use super::race::{BAR, Turns, race, utilities};
use super::rules::{Regressed, Regression};
use super::wiring::{Group, Weight, Wiring, cells, each, gather};
use crate::sim::Real;

/// Weight of one level of cost in a utility. With greater weights, utilities of several levels saturate; with smaller ones
/// the race is slower and less exact.
const LEVEL: Real = 0.4;
/// Weight of an operator that achieves an unmet goal, or a goal that stands in the way of one.
const HELPS: Real = 1.2 * LEVEL;
/// Weight of a new goal.
const FRESH: Real = -0.3 * LEVEL;
/// Weight of an operator with a precondition that serves another unmet goal. With a whole level, operators that serve are
/// worth as much as better ones, and plans grow longer in spikes.
const SHARES: Real = 0.6 * LEVEL;
/// Phases in which the race becomes easier to win, and the weight of each. It begins before the race does: while goals and
/// costs settle. Greater weights save a few milliseconds a step and lose long plans.
const URGES: [(usize, Real); 4] = [
    (Phase::Wave as usize, 1.06),
    (Phase::Settle as usize, 1.7),
    (Phase::Veto as usize, 1.7),
    (Phase::Race as usize, 3.7),
];

/// The groups of the choice.
pub(super) struct Choice {
    /// Operators that may be chosen.
    pub eligible: Group,
    /// What each operator is worth.
    pub utilities: Group,
    /// The chosen operator.
    pub winner: Group,
}

impl Regression {
    /// Returns links from fluents to operators.
    pub(super) fn links(&self, part: fn(&Regressed) -> &Vec<usize>, weight: Real) -> Vec<Weight> {
        let rows = self.operators.iter().enumerate();
        rows.flat_map(|(a, o)| part(o).iter().map(move |f| (*f, a, weight))).collect()
    }
}

impl Choice {
    /// Adds the choice. `open` are the goals that do not hold.
    pub fn new(
        w: &mut Wiring<'_, '_>,
        rules: &Regression,
        Control { phases, signals, restless, elapsed }: &Control,
        (goals, open): (&Group, &Group),
        costs: &Costs,
    ) -> Self {
        let (fluents, operators) = (rules.fluents, rules.operators.len());
        let adds = |weight| rules.links(|o| &o.adds, weight);
        let needs = |weight| rules.links(|o| &o.preconditions, weight);

        let irrelevant = w.tonic("irrelevant", operators);
        w.link(goals, &irrelevant, adds(-1.3));
        let veto = w.units("veto", operators);
        w.link(goals, &veto, rules.links(|o| &o.threatens, 1.0));
        if !rules.bars.is_empty() {
            // Two goals that never hold together with a precondition.
            let pairs = w.both("pairs", rules.bars.len());
            let numbered = || rules.bars.iter().enumerate();
            let parts = numbered().flat_map(|(i, (pair, _))| pair.map(|f| (f, i, 1.0)));
            w.link(goals, &pairs, parts);
            let barred = numbered().flat_map(|(i, (_, all))| all.iter().map(move |a| (i, *a, 1.0)));
            w.link(&pairs, &veto, barred);
        }
        let eligible = w.tonic("eligible", operators);
        w.link(&eligible, signals, gather(operators, Signal::Eligible as usize, 1.0));
        let helps = helps(w, rules, goals, open);

        // A utility is the cost of the goals that are achieved, less the cost of those that are new.
        let levels = &costs.levels;
        let gains = w.both("gains", levels.count);
        w.link(levels, &gains, each(levels.count, 1.0));
        let rows = cells(fluents, rules.levels);
        w.link(goals, &gains, rows.map(|(f, _, level)| (f, level, 1.0)));
        let gain = summed(w, "gain", &gains, fluents);
        let race_phase = Phase::Race as usize;
        let growing = (phases, elapsed, restless);
        let utilities = utilities(w, growing, (race_phase, &URGES), &vec![-1.1; operators]);
        w.link(&gain, &utilities, adds(LEVEL).into_iter().chain(needs(LEVEL)));
        w.link(&costs.cost, &utilities, needs(-LEVEL));
        let absent = w.tonic("not_goals", fluents);
        w.link(goals, &absent, each(fluents, -1.3));
        w.link(&absent, &utilities, needs(FRESH));
        w.link(&helps, &utilities, each(operators, HELPS));
        for bar in [&irrelevant, &veto] {
            w.link(bar, &eligible, each(operators, -1.3));
            w.link(bar, &utilities, each(operators, BAR));
        }
        // Operators with a precondition that serves another unmet goal.
        let shares = w.units("shares", operators);
        w.link(open, &shares, rules.links(|o| &o.serves, 1.0));
        w.link(&shares, &utilities, each(operators, SHARES));

        let turns = Turns {
            race: race_phase,
            check: Phase::Check as usize,
            clear: &[Phase::Settle as usize, Phase::Start as usize, Phase::Back as usize],
            told: [Signal::Won as usize, Signal::Double as usize],
        };
        let winner = race(w, (phases, signals), &turns, &utilities);
        Self { eligible, utilities, winner }
    }
}

/// Adds the operators that achieve an unmet goal, or a goal that stands in the way of an operator for an unmet one.
fn helps(w: &mut Wiring<'_, '_>, rules: &Regression, goals: &Group, open: &Group) -> Group {
    let (fluents, operators) = (rules.fluents, rules.operators.len());
    let mut hinders = vec![false; fluents * fluents];
    for operator in &rules.operators {
        for wanted in &operator.adds {
            operator.threatens.iter().for_each(|f| hinders[wanted * fluents + f] = true);
        }
    }
    let hindrance = w.units("hindrance", fluents);
    let pairs = (0..fluents * fluents).filter(|pair| hinders[*pair]);
    w.link(open, &hindrance, pairs.map(|pair| (pair / fluents, pair % fluents, 1.0)));
    let blamed = w.both("blamed", fluents);
    w.link(&hindrance, &blamed, each(fluents, 1.0));
    w.link(goals, &blamed, each(fluents, 1.0));
    let helps = w.units("helps", operators);
    for wanted in [open, &blamed] {
        w.link(wanted, &helps, rules.links(|o| &o.adds, 1.0));
    }
    helps
}
