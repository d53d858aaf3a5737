//! A node of one's own, a world of one's own, and a loop through both.
//!
//! `cargo run --example custom_node`

use std::error::Error;
use std::sync::Arc;

use symbolt::prelude::*;
use symbolt::sim::{
    AdvanceIo, InputSpec, Node, NodeFault, OutputSpec, PortDecl, Real, Scalar, StateSpec, StepCx,
    World, WorldError, WorldLink, WorldSave,
};

/// A proportional-integral controller. It remembers one number, so it declares one.
struct Controller {
    setpoint: Real,
}

impl Node for Controller {
    fn declare(&self, ports: &mut PortDecl) {
        ports
            .input("measured", InputSpec::scalar().at_advance())
            .output("power", OutputSpec::scalar().registered())
            .state(StateSpec { reals: 1, ..StateSpec::default() });
    }

    fn advance(&self, cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let error = self.setpoint - io.inputs.scalar(0);
        let sum: &mut Real = &mut io.state.reals[0];
        *sum += error * cx.dt_s() as Real;
        io.outputs.set(0, 5.0 * error + 4.0 * *sum);
        Ok(())
    }
}

/// Water that is heated and cools, one step every 10 ms.
struct Kettle(Real);

impl World for Kettle {
    fn period(&self) -> SimDuration {
        SimDuration::from_millis(10)
    }
    fn sense_width(&self) -> usize {
        1
    }
    fn command_width(&self) -> usize {
        1
    }
    fn sense(&self, out: &mut [Real]) {
        out[0] = self.0;
    }
    fn advance(&mut self, command: &[Real]) -> Result<(), WorldError> {
        self.0 += 0.01 * (command[0] - 0.5 * (self.0 - 20.0));
        Ok(())
    }
    fn reset(&mut self, _seed: Seed) -> Result<(), WorldError> {
        self.0 = 20.0;
        Ok(())
    }
    fn save(&self) -> WorldSave {
        WorldSave(self.0.to_le_bytes().to_vec())
    }
    fn restore(&mut self, saved: &WorldSave) -> Result<(), WorldError> {
        let bytes = saved.0.as_slice().try_into();
        self.0 = Real::from_le_bytes(bytes.map_err(|_| WorldError::new("not a kettle's save"))?);
        Ok(())
    }
}

/// The water's temperature after 20 simulated seconds.
pub fn run() -> Result<Real, Box<dyn Error>> {
    let mut graph = GraphBuilder::new();
    let link = WorldLink::new();
    let link = link.sense("celsius", OutputSpec::scalar()).command("power", InputSpec::scalar());
    let kettle = graph.world("kettle", link);
    let controller = graph.node("controller", Controller { setpoint: 80.0 });
    let celsius = kettle.output::<Scalar>("celsius");
    graph.connect(&celsius, &controller.input("measured"), Synapse::lowpass_ms(20));
    graph.connect(&controller.output::<Scalar>("power"), &kettle.input("power"), Synapse::None);

    let graph = graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1))?;
    let config = RunConfig::default().in_world(Kettle(20.0));
    let mut sim = Simulator::new(Arc::new(graph), config)?;
    sim.run_for(SimDuration::from_millis(20_000))?;
    Ok(sim.value(&celsius)[0])
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    println!("After 20 simulated seconds the water is at {:.1} degrees.", run()?);
    Ok(())
}
