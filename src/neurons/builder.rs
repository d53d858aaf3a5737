//! Builds the populations of a layer: draws neurons and solves for their decoders, or takes them from a solved model.

use std::ops::RangeInclusive;
use std::sync::Arc;

use rand::{Rng, RngExt};
use rand_chacha::ChaCha8Rng;

use super::bank::{
    Bank, Draft, Ensembles, LoadBalance, Partition, Recipe, Shape, ensemble_seed, hadamard,
};
use super::built::Origin;
use super::draw::{Neurons, cosine, on_sphere, part_of_pointer};
use super::models::{NeuronModel, check_state};
use super::plan::NeuronSpec;
use super::poles;
use super::solve::{Points, Special};
use super::solved::SolvedModel;
use super::tuning::{Tuning, TuningError, refuse};
use super::turn::{Turn, origin};
use crate::sim::{Fingerprint, Seed, fnv1a};

/// Builds the populations of one layer, for [`Layer::neural`](super::Layer::neural).
pub struct PopulationBuilder<'a> {
    pub(super) spec: &'a NeuronSpec,
    pub(super) dt_s: f64,
    pub(super) path: &'a str,
    pub(super) seed: Seed,
    /// Source of populations that are already solved.
    pub(super) solved: Option<&'a SolvedModel>,
    /// Assigns the parts of the populations to ranks.
    pub(super) balance: &'a LoadBalance,
    /// Whether the plan asks for rates of neurons instead of spikes.
    pub(super) in_rates: bool,
}

/// What is decoded from the ensembles of a bank: the functions with their widths, and outputs with points or a solver
/// of their own.
#[derive(Clone)]
pub(super) struct Outputs {
    pub functions: Vec<(String, usize)>,
    pub special: Vec<Special>,
    /// Whether neurons are drawn by the tuning, so that its greatest rate must be possible.
    pub tuned: bool,
    /// Factor on the regularisation of the tuning.
    pub regularisation: f64,
    /// So many ensembles are drawn and solved for. The others are these, turned.
    pub distinct: usize,
}

impl Outputs {
    /// One function of some width, from neurons that are drawn by the tuning.
    fn tuned(width: usize) -> Self {
        let functions = vec![("out".into(), width)];
        let (special, distinct) = (Vec::new(), usize::MAX);
        Self { functions, special, tuned: true, regularisation: 1.0, distinct }
    }
}

/// Ensembles of one dimension, one for each component of a vector.
#[derive(Debug, Clone, Copy)]
pub struct Components {
    /// Number of components.
    pub width: usize,
    /// Number of neurons in an ensemble, before [`Tuning::scale`].
    pub neurons: f64,
    /// Greatest magnitude of a component.
    pub radius: f64,
    /// Where neurons begin to fire.
    pub onset: Onset,
    /// Which ensembles stay together.
    pub keep: Keep,
}

/// Where the neurons of [`Components`] begin to fire.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Onset {
    /// At [`Tuning::intercepts`], in both directions.
    Anywhere,
    /// Evenly between a level and 0.95 of the radius. Neurons are silent below the level, which `level / radius` limits
    /// to -0.99 to 0.9.
    Above(f64),
    /// At even steps from a level on, so that few neurons decode a function with little ripple. Neurons are silent below
    /// the level, which is limited as in [`Above`](Self::Above).
    Even(f64),
    /// Most of them just above a level: at a mean distance, as a fraction of the radius.
    JustAbove {
        /// The level.
        level: f64,
        /// The mean distance.
        mean: f64,
    },
}

/// Which ensembles of a population are advanced together, and by the same process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Keep {
    /// Groups of so many.
    Groups(usize),
    /// All of them. [`PopulationBuilder::owner`] chooses the process.
    All(Owner),
}

/// The process that advances a population as a whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Owner(u32);

/// Number of evaluation points for functions of one number.
const SCALAR_POINTS: usize = 300;
/// Radius of a pointer's ensemble, in units of the usual norm of the part that it represents.
const POINTER_ROOM: f64 = 1.2;

/// How the ensembles of a pointer are drawn and solved.
#[derive(Debug, Clone, Copy)]
pub(super) struct PointerDraw {
    /// Factor on the number of evaluation points.
    points: usize,
    /// Range of the norms of evaluation points, in units of the usual norm.
    norms: [f64; 2],
    /// Whether each second neuron is the mirror image of the one before it. What they decode then has no error of even
    /// order: none at 0, and the same with the other sign at an opposite value.
    mirrored: bool,
    /// Factor on the regularisation of the decoders.
    regularisation: f64,
}

impl PointerDraw {
    /// For a value that is passed on.
    pub const FLOW: Self =
        Self { points: 1, norms: [0.0, POINTER_ROOM], mirrored: false, regularisation: 1.0 };
    /// For a value that is fed back, and decays.
    pub const FED: Self =
        Self { points: 3, norms: [0.4 * POINTER_ROOM, POINTER_ROOM], ..Self::FLOW };
    /// For a value that is kept. A memory drifts by the error of its decoding (Eliasmith and Anderson 2003, section 8.2), so
    /// its norms are those that it holds. A smaller regularisation trades that error, which adds up, for noise, which the
    /// synapse of the loop averages.
    pub const MEMORY: Self =
        Self { points: 3, norms: [0.88, 1.1], mirrored: true, regularisation: 0.1 };
}

impl PopulationBuilder<'_> {
    /// Returns the tuning that the plan gives to the layer.
    pub fn tuning(&self) -> &Tuning {
        &self.spec.tuning
    }

    /// Returns the neuron model that the plan gives to the layer.
    pub fn model(&self) -> &dyn NeuronModel {
        &*self.spec.model
    }

    /// Returns the length of a tick, in seconds.
    pub fn dt_s(&self) -> f64 {
        self.dt_s
    }

    /// Returns a process for populations of so many neurons that stay whole: that with the least work.
    pub fn owner(&self, neurons: usize) -> Owner {
        Owner(self.balance.owner(neurons))
    }

    /// Builds ensembles that compute a function of their component each. `role` tells the populations of a layer apart.
    ///
    /// # Errors
    /// [`TuningError`] if the tuning is invalid, or if the function is not finite within the radius.
    pub fn components(
        &self,
        role: &str,
        of: &Components,
        function: &(dyn Fn(f64) -> f64 + Sync),
    ) -> Result<Ensembles, TuningError> {
        self.components_from(role, of, PointerDraw::FLOW, function)
    }

    /// As [`components`](Self::components), solved with the regularisation of a draw.
    pub(super) fn components_from(
        &self,
        role: &str,
        of: &Components,
        PointerDraw { regularisation, .. }: PointerDraw,
        function: &(dyn Fn(f64) -> f64 + Sync),
    ) -> Result<Ensembles, TuningError> {
        let radius = of.radius;
        let neurons = self.tuning().count(of.neurons)?;
        let shape = Shape { ensembles: of.width, neurons, dims: 1, outputs: 1, hadamard: false };
        let partition = match of.keep {
            Keep::Groups(unit) => self.balance.partition(shape, unit),
            Keep::All(Owner(owner)) => self.balance.whole(shape, owner),
        };
        let low = match of.onset {
            Onset::Anywhere => -1.0,
            Onset::Above(level) | Onset::Even(level) | Onset::JustAbove { level, .. } => {
                (level / radius).clamp(-0.99, 0.9)
            }
        };
        let point = |i| low + (1.0 - low) * (f64::from(i) + 0.5) / f64::from(SCALAR_POINTS as u32);
        let values: Vec<f64> = (0..SCALAR_POINTS as u32).map(point).collect();
        let wanted: Vec<f64> = values.iter().map(|v| function(v * radius)).collect();
        if let Some((value, at)) = wanted.iter().zip(&values).find(|(v, _)| !v.is_finite()) {
            return Err(poles::not_finite(*value, (at * radius) as f32));
        }
        let one = |x: &[f64], out: &mut [f64]| out[0] = function(x[0]);
        let at: Vec<f64> = values.iter().map(|v| v * radius).collect();
        match of.onset {
            Onset::Anywhere => poles::check(&one, radius, (&at, 1), (&wanted, 1))?,
            _ => poles::between(&one, (&at, 1), (&wanted, 1))?,
        }
        let own_marks = match of.onset {
            Onset::Anywhere => vec![radius],
            Onset::Above(_) => vec![low, radius, 1.0],
            Onset::Even(_) => vec![low, radius, 2.0],
            // 0 by default, as before the mean could be chosen: stored populations keep their fingerprints.
            Onset::JustAbove { mean, .. } => {
                vec![low, radius, mean - Tuning::default().item_spread]
            }
        };
        let mut marks: Vec<f64> = wanted.iter().copied().chain(own_marks).collect();
        // Stored populations that were there before keep their fingerprints.
        marks.extend(Some(regularisation).filter(|factor| *factor != 1.0));
        let (spec, onset) = (self.spec.clone(), of.onset);
        let outputs = Outputs { regularisation, ..Outputs::tuned(1) };
        self.bank((shape, partition), role, &marks, outputs, move |_, seed| {
            let neurons = match onset {
                Onset::Anywhere => spec.scalar(neurons, seed)?,
                Onset::Above(_) => {
                    spec.upward(neurons, seed, |share| low + (0.95 - low) * share)?
                }
                Onset::Even(_) => {
                    let mut steps = (0..neurons).map(|step| step as f64 / neurons as f64);
                    let mut step = |_| steps.next().unwrap_or(0.0);
                    spec.upward(neurons, seed, |share| low + (0.95 - low) * step(share))?
                }
                Onset::JustAbove { mean, .. } => {
                    spec.upward(neurons, seed, |share| (low - (1.0 - share).ln() * mean).min(0.95))?
                }
            };
            let points = Points { values: values.clone(), wanted: wanted.clone(), outputs: 1 };
            Ok(Draft { neurons, radius, points })
        })
    }

    /// Builds the ensembles of a pointer, each of several dimensions.
    ///
    /// # Errors
    /// [`TuningError`] if the tuning is invalid.
    pub fn pointer(&self, width: usize, radius: f64) -> Result<Ensembles, TuningError> {
        self.pointer_from(width, radius, PointerDraw::FLOW)
    }

    /// As [`pointer`](Self::pointer), drawn and solved in a given way.
    pub(super) fn pointer_from(
        &self,
        width: usize,
        radius: f64,
        draw: PointerDraw,
    ) -> Result<Ensembles, TuningError> {
        let tuning = self.tuning();
        let most = tuning.sub_dimensions.clamp(1, width);
        let dims = (1..=most).rev().find(|d| width.is_multiple_of(*d)).unwrap_or(1);
        let neurons = tuning.count(tuning.per_dimension as f64 * dims as f64)?;
        let (ensembles, hadamard) = (width / dims, tuning.encoders.are_hadamard(dims));
        let shape = Shape { ensembles, neurons, dims, outputs: dims, hadamard };
        // A fast transform takes the place of Hadamard encoders, which have no mirror images.
        let draw = if draw.mirrored && hadamard { PointerDraw::FED } else { draw };
        // Usual norm of a part of a unit pointer. The ensemble represents norms up to 1.2 times that.
        let usual = (dims as f64 / width as f64).sqrt();
        let ball = radius * usual * POINTER_ROOM;
        let points = (neurons * 3 / 2).clamp(300, 2_000) * draw.points;
        let partition = self.balance.partition(shape, 1);
        let spec = self.spec.clone();
        let PointerDraw { norms: [low, high], mirrored, regularisation, .. } = draw;
        let mut marks = vec![ball, usual, points as f64];
        if mirrored {
            marks.extend([low, high, regularisation]);
        }
        // Turned Hadamard encoders are none any more, and one dimension has only two turns.
        let distinct = if hadamard || dims == 1 { usize::MAX } else { tuning.distinct_ensembles };
        if distinct < ensembles {
            marks.push(distinct as f64);
        }
        let outputs = Outputs { regularisation, distinct, ..Outputs::tuned(dims) };
        self.bank((shape, partition), "pointer", &marks, outputs, move |_, seed| {
            let mut rng = seed.rng();
            let mut neurons = spec.directions(&shape, &mut rng)?;
            if mirrored {
                neurons.mirror();
            }
            let mut values = vec![0.0; points * dims];
            for value in values.chunks_exact_mut(dims) {
                part_of_pointer(&mut rng, value, width);
                let amplitude = low + (high - low) * rng.random::<f64>();
                let scale = amplitude / (usual * POINTER_ROOM);
                value.iter_mut().for_each(|v| *v *= scale);
            }
            let wanted = values.iter().map(|v| v * ball).collect();
            Ok(Draft { neurons, radius: ball, points: Points { values, wanted, outputs: dims } })
        })
    }

    /// Solves for the own part of a bank, or takes it from the solved model. `marks` are the numbers that distinguish
    /// this bank from other banks of the same role. They enter its fingerprint.
    pub(super) fn bank(
        &self,
        (shape, partition): (Shape, Partition),
        role: &str,
        marks: &[f64],
        outputs: Outputs,
        draft: impl Fn(usize, Seed) -> Result<Draft, TuningError> + Send + Sync + 'static,
    ) -> Result<Ensembles, TuningError> {
        let NeuronSpec { model, tuning } = self.spec;
        model.check(self.dt_s)?;
        check_state(&**model)?;
        tuning.check()?;
        if outputs.tuned {
            // A rate that is not possible fails for every seed. Draws do not reach the upper end of a range.
            let [low, high] = tuning.max_rates;
            model.gain_bias(high - 1e-9 * (high - low), 0.0)?;
            let most = model.most_rate(self.dt_s);
            if high > most * (1.0 + 1e-9) {
                let expected =
                    format!("at most {} s, for maximum rates of up to {high} Hz", 1.0 / high);
                return Err(refuse("tick", format!("{} s", self.dt_s), expected));
            }
        }
        let seed = self.seed.derive("", role);
        let (fingerprint, own) =
            (self.fingerprint(shape, role, marks), partition.own(shape.ensembles));
        let solved = match (self.solved, own) {
            (Some(solved), None) => solved.find(self.path, fingerprint, shape)?,
            (Some(solved), Some(own)) => {
                Arc::new(solved.find(self.path, fingerprint, shape)?.only(own))
            }
            (None, own) => {
                let dt_s = self.dt_s;
                let regularisation = tuning.regularisation * outputs.regularisation;
                let (model, special, distinct) = (&**model, &*outputs.special, outputs.distinct);
                let recipe = Recipe {
                    model,
                    dt_s,
                    shape,
                    regularisation,
                    seed,
                    fingerprint,
                    own,
                    special,
                    distinct,
                };
                Arc::new(recipe.solve(&draft)?)
            }
        };
        let Outputs { functions, special, distinct, .. } = outputs;
        let draft = Box::new(move |ensemble: usize| {
            let first = origin(ensemble, distinct);
            let drawn = draft(first, ensemble_seed(seed, first))?;
            if first == ensemble {
                return Ok(drawn);
            }
            Ok(Turn::of(ensemble_seed(seed, ensemble), shape.dims).draft(&drawn))
        });
        let origin = Arc::new(Origin { functions, special, draft });
        Ok(Ensembles { bank: Bank::new(solved, model.clone(), self.dt_s), partition, origin })
    }

    /// Hashes everything that determines the tuning and the decoders.
    fn fingerprint(&self, shape: Shape, role: &str, marks: &[f64]) -> u64 {
        let NeuronSpec { model, tuning } = self.spec;
        let mut hash = Fingerprint::continued(fnv1a(self.seed.value(), role.as_bytes()));
        model.fingerprint(hash.real(self.dt_s));
        hash.real(tuning.regularisation);
        for number in tuning.max_rates.iter().chain(&tuning.intercepts).chain(marks) {
            hash.real(*number);
        }
        for size in [shape.ensembles, shape.neurons, shape.dims, shape.outputs] {
            hash.number(size as u64);
        }
        if shape.hadamard {
            hash.text("hadamard");
        }
        hash.value()
    }
}

impl NeuronSpec {
    fn max_rates(&self) -> RangeInclusive<f64> {
        self.tuning.max_rates[0]..=self.tuning.max_rates[1]
    }

    /// Draws neurons whose encoders are random directions. Intercepts follow the distribution of a coordinate of a
    /// random direction.
    pub(super) fn directions<R: Rng>(
        &self,
        shape: &Shape,
        rng: &mut R,
    ) -> Result<Neurons, TuningError> {
        let Shape { neurons, dims, hadamard, .. } = *shape;
        let drawn = if hadamard { hadamard::directions(rng, shape) } else { Vec::new() };
        let mut rows = drawn.chunks_exact(dims);
        let encoder = |rng: &mut R, out: &mut [f64]| match rows.next() {
            Some(row) => out.copy_from_slice(row),
            None => on_sphere(rng, out),
        };
        let (model, rates) = (&*self.model, self.max_rates());
        Neurons::draw(model, (neurons, dims), rates, rng, encoder, |rng| cosine(rng, dims + 2))
    }

    /// Draws neurons of one dimension. Half of them have the encoder 1, the other half -1.
    ///
    /// The range of intercepts is cut into as many equal parts as there are pairs of neurons; each pair draws its
    /// intercepts from one part. This leaves less distortion than independent draws.
    pub(super) fn scalar(&self, count: usize, seed: Seed) -> Result<Neurons, TuningError> {
        let [low, high] = self.tuning.intercepts;
        let (mut signs, mut parts) = (0..count, 0..count);
        let half = count.div_ceil(2) as f64;
        Neurons::draw(
            &*self.model,
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

    /// Draws neurons of one dimension with the encoder 1. `intercept` makes intercepts from numbers between 0 and 1.
    fn upward(
        &self,
        count: usize,
        seed: Seed,
        mut intercept: impl FnMut(f64) -> f64,
    ) -> Result<Neurons, TuningError> {
        let up = |_: &mut ChaCha8Rng, out: &mut [f64]| out.fill(1.0);
        let (model, rates) = (&*self.model, self.max_rates());
        Neurons::draw(model, (count, 1), rates, &mut seed.rng(), up, |rng| intercept(rng.random()))
    }
}

/// Returns a number that differs between processors on which decoders are solved to different bits: a hash of the
/// decoders of a small bank. Takes some milliseconds.
///
/// Ranks that solve the same graph on processors of different kinds compare it at the start
/// ([`Ranks::differs`](crate::sim::Ranks::differs)).
pub fn solver_signature() -> u64 {
    let spec = &NeuronSpec::default();
    let (dt_s, path, seed, balance) = (0.001, "signature", Seed::new(1), &LoadBalance::new(None));
    let solved = None;
    let builder = PopulationBuilder { spec, dt_s, path, seed, solved, balance, in_rates: false };
    let mut hash = Fingerprint::default();
    // Large enough for the matrix kernels that the processor chooses.
    if let Ok(Ensembles { bank, .. }) = builder.pointer(32, 1.0) {
        hash.reals(&bank.solved.decoders);
    }
    hash.value()
}
