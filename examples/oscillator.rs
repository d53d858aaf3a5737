//! A controlled oscillator in one ensemble of three dimensions: a point on a circle, and how fast it turns.
//!
//! `cargo run --example oscillator`

use std::error::Error;

use symbolt::prelude::*;
use symbolt::sim::Signal;

/// Returns the number of turns from 0.2 s to 1 s, and from 1 s to 2 s. The speed doubles after one second.
pub fn run(plan: &PopulationPlan, seed: Seed) -> Result<[usize; 2], Box<dyn Error>> {
    let mut graph = GraphBuilder::new();
    // Through a synapse of 0.1 s, a decoded x + 0.1 dx/dt makes the point move with the speed dx/dt.
    let turn = |x: &[f32], out: &mut [f32]| {
        let (speed, inward) = (2.0 * x[2], 1.0 - x[0] * x[0] - x[1] * x[1]);
        out[0] = x[0] + inward * x[0] - speed * x[1];
        out[1] = x[1] + inward * x[1] + speed * x[0];
    };
    let ensemble = Ensemble::new(3).radius(1.6).size(3.0).decode("turned", 2, turn).identity("all");
    let point = graph.add("point", ensemble);
    let kick = graph.add("kick", Signal::scalar(|t| if t < 0.1 { 1.0 } else { 0.0 }));
    let speed = graph.add("speed", Signal::scalar(|t| if t < 1.0 { 0.5 } else { 1.0 }));
    graph.route(kick.transform([[1.0], [0.0], [0.0]]) >> &point);
    graph.route(speed.transform([[0.0], [0.0], [1.0]]) >> &point);
    let turned = point.output("turned").transform([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]]);
    graph.route((turned >> &point).via(Synapse::lowpass_ms(100)));
    let probe =
        graph.probe(&point.output("all"), ProbeSpec::default().filtered(Synapse::lowpass_ms(20)));
    let sim = graph.run(plan, seed, SimDuration::from_millis(2_000))?;
    let y: Vec<f32> = sim.samples(&probe).iter().map(|(_, point)| point[1]).collect();
    let turns = |y: &[f32]| y.windows(2).filter(|pair| pair[0] < 0.0 && pair[1] >= 0.0).count();
    Ok([turns(&y[200..1_000]), turns(&y[1_000..])])
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    let spiking = PopulationPlan::lif();
    let [first, second] = run(&spiking, Seed::new(1))?;
    println!("{first} turns from 0.2 s to 1 s, {second} from 1 s to 2 s.");
    Ok(())
}
