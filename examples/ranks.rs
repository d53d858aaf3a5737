//! A graph of one's own on several processes, with a checkpoint on the way:
//! `cargo build --release --features mpi --example ranks`, then `mpirun -n 2 target/release/examples/ranks`.
//!
//! A pointer is bound to a role and unbound again, in 52,800 spiking neurons. Halfway the first process writes a
//! checkpoint to a file; `ranks FILE` continues from it, on as many processes as you like.

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

use symbolt::files::{Limit, Overwrite, read_file, write_atomic};
use symbolt::neurons::{PopulationPlan, own_neurons};
use symbolt::prelude::*;
use symbolt::sim::{Checkpoint, MpiSession, Ranks};

struct Things;
impl VocabTag for Things {
    const NAME: &'static str = "things";
}

fn main() -> ExitCode {
    MpiSession::run(model)
}

fn model(ranks: &Ranks) -> Result<(), Box<dyn Error>> {
    // All processes describe and build the same graph. Each solves and runs its share of the neurons.
    let things = VocabularyBuilder::<Things>::new(64, Seed::new(1))
        .pointers(["CUP"])
        .unitary("LEFT")
        .build()?;
    let mut graph = GraphBuilder::new();
    let cup = graph.add("cup", Constant::pointer(things.space(), &things.get("CUP")?));
    let left = graph.add("left", Constant::pointer(things.space(), &things.get("LEFT")?));
    let bind = graph.add("bind", Bind::new(&things));
    let unbind = graph.add("unbind", Unbind::new(&things));
    graph.connect(&cup, &bind.a, Synapse::None);
    graph.connect(&left, &bind.b, Synapse::None);
    graph.connect(&bind.output, &unbind.bound, Synapse::lowpass_ms(5));
    graph.connect(&left, &unbind.role, Synapse::None);
    let probe = ProbeSpec::default().filtered(Synapse::lowpass_ms(10));
    let probe = graph.probe(&unbind.output, probe);
    let plan = PopulationPlan::lif().shared(ranks);
    let graph = graph.build(Timebase::default(), &plan, Seed::new(1))?;
    eprintln!("rank {} of {}: {} neurons", ranks.rank(), ranks.ranks(), own_neurons(&graph));

    let mut sim = Simulator::new(graph.into(), RunConfig::default())?;
    let half = SimDuration::from_millis(100);
    match std::env::args_os().nth(1) {
        Some(file) => {
            let bytes = read_file(&PathBuf::from(file), Limit::ANY)?;
            let checkpoint: Checkpoint = serde_json::from_slice(&bytes)?;
            sim.restore(&checkpoint)?;
        }
        None => {
            sim.run_for(half)?;
            // All processes take the checkpoint, and each has the whole.
            let checkpoint = sim.checkpoint()?;
            if ranks.rank() == 0 {
                let file = std::env::temp_dir().join("symbolt-ranks.json");
                write_atomic(&file, serde_json::to_vec(&checkpoint)?, Overwrite::Allowed)?;
                println!("checkpoint at {:.1} s: {}", sim.time_s(), file.display());
            }
        }
    }
    sim.run_for(half)?;
    // Every process knows all values; one prints them.
    if ranks.rank() == 0
        && let Some((time_s, value)) = sim.samples(&probe).last()
    {
        println!("similarity to CUP at {time_s:.1} s: {:.6}", cosine(&value, &things.get("CUP")?));
    }
    Ok(())
}
