//! What was imported, in tables or as JSON.

use serde_json::{Value, json};
use symbolt::doubt::Doubt;
use symbolt::task::SnapshotEvent;
use symbolt::task::import::Imported;

use super::super::table::{Grid, counted, section, wrapped};

/// Most rows of a table of objects or events.
const MOST_ROWS: usize = 200;

fn name(event: SnapshotEvent) -> &'static str {
    match event {
        SnapshotEvent::Start => "start",
        SnapshotEvent::Contact => "contact",
        SnapshotEvent::Release => "release",
        SnapshotEvent::End => "end",
    }
}

pub(super) fn text(imported: &Imported) -> String {
    let mut text = String::new();
    let sessions = &imported.sessions;
    let mut grid = Grid::new(&["session", ">parts", ">seconds", ">objects", "hand", ">events"]);
    let mut counts = vec![(0usize, 0usize); sessions.len()];
    imported.seen.iter().for_each(|seen| counts[seen.session].0 += 1);
    imported.moments.iter().for_each(|moment| counts[moment.session].1 += 1);
    for (session, (objects, events)) in sessions.iter().zip(counts) {
        let spans = session.parts.iter().filter_map(|part| part.span());
        let seconds: f64 = spans.map(|(from, to)| to - from).sum();
        let hand = session.parts.iter().any(|part| part.hand.is_some());
        grid.row([
            session.name.to_string(),
            session.parts.len().to_string(),
            format!("{seconds:.1}"),
            objects.to_string(),
            if hand { "seen".into() } else { "not seen".into() },
            events.to_string(),
        ]);
    }
    section(
        &mut text,
        &format!(
            "{} of {}",
            counted(sessions.len(), "session"),
            counted(imported.rows as usize, "row")
        ),
        &grid,
    );
    let mut grid =
        Grid::new(&["session", "object", "kind", ">poses", ">Hz", ">noise mm", ">carried"]);
    for seen in imported.seen.iter().take(MOST_ROWS) {
        grid.row([
            sessions[seen.session].name.to_string(),
            seen.id.to_string(),
            seen.kind.to_string(),
            seen.samples.to_string(),
            format!("{:.1}", seen.rate_hz),
            seen.noise_m.map_or_else(|| "-".into(), |noise| format!("{:.2}", noise * 1e3)),
            seen.carried.to_string(),
        ]);
    }
    section(&mut text, "Objects", &grid);
    let mut grid = Grid::new(&["session", ">s", "event", "object", "evidence"]);
    for moment in imported.moments.iter().take(MOST_ROWS) {
        let mut evidence = moment.evidence.to_string();
        if !moment.with.is_empty() {
            let with: Vec<&str> = moment.with.iter().map(|id| &**id).collect();
            evidence = format!("{evidence}; with {}", with.join(", "));
        }
        let hand = sessions[moment.session].parts[moment.part].hand.is_some();
        evidence += match (moment.samples, moment.event) {
            (1.., _) => "",
            (0, SnapshotEvent::Release) if hand => "; pose from the hand's motion",
            _ => "; not seen then, pose from another time",
        };
        grid.row([
            sessions[moment.session].name.to_string(),
            format!("{:.2}", moment.t),
            name(moment.event).into(),
            moment.object.to_string(),
            evidence,
        ]);
    }
    section(&mut text, &counted(imported.moments.len(), "event"), &grid);
    let hidden = imported.moments.len().saturating_sub(MOST_ROWS);
    if hidden > 0 {
        text += &format!("... and {hidden} more; --json has all\n");
    }
    for guess in &imported.guesses {
        let file = if guess.file.is_empty() { String::new() } else { format!(" ({})", guess.file) };
        let line =
            format!("guessed {}: {}, because {}{file}", guess.what, guess.value, guess.reason);
        text += &format!("\n{}", wrapped(&line, 6));
    }
    if !imported.guesses.is_empty() {
        text.push('\n');
    }
    for dropped in &imported.dropped {
        let times =
            if dropped.count == 1 { String::new() } else { format!(" ({} times)", dropped.count) };
        text += &format!("\n{}", wrapped(&format!("left out: {}{times}", dropped.what), 6));
    }
    if !imported.dropped.is_empty() {
        text.push('\n');
    }
    let mut told: Vec<&Vec<String>> = Vec::new();
    for (file, columns) in &imported.unused {
        if !told.contains(&columns) {
            told.push(columns);
            let line = format!("not used in {file}: {}", columns.join(", "));
            text += &format!("\n{}", wrapped(&line, 6));
        }
    }
    if !told.is_empty() {
        text.push('\n');
    }
    text
}

pub(super) fn json(imported: &Imported, doubts: &[Doubt]) -> Value {
    let session = |index: usize| imported.sessions[index].name.clone();
    let sessions = imported.sessions.iter().map(|session| {
        let spans: Vec<_> = session.parts.iter().filter_map(|part| part.span()).collect();
        json!({
            "name": session.name,
            "parts": session.parts.len(),
            "seconds": spans.iter().map(|(from, to)| to - from).sum::<f64>(),
            "hand": session.parts.iter().find_map(|part| part.hand.as_ref()).map(|hand| &*hand.id),
        })
    });
    let objects = imported.seen.iter().map(|seen| {
        json!({
            "session": session(seen.session), "id": &*seen.id, "kind": &*seen.kind,
            "poses": seen.samples, "rate_hz": seen.rate_hz, "noise_m": seen.noise_m, "carried": seen.carried,
        })
    });
    let events = imported.moments.iter().map(|moment| {
        json!({
            "demo": moment.session, "session": session(moment.session), "part": moment.part,
            "t": moment.t, "event": name(moment.event), "object": &*moment.object,
            "with": moment.with.iter().map(|id| &**id).collect::<Vec<_>>(),
            "evidence": moment.evidence, "poses": moment.samples,
        })
    });
    let guesses = imported.guesses.iter().map(|guess| {
        json!({"what": guess.what, "value": guess.value, "reason": guess.reason, "file": guess.file})
    });
    json!({
        "warnings": doubts,
        "demonstrations": imported.recording.demos.len(),
        "snapshots": imported.recording.snapshot_count(),
        "rows": imported.rows,
        "sessions": sessions.collect::<Vec<_>>(),
        "objects": objects.collect::<Vec<_>>(),
        "events": events.collect::<Vec<_>>(),
        "guesses": guesses.collect::<Vec<_>>(),
        "left_out": imported.dropped.iter().map(|d| json!({"what": d.what, "count": d.count})).collect::<Vec<_>>(),
        "unused": imported.unused.iter().map(|(file, columns)| json!({"file": file, "columns": columns})).collect::<Vec<_>>(),
        "mapping": imported.mapping,
    })
}
