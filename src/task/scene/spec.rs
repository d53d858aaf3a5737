//! The description of a scene: kinds of bodies, parts, fixtures, table and robot. Plain data in SI units.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use super::shapes::has_volume;
use crate::task::domain::Pose;
use crate::task::error::TaskError;
use crate::task::robot::{ArmSpec, BodyFrame, GripperSpec};

/// A convex piece of a body: its corners in the body's frame, in metres.
pub type Piece = Vec<[f64; 3]>;

/// Returns the eight corners of a box, given its middle and half its sizes.
pub fn cuboid(middle: [f64; 3], half: [f64; 3]) -> Piece {
    let corner = |n: usize| {
        std::array::from_fn(|i| middle[i] + if n >> i & 1 == 0 { -half[i] } else { half[i] })
    };
    (0..8).map(corner).collect()
}

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

/// The ways in which a body can stand at a target. The target gives only the direction of the body's z axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Symmetry {
    /// Number of equally spaced rotations about the z axis that are tried, 1 to 360.
    pub turns: u32,
    /// Whether the body may also stand upside down.
    pub flips: bool,
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
}

/// A body that does not move.
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
}

/// A place that recordings show beside the parts, such as an opening of a fixture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Landmark {
    /// Name of its kind in recordings: 1 to 200 characters.
    pub kind: String,
    /// Pose of the place.
    pub pose: Pose,
}

/// The table. Its top is at height 0. Lengths in metres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
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
    /// Bodies that do not move.
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

const RULES: [Rule; 11] = [
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
        expected: "0 to 1 m for each length, and 1 to 360 turns",
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
        let lengths = [self.rise_m, self.release_m, self.in_the_way_m];
        lengths.iter().all(|v| (0.0..=1.0).contains(v)) && (1..=360).contains(&self.symmetry.turns)
    }
}

impl SceneSpec {
    fn frictions(&self) -> impl Iterator<Item = f64> {
        let kinds = self.kinds.iter().map(|k| k.friction);
        kinds.chain(self.fixtures.iter().map(|f| f.friction)).chain([self.table.friction])
    }

    /// Checks that the scene can be built. This computes the hulls of all pieces, in well below a millisecond.
    ///
    /// # Errors
    /// [`TaskError::Setting`] or [`TaskError::Range`], with the setting, its value and what is expected.
    pub fn check(&self) -> Result<(), TaskError> {
        if let Some(rule) = RULES.iter().find(|rule| !(rule.holds)(self)) {
            let Rule { name, value, expected, .. } = *rule;
            return Err(TaskError::Setting { name, value: value(self), expected });
        }
        self.gripper.check()?;
        self.arm.check(self.step_ms)
    }
}
