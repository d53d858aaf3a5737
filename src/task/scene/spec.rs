//! What a scene is made of: kinds of bodies, parts, fixtures, table, robot. Plain data in SI units.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use super::shapes::has_volume;
use crate::task::domain::Pose;
use crate::task::error::TaskError;
use crate::task::robot::{ArmSpec, BodyFrame, GripperSpec};

/// One convex piece of a body: its corners in the body's frame, in metres.
pub type Piece = Vec<[f64; 3]>;

/// The eight corners of a box of half these sizes about a point.
pub fn cuboid(middle: [f64; 3], half: [f64; 3]) -> Piece {
    let corner = |n: usize| {
        std::array::from_fn(|i| middle[i] + if n >> i & 1 == 0 { -half[i] } else { half[i] })
    };
    (0..8).map(corner).collect()
}

/// How something looks in pictures.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Look {
    /// Red, green and blue, a byte each.
    pub colour: u32,
    /// The same for text on white.
    pub ink: u32,
    /// 0 for a mirror to 1 for chalk.
    pub roughness: f64,
}

/// In how many ways a body can stand at a target that gives only the direction of its z axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Symmetry {
    /// Equal steps of a full turn about its z axis that are tried (at least 1).
    pub turns: u32,
    /// Whether it may stand upside down, too.
    pub flips: bool,
}

/// What the robot has to know to put down a body.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Handling {
    /// In how many ways it can stand at a target.
    pub symmetry: Symmetry,
    /// How far above its target it must pass, and come straight down from there, in metres.
    pub rise_m: f64,
    /// How far each finger is from the middle when it lets go, in metres.
    pub release_m: f64,
    /// A body of the same kind this near to a target, along the table, is in the way, in metres.
    pub in_the_way_m: f64,
}

/// A kind of movable body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BodyKind {
    /// What the recorder calls it: 1 to 200 characters.
    pub name: String,
    /// Its convex pieces, in its frame.
    pub pieces: Vec<Piece>,
    /// Kilograms a cubic metre.
    pub density: f64,
    /// Coefficient of friction. Of two things that touch the mean counts; in the grip, the greater.
    pub friction: f64,
    /// How the robot puts it down.
    pub handling: Handling,
    /// How it looks.
    pub look: Look,
}

/// A movable body, where it is let fall at the beginning.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// Its kind's place in [`SceneSpec::kinds`].
    pub kind: usize,
    /// Where it is let fall.
    pub frame: BodyFrame,
}

/// Something that stands where it is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Fixture {
    /// Where its frame is.
    pub frame: BodyFrame,
    /// Its convex pieces, in its frame.
    pub pieces: Vec<Piece>,
    /// Coefficient of friction.
    pub friction: f64,
    /// How it looks.
    pub look: Look,
}

/// A place that the recorder sees beside the parts, such as an opening of a fixture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Landmark {
    /// What the recorder calls it: 1 to 200 characters.
    pub kind: String,
    /// Where it is.
    pub pose: Pose,
}

/// The table, whose top is at height 0. Metres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TableSpec {
    /// The inner corners of the rim, the lower first.
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

/// Everything there is to know before a scene is built: a task draws it from a seed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SceneSpec {
    /// The kinds of movable bodies, under different names.
    pub kinds: Vec<BodyKind>,
    /// The movable bodies.
    pub parts: Vec<Part>,
    /// What does not move.
    pub fixtures: Vec<Fixture>,
    /// Places that the recorder sees beside the parts, of other kinds than they.
    pub landmarks: Vec<Landmark>,
    /// The table.
    pub table: TableSpec,
    /// The gripper.
    pub gripper: GripperSpec,
    /// The arm.
    pub arm: ArmSpec,
    /// Milliseconds of one step of the physics (1, 2 or 4).
    pub step_ms: u64,
}

/// Most parts of a scene.
pub const MAX_PARTS: usize = 64;

impl Default for SceneSpec {
    /// The robot at an empty table.
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

/// What must hold of a scene: of which setting, the value to show, what is expected, and whether it holds.
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
        value: |_| "without volume".into(),
        expected: "corners of convex pieces with volume, at least one piece a body",
        holds: |s| {
            let kinds = s.kinds.iter().map(|k| &k.pieces);
            let mut bodies = kinds.chain(s.fixtures.iter().map(|f| &f.pieces));
            bodies.all(|pieces| !pieces.is_empty() && pieces.iter().all(has_volume))
        },
    },
    Rule {
        name: "density",
        value: |s| format!("{:?}", s.kinds.iter().map(|k| k.density).collect::<Vec<_>>()),
        expected: "1 to 30000 kg a cubic metre for each kind",
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
        value: |s| format!("{} of them", s.parts.len()),
        expected: "at most 64",
        holds: |s| s.parts.len() <= MAX_PARTS,
    },
    Rule {
        name: "parts",
        value: |s| format!("{:?}", s.parts),
        expected: "parts of kinds that there are, at finite places",
        holds: |s| s.parts.iter().all(|p| p.kind < s.kinds.len() && p.frame.is_finite()),
    },
    Rule {
        name: "fixtures",
        value: |s| format!("{:?}", s.fixtures.iter().map(|f| f.frame).collect::<Vec<_>>()),
        expected: "finite places",
        holds: |s| s.fixtures.iter().all(|f| f.frame.is_finite()),
    },
    Rule {
        name: "table",
        value: |s| format!("{:?}", s.table),
        expected: "the rim's lower corner first, within 10 m, and a height of 0.001 to 0.1",
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

    /// Checks that such a scene can be built. Costs the hulls of all pieces, well below a millisecond.
    ///
    /// # Errors
    /// [`TaskError::Setting`] or [`TaskError::Range`], naming what is wrong and what is possible.
    pub fn check(&self) -> Result<(), TaskError> {
        if let Some(rule) = RULES.iter().find(|rule| !(rule.holds)(self)) {
            let Rule { name, value, expected, .. } = *rule;
            return Err(TaskError::Setting { name, value: value(self), expected });
        }
        self.gripper.check()?;
        self.arm.check(self.step_ms)
    }
}
