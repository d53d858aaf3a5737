//! The nut-and-bolt task as a [`Task`].

use std::sync::Arc;

use rand::RngExt;
use serde_json::{Value, json};

use super::demonstrator::Rules;
use super::settings::{NUT, NutsAndBolts};
use super::{grasps, scene};
use crate::robot::Pose;
use crate::robot::scene::{BodyId, Scene, SceneSpec, Sensed};
use crate::robot::skill::Grasp;
use crate::sim::Seed;
use crate::task::error::TaskError;
use crate::task::tasks::{Demonstrator, Judgement, Perturbation, Task};

impl Task for NutsAndBolts {
    fn name(&self) -> &'static str {
        "nuts-and-bolts"
    }

    fn description(&self) -> &'static str {
        "put a nut and a bolt into a jig, then the bolt through the nut"
    }

    fn settings(&self) -> Value {
        json!(self)
    }

    fn with_settings(&self, text: &[u8], file: &str) -> Result<Arc<dyn Task>, TaskError> {
        Ok(Arc::new(Self::parse(text, file)?))
    }

    fn scene(&self, seed: Seed) -> Result<SceneSpec, TaskError> {
        self.check()?;
        scene::spec(self, seed)
    }

    fn grasps(&self, scene: &Sensed<'_>, part: usize) -> Vec<Grasp> {
        match (scene.body_frame(part), scene.kinds().nth(part)) {
            (Some(frame), Some(NUT)) => grasps::nut(&frame, &self.part),
            (Some(frame), Some(_)) => grasps::bolt(&frame, &self.part),
            _ => Vec::new(),
        }
    }

    fn demonstrator(&self, seed: Seed, demo: usize) -> Box<dyn Demonstrator> {
        Box::new(Rules::new(self, seed, demo))
    }

    fn judge(&self, scene: &Scene) -> Judgement {
        self.assembly(scene).into()
    }

    fn min_actions(&self) -> usize {
        3
    }

    /// Drops the last bolt into the jig's hole at a moment of the first 20 s.
    fn perturbation(&self, seed: Seed) -> Option<Perturbation> {
        let [x, y] = self.jig.hole;
        Some(Perturbation {
            // Renaming this role would change the draw.
            at_s: 20.0 * seed.derive("meddling", "moment").rng().random::<f64>(),
            body: BodyId::Part(self.nuts + self.bolts - 1),
            pose: Pose::at([x, y, self.jig.hole_top_m + 1e-3]),
        })
    }
}
