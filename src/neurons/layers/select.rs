//! The layer of a choice among utilities: a threshold, a contest of utilities, or a race of evidence.
//!
//! In neurons each item has an ensemble that decodes to 1 above the level and is silent below it. A contest
//! (winner-take-all) adds a second ensemble per item. It inhibits all other items in proportion to the utility of its
//! own item, so the greatest utility silences the rest. A race (independent accumulators) adds a second ensemble per
//! item that gathers evidence through a recurrent synapse.
//!
//! Items under a threshold are independent and advance in parts. A contest and a race sum over all items, so they advance
//! as one part.

use super::{Circuit, Items, Layer, Populated};
use crate::neurons::builder::{Components, Keep, Onset, PopulationBuilder};
use crate::neurons::tuning::TuningError;
use crate::sim::{
    AdvanceIo, Fingerprint, InputSpec, Node, NodeFault, OutputSpec, PartIo, PortDecl, Real,
    SimDuration, StateSpec, StepCx, decayed,
};

/// The rule by which a [`Select`] chooses items from their utilities.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SelectRule {
    /// Chooses every item whose utility is at least `level`.
    Threshold {
        /// Least utility of a chosen item (finite).
        level: Real,
    },
    /// Chooses the item of greatest utility if this utility is at least `level`. In direct mode the first of equal
    /// items wins.
    WinnerTakeAll {
        /// Least utility of a chosen item (finite).
        level: Real,
    },
    /// Chooses the first item that has gathered enough evidence.
    ///
    /// Each item integrates the excess of its utility over `level` as evidence; `tau` sets the speed. The first item
    /// whose evidence reaches 0.8 is chosen. It holds the evidence of all others at zero until its own evidence has
    /// drained (Gosmann, Voelker and Eliasmith, "A spiking independent accumulator model for winner-take-all
    /// computation", 2017). This is slower than [`WinnerTakeAll`](Self::WinnerTakeAll) but never chooses two items at
    /// once.
    IndependentAccumulators {
        /// Level of utility, a finite number. Evidence grows while the utility is above the level and drains while it
        /// is below.
        level: Real,
        /// Time in which an excess of 1 over the level gathers evidence of 1. Must be above zero.
        tau: SimDuration,
    },
}

/// Evidence at which an item is chosen.
const EVIDENCE_THRESHOLD: Real = 0.8;

impl SelectRule {
    fn fingerprint(self, hash: &mut Fingerprint) {
        hash.reals(&[self.level()]);
        match self {
            Self::Threshold { .. } => hash.text("threshold"),
            Self::WinnerTakeAll { .. } => hash.text("winner"),
            Self::IndependentAccumulators { tau, .. } => {
                hash.text("accumulators").number(tau.as_micros())
            }
        };
    }

    fn level(self) -> Real {
        match self {
            Self::Threshold { level }
            | Self::WinnerTakeAll { level }
            | Self::IndependentAccumulators { level, .. } => level,
        }
    }
}

/// A request for a choice among utilities. The output is 1 for a chosen item and 0 for the others.
#[derive(Debug, Clone)]
pub struct Select {
    items: usize,
    rule: SelectRule,
}

/// Amount that an inhibition of 1 subtracts from a utility. It is enough to silence any similarity.
const INHIBITION: Real = 4.0;

impl Select {
    /// Requests a choice among `items` utilities (at least 1) by `rule`.
    ///
    /// A level that is not finite, or an accumulator time constant of zero, is a fault when the graph is built.
    pub fn new(items: usize, rule: SelectRule) -> Self {
        Self { items, rule }
    }
}

impl Node for Select {
    fn declare(&self, ports: &mut PortDecl) {
        if !self.rule.level().is_finite() {
            let level = self.rule.level();
            ports.fault(format!("the selection level is {level}; expected a finite number"));
        }
        if let SelectRule::IndependentAccumulators { tau, .. } = self.rule
            && tau == SimDuration::from_millis(0)
        {
            ports.fault("the accumulators' time constant `tau` is 0; expected a time above 0");
        }
        if let SelectRule::IndependentAccumulators { .. } = self.rule {
            ports.state(StateSpec { reals: self.items, ..StateSpec::default() });
        }
        ports
            .input("in", InputSpec::vector(self.items).sum().at_advance())
            .input("inhibit", InputSpec::vector(self.items).sum().optional().at_advance())
            .output("out", OutputSpec::vector(self.items).registered().filtered_only());
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        self.rule.fingerprint(hash);
    }

    fn advance(&self, cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let (utilities, inhibit) = (io.inputs.get(0), io.inputs.get(1));
        let output = io.outputs.get_mut(0);
        output.fill(0.0);
        let net = utilities.iter().zip(inhibit).map(|(u, i)| u - INHIBITION * i);
        match self.rule {
            SelectRule::Threshold { level } => {
                for (out, utility) in output.iter_mut().zip(net) {
                    if utility >= level {
                        *out = 1.0;
                    }
                }
            }
            SelectRule::WinnerTakeAll { level } => {
                let mut best = None;
                let mut most = level;
                for (index, utility) in net.enumerate() {
                    if utility > most || (best.is_none() && utility >= level) {
                        (best, most) = (Some(index), utility);
                    }
                }
                if let Some(index) = best {
                    output[index] = 1.0;
                }
            }
            SelectRule::IndependentAccumulators { level, tau } => {
                let rate = (cx.dt_s() / tau.as_secs_f64()) as Real;
                let evidence = &mut *io.state.reals;
                for ((evidence, utility), inhibit) in
                    evidence.iter_mut().zip(utilities).zip(inhibit)
                {
                    let gathered = *evidence + rate * (utility - level) - INHIBITION * inhibit;
                    *evidence = gathered.clamp(0.0, 1.0);
                }
                // If several items reach the threshold in one tick, the one with the most evidence wins.
                let first = (0..evidence.len())
                    .filter(|i| evidence[*i] >= EVIDENCE_THRESHOLD)
                    .reduce(|best, i| if evidence[i] > evidence[best] { i } else { best });
                if let Some(first) = first {
                    let own = evidence[first];
                    evidence.fill(0.0);
                    (evidence[first], output[first]) = (own, 1.0);
                }
            }
        }
        Ok(())
    }
}

/// Weight of the inhibition between items. In a contest it applies to the utility of a rival, in a race to the
/// activity of a rival.
const RIVALRY: Real = 2.0;
/// Time constant of the inhibition between items, in seconds.
const RIVALRY_TAU_S: f64 = 0.005;
/// Utility above which an item takes part in the contest, as a fraction of the level.
const CONTENDING: f64 = 0.6;
/// Fraction of an item's neurons that take part in the contest.
const CONTEST_SHARE: f64 = 0.4;
/// Fraction of an item's neurons that gather evidence.
const RACE_SHARE: f64 = 0.7;
/// Time constant of the recurrent synapse that holds the evidence, in seconds.
const EVIDENCE_TAU_S: f64 = 0.1;

impl Layer for Select {
    fn direct(&self) -> Box<dyn Node> {
        Box::new(self.clone())
    }

    fn neural(&self, builder: &PopulationBuilder<'_>) -> Result<Populated, TuningError> {
        let tuning = builder.tuning();
        let level = f64::from(self.rule.level());
        // Utilities are cosines or sums of a few cosines.
        let radius = level.max(0.0) + 0.7;
        let keep = match self.rule {
            SelectRule::Threshold { .. } => Keep::Groups(1),
            _ => Keep::All(builder.owner(self.items * tuning.per_item)),
        };
        let of = |share: f64, radius: f64, onset: Onset| {
            let neurons = tuning.per_item as f64 * share;
            Components { width: self.items, neurons, radius, onset, keep }
        };
        let chosen = |share: f64, radius: f64, level: f64| {
            let onset = Onset::JustAbove { level, mean: tuning.item_spread };
            builder.components("chosen", &of(share, radius, onset), &|_| 1.0)
        };
        let decay = |tau_s: f64| (-builder.dt_s() / tau_s).exp() as Real;
        let populated = |chosen, rivalry| {
            let circuit = Choice { rule: self.rule, rivalry };
            Populated::new(self.direct(), chosen, circuit).scratch(2)
        };
        Ok(match self.rule {
            SelectRule::Threshold { .. } => populated(chosen(1.0, radius, level)?, Rivalry::None),
            SelectRule::WinnerTakeAll { .. } => {
                let contending = of(CONTEST_SHARE, radius, Onset::Above(CONTENDING * level));
                let contest = builder.components("contest", &contending, &|u| u)?;
                let rivalry = Rivalry::Contest { decay: decay(RIVALRY_TAU_S) };
                let chosen = chosen(1.0 - CONTEST_SHARE, radius, level)?;
                populated(chosen, rivalry).and(contest).held(1)
            }
            SelectRule::IndependentAccumulators { tau, .. } => {
                let gathering = of(RACE_SHARE, 1.0, Onset::Above(0.0));
                let accumulators = builder.components("accumulators", &gathering, &|u| u)?;
                let (decay, hold) = (decay(RIVALRY_TAU_S), decay(EVIDENCE_TAU_S));
                let gain = (EVIDENCE_TAU_S / tau.as_secs_f64()) as Real;
                let chosen = chosen(1.0 - RACE_SHARE, 1.2, f64::from(EVIDENCE_THRESHOLD))?;
                populated(chosen, Rivalry::Race { decay, hold, gain }).and(accumulators).held(3)
            }
        })
    }
}

/// The circuit of a selection. Population 0 chooses; population 1 is that of the rivalry.
struct Choice {
    rule: SelectRule,
    rivalry: Rivalry,
}

/// How items inhibit each other.
enum Rivalry {
    /// No inhibition: the threshold rule.
    None,
    /// Each item inhibits all others in proportion to its own utility.
    Contest { decay: Real },
    /// Each item gathers evidence. The first to reach the threshold silences all others.
    Race { decay: Real, hold: Real, gain: Real },
}

impl Circuit for Choice {
    fn fingerprint(&self, hash: &mut Fingerprint) {
        self.rule.fingerprint(hash);
    }

    fn advance(&self, items: &Items<'_>, io: &mut PartIo<'_>) {
        let own = items.range();
        let (net, said) = io.scratch.reals[..2 * own.len()].split_at_mut(own.len());
        let (utilities, inhibit) = (&io.inputs.get(0)[own.clone()], &io.inputs.get(1)[own]);
        for ((net, utility), inhibit) in net.iter_mut().zip(utilities).zip(inhibit) {
            *net = utility - INHIBITION * inhibit;
        }
        let output = &mut *io.results;
        match &self.rivalry {
            Rivalry::None => items.step(0, (net, 1.0), io.state, output),
            Rivalry::Contest { decay } => {
                let ([chosen, contest], strengths) = items.split(io.state);
                let all: Real = strengths.iter().sum();
                for (net, own) in net.iter_mut().zip(&*strengths) {
                    *net -= RIVALRY * (all - own);
                }
                items.step(1, (net, 1.0), contest, said);
                for (strength, said) in strengths.iter_mut().zip(&*said) {
                    *strength = decayed(*decay, *strength, *said);
                }
                items.step(0, (net, 1.0), chosen, output);
            }
            Rivalry::Race { decay, hold, gain } => {
                let ([chosen, accumulators], held) = items.split(io.state);
                let (evidence, held) = held.split_at_mut(net.len());
                let (filtered, winning) = held.split_at_mut(net.len());
                let (level, all) = (self.rule.level(), winning.iter().sum::<Real>());
                // Evidence of each item, minus the inhibition from a chosen rival and from outside.
                let own = evidence.iter().zip(&*winning).zip(inhibit);
                for (said, ((evidence, own), inhibit)) in said.iter_mut().zip(own) {
                    *said = evidence - RIVALRY * (all - own) - INHIBITION * inhibit;
                }
                items.step(1, (said, 1.0), accumulators, output);
                for ((evidence, kept), net) in evidence.iter_mut().zip(&*output).zip(&*net) {
                    let drive = kept + gain * (net - level);
                    *evidence = decayed(*hold, *evidence, drive).max(0.0);
                }
                for (filtered, output) in filtered.iter_mut().zip(&*output) {
                    *filtered = decayed(*decay, *filtered, *output);
                }
                items.step(0, (filtered, 1.0), chosen, output);
                for (winning, output) in winning.iter_mut().zip(&*output) {
                    *winning = decayed(*decay, *winning, *output);
                }
            }
        }
    }
}
