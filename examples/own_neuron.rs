//! Your own neuron model: quadratic integrate-and-fire, in an ensemble that squares a number.
//!
//! `cargo run --example own_neuron`

use std::error::Error;

use symbolt::neurons::{Block, BuiltLayer, Ensemble, Firing, NeuronModel, Start, Variable};
use symbolt::prelude::*;
use symbolt::sim::{Fingerprint, Real};

/// Time constant, in seconds.
const TAU_S: f64 = 0.01;

/// A quadratic integrate-and-fire neuron (Latham et al. 2000): `tau v' = v^2 + J` from -10 up to 10.
#[derive(Debug)]
struct Quadratic;

impl NeuronModel for Quadratic {
    fn name(&self) -> &'static str {
        "quadratic"
    }
    /// The time from -10 to 10 has a closed form. Gain and bias are found by search.
    fn rates(&self, currents: &mut [f64]) {
        for current in currents {
            let root = current.max(1e-9).sqrt();
            let rate = root / (2.0 * TAU_S * (10.0 / root).atan());
            *current = if *current > 0.0 { rate } else { 0.0 };
        }
    }
    fn firing(&self) -> Firing {
        Firing::Spikes { trace: 1, above: 0.0 }
    }
    fn state(&self) -> Vec<Variable> {
        let voltages = Variable { name: "voltages", start: Start::Between(-1.0, 1.0) };
        vec![voltages, Variable { name: "spikes of the tick", start: Start::At(0.0) }]
    }
    fn step(&self, block: Block<'_>) {
        let (v, fired) = block.state.split_at_mut(block.currents.len());
        for (i, current) in block.currents.iter().enumerate() {
            // Twenty steps of Euler in a tick, since the voltage grows fast near the end.
            let (share, mut spikes) = (block.dt_s / TAU_S as Real / 20.0, 0.0);
            for _ in 0..20 {
                v[i] += (v[i] * v[i] + current) * share;
                (v[i], spikes) = if v[i] > 10.0 { (-10.0, spikes + 1.0) } else { (v[i], spikes) };
            }
            (fired[i], block.activity[i]) = (spikes, spikes);
        }
    }
    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text(self.name());
    }
}

/// Returns the square of 0.8 as spiking neurons decode it, and the decoding error of their rates.
pub fn run() -> Result<(Real, f64), Box<dyn Error>> {
    let mut graph = GraphBuilder::new();
    let given = graph.add("given", Constant::vector(&[0.8]));
    let square = Ensemble::new(1).decode("square", 1, |x, out| out[0] = x[0] * x[0]);
    let a = graph.add("a", square.model(Quadratic));
    graph.route(&given >> &a.input);
    let spec = ProbeSpec::default().filtered(Synapse::lowpass_ms(50));
    let probe = graph.probe(&a.output("square"), spec);
    let plan = PopulationPlan::lif();
    let sim = graph.run(&plan, Seed::new(1), SimDuration::from_millis(500))?;
    let error = BuiltLayer::of(sim.graph(), "a")?.ensemble(0)?.error("square")?;
    let (_, last) = sim.samples(&probe).last().ok_or("no samples")?;
    Ok((last[0], error))
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    let (square, error) = run()?;
    println!(
        "The square of 0.8 is {square:.3} in spikes; rates decode it with an error of {error:.4}."
    );
    Ok(())
}
