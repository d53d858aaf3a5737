//! Learns from demonstrations with failed attempts and lost parts, then classifies the objects of a new scene.
//!
//! `cargo run --example learn_recording`

use std::error::Error;

use symbolt::prelude::*;
use symbolt::task::learn::{Learned, Settings};
use symbolt::task::tasks::nuts_and_bolts::SyntheticDemonstrations;

/// The id and the state of each object; `None` for an object in no state.
pub type Seen = Vec<(String, Option<String>)>;

/// Returns the learned domain with its report, and the state of each part in a new scene.
pub fn run() -> Result<(Learned, Seen), Box<dyn Error>> {
    let synthetic = SyntheticDemonstrations {
        demos: 7,
        nuts: 3,
        bolts: 3,
        fail_rate: 0.2,
        ..SyntheticDemonstrations::default()
    };
    let recording = synthetic.record(Seed::new(1))?.recording;
    let learned = learn(&recording, &Settings::paper())?;

    let layout = Classifier::new(&learned.domain).classify(&synthetic.scene(Seed::new(2))?);
    let mut seen = Vec::new();
    for (object, located) in layout.objects.iter().zip(&layout.located) {
        let name = located.fact.map(|fact| learned.domain.states[fact.state].name.clone());
        seen.push((object.id.to_string(), name));
    }
    Ok((learned, seen))
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    let (Learned { domain, report, .. }, seen) = run()?;
    println!("{} of {} attempts failed", report.failed(), report.attempts.len());
    for operator in &domain.operators {
        let from = domain.names(&operator.from).join(" or ");
        let needs = operator.needs.iter().map(|need| domain.need_in_words(operator, need));
        let needs: Vec<String> = [from].into_iter().chain(needs).collect();
        println!("{:<24} needs {}", operator.name, needs.join(" and "));
    }
    for (id, state) in seen {
        println!("{id:<12} {}", state.as_deref().unwrap_or("in no state"));
    }
    Ok(())
}
