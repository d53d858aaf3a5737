//! The nut-and-bolt task with a jig that stands elsewhere in every scene and may be moved during an episode, and with
//! parts on the table that the task does not need.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;

use rand::{Rng, RngExt};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::check::can_stand;
use super::demonstrator::Rules;
use super::scene::{self, BOLT, NUT};
use super::settings::NutsAndBolts;
use super::{grasps, start};
use crate::sim::Seed;
use crate::task::domain::Pose;
use crate::task::error::TaskError;
use crate::task::robot::{BodyFrame, FINGER_TIP_M};
use crate::task::scene::{
    BodyId, BodyKind, Fixture, Handling, Look, Piece, Scene, SceneSpec, Symmetry, cuboid,
};
use crate::task::skill::Grasp;
use crate::task::tasks::{Demonstrator, Judgement, Perturbation, Task, parse_settings};

/// The task with a movable jig, and its settings. Lengths in metres, angles in degrees.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MovableJig {
    /// Parts, jig, table and robot. The places of pocket and hole are those of the jig's mean pose.
    pub assembly: NutsAndBolts,
    /// Number of blocks on the table, which the task does not need (0 to 4).
    pub blocks: usize,
    /// Name of a block's kind in recordings.
    pub block_kind: String,
    /// Greatest deviation of the jig from its mean place along x and along y (0 to 0.1).
    pub spread_m: f64,
    /// Greatest turn of the jig from its mean direction (0 to 180).
    pub spread_deg: f64,
}

impl Default for MovableJig {
    fn default() -> Self {
        Self {
            assembly: NutsAndBolts { nuts: 2, bolts: 2, ..NutsAndBolts::default() },
            blocks: 2,
            block_kind: "block".into(),
            spread_m: 0.04,
            spread_deg: 30.0,
        }
    }
}

/// Index of the blocks' kind in the scene.
pub(super) const BLOCK: usize = 2;
/// Index of the jig among the fixtures.
const JIG: usize = 0;
/// Half the size of a block, in metres.
pub(super) const HALF_M: f64 = 0.013;
/// Number of draws of a pose for the jig.
const DRAWS: usize = 2_000;
const BLOCK_LOOK: Look = Look { colour: 0x009e73, ink: 0x00704f, roughness: 0.6 };

/// The jig's place on the table and its turn from its mean direction, in radians.
#[derive(Debug, Clone, Copy)]
struct JigPose {
    at: [f64; 2],
    turn: f64,
}

impl JigPose {
    fn pose(self) -> Pose {
        let [x, y] = self.at;
        let (sin, cos) = (self.turn / 2.0).sin_cos();
        Pose { position: [x, y, 0.0], orientation: [0.0, 0.0, sin, cos] }
    }

    /// Returns the place on the table of a point that is `by` from the jig's middle in its mean direction.
    fn place(self, by: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.turn.sin_cos();
        [self.at[0] + cos * by[0] - sin * by[1], self.at[1] + sin * by[0] + cos * by[1]]
    }
}

impl MovableJig {
    /// Checks that the scene can be built and that the task can be done in it.
    ///
    /// # Errors
    /// As [`NutsAndBolts::check`]; [`TaskError::Setting`] or [`TaskError::Range`] for settings of the movable jig.
    pub fn check(&self) -> Result<(), TaskError> {
        self.assembly.check()?;
        for (name, value, least, most) in [
            ("blocks", self.blocks as f64, 0.0, 4.0),
            ("spread_m", self.spread_m, 0.0, 0.1),
            ("spread_deg", self.spread_deg, 0.0, 180.0),
        ] {
            if !(least..=most).contains(&value) {
                return Err(TaskError::Range { name, value, least, most });
            }
        }
        let NutsAndBolts { nut_kind, bolt_kind, .. } = &self.assembly;
        let places = self.assembly.places();
        let taken = places.iter().chain([nut_kind, bolt_kind]).any(|name| *name == self.block_kind);
        if taken || !(1..=200).contains(&self.block_kind.chars().count()) {
            return Err(TaskError::Setting {
                name: "block_kind",
                value: format!("`{}`", self.block_kind),
                expected: "a name of 1 to 200 characters that no other kind or place has",
            });
        }
        start::parts(&self.assembly, self.blocks, Seed::new(0)).map(|_| ())
    }

    /// Returns the jig's mean place, and pocket and hole relative to it.
    fn middle(&self) -> ([f64; 2], [[f64; 2]; 2]) {
        let jig = &self.assembly.jig;
        let at = std::array::from_fn(|i| (jig.pocket[i] + jig.hole[i]) / 2.0);
        let from = |place: [f64; 2]| [place[0] - at[0], place[1] - at[1]];
        (at, [from(jig.pocket), from(jig.hole)])
    }

    /// Draws a pose of the jig in which the arm reaches both of its places and the parts have room.
    fn draw(&self, rng: &mut impl Rng) -> Result<JigPose, TaskError> {
        let (middle, places) = self.middle();
        let mut spread = |most: f64| most * (2.0 * rng.random::<f64>() - 1.0);
        let found = (0..DRAWS).find_map(|_| {
            let at = middle.map(|v| v + spread(self.spread_m));
            let pose = JigPose { at, turn: spread(self.spread_deg.to_radians()) };
            can_stand(&self.assembly, places.map(|by| pose.place(by))).then_some(pose)
        });
        found.ok_or_else(|| TaskError::Setting {
            name: "spread_m",
            value: self.spread_m.to_string(),
            expected: "a spread in which the jig finds a place within reach",
        })
    }

    fn block(&self) -> BodyKind {
        let part = &self.assembly.part;
        BodyKind {
            name: self.block_kind.clone(),
            pieces: vec![cuboid([0.0; 3], [HALF_M; 3])],
            density: 700.0,
            friction: part.friction,
            handling: Handling {
                symmetry: Symmetry { turns: 24, fold: 4, flips: true },
                release_m: HALF_M + 0.006,
                ..Handling::default()
            },
            look: BLOCK_LOOK,
        }
    }
}

/// Returns pieces moved by `by` along the table.
fn moved(pieces: &[Piece], by: [f64; 2]) -> impl Iterator<Item = Piece> {
    pieces
        .iter()
        .map(move |piece| piece.iter().map(|[x, y, z]| [x + by[0], y + by[1], *z]).collect())
}

impl Task for MovableJig {
    fn name(&self) -> &'static str {
        "movable-jig"
    }

    fn description(&self) -> &'static str {
        "put a nut and a bolt together in a jig that stands anywhere and may be moved, among spare parts"
    }

    fn settings(&self) -> Value {
        json!(self)
    }

    fn with_settings(&self, text: &[u8], file: &str) -> Result<Arc<dyn Task>, TaskError> {
        Ok(Arc::new(parse_settings(text, file, Self::check)?))
    }

    fn scene(&self, seed: Seed) -> Result<SceneSpec, TaskError> {
        self.check()?;
        let jig = self.draw(&mut seed.derive("scene", "jig").rng())?;
        let mut spec = scene::spec(&self.assembly, seed)?;
        let (_, places) = self.middle();
        let blocks = spec.fixtures.iter().zip(places);
        let pieces = blocks.flat_map(|(block, by)| moved(&block.pieces, by)).collect();
        let (look, friction) = (spec.fixtures[JIG].look, spec.fixtures[JIG].friction);
        let frame = BodyFrame::from(&jig.pose());
        spec.fixtures =
            vec![Fixture { frame, pieces, friction, look, movable: Some("jig".into()) }];
        for (landmark, [x, y]) in spec.landmarks.iter_mut().zip(places) {
            landmark.pose = Pose::at([x, y, landmark.pose.position[2]]);
            landmark.body = Some(BodyId::Fixture(JIG));
        }
        spec.kinds.push(self.block());
        spec.parts = start::parts(&self.assembly, self.blocks, seed)?;
        Ok(spec)
    }

    fn grasps(&self, scene: &Scene, part: usize) -> Vec<Grasp> {
        let Some(frame) = scene.body_frame(part) else { return Vec::new() };
        match scene.kinds().nth(part) {
            Some(NUT) => grasps::nut(&frame, &self.assembly.part),
            Some(BOLT) => grasps::bolt(&frame, &self.assembly.part),
            _ => block_grasps(&frame),
        }
    }

    fn demonstrator(&self, seed: Seed, demo: usize) -> Box<dyn Demonstrator> {
        Box::new(Rules::new(&self.assembly, seed, demo))
    }

    fn judge(&self, scene: &Scene) -> Judgement {
        self.assembly.assembly(scene).into()
    }

    fn min_actions(&self) -> usize {
        3
    }

    /// Moves the jig, with what lies in it, to another place at a moment of the first 20 s.
    fn perturbation(&self, seed: Seed) -> Option<Perturbation> {
        let mut rng = seed.derive("meddling", "jig").rng();
        let at_s = 20.0 * rng.random::<f64>();
        let pose = self.draw(&mut rng).ok()?.pose();
        Some(Perturbation { at_s, body: BodyId::Fixture(JIG), pose })
    }
}

/// Returns the grasps for a block from above, on two opposing sides; no grasps if it stands on an edge.
fn block_grasps(frame: &BodyFrame) -> Vec<Grasp> {
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|a| frame.turn.apply(a));
    let Some(up) = axes.iter().position(|axis| axis[2].abs() > 0.99) else { return Vec::new() };
    let side = axes[(up + 1) % 3];
    let bearing = side[1].atan2(side[0]);
    let [x, y, z] = frame.position;
    let grasp = |quarter: u32| {
        let (sin, cos) = (bearing + f64::from(quarter) * FRAC_PI_2).rem_euclid(TAU).sin_cos();
        Grasp {
            at: [x, y, z - 0.006 + FINGER_TIP_M],
            approach: [0.0, 0.0, -1.0],
            closing: [cos, sin, 0.0],
            opening_m: HALF_M + 0.008,
        }
    };
    (0..4).map(grasp).collect()
}
