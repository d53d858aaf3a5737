//! Neurons whose gains and biases are known.

use symbolt::neurons::{
    Block, Firing, NeuronModel, NeuronSpec, Population, PopulationPlan, Tuning, TuningError,
    Variable,
};
use symbolt::sim::Fingerprint;

/// Neurons of a model that all have one gain and one bias.
#[derive(Debug)]
struct Alike<M> {
    model: M,
    gain: f64,
    bias: f64,
}

impl<M: NeuronModel> NeuronModel for Alike<M> {
    fn name(&self) -> &'static str {
        "alike"
    }
    fn check(&self, dt_s: f64) -> Result<(), TuningError> {
        self.model.check(dt_s)
    }
    fn gain_bias(&self, _max_rate: f64, _intercept: f64) -> Result<(f64, f64), TuningError> {
        Ok((self.gain, self.bias))
    }
    fn rates(&self, currents: &mut [f64]) {
        self.model.rates(currents);
    }
    fn firing(&self) -> Firing {
        self.model.firing()
    }
    fn state(&self) -> Vec<Variable> {
        self.model.state()
    }
    fn step(&self, block: Block<'_>) {
        self.model.step(block);
    }
    fn rest_below(&self) -> f64 {
        self.model.rest_below()
    }
    fn fingerprint(&self, hash: &mut Fingerprint) {
        self.model.fingerprint(hash.text("alike").real(self.gain).real(self.bias));
    }
}

/// Returns a plan of such neurons. Without gain and bias, their current is what is injected.
pub fn alike(model: impl NeuronModel, gain: f64, bias: f64) -> PopulationPlan {
    let spec = NeuronSpec::new(Alike { model, gain, bias }, Tuning::default());
    PopulationPlan::all(Population::Neurons(spec))
}
