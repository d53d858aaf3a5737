//! Writes logs of ROS 2 as MCAP: messages in CDR with their definitions, or in JSON.

// Each test binary uses only some of these functions.
#![allow(dead_code)]

use std::collections::BTreeMap;
use std::io::Cursor;

use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions, Writer};

const LINE: &str =
    "================================================================================";
const TIME: &str = "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
const HEADER: &str = "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n";
const POINT: &str = "MSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n";
const VECTOR: &str = "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n";
const TURN: &str =
    "MSG: geometry_msgs/Quaternion\nfloat64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n";
const POSE: &str = "MSG: geometry_msgs/Pose\nPoint position\nQuaternion orientation\n";
const TRANSFORM: &str = "MSG: geometry_msgs/Transform\nVector3 translation\nQuaternion rotation\n";
const STAMPED: &str = "MSG: geometry_msgs/TransformStamped\nstd_msgs/Header header\nstring child_frame_id\nTransform transform\n";
const COVARIANCE: &str =
    "MSG: geometry_msgs/PoseWithCovariance\nPose pose\nfloat64[36] covariance\n";
const DETECTION: &str = "MSG: vision_msgs/Detection3D\nstd_msgs/Header header\n\nObjectHypothesisWithPose[] results\nBoundingBox3D bbox\nstring id\n";
const HYPOTHESES: &str = "MSG: vision_msgs/ObjectHypothesisWithPose\nObjectHypothesis hypothesis\ngeometry_msgs/PoseWithCovariance pose\n";
const HYPOTHESIS: &str = "MSG: vision_msgs/ObjectHypothesis\nstring class_id\nfloat64 score\n";
const BOX: &str =
    "MSG: vision_msgs/BoundingBox3D\ngeometry_msgs/Pose center\ngeometry_msgs/Vector3 size\n";

fn schema(own: &str, used: &[&str]) -> String {
    used.iter().fold(own.to_owned(), |text, one| format!("{text}\n{LINE}\n{one}"))
}

/// Returns the definition of a type.
pub fn definition(kind: &str) -> String {
    match kind {
        "geometry_msgs/msg/PoseStamped" => {
            schema("std_msgs/Header header\nPose pose\n", &[HEADER, TIME, POSE, POINT, TURN])
        }
        "geometry_msgs/msg/PoseArray" => {
            schema("std_msgs/Header header\nPose[] poses\n", &[HEADER, TIME, POSE, POINT, TURN])
        }
        "tf2_msgs/msg/TFMessage" => schema(
            "geometry_msgs/TransformStamped[] transforms\n",
            &[STAMPED, HEADER, TIME, TRANSFORM, VECTOR, TURN],
        ),
        "vision_msgs/msg/Detection3DArray" => schema(
            "std_msgs/Header header\nDetection3D[] detections\n",
            &[
                DETECTION, HEADER, TIME, HYPOTHESES, HYPOTHESIS, COVARIANCE, BOX, POSE, POINT,
                TURN, VECTOR,
            ],
        ),
        "sensor_msgs/msg/JointState" => schema(
            "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n",
            &[HEADER, TIME],
        ),
        "std_msgs/msg/Bool" => "bool data\n".into(),
        "std_msgs/msg/Float32" => "float32 data\n".into(),
        "sensor_msgs/msg/Image" => {
            schema("std_msgs/Header header\nuint8[] data\n", &[HEADER, TIME])
        }
        other => panic!("{other} has no definition here"),
    }
}

/// A message in CDR.
#[derive(Clone)]
pub struct Cdr {
    bytes: Vec<u8>,
    little: bool,
}

impl Cdr {
    pub fn new() -> Self {
        Self { bytes: vec![0, 1, 0, 0], little: true }
    }

    pub fn big() -> Self {
        Self { bytes: vec![0, 0, 0, 0], little: false }
    }

    fn put<const N: usize>(mut self, mut own: [u8; N]) -> Self {
        while !(self.bytes.len() - 4).is_multiple_of(N) {
            self.bytes.push(0);
        }
        if !self.little {
            own.reverse();
        }
        self.bytes.extend(own);
        self
    }

    pub fn flag(self, value: bool) -> Self {
        self.put([u8::from(value)])
    }

    pub fn count(self, value: usize) -> Self {
        self.put((value as u32).to_le_bytes())
    }

    pub fn float(self, value: f32) -> Self {
        self.put(value.to_le_bytes())
    }

    pub fn numbers(self, values: &[f64]) -> Self {
        values.iter().fold(self, |own, value| own.put(value.to_le_bytes()))
    }

    pub fn text(self, text: &str) -> Self {
        let mut own = self.count(text.len() + 1);
        own.bytes.extend(text.as_bytes());
        own.bytes.push(0);
        own
    }

    /// A header with a stamp in nanoseconds.
    pub fn header(self, t: u64, frame: &str) -> Self {
        self.count((t / 1_000_000_000) as usize).count((t % 1_000_000_000) as usize).text(frame)
    }

    pub fn bytes(self) -> Vec<u8> {
        self.bytes
    }
}

/// Position and quaternion x, y, z, w.
pub type Numbers = [f64; 7];

pub fn pose_stamped(t: u64, frame: &str, pose: &Numbers) -> Vec<u8> {
    Cdr::new().header(t, frame).numbers(pose).bytes()
}

/// Transforms of children in a parent.
pub fn transforms(t: u64, edges: &[(&str, &str, Numbers)]) -> Vec<u8> {
    let start = Cdr::new().count(edges.len());
    let all = edges
        .iter()
        .fold(start, |own, (parent, child, pose)| own.header(t, parent).text(child).numbers(pose));
    all.bytes()
}

/// Detections with an id, a class and a pose.
pub fn detections(t: u64, frame: &str, all: &[(&str, &str, Numbers)]) -> Vec<u8> {
    let start = Cdr::big().header(t, frame).count(all.len());
    let all = all.iter().fold(start, |own, (id, class, pose)| {
        let own = own.header(t, frame).count(1).text(class).numbers(&[0.9]);
        let own = own.numbers(pose).numbers(&[0.0; 36]);
        own.numbers(pose).numbers(&[0.1; 3]).text(id)
    });
    all.bytes()
}

pub fn joints(t: u64, all: &[(&str, f64)]) -> Vec<u8> {
    let names =
        all.iter().fold(Cdr::new().header(t, "").count(all.len()), |own, (name, _)| own.text(name));
    let positions = all.iter().fold(names.count(all.len()), |own, (_, at)| own.numbers(&[*at]));
    positions.count(0).count(0).bytes()
}

/// How a log is written.
#[derive(Debug, Clone, Copy)]
pub enum Packing {
    Zstd,
    Lz4,
    Chunks,
    Plain,
}

/// A message: topic, type, time of the log in nanoseconds, bytes.
pub type Message = (String, &'static str, u64, Vec<u8>);

/// Writes a log whose schemas are in a language, such as `ros2msg`.
pub fn bag_in(language: &str, encoding: &str, packing: Packing, messages: &[Message]) -> Vec<u8> {
    let options = WriteOptions::new().profile("ros2").chunk_size(Some(4096));
    let options = match packing {
        Packing::Zstd => options.compression(Some(Compression::Zstd)),
        Packing::Lz4 => options.compression(Some(Compression::Lz4)),
        Packing::Chunks => options.compression(None),
        Packing::Plain => options.compression(None).use_chunks(false),
    };
    let mut writer: Writer<Cursor<Vec<u8>>> =
        options.create(Cursor::new(Vec::new())).expect("a writer");
    let mut channels: BTreeMap<(String, &str), u16> = BTreeMap::new();
    for (sequence, (topic, kind, t, data)) in messages.iter().enumerate() {
        let key = (topic.clone(), *kind);
        let channel_id = *channels.entry(key).or_insert_with(|| {
            let text = if language == "ros2msg" { definition(kind) } else { "module x {};".into() };
            let schema = writer.add_schema(kind, language, text.as_bytes()).expect("a schema");
            writer.add_channel(schema, topic, encoding, &BTreeMap::new()).expect("a channel")
        });
        let header =
            MessageHeader { channel_id, sequence: sequence as u32, log_time: *t, publish_time: *t };
        writer.write_to_known_channel(&header, data).expect("a message");
    }
    writer.finish().expect("the end");
    writer.into_inner().into_inner()
}

pub fn bag(packing: Packing, messages: &[Message]) -> Vec<u8> {
    bag_in("ros2msg", "cdr", packing, messages)
}
