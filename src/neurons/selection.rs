//! Selections as populations: a threshold, a contest of utilities, or a race of evidence.
//!
//! Each item has an ensemble that decodes to 1 above the level and is silent below it. A contest (winner-take-all)
//! adds a second ensemble per item. It inhibits all other items in proportion to the utility of its own item, so the
//! greatest utility silences the rest. A race (independent accumulators) adds a second ensemble per item that gathers
//! evidence through a recurrent synapse.

use super::layer::{EVIDENCE_THRESHOLD, INHIBITION, Select, SelectRule};
use super::population::{Maker, Refusal, Spread};
use super::solved::Kept;
use crate::sim::{
    AdvanceIo, Fingerprint, LayerRequest, Node, NodeFault, Outputs, PortDecl, Real, ScratchSpec,
    StateMut, StateRef, StateSpec, StepCx, decayed,
};

/// The node of a selection.
pub(crate) struct NeuralSelect {
    layer: Select,
    chosen: Kept,
    rivalry: Rivalry,
}

/// How items inhibit each other.
enum Rivalry {
    /// No inhibition: the threshold rule.
    None,
    /// Each item inhibits all others in proportion to its own utility.
    Contest { contest: Kept, decay: Real },
    /// Each item gathers evidence. The first to reach the threshold silences all others.
    Race { accumulators: Kept, decay: Real, hold: Real, gain: Real },
}

impl Rivalry {
    fn bank(&self) -> Option<&Kept> {
        match self {
            Self::None => None,
            Self::Contest { contest: kept, .. } | Self::Race { accumulators: kept, .. } => {
                Some(kept)
            }
        }
    }

    /// Length of each item's state, without the state of its neurons.
    fn held(&self) -> usize {
        match self {
            Self::None => 0,
            Self::Contest { .. } => 1,
            Self::Race { .. } => 3,
        }
    }
}

impl NeuralSelect {
    pub fn kept(&self) -> Vec<Kept> {
        std::iter::once(&self.chosen).chain(self.rivalry.bank()).cloned().collect()
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

impl Node for NeuralSelect {
    fn declare(&self, ports: &mut PortDecl) {
        self.layer.declare(ports);
        let items = self.layer.items;
        let rivals = self.rivalry.bank().map_or(0, |kept| kept.bank.state_len());
        let reals = self.chosen.bank.state_len() + rivals + self.rivalry.held() * items;
        ports
            .state(StateSpec { reals, ..StateSpec::default() })
            .scratch(ScratchSpec { reals: 2 * items, ..ScratchSpec::default() });
        let rivals = self.rivalry.bank().is_some_and(|kept| kept.bank.parallel());
        if self.chosen.bank.parallel() || rivals {
            ports.parallel();
        }
    }

    /// Hashes the rule and the populations. The weights between populations follow from these and the length of a
    /// tick.
    fn fingerprint(&self, hash: &mut Fingerprint) {
        self.layer.rule.fingerprint(hash);
        for kept in std::iter::once(&self.chosen).chain(self.rivalry.bank()) {
            hash.number(kept.fingerprint);
        }
    }

    fn init(&self, state: &mut StateMut<'_>, _registered: &mut Outputs<'_>) {
        let (chosen, rest) = state.reals.split_at_mut(self.chosen.bank.state_len());
        self.chosen.init(chosen);
        if let Some(kept) = self.rivalry.bank() {
            kept.init(&mut rest[..kept.bank.state_len()]);
        }
    }

    fn advance(&self, cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let items = self.layer.items;
        let (net, said) = io.scratch.reals.split_at_mut(items);
        let (utilities, inhibit) = (io.inputs.get(0), io.inputs.get(1));
        for ((net, utility), inhibit) in net.iter_mut().zip(utilities).zip(inhibit) {
            *net = utility - INHIBITION * inhibit;
        }
        let (chosen, rest) = io.state.reals.split_at_mut(self.chosen.bank.state_len());
        let output = io.outputs.get_mut(0);
        match &self.rivalry {
            Rivalry::None => self.chosen.bank.step(cx.threads(), (net, 1.0), chosen, output),
            Rivalry::Contest { contest, decay } => {
                let (neurons, strengths) = rest.split_at_mut(contest.bank.state_len());
                let all: Real = strengths.iter().sum();
                for (net, own) in net.iter_mut().zip(&*strengths) {
                    *net -= RIVALRY * (all - own);
                }
                contest.bank.step(cx.threads(), (net, 1.0), neurons, said);
                for (strength, said) in strengths.iter_mut().zip(&*said) {
                    *strength = decayed(*decay, *strength, *said);
                }
                self.chosen.bank.step(cx.threads(), (net, 1.0), chosen, output);
            }
            Rivalry::Race { accumulators, decay, hold, gain } => {
                let (neurons, held) = rest.split_at_mut(accumulators.bank.state_len());
                let (evidence, held) = held.split_at_mut(items);
                let (filtered, winning) = held.split_at_mut(items);
                let (level, all) = (self.layer.rule.level(), winning.iter().sum::<Real>());
                // Evidence of each item, minus the inhibition from a chosen rival and from outside.
                let own = evidence.iter().zip(&*winning).zip(inhibit);
                for (said, ((evidence, own), inhibit)) in said.iter_mut().zip(own) {
                    *said = evidence - RIVALRY * (all - own) - INHIBITION * inhibit;
                }
                accumulators.bank.step(cx.threads(), (said, 1.0), neurons, output);
                for ((evidence, kept), net) in evidence.iter_mut().zip(&*output).zip(&*net) {
                    let drive = kept + gain * (net - level);
                    *evidence = decayed(*hold, *evidence, drive).max(0.0);
                }
                for (filtered, output) in filtered.iter_mut().zip(&*output) {
                    *filtered = decayed(*decay, *filtered, *output);
                }
                self.chosen.bank.step(cx.threads(), (filtered, 1.0), chosen, output);
                for (winning, output) in winning.iter_mut().zip(&*output) {
                    *winning = decayed(*decay, *winning, *output);
                }
            }
        }
        Ok(())
    }

    fn units(&self) -> usize {
        self.chosen.bank.spiking()
    }

    fn event(&self, state: &StateRef<'_>, neuron: usize) -> bool {
        self.chosen.bank.spiked(&state.reals[..self.chosen.bank.state_len()], neuron)
    }
}

impl Maker<'_> {
    pub fn select(&self, layer: &Select) -> Result<NeuralSelect, Refusal> {
        let level = f64::from(layer.rule.level());
        // Utilities are cosines or sums of a few cosines.
        let radius = level.max(0.0) + 0.7;
        let (items, per) = (layer.items, self.spec.per_item as f64);
        let chosen = |share: f64, level: f64, radius: f64| {
            self.above(
                (items, per * share),
                (level, radius, Spread::Near(self.spec.item_spread)),
                &|_| 1.0,
                "chosen",
            )
        };
        let decay = |tau_s: f64| (-self.dt_s / tau_s).exp() as Real;
        let (chosen, rivalry) = match layer.rule {
            SelectRule::Threshold { .. } => (chosen(1.0, level, radius)?, Rivalry::None),
            SelectRule::WinnerTakeAll { .. } => {
                let reach = (CONTENDING * level, radius, Spread::Even);
                let contest = self.above((items, per * CONTEST_SHARE), reach, &|u| u, "contest")?;
                let rivalry = Rivalry::Contest { contest, decay: decay(RIVALRY_TAU_S) };
                (chosen(1.0 - CONTEST_SHARE, level, radius)?, rivalry)
            }
            SelectRule::IndependentAccumulators { tau, .. } => {
                let reach = (0.0, 1.0, Spread::Even);
                let size = (items, per * RACE_SHARE);
                let rivalry = Rivalry::Race {
                    accumulators: self.above(size, reach, &|u| u, "accumulators")?,
                    decay: decay(RIVALRY_TAU_S),
                    hold: decay(EVIDENCE_TAU_S),
                    gain: (EVIDENCE_TAU_S / tau.as_secs_f64()) as Real,
                };
                (chosen(1.0 - RACE_SHARE, f64::from(EVIDENCE_THRESHOLD), 1.2)?, rivalry)
            }
        };
        Ok(NeuralSelect { layer: layer.clone(), chosen, rivalry })
    }
}
