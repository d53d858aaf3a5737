//! A band-limited random signal that repeats.

use rand::RngExt;
use rand_distr::StandardNormal;
use rustfft::FftPlanner;

use crate::sim::describe::builder::{Module, Scope};
use crate::sim::describe::fingerprint::Fingerprint;
use crate::sim::describe::handle::Out;
use crate::sim::describe::io::{EmitIo, StepCx};
use crate::sim::describe::kind::{Kind, Pointer, Scalar, Space, Vector, VocabTag};
use crate::sim::describe::node::Node;
use crate::sim::describe::port::{AnyOutput, OutputSpec, PortDecl};
use crate::sim::describe::process::Process;
use crate::sim::real::{Complex, Real};
use crate::sim::seed::Seed;
use crate::sim::time::{SimDuration, Timebase};

/// Greatest number of values in a table.
const MOST: u64 = 1 << 28;

/// An output that is a random signal of all frequencies up to a limit, with equal expected power, and repeats after a
/// period.
///
/// The period is rounded up to an even number of ticks. Each frequency `k / period` from `k = 1` to the limit has an
/// amplitude and phase of Gaussian parts; there is no constant part. The root mean square is 0.5 on average over seeds
/// unless [`rms`](Self::rms) says otherwise: that of one signal with `n` frequencies varies by `1 / (2 sqrt(n))`, relatively.
///
/// It is a stimulus and no noise: it belongs to the build seed and the path, is the same in every run of a graph whatever the
/// run seed, and the run's noise scale leaves it as it is. [`seeded`](Self::seeded) gives it a seed of its own.
///
/// Adding it to a graph returns the handle of the output. A limit below `1 / period` or above half the rate of the ticks,
/// and numbers that are not finite, are faults when the graph is built. Memory: 4 bytes per tick of the period and
/// component. Costs one copy per tick.
///
/// ```
/// use symbolt::prelude::*;
/// use symbolt::sim::WhiteSignal;
///
/// let mut graph = GraphBuilder::new();
/// let signal = graph.add("signal", WhiteSignal::scalar(SimDuration::from_secs(1), 10.0).rms(0.3));
/// let relay = graph.add("relay", Add::scalar());
/// graph.route(&signal >> &relay);
/// let probe = graph.probe(&signal, ProbeSpec::default());
/// let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), SimDuration::from_secs(2))?;
/// let values: Vec<f32> = sim.samples(&probe).iter().map(|(_, v)| v[0]).collect();
/// assert_eq!(values[..1000], values[1000..]);
/// # Ok::<(), symbolt::sim::SimError>(())
/// ```
pub struct WhiteSignal<K: Kind> {
    spec: OutputSpec<K>,
    period: SimDuration,
    high_hz: f64,
    rms: Real,
    start: Option<Real>,
    seed: Option<Seed>,
}

impl WhiteSignal<Scalar> {
    /// Creates a signal of one number, with frequencies up to `high_hz`.
    pub fn scalar(period: SimDuration, high_hz: f64) -> Self {
        Self::of(OutputSpec::scalar(), period, high_hz)
    }
}

impl WhiteSignal<Vector> {
    /// Creates `width` independent signals, with frequencies up to `high_hz`.
    pub fn vector(width: usize, period: SimDuration, high_hz: f64) -> Self {
        Self::of(OutputSpec::vector(width), period, high_hz)
    }
}

impl<V: VocabTag> WhiteSignal<Pointer<V>> {
    /// Creates a pointer of independent signals, with frequencies up to `high_hz`.
    pub fn pointer(space: &Space<V>, period: SimDuration, high_hz: f64) -> Self {
        Self::of(OutputSpec::pointer(space), period, high_hz)
    }
}

impl<K: Kind> WhiteSignal<K> {
    fn of(spec: OutputSpec<K>, period: SimDuration, high_hz: f64) -> Self {
        Self { spec, period, high_hz, rms: 0.5, start: None, seed: None }
    }

    /// Sets the expected root mean square of each component.
    pub fn rms(mut self, rms: Real) -> Self {
        self.rms = rms;
        self
    }

    /// Starts each component where its signal is nearest to `value`.
    pub fn starting_near(mut self, value: Real) -> Self {
        self.start = Some(value);
        self
    }

    /// Draws the signal from this seed and not from the build seed and the path.
    pub fn seeded(mut self, seed: Seed) -> Self {
        self.seed = Some(seed);
        self
    }
}

impl<K: Kind> Process for WhiteSignal<K> {
    fn declare(&self, ports: &mut PortDecl) {
        let numbers = [self.rms, self.start.unwrap_or(0.0)];
        if numbers.iter().any(|v| !v.is_finite()) || self.rms < 0.0 {
            ports.fault(format!(
                "a root mean square of {} from {} on is not usable; use finite numbers, and a root mean square of at \
                 least 0",
                numbers[0], numbers[1]
            ));
        }
        ports.output("out", self.spec.clone());
    }

    fn make(&self, time: Timebase, seed: Seed) -> Result<Box<dyn Node>, String> {
        let Self { period, high_hz, rms, start, .. } = *self;
        let spec = AnyOutput::from(self.spec.clone());
        let width = spec.width();
        let ticks = 2 * period.as_micros().div_ceil(2 * time.tick().as_micros());
        if ticks == 0 {
            return Err("a period of 0 ms is not usable; use a longer one".into());
        }
        if ticks.saturating_mul(width as u64) > MOST {
            return Err(format!(
                "a period of {period} has {ticks} ticks for {width} components; use a shorter one, of at most {MOST} values"
            ));
        }
        let length = ticks as f64 * time.dt_s();
        // Above the rounding of a product such as 10 Hz and 1 s.
        let highest = (high_hz * length * (1.0 + 1e-9)).floor();
        if !(1.0..=0.5 * ticks as f64).contains(&highest)
            || high_hz > 0.5 / time.dt_s() * (1.0 + 1e-9)
        {
            return Err(format!(
                "frequencies up to {high_hz} Hz do not fit a period of {period} at ticks of {}; use a limit from {} Hz to \
                 {} Hz",
                time.tick(),
                1.0 / length,
                0.5 / time.dt_s()
            ));
        }
        let mut rng = self.seed.unwrap_or(seed).rng();
        let (ticks, highest) = (ticks as usize, highest as usize);
        let scale = rms / (highest as Real).sqrt();
        let transform = FftPlanner::new().plan_fft_inverse(ticks);
        let mut table = vec![0.0; ticks * width];
        for component in 0..width {
            let mut wave = vec![Complex::default(); ticks];
            for bin in &mut wave[1..=highest] {
                let [re, im]: [Real; 2] = [rng.sample(StandardNormal), rng.sample(StandardNormal)];
                *bin = Complex::new(scale * re, scale * im);
            }
            transform.process(&mut wave);
            let away = |at: &usize| start.map_or(0.0, |start| (wave[*at].re - start).abs());
            let first = (0..ticks).min_by(|a, b| away(a).total_cmp(&away(b))).unwrap_or(0);
            for at in 0..ticks {
                table[at * width + component] = wave[(first + at) % ticks].re;
            }
        }
        Ok(Box::new(Repeated { spec, table }))
    }
}

impl<K: Kind> Module for WhiteSignal<K> {
    type Ports = Out<K>;

    fn expand(self, scope: &mut Scope<'_>) -> Out<K> {
        scope.process(self).output("out")
    }
}

/// The node: one row of values per tick, again and again.
struct Repeated {
    spec: AnyOutput,
    table: Vec<Real>,
}

impl Node for Repeated {
    fn declare(&self, ports: &mut PortDecl) {
        ports.output("out", self.spec.clone());
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.reals(&self.table);
    }

    fn emit(&self, cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
        let out = io.outputs.get_mut(0);
        let width = out.len();
        let row = (cx.tick() % (self.table.len() / width) as u64) as usize;
        out.copy_from_slice(&self.table[row * width..(row + 1) * width]);
    }
}
