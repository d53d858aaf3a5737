//! The page of an import: tracks over time and in space, with each event and its evidence.

use serde_json::{Value, json};

use crate::record::shell::filled;
use crate::task::SnapshotEvent;
use crate::task::import::{Imported, Part, Session, Track};

const PAGE: &str = include_str!("../../assets/import/page.html");
const CODE: &str = include_str!("../../assets/import/page.js");

/// Greatest number of samples of all tracks on the page, and of one track.
const MOST: usize = 60_000;
const MOST_OF_A_TRACK: usize = 1_500;

/// Returns a page in HTML that shows what was imported. It opens offline. Tracks and signals are thinned out: together
/// the tracks have at most 60,000 samples, or 20 each if there are more than 3,000, so that the page of a usual log has at
/// most a few megabytes. A sample is about 40 bytes.
pub fn import_page(imported: &Imported) -> String {
    let parts = imported.sessions.iter().flat_map(|session| &session.parts);
    let tracks = parts.map(|part| part.tracks.len() + 1).sum::<usize>().max(1);
    let most = (MOST / tracks).clamp(20, MOST_OF_A_TRACK);
    let session = |session: &Session| {
        let parts: Vec<Value> = session.parts.iter().map(|part| of_part(part, most)).collect();
        json!({"name": session.name, "parts": parts})
    };
    let events: Vec<Value> = (imported.moments.iter())
        .map(|moment| {
            json!({
                "session": moment.session, "part": moment.part, "t": moment.t, "object": &*moment.object,
                "event": if moment.event == SnapshotEvent::Contact { "contact" } else { "release" },
                "with": moment.with.iter().map(|id| &**id).collect::<Vec<_>>(),
                "evidence": moment.evidence, "p": moment.position,
            })
        })
        .collect();
    let objects: Vec<Value> = (imported.seen.iter())
        .map(|seen| {
            json!({
                "session": seen.session, "id": &*seen.id, "kind": &*seen.kind, "poses": seen.samples,
                "rate_hz": seen.rate_hz, "noise_m": seen.noise_m, "carried": seen.carried,
            })
        })
        .collect();
    let guessed =
        imported.guesses.iter().map(|g| format!("{}: {}, because {}", g.what, g.value, g.reason));
    let dropped = imported.dropped.iter().map(|d| format!("left out: {} ({})", d.what, d.count));
    let notes: Vec<String> = guessed.chain(dropped).take(1000).collect();
    let data = json!({
        "sessions": imported.sessions.iter().map(session).collect::<Vec<_>>(),
        "events": events, "objects": objects, "notes": notes, "rows": imported.rows,
    });
    filled(PAGE, &[], &data, CODE)
}

/// Returns a number with as many digits as a curve shows.
fn short(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

fn of_part(part: &Part, most: usize) -> Value {
    let track = |track: &Track| {
        let step = track.samples.len() / most + 1;
        let kept: Vec<_> = track.samples.iter().step_by(step).collect();
        json!({
            "id": &*track.id,
            "t": kept.iter().map(|s| short(s.t)).collect::<Vec<_>>(),
            "p": kept.iter().map(|s| s.position.map(short)).collect::<Vec<_>>(),
        })
    };
    let signal = |name: &str, values: &[(f64, f64)]| {
        let kept: Vec<_> = values.iter().step_by(values.len() / most + 1).collect();
        json!({
            "name": name,
            "t": kept.iter().map(|(t, _)| short(*t)).collect::<Vec<_>>(),
            "v": kept.iter().map(|(_, v)| short(*v)).collect::<Vec<_>>(),
        })
    };
    let flags = |flags: &[(f64, bool)]| -> Vec<(f64, f64)> {
        flags.iter().map(|(t, set)| (*t, f64::from(u8::from(*set)))).collect()
    };
    let mut signals = Vec::new();
    if !part.width.is_empty() {
        signals.push(signal("width", &part.width));
    }
    if !part.grasp.is_empty() {
        signals.push(signal("grasp", &flags(&part.grasp)));
    }
    signals.extend(part.contacts.iter().map(|(id, f)| signal(&format!("contact {id}"), &flags(f))));
    let (from, to) = part.span().unwrap_or((0.0, 0.0));
    json!({
        "name": part.part, "from": from, "to": to, "signals": signals,
        "tracks": part.tracks.iter().map(track).collect::<Vec<_>>(),
        "hand": part.hand.as_ref().map(track),
    })
}
