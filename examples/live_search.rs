//! Searches, by 200 rewound interventions, for the least silencing of one module that changes a decision, and repeats it.
//!
//! `cargo run --release --example live_search`

use std::error::Error;

use symbolt::prelude::*;
use symbolt::sim::{Checkpoint, Intervention, InterventionLog, Live, LiveOptions};

symbolt::vocabulary!(Parts = "parts": NUT, BOLT);

const CHOICES: [&str; 3] = ["TAKE_NUT", "TAKE_BOLT", "WAIT"];

/// Asks for the NUT for 100 ms, then shows a BOLT. Returns what is chosen at 400 ms; the log of the shortest silence of a
/// module that changes the choice; the choice then; and whether the log gives the same bits again.
pub fn run() -> Result<(&'static str, InterventionLog, &'static str, bool), Box<dyn Error>> {
    let parts = Parts::vocabulary(64, Seed::new(1))?;
    let mut graph = GraphBuilder::new();
    let request = graph.add("request", parts.stimulus([(0, "NUT"), (100, "0")])?);
    let vision = graph.add("vision", parts.stimulus([(0, "0"), (150, "0.5 * BOLT")])?);
    let memory = graph.add("memory", State::new(&parts).recurrent(Synapse::lowpass_ms(100)));
    graph.route(&request >> &memory);
    let rules = Rules::new()
        .rule(CHOICES[0], memory.dot(Parts::NUT), [])
        .rule(CHOICES[1], vision.dot(Parts::BOLT), [])
        .otherwise(CHOICES[2], 0.3, []);
    let rules = graph.add("rules", rules);
    let sim = graph.start(&PopulationPlan::direct(), Seed::new(1))?;
    let mut live = Live::new(sim, LiveOptions::default())?;
    let start = live.mark()?;
    let decide = |live: &mut Live| -> Result<&'static str, Box<dyn Error>> {
        live.seek(400)?;
        let chosen = live.sim().value(&rules.chosen);
        let best = (0..CHOICES.len()).max_by(|a, b| chosen[*a].total_cmp(&chosen[*b]));
        Ok(CHOICES[best.ok_or("no choice")?])
    };
    let usual = decide(&mut live)?;
    let mut least: Option<(u64, InterventionLog, &str, Checkpoint)> = None;
    for (module, n) in
        ["request", "vision", "memory", "rules"].iter().flat_map(|m| (0..50).map(move |n| (m, n)))
    {
        let (from, ticks) = (30 * (n % 10), [5, 10, 20, 40, 80][n as usize / 10]);
        live.return_to(&start)?;
        live.step(from)?;
        live.intervene(Intervention::Silence { at: module.to_string() })?;
        live.step(ticks)?;
        live.intervene(Intervention::Release { at: module.to_string() })?;
        let choice = decide(&mut live)?;
        if choice != usual && least.as_ref().is_none_or(|least| ticks < least.0) {
            least = Some((ticks, live.log(), choice, live.sim().checkpoint()?));
        }
    }
    let (_, log, choice, state) = least.ok_or("no silence changes the choice")?;
    live.return_to(&start)?;
    live.follow(&InterventionLog::parse(&log.to_string())?)?;
    let same = decide(&mut live)? == choice && live.sim().checkpoint()? == state;
    Ok((usual, log, choice, same))
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    let (usual, log, choice, same) = run()?;
    println!("{usual} is chosen, but {choice} after\n{log}Again with the same bits: {same}.");
    Ok(())
}
