//! A second task, written against the public trait alone: a base block on a pad, and another block on top of
//! it.
//!
//! Scene, skills, recorder, learner, planner and closed loop are those of the first task, unchanged.

#![allow(clippy::unwrap_used, clippy::expect_used)]
#![cfg(feature = "physics")]

use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;

use rand::RngExt;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use symbolt::robot::Pose;
use symbolt::robot::SkillReport;
use symbolt::robot::arm::{BodyFrame, FINGER_TIP_M, Turn, reaches_table};
use symbolt::robot::scene::{
    BodyId, BodyKind, Fixture, Handling, Landmark, Look, Outline, Part, Scene, SceneSpec, Sensed,
    Symmetry, cuboid,
};
use symbolt::robot::skill::{Grasp, Target};
use symbolt::sim::Seed;
use symbolt::task::event::Ended;
use symbolt::task::execute::{EpisodeSpec, episode};
use symbolt::task::learn::{Settings, learn};
use symbolt::task::planner::{PlannerBuild, PlannerKind};
use symbolt::task::tasks::{
    self, Demonstrator, Judgement, Perturbation, Step, Task, parse_settings,
};
use symbolt::task::{TaskError, demonstrate};

/// The task: a base on a pad, and a top on the base.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Tower {
    /// Position of the pad, in metres.
    pad: [f64; 2],
    /// Half the width of both blocks, in metres.
    half_m: f64,
}

impl Default for Tower {
    fn default() -> Self {
        Self { pad: [0.48, -0.14], half_m: 0.016 }
    }
}

const BASE: usize = 0;
const TOP: usize = 1;
const PAD_HEIGHT_M: f64 = 0.02;

impl Tower {
    fn check(&self) -> Result<(), TaskError> {
        if !reaches_table(self.pad) {
            let value = format!("{:?}", self.pad);
            return Err(TaskError::Setting { name: "pad", value, expected: "a place in reach" });
        }
        let (value, least, most) = (self.half_m, 0.01, 0.03);
        if !(least..=most).contains(&value) {
            return Err(TaskError::Range { name: "half_m", value, least, most });
        }
        Ok(())
    }

    /// Returns where the middle of a block belongs.
    fn place(&self, part: usize) -> [f64; 3] {
        let [x, y] = self.pad;
        [x, y, PAD_HEIGHT_M + self.half_m * if part == BASE { 1.0 } else { 3.0 }]
    }

    fn is_placed(&self, scene: &Scene, part: usize) -> bool {
        let Some(Pose { position, .. }) = scene.part(part) else { return false };
        let [x, y, z] = self.place(part);
        (position[0] - x).hypot(position[1] - y) < 5e-3 && (position[2] - z).abs() < 1.5e-3
    }
}

impl Task for Tower {
    fn name(&self) -> &'static str {
        "tower"
    }

    fn description(&self) -> &'static str {
        "put a block on a pad and another block on top of it"
    }

    fn settings(&self) -> Value {
        json!(self)
    }

    fn with_settings(&self, text: &[u8], file: &str) -> Result<Arc<dyn Task>, TaskError> {
        Ok(Arc::new(parse_settings(text, file, Self::check)?))
    }

    fn scene(&self, seed: Seed) -> Result<SceneSpec, TaskError> {
        self.check()?;
        let mut rng = seed.derive("tower", "drop").rng();
        let look = |colour| Look { colour, ink: colour, roughness: 0.6 };
        let kind = |name: &str, colour| BodyKind {
            name: name.into(),
            pieces: vec![cuboid([0.0; 3], [self.half_m; 3])],
            density: 700.0,
            friction: 0.6,
            handling: Handling {
                symmetry: Symmetry { turns: 24, fold: 4, flips: false },
                rise_m: 0.05,
                release_m: self.half_m + 0.006,
                in_the_way_m: self.half_m,
                ..Handling::default()
            },
            look: look(colour),
        };
        let parts = [BASE, TOP].map(|kind| {
            // Each block starts in its own half of the area, so they never touch.
            let y = if kind == BASE { 0.04 } else { 0.18 };
            let position = [
                0.40 + 0.16 * rng.random::<f64>(),
                y + 0.08 * rng.random::<f64>(),
                self.half_m + 0.005,
            ];
            let turn = Turn::about_z(TAU * rng.random::<f64>()) * Turn::about_x(0.03);
            Part::free(kind, BodyFrame { position, turn })
        });
        let [x, y] = self.pad;
        let half = [0.035, 0.035, PAD_HEIGHT_M / 2.0];
        Ok(SceneSpec {
            kinds: vec![kind("base", 0x009e73), kind("top", 0xcc79a7)],
            parts: parts.into(),
            fixtures: vec![Fixture {
                frame: BodyFrame::at([x, y, 0.0]),
                pieces: vec![cuboid([0.0, 0.0, PAD_HEIGHT_M / 2.0], half)],
                friction: 0.6,
                look: look(0x6f7f8f),
                movable: None,
            }],
            landmarks: vec![Landmark::fixed("pad", Pose::at([x, y, PAD_HEIGHT_M]))],
            ..SceneSpec::default()
        })
    }

    /// Grasps from above, on two opposing sides.
    fn grasps(&self, scene: &Sensed<'_>, part: usize) -> Vec<Grasp> {
        let Some(BodyFrame { position: [x, y, z], turn }) = scene.body_frame(part) else {
            return Vec::new();
        };
        if turn.apply([0.0, 0.0, 1.0])[2] < 0.99 {
            return Vec::new();
        }
        let side = |quarter: u32| {
            let [x, y, _] =
                (turn * Turn::about_z(f64::from(quarter) * FRAC_PI_2)).apply([1.0, 0.0, 0.0]);
            [x, y, 0.0]
        };
        let grasp = |quarter| Grasp {
            at: [x, y, z - 0.008 + FINGER_TIP_M],
            approach: [0.0, 0.0, -1.0],
            closing: side(quarter),
            opening_m: self.half_m + 0.008,
        };
        (0..4).map(grasp).collect()
    }

    fn demonstrator(&self, _seed: Seed, _demo: usize) -> Box<dyn Demonstrator> {
        Box::new(Builder(self.clone()))
    }

    fn judge(&self, scene: &Scene) -> Judgement {
        let placed = [BASE, TOP].map(|part| self.is_placed(scene, part));
        let said = ["the base is on the pad", "the top is on the base"];
        let achieved = said.iter().zip(placed).filter(|(_, placed)| *placed);
        Judgement {
            solved: placed == [true; 2],
            achieved: achieved.map(|(said, _)| (*said).into()).collect(),
        }
    }

    fn min_actions(&self) -> usize {
        2
    }

    /// A person moves the base away as soon as the robot has released it.
    fn perturbation(&self, _seed: Seed) -> Option<Perturbation> {
        let pose = Pose::at([0.42, 0.30, self.half_m + 1e-3]);
        Some(Perturbation { at_s: 6.0, body: BodyId::Part(BASE), pose })
    }
}

/// A demonstrator that builds from the ground up.
struct Builder(Tower);

impl Demonstrator for Builder {
    fn next(&mut self, scene: &Scene, _so_far: &[SkillReport]) -> Option<Step> {
        let part = [BASE, TOP].into_iter().find(|part| !self.0.is_placed(scene, *part))?;
        Some(Step { part, target: Target::upright(self.0.place(part)) })
    }
}

#[test]
fn a_second_task_is_demonstrated_learned_and_done_through_the_trait_alone() {
    let task = Tower::default();
    let shown = demonstrate(&task, 4, Seed::new(1)).expect("it can be shown");
    assert_eq!(shown.solved, 4, "{:?}", shown.skills);
    let domain = learn(&shown.recording, &Settings::paper()).expect("it teaches").domain;
    let names: Vec<&str> = domain.states.iter().map(|state| state.name.as_str()).collect();
    assert_eq!(names, ["BASE_AT_START", "BASE_AT_PAD", "TOP_AT_START", "TOP_AT_PAD"]);
    assert_eq!(domain.operators.len(), task.min_actions());
    let build = PlannerBuild { kind: PlannerKind::Chain, ..PlannerBuild::default() };
    for seed in 0..3 {
        let spec = EpisodeSpec::of(task.clone());
        let report = episode(&domain, &build, &spec, Seed::new(seed)).expect("it runs").report;
        assert_eq!(report.ended, Ended::GoalMet, "seed {seed}: {report:?}");
        assert!(report.solved && !report.false_goal(), "seed {seed}: {report:?}");
        assert_eq!(report.skills().count(), task.min_actions(), "seed {seed}: {report:?}");
    }
    let perturbation = task.perturbation(Seed::new(1));
    let spec = EpisodeSpec { perturbation, ..EpisodeSpec::of(task.clone()) };
    // A block that a person takes away is put back.
    let over = episode(&domain, &build, &spec, Seed::new(5)).expect("runs");
    assert!(over.report.perturbed() && over.report.solved, "{:?}", over.report);
    assert_eq!(over.report.skills().count(), 3, "the base twice: {:?}", over.report);
    // The same with states in the frames of objects.
    let domain = learn(&shown.recording, &Settings::default()).expect("it teaches").domain;
    let build = PlannerBuild::default();
    for (seed, spec, skills) in [(0, EpisodeSpec::of(task), 2), (5, spec, 3)] {
        let over = episode(&domain, &build, &spec, Seed::new(seed)).expect("it runs");
        let report = &over.report;
        assert_eq!(report.ended, Ended::GoalMet, "seed {seed}: {report:?}");
        assert!(report.solved && !report.false_goal(), "seed {seed}: {report:?}");
        assert_eq!(report.skills().count(), skills, "seed {seed}: {report:?}");
        assert_eq!((over.grounds.len(), over.reference_moves), (1, None));
        let begun = report.decisions.iter().filter(|d| d.begun);
        let objects: Vec<&str> =
            begun.map(|d| d.chosen.as_ref().expect("it says which").object.as_str()).collect();
        assert_eq!(objects.last(), Some(&"top_0"), "{objects:?}");
        let again = episode(&domain, &build, &spec, Seed::new(seed)).expect("it runs");
        assert_eq!(again.report, *report);
    }
}

/// A task that needs no action.
#[derive(Debug)]
struct Nothing(Tower);

impl Task for Nothing {
    fn name(&self) -> &'static str {
        "nothing"
    }

    fn description(&self) -> &'static str {
        "leave everything as it is"
    }

    fn settings(&self) -> Value {
        self.0.settings()
    }

    fn with_settings(&self, text: &[u8], file: &str) -> Result<Arc<dyn Task>, TaskError> {
        self.0.with_settings(text, file)
    }

    fn scene(&self, seed: Seed) -> Result<SceneSpec, TaskError> {
        self.0.scene(seed)
    }

    fn grasps(&self, scene: &Sensed<'_>, part: usize) -> Vec<Grasp> {
        self.0.grasps(scene, part)
    }

    fn demonstrator(&self, seed: Seed, demo: usize) -> Box<dyn Demonstrator> {
        self.0.demonstrator(seed, demo)
    }

    fn judge(&self, scene: &Scene) -> Judgement {
        self.0.judge(scene)
    }

    fn min_actions(&self) -> usize {
        0
    }
}

#[test]
fn a_task_without_actions_is_not_shown() {
    let refused = demonstrate(&Nothing(Tower::default()), 1, Seed::new(1)).expect_err("nothing");
    assert_eq!(refused.to_string(), "`min_actions` is 0; expected at least 1 action");
}

#[test]
fn the_judge_looks_at_the_scene_alone() {
    let task = Tower::default();
    let mut scene = Scene::new(task.scene(Seed::new(3)).expect("drawn")).expect("built");
    assert_eq!(task.judge(&scene), Judgement::default());
    for part in [BASE, TOP] {
        scene.disturb(part, &Pose::at(task.place(part)));
    }
    for _ in 0..100 {
        scene.step();
    }
    assert_eq!(task.judge(&scene).achieved.len(), 2);
    assert!(task.judge(&scene).solved);
    // The outline shows the colours of the specification.
    let outline = Outline::of(scene.spec());
    assert_eq!(
        outline.kinds.iter().map(|k| k.look.colour).collect::<Vec<_>>(),
        [0x009e73, 0xcc79a7]
    );
    assert_eq!(outline.parts, [BASE, TOP]);
}

#[test]
fn settings_go_to_json_and_back_and_faults_are_named() {
    let task = Tower { half_m: 0.014, ..Tower::default() };
    let text = task.settings().to_string();
    let same = Tower::default().with_settings(text.as_bytes(), "tower.json").expect("valid");
    assert_eq!(same.settings(), task.settings());
    let refused = |text: &str| {
        let read = task.with_settings(text.as_bytes(), "tower.json");
        read.map(|_| ()).expect_err("it is refused").to_string()
    };
    let far = refused(r#"{"pad": [2.0, 0.0]}"#);
    assert!(far.starts_with("tower.json, field `pad`: [2.0, 0.0]"), "{far}");
    assert!(refused("{\n\"pat\": 1}").starts_with("tower.json, line 2: unknown field `pat`"));
    let unknown = tasks::by_name("bricks").map(|_| ()).expect_err("it is not built in").to_string();
    assert!(unknown.contains("the tasks are: nuts-and-bolts, movable-jig"), "{unknown}");
}

#[test]
fn scenes_that_cannot_be_built_are_refused_by_what_is_wrong() {
    let refused = |change: fn(&mut SceneSpec)| {
        let mut spec = Tower::default().scene(Seed::new(1)).expect("drawn");
        change(&mut spec);
        Scene::new(spec).map(|_| ()).expect_err("it is refused").to_string()
    };
    let cases: [(&str, String); 11] = [
        ("kinds", refused(|s| s.kinds[1].name = "base".into())),
        ("landmarks", refused(|s| s.landmarks[0].kind = "top".into())),
        ("pieces", refused(|s| s.kinds[0].pieces.clear())),
        ("pieces", refused(|s| s.kinds[0].pieces[0] = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])),
        ("pieces", refused(|s| s.fixtures[0].pieces[0].iter_mut().for_each(|c| c[2] = 0.0))),
        ("pieces", refused(|s| s.kinds[0].pieces[0][0][0] = f64::NAN)),
        ("density", refused(|s| s.kinds[0].density = 0.0)),
        ("friction", refused(|s| s.table.friction = f64::NAN)),
        ("handling", refused(|s| s.kinds[0].handling.symmetry.turns = 0)),
        ("parts", refused(|s| s.parts[0].kind = 2)),
        ("step_ms", refused(|s| s.step_ms = 3)),
    ];
    for (name, message) in cases {
        assert!(message.starts_with(&format!("`{name}` is ")), "{name}: {message}");
    }
}
