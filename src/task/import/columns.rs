//! What a column holds, by its name.

use super::mapping::{Angle, Length, TimeUnit};

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Field {
    Time,
    Id,
    Kind,
    Session,
    Position(usize),
    /// A component x, y, z or w of a quaternion, by name.
    Quaternion(usize),
    /// A component of a quaternion by its number, in an order that the name does not say.
    Component(usize),
    /// A component of a rotation of three numbers; whether they are angles is known from the name or not.
    Turn(usize, Option<bool>),
    /// An entry of a rotation matrix, by rows.
    Matrix(usize),
    Width,
    Grasp,
    Contact,
}

/// The unit at the end of a column's name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Unit {
    Length(Length),
    Time(TimeUnit),
    Angle(Angle),
}

/// A column whose name is known.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Column {
    pub field: Field,
    /// The id of the object, as far as the name says it.
    pub object: String,
    pub unit: Option<Unit>,
    /// Less is surer; `x` is surer to be a position than `tx`.
    pub doubt: u8,
}

const TURNS: [&str; 9] =
    ["orientation", "quaternion", "quat", "rotation", "rot", "q", "orient", "ori", "attitude"];
const PLACES: [&str; 9] =
    ["position", "pos", "pose", "translation", "trans", "transform", "point", "xyz", "location"];
const ANGLES: [&str; 2] = ["euler", "rpy"];
const VECTORS: [&str; 3] = ["rotvec", "rvec", "axisangle"];
const IDS: [&str; 16] = [
    "id",
    "object",
    "name",
    "label",
    "marker",
    "body",
    "objectid",
    "objectname",
    "trackid",
    "childframeid",
    "entity",
    "tag",
    "item",
    "bodyname",
    "rigidbody",
    "obj",
];
const KINDS: [&str; 7] =
    ["kind", "class", "type", "category", "objecttype", "classname", "objectclass"];
const SESSIONS: [&str; 13] = [
    "session",
    "demo",
    "episode",
    "trial",
    "run",
    "demonstration",
    "demoid",
    "episodeid",
    "sessionid",
    "trialid",
    "take",
    "episodeindex",
    "demoindex",
];
const TIMES: [&str; 16] = [
    "t",
    "time",
    "timestamp",
    "stamp",
    "sec",
    "secs",
    "seconds",
    "elapsed",
    "clock",
    "simtime",
    "elapsedtime",
    "nsec",
    "nsecs",
    "nanosec",
    "nanosecs",
    "nanoseconds",
];
const WIDTHS: [&str; 14] = [
    "gripwidth",
    "gripperwidth",
    "width",
    "gripper",
    "grip",
    "gripperposition",
    "gripperpos",
    "gripperopening",
    "fingerwidth",
    "aperture",
    "opening",
    "gripperaperture",
    "fingers",
    "gripperstate",
];

/// A word of a name and where it begins.
struct Word {
    at: usize,
    text: String,
}

fn words(name: &str) -> Vec<Word> {
    let mut words: Vec<Word> = Vec::new();
    let mut inside = false;
    for (at, c) in name.char_indices() {
        if c.is_alphanumeric() {
            if !inside {
                words.push(Word { at, text: String::new() });
            }
            if let Some(word) = words.last_mut() {
                word.text.extend(c.to_lowercase());
            }
        }
        inside = c.is_alphanumeric();
    }
    words
}

fn unit(word: &str) -> Option<Unit> {
    Some(match word {
        "m" | "meter" | "meters" | "metre" | "metres" => Unit::Length(Length::Metre),
        "mm" | "millimeters" | "millimetres" => Unit::Length(Length::Millimetre),
        "cm" => Unit::Length(Length::Centimetre),
        "inch" | "inches" | "in" => Unit::Length(Length::Inch),
        "s" | "sec" | "secs" | "seconds" => Unit::Time(TimeUnit::Second),
        "ms" | "msec" | "millis" => Unit::Time(TimeUnit::Millisecond),
        "us" | "usec" | "micros" => Unit::Time(TimeUnit::Microsecond),
        "ns" | "nsec" | "nsecs" | "nanosec" | "nanosecs" | "nanoseconds" | "nanos" => {
            Unit::Time(TimeUnit::Nanosecond)
        }
        "deg" | "degrees" => Unit::Angle(Angle::Degree),
        "rad" | "radians" => Unit::Angle(Angle::Radian),
        _ => return None,
    })
}

fn axis(word: &str) -> Option<usize> {
    ["x", "y", "z"].iter().position(|name| *name == word)
}

/// Returns the name of a column of time without its unit at the end.
pub(super) fn without_unit(name: &str) -> String {
    let mut words = words(name);
    if words.last().is_some_and(|word| unit(&word.text).is_some()) {
        words.pop();
    }
    words.into_iter().map(|word| word.text).collect()
}

/// Reads what a column holds from its name; `None` if the name says nothing.
pub(super) fn recognise(name: &str) -> Option<Column> {
    let mut words = words(name);
    let mut end_unit = None;
    // A unit alone is the name of a time.
    if let [only] = &words[..]
        && let Some(found @ Unit::Time(TimeUnit::Nanosecond)) = unit(&only.text)
    {
        end_unit = Some(found);
    }
    if words.len() > 1
        && let Some(found) = words.last().and_then(|word| unit(&word.text))
    {
        // `stamp.secs` is a time by both words.
        end_unit = Some(found);
        words.pop();
    }
    let joined = |from: usize| words[from..].iter().map(|w| w.text.as_str()).collect::<String>();
    let whole = joined(0);
    let prefix = |kept: usize| {
        let end = words.get(kept).map_or(name.len(), |word| word.at);
        name[..end].trim_end_matches(|c: char| !c.is_alphanumeric()).to_owned()
    };
    let column = |field, object, doubt| Some(Column { field, object, unit: end_unit, doubt });
    let last = words.last()?.text.clone();
    let count = words.len();
    for (list, field) in [
        (&TIMES[..], Field::Time),
        (&IDS, Field::Id),
        (&KINDS, Field::Kind),
        (&SESSIONS, Field::Session),
    ] {
        if list.contains(&whole.as_str()) {
            return column(field, String::new(), 0);
        }
    }
    if (whole.starts_with("header") || whole.starts_with("log")) && TIMES.contains(&last.as_str()) {
        return column(Field::Time, String::new(), 1);
    }
    if let Some(Unit::Time(_)) = end_unit
        && TIMES.contains(&last.as_str())
    {
        return column(Field::Time, String::new(), 1);
    }
    if WIDTHS.contains(&whole.as_str()) || whole.ends_with("gripperwidth") {
        return column(Field::Width, String::new(), 0);
    }
    let held = ["grasp", "grasped", "grasping", "holding", "held", "attached", "gripped"];
    if words.iter().any(|word| held.contains(&word.text.as_str())) || whole == "gripperclosed" {
        return column(Field::Grasp, String::new(), 0);
    }
    if let Some(at) =
        words.iter().position(|w| ["contact", "contacts", "touch"].contains(&w.text.as_str()))
    {
        let object = match at {
            0 if count > 1 => name[words[1].at..].to_owned(),
            0 => String::new(),
            at => prefix(at),
        };
        return column(Field::Contact, object, 0);
    }
    // The words before the last that only say what the numbers are.
    let before = |mut kept: usize| {
        while kept > 0 && PLACES.contains(&words[kept - 1].text.as_str()) {
            kept -= 1;
        }
        prefix(kept)
    };
    let previous = count.checked_sub(2).map_or("", |at| words[at].text.as_str());
    let number = last.parse::<usize>().ok();
    let component = axis(&last).or(number.filter(|n| *n < 3));
    if let Some(axis) = component
        && ANGLES.contains(&previous)
    {
        return column(Field::Turn(axis, Some(true)), before(count - 2), 0);
    }
    if let Some(axis) = component
        && VECTORS.contains(&previous)
    {
        return column(Field::Turn(axis, Some(false)), before(count - 2), 0);
    }
    if TURNS.contains(&previous) {
        if let Some(axis) = axis(&last).or((last == "w").then_some(3)) {
            return column(Field::Quaternion(axis), before(count - 2), 0);
        }
        if let Some(number) = number.filter(|n| *n < 4) {
            return column(Field::Component(number), before(count - 2), 0);
        }
    }
    if let Some(axis) = axis(&last) {
        return column(Field::Position(axis), before(count - 1), 0);
    }
    if let Some(number) = number.filter(|n| *n < 3)
        && ["pos", "position", "xyz", "translation"].contains(&previous)
    {
        return column(Field::Position(number), before(count - 1), 1);
    }
    let spelled =
        |start: &str| last.strip_prefix(start).filter(|rest| !rest.is_empty()).map(str::to_owned);
    if let Some(rest) = spelled("q") {
        if let Some(axis) = axis(&rest).or((rest == "w").then_some(3)) {
            return column(Field::Quaternion(axis), before(count - 1), 0);
        }
        if let Some(number) = rest.parse().ok().filter(|n: &usize| *n < 4) {
            return column(Field::Component(number), before(count - 1), 0);
        }
    }
    if let Some(axis) = spelled("r").and_then(|rest| axis(&rest)) {
        return column(Field::Turn(axis, None), before(count - 1), 0);
    }
    if let Some(axis) = ["roll", "pitch", "yaw"].iter().position(|angle| *angle == last) {
        return column(Field::Turn(axis, Some(true)), before(count - 1), 0);
    }
    for start in ["r", "m", "rot"] {
        let entry = spelled(start)
            .filter(|rest| rest.len() == 2)
            .and_then(|rest| rest.parse::<usize>().ok());
        if let Some(entry) = entry.filter(|n| n / 10 < 4 && n % 10 < 4) {
            return column(Field::Matrix(entry), before(count - 1), 0);
        }
    }
    for (start, doubt) in [("p", 1), ("pos", 1), ("t", 2)] {
        if let Some(axis) = spelled(start).and_then(|rest| axis(&rest)) {
            return column(Field::Position(axis), before(count - 1), doubt);
        }
    }
    if WIDTHS.contains(&last.as_str()) {
        return column(Field::Width, String::new(), 1);
    }
    None
}

/// Words of ids that stand for the robot's hand.
const HANDS: [&str; 15] = [
    "hand",
    "gripper",
    "ee",
    "eef",
    "tcp",
    "tool",
    "tool0",
    "endeffector",
    "effector",
    "wrist",
    "palm",
    "robot",
    "arm",
    "fingertip",
    "flange",
];

/// Returns whether an id is that of a hand, by its words.
pub(super) fn names_a_hand(id: &str) -> bool {
    let words = words(id);
    let whole: String = words.iter().map(|word| word.text.as_str()).collect();
    HANDS.contains(&whole.as_str())
        || words.iter().any(|w| {
            ["gripper", "tcp", "eef", "hand", "endeffector", "effector", "tool0"]
                .contains(&w.text.as_str())
        })
}

/// Returns the kind that an id names: the id without the number at its end.
pub(super) fn kind_of(id: &str) -> &str {
    let without = id.trim_end_matches(|c: char| c.is_ascii_digit());
    let kind = without.trim_end_matches(|c: char| "_-.#: /".contains(c));
    if kind.is_empty() || without.len() == id.len() { id } else { kind }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_columns_say_what_they_hold() {
        for (name, field, object) in [
            ("cup_1.x", Field::Position(0), "cup_1"),
            ("cup_1_pos_z", Field::Position(2), "cup_1"),
            ("/cup_1/pose/position/y", Field::Position(1), "/cup_1"),
            ("cup1.pose.orientation.w", Field::Quaternion(3), "cup1"),
            ("qw", Field::Quaternion(3), ""),
            ("cup_2_qx", Field::Quaternion(0), "cup_2"),
            ("q2", Field::Component(2), ""),
            ("cup-q0", Field::Component(0), "cup"),
            ("rx", Field::Turn(0, None), ""),
            ("a yaw [deg]", Field::Turn(2, Some(true)), "a"),
            ("r21", Field::Matrix(21), ""),
            ("x_mm", Field::Position(0), ""),
            ("header.stamp.secs", Field::Time, ""),
            ("time (ms)", Field::Time, ""),
            ("timestamp_ns", Field::Time, ""),
            ("nsecs", Field::Time, ""),
            ("object_id", Field::Id, ""),
            ("grip_width", Field::Width, ""),
            ("grasp_detected", Field::Grasp, ""),
            ("contact_cup_1", Field::Contact, "cup_1"),
            ("cup_1.contact", Field::Contact, "cup_1"),
        ] {
            let found = recognise(name).unwrap_or_else(|| panic!("{name} is not known"));
            assert_eq!((found.field, &*found.object), (field, object), "{name}");
        }
        for name in ["fx", "note", "wrist_camera_capture", "", "__", "é"] {
            assert_eq!(recognise(name), None, "{name}");
        }
        assert_eq!(
            recognise("time (ms)").and_then(|c| c.unit),
            Some(Unit::Time(TimeUnit::Millisecond))
        );
        assert_eq!(kind_of("cup_12"), "cup");
        assert_eq!(kind_of("7"), "7");
        assert!(names_a_hand("panda_hand") && names_a_hand("robot") && !names_a_hand("handle"));
    }
}
