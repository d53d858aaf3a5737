//! What the messages of robots say, by their types: poses, transforms between frames, and signals of the gripper.

use super::cdr::Value;
use crate::robot::Pose;

/// What messages of a type hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Shape {
    /// Transforms between frames.
    Transforms,
    /// One transform, of a child frame.
    Transform,
    /// The pose of one object.
    Pose,
    /// The pose of a frame of a vehicle.
    Odometry,
    /// Poses of objects in an order.
    Poses,
    Detections,
    Detection,
    Markers,
    Marker,
    /// Positions of joints, by name.
    Joints,
    Number,
    Flag,
    /// The state of a gripper.
    Gripper,
}

impl Shape {
    /// Returns what messages of a type hold; `None` if they are not used.
    pub fn of(kind: &str) -> Option<Self> {
        let name = kind.rsplit(['/', '.', ':']).next().unwrap_or(kind);
        Some(match name {
            "TFMessage" | "FrameTransforms" => Self::Transforms,
            "TransformStamped" | "FrameTransform" => Self::Transform,
            "PoseStamped"
            | "PoseWithCovarianceStamped"
            | "Pose"
            | "PoseWithCovariance"
            | "Transform"
            | "PoseInFrame" => Self::Pose,
            "Odometry" => Self::Odometry,
            "PoseArray" | "PosesInFrame" => Self::Poses,
            "Detection3DArray" => Self::Detections,
            "Detection3D" => Self::Detection,
            "MarkerArray" => Self::Markers,
            "Marker" => Self::Marker,
            "JointState" => Self::Joints,
            "Float32" | "Float64" | "Float32Stamped" | "Float64Stamped" | "UInt8" | "Int32" => {
                Self::Number
            }
            "Bool" | "BoolStamped" => Self::Flag,
            name if name.to_ascii_lowercase().contains("gripper") => Self::Gripper,
            _ => return None,
        })
    }

    /// Returns whether messages give poses of objects.
    pub fn poses(self) -> bool {
        !matches!(self, Self::Joints | Self::Number | Self::Flag | Self::Gripper)
    }
}

/// What a part of a message says.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Reading<'a> {
    /// The pose of a frame in its parent.
    Edge { parent: &'a str, child: &'a str, pose: Pose },
    /// The pose of an object in a frame. An empty id stands for the topic, an empty frame for that of the log.
    Pose { id: String, kind: Option<String>, frame: &'a str, pose: Pose },
    /// Objects of this message have numbers by their places in it.
    Numbered,
    /// A pose whose numbers are none.
    Unseen,
    /// A number or a flag of the gripper.
    Signal(f64),
}

/// Numbers of a record, by name.
fn numbers<const N: usize>(value: &Value<'_>, names: [&str; N]) -> Option<[f64; N]> {
    let mut found = [0.0; N];
    for (slot, name) in found.iter_mut().zip(names) {
        *slot = value.get(name)?.number().filter(|number| number.is_finite())?;
    }
    Some(found)
}

/// Returns the pose in a record, however deep it stands; `None` if there is none, or if its numbers are none.
fn pose(value: &Value<'_>) -> Option<Pose> {
    let mut value = value;
    for _ in 0..4 {
        for (place, turn) in [("position", "orientation"), ("translation", "rotation")] {
            let (Some(place), Some(turn)) = (value.get(place), value.get(turn)) else { continue };
            return Some(Pose {
                position: numbers(place, ["x", "y", "z"])?,
                orientation: numbers(turn, ["x", "y", "z", "w"])?,
            });
        }
        value = value.get("pose").or_else(|| value.get("transform"))?;
    }
    None
}

fn text<'a>(value: &'a Value<'_>, name: &str) -> &'a str {
    match value.get(name) {
        Some(Value::Text(text)) => text,
        _ => "",
    }
}

/// Returns a frame's name without the stroke that older logs put before it.
fn frame<'a>(value: &'a Value<'_>) -> &'a str {
    let own = text(value, "frame_id");
    let own =
        if own.is_empty() { value.get("header").map_or("", |h| text(h, "frame_id")) } else { own };
    own.trim_start_matches('/')
}

fn stamp_in(value: &Value<'_>) -> Option<i64> {
    let whole = value.get("sec").or_else(|| value.get("secs"))?.number()?;
    let rest = ["nanosec", "nsec", "nsecs"].iter().find_map(|name| value.get(name)?.number())?;
    // Nanoseconds since 1970 fit until the year 2262.
    let inside = (0.0..9e9).contains(&whole) && (0.0..=4.3e9).contains(&rest);
    inside.then_some(whole as i64 * 1_000_000_000 + rest as i64)
}

/// Returns the time that a message gives itself, in nanoseconds. Zero may be a time, or none.
pub(crate) fn stamp(value: &Value<'_>) -> Option<i64> {
    let header = value.get("header").and_then(|header| header.get("stamp"));
    header.or_else(|| value.get("timestamp")).or_else(|| value.get("stamp")).and_then(stamp_in)
}

/// Calls `tell` with each thing that a message says, and the time that this part gives itself.
pub(crate) fn read<'a>(
    shape: Shape,
    message: &'a Value<'_>,
    joint: &dyn Fn(&str) -> bool,
    tell: &mut dyn FnMut(Option<i64>, Reading<'a>),
) {
    let own = stamp(message);
    match shape {
        Shape::Transforms => {
            for transform in message.get("transforms").map_or(&[][..], Value::list) {
                tell(stamp(transform), edge(transform));
            }
        }
        Shape::Transform => tell(own, edge(message)),
        Shape::Pose => tell(own, posed(message, String::new(), None, message)),
        Shape::Odometry => {
            let child = text(message, "child_frame_id").trim_start_matches('/').to_owned();
            tell(own, posed(message, child, None, message));
        }
        Shape::Poses => {
            for (index, pose) in
                message.get("poses").map_or(&[][..], Value::list).iter().enumerate()
            {
                tell(own, posed(pose, format!("*_{index}"), None, message));
            }
        }
        Shape::Detections => {
            let all = message.get("detections").map_or(&[][..], Value::list);
            let mut kinds: Vec<String> = Vec::new();
            for detection in all {
                let reading = detected(detection, message, &mut kinds);
                let inner = stamp(detection);
                tell(inner.filter(|t| *t != 0).or(own).or(inner), reading);
            }
            if !kinds.is_empty() {
                tell(own, Reading::Numbered);
            }
        }
        Shape::Detection => tell(own, detected(message, message, &mut Vec::new())),
        Shape::Markers => {
            for marker in message.get("markers").map_or(&[][..], Value::list) {
                if let Some(reading) = marked(marker) {
                    tell(stamp(marker), reading);
                }
            }
        }
        Shape::Marker => {
            if let Some(reading) = marked(message) {
                tell(own, reading);
            }
        }
        Shape::Joints => {
            let names = message.get("name").map_or(&[][..], Value::list);
            let positions = message.get("position").map_or(&[][..], Value::list);
            let named = names.iter().zip(positions).filter_map(|(name, position)| {
                let name = name.text()?;
                joint(&name).then(|| position.number()).flatten()
            });
            // Fingers that move against each other have positions of either sign.
            if let Some(sum) = named.map(f64::abs).reduce(|sum, own| sum + own) {
                signal(own, Some(sum), tell);
            }
        }
        Shape::Number | Shape::Flag => {
            signal(own, message.get("data").and_then(Value::number), tell);
        }
        Shape::Gripper => {
            let inner =
                message.get("feedback").or_else(|| message.get("status")).unwrap_or(message);
            let named = ["width", "opening", "position", "gap"];
            let found = named.iter().find_map(|name| inner.get(name)?.number());
            signal(own, found, tell);
        }
    }
}

fn signal<'a>(
    own: Option<i64>,
    value: Option<f64>,
    tell: &mut dyn FnMut(Option<i64>, Reading<'a>),
) {
    if let Some(value) = value.filter(|value| value.is_finite()) {
        tell(own, Reading::Signal(value));
    }
}

fn edge<'a>(value: &'a Value<'_>) -> Reading<'a> {
    let parent = text(value, "parent_frame_id").trim_start_matches('/');
    let parent = if parent.is_empty() { frame(value) } else { parent };
    let child = text(value, "child_frame_id").trim_start_matches('/');
    match pose(value) {
        Some(pose) if !child.is_empty() => Reading::Edge { parent, child, pose },
        _ => Reading::Unseen,
    }
}

fn posed<'a>(
    value: &Value<'_>,
    id: String,
    kind: Option<String>,
    message: &'a Value<'_>,
) -> Reading<'a> {
    match pose(value) {
        Some(pose) => Reading::Pose { id, kind, frame: frame(message), pose },
        None => Reading::Unseen,
    }
}

/// Reads a detection. Without an id of its own it is the next of its kind in the message.
fn detected<'a>(
    detection: &'a Value<'_>,
    message: &'a Value<'_>,
    kinds: &mut Vec<String>,
) -> Reading<'a> {
    let results = detection.get("results").map_or(&[][..], Value::list);
    let hypothesis = |result: &'a Value<'_>| result.get("hypothesis").unwrap_or(result);
    let score = |result: &&'a Value<'_>| {
        hypothesis(result).get("score").and_then(Value::number).unwrap_or(0.0)
    };
    let best =
        results.iter().reduce(|best, own| if score(&own) > score(&best) { own } else { best });
    let class = best.and_then(|result| {
        let own = hypothesis(result);
        own.get("class_id").or_else(|| own.get("id"))?.text()
    });
    let kind = class.map(|class| class.into_owned()).filter(|class| !class.is_empty());
    let id = match ["id", "tracking_id"].iter().find_map(|name| detection.get(name)?.text()) {
        Some(id) if !id.is_empty() => id.into_owned(),
        _ => {
            let kind = kind.clone().unwrap_or_else(|| "object".into());
            let number = kinds.iter().filter(|known| **known == kind).count();
            let id = format!("{kind}_{number}");
            kinds.push(kind);
            id
        }
    };
    // Many detectors leave the pose of a result as it was made: at the origin, and without an orientation.
    let empty = |pose: &Pose| pose.position == [0.0; 3] && pose.orientation[..3] == [0.0; 3];
    let inside = best.and_then(pose).filter(|pose| !empty(pose));
    let of_box = || detection.get("bbox").and_then(|bbox| pose(bbox.get("center")?));
    let frame = if frame(detection).is_empty() { frame(message) } else { frame(detection) };
    match inside.or_else(of_box) {
        Some(pose) => Reading::Pose { id, kind, frame, pose },
        None => Reading::Unseen,
    }
}

/// Reads a marker; `None` if it stands for no body.
fn marked<'a>(marker: &'a Value<'_>) -> Option<Reading<'a>> {
    let number = |name: &str| marker.get(name).and_then(Value::number).unwrap_or(0.0);
    // Arrows, cubes, spheres, cylinders and meshes, where they are set; lines, points and texts are no bodies.
    let body = [0.0, 1.0, 2.0, 3.0, 10.0].contains(&number("type")) && number("action") == 0.0;
    let name = text(marker, "ns").rsplit('/').next().unwrap_or_default();
    let name = if name.is_empty() { "marker" } else { name };
    body.then(|| posed(marker, format!("{name}_{}", number("id")), None, marker))
}
