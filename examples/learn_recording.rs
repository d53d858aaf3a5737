//! Learns from demonstrations with failed attempts and lost parts, then classifies the objects of a new scene.
//!
//! `cargo run --example learn_recording`

use std::error::Error;

use symbolt::prelude::*;
use symbolt::task::learn::{Learned, Settings, learn};
use symbolt::task::tasks::nuts_and_bolts::SyntheticDemonstrations;
use symbolt::task::{Classifier, Grounding};

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
    let learned = learn(&recording, &Settings::default())?;

    let classifier = Classifier::new(&learned.domain, Grounding::default())?;
    let scene = synthetic.scene(Seed::new(2))?;
    let mut seen = Vec::new();
    for object in &scene.objects {
        let state = classifier.classify(&object.kind, &object.pose).state;
        let name = state.map(|s| learned.domain[s].name.clone());
        seen.push((object.id.to_string(), name));
    }
    Ok((learned, seen))
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    let (Learned { domain, report }, seen) = run()?;
    println!("{} of {} attempts failed", report.failed(), report.attempts.len());
    for operator in domain.operators() {
        let needs = domain.names(&operator.preconditions).join(" and ");
        println!("{:<24} needs {needs}", operator.name);
    }
    for (id, state) in seen {
        println!("{id:<12} {}", state.as_deref().unwrap_or("in no state"));
    }
    Ok(())
}
