//! Five states that follow each other through basal ganglia and thalamus.
//!
//! `cargo run --example cycle`

use std::error::Error;

use symbolt::prelude::*;

symbolt::vocabulary!(States = "states": A, B, C, D, E);

/// Returns the similarities of the state with all names over 500 ms.
pub fn run(plan: &PopulationPlan, seed: Seed) -> Result<TimeSeries, Box<dyn Error>> {
    let states = States::vocabulary(128, seed)?;
    let mut graph = GraphBuilder::new();
    let state = graph.add("state", State::new(&states));
    let start = graph.add("start", states.stimulus([(0, "A"), (40, "0")])?);
    graph.route(&start >> &state);
    let rules = Rules::new()
        .rule("a_to_b", state.dot(States::A), [States::B >> &state])
        .rule("b_to_c", state.dot(States::B), [States::C >> &state])
        .rule("c_to_d", state.dot(States::C), [States::D >> &state])
        .rule("d_to_e", state.dot(States::D), [States::E >> &state])
        .rule("e_to_a", state.dot(States::E), [States::A >> &state]);
    graph.add("rules", rules);
    let probe = graph.probe(&state.output, ProbeSpec::default());
    let sim = graph.run(plan, seed, SimDuration::from_millis(500))?;
    Ok(states.similarities(sim.samples(&probe), States::NAMES)?)
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    for (time_s, state) in run(&PopulationPlan::direct(), Seed::new(1))?.switches(0.3) {
        println!("{state} from {:.0} ms on", 1e3 * time_s);
    }
    Ok(())
}
