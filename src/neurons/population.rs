//! Populations for representations, functions and products: the tuning of their neurons, and their nodes.
//!
//! - Ensembles of at most [`LifSpec::sub_dimensions`] dimensions represent a pointer. One ensemble per component
//!   represents a plain vector.
//! - Two squares make a product, `a b = ((a + b) / 2)^2 - ((a - b) / 2)^2`, each in an ensemble of one dimension
//!   (Gosmann, "Precise multiplications with the NEF", 2015).
//! - The populations for selections are in `selection.rs`.

use std::ops::Range;
use std::sync::Arc;

use super::bank::{Bank, Consts, Draft, Firing, Shape};
use super::decode::Points;
use super::layer::{Map, Product, Represent};
use super::model::{TuningError, refuse};
use super::parted::{Cut, Deal, Parted};
use super::plan::LifSpec;
use super::solved::{Kept, SolvedModel, Unfit};
use super::tuning::{Neurons, cosine, on_sphere, part_of_pointer};
use crate::sim::{
    Fingerprint, LayerRequest, Node, Outputs, PartIo, PartSpec, Parts, PortDecl, Real, ScratchSpec,
    Seed, StateMut, StepCx, fnv1a,
};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// The data from which the populations of one layer are built.
pub(crate) struct Maker<'a> {
    pub spec: &'a LifSpec,
    pub firing: Firing,
    pub dt_s: f64,
    pub path: &'a str,
    pub seed: Seed,
    /// Source of populations that are already solved.
    pub solved: Option<&'a SolvedModel>,
    /// Deals out the parts of the banks.
    pub deal: &'a Deal,
}

/// Why a layer could not get a population.
pub(crate) enum Refusal {
    Tuning(TuningError),
    Unfit(Unfit),
}

impl From<TuningError> for Refusal {
    fn from(error: TuningError) -> Self {
        Self::Tuning(error)
    }
}

/// The node of a representation or a function: one bank.
pub(crate) struct Neural {
    ports: Box<dyn LayerRequest>,
    bank: Parted,
    /// Share of the silencing current that closes the gate; `None` without a gate.
    gate: Option<Real>,
}

impl Neural {
    pub fn kept(&self) -> Vec<Kept> {
        vec![self.bank.kept.clone()]
    }

    /// Returns the bank, to be changed before the graph is built.
    pub fn bank_mut(&mut self) -> Option<&mut Bank> {
        self.bank.bank_mut()
    }
}

impl Node for Neural {
    fn declare(&self, ports: &mut PortDecl) {
        self.ports.declare(ports);
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.number(self.bank.kept.fingerprint).number(u64::from(self.gate.is_some()));
        if let Some(weak) = self.gate.filter(|inhibition| *inhibition != 1.0) {
            hash.reals(&[weak]);
        }
    }

    fn init(&self, _cx: &StepCx<'_>, state: &mut StateMut<'_>, _registered: &mut Outputs<'_>) {
        self.bank.init(state.reals);
    }

    fn parts(&self) -> Option<&dyn Parts> {
        Some(self)
    }

    fn units(&self) -> usize {
        self.bank.bank().spiking()
    }
}

impl Parts for Neural {
    fn count(&self) -> usize {
        self.bank.count()
    }

    fn part(&self, part: usize) -> PartSpec {
        self.bank.spec(part, self.bank.bank().shape.outputs)
    }

    fn advance(&self, _cx: &StepCx<'_>, part: usize, io: &mut PartIo<'_>) {
        let open = match self.gate {
            Some(1.0) => io.inputs.scalar(1),
            Some(inhibition) => 1.0 - inhibition * (1.0 - io.inputs.scalar(1).clamp(0.0, 1.0)),
            None => 1.0,
        };
        let own = rows(self.bank.ensembles(part), self.bank.bank().shape.dims);
        self.bank.step(part, (&io.inputs.get(0)[own], open), io.state, io.results);
    }

    fn collect(&self, part: usize, results: &[Real], outputs: &mut Outputs<'_>) {
        let own = rows(self.bank.ensembles(part), self.bank.bank().shape.outputs);
        outputs.get_mut(0)[own].copy_from_slice(results);
    }

    fn event(&self, _part: usize, state: &[Real], neuron: usize) -> bool {
        self.bank.bank().spiked(state, neuron)
    }
}

/// Returns the range of `width` values for each ensemble.
pub(super) fn rows(ensembles: Range<usize>, width: usize) -> Range<usize> {
    ensembles.start * width..ensembles.end * width
}

/// The node of products: differences of squares.
pub(crate) struct NeuralProduct {
    layer: Product,
    /// Two ensembles for each product.
    bank: Parted,
}

impl NeuralProduct {
    pub fn kept(&self) -> Vec<Kept> {
        vec![self.bank.kept.clone()]
    }
}

impl Node for NeuralProduct {
    fn declare(&self, ports: &mut PortDecl) {
        self.layer.declare(ports);
        let reals = 2 * self.bank.ensembles(0).len();
        ports.scratch(ScratchSpec { reals, ..ScratchSpec::default() });
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.number(self.bank.kept.fingerprint);
    }

    fn init(&self, _cx: &StepCx<'_>, state: &mut StateMut<'_>, _registered: &mut Outputs<'_>) {
        self.bank.init(state.reals);
    }

    fn parts(&self) -> Option<&dyn Parts> {
        Some(self)
    }

    fn units(&self) -> usize {
        self.bank.bank().spiking()
    }
}

impl NeuralProduct {
    fn pairs(&self, part: usize) -> Range<usize> {
        let ensembles = self.bank.ensembles(part);
        ensembles.start / 2..ensembles.end / 2
    }
}

impl Parts for NeuralProduct {
    fn count(&self) -> usize {
        self.bank.count()
    }

    fn part(&self, part: usize) -> PartSpec {
        PartSpec { results: self.pairs(part).len(), ..self.bank.spec(part, 0) }
    }

    fn advance(&self, _cx: &StepCx<'_>, part: usize, io: &mut PartIo<'_>) {
        let pairs = self.pairs(part);
        let (halves, squares) = io.scratch.reals[..4 * pairs.len()].split_at_mut(2 * pairs.len());
        let (a, b) = (&io.inputs.get(0)[pairs.clone()], &io.inputs.get(1)[pairs]);
        for ((two, a), b) in halves.chunks_exact_mut(2).zip(a).zip(b) {
            two[0] = (a + b) / 2.0;
            two[1] = (a - b) / 2.0;
        }
        self.bank.step(part, (halves, 1.0), io.state, squares);
        for (result, two) in io.results.iter_mut().zip(squares.chunks_exact(2)) {
            *result = two[0] - two[1];
        }
    }

    fn collect(&self, part: usize, results: &[Real], outputs: &mut Outputs<'_>) {
        outputs.get_mut(0)[self.pairs(part)].copy_from_slice(results);
    }

    fn event(&self, _part: usize, state: &[Real], neuron: usize) -> bool {
        self.bank.bank().spiked(state, neuron)
    }
}

/// Greatest number of neurons in one ensemble. The decoder solve for more would need gigabytes of memory.
const MAX_NEURONS: f64 = 10_000.0;

pub(super) fn count(of: f64, scale: f64) -> Result<usize, TuningError> {
    let count = (of * scale).round();
    if (1.0..=MAX_NEURONS).contains(&count) {
        Ok(count as usize)
    } else {
        Err(refuse("neurons", format!("{count} per ensemble"), format!("1 to {MAX_NEURONS}")))
    }
}

impl Maker<'_> {
    /// Solves for the own part of a bank, or takes it from the solved model. `marks` are the numbers that distinguish
    /// this bank from other banks of the same role. They enter its fingerprint.
    pub(super) fn bank(
        &self,
        (shape, cut): (Shape, Cut),
        role: &str,
        marks: &[f64],
        draft: impl Fn(usize, Seed) -> Result<Draft, TuningError> + Sync,
    ) -> Result<Parted, Refusal> {
        self.check()?;
        let (fingerprint, own) = (self.fingerprint(shape, role, marks), cut.own(shape.ensembles));
        if let Some(solved) = self.solved {
            let form = (shape, self.firing, Consts::new(&self.spec.model, self.dt_s));
            let mut kept = solved.find(self.path, fingerprint, form).map_err(Refusal::Unfit)?;
            if let Some(own) = own {
                kept.bank = Arc::new(kept.bank.only(own));
            }
            return Ok(Parted { kept, cut });
        }
        let how = (self.firing, self.spec.regularisation);
        let seed = self.seed.derive("", role);
        let bank = Bank::build(&self.spec.model, self.dt_s, shape, how, (seed, own), draft)?;
        Ok(Parted { kept: Kept { bank: Arc::new(bank), fingerprint }, cut })
    }

    /// Checks the ranges from which neurons are drawn. An invalid range then fails for every seed.
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
        let spread = self.spec.item_spread;
        if !(spread.is_finite() && spread >= 0.0) {
            return Err(refuse("item_spread", spread, "a finite number of at least 0"));
        }
        if !(*low >= -1.0 && low <= high && *high < 1.0) {
            let expected = "two numbers in rising order, at least -1 and below 1";
            return Err(refuse("intercepts", format!("{low} to {high}"), expected));
        }
        Ok(())
    }

    /// Hashes everything that determines the tuning and the decoders.
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

    pub(super) fn max_rates(&self) -> std::ops::RangeInclusive<f64> {
        self.spec.max_rates[0]..=self.spec.max_rates[1]
    }

    /// Draws neurons of one dimension. Half of them have the encoder 1, the other half -1.
    ///
    /// The range of intercepts is cut into as many equal parts as there are pairs of neurons; each pair draws its
    /// intercepts from one part. This leaves less distortion than independent draws.
    pub(super) fn scalar(&self, count: usize, seed: Seed) -> Result<Neurons, TuningError> {
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

    /// Makes one ensemble per component of a plain vector. Each ensemble computes a function of its component. `unit`
    /// ensembles stay together.
    fn components(
        &self,
        (width, unit): (usize, usize),
        radius: f64,
        per: f64,
        function: &(dyn Fn(f64) -> f64 + Sync),
    ) -> Result<Parted, Refusal> {
        let neurons = count(per, self.spec.scale)?;
        let shape = Shape { ensembles: width, neurons, dims: 1, outputs: 1 };
        let values: Vec<f64> = (0..SCALAR_POINTS)
            .map(|i| 2.0 * (i as f64 + 0.5) / SCALAR_POINTS as f64 - 1.0)
            .collect();
        let wanted: Vec<f64> = values.iter().map(|v| function(v * radius)).collect();
        let marks: Vec<f64> = wanted.iter().copied().chain([radius]).collect();
        self.bank((shape, self.deal.cut(shape, unit)), "components", &marks, |_, seed| {
            let points = Points { values: values.clone(), wanted: wanted.clone(), outputs: 1 };
            Ok(Draft { neurons: self.scalar(neurons, seed)?, radius, points })
        })
    }

    pub fn represent(&self, layer: &Represent) -> Result<Neural, Refusal> {
        let (width, radius) = (layer.input.width(), f64::from(layer.radius));
        let bank = if layer.input.is_pointer() {
            self.pointer(width, radius)?
        } else {
            self.components((width, 1), radius, self.spec.per_function as f64, &|x| x)?
        };
        let gate = layer.gated.then_some(layer.inhibition);
        Ok(Neural { ports: Box::new(layer.clone()), bank, gate })
    }

    /// Makes the ensembles of a pointer.
    fn pointer(&self, width: usize, radius: f64) -> Result<Parted, Refusal> {
        let most = self.spec.sub_dimensions.clamp(1, width);
        let dims = (1..=most).rev().find(|d| width.is_multiple_of(*d)).unwrap_or(1);
        let neurons = count(self.spec.per_dimension as f64 * dims as f64, self.spec.scale)?;
        let shape = Shape { ensembles: width / dims, neurons, dims, outputs: dims };
        // Usual norm of a part of a unit pointer. The ensemble represents norms up to 1.2 times that.
        let usual = (dims as f64 / width as f64).sqrt();
        let ball = radius * usual * POINTER_ROOM;
        let points = (neurons * 3 / 2).clamp(300, 2_000);
        let cut = self.deal.cut(shape, 1);
        self.bank((shape, cut), "pointer", &[ball, usual, points as f64], |_, seed| {
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
        let bank = match layer.above {
            None => self.components((layer.width, 1), radius, per, &exact)?,
            Some(least) => {
                let reach = (f64::from(least), radius, Spread::Even);
                let cut = |shape: Shape| self.deal.cut(shape, 1);
                self.above((layer.width, per, &cut), reach, &exact, "above")?
            }
        };
        Ok(Neural { ports: Box::new(layer.clone()), bank, gate: None })
    }

    pub fn product(&self, layer: &Product) -> Result<NeuralProduct, Refusal> {
        let per = self.spec.per_product as f64 / 2.0;
        let radius = f64::from(layer.radius);
        let bank = self.components((2 * layer.pairs, 2), radius, per, &|x| x * x)?;
        Ok(NeuralProduct { layer: layer.clone(), bank })
    }

    /// Makes one ensemble per component. Its neurons are silent below `from` and compute a function above it.
    pub(super) fn above(
        &self,
        (width, per, cut): (usize, f64, &dyn Fn(Shape) -> Cut),
        (from, radius, spread): (f64, f64, Spread),
        function: &(dyn Fn(f64) -> f64 + Sync),
        role: &str,
    ) -> Result<Parted, Refusal> {
        let neurons = count(per, self.spec.scale)?;
        let shape = Shape { ensembles: width, neurons, dims: 1, outputs: 1 };
        let low = (from / radius).clamp(-0.99, 0.9);
        let values: Vec<f64> = (0..SCALAR_POINTS)
            .map(|i| low + (1.0 - low) * (i as f64 + 0.5) / SCALAR_POINTS as f64)
            .collect();
        let wanted: Vec<f64> = values.iter().map(|v| function(v * radius)).collect();
        let mark = match spread {
            Spread::Even => 1.0,
            // 0 by default, as before the mean could be chosen: stored populations keep their fingerprints.
            Spread::Near(mean) => mean - LifSpec::default().item_spread,
        };
        let marks: Vec<f64> = wanted.iter().copied().chain([low, radius, mark]).collect();
        self.bank((shape, cut(shape)), role, &marks, |_, seed| {
            let intercept = |rng: &mut ChaCha8Rng| {
                let share: f64 = rng.random();
                match spread {
                    Spread::Even => low + (0.95 - low) * share,
                    // Most neurons begin to fire just above the level.
                    Spread::Near(mean) => (low - (1.0 - share).ln() * mean).min(0.95),
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
}

/// Returns a number that differs between processors on which decoders are solved to different bits: a hash of the decoders
/// of a small bank. Takes some milliseconds.
///
/// Ranks that solve the same graph on processors of different kinds compare it at the start
/// ([`Ranks::differs`](crate::sim::Ranks::differs)).
pub fn solver_signature() -> u64 {
    let spec = LifSpec::default();
    let deal = Deal::new(None);
    let (dt_s, seed) = (0.001, Seed::new(1));
    let firing = Firing::Spikes;
    let maker =
        Maker { spec: &spec, firing, dt_s, path: "signature", seed, solved: None, deal: &deal };
    let mut hash = Fingerprint::default();
    // Large enough for the matrix kernels that the processor chooses.
    if let Ok(bank) = maker.pointer(32, 1.0) {
        hash.reals(&bank.bank().decoders);
    }
    hash.value()
}

/// How intercepts are distributed above a level.
#[derive(Clone, Copy)]
pub(super) enum Spread {
    /// Uniformly up to 0.95 of the radius.
    Even,
    /// Exponentially, most of them just above the level, with this mean distance in units of the radius.
    Near(f64),
}

/// Number of evaluation points for functions of one number.
const SCALAR_POINTS: usize = 300;
/// Radius of a pointer's ensemble, in units of the usual norm of the part that it represents.
const POINTER_ROOM: f64 = 1.2;
