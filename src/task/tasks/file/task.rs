//! A task file as a [`Task`].

use std::sync::Arc;

use rand::RngExt;
use serde_json::{Map, Value, json};

use super::demonstrator::Shower;
use super::draw::{self, Inner, Layout, Shapes};
use super::format::{LandmarkData, LookData, PartKind, Quantity, Reference, Start, TaskFile};
use super::grasps;
use super::relation::Sight;
use crate::robot::Pose;
use crate::robot::arm::BodyFrame;
use crate::robot::arm::vector::{add, unit};
use crate::robot::scene::extent::Extent;
use crate::robot::scene::{
    BodyId, BodyKind, Fixture, Handling, Landmark, Look, Part, Scene, SceneSpec, Sensed, Slider,
    Symmetry,
};
use crate::robot::skill::Grasp;
use crate::sim::Seed;
use crate::task::error::{InputFault, TaskError, json_problem};
use crate::task::tasks::{Demonstrator, Judgement, Perturbation, Task};

/// A task that is described by a [`TaskFile`].
#[derive(Debug, Clone, PartialEq)]
pub struct DataTask(Arc<Inner>);

impl DataTask {
    /// Creates the task.
    ///
    /// # Errors
    /// [`TaskError::Input`], which names the field: the scene cannot be built, or fields do not fit together.
    pub fn new(file: TaskFile) -> Result<Self, TaskError> {
        Self::named(file, "the task file")
    }

    /// Reads the task from the text of a task file. `name` is the name of the file in error messages.
    ///
    /// # Errors
    /// As [`TaskFile::parse`].
    pub fn parse(text: &[u8], name: &str) -> Result<Self, TaskError> {
        Self::named(TaskFile::read_json(text, name)?, name)
    }

    /// Creates the task; error messages call the file `name`.
    pub(super) fn named(file: TaskFile, name: &str) -> Result<Self, TaskError> {
        let fault = |field: &str, problem: String, expected: String| {
            let (file, field) = (name.into(), field.into());
            TaskError::from(InputFault { file, line: None, field, problem, expected })
        };
        file.faults().map_err(|f| fault(&f.field, f.problem, f.expected))?;
        let task = Self(Arc::new(Inner { shapes: Shapes::of(&file), file }));
        let checked = task.scene(Seed::new(0)).and_then(|spec| Ok(spec.check()?));
        checked.map_err(|error| match error {
            TaskError::Setting { name, value, expected } => fault(name, value, expected.into()),
            TaskError::Range { name, value, least, most } => {
                fault(name, value.to_string(), format!("{least} to {most}"))
            }
            other => other,
        })?;
        Ok(task)
    }

    /// Returns the task file.
    pub fn file(&self) -> &TaskFile {
        &self.0.file
    }

    /// Returns the families of grasps of which some close on nothing, at some turn, tilt or opening, in words that name the
    /// field. The robot does not use these. Looks at the first part of each kind in the scene of seed 0.
    ///
    /// # Errors
    /// As [`scene`](Task::scene).
    pub fn empty_grasps(&self) -> Result<Vec<String>, TaskError> {
        let scene = Scene::new(self.scene(Seed::new(0))?)?;
        let scene = scene.sensed();
        let mut all = Vec::new();
        for (kind, part) in self.0.file.parts.iter().enumerate() {
            let Some(index) = scene.kinds().position(|of| of == kind) else { continue };
            let Some(frame) = scene.body_frame(index) else { continue };
            for (at, family) in part.grasps.iter().enumerate() {
                let field = format!("parts[{kind}].grasps[{at}]");
                all.extend(
                    grasps::empty(family, &frame, &scene, index)
                        .map(|why| format!("{field}: {why}")),
                );
            }
        }
        Ok(all)
    }

    fn layout(&self, seed: Seed) -> Result<Layout, TaskError> {
        draw::layout(&self.0.file, &self.0.shapes, seed).map_err(|missing| TaskError::Setting {
            name: "starts",
            value: missing,
            expected: "regions with room for everything, inside the rim, and with the places of the goal in \
                       the arm's reach",
        })
    }

    fn sight(&self, scene: &Scene) -> Sight<'_> {
        Sight::of(&self.0.file, &self.0.shapes, scene)
    }
}

impl Reference {
    /// Returns the places that recordings show.
    pub(super) fn marks(&self) -> Vec<LandmarkData> {
        if self.landmarks.is_empty() {
            return vec![LandmarkData { name: self.name.clone(), at: [0.0; 3] }];
        }
        self.landmarks.clone()
    }
}

impl LookData {
    pub(super) fn number(colour: &str) -> Option<u32> {
        let digits = colour.strip_prefix('#').filter(|d| d.len() == 6)?;
        u32::from_str_radix(digits, 16).ok()
    }

    fn look(&self) -> Look {
        let colour = Self::number(&self.colour).unwrap_or(0);
        let ink = self.ink.as_deref().and_then(Self::number).unwrap_or(colour);
        Look { colour, ink, roughness: self.roughness }
    }
}

impl Inner {
    fn kinds(&self) -> Vec<BodyKind> {
        let kinds = self.file.parts.iter().zip(&self.shapes.parts);
        let kind = kinds.map(|(part, pieces)| BodyKind {
            name: part.kind.clone(),
            pieces: pieces.clone(),
            density: part.density,
            friction: part.friction,
            handling: Handling {
                symmetry: Symmetry {
                    turns: part.handling.turns,
                    fold: part.handling.fold,
                    flips: part.handling.flips,
                },
                rise_m: part.handling.rise_m,
                release_m: part.handling.release_m,
                in_the_way_m: part.handling.in_the_way_m,
                fall_m: part.handling.fall_m,
                clear_m: part.handling.clear_m,
            },
            look: part.look.look(),
        });
        kind.collect()
    }

    fn furniture(&self, layout: &Layout) -> (Vec<Fixture>, Vec<Landmark>) {
        let (mut fixtures, mut landmarks) = (Vec::new(), Vec::new());
        for (kind, reference) in self.file.references.iter().enumerate() {
            for frame in &layout.references[kind] {
                let pieces = self.shapes.references[kind].clone();
                let body = reference.movable.then_some(BodyId::Fixture(fixtures.len()));
                if !pieces.is_empty() {
                    let (friction, look) = (reference.friction, reference.look.look());
                    let movable = reference.movable.then(|| reference.name.clone());
                    fixtures.push(Fixture { frame: *frame, pieces, friction, look, movable });
                }
                landmarks.extend(reference.marks().into_iter().map(|mark| {
                    let position = add(frame.position, frame.turn.apply(mark.at));
                    let pose = match body {
                        Some(_) => Pose::at(mark.at),
                        None => BodyFrame { position, turn: frame.turn }.pose(),
                    };
                    Landmark { kind: mark.name, pose, body }
                }));
            }
        }
        (fixtures, landmarks)
    }

    /// Returns the number of the first fixture of a kind of reference.
    fn first_fixture(&self, layout: &Layout, reference: usize) -> usize {
        let before = layout.references[..reference].iter().zip(&self.shapes.references);
        before.filter(|(_, shape)| !shape.is_empty()).map(|(frames, _)| frames.len()).sum()
    }

    /// Returns the parts in the order of the file, which is that of the layout.
    fn parts(&self, layout: &Layout) -> Vec<Part> {
        let kinds = self.file.parts.iter();
        let starts = kinds.flat_map(|kind| kind.starts.iter().map(move |start| (kind, start)));
        let each = starts.flat_map(|pair| std::iter::repeat_n(pair, pair.1.count));
        let part =
            |((kind, start), (number, frame)): ((&PartKind, &Start), &(usize, BodyFrame))| {
                let slider = kind.slider.map(|slider| Slider {
                    fixture: start.region.as_ref().and_then(|region| {
                        let named =
                            self.file.references.iter().position(|r| r.name == region.of)?;
                        let carries = self.file.references[named].movable;
                        carries.then(|| self.first_fixture(layout, named))
                    }),
                    axis: unit(slider.axis),
                    range_m: slider.range_m,
                    friction_n: slider.friction_n,
                });
                Part { kind: *number, frame: *frame, slider }
            };
        each.zip(&layout.parts).map(part).collect()
    }

    /// Returns the number of parts of one kind.
    pub fn count(&self, kind: &str) -> usize {
        let named = self.file.parts.iter().filter(|part| part.kind == kind);
        named.flat_map(|part| &part.starts).map(|start| start.count).sum()
    }

    /// Returns the number of instances of a relation's reference.
    pub fn instances(&self, reference: &str) -> usize {
        if reference == super::WORLD {
            return 1;
        }
        let named = self.file.references.iter().filter(|r| r.name == reference);
        let fixed: usize = named.flat_map(|r| &r.starts).map(|start| start.count).sum();
        fixed + self.count(reference)
    }
}

/// Distance that another hand keeps from everything else, in metres.
const APART_M: f64 = 0.025;

impl Inner {
    /// Returns the space that everything but one body takes in a layout.
    fn taken(&self, layout: &Layout, but: BodyId) -> Vec<Extent> {
        let mut taken = Vec::new();
        for (part, (kind, frame)) in layout.parts.iter().enumerate() {
            if but != BodyId::Part(part) {
                taken.push(Extent::of(&self.shapes.corners[*kind], frame));
            }
        }
        let mut fixtures = 0;
        for (kind, reference) in self.file.references.iter().enumerate() {
            for frame in &layout.references[kind] {
                let room = self.shapes.room(kind, reference, frame);
                if !self.shapes.references[kind].is_empty() {
                    taken.extend(room.filter(|_| but != BodyId::Fixture(fixtures)));
                    fixtures += 1;
                }
            }
        }
        taken
    }
}

impl Task for DataTask {
    fn name(&self) -> &str {
        &self.0.file.name
    }

    fn description(&self) -> &str {
        &self.0.file.description
    }

    fn settings(&self) -> Value {
        json!(self.0.file)
    }

    /// Reads a whole task file, or some of its fields (those of the uppermost level) that replace this task's own.
    fn with_settings(&self, text: &[u8], file: &str) -> Result<Arc<dyn Task>, TaskError> {
        let given: Map<String, Value> =
            serde_json::from_slice(text).map_err(|error| InputFault {
                file: file.into(),
                line: (error.line() > 0).then(|| error.line()),
                field: String::new(),
                problem: json_problem(&error),
                expected: "a task file, or an object with some of its fields".into(),
            })?;
        if given.contains_key("format") {
            return Ok(Arc::new(Self::parse(text, file)?));
        }
        let mut whole = self.settings();
        if let Value::Object(fields) = &mut whole {
            fields.extend(given);
        }
        Ok(Arc::new(Self::named(TaskFile::of_value(whole, file)?, file)?))
    }

    fn scene(&self, seed: Seed) -> Result<SceneSpec, TaskError> {
        let Inner { file, .. } = &*self.0;
        let layout = self.layout(seed)?;
        let (fixtures, landmarks) = self.0.furniture(&layout);
        Ok(SceneSpec {
            kinds: self.0.kinds(),
            parts: self.0.parts(&layout),
            fixtures,
            landmarks,
            table: file.table,
            gripper: file.gripper,
            arm: file.arm,
            step_ms: file.step_ms,
        })
    }

    fn grasps(&self, scene: &Sensed<'_>, part: usize) -> Vec<Grasp> {
        let kind = scene.kinds().nth(part).and_then(|kind| self.0.file.parts.get(kind));
        match (kind, scene.body_frame(part)) {
            (Some(kind), Some(frame)) => {
                let mut all = grasps::grasps(&kind.grasps, &frame);
                // Spare the robot postures in which the hand has no room, or closes on nothing.
                all.retain(|grasp| {
                    let room = |tool| !scene.hand_collides(&tool, grasp.opening_m, &[part]);
                    grasps::holds(grasp, scene, part) && grasp.tool().is_some_and(room)
                });
                all
            }
            _ => Vec::new(),
        }
    }

    fn demonstrator(&self, seed: Seed, demo: usize) -> Box<dyn Demonstrator> {
        Box::new(Shower::new(self.0.clone(), seed, demo))
    }

    fn judge(&self, scene: &Scene) -> Judgement {
        let sight = self.sight(scene);
        let goal = &self.0.file.goal;
        let mut achieved = Vec::new();
        for relation in goal {
            achieved.extend(sight.held(relation).into_iter().map(|held| {
                let (part, to, instance) = (held.part, &relation.reference, held.instance);
                let place =
                    if to == super::WORLD { String::new() } else { format!(", {to}_{instance}") };
                format!("{}: part {part}{place}", relation.name)
            }));
        }
        Judgement { solved: goal.iter().all(|relation| sight.holds(relation)), achieved }
    }

    /// Counts one action for each part that the goal and the conditions ask for, and one for each part that starts on
    /// another.
    fn min_actions(&self) -> usize {
        let file = &self.0.file;
        let asked = file.relations().map(|relation| match relation.quantity {
            Quantity::Each => self.0.instances(&relation.reference),
            Quantity::One => 1,
            Quantity::AtLeast(least) => least,
        });
        let starts = file.parts.iter().flat_map(|part| &part.starts);
        let on: usize = starts.filter(|start| start.on.is_some()).map(|start| start.count).sum();
        asked.sum::<usize>() + on
    }

    /// Draws one of the file's perturbations. References stand as in the scene with the same seed.
    fn perturbation(&self, seed: Seed) -> Option<Perturbation> {
        let Inner { file, shapes } = &*self.0;
        let mut rng = seed.derive("meddling", "another hand").rng();
        if file.perturbations.is_empty() {
            return None;
        }
        let drawn = &file.perturbations[rng.random_range(0..file.perturbations.len())];
        let layout = self.layout(seed).ok()?;
        let kind = file.parts.iter().position(|part| part.kind == drawn.moves);
        let moved = file.references.iter().position(|r| r.name == drawn.moves);
        let all: Vec<BodyId> = match (kind, moved) {
            (Some(kind), _) => {
                let parts = layout.parts.iter().enumerate().filter(|(_, part)| part.0 == kind);
                parts.map(|(part, _)| BodyId::Part(part)).collect()
            }
            (None, Some(moved)) => {
                let first = self.0.first_fixture(&layout, moved);
                (first..first + layout.references[moved].len()).map(BodyId::Fixture).collect()
            }
            (None, None) => Vec::new(),
        };
        let body = *all.get(rng.random_range(0..all.len().max(1)))?;
        let reference = file.references.iter().position(|r| r.name == drawn.to.of);
        let base = match reference {
            Some(reference) => *layout.references[reference].first()?,
            None => BodyFrame::at([0.0; 3]),
        };
        let (corners, turns) = match kind {
            Some(kind) => (&shapes.corners[kind][..], file.parts[kind].handling.turns),
            None => (&[][..], 1),
        };
        let others = self.0.taken(&layout, body);
        let space = |frame: &BodyFrame| match moved {
            Some(moved) => shapes.room(moved, &file.references[moved], frame),
            None => Some(Extent::of(corners, frame)),
        };
        // Another hand leaves room for the gripper beside everything that has not moved.
        let mut draw = || draw::draw_in(&drawn.to, &base, corners, turns, &mut rng);
        let first = draw();
        let is_free = |frame: &BodyFrame| {
            space(frame).is_none_or(|space| !others.iter().any(|other| space.near(other, APART_M)))
        };
        let drawn_again = (0..200).map(|_| draw());
        let frame = std::iter::once(first).chain(drawn_again).find(is_free).unwrap_or(first);
        let [from, to] = drawn.between_s;
        let pose: Pose = frame.pose();
        Some(Perturbation { at_s: from + (to - from) * rng.random::<f64>(), body, pose })
    }
}
