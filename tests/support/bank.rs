//! A minimal bank of LIF neurons in a single [`Node`].
//!
//! Neuron `i` gets a current of `1 + drive * (1 + 0.02 (i mod 97))`. The membrane time constant is 20 ms, the
//! refractory period 2 ms. The refractory period begins at the moment within the step at which the membrane crosses
//! the threshold. The output is the number of spikes in the tick.

use multiversion::multiversion;
use symbolt::sim::{
    AdvanceIo, Fingerprint, InputSpec, Node, NodeFault, OutputSpec, PortDecl, StateSpec, StepCx,
};

pub struct Bank {
    neurons: usize,
    /// One period of the gains, sixteen per row.
    gains: Vec<[f32; 16]>,
}

const TAU_S: f64 = 0.02;
const REFRACTORY_S: f64 = 0.002;

fn gain(neuron: usize) -> f32 {
    1.0 + 0.02 * (neuron % 97) as f32
}

impl Bank {
    pub fn new(neurons: usize) -> Self {
        assert!(neurons.is_multiple_of(16), "the loop takes sixteen at a time");
        let gains = (0..97).map(|row| std::array::from_fn(|lane| gain(16 * row + lane))).collect();
        Self { neurons, gains }
    }
}

/// Returns the bank's mean firing rate in Hz, from the closed form.
#[allow(dead_code)]
pub fn mean_rate_hz(neurons: usize, drive: f64) -> f64 {
    let rate = |i: usize| {
        let current = 1.0 + drive * f64::from(gain(i));
        1.0 / (REFRACTORY_S + TAU_S * (current / (current - 1.0)).ln())
    };
    (0..neurons).map(rate).sum::<f64>() / neurons as f64
}

impl Node for Bank {
    fn declare(&self, ports: &mut PortDecl) {
        ports
            .input("drive", InputSpec::scalar().at_advance())
            .output("spikes", OutputSpec::scalar().registered())
            // Voltages, then the remaining refractory times.
            .state(StateSpec { reals: 2 * self.neurons, ..StateSpec::default() });
    }

    fn fingerprint(&self, _hash: &mut Fingerprint) {}

    fn advance(&self, cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let drive = io.inputs.scalar(0);
        let (voltage, rest) = io.state.reals.split_at_mut(self.neurons);
        let spikes = step(&self.gains, drive, cx.dt_s() as f32, voltage, rest);
        io.outputs.set(0, spikes);
        Ok(())
    }
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1"))]
fn step(gains: &[[f32; 16]], drive: f32, dt: f32, voltage: &mut [f32], rest: &mut [f32]) -> f32 {
    let decay = -(-dt / TAU_S as f32).exp_m1();
    let (refractory, per_dt) = (REFRACTORY_S as f32, 1.0 / dt);
    // An integer count, because a conditional float sum compiles to a masked store, which is four times slower
    // than the rest of the loop.
    let mut spikes = [0u32; 16];
    let (voltage, _) = voltage.as_chunks_mut::<16>();
    let (rest, _) = rest.as_chunks_mut::<16>();
    for (voltage, rest) in voltage.chunks_mut(gains.len()).zip(rest.chunks_mut(gains.len())) {
        for ((gain, v), r) in gains.iter().zip(voltage).zip(rest) {
            for lane in 0..16 {
                let current = 1.0 + drive * gain[lane];
                // Fraction of the step in which the neuron is not refractory.
                let open = (1.0 - r[lane] * per_dt).clamp(0.0, 1.0);
                let rise = (current - v[lane]) * decay * open;
                let next = v[lane] + rise;
                let spiked = next > 1.0;
                // Time since the threshold was crossed, by linear interpolation.
                let over = dt * open * (next - 1.0) / rise.max(1e-9);
                spikes[lane] += u32::from(spiked);
                r[lane] = if spiked { refractory - over } else { (r[lane] - dt).max(0.0) };
                v[lane] = if spiked { 0.0 } else { next };
            }
        }
    }
    spikes.iter().sum::<u32>() as f32
}
