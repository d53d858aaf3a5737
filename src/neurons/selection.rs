//! Selections as populations: a threshold, a contest of utilities, or a race of evidence.
//!
//! Each item has an ensemble that decodes to 1 above the level and is silent below it. A contest (winner-take-all)
//! adds a second ensemble per item. It inhibits all other items in proportion to the utility of its own item, so the
//! greatest utility silences the rest. A race (independent accumulators) adds a second ensemble per item that gathers
//! evidence through a recurrent synapse.
//!
//! Items under a threshold are independent and advance in parts. A contest and a race sum over all items, so they advance
//! as one part.

use super::bank::Shape;
use super::layer::{EVIDENCE_THRESHOLD, INHIBITION, Select, SelectRule};
use super::parted::Parted;
use super::population::{Maker, Refusal, Spread};
use super::solved::Kept;
use crate::sim::{
    Fingerprint, LayerRequest, Node, Outputs, PartIo, PartSpec, Parts, PortDecl, Real, ScratchSpec,
    StateMut, StepCx, decayed,
};

/// The node of a selection.
pub(crate) struct NeuralSelect {
    layer: Select,
    chosen: Parted,
    rivalry: Rivalry,
}

/// How items inhibit each other.
enum Rivalry {
    /// No inhibition: the threshold rule.
    None,
    /// Each item inhibits all others in proportion to its own utility.
    Contest { contest: Parted, decay: Real },
    /// Each item gathers evidence. The first to reach the threshold silences all others.
    Race { accumulators: Parted, decay: Real, hold: Real, gain: Real },
}

impl Rivalry {
    fn bank(&self) -> Option<&Parted> {
        match self {
            Self::None => None,
            Self::Contest { contest: bank, .. } | Self::Race { accumulators: bank, .. } => {
                Some(bank)
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
        self.banks().map(|bank| bank.kept.clone()).collect()
    }

    fn banks(&self) -> impl Iterator<Item = &Parted> {
        std::iter::once(&self.chosen).chain(self.rivalry.bank())
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
        let reals = 2 * self.chosen.ensembles(0).len();
        ports.scratch(ScratchSpec { reals, ..ScratchSpec::default() });
    }

    /// Hashes the rule and the populations. The weights between populations follow from these and the length of a
    /// tick.
    fn fingerprint(&self, hash: &mut Fingerprint) {
        self.layer.rule.fingerprint(hash);
        for bank in self.banks() {
            hash.number(bank.kept.fingerprint);
        }
    }

    fn init(&self, _cx: &StepCx<'_>, state: &mut StateMut<'_>, _registered: &mut Outputs<'_>) {
        let (chosen, rest) = state.reals.split_at_mut(self.chosen.bank().state_len());
        self.chosen.init(chosen);
        if let Some(rivals) = self.rivalry.bank() {
            rivals.init(&mut rest[..rivals.bank().state_len()]);
        }
    }

    fn parts(&self) -> Option<&dyn Parts> {
        Some(self)
    }

    fn units(&self) -> usize {
        self.chosen.bank().spiking()
    }
}

impl Parts for NeuralSelect {
    fn count(&self) -> usize {
        self.chosen.count()
    }

    fn part(&self, part: usize) -> PartSpec {
        let (own, items) = (self.chosen.spec(part, 1), self.chosen.ensembles(part).len());
        let rivals = self.rivalry.bank().map(|bank| bank.spec(part, 1)).unwrap_or_default();
        PartSpec {
            state: own.state + rivals.state + self.rivalry.held() * items,
            work: own.work + rivals.work,
            ..own
        }
    }

    fn advance(&self, _cx: &StepCx<'_>, part: usize, io: &mut PartIo<'_>) {
        let own = self.chosen.ensembles(part);
        let items = own.len();
        let (net, said) = io.scratch.reals[..2 * items].split_at_mut(items);
        let (utilities, inhibit) = (&io.inputs.get(0)[own.clone()], &io.inputs.get(1)[own]);
        for ((net, utility), inhibit) in net.iter_mut().zip(utilities).zip(inhibit) {
            *net = utility - INHIBITION * inhibit;
        }
        let (chosen, rest) = io.state.split_at_mut(self.chosen.bank().state_of(items));
        let output = &mut *io.results;
        match &self.rivalry {
            Rivalry::None => self.chosen.step(part, (net, 1.0), chosen, output),
            Rivalry::Contest { contest, decay } => {
                let (neurons, strengths) = rest.split_at_mut(contest.bank().state_len());
                let all: Real = strengths.iter().sum();
                for (net, own) in net.iter_mut().zip(&*strengths) {
                    *net -= RIVALRY * (all - own);
                }
                contest.step(part, (net, 1.0), neurons, said);
                for (strength, said) in strengths.iter_mut().zip(&*said) {
                    *strength = decayed(*decay, *strength, *said);
                }
                self.chosen.step(part, (net, 1.0), chosen, output);
            }
            Rivalry::Race { accumulators, decay, hold, gain } => {
                let (neurons, held) = rest.split_at_mut(accumulators.bank().state_len());
                let (evidence, held) = held.split_at_mut(items);
                let (filtered, winning) = held.split_at_mut(items);
                let (level, all) = (self.layer.rule.level(), winning.iter().sum::<Real>());
                // Evidence of each item, minus the inhibition from a chosen rival and from outside.
                let own = evidence.iter().zip(&*winning).zip(inhibit);
                for (said, ((evidence, own), inhibit)) in said.iter_mut().zip(own) {
                    *said = evidence - RIVALRY * (all - own) - INHIBITION * inhibit;
                }
                accumulators.step(part, (said, 1.0), neurons, output);
                for ((evidence, kept), net) in evidence.iter_mut().zip(&*output).zip(&*net) {
                    let drive = kept + gain * (net - level);
                    *evidence = decayed(*hold, *evidence, drive).max(0.0);
                }
                for (filtered, output) in filtered.iter_mut().zip(&*output) {
                    *filtered = decayed(*decay, *filtered, *output);
                }
                self.chosen.step(part, (filtered, 1.0), chosen, output);
                for (winning, output) in winning.iter_mut().zip(&*output) {
                    *winning = decayed(*decay, *winning, *output);
                }
            }
        }
    }

    fn collect(&self, part: usize, results: &[Real], outputs: &mut Outputs<'_>) {
        outputs.get_mut(0)[self.chosen.ensembles(part)].copy_from_slice(results);
    }

    fn event(&self, part: usize, state: &[Real], neuron: usize) -> bool {
        let bank = self.chosen.bank();
        bank.spiked(&state[..bank.state_of(self.chosen.ensembles(part).len())], neuron)
    }
}

impl Maker<'_> {
    pub fn select(&self, layer: &Select) -> Result<NeuralSelect, Refusal> {
        let level = f64::from(layer.rule.level());
        // Utilities are cosines or sums of a few cosines.
        let radius = level.max(0.0) + 0.7;
        let (items, per) = (layer.items, self.spec.per_item as f64);
        let owner = match layer.rule {
            SelectRule::Threshold { .. } => None,
            _ => Some(self.deal.whole(items * self.spec.per_item)),
        };
        let cut = |shape: Shape| match owner {
            Some(owner) => self.deal.uncut(shape, owner),
            None => self.deal.cut(shape, 1),
        };
        let bank = |share: f64, reach, function: &(dyn Fn(f64) -> f64 + Sync), role| {
            self.above((items, per * share, &cut), reach, function, role)
        };
        let chosen = |share: f64, level: f64, radius: f64| {
            let spread = Spread::Near(self.spec.item_spread);
            bank(share, (level, radius, spread), &|_| 1.0, "chosen")
        };
        let decay = |tau_s: f64| (-self.dt_s / tau_s).exp() as Real;
        let (chosen, rivalry) = match layer.rule {
            SelectRule::Threshold { .. } => (chosen(1.0, level, radius)?, Rivalry::None),
            SelectRule::WinnerTakeAll { .. } => {
                let reach = (CONTENDING * level, radius, Spread::Even);
                let contest = bank(CONTEST_SHARE, reach, &|u| u, "contest")?;
                let rivalry = Rivalry::Contest { contest, decay: decay(RIVALRY_TAU_S) };
                (chosen(1.0 - CONTEST_SHARE, level, radius)?, rivalry)
            }
            SelectRule::IndependentAccumulators { tau, .. } => {
                let reach = (0.0, 1.0, Spread::Even);
                let rivalry = Rivalry::Race {
                    accumulators: bank(RACE_SHARE, reach, &|u| u, "accumulators")?,
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
