//! The cup task: turn over a cup that stands upside down, and drop a cube into it.
//!
//! The cup stands anywhere in an area of the table. The hand takes it from the side, between two opposing flats, and
//! turns it over in place.

mod scene;
mod show;

use std::f64::consts::TAU;
use std::sync::Arc;

use rand::RngExt;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::sim::Seed;
use crate::task::domain::Pose;
use crate::task::error::TaskError;
use crate::task::robot::reaches_table;
use crate::task::scene::{BodyId, Scene, SceneSpec};
use crate::task::skill::Grasp;
use crate::task::tasks::parse_settings;
use crate::task::tasks::{Demonstrator, Judgement, Perturbation, Task};

/// The cup task and its settings, in SI units.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Cup {
    /// Corners of the area in which the cup stands, as `[x, y]`: first the corner with the smaller coordinates.
    pub area: [[f64; 2]; 2],
    /// Corners of the area in which the cube lies, as `[x, y]`: first the corner with the smaller coordinates.
    pub cube_area: [[f64; 2]; 2],
    /// Coefficient of friction of cup, cube and table (0.2 to 2).
    pub friction: f64,
}

impl Default for Cup {
    fn default() -> Self {
        Self {
            area: [[0.44, -0.20], [0.56, 0.06]],
            cube_area: [[0.40, 0.16], [0.56, 0.28]],
            friction: 0.6,
        }
    }
}

impl Cup {
    /// Checks that the task can be done with these settings.
    ///
    /// # Errors
    /// [`TaskError::Setting`] or [`TaskError::Range`], with the setting, its value and what is expected.
    pub fn check(&self) -> Result<(), TaskError> {
        let (value, least, most) = (self.friction, 0.2, 2.0);
        if !(least..=most).contains(&value) {
            return Err(TaskError::Range { name: "friction", value, least, most });
        }
        let corners = |[low, high]: [[f64; 2]; 2]| {
            [low, high, [low[0], high[1]], [high[0], low[1]]].into_iter().all(reaches_table)
                && (0..2).all(|i| low[i] <= high[i])
        };
        for (name, area) in [("area", self.area), ("cube_area", self.cube_area)] {
            if !corners(area) {
                return Err(TaskError::Setting {
                    name,
                    value: format!("{area:?}"),
                    expected: "corners within the arm's reach, the lower corner first",
                });
            }
        }
        let apart = |i: usize| {
            (self.cube_area[0][i] - self.area[1][i]).max(self.area[0][i] - self.cube_area[1][i])
        };
        if apart(0).max(apart(1)) < scene::APART_M {
            return Err(TaskError::Setting {
                name: "cube_area",
                value: format!("{:?}", self.cube_area),
                expected: "an area at least 90 mm beside `area`",
            });
        }
        Ok(())
    }
}

impl Task for Cup {
    fn name(&self) -> &'static str {
        "cup"
    }

    fn description(&self) -> &'static str {
        "turn over a cup that stands upside down, and put a cube into it"
    }

    fn settings(&self) -> Value {
        json!(self)
    }

    fn with_settings(&self, text: &[u8], file: &str) -> Result<Arc<dyn Task>, TaskError> {
        Ok(Arc::new(parse_settings(text, file, Self::check)?))
    }

    fn scene(&self, seed: Seed) -> Result<SceneSpec, TaskError> {
        self.check()?;
        Ok(scene::spec(self, seed))
    }

    fn grasps(&self, scene: &Scene, part: usize) -> Vec<Grasp> {
        match scene.body_frame(part) {
            Some(frame) if part == scene::CUP => scene::cup_grasps(&frame),
            Some(frame) => scene::cube_grasps(&frame),
            None => Vec::new(),
        }
    }

    fn demonstrator(&self, _seed: Seed, _demo: usize) -> Box<dyn Demonstrator> {
        Box::new(show::Filler)
    }

    fn judge(&self, scene: &Scene) -> Judgement {
        show::judge(scene)
    }

    fn min_actions(&self) -> usize {
        2
    }

    /// Puts the cup upside down at another place at a moment of the first 20 s.
    fn perturbation(&self, seed: Seed) -> Option<Perturbation> {
        let mut rng = seed.derive("cup", "moment").rng();
        let at_s = 20.0 * rng.random::<f64>();
        let [x, y] = scene::draw(self.area, &mut rng);
        let half = TAU * rng.random::<f64>() / 2.0;
        let position = [x, y, scene::HEIGHT_M / 2.0 + 1e-3];
        // Half a turn about x, then a turn about z.
        let orientation = [half.cos(), half.sin(), 0.0, 0.0];
        Some(Perturbation {
            at_s,
            body: BodyId::Part(scene::CUP),
            pose: Pose { position, orientation },
        })
    }
}
