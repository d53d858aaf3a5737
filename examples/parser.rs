//! Reads written commands, word by word and in any order, and executes them: after WRITE and ONE the hand writes ONE.
//!
//! `cargo run --example parser`

use std::error::Error;

use symbolt::prelude::*;

symbolt::vocabulary!(Words = "words": WRITE, SAY, ONE, TWO, THREE, STOP, VERB, NOUN);

/// Returns the similarities of the hand with the numbers. Two commands are shown, WRITE ONE and THREE WRITE, and a third
/// that is not for the hand: SAY TWO. Each word lasts 150 ms.
///
/// The memories store what was seen about 40 ms ago, because the gates close some time after the next word has
/// appeared. They are open from 1 on; in neurons a chosen rule may have an activity of only 0.9.
pub fn run(plan: &PopulationPlan, seed: Seed) -> Result<TimeSeries, Box<dyn Error>> {
    let words = Words::vocabulary(256, seed)?;
    let mut graph = GraphBuilder::new();
    let text = ["WRITE", "ONE", "STOP", "THREE", "WRITE", "STOP", "SAY", "TWO", "STOP"];
    let text = (0..).step_by(150).zip(text);
    let vision = graph.add("vision", words.stimulus(text)?);
    let seen = graph.add("seen", State::new(&words).synapse(Synapse::lowpass_ms(40)));
    let [verb, noun] = ["verb", "noun"].map(|name| graph.add(name, GoalBuffer::new(&words)));
    let [phrase, hand] = ["phrase", "hand"].map(|name| graph.add(name, State::new(&words)));
    graph.route(&vision >> &seen);
    graph.route(&seen >> &verb);
    graph.route(&seen >> &noun);
    graph.route(&verb * Words::VERB + &noun * Words::NOUN >> &phrase);
    let number = vision.dot(Words::ONE + Words::TWO + Words::THREE);
    let write = 0.5 * vision.dot(Words::STOP) + 0.6 * phrase.dot(Words::WRITE * Words::VERB);
    let rules = Rules::new()
        .rule("see_verb", vision.dot(Words::WRITE + Words::SAY), [2.0 >> &verb.open])
        .rule("see_noun", number, [2.0 >> &noun.open])
        .rule("write", write, [&phrase * !Words::NOUN >> &hand])
        .otherwise("wait", 0.65, []);
    graph.add("rules", rules);
    let probe = graph.probe(&hand.output, ProbeSpec::default());
    let sim = graph.run(plan, seed, SimDuration::from_millis(1350))?;
    Ok(words.similarities(sim.samples(&probe), ["ONE", "TWO", "THREE"])?)
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    println!("{}", run(&PopulationPlan::direct(), Seed::new(1))?);
    Ok(())
}
