//! `symbolt classify`: the state of every object in a recording or scene.

use anyhow::Error;
use serde_json::{Value, json};
use symbolt::task::{Classifier, Domain, Recording, Snapshot, TaskError};

use super::Outcome;
use super::args::{BadArgument, ClassifyArgs};
use super::output::{Grid, emit_or_write, refuse_existing, use_threads};

pub(crate) fn classify(args: &ClassifyArgs) -> Result<Outcome, Error> {
    refuse_existing(args.out.out.as_deref(), args.out.force)?;
    use_threads(&args.common)?;
    if args.domain.as_os_str() == "-" && args.recording.as_os_str() == "-" {
        let problem = "the domain and the recording cannot both come from standard input (-)";
        return Err(BadArgument(problem.into()).into());
    }
    let domain = Domain::read(&args.domain)?;
    let classifier = Classifier::new(&domain, args.grounding.rule())?;
    let scenes = read_scenes(&args.recording)?;
    let mut rows = Vec::new();
    for (place, scene) in &scenes {
        for (object, grounded) in scene.objects.iter().zip(classifier.classify_all(scene)) {
            let state = grounded.state.map(|s| domain[s].name.as_str());
            rows.push((*place, object, state, grounded.distance));
        }
    }
    let text = if args.common.json {
        let lines: Vec<String> = rows
            .iter()
            .map(|(place, object, state, distance)| {
                let (demo, snapshot) = place.unzip();
                json!({
                    "demo": demo, "snapshot": snapshot, "id": *object.id, "kind": *object.kind,
                    "state": state, "distance": distance,
                })
            })
            .map(|v: Value| v.to_string())
            .collect();
        lines.join("\n")
    } else {
        let mut grid = Grid::new(&[">demo", ">snapshot", "id", "kind", "state", ">distance"]);
        for (place, object, state, distance) in &rows {
            let number = |n: Option<u64>| n.map_or_else(|| "-".into(), |n| n.to_string());
            let (demo, snapshot) = place.unzip();
            grid.row([
                number(demo),
                number(snapshot),
                object.id.to_string(),
                object.kind.to_string(),
                state.unwrap_or("none").into(),
                distance.map_or_else(|| "-".into(), |d| format!("{d:.3}")),
            ]);
        }
        grid.to_string()
    };
    emit_or_write(&text, &args.out)?;
    Ok(Outcome::Done)
}

/// A snapshot with its demonstration and snapshot numbers, if it comes from a recording.
type Scene = (Option<(u64, u64)>, Snapshot);

/// Reads all snapshots of a recording, or the only one of a scene.
fn read_scenes(path: &std::path::Path) -> Result<Vec<Scene>, Error> {
    let bytes = symbolt::files::read_file(path)?;
    let name = path.display().to_string();
    match Recording::parse(&bytes, &name) {
        Ok((recording, _)) => {
            let scenes = recording.demos.into_iter().flat_map(|demo| {
                let number = demo.number;
                demo.snapshots.into_iter().map(move |s| (Some((number, s.number)), s))
            });
            Ok(scenes.collect())
        }
        // A file that is neither a recording nor a scene is reported as a faulty recording.
        Err(fault) => match Snapshot::parse(&bytes, &name) {
            Ok(scene) => Ok(vec![(None, scene)]),
            Err(_) => Err(TaskError::Input(fault).into()),
        },
    }
}
