//! The layer of a choice among utilities: a threshold, a contest of utilities, or a race of evidence.
//!
//! In neurons each item has an ensemble that decodes to 1 above the level and is silent below it. A contest
//! (winner-take-all) adds a second ensemble per item, which decodes what is left of the item's utility and inhibits all
//! others by it. With a weight of 1 an item is silent if and only if another has a greater utility, whatever the past.
//! The weight is a little greater: of two equal utilities one then wins. A race (independent accumulators) adds a second
//! ensemble per item that gathers evidence through a recurrent synapse.
//!
//! Items under a threshold are independent and advance in parts. A contest and a race sum over all items, so they advance
//! as one part.

use super::{Circuit, Items, Layer, Populated};
use crate::neurons::builder::{Components, Keep, Onset, PopulationBuilder};
use crate::neurons::tuning::TuningError;
use crate::sim::{
    AdvanceIo, Fingerprint, InputSpec, Inputs, Node, NodeFault, OutputSpec, PartIo, PortDecl, Real,
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
    /// Chooses every item whose utility is at least `level`, as strongly as its utility: the activity is the utility
    /// itself. Neurons saturate at `level + 0.7`.
    Graded {
        /// Least utility of a chosen item (finite).
        level: Real,
    },
    /// Chooses the item of greatest utility if this utility is at least `level`. In direct mode the first of equal
    /// items wins.
    ///
    /// Neurons follow a change of the greatest utility: within 25 ms if the old winner has half of the new utility or
    /// less, 45 ms at 0.8 of it and 120 ms at 0.9. Of utilities that differ by a twentieth or less they choose one and
    /// keep it; of equal ones none is chosen until one has won, which can take some 100 ms. Utilities should be at most
    /// `level + 0.7`, about 1.
    WinnerTakeAll {
        /// Least utility of a chosen item (finite).
        level: Real,
    },
    /// Chooses as [`WinnerTakeAll`](Self::WinnerTakeAll), but the winner stays until another utility is greater than
    /// `1 + margin` times its own, or its own falls below the level. In neurons the rival needs up to a twentieth more.
    Hysteresis {
        /// Least utility of a chosen item (finite).
        level: Real,
        /// By which share of the winner's utility a rival must be greater (at least 0, finite).
        margin: Real,
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
            Self::Graded { .. } => hash.text("graded"),
            Self::WinnerTakeAll { .. } => hash.text("winner"),
            Self::Hysteresis { margin, .. } => hash.text("hysteresis").reals(&[margin]),
            Self::IndependentAccumulators { tau, .. } => {
                hash.text("accumulators").number(tau.as_micros())
            }
        };
    }

    /// Returns the least utility of a chosen item; of accumulators, the utility above which evidence grows.
    pub fn level(self) -> Real {
        match self {
            Self::Threshold { level }
            | Self::Graded { level }
            | Self::WinnerTakeAll { level }
            | Self::Hysteresis { level, .. }
            | Self::IndependentAccumulators { level, .. } => level,
        }
    }

    /// By which share of the winner's utility a rival must be greater.
    fn margin(self) -> Real {
        if let Self::Hysteresis { margin, .. } = self { margin } else { 0.0 }
    }
}

/// A request for a choice among utilities. The output is 1 (with [`SelectRule::Graded`] the utility) for a chosen item
/// and 0 for the others.
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
    /// A level that is not finite, a margin that is not finite or below 0, or an accumulator time constant of zero, is a
    /// fault when the graph is built.
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
        let margin = self.rule.margin();
        if !(margin.is_finite() && margin >= 0.0) {
            ports.fault(format!("the margin is {margin}; expected a finite number of at least 0"));
        }
        if let SelectRule::IndependentAccumulators { .. } | SelectRule::Hysteresis { .. } =
            self.rule
        {
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
            SelectRule::Graded { level } => {
                for (out, utility) in output.iter_mut().zip(net) {
                    *out = if utility >= level { utility } else { 0.0 };
                }
            }
            SelectRule::WinnerTakeAll { level } | SelectRule::Hysteresis { level, .. } => {
                // With hysteresis, the state of the winner is 1.
                let held = &mut *io.state.reals;
                let (mut best, mut most) = (None, 0.0);
                for (index, utility) in net.enumerate().filter(|(_, utility)| *utility >= level) {
                    let stays = self.rule.margin() * held.get(index).unwrap_or(&0.0);
                    let favoured = utility + stays * utility.abs();
                    if best.is_none() || favoured > most {
                        (best, most) = (Some(index), favoured);
                    }
                }
                held.fill(0.0);
                if let Some(index) = best {
                    output[index] = 1.0;
                    held.iter_mut().skip(index).take(1).for_each(|held| *held = 1.0);
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

/// Weight of the inhibition between items in a race, on the activity of a rival.
const RIVALRY: Real = 2.0;
/// Time constant of the inhibition between items in a race, in seconds.
const RIVALRY_TAU_S: f64 = 0.005;
/// Weight of the inhibition between items in a contest, on what is left of a rival's utility. As much as it exceeds 1 is
/// the hysteresis; less would not outweigh the ripple of the decoding, so that equal items would silence each other.
const CONTEST: Real = 1.05;
/// Weight of the same inhibition on the ensembles that choose. Of two items that are still in contest neither is chosen.
const CHOICE: Real = 1.5;
/// Time constant of the inhibition between items in a contest, in seconds.
const CONTEST_TAU_S: f64 = 0.003;
/// Fraction of an item's neurons that take part in the contest.
const CONTEST_SHARE: f64 = 0.5;
/// Fraction of an item's neurons that gather evidence.
const RACE_SHARE: f64 = 0.7;
/// Fewest neurons of an item that decode evidence.
const FEWEST_GATHERING: f64 = 6.0;
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
            SelectRule::Threshold { .. } | SelectRule::Graded { .. } => Keep::Groups(1),
            _ => Keep::All(builder.owner(self.items * tuning.per_item)),
        };
        let of = |share: f64, radius: f64, onset: Onset| {
            // Each population of an item has a neuron at least.
            let (all, scale) = (tuning.per_item as f64, tuning.scale);
            let neurons = if all * scale >= 1.0 { (all * share).max(1.0 / scale) } else { 0.0 };
            Components { width: self.items, neurons, radius, onset, keep }
        };
        let graded = matches!(self.rule, SelectRule::Graded { .. });
        let chosen = |share: f64, radius: f64, level: f64| {
            let onset = Onset::JustAbove { level, mean: tuning.item_spread };
            let activity = |utility: f64| if graded { utility } else { 1.0 };
            builder.components("chosen", &of(share, radius, onset), &activity)
        };
        let decay = |tau_s: f64| (-builder.dt_s() / tau_s).exp() as Real;
        let populated = |chosen, rivalry| {
            let circuit = Choice { rule: self.rule, rivalry };
            Populated::new(self.direct(), chosen, circuit).scratch(2)
        };
        Ok(match self.rule {
            SelectRule::Threshold { .. } | SelectRule::Graded { .. } => {
                populated(chosen(1.0, radius, level)?, Rivalry::None)
            }
            SelectRule::WinnerTakeAll { .. } | SelectRule::Hysteresis { .. } => {
                let contending = of(CONTEST_SHARE, radius, Onset::Even(0.0));
                let contest = builder.components("contest", &contending, &|u| u)?;
                let stays = 1.0 + self.rule.margin();
                let (weight, choice) = (CONTEST * stays, CHOICE * stays);
                let rivalry = Rivalry::Contest { decay: decay(CONTEST_TAU_S), weight, choice };
                let chosen = chosen(1.0 - CONTEST_SHARE, radius, level)?;
                populated(chosen, rivalry).and(contest).held(1)
            }
            SelectRule::IndependentAccumulators { tau, .. } => {
                let mut gathering = of(RACE_SHARE, 1.0, Onset::Above(0.0));
                // Evidence is a number, not a threshold.
                let least = FEWEST_GATHERING / tuning.scale;
                if gathering.neurons > 0.0 && gathering.neurons < least {
                    (gathering.neurons, gathering.onset) = (least, Onset::Even(0.0));
                }
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
    /// Each item inhibits all others in proportion to what is left of its own utility.
    Contest { decay: Real, weight: Real, choice: Real },
    /// Each item gathers evidence. The first to reach the threshold silences all others.
    Race { decay: Real, hold: Real, gain: Real },
}

/// Returns what inhibition from outside leaves of a utility.
fn left(utility: Real, inhibit: Real) -> Real {
    utility - INHIBITION * inhibit
}

impl Circuit for Choice {
    fn fingerprint(&self, hash: &mut Fingerprint) {
        self.rule.fingerprint(hash);
    }

    /// A graded choice hands utilities on, and a contest compares them. Those below 0 silence their neurons, and exact maths chooses
    /// none of them either.
    fn unlimited(&self, items: &Items<'_>, inputs: Inputs<'_>, values: &mut Vec<Real>) {
        let graded = matches!(self.rule, SelectRule::Graded { .. });
        if !graded && !matches!(self.rivalry, Rivalry::Contest { .. }) {
            return;
        }
        let own = inputs.get(0)[items.range()].iter().zip(&inputs.get(1)[items.range()]);
        values.extend(own.map(|(utility, inhibit)| left(*utility, *inhibit).max(0.0)));
    }

    fn advance(&self, items: &Items<'_>, io: &mut PartIo<'_>) {
        let own = items.range();
        let (net, said) = io.scratch.reals[..2 * own.len()].split_at_mut(own.len());
        let (utilities, inhibit) = (&io.inputs.get(0)[own.clone()], &io.inputs.get(1)[own]);
        for ((net, utility), inhibit) in net.iter_mut().zip(utilities).zip(inhibit) {
            *net = left(*utility, *inhibit);
        }
        let output = &mut *io.results;
        match &self.rivalry {
            Rivalry::None => items.step(0, (net, 1.0), io.state, output),
            Rivalry::Contest { decay, weight, choice } => {
                let ([chosen, contest], strengths) = items.split(io.state);
                let all: Real = strengths.iter().sum();
                for (net, own) in net.iter_mut().zip(&*strengths) {
                    *net -= weight * (all - own);
                }
                items.step(1, (net, 1.0), contest, said);
                for (net, own) in net.iter_mut().zip(&*strengths) {
                    *net -= (choice - weight) * (all - own);
                }
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
                    *evidence = decayed(*hold, *evidence, drive).clamp(0.0, 1.0);
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
