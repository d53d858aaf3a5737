//! What holds over an episode: the state of each object and the terms of the goal at each frame, found from the poses.

use serde_json::{Value, json};

use super::arrays::kept;
use super::film::Film;
use crate::robot::Pose;
use crate::robot::scene::{BodyId, SceneSpec};
use crate::task::classify::{Classifier, Layout};
use crate::task::compile::Problem;
use crate::task::domain::naming::object_names;
use crate::task::domain::{Fact, RelationalDomain};
use crate::task::recording::{ObjectPose, Snapshot};

/// Greatest number of frames of an episode that are examined.
const MAX_LOOKS: usize = 1_500;
/// Height below which a part has left the table, in metres.
const GONE_M: f64 = -0.05;
/// Movement below which nothing has changed, in metres and in components of the quaternion.
const STILL: f64 = 1e-6;

/// The objects of a scene as recordings name them: the parts, then the landmarks.
pub(super) struct Objects<'s> {
    scene: &'s SceneSpec,
    names: Vec<(String, &'s str)>,
}

impl<'s> Objects<'s> {
    /// Names the objects: each has the name of its kind and a number from 0.
    pub fn of(scene: &'s SceneSpec) -> Self {
        let parts = scene.parts.iter().map(|part| scene.kinds[part.kind].name.as_str());
        let landmarks = scene.landmarks.iter().map(|landmark| landmark.kind.as_str());
        let names =
            [parts.collect::<Vec<_>>(), landmarks.collect()].into_iter().flat_map(|kinds| {
                let name = |i: usize| {
                    let number = kinds[..i].iter().filter(|other| **other == kinds[i]).count();
                    (format!("{}_{number}", kinds[i]), kinds[i])
                };
                (0..kinds.len()).map(name).collect::<Vec<_>>()
            });
        Self { scene, names: names.collect() }
    }

    /// Index among the bodies of a picture frame of what a landmark moves with; `None` if it never moves.
    fn carrier(&self, landmark: usize) -> Option<usize> {
        match self.scene.landmarks[landmark].body? {
            BodyId::Part(part) => Some(part),
            BodyId::Fixture(index) => {
                let before = self.scene.fixtures[..index].iter().filter(|f| f.movable.is_some());
                Some(self.scene.parts.len() + before.count())
            }
        }
    }

    /// Returns the objects for the page: id and kind of each part, and of each landmark also its pose and the body in the
    /// picture that it moves with.
    pub fn to_page(&self) -> Value {
        let parts = self.scene.parts.len();
        let named = |i: usize| json!({"id": self.names[i].0, "kind": self.names[i].1});
        let landmark = |i: usize| {
            let (id, kind) = &self.names[parts + i];
            let pose = self.scene.landmarks[i].pose;
            json!({"id": id, "kind": kind, "pose": pose, "on": self.carrier(i)})
        };
        json!({
            "parts": (0..parts).map(named).collect::<Vec<_>>(),
            "landmarks": (0..self.scene.landmarks.len()).map(landmark).collect::<Vec<_>>(),
        })
    }

    /// Returns the poses of all objects in a frame. What fell off the table is far away from everything.
    fn poses(&self, film: &Film, frame: usize) -> Option<Vec<Pose>> {
        let parts = (0..self.scene.parts.len()).map(|part| {
            let pose = film.pose(frame, part)?;
            let gone = pose.position[2] <= GONE_M;
            Some(if gone { Pose::at([0.0, 0.0, -10.0 * (1.0 + part as f64)]) } else { pose })
        });
        let landmarks = self.scene.landmarks.iter().enumerate().map(|(i, landmark)| {
            let Some(on) = self.carrier(i) else { return Some(landmark.pose) };
            Some(film.pose(frame, on)?.after(&landmark.pose))
        });
        parts.chain(landmarks).collect()
    }

    fn snapshot(&self, poses: &[Pose]) -> Snapshot {
        let object = |((id, kind), pose): (&(String, &str), &Pose)| ObjectPose {
            id: id.as_str().into(),
            kind: (*kind).into(),
            pose: *pose,
        };
        Snapshot {
            objects: self.names.iter().zip(poses).map(object).collect(),
            ..Snapshot::default()
        }
    }

    /// Finds what holds over an episode: of each object whose kind has states a list of changes `[seconds, state, statement]`, and of each term of the goal a list of changes `[seconds, how many are lacking]`. A state is null where
    /// the object is in none. `None` if the domain cannot be used with the names of the scene.
    pub fn situations(&self, film: &Film, domain: &RelationalDomain) -> Option<Value> {
        // The recorded kinds are then not those of the scene.
        if !domain.sub_kinds.is_empty() || film.len() == 0 {
            return None;
        }
        let people = object_names(self.names.iter().map(|(id, kind)| (id.as_str(), *kind)));
        let classifier = Classifier::new(domain);
        let begun = self.poses(film, 0)?;
        let first = classifier.classify(&self.snapshot(&begun));
        let terms = domain
            .goals
            .iter()
            .map(|goal| Problem::with_goals(domain, &first, vec![goal.clone()]).ok());
        let terms: Vec<Option<Problem<'_>>> = terms.collect();
        let mut states: Vec<Vec<Value>> = vec![Vec::new(); self.names.len()];
        let mut lacking: Vec<Vec<Value>> = vec![Vec::new(); terms.len()];
        let mut before: Option<(Vec<Pose>, Layout)> = None;
        // With where it is, in words.
        let mut last: Vec<Option<(Option<Fact>, Option<String>)>> = vec![None; self.names.len()];
        let mut lacked: Vec<Option<usize>> = vec![None; terms.len()];
        let step = film.len().div_ceil(MAX_LOOKS).max(1);
        for frame in kept(film.len(), step) {
            let poses = self.poses(film, frame)?;
            if before.as_ref().is_some_and(|(old, _)| still(old, &poses)) {
                continue;
            }
            let snapshot = self.snapshot(&poses);
            let layout = match &before {
                None => classifier.classify(&snapshot),
                Some((_, layout)) => classifier.classify_after(layout, &snapshot),
            };
            let t = (1e3 * film.time_s(frame)).round() / 1e3;
            let situation = layout.situation();
            for (i, fact) in situation.iter().enumerate() {
                let words = fact.map(|fact| {
                    domain.whereabouts(&fact, i, &people, &snapshot.objects, &begun[i])
                });
                let now = Some((*fact, words.clone()));
                if last[i] != now {
                    last[i] = now;
                    let state = fact.map(|fact| &domain.states[fact.state].name);
                    states[i].push(json!([t, state, words]));
                }
            }
            for (i, term) in terms.iter().enumerate() {
                let now = term.as_ref().map(|term| term.lacking(&situation));
                if now.is_some() && lacked[i] != now {
                    lacked[i] = now;
                    lacking[i].push(json!([t, now]));
                }
            }
            before = Some((poses, layout));
        }
        let parts = states[..self.scene.parts.len()].iter().enumerate();
        let known = |kind: &str| domain.states.iter().any(|state| state.kind == kind);
        let own: Vec<Value> = parts
            .filter(|(i, _)| known(self.names[*i].1))
            .map(|(i, changes)| {
                json!({"id": self.names[i].0, "name": people[i], "part": i, "changes": changes})
            })
            .collect();
        let goal: Vec<Value> = (domain.goals.iter().zip(&lacking))
            .map(|(goal, changes)| json!({"term": domain.goal_in_words(goal), "changes": changes}))
            .collect();
        Some(json!({"objects": own, "goal": goal}))
    }
}

/// Returns whether nothing has moved.
fn still(before: &[Pose], now: &[Pose]) -> bool {
    let numbers = |pose: &Pose| pose.position.into_iter().chain(pose.orientation);
    before
        .iter()
        .zip(now)
        .all(|(a, b)| numbers(a).zip(numbers(b)).all(|(x, y)| (x - y).abs() <= STILL))
}
