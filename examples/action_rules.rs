//! Reads a command word by word: rules route each word to the verb or the noun.
//!
//! `cargo run --example action_rules`

use std::error::Error;

use symbolt::prelude::*;

symbolt::vocabulary!(Words = "words": WRITE, SAY, ONE, TWO, VERB, NOUN);

/// Shows WRITE for 150 ms, then ONE for 150 ms. Returns the similarity of the phrase in memory, 100 ms later, with the
/// expected phrase and with the phrase in which verb and noun are exchanged.
pub fn run() -> Result<[f32; 2], Box<dyn Error>> {
    let words = Words::vocabulary(256, Seed::new(1))?;
    let (write, one) = (words.get("WRITE")?, words.get("ONE")?);
    let ms = SimDuration::from_millis;
    let shown = Stimulus::pointer(words.space(), &write).from(ms(150), &one).silent_from(ms(300));
    let keep = || State::new(&words).recurrent(Synapse::lowpass_ms(100));

    let mut graph = GraphBuilder::new();
    let vision = graph.add("vision", shown);
    let [verb, noun] = ["verb", "noun"].map(|name| graph.add(name, keep()));
    let phrase = graph.add("phrase", State::new(&words));
    let rules = Rules::new()
        .rule("see_verb", vision.dot(Words::WRITE + Words::SAY), [&vision >> &verb])
        .rule("see_noun", vision.dot(Words::ONE + Words::TWO), [&vision >> &noun])
        .otherwise("wait", 0.4, []);
    graph.add("rules", rules);
    graph.route(&verb * Words::VERB + &noun * Words::NOUN >> &phrase);

    let mut sim = graph.start(&PopulationPlan::direct(), Seed::new(1))?;
    sim.run_for(ms(400))?;
    let phrase = sim.value(&phrase.output);
    let compare =
        |text: &str| -> Result<f32, Box<dyn Error>> { Ok(cosine(&phrase, &words.parse(text)?)) };
    Ok([compare("WRITE * VERB + ONE * NOUN")?, compare("ONE * VERB + WRITE * NOUN")?])
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    let [expected, exchanged] = run()?;
    println!("Similarity with WRITE ONE: {expected:.2}; with ONE WRITE: {exchanged:.2}.");
    Ok(())
}
