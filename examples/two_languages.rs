//! Translates a sentence into another vocabulary, role by role.
//!
//! `cargo run --example two_languages`

use std::error::Error;

use symbolt::prelude::*;

symbolt::vocabulary!(Scene = "scene": AGENT, OBJECT, DOG, CAT, MOUSE);
symbolt::vocabulary!(Speech = "speech": DOG, CAT, MOUSE);

/// Returns what is said about the agent and the object of "the cat sees the mouse".
pub fn run(plan: &PopulationPlan, seed: Seed) -> Result<[String; 2], Box<dyn Error>> {
    let (scene, speech) = (Scene::vocabulary(256, seed)?, Speech::vocabulary(128, seed)?);
    let mut graph = GraphBuilder::new();
    let seen = graph.add("seen", scene.stimulus([(0, "AGENT * CAT + OBJECT * MOUSE")])?);
    let said = ["agent", "object"].map(|name| graph.add(name, State::new(&speech)));
    graph.route((&seen * !Scene::AGENT).translate(&speech) >> &said[0]);
    graph.route((&seen * !Scene::OBJECT).translate(&speech) >> &said[1]);
    let filtered = ProbeSpec::default().filtered(Synapse::lowpass_ms(30));
    let probes = said.each_ref().map(|word| graph.probe(&word.output, filtered));
    let sim = graph.run(plan, seed, SimDuration::from_millis(200))?;
    let word = |probe| sim.samples(probe).last().map(|(_, word)| speech.describe(&word, 0.4));
    let [agent, object] = probes.each_ref().map(|probe| word(probe).unwrap_or_default());
    Ok([agent, object])
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    let [agent, object] = run(&PopulationPlan::direct(), Seed::new(1))?;
    println!("agent: {agent}; object: {object}");
    Ok(())
}
