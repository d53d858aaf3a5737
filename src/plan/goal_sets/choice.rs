//! The choice of an operator: which ones achieve a goal, what they are worth, and the race among them.

use super::control::{Control, Phase, Signal};
use super::costs::{LEVELS, by_level};
use super::rules::{Regressed, Regression};
use super::wiring::{Group, Weight, Wiring, cells, each, gather, spread};
use crate::neurons::Map;
use crate::sim::{Real, SimDuration, Synapse};

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
/// Weight of an operator that is favoured by chance, after a search that found no plan.
const STIRS: Real = 1.5 * LEVEL;
/// Weight with which such a search lets chance through. Without it, noise of six standard deviations would be needed.
const STIRRED: Real = 3.0;
/// Standard deviation of the noise behind it, and the time constant of its changes in milliseconds: about that of a step.
const STIR_NOISE: Real = 0.5;
const STIR_MS: u64 = 100;
/// Weight with which a veto keeps an operator out of the race. It must outweigh the greatest gain in the longest race.
pub(super) const BAR: Real = -16.0;
/// Weight with which a winner holds the accumulators of all others down. With less, those that come a few milliseconds later
/// win as well.
const HOLD: Real = 8.0;
/// Time constant with which the race becomes easier to win, in milliseconds.
const URGENCY_MS: u64 = 60;
/// Phases in which the race becomes easier to win, and the weight of each. It begins before the race does: while goals and
/// costs settle. Greater weights save a few milliseconds a step and lose long plans.
const URGES: [(Phase, Real); 3] = [(Phase::Wave, 1.06), (Phase::Settle, 1.7), (Phase::Race, 3.7)];
/// Units that make a race easier to win the longer it lasts, so that the best of operators that cost much is found as well.
/// Without them it lasts until it is taken for a dead end.
const RUNGS: usize = 8;
/// Synapse from one of them to the next, in milliseconds.
const RUNG_MS: u64 = 12;

/// The groups of the choice.
pub(super) struct Choice {
    /// Rows of costs of the present goals, as those of all fluents in the costs.
    pub gains: Group,
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
        costs: &Group,
    ) -> Self {
        let (fluents, operators) = (rules.fluents, rules.operators.len());
        let adds = |weight| rules.links(|o| &o.adds, weight);
        let needs = |weight| rules.links(|o| &o.preconditions, weight);

        let irrelevant = w.tonic("irrelevant", operators);
        w.link(goals, &irrelevant, adds(-1.3));
        let veto = w.units("veto", operators);
        w.link(goals, &veto, rules.links(|o| &o.threatens, 1.0));
        let eligible = w.tonic("eligible", operators);
        w.link(&eligible, signals, gather(operators, Signal::Eligible as usize, 1.0));
        let helps = helps(w, rules, goals, open);

        // A utility is the cost of the goals that are achieved, less the cost of those that are new.
        let levels = fluents * LEVELS;
        let gains = w.both("gains", levels);
        w.link(costs, &gains, each(levels, 1.0));
        w.link(goals, &gains, cells(fluents, LEVELS).map(|(f, _, level)| (f, level, 1.0)));
        let utility = Map::each(operators, |x| x.max(0.0)).radius(2.5).above(0.0);
        let utilities = w.analog("utilities", operators, utility);
        let both = adds(LEVEL).into_iter().chain(needs(LEVEL)).collect();
        w.link(&gains, &utilities, by_level(both));
        w.link(costs, &utilities, by_level(needs(-LEVEL)));
        let absent = w.tonic("not_goals", fluents);
        w.link(goals, &absent, each(fluents, -1.3));
        w.link(&absent, &utilities, needs(FRESH));
        w.link(&helps, &utilities, each(operators, HELPS));
        for bar in [&irrelevant, &veto] {
            w.link(bar, &eligible, each(operators, -1.3));
            w.link(bar, &utilities, each(operators, BAR));
        }
        let urgency = w.slow("urgency", phases, URGENCY_MS);
        w.link(
            &urgency,
            &utilities,
            URGES.iter().flat_map(|(p, u)| spread(*p as usize, operators, *u)),
        );
        w.bias(&utilities, &vec![-1.1; operators]);

        let impatience = impatience(w, phases, elapsed);
        w.link(&impatience, &utilities, (0..RUNGS).flat_map(|rung| spread(rung, operators, 1.0)));
        // Operators with a precondition that serves another unmet goal.
        let shares = w.units("shares", operators);
        w.link(open, &shares, rules.links(|o| &o.serves, 1.0));
        w.link(&shares, &utilities, each(operators, SHARES));

        let stir = stir(w, operators, restless);
        w.link(&stir, &utilities, each(operators, STIRS));

        let winner = race(w, operators, (phases, signals), &utilities);
        Self { gains, eligible, utilities, winner }
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

/// Adds units of which half, others from race to race, are active after a search that found no plan. So the next search takes
/// another way.
fn stir(w: &mut Wiring<'_, '_>, operators: usize, restless: &Group) -> Group {
    let stir = w.biased("stir", operators, 0.5 - STIRRED);
    let chance = w.noisy("chance", operators, STIR_NOISE, STIR_MS);
    w.link(restless, &chance, spread(0, operators, STIRRED));
    w.link_by(&chance, &stir, each(operators, 1.0), Synapse::lowpass_ms(STIR_MS));
    stir
}

/// Adds a row of units that become active one after the other while a race lasts, and fall silent with it.
fn impatience(w: &mut Wiring<'_, '_>, phases: &Group, elapsed: &Group) -> Group {
    let race = Phase::Race as usize;
    let rungs = w.both("impatience", RUNGS);
    w.link(phases, &rungs, spread(race, RUNGS, 1.0));
    w.link(elapsed, &rungs, [(race, 0, 1.0)]);
    let later = (1..RUNGS).map(|rung| (rung - 1, rung, 1.0));
    w.link_by(&rungs, &rungs, later, Synapse::lowpass_ms(RUNG_MS));
    rungs
}

/// Adds the race of accumulators, and latches that hold the winner. A winner holds the other accumulators down.
fn race(
    w: &mut Wiring<'_, '_>,
    operators: usize,
    (phases, signals): (&Group, &Group),
    utilities: &Group,
) -> Group {
    let race = w.race("race", operators, SimDuration::from_millis(5));
    w.link(utilities, &race, each(operators, 1.0));
    let rest = w.tonic("rest", 1);
    w.link(phases, &rest, [(Phase::Race as usize, 0, -1.3)]);
    w.link(&rest, &race, spread(0, operators, -8.0));
    let winner = w.latches("winner", operators);
    w.link(&race, &winner, each(operators, 1.0));
    let rivals = w.sum("rivals", 1);
    w.link(&winner, &rivals, gather(operators, 0, 1.0));
    let own = w.sum("own", operators);
    w.link(&winner, &own, each(operators, 1.0));
    w.link(&rivals, &race, spread(0, operators, -HOLD));
    w.link(&own, &race, each(operators, HOLD));
    let clearing = [Phase::Settle, Phase::Start, Phase::Back];
    let cleared = clearing.iter().flat_map(|p| spread(*p as usize, operators, -4.0));
    w.link(phases, &winner, cleared);
    break_ties(w, phases, &winner);
    let told = [Signal::Won, Signal::Double].map(|signal| (0, signal as usize, 1.0));
    w.link(&rivals, signals, told);
    winner
}

/// Lets every winner give way to those before it, in [`Phase::Check`].
///
/// Winners are summed in rows, so that the weights are as many as operators times the root of their number.
fn break_ties(w: &mut Wiring<'_, '_>, phases: &Group, winner: &Group) {
    const BEFORE: Real = 1.3;
    let operators = winner.count;
    let side = operators.isqrt().max(1);
    let rows = w.sum("winner_rows", operators.div_ceil(side));
    w.link(winner, &rows, (0..operators).map(|a| (a, a / side, 1.0)));
    let later = w.both("give_way", operators);
    let before = (0..operators).flat_map(|a| (0..a / side).map(move |row| (row, a, BEFORE)));
    w.link(&rows, &later, before);
    let beside = (0..operators).flat_map(|a| (a - a % side..a).map(move |b| (b, a, BEFORE)));
    w.link(winner, &later, beside);
    w.link(phases, &later, spread(Phase::Check as usize, operators, 1.0));
    w.link(&later, winner, each(operators, -4.0));
}
