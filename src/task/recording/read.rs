//! Reads recordings and single scenes from JSON. Every error names the file, line and field.

use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::Path;
use std::sync::Arc;

use serde::Deserialize;

use super::{
    Attributes, Demonstration, FIT_NAME, Labels, ObjectPose, Recording, Snapshot, SnapshotEvent,
    unfit,
};
use crate::files::{Limit, read_file};
use crate::robot::Pose;
use crate::sim::{meant, nearest_first};
use crate::task::error::{InputFault, TaskError, json_problem};

/// One line of the file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSnapshot<'a> {
    demo: Option<u64>,
    snapshot: Option<u64>,
    next_action: Option<String>,
    t: Option<f64>,
    event: Option<SnapshotEvent>,
    #[serde(borrow)]
    object: Option<Cow<'a, str>>,
    #[serde(borrow)]
    objects: Vec<RawObject<'a>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawObject<'a> {
    #[serde(borrow)]
    id: Cow<'a, str>,
    #[serde(borrow)]
    kind: Cow<'a, str>,
    position: [f64; 3],
    orientation: [f64; 4],
    attributes: Option<BTreeMap<String, serde_json::Value>>,
}

/// Largest accepted deviation of an orientation's norm from 1. Files contain rounded numbers.
const NORM_TOLERANCE: f64 = 1e-3;

/// Largest magnitude of a coordinate, in metres. Larger values are taken for a wrong unit.
const FARTHEST: f64 = 1e6;

/// Maximum length of a line, in bytes.
const LONGEST_LINE: usize = 8 << 20;

/// Maximum number of snapshots in a recording.
const MOST_SNAPSHOTS: usize = 1_000_000;

/// The current position in a file, for errors.
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
    /// Reads a recording from a file with one JSON object per line, or from standard input if `path` is `-`.
    ///
    /// # Errors
    /// [`TaskError::File`] if the file cannot be read; [`TaskError::Input`] if a line is invalid, see
    /// [`Recording::parse`].
    pub fn read(path: &Path) -> Result<Self, TaskError> {
        Ok(Self::read_labelled(path)?.0)
    }

    /// Reads a recording and, separately, a person's labels for the actions.
    ///
    /// # Errors
    /// As [`Recording::read`].
    pub fn read_labelled(path: &Path) -> Result<(Self, Labels), TaskError> {
        let bytes = read_file(path, Limit::RECORDING)?;
        Ok(Self::parse(&bytes, &path.display().to_string())?)
    }

    /// Reads a recording from the bytes of a file. `file` is the file's name in error messages. Never panics.
    ///
    /// # Errors
    /// [`InputFault`] for the first faulty line: one that is not a JSON object, has an unknown field, lacks a field,
    /// has a number that is not finite, has an orientation that is not a unit quaternion, uses an id twice, or is out
    /// of order.
    pub fn parse(bytes: &[u8], file: &str) -> Result<(Self, Labels), InputFault> {
        let (recording, labels, _) = Self::parse_whole(bytes, file)?;
        Ok((recording, labels))
    }

    /// Reads a recording from the bytes of a file, with a person's labels for the actions and the attributes of the objects.
    ///
    /// # Errors
    /// As [`Recording::parse`], and if an attribute is neither a word nor a number, or changes in a demonstration.
    pub fn parse_whole(bytes: &[u8], file: &str) -> Result<(Self, Labels, Attributes), InputFault> {
        let mut attributes = Attributes::default();
        let nowhere = Place { file, line: None };
        let mut recording = Self::default();
        let mut labels = Labels::new();
        let mut seen = HashSet::new();
        let (mut words, mut snapshots) = (HashSet::new(), 0);
        let mut kinds: HashMap<Arc<str>, Arc<str>> = HashMap::new();
        for (index, line) in bytes.split(|b| *b == b'\n').enumerate() {
            let place = Place { file, line: Some(index + 1) };
            let line = line.strip_suffix(b"\r").unwrap_or(line);
            if line.iter().all(u8::is_ascii_whitespace) {
                continue;
            }
            snapshots += 1;
            if snapshots > MOST_SNAPSHOTS {
                let expected = format!("at most {MOST_SNAPSHOTS} snapshots");
                return Err(place.fault("", "the recording has too many snapshots", expected));
            }
            if line.len() > LONGEST_LINE {
                let problem = format!("the line has {} bytes", line.len());
                return Err(place.fault("", problem, format!("at most {LONGEST_LINE} bytes")));
            }
            let mut raw: RawSnapshot<'_> = parse_json(utf8(line, place)?, place)?;
            let required = |field, value: Option<u64>| {
                value.ok_or_else(|| place.fault(field, "it is missing", "a whole number"))
            };
            let number = required("demo", raw.demo)?;
            let snapshot_number = required("snapshot", raw.snapshot)?;
            let label = raw.next_action.take();
            let new = recording.demos.last().is_none_or(|d| d.number != number);
            let demo = recording.demos.len() - usize::from(!new);
            let noted = (&mut attributes, demo);
            let snapshot = check_snapshot(raw, snapshot_number, place, &mut words, noted)?;
            if new {
                if !seen.insert(number) {
                    let problem = format!("demonstration {number} continues after another one");
                    return Err(place.fault(
                        "demo",
                        problem,
                        "all lines of a demonstration in one block",
                    ));
                }
                kinds.clear();
                recording.demos.push(Demonstration { number, snapshots: Vec::new() });
                labels.push(Vec::new());
            }
            for object in &snapshot.objects {
                let kind = kinds.entry(object.id.clone()).or_insert_with(|| object.kind.clone());
                if **kind != *object.kind {
                    let problem = format!(
                        "`{}` has the kind `{}`, but had the kind `{kind}` before",
                        object.id, object.kind
                    );
                    let expected = "the same kind for an id in all snapshots of a demonstration";
                    return Err(place.fault("objects", problem, expected));
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
            return Err(nowhere.fault("", "it holds no snapshot", "one JSON object per line"));
        }
        Ok((recording, labels, attributes))
    }
}

impl Snapshot {
    /// Reads a single scene from a file with one JSON object, or from standard input if `path` is `-`.
    ///
    /// # Errors
    /// [`TaskError::File`] if the file cannot be read; [`TaskError::Input`] if it is not exactly one valid snapshot.
    pub fn read(path: &Path) -> Result<Self, TaskError> {
        let bytes = read_file(path, Limit::SCENE)?;
        Ok(Self::parse(&bytes, &path.display().to_string())?)
    }

    /// Reads a single scene from the bytes of a file. `file` is the file's name in error messages. Never panics.
    ///
    /// # Errors
    /// [`InputFault`] if the bytes are not exactly one valid snapshot.
    pub fn parse(bytes: &[u8], file: &str) -> Result<Self, InputFault> {
        Ok(Self::parse_attributed(bytes, file)?.0)
    }

    /// Reads a single scene and, separately, the attributes of its objects from the bytes of a file.
    ///
    /// # Errors
    /// As [`Snapshot::parse`], and if an attribute is neither a word nor a number.
    pub fn parse_attributed(bytes: &[u8], file: &str) -> Result<(Self, Attributes), InputFault> {
        let place = Place { file, line: None };
        let text = utf8(bytes, place)?;
        let mut stream = serde_json::Deserializer::from_str(text).into_iter::<RawSnapshot<'_>>();
        let raw = match stream.next() {
            Some(Ok(raw)) => raw,
            Some(Err(error)) => return Err(json_fault(&error, place, true)),
            None => return Err(place.fault("", "it is empty", "one snapshot as a JSON object")),
        };
        if !text[stream.byte_offset()..].trim().is_empty() {
            return Err(place.fault("", "it holds more than one snapshot", "exactly one snapshot"));
        }
        let number = raw.snapshot.unwrap_or(0);
        let mut attributes = Attributes::default();
        let noted = (&mut attributes, 0);
        let scene = check_snapshot(raw, number, place, &mut HashSet::new(), noted)?;
        Ok((scene, attributes))
    }
}

fn utf8<'a>(bytes: &'a [u8], place: Place<'_>) -> Result<&'a str, InputFault> {
    // Some editors begin a text with a byte order mark.
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    std::str::from_utf8(bytes).map_err(|error| {
        let problem = format!("byte {} is not UTF-8", error.valid_up_to());
        place.fault("", problem, "UTF-8 text")
    })
}

fn parse_json<'a, T: Deserialize<'a>>(text: &'a str, place: Place<'_>) -> Result<T, InputFault> {
    // Serde would read an array as an object's fields in order.
    if text.trim_start().starts_with('[') {
        return Err(place.fault("", "it is an array", "a JSON object"));
    }
    serde_json::from_str(text).map_err(|error| json_fault(&error, place, false))
}

/// Turns a JSON error into a fault. If the object is the whole file, the error's line is the line in the file.
fn json_fault(error: &serde_json::Error, place: Place<'_>, whole_file: bool) -> InputFault {
    let place = if whole_file { Place { line: Some(error.line()), ..place } } else { place };
    let problem = format!("{} (column {})", json_problem(error), error.column());
    let expected = match error.classify() {
        serde_json::error::Category::Eof => "a complete JSON object",
        serde_json::error::Category::Syntax => "a JSON object",
        _ => {
            "the fields `demo`, `snapshot`, `next_action`, `t`, `event`, `object` and `objects` \
             with `id`, `kind`, `position` [3] and `orientation` [4]"
        }
    };
    place.fault("", problem, expected)
}

/// Returns `word`, shared with all its earlier uses.
fn shared(words: &mut HashSet<Arc<str>>, word: &str) -> Arc<str> {
    if let Some(known) = words.get(word) {
        return known.clone();
    }
    let new: Arc<str> = word.into();
    words.insert(new.clone());
    new
}

/// Checks a snapshot. `words` are the ids and kinds of the file so far. Attributes are noted for the demonstration of this
/// index.
fn check_snapshot(
    raw: RawSnapshot<'_>,
    number: u64,
    place: Place<'_>,
    words: &mut HashSet<Arc<str>>,
    (attributes, demo): (&mut Attributes, usize),
) -> Result<Snapshot, InputFault> {
    if let Some(t) = raw.t
        && !t.is_finite()
    {
        return Err(place.fault("t", format!("it is {t}"), "a finite number of seconds"));
    }
    let mut objects: Vec<ObjectPose> = Vec::with_capacity(raw.objects.len());
    let mut ids: HashMap<Arc<str>, usize> = HashMap::with_capacity(raw.objects.len());
    for (index, object) in raw.objects.into_iter().enumerate() {
        let field = |name: &str| format!("objects[{index}].{name}");
        for (name, text) in [("id", &object.id), ("kind", &object.kind)] {
            if let Some(problem) = unfit(text) {
                return Err(place.fault(field(name), problem, FIT_NAME));
            }
        }
        let pose = check_pose(object.position, object.orientation, &field, place)?;
        let (id, kind) = (shared(words, &object.id), shared(words, &object.kind));
        if ids.insert(id.clone(), index).is_some() {
            let problem = format!("the id `{id}` is used twice");
            return Err(place.fault(field("id"), problem, "each id once per snapshot"));
        }
        if let Some(own) = object.attributes {
            attributes.read(demo, &id, own).map_err(|(name, problem, expected)| {
                place.fault(field(&format!("attributes.{name}")), problem, expected)
            })?;
        }
        objects.push(ObjectPose { id, kind, pose });
    }
    let touched = match &raw.object {
        None => None,
        Some(id) => Some(*ids.get(&**id).ok_or_else(|| {
            let known = || objects.iter().map(|o| &*o.id);
            let expected = if objects.is_empty() {
                "no `object`, as the snapshot has no objects".into()
            } else {
                format!("an id of this snapshot's objects: {}", nearest_first(id, known()))
            };
            let problem = format!("no object is called `{id}`{}", meant(id, known()));
            place.fault("object", problem, expected)
        })?),
    };
    if matches!(raw.event, Some(SnapshotEvent::Start | SnapshotEvent::End)) && touched.is_some() {
        let problem = "it is set although the event is `start` or `end`";
        return Err(place.fault("object", problem, "no `object` with these events"));
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
                format!("it is {value}"),
                format!("a finite number of metres, at most {FARTHEST:e} in magnitude"),
            ));
        }
    }
    let norm = orientation.iter().map(|v| v * v).sum::<f64>().sqrt();
    if !norm.is_finite() || (norm - 1.0).abs() > NORM_TOLERANCE {
        let greatest = orientation.iter().fold(0.0f64, |most, v| most.max(v.abs()));
        let angles = match greatest {
            g if g > std::f64::consts::TAU => ": the numbers are probably angles in degrees",
            g if g > 1.5 => ": the numbers are probably angles",
            _ => "",
        };
        return Err(place.fault(
            field("orientation"),
            format!("its norm is {norm}{angles}"),
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
            "the next number, as lines are in time order",
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
