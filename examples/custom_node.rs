//! Your own node: a controller that remembers a sum, in a loop with the water that it heats.
//!
//! `cargo run --example custom_node`

use std::error::Error;
use std::sync::Arc;

use symbolt::prelude::*;
use symbolt::sim::{
    AdvanceIo, Fingerprint, InputSpec, Node, NodeFault, OutputSpec, PortDecl, Real, StateSpec,
    StepCx,
};

/// A proportional-integral controller.
struct Controller {
    setpoint: Real,
}

impl Node for Controller {
    // The engine resets, saves and restores declared state. A registered output is visible from the next tick on, so it
    // may be part of a loop.
    fn declare(&self, ports: &mut PortDecl) {
        ports
            .input("celsius", InputSpec::scalar().at_advance())
            .output("power", OutputSpec::scalar().registered())
            .state(StateSpec { reals: 1, ..StateSpec::default() });
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.reals(&[self.setpoint]);
    }

    fn advance(&self, cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let error = self.setpoint - io.inputs.scalar(0);
        let sum = &mut io.state.reals[0];
        *sum += error * cx.dt_s() as Real;
        io.outputs.set(0, 10.0 * error + 8.0 * *sum);
        Ok(())
    }
}

/// Returns the water's temperature after 20 simulated seconds, in degrees Celsius.
pub fn run() -> Result<Real, Box<dyn Error>> {
    let mut graph = GraphBuilder::new();
    let controller = graph.node("controller", Controller { setpoint: 80.0 });
    let room = graph.add("room", Constant::scalar(20.0));
    let water = graph.add("water", Add::scalar());
    // The water approaches its final temperature with a time constant of 2 s, as a synapse does.
    let power = controller.output::<Scalar>("power");
    graph.connect(&power, &water.input, Synapse::lowpass_ms(2000));
    graph.connect(&room, &water.input, Synapse::None);
    graph.connect(&water.output, &controller.input("celsius"), Synapse::None);

    let graph = graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1))?;
    let mut sim = Simulator::new(Arc::new(graph), RunConfig::default())?;
    sim.run_for(SimDuration::from_secs(20))?;
    Ok(sim.value(&water.output)[0])
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    println!("After 20 simulated seconds the water is at {:.1} degrees.", run()?);
    Ok(())
}
