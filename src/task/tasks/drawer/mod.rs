//! The drawer task: open a drawer, put blocks into it, and close it.
//!
//! The cabinet stands at a place and in a direction that differ from scene to scene. The drawer moves on a
//! [`Slider`](crate::task::scene::Slider) with friction; the blocks in it move along by friction alone.

mod scene;
mod show;

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

/// The drawer task and its settings, in SI units.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Drawer {
    /// Number of blocks, 1 or 2.
    pub blocks: usize,
    /// Mean position of the cabinet on the table, as `[x, y]`.
    pub cabinet: [f64; 2],
    /// Greatest deviation of the cabinet from its mean position, along x and along y (0 to 0.05).
    pub spread_m: f64,
    /// Greatest deviation of the drawer's direction from the y axis, in degrees (0 to 45).
    pub spread_deg: f64,
    /// Friction of the drawer's guide, in newtons (0.1 to 10).
    pub guide_n: f64,
    /// Coefficient of friction of blocks, drawer and table (0.2 to 2).
    pub friction: f64,
}

impl Default for Drawer {
    fn default() -> Self {
        Self {
            blocks: 1,
            cabinet: [0.47, -0.20],
            spread_m: 0.03,
            spread_deg: 20.0,
            guide_n: 2.0,
            friction: 0.6,
        }
    }
}

impl Drawer {
    /// Checks that the task can be done with these settings.
    ///
    /// # Errors
    /// [`TaskError::Setting`] or [`TaskError::Range`], with the setting, its value and what is expected.
    pub fn check(&self) -> Result<(), TaskError> {
        if !(1..=2).contains(&self.blocks) {
            let value = self.blocks.to_string();
            return Err(TaskError::Setting { name: "blocks", value, expected: "1 or 2" });
        }
        for (name, value, least, most) in [
            ("spread_m", self.spread_m, 0.0, 0.05),
            ("spread_deg", self.spread_deg, 0.0, 45.0),
            ("guide_n", self.guide_n, 0.1, 10.0),
            ("friction", self.friction, 0.2, 2.0),
        ] {
            if !(least..=most).contains(&value) {
                return Err(TaskError::Range { name, value, least, most });
            }
        }
        if !reaches_table(self.cabinet) || self.cabinet[1] > -0.1 {
            return Err(TaskError::Setting {
                name: "cabinet",
                value: format!("{:?}", self.cabinet),
                expected: "a place within the arm's reach, with y of at most -0.1",
            });
        }
        Ok(())
    }
}

impl Task for Drawer {
    fn name(&self) -> &'static str {
        "drawer"
    }

    fn description(&self) -> &'static str {
        "open a drawer, put every block into it, and close it"
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
        scene.body_frame(part).map_or_else(Vec::new, |frame| scene::grasps(&frame, part))
    }

    fn demonstrator(&self, _seed: Seed, _demo: usize) -> Box<dyn Demonstrator> {
        Box::new(show::Filler)
    }

    fn judge(&self, scene: &Scene) -> Judgement {
        show::judge(scene)
    }

    fn min_actions(&self) -> usize {
        2 + self.blocks
    }

    /// Puts the last block elsewhere on the table at a moment of the first 20 s.
    fn perturbation(&self, seed: Seed) -> Option<Perturbation> {
        let mut rng = seed.derive("drawer", "moment").rng();
        Some(Perturbation {
            at_s: 20.0 * rng.random::<f64>(),
            body: BodyId::Part(self.blocks),
            pose: Pose::at([0.40 + 0.14 * rng.random::<f64>(), 0.31, scene::HALF_M + 1e-3]),
        })
    }
}
