//! Topics of a log: what each gives, by its type and its name.

use std::collections::{BTreeSet, HashMap};

use super::maps::{Take, TopicMap};
use super::messages::Shape;
use super::pattern::fits;

/// What is asked of a log.
pub(crate) struct Asked<'a> {
    /// Whether a topic is to be left out.
    pub ignores: &'a dyn Fn(&str) -> bool,
    /// The topics to take; all that are known if there are none.
    pub topics: &'a [TopicMap],
}

/// A topic with what its messages said.
#[derive(Debug)]
pub(crate) struct Topic {
    pub name: String,
    /// Type of its messages.
    pub kind: String,
    pub shape: Option<Shape>,
    /// What is taken; `None` if nothing is.
    pub meaning: Option<Take>,
    pub map: TopicMap,
    /// Whether the mapping names it.
    pub given: bool,
    /// Why nothing is taken, where that is not plain.
    pub why: Option<String>,
    /// Whether its transforms hold always.
    pub fixed: bool,
    /// Whether single transforms are between frames, not poses of objects.
    pub tree: bool,
    /// Number of messages.
    pub count: u64,
    /// Number of poses without numbers.
    pub unseen: u64,
    /// Whether objects have numbers by their places in a message.
    pub numbered: bool,
    /// Whether messages give their time.
    pub stamped: bool,
    pub signal: Vec<(i64, f64)>,
    /// Frames whose transforms it gives.
    pub frames: BTreeSet<u32>,
    /// Kinds of objects that it gives.
    pub kinds: HashMap<u32, String>,
    /// Joints of the gripper that it gives.
    pub joints: Vec<String>,
    /// The id of its object.
    pub base: String,
}

fn words(name: &str) -> impl Iterator<Item = String> {
    let words = name.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty());
    words.map(str::to_lowercase)
}

/// Returns whether a topic is named after a gripper.
fn grips(name: &str) -> bool {
    let name = name.to_lowercase();
    name.contains("grip") || name.contains("grasp")
}

/// Returns whether a topic is named after what is wanted, not what is.
pub(crate) fn commands(name: &str) -> bool {
    let wanted = ["command", "commands", "cmd", "goal", "target", "desired", "set", "setpoint"];
    words(name).any(|word| wanted.contains(&word.as_str()))
}

/// Returns whether a topic is named after how wide a gripper is open.
pub(crate) fn measures_width(name: &str) -> bool {
    words(name).any(|word| ["width", "opening", "position", "gap"].contains(&word.as_str()))
}

/// Returns whether a topic is named after an open gripper.
pub(crate) fn opens(name: &str) -> bool {
    words(name).any(|word| ["open", "opened", "released"].contains(&word.as_str()))
}

/// Returns whether a joint moves a finger, by the mapping or by its name.
pub(crate) fn is_finger(patterns: &[String], joint: &str) -> bool {
    if patterns.is_empty() {
        let name = joint.to_lowercase();
        return name.contains("finger") || name.contains("gripper");
    }
    patterns.iter().any(|pattern| fits(pattern, joint))
}

/// Words at the end of a topic's name that say what it gives, not of which object.
const PLACES: [&str; 18] = [
    "pose",
    "poses",
    "posestamped",
    "stamped",
    "position",
    "transform",
    "odom",
    "odometry",
    "tf",
    "state",
    "filtered",
    "array",
    "detections",
    "raw",
    "tracked",
    "covariance",
    "with",
    "ground",
];

/// Returns the name of a topic without the words that say what it gives.
fn object_path(name: &str) -> &str {
    let mut left = name.trim_matches('/');
    loop {
        let at = left.rfind(['/', '_']);
        let last = at.map_or(left, |at| &left[at + 1..]);
        match at {
            Some(at) if PLACES.contains(&last.to_lowercase().as_str()) && at > 0 => {
                left = left[..at].trim_end_matches(['/', '_']);
            }
            _ => return if left.is_empty() { name } else { left },
        }
    }
}

/// Frames of robots and sensors, by a word or the whole of their names.
const PARTS: [&str; 22] = [
    "link",
    "camera",
    "optical",
    "imu",
    "lidar",
    "laser",
    "joint",
    "footprint",
    "flange",
    "wrist",
    "finger",
    "leftfinger",
    "rightfinger",
    "depth",
    "shoulder",
    "elbow",
    "forearm",
    "upperarm",
    "knuckle",
    "caster",
    "wheel",
    "gps",
];
const WHOLE: [&str; 8] = ["base", "world", "map", "odom", "earth", "robot", "root", "origin"];

/// Returns whether a frame's name is that of a part of a robot or a sensor, or of a frame of reference.
pub(crate) fn names_a_part(name: &str) -> bool {
    let plain = |word: &str| word.trim_end_matches(|c: char| c.is_ascii_digit()).to_owned();
    WHOLE.contains(&name.to_lowercase().as_str())
        || words(name).any(|word| PARTS.contains(&plain(&word).as_str()))
}

impl Topic {
    /// Makes a topic without messages.
    pub fn of(name: &str, kind: &str, asked: &Asked<'_>) -> Self {
        let shape = Shape::of(kind);
        let given = asked.topics.iter().find(|topic| fits(&topic.topic, name)).cloned();
        let meaning = match (&given, shape) {
            _ if (asked.ignores)(name) => None,
            (Some(map), _) => Some(map.take),
            (None, _) if !asked.topics.is_empty() => None,
            (None, Some(Shape::Joints | Shape::Gripper)) => Some(Take::Width),
            (None, Some(Shape::Number)) => grips(name).then_some(Take::Width),
            (None, Some(Shape::Flag)) => grips(name).then_some(Take::Grasp),
            (None, Some(_)) => Some(Take::Poses),
            (None, None) => None,
        };
        let path = object_path(name);
        let last = path.rsplit('/').next().filter(|last| !last.is_empty());
        let tail = name.rsplit('/').next().unwrap_or(name);
        Self {
            name: name.into(),
            kind: kind.into(),
            shape,
            meaning,
            given: given.is_some(),
            map: given.unwrap_or_default(),
            why: None,
            fixed: tail == "tf_static",
            tree: ["tf", "tf_static"].contains(&tail) || kind.ends_with("FrameTransform"),
            count: 0,
            unseen: 0,
            numbered: false,
            stamped: false,
            signal: Vec::new(),
            frames: BTreeSet::new(),
            kinds: HashMap::new(),
            joints: Vec::new(),
            base: last.unwrap_or(path).to_owned(),
        }
    }

    /// Returns whether the objects of two topics would have the same id, and stand at different paths.
    pub fn sounds_like(&self, other: &Self) -> bool {
        let poses = |topic: &Self| topic.meaning == Some(Take::Poses);
        poses(self)
            && poses(other)
            && self.base.rsplit('/').next() == other.base.rsplit('/').next()
            && object_path(&self.name) != object_path(&other.name)
    }

    /// Names the object by the whole of the topic's name, since another topic ends in the same word.
    pub fn spell_out(&mut self) {
        self.base = object_path(&self.name).to_owned();
    }

    /// Returns the id of an object that messages give as `own`: nothing for that of the topic, `*_0` for one of several.
    pub fn id(&self, own: &str) -> String {
        let named = self.map.object.as_deref();
        match own.strip_prefix("*_") {
            Some(number) => match named {
                Some(object) if object.contains('*') => object.replace('*', number),
                _ => format!("{}_{number}", named.unwrap_or(&self.base)),
            },
            None => match (self.shape, named) {
                (Some(Shape::Pose | Shape::Odometry | Shape::Transform), Some(object)) => {
                    object.to_owned()
                }
                _ if own.is_empty() => self.base.clone(),
                _ => own.to_owned(),
            },
        }
    }

    /// Returns whether an object is taken.
    pub fn takes(&self, id: &str) -> bool {
        self.map.objects.is_empty() || self.map.objects.iter().any(|pattern| fits(pattern, id))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_topics_and_frames_say_what_they_are_of() {
        for (name, base) in [
            ("/cup_1/pose", "cup_1"),
            ("/vrpn_mocap/cup_1/pose", "cup_1"),
            ("/cup_1_pose", "cup_1"),
            ("/pose", "pose"),
            ("cup", "cup"),
            ("/robot/ee/pose_stamped", "ee"),
            ("/", "/"),
        ] {
            let topic = Topic::of(
                name,
                "geometry_msgs/msg/PoseStamped",
                &Asked { ignores: &|_| false, topics: &[] },
            );
            assert_eq!(topic.base, base, "{name}");
        }
        for (name, part) in [
            ("panda_link3", true),
            ("camera_color_optical_frame", true),
            ("base", true),
            ("base_plate_1", false),
            ("cup_1", false),
            ("linked_chain", false),
            ("wrist_3_link", true),
        ] {
            assert_eq!(names_a_part(name), part, "{name}");
        }
        assert!(opens("/gripper/is_open") && !opens("/gripper/opening"));
    }
}
