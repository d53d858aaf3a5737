//! What arrays of a log hold: by the names and shapes of datasets, and how their rows are poses.

use std::collections::BTreeMap;

use super::maps::{DatasetMap, PoseDatasets};

/// What a dataset with one number for each row holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Flat {
    Time,
    Width,
    Grasp,
}

/// What the numbers of a pose are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Form {
    /// A position.
    Place,
    /// A position and a quaternion.
    Pose,
    /// A matrix of four rows.
    Matrix,
}

impl Form {
    /// Refuses a matrix whose last row is none of a pose.
    ///
    /// # Errors
    /// What is wrong, in words.
    pub fn check(self, values: &[f64]) -> Result<(), String> {
        let row: Vec<f64> = values.iter().skip(12).copied().collect();
        let unlike = |(own, wanted): (&f64, f64)| (own - wanted).abs() > 0.01;
        if self != Self::Matrix || !row.iter().zip([0.0, 0.0, 0.0, 1.0]).any(unlike) {
            return Ok(());
        }
        let column = [3, 7, 11].iter().filter_map(|at| values.get(*at));
        let looks = match column.clone().all(|value| value.abs() < 0.01) {
            true => ", so that it looks transposed",
            false => "",
        };
        Err(format!("the last row of the matrix is {row:?}{looks}"))
    }

    /// Returns the position, and the numbers of the orientation.
    pub fn split(self, values: &[f64]) -> ([f64; 3], Vec<f64>) {
        let at = |places: [usize; 3]| places.map(|at| values.get(at).copied().unwrap_or(f64::NAN));
        match self {
            Self::Place => (at([0, 1, 2]), Vec::new()),
            Self::Pose => (at([0, 1, 2]), values.get(3..).unwrap_or_default().to_vec()),
            Self::Matrix => {
                let rows = values.chunks(4).take(3).flat_map(|row| row.iter().take(3));
                (at([3, 7, 11]), rows.copied().collect())
            }
        }
    }
}

/// How a row of a dataset holds poses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Layout {
    pub form: Form,
    /// Number of objects.
    pub objects: usize,
    /// Number of numbers of each.
    pub size: usize,
}

impl Layout {
    /// Returns how a dataset of a shape holds poses; `None` if it does not.
    pub fn of(shape: &[u64]) -> Option<Self> {
        let (form, size, inner) = match shape {
            [_, .., 4, 4] => (Form::Matrix, 16, 2),
            [_, .., 3] => (Form::Place, 3, 1),
            [_, .., 7] => (Form::Pose, 7, 1),
            _ => return None,
        };
        let between = shape.get(1..shape.len() - inner)?;
        let objects = between.iter().try_fold(1u64, |product, size| product.checked_mul(*size))?;
        let objects = usize::try_from(objects).ok().filter(|_| between.len() < 2)?;
        Some(Self { form, objects, size })
    }

    /// Returns how many numbers of an orientation stand beside each position; `None` if the shapes do not fit.
    pub fn turns(&self, shape: &[u64], turned: &[u64]) -> Option<usize> {
        let prefix = shape.len().checked_sub(if self.form == Form::Matrix { 2 } else { 1 })?;
        let same = turned.get(..prefix)? == shape.get(..prefix)?;
        match turned.get(prefix..)? {
            _ if !same => None,
            [4] => Some(4),
            [3] => Some(3),
            [9] | [3, 3] => Some(9),
            _ => None,
        }
    }
}

/// Words of groups that are sessions, before a number.
const SESSIONS: [&str; 11] = [
    "demo",
    "demonstration",
    "episode",
    "ep",
    "traj",
    "trajectory",
    "session",
    "trial",
    "run",
    "take",
    "rollout",
];

/// Returns whether a group is named as a session is.
pub(crate) fn is_session(name: &str) -> bool {
    let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
    let word = stem.trim_end_matches(['_', '-']).to_lowercase();
    stem.len() < name.len() && SESSIONS.contains(&word.as_str())
}

/// Returns the pattern of the groups that are sessions; empty if the file is one session.
pub(crate) fn sessions<'p>(paths: impl Iterator<Item = &'p String>) -> String {
    for path in paths {
        let Some((groups, _)) = path.rsplit_once('/') else { continue };
        let mut before = String::new();
        for name in groups.split('/') {
            if is_session(name) {
                let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
                return format!("{before}{stem}*");
            }
            before = format!("{before}{name}/");
        }
    }
    String::new()
}

/// Endings of names of positions, orientations and poses.
const PLACES: [&str; 5] = ["pos", "position", "xyz", "translation", "positions"];
const TURNS: [&str; 7] =
    ["quat", "quaternion", "orientation", "rot", "rotation", "rotmat", "quaternions"];
const POSES: [&str; 3] = ["pose", "poses", "transform"];
/// Words of datasets that are no poses of what is.
const OTHERS: [&str; 22] = [
    "to",
    "vel",
    "velocity",
    "joint",
    "joints",
    "action",
    "actions",
    "target",
    "goal",
    "desired",
    "command",
    "cmd",
    "next",
    "camera",
    "intrinsic",
    "intrinsics",
    "extrinsic",
    "extrinsics",
    "acc",
    "force",
    "torque",
    "gripper",
];

/// The words of a path that are joined by strokes: its groups and, within the last name, words.
fn parts(path: &str) -> impl Iterator<Item = &str> {
    path.split(['/', '_', '-', '.']).filter(|word| !word.is_empty())
}

/// Splits the last word off a name, at a stroke of either kind.
fn ending<'p>(path: &'p str, endings: &[&str]) -> Option<&'p str> {
    let (stem, last) = path.rsplit_once(['/', '_'])?;
    endings.contains(&last.to_lowercase().as_str()).then_some(stem)
}

/// Adds what the datasets of a session hold to a mapping. `flat` says what one with a number for each row holds, by the
/// last name of its path.
pub(crate) fn guess(
    datasets: &BTreeMap<&str, &[u64]>,
    map: &mut DatasetMap,
    flat: impl Fn(&str) -> Option<Flat>,
) {
    for (path, shape) in datasets {
        let last = path.rsplit('/').next().unwrap_or(path);
        let other = parts(path).any(|word| OTHERS.contains(&word.to_lowercase().as_str()));
        let lower = path.to_lowercase();
        let copied = parts(path).next() == Some("next");
        if matches!(shape, [_] | [_, 1]) && !copied {
            // Arrays have names in the plural, too.
            match flat(last).or_else(|| flat(last.strip_suffix('s')?)) {
                Some(Flat::Time) => drop(map.time.get_or_insert((*path).to_owned())),
                Some(Flat::Width) => drop(map.width.get_or_insert((*path).to_owned())),
                Some(Flat::Grasp) => drop(map.grasp.get_or_insert((*path).to_owned())),
                None => {}
            }
        }
        let fingers = matches!(shape, [_] | [_, 1..=6]) && lower.contains("gripper");
        if fingers && !copied && (lower.ends_with("qpos") || lower.ends_with("gripper_pos")) {
            map.width.get_or_insert((*path).to_owned());
        }
        let Some(layout) = Layout::of(shape).filter(|_| !other) else { continue };
        let (stem, rotation) = match layout.form {
            Form::Place => {
                let Some(stem) = ending(path, &PLACES) else { continue };
                let turn = datasets.iter().find(|(other, turned)| {
                    ending(other, &TURNS) == Some(stem) && layout.turns(shape, turned).is_some()
                });
                (stem, turn.map(|(path, _)| (*path).to_owned()))
            }
            Form::Pose => match ending(path, &POSES) {
                Some(stem) => (stem, None),
                None => continue,
            },
            Form::Matrix => (ending(path, &POSES).unwrap_or(path), None),
        };
        let id = stem.rsplit('/').next().unwrap_or(stem);
        let id = if shape.len() > if layout.form == Form::Matrix { 3 } else { 2 }
            && layout.objects > 1
        {
            format!("{id}_*")
        } else {
            id.to_owned()
        };
        let own = PoseDatasets { position: (*path).to_owned(), rotation };
        map.objects.entry(id).or_insert(own);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_shapes_of_datasets_say_what_they_hold() {
        let datasets: BTreeMap<&str, &[u64]> = [
            ("actions", &[50, 7][..]),
            ("next_obs/cube_pos", &[50, 3]),
            ("obs/cube_pos", &[50, 3]),
            ("obs/cube_quat", &[50, 4]),
            ("obs/cube_to_robot0_eef_pos", &[50, 3]),
            ("obs/object", &[50, 10]),
            ("obs/robot0_eef_pos", &[50, 3]),
            ("obs/robot0_eef_vel_lin", &[50, 3]),
            ("obs/robot0_gripper_qpos", &[50, 2]),
            ("obs/robot0_gripper_qvel", &[50, 2]),
            ("obs/robot0_joint_pos", &[50, 7]),
            ("datagen_info/object_poses/lid", &[50, 4, 4]),
            ("obs/pegs_pos", &[50, 4, 3]),
        ]
        .into_iter()
        .collect();
        let mut map = DatasetMap::default();
        guess(&datasets, &mut map, |_| None);
        let ids: Vec<&str> = map.objects.keys().map(String::as_str).collect();
        assert_eq!(ids, ["cube", "lid", "pegs_*", "robot0_eef"]);
        assert_eq!(map.objects["cube"].rotation.as_deref(), Some("obs/cube_quat"));
        assert_eq!((map.width.as_deref(), map.time), (Some("obs/robot0_gripper_qpos"), None));
        let times: BTreeMap<&str, &[u64]> =
            [("a/cup_pose", &[9, 7][..]), ("timestamps", &[9])].into_iter().collect();
        let mut map = DatasetMap::default();
        guess(&times, &mut map, |name| (name == "timestamp").then_some(Flat::Time));
        assert_eq!((map.time.as_deref(), map.objects.len()), (Some("timestamps"), 1));
        for (path, pattern) in [
            ("data/demo_0/obs/a", "data/demo_*"),
            ("episode12/x", "episode*"),
            ("obs/a", ""),
            ("demo_x/a", ""),
        ] {
            assert_eq!(sessions([&path.to_owned()].into_iter()), pattern, "{path}");
        }
        assert_eq!(Layout::of(&[9, 2, 4, 4]).map(|l| l.objects), Some(2));
        assert_eq!(Layout::of(&[9, 5]), None);
        assert_eq!(Layout::of(&[3]), None);
    }
}
