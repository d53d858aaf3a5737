//! The description of a scene: kinds of bodies, parts, fixtures, table and robot. Plain data in SI units.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use super::shapes::{Piece, has_volume};
use crate::robot::Pose;
use crate::robot::RobotError;
use crate::robot::arm::{ArmSpec, BodyFrame, GripperSpec};

/// The look of a body in pictures.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Look {
    /// Colour as 0xRRGGBB.
    pub colour: u32,
    /// Colour of text about this body on white, as 0xRRGGBB.
    pub ink: u32,
    /// Roughness, from 0 (mirror) to 1 (chalk).
    pub roughness: f64,
}

/// The ways in which a body can stand at a target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Symmetry {
    /// Number of equally spaced rotations about the z axis that are tried at a target that gives only the direction of
    /// the z axis, 1 to 360.
    pub turns: u32,
    /// Number of equal rotations about the z axis after which the body looks the same, 1 to 360: 1 for none, 4 for a
    /// square block. They are tried at a target that gives the whole orientation.
    #[serde(default = "once")]
    pub fold: u32,
    /// Whether the body may also stand upside down: it looks the same after half a turn about x.
    pub flips: bool,
}

fn once() -> u32 {
    1
}

impl Default for Symmetry {
    fn default() -> Self {
        Self { turns: 24, fold: 1, flips: false }
    }
}

/// How the robot puts down a body.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Handling {
    /// The ways in which the body can stand at a target.
    pub symmetry: Symmetry,
    /// Height above the target from which the body is lowered straight down, in metres.
    pub rise_m: f64,
    /// Distance of each finger from the middle of the gripper when the hand lets go of the body, in metres.
    pub release_m: f64,
    /// Horizontal distance within which another body of the same kind blocks a target, in metres.
    pub in_the_way_m: f64,
    /// Greatest height above the target from which the hand may let the body fall if it cannot reach lower, in metres.
    #[serde(default)]
    pub fall_m: f64,
    /// Distance that the arm keeps from everything else on its way to the body and with it, where it finds such a way,
    /// in metres.
    #[serde(default)]
    pub clear_m: f64,
}

impl Default for Handling {
    fn default() -> Self {
        Self {
            symmetry: Symmetry::default(),
            rise_m: 0.05,
            release_m: 0.03,
            in_the_way_m: 0.02,
            fall_m: 0.0,
            clear_m: 0.0,
        }
    }
}

/// A kind of movable body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BodyKind {
    /// Name of the kind in recordings: 1 to 200 characters.
    pub name: String,
    /// Convex pieces, in the body's frame.
    pub pieces: Vec<Piece>,
    /// Density, in kilograms per cubic metre.
    pub density: f64,
    /// Coefficient of friction. Between two bodies, the mean of their coefficients applies. Between a pad and a part,
    /// the greater coefficient applies.
    pub friction: f64,
    /// How the robot puts the body down.
    pub handling: Handling,
    /// Look in pictures.
    pub look: Look,
}

/// A movable body, and the frame from which it falls at the beginning.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// Index of its kind in [`SceneSpec::kinds`].
    pub kind: usize,
    /// Frame from which it is dropped.
    pub frame: BodyFrame,
    /// The slider on which the part moves; `None` for a part that moves freely.
    #[serde(default)]
    pub slider: Option<Slider>,
}

impl Part {
    /// Returns a part that moves freely.
    pub fn free(kind: usize, frame: BodyFrame) -> Self {
        Self { kind, frame, slider: None }
    }
}

/// A straight guide: the part moves along one axis and does not turn, like a drawer.
///
/// The part's frame at the beginning ([`Part::frame`]) is at coordinate 0. The robot does not lift such a part; it
/// takes and slides it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Slider {
    /// Fixture that carries the guide, by its index in [`SceneSpec::fixtures`]; `None` for the table.
    #[serde(default)]
    pub fixture: Option<usize>,
    /// Direction of positive coordinates, in the part's frame.
    pub axis: [f64; 3],
    /// Least and greatest coordinate, in metres.
    pub range_m: [f64; 2],
    /// Friction of the guide, in newtons.
    pub friction_n: f64,
}

/// A body that moves: a part, or a fixture that another hand moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum BodyId {
    /// A part, by its index in [`SceneSpec::parts`].
    Part(usize),
    /// A movable fixture, by its index in [`SceneSpec::fixtures`].
    Fixture(usize),
}

/// A body that the robot does not move.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Fixture {
    /// Frame of the body in the scene.
    pub frame: BodyFrame,
    /// Convex pieces, in the body's frame.
    pub pieces: Vec<Piece>,
    /// Coefficient of friction.
    pub friction: f64,
    /// Look in pictures.
    pub look: Look,
    /// Name in pictures of a fixture that another hand may move (see [`Scene::displace`](super::Scene::displace));
    /// `None` for a fixture that never moves.
    #[serde(default)]
    pub movable: Option<String>,
}

/// A place that recordings show beside the parts, such as an opening of a fixture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Landmark {
    /// Name of its kind in recordings: 1 to 200 characters.
    pub kind: String,
    /// Pose of the place: in the scene, or in the frame of `body`.
    pub pose: Pose,
    /// The body that the place moves with; `None` for a place that never moves.
    #[serde(default)]
    pub body: Option<BodyId>,
}

impl Landmark {
    /// Returns a place that never moves.
    pub fn fixed(kind: impl Into<String>, pose: Pose) -> Self {
        Self { kind: kind.into(), pose, body: None }
    }
}

/// The table. Its top is at height 0. Lengths in metres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TableSpec {
    /// Inner corners of the rim as `[x, y]`: first the corner with the smaller coordinates, then the corner with the
    /// greater.
    pub rim: [[f64; 2]; 2],
    /// Height of the rim.
    pub rim_height_m: f64,
    /// Coefficient of friction.
    pub friction: f64,
}

impl Default for TableSpec {
    fn default() -> Self {
        Self { rim: [[0.30, -0.33], [0.66, 0.36]], rim_height_m: 0.015, friction: 0.5 }
    }
}

/// A complete description of a scene. A task draws it from a seed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SceneSpec {
    /// Kinds of movable bodies, each with its own name.
    pub kinds: Vec<BodyKind>,
    /// The movable bodies: at most [`MAX_PARTS`].
    pub parts: Vec<Part>,
    /// Bodies that the robot does not move.
    pub fixtures: Vec<Fixture>,
    /// Places that recordings show beside the parts. No landmark shares its name with a kind of part.
    pub landmarks: Vec<Landmark>,
    /// The table.
    pub table: TableSpec,
    /// The gripper.
    pub gripper: GripperSpec,
    /// The arm.
    pub arm: ArmSpec,
    /// Duration of one physics step, in milliseconds (1, 2 or 4).
    pub step_ms: u64,
}

/// Greatest number of parts in a scene.
pub const MAX_PARTS: usize = 64;

impl Default for SceneSpec {
    /// Describes the robot at an empty table.
    fn default() -> Self {
        Self {
            kinds: Vec::new(),
            parts: Vec::new(),
            fixtures: Vec::new(),
            landmarks: Vec::new(),
            table: TableSpec::default(),
            gripper: GripperSpec::default(),
            arm: ArmSpec::default(),
            step_ms: 4,
        }
    }
}

/// A condition on a scene: the setting's name, its value in messages, what is expected, and the test.
struct Rule {
    name: &'static str,
    value: fn(&SceneSpec) -> String,
    expected: &'static str,
    holds: fn(&SceneSpec) -> bool,
}

const RULES: [Rule; 13] = [
    Rule {
        name: "step_ms",
        value: |s| s.step_ms.to_string(),
        expected: "1, 2 or 4",
        holds: |s| [1, 2, 4].contains(&s.step_ms),
    },
    Rule {
        name: "kinds",
        value: |s| format!("{:?}", s.kinds.iter().map(|k| &k.name).collect::<Vec<_>>()),
        expected: "different names of 1 to 200 characters",
        holds: |s| {
            let names: BTreeSet<&String> = s.kinds.iter().map(|k| &k.name).collect();
            names.len() == s.kinds.len() && names.into_iter().all(|name| is_name(name))
        },
    },
    Rule {
        name: "landmarks",
        value: |s| format!("{:?}", s.landmarks.iter().map(|l| &l.kind).collect::<Vec<_>>()),
        expected: "names of 1 to 200 characters that no part has",
        holds: |s| {
            let taken = |name: &String| s.kinds.iter().any(|k| k.name == *name);
            s.landmarks.iter().all(|l| is_name(&l.kind) && !taken(&l.kind))
        },
    },
    Rule {
        name: "pieces",
        value: |_| "empty or without volume".into(),
        expected: "at least one piece for each body, each with corners that enclose a volume",
        holds: |s| {
            let kinds = s.kinds.iter().map(|k| &k.pieces);
            let mut bodies = kinds.chain(s.fixtures.iter().map(|f| &f.pieces));
            bodies.all(|pieces| !pieces.is_empty() && pieces.iter().all(has_volume))
        },
    },
    Rule {
        name: "density",
        value: |s| format!("{:?}", s.kinds.iter().map(|k| k.density).collect::<Vec<_>>()),
        expected: "1 to 30000 kg per cubic metre for each kind",
        holds: |s| s.kinds.iter().all(|k| (1.0..=30_000.0).contains(&k.density)),
    },
    Rule {
        name: "friction",
        value: |s| format!("{:?}", s.frictions().collect::<Vec<_>>()),
        expected: "0.001 to 10 for each kind, each fixture and the table",
        holds: |s| s.frictions().all(|friction| (1e-3..=10.0).contains(&friction)),
    },
    Rule {
        name: "handling",
        value: |s| format!("{:?}", s.kinds.iter().map(|k| k.handling).collect::<Vec<_>>()),
        expected: "0 to 1 m for each length, and 1 to 360 turns and folds",
        holds: |s| s.kinds.iter().all(|k| k.handling.is_possible()),
    },
    Rule {
        name: "parts",
        value: |s| format!("a list of {}", s.parts.len()),
        expected: "at most 64 parts",
        holds: |s| s.parts.len() <= MAX_PARTS,
    },
    Rule {
        name: "parts",
        value: |s| format!("{:?}", s.parts),
        expected: "a kind from `kinds` and finite numbers for each part",
        holds: |s| s.parts.iter().all(|p| p.kind < s.kinds.len() && p.frame.is_finite()),
    },
    Rule {
        name: "fixtures",
        value: |s| format!("{:?}", s.fixtures.iter().map(|f| f.frame).collect::<Vec<_>>()),
        expected: "finite numbers for each place",
        holds: |s| s.fixtures.iter().all(|f| f.frame.is_finite()),
    },
    Rule {
        name: "landmarks",
        value: |s| format!("{:?}", s.landmarks.iter().map(|l| l.body).collect::<Vec<_>>()),
        expected: "a part or a movable fixture of the scene for each landmark with a body",
        holds: |s| s.landmarks.iter().filter_map(|l| l.body).all(|body| s.moves(body)),
    },
    Rule {
        name: "slider",
        value: |s| format!("{:?}", s.parts.iter().filter_map(|p| p.slider).collect::<Vec<_>>()),
        expected: "an axis of length 1, a range around 0 within 1 m, 0 to 1000 N, and a fixture of the scene",
        holds: |s| {
            let mut sliders = s.parts.iter().filter_map(|p| p.slider);
            sliders.all(|slider| slider.is_possible(s.fixtures.len()))
        },
    },
    Rule {
        name: "table",
        value: |s| format!("{:?}", s.table),
        expected: "the rim's lower corner first, both within 10 m, and a rim height of 0.001 to 0.1 m",
        holds: |s| {
            let [low, high] = s.table.rim;
            (0..2).all(|i| low[i] < high[i] && low[i] > -10.0 && high[i] < 10.0)
                && (1e-3..=0.1).contains(&s.table.rim_height_m)
        },
    },
];

fn is_name(name: &str) -> bool {
    (1..=200).contains(&name.chars().count())
}

impl Handling {
    fn is_possible(&self) -> bool {
        let lengths = [self.rise_m, self.release_m, self.in_the_way_m, self.fall_m, self.clear_m];
        let Symmetry { turns, fold, .. } = self.symmetry;
        lengths.iter().all(|v| (0.0..=1.0).contains(v))
            && [turns, fold].iter().all(|count| (1..=360).contains(count))
    }
}

impl Slider {
    fn is_possible(&self, fixtures: usize) -> bool {
        let length: f64 = self.axis.iter().map(|v| v * v).sum();
        let [least, most] = self.range_m;
        (length - 1.0).abs() < 1e-6
            && (-1.0..=0.0).contains(&least)
            && (0.0..=1.0).contains(&most)
            && (0.0..=1e3).contains(&self.friction_n)
            && self.fixture.is_none_or(|fixture| fixture < fixtures)
    }
}

impl SceneSpec {
    /// Returns whether a body is a part or a movable fixture of this scene.
    pub fn moves(&self, body: BodyId) -> bool {
        match body {
            BodyId::Part(part) => part < self.parts.len(),
            BodyId::Fixture(index) => self.fixtures.get(index).is_some_and(|f| f.movable.is_some()),
        }
    }

    /// Returns the number of bodies whose poses a [picture frame](super::Scene::frame) lists: the parts, then the
    /// movable fixtures.
    pub fn pictured(&self) -> usize {
        self.parts.len() + self.fixtures.iter().filter(|f| f.movable.is_some()).count()
    }

    fn frictions(&self) -> impl Iterator<Item = f64> {
        let kinds = self.kinds.iter().map(|k| k.friction);
        kinds.chain(self.fixtures.iter().map(|f| f.friction)).chain([self.table.friction])
    }

    /// Checks that the scene can be built. This computes the hulls of all pieces, in well below a millisecond.
    ///
    /// # Errors
    /// [`RobotError::Setting`] or [`RobotError::Range`], with the setting, its value and what is expected.
    pub fn check(&self) -> Result<(), RobotError> {
        if let Some(rule) = RULES.iter().find(|rule| !(rule.holds)(self)) {
            let Rule { name, value, expected, .. } = *rule;
            return Err(RobotError::Setting { name, value: value(self), expected });
        }
        self.gripper.check()?;
        self.arm.check(self.step_ms)
    }
}
