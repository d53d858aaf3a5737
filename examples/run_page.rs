//! Exports a run: a page with charts and a spike raster, all samples for numpy, and the spikes as CSV.
//!
//! `cargo run --example run_page -- FOLDER`

use std::error::Error;
use std::path::{Path, PathBuf};

use symbolt::files::{Overwrite, write_atomic};
use symbolt::prelude::*;
use symbolt::record::RunPage;

symbolt::vocabulary!(Words = "words": ONE, TWO);

/// Writes `run.html`, `run.npz` and `spikes.csv` into a folder. Returns the number of spikes.
pub fn run(folder: &Path) -> Result<usize, Box<dyn Error>> {
    let words = Words::vocabulary(64, Seed::new(1))?;
    let mut graph = GraphBuilder::new();
    let shown = graph.add("shown", words.stimulus([(0, "ONE"), (100, "TWO"), (200, "0")])?);
    let memory = graph.add("memory", State::new(&words).recurrent(Synapse::lowpass_ms(100)));
    graph.route(&shown >> &memory);
    let value = graph.probe(&memory.output, ProbeSpec::default());
    let ideal = graph.probe(&shown, ProbeSpec::default());
    let spikes = graph.probe_spikes("memory");
    let spiking = PopulationPlan::lif();
    let sim = graph.run(&spiking, Seed::new(1), SimDuration::from_millis(300))?;

    let [memory, ideal] =
        [value, ideal].map(|probe| words.similarities(sim.samples(&probe), Words::NAMES));
    let page = RunPage::new("A memory", &sim).against("memory", &memory?, &ideal?).html();
    write_atomic(&folder.join("run.html"), page, Overwrite::Allowed)?;
    let recordings = sim.recordings();
    write_atomic(&folder.join("run.npz"), recordings.to_npz()?, Overwrite::Allowed)?;
    write_atomic(&folder.join("spikes.csv"), recordings.spikes_csv(), Overwrite::Allowed)?;
    Ok(sim.spikes(&spikes).count())
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args_os().nth(1).map_or_else(|| PathBuf::from("."), PathBuf::from);
    let spikes = run(&folder)?;
    println!("{spikes} spikes are in {}.", folder.display());
    Ok(())
}
