//! A two-joint arm: one ensemble decodes where the hand is and how both joints must turn to reach a target.
//!
//! `cargo run --example reaching`

use std::error::Error;

use symbolt::prelude::*;

/// Returns where the hand is after 3 s, in m. Both links are 0.5 m long.
pub fn run(
    plan: &PopulationPlan,
    seed: Seed,
    target: [f32; 2],
) -> Result<[f32; 2], Box<dyn Error>> {
    let hand = |joints: &[f32]| {
        let (shoulder, both) = (joints[0], joints[0] + joints[1]);
        [0.5 * (shoulder.cos() + both.cos()), 0.5 * (shoulder.sin() + both.sin())]
    };
    // The transpose of the Jacobian turns the distance to the target into turns of the joints.
    let turns = move |x: &[f32], out: &mut [f32]| {
        let [reached_x, reached_y] = hand(x);
        let (dx, dy) = (x[2] - reached_x, x[3] - reached_y);
        let (fore_x, fore_y) = (0.5 * (x[0] + x[1]).cos(), 0.5 * (x[0] + x[1]).sin());
        out[0] = x[0] + 0.5 * (dy * reached_x - dx * reached_y);
        out[1] = x[1] + 0.5 * (dy * fore_x - dx * fore_y);
    };
    let mut graph = GraphBuilder::new();
    let arm = Ensemble::new(4).radius(2.5).size(4.0).decode("turned", 2, turns).identity("all");
    let arm = graph.add("arm", arm);
    let start = graph
        .add("start", Stimulus::vector(&[0.3, 1.2]).from(SimDuration::from_millis(150), &[0.0; 2]));
    let target = graph.add("target", Constant::vector(&target));
    let joints = [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0], [0.0, 0.0]];
    let aim = [[0.0, 0.0], [0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
    graph.route(start.transform(joints) >> &arm);
    graph.route(target.transform(aim) >> &arm);
    graph.route((arm.output("turned").transform(joints) >> &arm).via(Synapse::lowpass_ms(100)));
    let probe =
        graph.probe(&arm.output("all"), ProbeSpec::default().filtered(Synapse::lowpass_ms(50)));
    let sim = graph.run(plan, seed, SimDuration::from_millis(3_000))?;
    let (_, joints) = sim.samples(&probe).last().ok_or("no sample")?;
    Ok(hand(joints))
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    let spiking = PopulationPlan::lif();
    let [x, y] = run(&spiking, Seed::new(1), [0.2, 0.7])?;
    println!("The hand is at ({x:.2}, {y:.2}) m; the target is at (0.20, 0.70) m.");
    Ok(())
}
