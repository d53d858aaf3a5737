//! A channel that learns from its error: weights from neurons to a value, changed by PES.
//!
//! `cargo run --example learned_channel`

use std::error::Error;

use symbolt::prelude::*;
use symbolt::sim::Signal;

/// Returns the root mean square error of the channel in the first and in the last of three seconds.
pub fn run(plan: &PopulationPlan, seed: Seed) -> Result<[f32; 2], Box<dyn Error>> {
    let mut graph = GraphBuilder::new();
    let given = graph.add("given", Signal::scalar(|t| 0.8 * (2.0 * t).sin() as f32));
    let pre = graph.add("pre", Ensemble::new(1).neurons(100).expose_neurons().identity("x"));
    let post = graph.add("post", Ensemble::new(1).neurons(100).identity("x"));
    let channel = graph.add("channel", Learned::new(&pre.neurons(), 1).rule(Pes::new(1e-3)));
    graph.route(given.embed(0, 1) >> &pre);
    graph.route(&channel >> &post);
    graph.route(&post.output("x") - &pre.output("x") >> &channel.error());
    let spec = ProbeSpec::default().filtered(Synapse::lowpass_ms(20));
    let probes = ["pre.x", "post.x"].map(|name| graph.probe_at::<Vector>(name, spec));
    let sim = graph.run(plan, seed, SimDuration::from_secs(3))?;
    let of =
        |probe| -> Vec<f32> { sim.samples::<Vector>(probe).iter().map(|(_, x)| x[0]).collect() };
    let [pre, post] = probes.each_ref().map(of);
    Ok([0..1000, 2000..3000].map(|span| error(&pre, &post, span)))
}

fn error(a: &[f32], b: &[f32], span: std::ops::Range<usize>) -> f32 {
    let square = |at: usize| (a[at] - b[at]).powi(2);
    (span.clone().map(square).sum::<f32>() / span.len() as f32).sqrt()
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    let spiking = PopulationPlan::lif();
    let [first, last] = run(&spiking, Seed::new(1))?;
    println!("The error falls from {first:.3} in the first second to {last:.3} in the third.");
    Ok(())
}
