//! The program of the guide to expressions and rules, `docs/expressions.md`.

use std::error::Error;

use symbolt::prelude::*;
use symbolt::sim::{Apply, InputSpec, OutputSpec, Signal};
use symbolt::spa::Capacity;

symbolt::vocabulary!(Words = "words": WRITE, SAY, ONE, TWO, VERB, NOUN);

fn words(dimensions: usize) -> Result<Vocabulary<Words>, Box<dyn Error>> {
    Ok(Words::vocabulary(dimensions, Seed::new(1))?)
}

fn what_was_said() -> Result<(), Box<dyn Error>> {
    let words = words(256)?;
    let mut graph = GraphBuilder::new();
    let phrase = graph.add("phrase", State::new(&words));
    let verb = graph.add("verb", State::new(&words));
    graph.route(Words::WRITE * Words::VERB + Words::ONE * Words::NOUN >> &phrase);
    graph.route(&phrase * !Words::VERB >> &verb);

    let mut sim = graph.start(&PopulationPlan::direct(), Seed::new(1))?;
    sim.run_for(SimDuration::from_millis(50))?;
    println!("the verb is {}", words.describe(&sim.value(&verb.output), 0.3));
    Ok(())
}

/// A graph, and the memory of the phrase in it.
type Reader = (GraphBuilder, Out<Pointer<Words>>);

/// Describes a graph that reads a command word by word.
fn reader(words: &Vocabulary<Words>) -> Result<Reader, Box<dyn Error>> {
    let ms = SimDuration::from_millis;
    let shown = Stimulus::pointer(words.space(), &words.get("WRITE")?)
        .from(ms(150), &words.get("ONE")?)
        .silent_from(ms(300));
    let mut graph = GraphBuilder::new();
    let vision = graph.add("vision", shown);
    let memory = || State::new(words).recurrent(Synapse::lowpass_ms(100));
    let verb = graph.add("verb", memory());
    let noun = graph.add("noun", memory());
    let phrase = graph.add("phrase", State::new(words));
    let rules = Rules::new()
        .rule("see_verb", vision.dot(Words::WRITE + Words::SAY), [&vision >> &verb])
        .rule("see_noun", vision.dot(Words::ONE + Words::TWO), [&vision >> &noun])
        .otherwise("wait", 0.4, []);
    graph.add("rules", rules);
    graph.route(&verb * Words::VERB + &noun * Words::NOUN >> &phrase);
    Ok((graph, phrase.output))
}

fn read_a_command() -> Result<(), Box<dyn Error>> {
    let words = words(256)?;
    let (mut graph, phrase) = reader(&words)?;
    let every = ProbeSpec::every(SimDuration::from_millis(50));
    let probe = graph.probe(&phrase, every);
    let mut sim = graph.start(&PopulationPlan::direct(), Seed::new(1))?;
    sim.run_for(SimDuration::from_millis(400))?;
    let similarities = words.similarities(sim.samples(&probe), ["WRITE * VERB", "ONE * NOUN"])?;
    println!("{similarities}");
    Ok(())
}

fn a_gesture() -> Result<(), Box<dyn Error>> {
    let mut graph = GraphBuilder::new();
    let angle = graph.add("angle", Signal::scalar(|t| 3.0 * t as f32));
    let hand = graph.add(
        "hand",
        Apply::new(InputSpec::scalar(), OutputSpec::vector(2), |angle, out| {
            (out[0], out[1]) = (0.9 * angle[0].cos(), 0.9 * angle[0].sin());
        }),
    );
    let seen = Ensemble::new(2).identity("place").function("area", |x| x[0] * x[1]);
    let seen = graph.add("seen", seen);
    let [turned, area] =
        [("turned", 2), ("area", 1)].map(|(name, width)| graph.add(name, Add::vector(width)));
    let left = graph.add("left", Add::scalar());
    graph.route(&angle >> &hand);
    graph.route(&hand >> &seen);
    graph.route(
        (seen.output("place").transform([[0.0, -1.0], [1.0, 0.0]]) >> &turned)
            .via(Synapse::lowpass_ms(20)),
    );
    graph.route((&seen.output("area") >> &area).via(Synapse::lowpass_ms(20)));
    graph.route(-seen.output("place").component(0) >> &left);
    let every = ProbeSpec::every(SimDuration::from_millis(100));
    let probes = ["turned", "area"].map(|name| graph.probe_at::<Vector>(name, every));
    let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), SimDuration::from_millis(300))?;
    let [turned, area] = probes.map(|probe| sim.samples(&probe));
    for ((time_s, turned), (_, area)) in turned.iter().zip(area.iter()) {
        println!("{time_s:.1} s: turned {turned:.2?}, area {area:.2?}");
    }
    Ok(())
}

fn how_many_dimensions() {
    let sum = Capacity { pairs: 2, items: 6, ..Capacity::default() };
    for reliability in [0.99, 0.9999] {
        if let Some(dimensions) = sum.dimensions_for(reliability) {
            println!("{reliability}: {dimensions} dimensions");
        }
    }
}

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    what_was_said()?;
    read_a_command()?;
    a_gesture()?;
    how_many_dimensions();
    Ok(())
}
