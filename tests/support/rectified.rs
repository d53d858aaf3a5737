//! A neuron model that the crate does not know: its rate is its current above 0, and it spikes at that rate (Voelker et
//! al. 2020).

use symbolt::neurons::{Block, Firing, NeuronModel, Start, TuningError, Variable};
use symbolt::sim::Fingerprint;

/// Rectified linear neurons.
#[derive(Debug)]
pub struct Rectified;

impl NeuronModel for Rectified {
    fn name(&self) -> &'static str {
        "rectified"
    }

    fn check(&self, _dt_s: f64) -> Result<(), TuningError> {
        Ok(())
    }

    fn gain_bias(&self, max_rate: f64, intercept: f64) -> Result<(f64, f64), TuningError> {
        let gain = max_rate / (1.0 - intercept);
        Ok((gain, -gain * intercept))
    }

    fn rates(&self, currents: &mut [f64]) {
        currents.iter_mut().for_each(|current| *current = current.max(0.0));
    }

    fn firing(&self) -> Firing {
        Firing::Spikes { trace: 1, above: 0.0 }
    }

    fn state(&self) -> Vec<Variable> {
        let due = Variable { name: "spikes due", start: Start::Between(0.0, 1.0) };
        vec![due, Variable { name: "spikes of the tick", start: Start::At(0.0) }]
    }

    fn step(&self, block: Block<'_>) {
        let (due, fired) = block.state.split_at_mut(block.currents.len());
        for (i, current) in block.currents.iter().enumerate() {
            due[i] += current.max(0.0) * block.dt_s;
            fired[i] = due[i].floor();
            due[i] -= fired[i];
            block.activity[i] = fired[i];
        }
    }

    fn rest_below(&self) -> f64 {
        0.0
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text(self.name());
    }
}
