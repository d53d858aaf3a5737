//! `symbolt record`: demonstrations, or a single scene, from the kinematic generator.

use anyhow::Error;
use serde_json::json;
use symbolt::sim::Seed;
use symbolt::task::write_whole;

use super::Outcome;
use super::args::RecordArgs;
use super::output::{emit, emit_json, refuse_existing, use_threads};

pub(crate) fn record(args: &RecordArgs) -> Result<Outcome, Error> {
    refuse_existing(args.out.out.as_deref(), args.out.force)?;
    use_threads(&args.common)?;
    let rehearsal = args.rehearsal.rehearsal();
    let seed = Seed::new(args.common.seed);
    let (text, summary) = if args.scene {
        let scene = rehearsal.scene(seed)?;
        (scene.to_json() + "\n", json!({"objects": scene.objects.len()}))
    } else {
        let made = rehearsal.record(seed)?;
        let summary = json!({
            "demonstrations": made.recording.demos.len(),
            "snapshots": made.recording.snapshot_count(),
            "failed": made.failed,
            "lost": made.lost,
            "assembled": made.assembled,
        });
        (made.recording.to_jsonl(args.labels.then_some(&made.labels)), summary)
    };
    match &args.out.out {
        None => emit(&text)?,
        Some(path) => {
            write_whole(path, &text, args.out.overwrite())?;
            if args.common.json {
                emit_json(&[summary])?;
            } else if !args.common.quiet {
                emit(&format!("wrote {}: {summary}", path.display()))?;
            }
        }
    }
    Ok(Outcome::Done)
}
