//! `symbolt classify`: the state of every object in a recording or scene.

use std::path::{Path, PathBuf};

use anyhow::Error;
use clap::Args;
use serde_json::{Value, json};
use symbolt::files::{Limit, read_file};
use symbolt::task::classify::{Classifier, Layout};
use symbolt::task::domain::RelationalDomain;
use symbolt::task::event::InNoState;
use symbolt::task::{Recording, Snapshot, TaskError};

use super::end::Outcome;
use super::options::{Common, GroundingArgs, OutFile};
use super::output::{not_both_standard_input, use_threads};
use super::table::Grid;

#[derive(Debug, Clone, Args)]
pub(crate) struct ClassifyArgs {
    /// Learned domain; - for standard input
    pub domain: PathBuf,
    /// Recording or scene; - for standard input
    pub recording: PathBuf,
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    pub grounding: GroundingArgs,
    #[command(flatten)]
    pub out: OutFile,
}

/// The state of an object in a snapshot.
struct Row {
    place: Option<(u64, u64)>,
    id: String,
    kind: String,
    state: Option<String>,
    distance: Option<f64>,
    /// The nearest state of a part in no state.
    miss: Option<InNoState>,
    /// Id of the reference; `None` in the world frame and for an object in no state.
    reference: Option<String>,
    /// Number of the state's place, counted from 0.
    at: Option<usize>,
    ambiguous: bool,
}

pub(crate) fn classify(args: &ClassifyArgs) -> Result<Outcome, Error> {
    let out = args.out.place()?;
    use_threads(&args.common)?;
    not_both_standard_input(("domain", &args.domain), ("recording", &args.recording))?;
    let domain = RelationalDomain::read(&args.domain)?;
    let classifier = args.grounding.classifier(&domain)?;
    let rows = rows(&domain, &classifier, &read_scenes(&args.recording)?);
    let text = if args.common.json {
        let lines: Vec<String> = rows.iter().map(|row| json(row).to_string()).collect();
        lines.join("\n")
    } else {
        table(&rows).to_string()
    };
    out.write(&text)
}

/// Classifies with hysteresis along each demonstration.
fn rows(domain: &RelationalDomain, classifier: &Classifier, scenes: &[Scene]) -> Vec<Row> {
    let mut rows = Vec::new();
    let mut before: Option<(Option<u64>, Layout)> = None;
    for (place, scene) in scenes {
        let demo = place.map(|(demo, _)| demo);
        let layout = match &before {
            Some((of, layout)) if *of == demo => classifier.classify_after(layout, scene),
            _ => classifier.classify(scene),
        };
        for (object, located) in layout.objects.iter().zip(&layout.located) {
            let reference = located.fact.and_then(|fact| fact.reference);
            rows.push(Row {
                place: *place,
                id: object.id.to_string(),
                kind: object.kind.to_string(),
                state: located.fact.map(|fact| domain.states[fact.state].name.clone()),
                distance: located.distance,
                miss: located.miss.map(|miss| {
                    let nearest = &domain.states[miss.nearest.state].name;
                    InNoState::new(&object.id, nearest, &miss.offset)
                }),
                reference: reference.map(|r| layout.objects[r].id.to_string()),
                at: located.fact.map(|fact| fact.place),
                ambiguous: located.ambiguous,
            });
        }
        before = Some((demo, layout));
    }
    rows
}

fn json(row: &Row) -> Value {
    let (demo, snapshot) = row.place.unzip();
    let mut keys = json!({
        "demo": demo, "snapshot": snapshot, "id": row.id, "kind": row.kind, "state": row.state,
        "distance": row.distance, "reference": row.reference, "place": row.at,
        "ambiguous": row.ambiguous,
    });
    if let Some(miss) = &row.miss {
        keys["nearest"] = json!(miss.nearest);
        keys["off_mm"] = json!(miss.off_mm);
        keys["off_deg"] = json!(miss.off_deg);
    }
    keys
}

fn table(rows: &[Row]) -> Grid {
    // Columns that are the same for all rows would only take room.
    let references = rows.iter().any(|row| row.reference.is_some());
    let missed = rows.iter().any(|row| row.miss.is_some());
    let mut columns = vec![">demo", ">snapshot", "id", "kind", "state"];
    columns.extend(references.then_some("reference"));
    columns.push(">distance");
    columns.extend(missed.then_some("nearest state"));
    let mut grid = Grid::new(&columns);
    for row in rows {
        let number = |n: Option<u64>| n.map_or_else(|| "-".into(), |n| n.to_string());
        let (demo, snapshot) = row.place.unzip();
        let state = row.state.clone().unwrap_or_else(|| "none".into());
        let mut cells =
            vec![number(demo), number(snapshot), row.id.clone(), row.kind.clone(), state];
        if references {
            let mark = if row.ambiguous { " (or another)" } else { "" };
            let reference = row.reference.as_ref();
            cells.push(reference.map_or_else(|| "-".into(), |r| format!("{r}{mark}")));
        }
        cells.push(row.distance.map_or_else(|| "-".into(), |d| format!("{d:.3}")));
        if missed {
            let near = row.miss.as_ref().map(|miss| format!("{}: {}", miss.nearest, miss.off));
            cells.push(near.unwrap_or_else(|| "-".into()));
        }
        grid.row(cells);
    }
    grid
}

/// A snapshot with its demonstration and snapshot numbers, if it comes from a recording.
type Scene = (Option<(u64, u64)>, Snapshot);

/// Reads all snapshots of a recording, or the only one of a scene.
fn read_scenes(path: &Path) -> Result<Vec<Scene>, Error> {
    let bytes = read_file(path, Limit::RECORDING)?;
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
