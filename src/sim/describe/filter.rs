//! Filters: synapses made discrete for one length of a tick.

use nalgebra::DMatrix;

use super::synapse::{LinearFilter, MAX_ORDER, Synapse};
use crate::sim::error::SynapseError;
use crate::sim::real::Real;
use crate::sim::time::{SimDuration, Timebase};

/// Greatest number of ticks that a delay or a triangle holds.
const MAX_TICKS: u64 = 1_000_000;

/// A [`Synapse`] made discrete for one length of a tick, for a node that filters signals of its own.
///
/// The filter is immutable. Its state is a slice that the caller keeps: [`state_len`](Self::state_len) numbers, zero at the
/// start, in the state of the node, so that the engine resets, saves and restores it. The state begins with the output.
///
/// ```
/// use symbolt::sim::{Filter, Synapse, Timebase};
/// let filter = Filter::new(Synapse::lowpass_ms(5), Timebase::default())?;
/// let mut state = vec![0.0; filter.state_len(2)];
/// let filtered = filter.step(&[1.0, 2.0], &mut state);
/// assert!((filtered[0] - 0.181269).abs() < 1e-6 && (filtered[1] - 0.362538).abs() < 1e-6);
/// # Ok::<(), symbolt::sim::SynapseError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Filter {
    rule: Rule,
}

#[derive(Debug, Clone)]
enum Rule {
    Gain(Real),
    Lowpass(Real),
    Linear(Box<StateSpace>),
    /// The last so many inputs in a ring, behind the place of the next one.
    Delay(usize),
    Triangle(usize),
}

/// A filter that copies.
impl Default for Filter {
    fn default() -> Self {
        Self { rule: Rule::Gain(1.0) }
    }
}

impl Filter {
    /// Makes a synapse discrete. [`Synapse::None`] becomes a filter that copies.
    ///
    /// # Errors
    /// [`SynapseError`] if a time is zero or too long, a delay is not a whole number of ticks, or a linear filter has no
    /// realisation.
    pub fn new(synapse: Synapse, time: Timebase) -> Result<Self, SynapseError> {
        let first = |tau: SimDuration| [tau.as_secs_f64(), 1.0];
        let rule = match synapse {
            Synapse::None => Rule::Gain(1.0),
            Synapse::Lowpass { tau } => Rule::Lowpass(lowpass_decay(positive(tau)?, time.dt_s())),
            Synapse::Alpha { tau } => series(first(positive(tau)?), first(tau), time)?,
            Synapse::DoubleExponential { rise, decay } => {
                series(first(positive(rise)?), first(positive(decay)?), time)?
            }
            Synapse::Triangle { length } => {
                let (length, tick) = (positive(length)?.as_micros(), time.tick().as_micros());
                // The nearest whole number, of two the even one.
                let (whole, rest) = (length / tick, length % tick);
                let up = rest * 2 > tick || (rest * 2 == tick && whole % 2 == 1);
                Rule::Triangle(1 + few(whole + u64::from(up))?)
            }
            Synapse::Delay { length } => Rule::Delay(few(time.ticks(positive(length)?)?)?),
            Synapse::Linear(filter) => linear(&filter, time)?,
        };
        Ok(Self { rule })
    }

    /// Makes the synapse of a connection discrete. The connection adds a tick, which is part of a delay.
    pub(crate) fn of_connection(synapse: Synapse, time: Timebase) -> Result<Self, SynapseError> {
        let whole = Self::new(synapse, time)?;
        Ok(match whole.rule {
            Rule::Delay(1) => Self { rule: Rule::Gain(1.0) },
            Rule::Delay(ticks) => Self { rule: Rule::Delay(ticks - 1) },
            _ => whole,
        })
    }

    /// Returns the number of state values for signals of `width` components.
    pub fn state_len(&self, width: usize) -> usize {
        width
            + match &self.rule {
                Rule::Gain(_) | Rule::Lowpass(_) => 0,
                Rule::Linear(system) => 2 * system.input.len() * width,
                Rule::Delay(ticks) | Rule::Triangle(ticks) => 1 + ticks * width,
            }
    }

    /// Advances the filter by one tick and returns its output, which includes the input of this tick. The output stays at
    /// the start of `state`. Does not allocate.
    ///
    /// # Panics
    /// If `state` does not hold [`state_len`](Self::state_len) values for the width of `input`.
    #[inline]
    pub fn step<'s>(&self, input: &[Real], state: &'s mut [Real]) -> &'s [Real] {
        let (output, rest) = state.split_at_mut(input.len());
        match &self.rule {
            Rule::Lowpass(decay) => latch(*decay, input, output),
            rule => rule.step(input, output, rest),
        }
        output
    }

    /// Returns the decay factor of a low-pass.
    pub(crate) fn decay(&self) -> Option<Real> {
        if let Rule::Lowpass(decay) = self.rule { Some(decay) } else { None }
    }

    /// Returns whether finite inputs have finite outputs.
    pub(crate) fn is_bounded(&self) -> bool {
        !matches!(self.rule, Rule::Gain(_) | Rule::Linear(_))
    }
}

impl Rule {
    /// Steps any filter but a low-pass.
    #[inline(never)]
    fn step(&self, input: &[Real], output: &mut [Real], rest: &mut [Real]) {
        match self {
            Self::Lowpass(decay) => latch(*decay, input, output),
            Self::Gain(gain) => output.iter_mut().zip(input).for_each(|(y, u)| *y = gain * u),
            Self::Linear(system) => system.step(input, output, rest),
            Self::Delay(ticks) | Self::Triangle(ticks) => {
                let (next, ring) = rest.split_at_mut(1);
                let at = next[0] as usize;
                let row = at * input.len()..(at + 1) * input.len();
                next[0] = ((at + 1) % ticks) as Real;
                if matches!(self, Self::Delay(_)) {
                    output.copy_from_slice(&ring[row.clone()]);
                }
                ring[row].iter_mut().zip(input).for_each(|(kept, u)| *kept = settled(*u));
                if matches!(self, Self::Triangle(_)) {
                    triangle(ring, (at, *ticks), output);
                }
            }
        }
    }
}

/// Sums a ring of inputs with the weights of a triangle. The newest lies at `at`.
fn triangle(ring: &[Real], (at, ticks): (usize, usize), output: &mut [Real]) {
    const BLOCK: usize = 16;
    let width = output.len();
    let unit = 2.0 / (ticks as f64 * (ticks + 1) as f64);
    for (block, output) in output.chunks_mut(BLOCK).enumerate() {
        let mut sums = [0.0f64; BLOCK];
        for age in 0..ticks {
            let row = (at + ticks - age) % ticks;
            let first = row * width + block * BLOCK;
            let weight = (ticks - age) as f64;
            for (sum, u) in sums.iter_mut().zip(&ring[first..first + output.len()]) {
                *sum += weight * f64::from(*u);
            }
        }
        output.iter_mut().zip(sums).for_each(|(y, sum)| *y = settled((unit * sum) as Real));
    }
}

/// A linear filter in state space: `x' = A x + B u`. The output is `C x'`, or `C x + D u` with a direct term.
#[derive(Debug, Clone)]
struct StateSpace {
    /// A, row by row.
    transition: Vec<f64>,
    /// B.
    input: Vec<f64>,
    /// C.
    output: Vec<f64>,
    /// D.
    direct: f64,
}

impl StateSpace {
    /// Steps each component. A number of the state is kept as two single ones, its rounded value and the rest.
    fn step(&self, input: &[Real], output: &mut [Real], state: &mut [Real]) {
        let order = self.input.len();
        let (mut x, mut next) = ([0.0f64; MAX_ORDER], [0.0f64; MAX_ORDER]);
        let (x, next) = (&mut x[..order], &mut next[..order]);
        for ((u, y), pairs) in input.iter().zip(output).zip(state.chunks_exact_mut(2 * order)) {
            let u = f64::from(*u);
            for (x, pair) in x.iter_mut().zip(pairs.chunks_exact(2)) {
                *x = f64::from(pair[0]) + f64::from(pair[1]);
            }
            let rows = self.transition.chunks_exact(order).zip(&self.input);
            for (next, (row, b)) in next.iter_mut().zip(rows) {
                *next = row.iter().zip(&*x).map(|(a, x)| a * x).sum::<f64>() + b * u;
            }
            let of = if self.direct == 0.0 { &*next } else { &*x };
            let sum: f64 = self.output.iter().zip(of).map(|(c, x)| c * x).sum();
            *y = settled((sum + self.direct * u) as Real);
            if next.iter().all(|x| x.abs() < f64::from(NEGLIGIBLE)) {
                next.fill(0.0);
            }
            for (pair, x) in pairs.chunks_exact_mut(2).zip(&*next) {
                let whole = *x as Real;
                // Neither number of a pair is ever subnormal.
                let rest = whole.abs() >= NEGLIGIBLE;
                pair[0] = if whole.abs() < TINY { 0.0 } else { whole };
                pair[1] = if rest { (x - f64::from(whole)) as Real } else { 0.0 };
            }
        }
    }
}

/// Two first-order low-passes in series, each `a s + b`.
fn series([a, b]: [f64; 2], [c, d]: [f64; 2], time: Timebase) -> Result<Rule, SynapseError> {
    state_space(&[1.0], &[b * d, a * d + b * c, a * c], time)
}

fn linear(filter: &LinearFilter, time: Timebase) -> Result<Rule, SynapseError> {
    let LinearFilter { numerator, denominator } = filter;
    let order = denominator.len.max(numerator.len).saturating_sub(1);
    if order > MAX_ORDER {
        return Err(SynapseError::Order { order, most: MAX_ORDER });
    }
    let (above, below) = (numerator.ascending(), denominator.ascending());
    if above.iter().chain(below).any(|c| !c.is_finite()) {
        return Err(SynapseError::NotFinite);
    }
    match (above.len(), below.len()) {
        (0, _) => Err(SynapseError::Zero { what: "numerator" }),
        (_, 0) => Err(SynapseError::Zero { what: "denominator" }),
        (a, b) if a > b => Err(SynapseError::Improper { numerator: a - 1, denominator: b - 1 }),
        (1, 1) => {
            let gain = (above[0] / below[0]) as Real;
            if gain.is_finite() { Ok(Rule::Gain(gain)) } else { Err(SynapseError::NotFinite) }
        }
        _ => state_space(above, below, time),
    }
}

/// Greatest number of a matrix whose exponential is computed.
const MOST_EXPONENT: f64 = 1e20;

/// Makes `above / below` discrete, both with the lowest power first, for an input that is constant during a tick.
///
/// Time is counted in units in which no coefficient of the monic denominator is above 1, so that the numbers of the
/// state, a chain of integrals, are of one size whatever the time constants. The exponential of the matrix
/// `[A B; 0 0]` holds both matrices of the discrete system (Van Loan 1978).
fn state_space(above: &[f64], below: &[f64], time: Timebase) -> Result<Rule, SynapseError> {
    let order = below.len() - 1;
    let monic = |c: &[f64], k: usize, unit: f64| {
        let power = unit.powi((order - k) as i32);
        c.get(k).map_or(0.0, |c| c / below[order] * power)
    };
    let dt = time.dt_s();
    let speed = |k: usize| monic(below, k, dt).abs().powf(1.0 / (order - k) as f64);
    let fastest = (0..order).map(speed).fold(0.0, f64::max);
    // One tick in the new unit. A chain of integrators alone has none.
    let tick = if fastest > 0.0 { fastest } else { 1.0 };
    let unit = dt / tick;
    let direct = monic(above, order, unit);
    let mut both = DMatrix::<f64>::zeros(order + 1, order + 1);
    for k in 0..order {
        both[(k, k + 1)] = tick;
    }
    for k in 0..order {
        both[(order - 1, k)] -= tick * monic(below, k, unit);
    }
    // Powers of a matrix of greater numbers are not finite, and its exponential would never be done.
    if !both.iter().all(|value| value.abs() <= MOST_EXPONENT) {
        return Err(SynapseError::NotFinite);
    }
    let both = both.exp();
    let system = StateSpace {
        transition: (0..order * order).map(|at| both[(at / order, at % order)]).collect(),
        input: (0..order).map(|row| both[(row, order)]).collect(),
        output: (0..order)
            .map(|k| monic(above, k, unit) - direct * monic(below, k, unit))
            .collect(),
        direct,
    };
    let numbers = system.transition.iter().chain(&system.input).chain(&system.output);
    let finite = numbers.chain([&system.direct]).all(|value| value.is_finite());
    if finite { Ok(Rule::Linear(Box::new(system))) } else { Err(SynapseError::NotFinite) }
}

fn positive(length: SimDuration) -> Result<SimDuration, SynapseError> {
    if length.is_zero() { Err(SynapseError::ZeroTime) } else { Ok(length) }
}

fn few(ticks: u64) -> Result<usize, SynapseError> {
    match ticks <= MAX_TICKS {
        true => Ok(ticks as usize),
        false => Err(SynapseError::TooLong { ticks, most: MAX_TICKS }),
    }
}

/// Returns the decay factor of a low-pass with time constant `tau` for a tick of `dt_s` seconds.
pub(crate) fn lowpass_decay(tau: SimDuration, dt_s: f64) -> Real {
    (-dt_s / tau.as_secs_f64()).exp() as Real
}

/// Filters set magnitudes below this bound to zero. It is 2^-63, the square root of the smallest normal number.
///
/// Without the bound, a filter without input would decay to a subnormal number and stay there, because rounding undoes
/// the last steps. Computing with subnormal numbers is much slower on many processors. Above the bound, even the
/// product of two filtered values is a normal number. The bound is 12 orders of magnitude below the rounding error of
/// a signal of order 1.
const NEGLIGIBLE: Real = 1.0 / (1u64 << 63) as Real;

/// Numbers of a state below this bound, 2^-100, are zero. Smaller ones than [`NEGLIGIBLE`] matter while others are larger.
const TINY: Real = NEGLIGIBLE / (1u64 << 37) as Real;

/// Returns a value, or zero if its magnitude is below 2^-63 (about 1.1e-19). Infinite values and values that are not a
/// number pass through.
#[inline]
fn settled(value: Real) -> Real {
    if value.abs() < NEGLIGIBLE { 0.0 } else { value }
}

/// Returns the next value of a first-order low-pass, `a y + (1 - a) u`, or zero if it is negligible.
#[inline]
pub(crate) fn decayed(decay: Real, y: Real, u: Real) -> Real {
    settled(decay * y + (1.0 - decay) * u)
}

/// Advances the low-pass filters in `held` by one step.
#[inline]
pub(crate) fn latch(decay: Real, input: &[Real], held: &mut [Real]) {
    for (y, u) in held.iter_mut().zip(input) {
        *y = decayed(decay, *y, *u);
    }
}
