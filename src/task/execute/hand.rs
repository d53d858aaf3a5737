//! Another hand in the scene: a person who moves a part or takes it away while the robot works.

use serde::Deserialize;
use serde_json::Value;

use super::cell::Cell;
use super::recovery::places;
use crate::robot::Pose;
use crate::robot::scene::BodyId;
use crate::sim::{cut, nearest_first};
use crate::task::event::Displaced;
use crate::task::tasks::Perturbation;

/// What a person may ask for in a live run. In JSON it is an object with one key, such as
/// `{"move":{"object":"part_0","position":[0.4,0.1,0.02]}}`.
#[derive(Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
enum Wish {
    /// Puts a body down elsewhere.
    Move {
        object: String,
        position: [f64; 3],
        /// As it stands, if it is missing.
        orientation: Option<[f64; 4]>,
    },
    /// Takes a part away for good.
    Remove { object: String },
}

/// Greatest distance of a place from the robot, in metres.
const FAR_M: f64 = 2.0;
/// Heights above a place at which there may be room for a body: what lies on the table touches it.
const LIFTS_M: [f64; 4] = [0.0, 1e-3, 2e-3, 4e-3];

impl Cell {
    /// Lets a person change the scene as the task demands it, if the time has come and it is possible.
    pub fn perturb(&mut self, perturbation: &Perturbation) -> Option<Displaced> {
        let Perturbation { at_s, body, pose } = *perturbation;
        let due = self.truth().time_s() >= at_s
            && self.is_free(body)
            && self.truth().room_for(body, &pose);
        due.then(|| self.displace(body, Some(pose))).flatten()
    }

    /// Lets a person change the scene as `wish` says. After an error nothing has changed.
    pub fn grant(&mut self, wish: &Value) -> Result<Displaced, String> {
        let (object, to) = match Wish::deserialize(wish).map_err(|error| error.to_string())? {
            Wish::Move { object, position, orientation } => (object, Some((position, orientation))),
            Wish::Remove { object } => (object, None),
        };
        let body = self.named(&object)?;
        if matches!(body, BodyId::Part(part) if self.truth().slid_m(part).is_some()) {
            return Err(format!("`{object}` slides on a rail, where only the robot moves it"));
        }
        if !self.is_free(body) {
            return Err(format!("the robot has `{object}` in hand, or is about to take it"));
        }
        let place = match (to, body) {
            (None, BodyId::Part(part)) if self.truth().lost(part) => {
                return Err(format!("`{object}` is no longer on the table"));
            }
            (None, BodyId::Part(_)) => None,
            (None, BodyId::Fixture(_)) => {
                return Err(format!("`{object}` can be moved, but not taken away: it is no part"));
            }
            (Some((position, orientation)), _) => {
                let now = self.truth().body(body).unwrap_or(Pose::at(position));
                let pose = Pose { position, orientation: orientation.unwrap_or(now.orientation) };
                Some(self.place(body, &object, pose)?)
            }
        };
        self.displace(body, place).ok_or_else(|| format!("`{object}` is not in the scene"))
    }

    /// Returns the pose nearest above `pose` at which there is room for a body.
    fn place(&self, body: BodyId, object: &str, pose: Pose) -> Result<Pose, String> {
        let turn: f64 = pose.orientation.iter().map(|v| v * v).sum::<f64>().sqrt();
        let [.., height] = pose.position;
        let near = height >= 0.0 && pose.position.iter().all(|m| m.abs() <= FAR_M);
        if !near {
            return Err(format!(
                "expected a position within {FAR_M} m, not below the table, for `{object}`"
            ));
        }
        if !(turn - 1.0).is_finite() || (turn - 1.0).abs() > 0.01 {
            return Err(format!("expected a unit quaternion [x, y, z, w] for `{object}`"));
        }
        let raised = LIFTS_M.iter().map(|lift| {
            let [x, y, z] = pose.position;
            Pose { position: [x, y, z + lift], orientation: pose.orientation.map(|v| v / turn) }
        });
        let mut raised = raised.filter(|pose| self.truth().room_for(body, pose));
        raised.next().ok_or_else(|| format!("there is no room for `{object}` there"))
    }

    /// Returns the part of this id, or the movable fixture of this name.
    fn named(&self, object: &str) -> Result<BodyId, String> {
        let all: Vec<(String, BodyId)> = self.bodies().collect();
        let own = all.iter().find(|(name, _)| name == object).map(|(_, body)| *body);
        own.ok_or_else(|| {
            let names = nearest_first(object, all.iter().map(|(name, _)| name.as_str()));
            format!("there is no `{}`; there are: {names}", cut(object, 100))
        })
    }

    /// Returns the bodies that another hand may move, with their names.
    fn bodies(&self) -> impl Iterator<Item = (String, BodyId)> {
        let (scene, sensed) = (self.truth(), self.sensed());
        let parts = (0..scene.part_count())
            .map(move |part| (places::id(&sensed, part), BodyId::Part(part)));
        let fixtures = scene.spec().fixtures.iter().enumerate();
        let fixtures = fixtures.filter_map(|(i, f)| Some((f.movable.clone()?, BodyId::Fixture(i))));
        parts.chain(fixtures)
    }

    /// Moves a body, or takes a part away. Returns what has changed; `None` if there is no such body.
    fn displace(&mut self, body: BodyId, to: Option<Pose>) -> Option<Displaced> {
        let from = self.truth().body(body)?;
        let (object, _) = self.bodies().find(|(_, own)| *own == body)?;
        let name = match body {
            BodyId::Part(part) => places::name(&self.sensed(), part),
            BodyId::Fixture(_) => format!("the {}", object.replace('_', " ")),
        };
        self.put(body, to.as_ref());
        Some(Displaced::new(self.truth().time_s(), &object, &name, from, to))
    }
}
