//! The mapping: which columns of a log hold what, and in which units, axes and frame.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::columns::names_a_hand;
use crate::logs::{DatasetMap, TopicMap, fits};
use crate::robot::Pose;
use crate::task::error::{InputFault, TaskError, json_problem};

/// Value of `format` in a mapping file.
pub const FORMAT: &str = "symbolt-import";
/// Version of mapping files.
pub const VERSION: u32 = 1;

/// A name that no value has. It lists those that there are.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected one of {0}")]
pub struct UnknownName(String);

/// Makes an enum whose values have a name in files and on the command line.
macro_rules! named {
    ($(#[$doc:meta])* $name:ident { $($(#[$about:meta])* $value:ident = $text:literal,)* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
        pub enum $name { $($(#[$about])* #[serde(rename = $text)] $value,)* }

        impl $name {
            /// All values.
            pub const ALL: &[Self] = &[$(Self::$value,)*];

            /// Returns the name in files and on the command line.
            pub fn name(self) -> &'static str {
                match self { $(Self::$value => $text,)* }
            }

        }

        impl std::str::FromStr for $name {
            type Err = UnknownName;

            fn from_str(name: &str) -> Result<Self, UnknownName> {
                Self::ALL.iter().copied().find(|value| value.name() == name).ok_or_else(|| {
                    let names: Vec<&str> = Self::ALL.iter().map(|value| value.name()).collect();
                    UnknownName(names.join(", "))
                })
            }
        }
    };
}

named! {
    /// Unit of positions.
    Length {
        /// Metres.
        Metre = "m",
        /// Millimetres.
        Millimetre = "mm",
        /// Centimetres.
        Centimetre = "cm",
        /// Inches of 25.4 mm.
        Inch = "inch",
    }
}

impl Length {
    /// Returns the unit in metres.
    pub fn metres(self) -> f64 {
        match self {
            Self::Metre => 1.0,
            Self::Millimetre => 1e-3,
            Self::Centimetre => 1e-2,
            Self::Inch => 0.0254,
        }
    }
}

named! {
    /// Unit of times.
    TimeUnit {
        /// Seconds.
        Second = "s",
        /// Milliseconds.
        Millisecond = "ms",
        /// Microseconds.
        Microsecond = "us",
        /// Nanoseconds.
        Nanosecond = "ns",
    }
}

impl TimeUnit {
    /// Returns the unit in seconds.
    pub fn seconds(self) -> f64 {
        match self {
            Self::Second => 1.0,
            Self::Millisecond => 1e-3,
            Self::Microsecond => 1e-6,
            Self::Nanosecond => 1e-9,
        }
    }
}

named! {
    /// Unit of angles.
    Angle {
        /// Radians.
        Radian = "rad",
        /// Degrees.
        Degree = "deg",
    }
}

named! {
    /// Order of the four numbers of a quaternion.
    QuaternionOrder {
        /// The real part stands last.
        Xyzw = "xyzw",
        /// The real part stands first.
        Wxyz = "wxyz",
    }
}

named! {
    /// What three numbers of a rotation are.
    Rotation {
        /// A rotation vector: axis times angle.
        Vector = "vector",
        /// Roll, pitch and yaw about the fixed axes x, y and z, in this order.
        Euler = "euler",
    }
}

named! {
    /// Axis of the log that points up.
    Up {
        /// The x axis.
        X = "x",
        /// The y axis.
        Y = "y",
        /// The z axis.
        Z = "z",
        /// Against the x axis.
        MinusX = "-x",
        /// Against the y axis.
        MinusY = "-y",
        /// Against the z axis.
        MinusZ = "-z",
    }
}

named! {
    /// Handedness of the log's axes.
    Handed {
        /// The axes are right-handed.
        Right = "right",
        /// The axes are left-handed.
        Left = "left",
    }
}

/// Columns that hold the pose of one object. Columns are given by name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PoseColumns {
    /// Columns of x, y and z.
    pub position: [String; 3],
    /// Four columns of a quaternion in the mapping's order, three of a rotation, nine of a matrix by rows, or none.
    #[serde(default)]
    pub rotation: Vec<String>,
}

/// How to read the tables whose file names match a pattern.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TableMap {
    /// Pattern of file names; `*` stands for any text. Empty: all files.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub files: String,
    /// Number of rows of the header; names of several rows are joined by a dot.
    pub header_rows: Option<usize>,
    /// Character between fields: `,`, `;`, a tab, `|` or a space, which stands for several.
    pub delimiter: Option<char>,
    /// Column of time.
    pub time: Option<String>,
    /// The first column counts the rows, from 0, of the table of the same session whose file name matches this pattern.
    pub row_of: Option<String>,
    /// Column of the object's id: one row for each time and object.
    pub id: Option<String>,
    /// Column of the object's kind.
    pub kind: Option<String>,
    /// Columns of each object, by id. In a table with a column of ids the id is `*`.
    pub objects: BTreeMap<String, PoseColumns>,
    /// Column of the gripper's width. Any unit; open is wider.
    pub width: Option<String>,
    /// Column that says whether the gripper holds something.
    pub grasp: Option<String>,
    /// Columns that say whether the gripper touches an object, by the object's id (`*` in a table with a column of ids).
    pub contact: BTreeMap<String, String>,
    /// Unit of positions, if it differs from the mapping's.
    pub length: Option<Length>,
    /// Pose of this table's frame of reference in the world, if it differs from the mapping's.
    pub frame: Option<Pose>,
}

/// What a log means. What is not given is guessed from the log, and each guess is reported.
///
/// ```
/// use symbolt::task::import::{Length, Mapping};
///
/// let text = r#"{"format": "symbolt-import", "version": 1, "length": "mm", "kinds": {"cup_*": "cup"}}"#;
/// let mapping = Mapping::parse(text.as_bytes(), "map.json")?;
/// assert_eq!(mapping.length, Some(Length::Millimetre));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Mapping {
    /// Always [`FORMAT`].
    pub format: String,
    /// Always [`VERSION`].
    pub version: u32,
    /// Pattern of file names with `{session}`, and `{part}` where a session has several files one after the other.
    pub sessions: Option<String>,
    /// Column of the session.
    pub session: Option<String>,
    /// A longer gap in time begins a new session, in seconds.
    pub gap_s: Option<f64>,
    /// Unit of time.
    pub time_unit: Option<TimeUnit>,
    /// Unit of positions.
    pub length: Option<Length>,
    /// Unit of angles.
    pub angle: Option<Angle>,
    /// Order of quaternions whose columns do not name it.
    pub quaternion: Option<QuaternionOrder>,
    /// Meaning of three columns of a rotation.
    pub rotation: Option<Rotation>,
    /// Axis that points up.
    pub up: Option<Up>,
    /// Handedness of the axes.
    pub handed: Option<Handed>,
    /// Pose in the world of the frame in which the log gives poses, in metres, after `up` and `handed`.
    pub frame: Option<Pose>,
    /// Pattern of the id of the hand.
    pub hand: Option<String>,
    /// Kind of the objects whose id matches a pattern. Of several that match, an id counts first, then the longest.
    pub kinds: BTreeMap<String, String>,
    /// Patterns of columns and ids to leave out.
    pub ignore: Vec<String>,
    /// The tables. The first whose pattern matches the name of a file is used for it.
    pub tables: Vec<TableMap>,
    /// The topics of logs of messages. The first whose pattern matches the name of a topic is used for it; if there is any,
    /// other topics are not used.
    pub topics: Vec<TopicMap>,
    /// Name of the frame in which poses are taken, in logs with several frames.
    pub reference: Option<String>,
    /// The datasets of logs of arrays, for each group of sessions. Of a file that no pattern fits they are guessed.
    pub datasets: Vec<DatasetMap>,
    /// Number of rows a second, in logs of arrays without times.
    pub rate_hz: Option<f64>,
}

impl Mapping {
    /// Returns a mapping in which everything is to be guessed.
    pub fn unknown() -> Self {
        Self { format: FORMAT.into(), version: VERSION, ..Self::default() }
    }

    /// Reads a mapping from the bytes of a JSON file. `file` is its name in errors.
    ///
    /// # Errors
    /// [`InputFault`] if the bytes are no mapping, with the line and what was expected.
    pub fn parse(bytes: &[u8], file: &str) -> Result<Self, InputFault> {
        let fault = |line, field: &str, problem: String, expected: &str| InputFault {
            file: file.into(),
            line,
            field: field.into(),
            problem,
            expected: expected.into(),
        };
        let mapping: Self = serde_json::from_slice(bytes).map_err(|error| {
            let expected = "a mapping as `symbolt import LOG --dry-run` prints it";
            fault(Some(error.line()), "", json_problem(&error), expected)
        })?;
        if mapping.format != FORMAT {
            let problem = format!("it is `{}`", mapping.format);
            return Err(fault(None, "format", problem, FORMAT));
        }
        if mapping.version != VERSION {
            return Err(fault(None, "version", format!("it is {}", mapping.version), "1"));
        }
        if let Some(sessions) = &mapping.sessions
            && !sessions.contains("{session}")
        {
            let problem = format!("`{sessions}` does not say where the session stands");
            return Err(fault(None, "sessions", problem, "a pattern with {session}"));
        }
        if let Some(gap_s) = mapping.gap_s
            && !(gap_s > 0.0 && gap_s.is_finite())
        {
            return Err(fault(None, "gap_s", format!("it is {gap_s}"), "more than 0 seconds"));
        }
        let frames = mapping.tables.iter().filter_map(|table| table.frame.as_ref());
        let frames = frames.chain(mapping.topics.iter().filter_map(|topic| topic.frame.as_ref()));
        for frame in mapping.frame.iter().chain(frames) {
            let norm = frame.orientation.iter().map(|v| v * v).sum::<f64>().sqrt();
            if !((norm - 1.0).abs() < 1e-2 && frame.position.iter().all(|v| v.is_finite())) {
                let problem = format!("its orientation has the norm {norm}");
                let expected = "a position in metres and a unit quaternion x, y, z, w";
                return Err(fault(None, "frame", problem, expected));
            }
        }
        for (index, table) in mapping.tables.iter().enumerate() {
            for (id, columns) in &table.objects {
                if !matches!(columns.rotation.len(), 0 | 3 | 4 | 9) {
                    let field = format!("tables[{index}].objects.{id}.rotation");
                    let problem = format!("it has {} columns", columns.rotation.len());
                    return Err(fault(None, &field, problem, "no, 3, 4 or 9 columns"));
                }
            }
        }
        for (index, own) in mapping.topics.iter().enumerate() {
            let field = format!("topics[{index}].topic");
            if own.topic.is_empty() {
                let expected = "the name of a topic, or a pattern such as /objects/*";
                return Err(fault(None, &field, "it is empty".into(), expected));
            }
            if let Some(first) = mapping.topics[..index].iter().position(|t| t.topic == own.topic) {
                let problem = format!("it is `{}`, as in topics[{first}]", own.topic);
                let expected = "each topic once, with all its `objects`";
                return Err(fault(None, &field, problem, expected));
            }
        }
        if let Some(rate) = mapping.rate_hz
            && !(rate > 0.0 && rate.is_finite())
        {
            return Err(fault(None, "rate_hz", format!("it is {rate}"), "more than 0 Hz"));
        }
        Ok(mapping)
    }

    /// Writes the mapping as JSON.
    ///
    /// # Errors
    /// [`TaskError::Json`] if serialisation fails. This is not known to happen.
    pub fn to_json(&self) -> Result<String, TaskError> {
        let mut whole = serde_json::to_value(self)
            .map_err(|source| TaskError::Json { what: "the mapping", source })?;
        leave_out_unset(&mut whole);
        Ok(format!("{whole:#}"))
    }

    /// Returns how to read the file with this name.
    pub(super) fn table(&self, name: &str) -> Option<&TableMap> {
        let fits = |table: &&TableMap| table.files.is_empty() || fits(&table.files, name);
        self.tables.iter().find(fits)
    }

    /// Returns whether a column or an id is left out.
    pub(super) fn ignores(&self, name: &str) -> bool {
        self.ignore.iter().any(|pattern| fits(pattern, name))
    }

    /// Returns whether an id is that of the hand.
    pub(super) fn is_hand(&self, id: &str) -> bool {
        self.hand.as_ref().map_or_else(|| names_a_hand(id), |pattern| fits(pattern, id))
    }

    /// Returns the kind that the mapping gives to an id.
    pub(super) fn kind(&self, id: &str) -> Option<&str> {
        let fitting = self.kinds.iter().filter(|(pattern, _)| fits(pattern, id));
        let best = fitting.max_by_key(|(pattern, _)| (*pattern == id, pattern.len()));
        best.map(|(_, kind)| kind.as_str())
    }
}

/// Leaves out the keys that say nothing: null, an empty list, an empty object.
fn leave_out_unset(value: &mut Value) {
    match value {
        Value::Array(items) => items.iter_mut().for_each(leave_out_unset),
        Value::Object(keys) => {
            keys.values_mut().for_each(leave_out_unset);
            let says_nothing = |value: &Value| match value {
                Value::Array(items) => items.is_empty(),
                Value::Object(keys) => keys.is_empty(),
                other => other.is_null(),
            };
            keys.retain(|_, value| !says_nothing(value));
        }
        _ => {}
    }
}
