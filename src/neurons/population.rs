//! The layers as populations of neurons: who the neurons of each are, and the nodes that run them.
//!
//! - A pointer is represented by sub-ensembles of at most [`LifSpec::sub_dimensions`] dimensions, a plain
//!   vector by one ensemble a component.
//! - A product is made of two squares, `a b = ((a + b) / 2)^2 - ((a - b) / 2)^2`, each in one dimension
//!   (Gosmann, "Precise multiplications with the NEF", 2015).
//! - A selection has two ensembles an item. One says 1 above the level and nothing below. In a contest
//!   the other inhibits all other items in proportion to its own utility, so that the
//!   greatest one silences the rest.

use super::bank::{Bank, Draft, Firing, Shape};
use super::decode::Points;
use super::layer::{INHIBITION, Map, Product, Represent, Select, SelectRule};
use super::model::{TuningError, refuse};
use super::plan::LifSpec;
use super::tuning::{Neurons, cosine, either_way, on_sphere, part_of_pointer};
use crate::sim::{
    AdvanceIo, LayerRequest, Node, NodeFault, PortDecl, Real, ScratchSpec, Seed, StateSpec, StepCx,
};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// What every population is built from.
pub(crate) struct Maker<'a> {
    pub spec: &'a LifSpec,
    pub firing: Firing,
    pub dt_s: f64,
    pub seed: Seed,
}

/// A layer that is one bank: a representation or a function.
pub(crate) struct Neural {
    ports: Box<dyn LayerRequest>,
    bank: Bank,
    gated: bool,
}

impl Node for Neural {
    fn declare(&self, ports: &mut PortDecl) {
        self.ports.declare(ports);
        ports.state(StateSpec { reals: self.bank.state_len(), ..StateSpec::default() });
    }

    fn advance(&self, _cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let open = if self.gated { io.inputs.scalar(1) } else { 1.0 };
        self.bank.step(io.inputs.get(0), open, io.state.reals, io.outputs.get_mut(0));
        Ok(())
    }
}

/// Products of pairs, as differences of squares.
pub(crate) struct NeuralProduct {
    layer: Product,
    bank: Bank,
}

impl Node for NeuralProduct {
    fn declare(&self, ports: &mut PortDecl) {
        self.layer.declare(ports);
        ports
            .state(StateSpec { reals: self.bank.state_len(), ..StateSpec::default() })
            .scratch(ScratchSpec { reals: 4 * self.layer.pairs, ..ScratchSpec::default() });
    }

    fn advance(&self, _cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let (halves, squares) = io.scratch.reals.split_at_mut(2 * self.layer.pairs);
        let (a, b) = (io.inputs.get(0), io.inputs.get(1));
        for ((two, a), b) in halves.chunks_exact_mut(2).zip(a).zip(b) {
            two[0] = (a + b) / 2.0;
            two[1] = (a - b) / 2.0;
        }
        self.bank.step(halves, 1.0, io.state.reals, squares);
        for (out, two) in io.outputs.get_mut(0).iter_mut().zip(squares.chunks_exact(2)) {
            *out = two[0] - two[1];
        }
        Ok(())
    }
}

/// A choice among utilities.
pub(crate) struct NeuralSelect {
    layer: Select,
    chosen: Bank,
    contest: Option<Bank>,
    /// Decay a tick of the synapse by which items inhibit one another.
    decay: Real,
}

/// How much of the winner's utility is taken from all others.
const RIVALRY: Real = 2.0;
/// Time constant of that inhibition, in seconds.
const RIVALRY_TAU_S: f64 = 0.005;
/// Share of the level above which an item takes part in the contest.
const CONTENDING: f64 = 0.6;
/// Share of an item's neurons that are in the contest.
const CONTEST_SHARE: f64 = 0.4;

impl Node for NeuralSelect {
    fn declare(&self, ports: &mut PortDecl) {
        self.layer.declare(ports);
        let items = self.layer.items;
        let contest = self.contest.as_ref().map_or(0, |c| c.state_len() + items);
        ports
            .state(StateSpec { reals: self.chosen.state_len() + contest, ..StateSpec::default() })
            .scratch(ScratchSpec { reals: 2 * items, ..ScratchSpec::default() });
    }

    fn advance(&self, _cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let (net, said) = io.scratch.reals.split_at_mut(self.layer.items);
        let (utilities, inhibit) = (io.inputs.get(0), io.inputs.get(1));
        for ((net, utility), inhibit) in net.iter_mut().zip(utilities).zip(inhibit) {
            *net = utility - INHIBITION * inhibit;
        }
        let (chosen, rest) = io.state.reals.split_at_mut(self.chosen.state_len());
        if let Some(contest) = &self.contest {
            let (neurons, strengths) = rest.split_at_mut(contest.state_len());
            let all: Real = strengths.iter().sum();
            for (net, own) in net.iter_mut().zip(&*strengths) {
                *net -= RIVALRY * (all - own);
            }
            contest.step(net, 1.0, neurons, said);
            for (strength, said) in strengths.iter_mut().zip(&*said) {
                *strength = self.decay * *strength + (1.0 - self.decay) * said;
            }
        }
        self.chosen.step(net, 1.0, chosen, io.outputs.get_mut(0));
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
    fn bank(
        &self,
        shape: Shape,
        role: &str,
        draft: impl Fn(usize, Seed) -> Result<Draft, TuningError> + Sync,
    ) -> Result<Bank, TuningError> {
        let how = (self.firing, self.spec.regularisation);
        Bank::build(&self.spec.model, self.dt_s, shape, how, self.seed.derive("", role), draft)
    }

    fn max_rates(&self) -> std::ops::RangeInclusive<f64> {
        self.spec.max_rates[0]..=self.spec.max_rates[1]
    }

    /// Neurons of one dimension, firing either way.
    fn scalar(&self, count: usize, seed: Seed) -> Result<Neurons, TuningError> {
        let [low, high] = self.spec.intercepts;
        let evenly = |rng: &mut ChaCha8Rng| low + (high - low) * rng.random::<f64>();
        let shape = (count, 1);
        Neurons::draw(
            &self.spec.model,
            shape,
            self.max_rates(),
            &mut seed.rng(),
            either_way,
            evenly,
        )
    }

    /// One ensemble a component of a plain vector, and a function of each.
    fn components(
        &self,
        width: usize,
        radius: f64,
        per: f64,
        function: &(dyn Fn(f64) -> f64 + Sync),
    ) -> Result<Bank, TuningError> {
        let neurons = count(per, self.spec.scale)?;
        let shape = Shape { ensembles: width, neurons, dims: 1, outputs: 1 };
        let values: Vec<f64> = (0..SCALAR_POINTS)
            .map(|i| 2.0 * (i as f64 + 0.5) / SCALAR_POINTS as f64 - 1.0)
            .collect();
        let wanted: Vec<f64> = values.iter().map(|v| function(v * radius)).collect();
        self.bank(shape, "components", |_, seed| {
            let points = Points { values: values.clone(), wanted: wanted.clone(), outputs: 1 };
            Ok(Draft { neurons: self.scalar(neurons, seed)?, radius, points })
        })
    }

    pub fn represent(&self, layer: &Represent) -> Result<Neural, TuningError> {
        let (width, radius) = (layer.input.width(), f64::from(layer.radius));
        let bank = if layer.input.is_pointer() {
            self.pointer(width, radius)?
        } else {
            self.components(width, radius, self.spec.per_function as f64, &|x| x)?
        };
        Ok(Neural { ports: Box::new(layer.clone()), bank, gated: layer.gated })
    }

    /// Sub-ensembles of a pointer.
    fn pointer(&self, width: usize, radius: f64) -> Result<Bank, TuningError> {
        let most = self.spec.sub_dimensions.clamp(1, width);
        let dims = (1..=most).rev().find(|d| width.is_multiple_of(*d)).unwrap_or(1);
        let neurons = count((self.spec.per_dimension * dims) as f64, self.spec.scale)?;
        let shape = Shape { ensembles: width / dims, neurons, dims, outputs: dims };
        // Where the parts of unit pointers lie, and a little beyond.
        let usual = (dims as f64 / width as f64).sqrt();
        let ball = radius * usual * POINTER_ROOM;
        let points = (neurons * 3 / 2).clamp(300, 2_000);
        self.bank(shape, "pointer", |_, seed| {
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

    pub fn map(&self, layer: &Map) -> Result<Neural, TuningError> {
        let function = layer.function.clone();
        let exact = move |x: f64| f64::from(function(x as Real));
        let per = self.spec.per_function as f64 * f64::from(layer.size);
        let radius = f64::from(layer.radius);
        let bank = match layer.above {
            None => self.components(layer.width, radius, per, &exact)?,
            Some(least) => {
                let reach = (f64::from(least), radius, Spread::Even);
                self.above((layer.width, per), reach, &exact, "above")?
            }
        };
        Ok(Neural { ports: Box::new(layer.clone()), bank, gated: false })
    }

    pub fn product(&self, layer: &Product) -> Result<NeuralProduct, TuningError> {
        let per = self.spec.per_product as f64 / 2.0;
        let radius = f64::from(layer.radius);
        let bank = self.components(2 * layer.pairs, radius, per, &|x| x * x)?;
        Ok(NeuralProduct { layer: layer.clone(), bank })
    }

    /// One ensemble a component whose neurons are silent below a value, and a function above it.
    fn above(
        &self,
        (width, per): (usize, f64),
        (from, radius, spread): (f64, f64, Spread),
        function: &(dyn Fn(f64) -> f64 + Sync),
        role: &str,
    ) -> Result<Bank, TuningError> {
        let neurons = count(per, self.spec.scale)?;
        let shape = Shape { ensembles: width, neurons, dims: 1, outputs: 1 };
        let low = (from / radius).clamp(-0.99, 0.9);
        let values: Vec<f64> = (0..SCALAR_POINTS)
            .map(|i| low + (1.0 - low) * (i as f64 + 0.5) / SCALAR_POINTS as f64)
            .collect();
        let wanted: Vec<f64> = values.iter().map(|v| function(v * radius)).collect();
        self.bank(shape, role, |_, seed| {
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

    pub fn select(&self, layer: &Select) -> Result<NeuralSelect, TuningError> {
        let level = f64::from(layer.rule.level());
        // Utilities are cosines, and sums of a few of them.
        let radius = level.max(0.0) + 0.7;
        let contest_share = match layer.rule {
            SelectRule::Threshold { .. } => 0.0,
            SelectRule::WinnerTakeAll { .. } => CONTEST_SHARE,
        };
        let (items, per) = (layer.items, self.spec.per_item as f64);
        let size = (items, per * (1.0 - contest_share));
        let chosen = self.above(size, (level, radius, Spread::Near), &|_| 1.0, "chosen")?;
        let contest = match layer.rule {
            SelectRule::Threshold { .. } => None,
            SelectRule::WinnerTakeAll { .. } => {
                let reach = (CONTENDING * level, radius, Spread::Even);
                Some(self.above((items, per * CONTEST_SHARE), reach, &|u| u, "contest")?)
            }
        };
        let decay = (-self.dt_s / RIVALRY_TAU_S).exp() as Real;
        Ok(NeuralSelect { layer: layer.clone(), chosen, contest, decay })
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
