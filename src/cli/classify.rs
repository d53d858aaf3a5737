//! `symbolt classify`: the state of every object in a recording or scene.

use anyhow::Error;
use serde_json::{Map, Value, json};
use symbolt::task::event::InNoState;
use symbolt::task::relational::{Grounder, Layout, RelationalDomain};
use symbolt::task::{Classifier, Domain, Recording, Snapshot, TaskError};

use super::Outcome;
use super::args::{BadArgument, ClassifyArgs};
use super::domain::AnyDomain;
use super::output::{Grid, emit_or_write, refuse_existing, use_threads};

/// The state of an object in a snapshot.
struct Row {
    place: Option<(u64, u64)>,
    id: String,
    kind: String,
    state: Option<String>,
    distance: Option<f64>,
    /// The nearest state of a part in no state.
    miss: Option<InNoState>,
    /// Only for a domain with frames.
    framed: Option<Framed>,
}

/// How an object is in a state in a frame.
struct Framed {
    /// Id of the reference; `None` in the world frame and for an object in no state.
    reference: Option<String>,
    /// Number of the place, counted from 0.
    place: Option<usize>,
    ambiguous: bool,
}

pub(crate) fn classify(args: &ClassifyArgs) -> Result<Outcome, Error> {
    refuse_existing(args.out.out.as_deref(), args.out.force)?;
    use_threads(&args.common)?;
    if args.domain.as_os_str() == "-" && args.recording.as_os_str() == "-" {
        let problem = "the domain and the recording cannot both come from standard input (-)";
        return Err(BadArgument(problem.into()).into());
    }
    let rows = match AnyDomain::read(&args.domain)? {
        AnyDomain::Relational(domain) => {
            let grounder = args.grounding.grounder(&domain)?;
            framed(&domain, &grounder, &read_scenes(&args.recording)?)
        }
        AnyDomain::Plain(domain) => {
            let classifier = Classifier::new(&domain, args.grounding.rule())?;
            plain(&domain, &classifier, &read_scenes(&args.recording)?)
        }
    };
    let text = if args.common.json {
        let lines: Vec<String> = rows.iter().map(|row| json(row).to_string()).collect();
        lines.join("\n")
    } else {
        table(&rows).to_string()
    };
    emit_or_write(&text, &args.out)?;
    Ok(Outcome::Done)
}

fn plain(domain: &Domain, classifier: &Classifier, scenes: &[Scene]) -> Vec<Row> {
    let mut rows = Vec::new();
    for (place, scene) in scenes {
        for (object, grounded) in scene.objects.iter().zip(classifier.classify_all(scene)) {
            rows.push(Row {
                place: *place,
                id: object.id.to_string(),
                kind: object.kind.to_string(),
                state: grounded.state.map(|s| domain[s].name.clone()),
                distance: grounded.distance,
                miss: match grounded.state {
                    Some(_) => None,
                    None => classifier
                        .nearest(&object.kind, &object.pose)
                        .map(|(s, offset)| InNoState::new(&object.id, &domain[s].name, &offset)),
                },
                framed: None,
            });
        }
    }
    rows
}

/// Classifies with hysteresis along each demonstration.
fn framed(domain: &RelationalDomain, grounder: &Grounder, scenes: &[Scene]) -> Vec<Row> {
    let mut rows = Vec::new();
    let mut before: Option<(Option<u64>, Layout)> = None;
    for (place, scene) in scenes {
        let demo = place.map(|(demo, _)| demo);
        let layout = match &before {
            Some((of, layout)) if *of == demo => grounder.layout_after(layout, scene),
            _ => grounder.layout(scene),
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
                framed: Some(Framed {
                    reference: reference.map(|r| layout.objects[r].id.to_string()),
                    place: located.fact.map(|fact| fact.place),
                    ambiguous: located.ambiguous,
                }),
            });
        }
        before = Some((demo, layout));
    }
    rows
}

fn json(row: &Row) -> Value {
    let (demo, snapshot) = row.place.unzip();
    let mut keys = Map::new();
    let own = [
        ("demo", json!(demo)),
        ("snapshot", json!(snapshot)),
        ("id", json!(row.id)),
        ("kind", json!(row.kind)),
        ("state", json!(row.state)),
        ("distance", json!(row.distance)),
    ];
    let framed = row.framed.iter().flat_map(|framed| {
        [
            ("reference", json!(framed.reference)),
            ("place", json!(framed.place)),
            ("ambiguous", json!(framed.ambiguous)),
        ]
    });
    let missed = row.miss.iter().flat_map(|miss| {
        [
            ("nearest", json!(miss.nearest)),
            ("off_mm", json!(miss.off_mm)),
            ("off_deg", json!(miss.off_deg)),
        ]
    });
    let all = own.into_iter().chain(framed).chain(missed);
    keys.extend(all.map(|(name, value)| (name.to_owned(), value)));
    Value::Object(keys)
}

fn table(rows: &[Row]) -> Grid {
    // Columns that are the same for all rows would only take room.
    let references =
        rows.iter().any(|row| row.framed.as_ref().is_some_and(|framed| framed.reference.is_some()));
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
            let framed = row.framed.as_ref();
            let reference = framed.and_then(|f| f.reference.clone());
            let mark = if framed.is_some_and(|f| f.ambiguous) { " (or another)" } else { "" };
            cells.push(reference.map_or_else(|| "-".into(), |reference| reference + mark));
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
