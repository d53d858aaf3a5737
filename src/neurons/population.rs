//! The layers as populations of neurons: who the neurons of each are, and the nodes that run them.
//!
//! - A pointer is represented by sub-ensembles of at most [`LifSpec::sub_dimensions`] dimensions, a plain
//!   vector by one ensemble a component.
//! - A product is made of two squares, `a b = ((a + b) / 2)^2 - ((a - b) / 2)^2`, each in one dimension
//!   (Gosmann, "Precise multiplications with the NEF", 2015).
//! - A selection has two ensembles an item. One says 1 above the level and nothing below. In a contest
//!   the other inhibits all other items in proportion to its own utility, so that the
//!   greatest one silences the rest; in a race the other gathers evidence by a recurrent synapse.

use std::sync::Arc;

use super::bank::{Bank, Consts, Draft, Firing, Shape};
use super::decode::Points;
use super::layer::{ENOUGH, INHIBITION, Map, Product, Represent, Select, SelectRule};
use super::model::{TuningError, refuse};
use super::plan::LifSpec;
use super::solved::{Kept, SolvedModel, Unfit};
use super::tuning::{Neurons, cosine, on_sphere, part_of_pointer};
use crate::sim::{
    AdvanceIo, LayerRequest, Node, NodeFault, Outputs, PortDecl, Real, ScratchSpec, Seed, StateMut,
    StateSpec, StepCx, fnv1a,
};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// What every population is built from.
pub(crate) struct Maker<'a> {
    pub spec: &'a LifSpec,
    pub firing: Firing,
    pub dt_s: f64,
    pub path: &'a str,
    pub seed: Seed,
    /// Where populations are taken from instead of being solved.
    pub solved: Option<&'a SolvedModel>,
}

/// Why a layer has no population.
pub(crate) enum Refusal {
    Tuning(TuningError),
    Unfit(Unfit),
}

impl From<TuningError> for Refusal {
    fn from(error: TuningError) -> Self {
        Self::Tuning(error)
    }
}

/// A layer that is one bank: a representation or a function.
pub(crate) struct Neural {
    ports: Box<dyn LayerRequest>,
    kept: Kept,
    gated: bool,
}

impl Neural {
    pub fn kept(&self) -> Vec<Kept> {
        vec![self.kept.clone()]
    }
}

impl Node for Neural {
    fn declare(&self, ports: &mut PortDecl) {
        self.ports.declare(ports);
        ports.state(StateSpec { reals: self.kept.bank.state_len(), ..StateSpec::default() });
    }

    fn init(&self, state: &mut StateMut<'_>, _registered: &mut Outputs<'_>) {
        self.kept.init(state.reals);
    }

    fn advance(&self, _cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let open = if self.gated { io.inputs.scalar(1) } else { 1.0 };
        self.kept.bank.step(io.inputs.get(0), open, io.state.reals, io.outputs.get_mut(0));
        Ok(())
    }
}

/// Products of pairs, as differences of squares.
pub(crate) struct NeuralProduct {
    layer: Product,
    kept: Kept,
}

impl NeuralProduct {
    pub fn kept(&self) -> Vec<Kept> {
        vec![self.kept.clone()]
    }
}

impl Node for NeuralProduct {
    fn declare(&self, ports: &mut PortDecl) {
        self.layer.declare(ports);
        ports
            .state(StateSpec { reals: self.kept.bank.state_len(), ..StateSpec::default() })
            .scratch(ScratchSpec { reals: 4 * self.layer.pairs, ..ScratchSpec::default() });
    }

    fn init(&self, state: &mut StateMut<'_>, _registered: &mut Outputs<'_>) {
        self.kept.init(state.reals);
    }

    fn advance(&self, _cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let (halves, squares) = io.scratch.reals.split_at_mut(2 * self.layer.pairs);
        let (a, b) = (io.inputs.get(0), io.inputs.get(1));
        for ((two, a), b) in halves.chunks_exact_mut(2).zip(a).zip(b) {
            two[0] = (a + b) / 2.0;
            two[1] = (a - b) / 2.0;
        }
        self.kept.bank.step(halves, 1.0, io.state.reals, squares);
        for (out, two) in io.outputs.get_mut(0).iter_mut().zip(squares.chunks_exact(2)) {
            *out = two[0] - two[1];
        }
        Ok(())
    }
}

/// A choice among utilities.
pub(crate) struct NeuralSelect {
    layer: Select,
    chosen: Kept,
    rivalry: Rivalry,
}

/// How items keep one another from being chosen.
enum Rivalry {
    None,
    /// Ensembles that inhibit all others in proportion to their own utility.
    Contest {
        contest: Kept,
        decay: Real,
    },
    /// Ensembles that gather evidence; who has enough silences all others.
    Race {
        accumulators: Kept,
        decay: Real,
        hold: Real,
        gain: Real,
    },
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

    /// Numbers of state an item beside those of the neurons.
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

/// How much of the winner's utility, or of its being chosen, is taken from all others.
const RIVALRY: Real = 2.0;
/// Time constant of that inhibition, in seconds.
const RIVALRY_TAU_S: f64 = 0.005;
/// Share of the level above which an item takes part in the contest.
const CONTENDING: f64 = 0.6;
/// Share of an item's neurons that are in the contest.
const CONTEST_SHARE: f64 = 0.4;
/// Share of an item's neurons that gather evidence.
const RACE_SHARE: f64 = 0.7;
/// Time constant of the synapse by which evidence is kept, in seconds.
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
    }

    fn init(&self, state: &mut StateMut<'_>, _registered: &mut Outputs<'_>) {
        let (chosen, rest) = state.reals.split_at_mut(self.chosen.bank.state_len());
        self.chosen.init(chosen);
        if let Some(kept) = self.rivalry.bank() {
            kept.init(&mut rest[..kept.bank.state_len()]);
        }
    }

    fn advance(&self, _cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let items = self.layer.items;
        let (net, said) = io.scratch.reals.split_at_mut(items);
        let (utilities, inhibit) = (io.inputs.get(0), io.inputs.get(1));
        for ((net, utility), inhibit) in net.iter_mut().zip(utilities).zip(inhibit) {
            *net = utility - INHIBITION * inhibit;
        }
        let (chosen, rest) = io.state.reals.split_at_mut(self.chosen.bank.state_len());
        let output = io.outputs.get_mut(0);
        match &self.rivalry {
            Rivalry::None => self.chosen.bank.step(net, 1.0, chosen, output),
            Rivalry::Contest { contest, decay } => {
                let (neurons, strengths) = rest.split_at_mut(contest.bank.state_len());
                let all: Real = strengths.iter().sum();
                for (net, own) in net.iter_mut().zip(&*strengths) {
                    *net -= RIVALRY * (all - own);
                }
                contest.bank.step(net, 1.0, neurons, said);
                for (strength, said) in strengths.iter_mut().zip(&*said) {
                    *strength = decay * *strength + (1.0 - decay) * said;
                }
                self.chosen.bank.step(net, 1.0, chosen, output);
            }
            Rivalry::Race { accumulators, decay, hold, gain } => {
                let (neurons, held) = rest.split_at_mut(accumulators.bank.state_len());
                let (evidence, held) = held.split_at_mut(items);
                let (heard, winning) = held.split_at_mut(items);
                let (level, all) = (self.layer.rule.level(), winning.iter().sum::<Real>());
                // What each item has gathered, while no other has enough and nothing inhibits it.
                let own = evidence.iter().zip(&*winning).zip(inhibit);
                for (said, ((evidence, own), inhibit)) in said.iter_mut().zip(own) {
                    *said = evidence - RIVALRY * (all - own) - INHIBITION * inhibit;
                }
                accumulators.bank.step(said, 1.0, neurons, output);
                for ((evidence, kept), net) in evidence.iter_mut().zip(&*output).zip(&*net) {
                    let drive = kept + gain * (net - level);
                    *evidence = (hold * *evidence + (1.0 - hold) * drive).max(0.0);
                }
                for (heard, output) in heard.iter_mut().zip(&*output) {
                    *heard = decay * *heard + (1.0 - decay) * output;
                }
                self.chosen.bank.step(heard, 1.0, chosen, output);
                for (winning, output) in winning.iter_mut().zip(&*output) {
                    *winning = decay * *winning + (1.0 - decay) * output;
                }
            }
        }
        Ok(())
    }
}

/// Neurons of one ensemble: the matrix that is solved for more would take gigabytes.
const MOST_NEURONS: f64 = 10_000.0;

fn count(of: f64, scale: f64) -> Result<usize, TuningError> {
    let count = (of * scale).round();
    if (1.0..=MOST_NEURONS).contains(&count) {
        Ok(count as usize)
    } else {
        Err(refuse("neurons", format!("{count} an ensemble"), format!("1 to {MOST_NEURONS}")))
    }
}

impl Maker<'_> {
    /// A bank solved for, or taken from a model that was solved from the same. `marks` are the
    /// numbers by which this bank differs from others of the same role.
    fn bank(
        &self,
        shape: Shape,
        role: &str,
        marks: &[f64],
        draft: impl Fn(usize, Seed) -> Result<Draft, TuningError> + Sync,
    ) -> Result<Kept, Refusal> {
        self.check()?;
        let fingerprint = self.fingerprint(shape, role, marks);
        if let Some(solved) = self.solved {
            let form = (shape, self.firing, Consts::new(&self.spec.model, self.dt_s));
            return solved.find(self.path, fingerprint, form).map_err(Refusal::Unfit);
        }
        let how = (self.firing, self.spec.regularisation);
        let seed = self.seed.derive("", role);
        let bank = Bank::build(&self.spec.model, self.dt_s, shape, how, seed, draft)?;
        Ok(Kept { bank: Arc::new(bank), fingerprint })
    }

    /// Checks the ranges that neurons are drawn from, whatever the draws would be.
    fn check(&self) -> Result<(), TuningError> {
        let LifSpec { model, max_rates: [low, high], intercepts, .. } = self.spec;
        model.check()?;
        let limit = if model.tau_ref_s > 0.0 { 1.0 / model.tau_ref_s } else { f64::INFINITY };
        if !(*low > 0.0 && low <= high && *high < limit) {
            let expected = format!(
                "two rates in rising order, above 0 and below the refractory limit of {limit} Hz"
            );
            return Err(refuse("max_rates", format!("{low} to {high}"), expected));
        }
        let [low, high] = intercepts;
        if !(*low >= -1.0 && low <= high && *high < 1.0) {
            let expected = "two numbers in rising order from -1 up to, not including, 1";
            return Err(refuse("intercepts", format!("{low} to {high}"), expected));
        }
        Ok(())
    }

    /// A hash of everything that decides who the neurons are and what is decoded from them.
    fn fingerprint(&self, shape: Shape, role: &str, marks: &[f64]) -> u64 {
        let LifSpec { model, max_rates, intercepts, regularisation, .. } = self.spec;
        let rates = if self.firing == Firing::Rates { 1.0 } else { 0.0 };
        let tuning = [self.dt_s, rates, model.tau_rc_s, model.tau_ref_s, *regularisation];
        let numbers = tuning.iter().chain(max_rates).chain(intercepts).chain(marks);
        let sizes = [shape.ensembles, shape.neurons, shape.dims, shape.outputs];
        let mut hash = fnv1a(self.seed.value(), role.as_bytes());
        for number in numbers {
            hash = fnv1a(hash, &number.to_le_bytes());
        }
        sizes.iter().fold(hash, |hash, size| fnv1a(hash, &(*size as u64).to_le_bytes()))
    }

    fn max_rates(&self) -> std::ops::RangeInclusive<f64> {
        self.spec.max_rates[0]..=self.spec.max_rates[1]
    }

    /// Neurons of one dimension, half of them firing upwards and half downwards, their intercepts spread
    /// evenly: one of each half in each of as many equal parts of the range, which leaves
    /// less distortion than as many independent draws.
    fn scalar(&self, count: usize, seed: Seed) -> Result<Neurons, TuningError> {
        let [low, high] = self.spec.intercepts;
        let (mut signs, mut parts) = (0..count, 0..count);
        let half = count.div_ceil(2) as f64;
        Neurons::draw(
            &self.spec.model,
            (count, 1),
            self.max_rates(),
            &mut seed.rng(),
            |_, out| out.fill(if signs.next().unwrap_or(0).is_multiple_of(2) { 1.0 } else { -1.0 }),
            |rng| {
                let part = (parts.next().unwrap_or(0) / 2) as f64;
                low + (high - low) * (part + rng.random::<f64>()) / half
            },
        )
    }

    /// One ensemble a component of a plain vector, and a function of each.
    fn components(
        &self,
        width: usize,
        radius: f64,
        per: f64,
        function: &(dyn Fn(f64) -> f64 + Sync),
    ) -> Result<Kept, Refusal> {
        let neurons = count(per, self.spec.scale)?;
        let shape = Shape { ensembles: width, neurons, dims: 1, outputs: 1 };
        let values: Vec<f64> = (0..SCALAR_POINTS)
            .map(|i| 2.0 * (i as f64 + 0.5) / SCALAR_POINTS as f64 - 1.0)
            .collect();
        let wanted: Vec<f64> = values.iter().map(|v| function(v * radius)).collect();
        let marks: Vec<f64> = wanted.iter().copied().chain([radius]).collect();
        self.bank(shape, "components", &marks, |_, seed| {
            let points = Points { values: values.clone(), wanted: wanted.clone(), outputs: 1 };
            Ok(Draft { neurons: self.scalar(neurons, seed)?, radius, points })
        })
    }

    pub fn represent(&self, layer: &Represent) -> Result<Neural, Refusal> {
        let (width, radius) = (layer.input.width(), f64::from(layer.radius));
        let kept = if layer.input.is_pointer() {
            self.pointer(width, radius)?
        } else {
            self.components(width, radius, self.spec.per_function as f64, &|x| x)?
        };
        Ok(Neural { ports: Box::new(layer.clone()), kept, gated: layer.gated })
    }

    /// Sub-ensembles of a pointer.
    fn pointer(&self, width: usize, radius: f64) -> Result<Kept, Refusal> {
        let most = self.spec.sub_dimensions.clamp(1, width);
        let dims = (1..=most).rev().find(|d| width.is_multiple_of(*d)).unwrap_or(1);
        let neurons = count(self.spec.per_dimension as f64 * dims as f64, self.spec.scale)?;
        let shape = Shape { ensembles: width / dims, neurons, dims, outputs: dims };
        // Where the parts of unit pointers lie, and a little beyond.
        let usual = (dims as f64 / width as f64).sqrt();
        let ball = radius * usual * POINTER_ROOM;
        let points = (neurons * 3 / 2).clamp(300, 2_000);
        self.bank(shape, "pointer", &[ball, usual, points as f64], |_, seed| {
            let mut rng = seed.rng();
            let drawn = Neurons::draw(
                &self.spec.model,
                (neurons, dims),
                self.max_rates(),
                &mut rng,
                on_sphere,
                |rng| cosine(rng, dims + 2),
            )?;
            let mut values = vec![0.0; points * dims];
            for value in values.chunks_exact_mut(dims) {
                part_of_pointer(&mut rng, value, width);
                let amplitude = POINTER_ROOM * rng.random::<f64>();
                let scale = amplitude / (usual * POINTER_ROOM);
                value.iter_mut().for_each(|v| *v *= scale);
            }
            let wanted = values.iter().map(|v| v * ball).collect();
            Ok(Draft {
                neurons: drawn,
                radius: ball,
                points: Points { values, wanted, outputs: dims },
            })
        })
    }

    pub fn map(&self, layer: &Map) -> Result<Neural, Refusal> {
        let function = layer.function.clone();
        let exact = move |x: f64| f64::from(function(x as Real));
        let per = self.spec.per_function as f64 * f64::from(layer.size);
        let radius = f64::from(layer.radius);
        let kept = match layer.above {
            None => self.components(layer.width, radius, per, &exact)?,
            Some(least) => {
                let reach = (f64::from(least), radius, Spread::Even);
                self.above((layer.width, per), reach, &exact, "above")?
            }
        };
        Ok(Neural { ports: Box::new(layer.clone()), kept, gated: false })
    }

    pub fn product(&self, layer: &Product) -> Result<NeuralProduct, Refusal> {
        let per = self.spec.per_product as f64 / 2.0;
        let radius = f64::from(layer.radius);
        let kept = self.components(2 * layer.pairs, radius, per, &|x| x * x)?;
        Ok(NeuralProduct { layer: layer.clone(), kept })
    }

    /// One ensemble a component whose neurons are silent below a value, and a function above it.
    fn above(
        &self,
        (width, per): (usize, f64),
        (from, radius, spread): (f64, f64, Spread),
        function: &(dyn Fn(f64) -> f64 + Sync),
        role: &str,
    ) -> Result<Kept, Refusal> {
        let neurons = count(per, self.spec.scale)?;
        let shape = Shape { ensembles: width, neurons, dims: 1, outputs: 1 };
        let low = (from / radius).clamp(-0.99, 0.9);
        let values: Vec<f64> = (0..SCALAR_POINTS)
            .map(|i| low + (1.0 - low) * (i as f64 + 0.5) / SCALAR_POINTS as f64)
            .collect();
        let wanted: Vec<f64> = values.iter().map(|v| function(v * radius)).collect();
        let even = if matches!(spread, Spread::Even) { 1.0 } else { 0.0 };
        let marks: Vec<f64> = wanted.iter().copied().chain([low, radius, even]).collect();
        self.bank(shape, role, &marks, |_, seed| {
            let intercept = |rng: &mut ChaCha8Rng| {
                let share: f64 = rng.random();
                match spread {
                    Spread::Even => low + (0.95 - low) * share,
                    // Most neurons answer soon above the level.
                    Spread::Near => (low - (1.0 - share).ln() * NEAR_LEVEL).min(0.95),
                }
            };
            let up = |_: &mut ChaCha8Rng, out: &mut [f64]| out.fill(1.0);
            let (model, shape) = (&self.spec.model, (neurons, 1));
            let drawn =
                Neurons::draw(model, shape, self.max_rates(), &mut seed.rng(), up, intercept)?;
            let points = Points { values: values.clone(), wanted: wanted.clone(), outputs: 1 };
            Ok(Draft { neurons: drawn, radius, points })
        })
    }

    pub fn select(&self, layer: &Select) -> Result<NeuralSelect, Refusal> {
        let level = f64::from(layer.rule.level());
        // Utilities are cosines, and sums of a few of them.
        let radius = level.max(0.0) + 0.7;
        let (items, per) = (layer.items, self.spec.per_item as f64);
        let chosen = |share: f64, level: f64, radius: f64| {
            self.above((items, per * share), (level, radius, Spread::Near), &|_| 1.0, "chosen")
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
                (chosen(1.0 - RACE_SHARE, f64::from(ENOUGH), 1.2)?, rivalry)
            }
        };
        Ok(NeuralSelect { layer: layer.clone(), chosen, rivalry })
    }
}

/// How intercepts lie above a level.
#[derive(Clone, Copy)]
enum Spread {
    Even,
    Near,
}

/// Mean distance of intercepts from the level, in units of the radius.
const NEAR_LEVEL: f64 = 0.1;
/// Points at which functions of one number are solved for.
const SCALAR_POINTS: usize = 300;
/// How far beyond the usual length of a pointer's part its ensemble reaches.
const POINTER_ROOM: f64 = 1.2;
