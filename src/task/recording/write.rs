//! Writes recordings and scenes as JSON.

use std::fmt::Write as _;

use serde::Serialize;

use crate::task::error::TaskError;

use super::{Attributes, Labels, ObjectAttributes, ObjectPose, Recording, Snapshot, SnapshotEvent};

#[derive(Serialize)]
struct Line<'a> {
    #[serde(skip_serializing_if = "Option::is_none")]
    demo: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    snapshot: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    next_action: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    t: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    event: Option<SnapshotEvent>,
    #[serde(skip_serializing_if = "Option::is_none")]
    object: Option<&'a str>,
    objects: Vec<LineObject<'a>>,
}

#[derive(Serialize)]
struct LineObject<'a> {
    id: &'a str,
    kind: &'a str,
    position: [f64; 3],
    orientation: [f64; 4],
    #[serde(skip_serializing_if = "Option::is_none")]
    attributes: Option<&'a ObjectAttributes>,
}

impl<'a> Line<'a> {
    fn of(snapshot: &'a Snapshot, attributes: Option<(&'a Attributes, usize)>) -> Self {
        let object = |o: &'a ObjectPose| LineObject {
            id: &o.id,
            kind: &o.kind,
            position: o.pose.position,
            orientation: o.pose.orientation,
            attributes: attributes.and_then(|(all, demo)| all.get(demo, &o.id)),
        };
        Self {
            demo: None,
            snapshot: None,
            next_action: None,
            t: snapshot.time_s,
            event: snapshot.event,
            object: snapshot.object.and_then(|i| snapshot.objects.get(i)).map(|o| &*o.id),
            objects: snapshot.objects.iter().map(object).collect(),
        }
    }

    fn text(&self, what: &'static str) -> Result<String, TaskError> {
        serde_json::to_string(self).map_err(|source| TaskError::Json { what, source })
    }
}

impl Recording {
    /// Writes the recording as text with one JSON object per line. `labels` adds a person's names for the actions.
    ///
    /// # Errors
    /// [`TaskError::Json`] if serialisation fails. This is not known to happen.
    pub fn to_jsonl(&self, labels: Option<&Labels>) -> Result<String, TaskError> {
        self.to_jsonl_attributed(labels, &Attributes::default())
    }

    /// Writes the recording as [`Recording::to_jsonl`] does, with the attributes of the objects.
    ///
    /// # Errors
    /// As [`Recording::to_jsonl`].
    pub fn to_jsonl_attributed(
        &self,
        labels: Option<&Labels>,
        attributes: &Attributes,
    ) -> Result<String, TaskError> {
        let noted = (!attributes.is_empty()).then_some(attributes);
        let mut text = String::new();
        for (d, demo) in self.demos.iter().enumerate() {
            for (s, snapshot) in demo.snapshots.iter().enumerate() {
                let line = Line {
                    demo: Some(demo.number),
                    snapshot: Some(snapshot.number),
                    next_action: labels
                        .and_then(|l| l.get(d))
                        .and_then(|l| l.get(s))
                        .and_then(Option::as_deref),
                    ..Line::of(snapshot, noted.map(|all| (all, d)))
                };
                let _ = writeln!(text, "{}", line.text("the recording")?);
            }
        }
        Ok(text)
    }
}

impl Snapshot {
    /// Writes the snapshot as one JSON object, the format that `symbolt plan --scene` reads.
    ///
    /// # Errors
    /// [`TaskError::Json`] if serialisation fails. This is not known to happen.
    pub fn to_json(&self) -> Result<String, TaskError> {
        Line::of(self, None).text("the scene")
    }
}
