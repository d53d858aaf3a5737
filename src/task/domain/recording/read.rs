//! Reading recordings and single scenes from JSON, with every fault named by file, line and field.

use std::collections::{HashMap, HashSet};
use std::path::Path;
use std::sync::Arc;

use serde::Deserialize;

use super::{Demonstration, Labels, ObjectPose, Recording, Snapshot, SnapshotEvent};
use crate::files::read_file;
use crate::task::domain::pose::Pose;
use crate::task::error::{InputFault, TaskError, json_problem};

/// A line as it stands in the file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSnapshot {
    demo: Option<u64>,
    snapshot: Option<u64>,
    next_action: Option<String>,
    t: Option<f64>,
    event: Option<SnapshotEvent>,
    object: Option<String>,
    objects: Vec<RawObject>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawObject {
    id: String,
    kind: String,
    position: [f64; 3],
    orientation: [f64; 4],
}

/// How far from 1 the norm of an orientation may be: files hold rounded numbers.
const NORM_TOLERANCE: f64 = 1e-3;

/// Greatest coordinate in metres: beyond it a unit is more likely wrong than a scene that large.
const FARTHEST: f64 = 1e6;

/// Longest id or kind, in characters.
const LONGEST_NAME: usize = 200;

/// Where a fault is, while a file is read.
#[derive(Clone, Copy)]
struct Place<'a> {
    file: &'a str,
    line: Option<usize>,
}

impl Place<'_> {
    fn fault(
        self,
        field: impl Into<String>,
        problem: impl Into<String>,
        expected: impl Into<String>,
    ) -> InputFault {
        InputFault {
            file: self.file.into(),
            line: self.line,
            field: field.into(),
            problem: problem.into(),
            expected: expected.into(),
        }
    }
}

impl Recording {
    /// Reads a recording from a file of one JSON object a line.
    ///
    /// # Errors
    /// If the file cannot be read or any line is not valid; see [`Recording::parse`].
    pub fn read(path: &Path) -> Result<Self, TaskError> {
        Ok(Self::read_labelled(path)?.0)
    }

    /// Reads a recording and, beside it, the names that a person gave to the actions.
    ///
    /// # Errors
    /// As [`Recording::read`].
    pub fn read_labelled(path: &Path) -> Result<(Self, Labels), TaskError> {
        let bytes = read_file(path)?;
        Ok(Self::parse(&bytes, &path.display().to_string())?)
    }

    /// Reads a recording from bytes; `file` names them in messages. Never panics, whatever the
    /// bytes.
    ///
    /// # Errors
    /// The first line that is no JSON object of the known fields, holds a number that is not finite, an
    /// orientation that is no unit quaternion, an id twice, or that is out of order.
    pub fn parse(bytes: &[u8], file: &str) -> Result<(Self, Labels), InputFault> {
        let nowhere = Place { file, line: None };
        let mut recording = Self::default();
        let mut labels = Labels::new();
        let mut seen = HashSet::new();
        let mut kinds: HashMap<Arc<str>, Arc<str>> = HashMap::new();
        for (index, line) in bytes.split(|b| *b == b'\n').enumerate() {
            let place = Place { file, line: Some(index + 1) };
            let line = line.strip_suffix(b"\r").unwrap_or(line);
            if line.iter().all(u8::is_ascii_whitespace) {
                continue;
            }
            let raw: RawSnapshot = parse_json(utf8(line, place)?, place)?;
            let need = |field, value: Option<u64>| {
                value.ok_or_else(|| place.fault(field, "it is missing", "a whole number"))
            };
            let number = need("demo", raw.demo)?;
            let snapshot_number = need("snapshot", raw.snapshot)?;
            let label = raw.next_action.clone();
            let snapshot = check_snapshot(raw, snapshot_number, place)?;
            let new = recording.demos.last().is_none_or(|d| d.number != number);
            if new {
                if !seen.insert(number) {
                    let problem = format!("demonstration {number} goes on after another one");
                    return Err(place.fault("demo", problem, "all of its lines in one block"));
                }
                kinds.clear();
                recording.demos.push(Demonstration { number, snapshots: Vec::new() });
                labels.push(Vec::new());
            }
            for object in &snapshot.objects {
                let kind = kinds.entry(object.id.clone()).or_insert_with(|| object.kind.clone());
                if **kind != *object.kind {
                    let problem =
                        format!("`{}` was a `{kind}` and is a `{}` now", object.id, object.kind);
                    return Err(place.fault("objects", problem, "one kind for one id"));
                }
            }
            let Some(demo) = recording.demos.last_mut() else { continue };
            if let Some(last) = demo.snapshots.last() {
                check_order(last, &snapshot, place)?;
            }
            demo.snapshots.push(snapshot);
            if let Some(labels) = labels.last_mut() {
                labels.push(label);
            }
        }
        if recording.demos.is_empty() {
            return Err(nowhere.fault("", "it holds no snapshot", "one JSON object a line"));
        }
        Ok((recording, labels))
    }
}

impl Snapshot {
    /// Reads a single scene from a file that holds one JSON object.
    ///
    /// # Errors
    /// If the file cannot be read, or is not exactly one valid snapshot.
    pub fn read(path: &Path) -> Result<Self, TaskError> {
        let bytes = read_file(path)?;
        Ok(Self::parse(&bytes, &path.display().to_string())?)
    }

    /// Reads a single scene from bytes; `file` names them in messages. Never panics, whatever the
    /// bytes.
    ///
    /// # Errors
    /// If they are not exactly one valid snapshot.
    pub fn parse(bytes: &[u8], file: &str) -> Result<Self, InputFault> {
        let place = Place { file, line: None };
        let text = utf8(bytes, place)?;
        let mut stream = serde_json::Deserializer::from_str(text).into_iter::<RawSnapshot>();
        let raw = match stream.next() {
            Some(Ok(raw)) => raw,
            Some(Err(error)) => return Err(json_fault(&error, place, true)),
            None => return Err(place.fault("", "it is empty", "one snapshot")),
        };
        if !text[stream.byte_offset()..].trim().is_empty() {
            return Err(place.fault("", "it holds more than one snapshot", "exactly one"));
        }
        let number = raw.snapshot.unwrap_or(0);
        check_snapshot(raw, number, place)
    }
}

fn utf8<'a>(bytes: &'a [u8], place: Place<'_>) -> Result<&'a str, InputFault> {
    std::str::from_utf8(bytes).map_err(|error| {
        let problem = format!("byte {} is not UTF-8", error.valid_up_to());
        place.fault("", problem, "UTF-8 text")
    })
}

fn parse_json<'a, T: Deserialize<'a>>(text: &'a str, place: Place<'_>) -> Result<T, InputFault> {
    // An array could be read as an object whose fields stand in order.
    if text.trim_start().starts_with('[') {
        return Err(place.fault("", "it is an array", "a JSON object"));
    }
    serde_json::from_str(text).map_err(|error| json_fault(&error, place, false))
}

/// A JSON error as a fault; in a file of one object its line is the file's.
fn json_fault(error: &serde_json::Error, place: Place<'_>, whole_file: bool) -> InputFault {
    let place = if whole_file { Place { line: Some(error.line()), ..place } } else { place };
    let problem = format!("{} (column {})", json_problem(error), error.column());
    let expected = match error.classify() {
        serde_json::error::Category::Eof => "a complete JSON object",
        serde_json::error::Category::Syntax => "a JSON object",
        _ => {
            "the fields `demo`, `snapshot`, `next_action`, `t`, `event`, `object` and `objects` with `id`, `kind`, `position` [3] and `orientation` [4]"
        }
    };
    place.fault("", problem, expected)
}

fn check_snapshot(raw: RawSnapshot, number: u64, place: Place<'_>) -> Result<Snapshot, InputFault> {
    if let Some(t) = raw.t
        && !t.is_finite()
    {
        return Err(place.fault("t", t.to_string(), "a finite number of seconds"));
    }
    let mut objects: Vec<ObjectPose> = Vec::with_capacity(raw.objects.len());
    let mut ids: HashMap<String, usize> = HashMap::with_capacity(raw.objects.len());
    for (index, object) in raw.objects.into_iter().enumerate() {
        let field = |name: &str| format!("objects[{index}].{name}");
        for (name, text) in [("id", &object.id), ("kind", &object.kind)] {
            let length = text.chars().count();
            if length == 0 || length > LONGEST_NAME {
                let problem = format!("it has {length} characters");
                return Err(place.fault(field(name), problem, format!("1 to {LONGEST_NAME}")));
            }
        }
        let pose = check_pose(object.position, object.orientation, &field, place)?;
        if ids.insert(object.id.clone(), index).is_some() {
            let problem = format!("`{}` is there twice", object.id);
            return Err(place.fault(field("id"), problem, "every id once a snapshot"));
        }
        objects.push(ObjectPose { id: object.id.into(), kind: object.kind.into(), pose });
    }
    let touched = match &raw.object {
        None => None,
        Some(id) => Some(*ids.get(id).ok_or_else(|| {
            place.fault("object", format!("no object is called `{id}`"), "an id of this snapshot")
        })?),
    };
    if matches!(raw.event, Some(SnapshotEvent::Start | SnapshotEvent::End)) && touched.is_some() {
        let problem = "nothing is touched at the start and the end";
        return Err(place.fault("object", problem, "no such field"));
    }
    Ok(Snapshot { number, time_s: raw.t, event: raw.event, object: touched, objects })
}

fn check_pose(
    position: [f64; 3],
    orientation: [f64; 4],
    field: &impl Fn(&str) -> String,
    place: Place<'_>,
) -> Result<Pose, InputFault> {
    for (axis, value) in position.iter().enumerate() {
        if !value.is_finite() || value.abs() > FARTHEST {
            return Err(place.fault(
                format!("{}[{axis}]", field("position")),
                value.to_string(),
                format!("a finite number of metres, at most {FARTHEST:e} in magnitude"),
            ));
        }
    }
    let norm = orientation.iter().map(|v| v * v).sum::<f64>().sqrt();
    if !norm.is_finite() || (norm - 1.0).abs() > NORM_TOLERANCE {
        return Err(place.fault(
            field("orientation"),
            format!("its norm is {norm}"),
            format!("a unit quaternion [x, y, z, w] (norm 1 within {NORM_TOLERANCE})"),
        ));
    }
    Ok(Pose { position, orientation: orientation.map(|v| v / norm) })
}

fn check_order(last: &Snapshot, next: &Snapshot, place: Place<'_>) -> Result<(), InputFault> {
    if last.number.checked_add(1) != Some(next.number) {
        let problem = format!("snapshot {} follows snapshot {}", next.number, last.number);
        return Err(place.fault(
            "snapshot",
            problem,
            "the next number: lines in the order of time",
        ));
    }
    if let (Some(before), Some(now)) = (last.time_s, next.time_s)
        && now < before
    {
        let problem = format!("{now} s follows {before} s");
        return Err(place.fault("t", problem, "times that do not decrease"));
    }
    Ok(())
}
