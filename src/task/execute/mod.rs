//! The closed loop: look, ask the planner graph, do what it says, look again.
//!
//! The scene is the planner graph's world, so that planning and physics go on in the same simulated time:
//! while the graph thinks the parts lie and roll, and while the arm moves the graph idles. After every
//! skill, however it ended, everything is looked at and decided anew.
//!
//! The executor knows what was learned and, from the task, how to take hold of parts; of the task itself it knows
//! nothing. Which part goes where is a state's mean pose.

mod choose;
mod demonstrate;
mod recorder;
mod thoughts;
mod world;

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::sim::{RunConfig, Seed, SimDuration, SimView, Simulator, StopReason};
use crate::task::domain::Grounding;
use crate::task::domain::Obstacle;
use crate::task::error::TaskError;
use crate::task::planner::Planner;
use crate::task::scene::SceneFrame;
use crate::task::skill::{SkillOutcome, SkillReport, Touch};
pub use crate::task::tasks::Perturbation;
use crate::task::tasks::{self, Task};
pub use demonstrate::{Demonstrated, demonstrate};
pub use recorder::Recorder;
pub use thoughts::{ModuleSamples, Thoughts};
pub use world::{AssemblyWorld, Doing};

/// How episodes are run.
#[derive(Debug, Clone)]
pub struct EpisodeSpec {
    /// The task, which draws the scene.
    pub task: Arc<dyn Task>,
    /// The probability, for each grasp, that the fingers open at a uniformly drawn moment of the
    /// carrying (0 to 1).
    pub drop_rate: f64,
    /// Simulated seconds after which an episode is given up.
    pub limit_s: f64,
    /// Skills after which an episode is given up.
    pub most_skills: usize,
    /// What a person does meanwhile.
    pub perturbation: Option<Perturbation>,
    /// Simulated milliseconds between frames kept for pictures; `None` to keep none.
    pub frame_ms: Option<u64>,
}

impl Default for EpisodeSpec {
    fn default() -> Self {
        Self {
            task: tasks::default(),
            drop_rate: 0.0,
            limit_s: 400.0,
            most_skills: 30,
            perturbation: None,
            frame_ms: None,
        }
    }
}

impl EpisodeSpec {
    /// Episodes of a task, with nothing going wrong.
    pub fn of(task: impl Task + 'static) -> Self {
        Self { task: Arc::new(task), ..Self::default() }
    }

    /// Checks the numbers, and that the task's scene can be built.
    ///
    /// # Errors
    /// [`TaskError::Setting`] for a rate or limit outside its range, or a perturbation of a part that is not there; as
    /// [`Task::scene`] and [`SceneSpec::check`](crate::task::scene::SceneSpec::check).
    pub fn check(&self) -> Result<(), TaskError> {
        let scene = self.task.scene(Seed::new(0))?;
        scene.check()?;
        let refuse =
            |name, value: String, expected| Err(TaskError::Setting { name, value, expected });
        if !(0.0..=1.0).contains(&self.drop_rate) {
            return refuse("drop_rate", self.drop_rate.to_string(), "0 to 1");
        }
        if let Some(perturbation) = &self.perturbation {
            if perturbation.part >= scene.parts.len() {
                return refuse(
                    "perturbation.part",
                    perturbation.part.to_string(),
                    "a part's place in the scene",
                );
            }
            let turn: f64 = perturbation.pose.orientation.iter().map(|v| v * v).sum();
            let finite =
                perturbation.pose.position.iter().all(|v| v.is_finite()) && turn.is_finite();
            if !finite || turn < 1e-6 || !perturbation.at_s.is_finite() {
                return refuse(
                    "perturbation",
                    format!("{perturbation:?}"),
                    "finite numbers and a rotation",
                );
            }
        }
        if !(self.limit_s > 0.0 && self.limit_s <= 86_400.0) {
            return refuse("limit_s", self.limit_s.to_string(), "more than 0, at most 86400");
        }
        Ok(())
    }
}

/// One answer of the planner graph.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Decided {
    /// Simulated seconds when the question was put.
    pub asked_s: f64,
    /// Simulated milliseconds until the answer, to the period of the physics.
    pub took_ms: f64,
    /// The states that held.
    pub holds: Vec<String>,
    /// The action to be done; `None` if the goal was met or nothing can be done.
    pub action: Option<String>,
    /// Whether the robot began to do it: not if something had changed meanwhile, or if there was no way.
    pub begun: bool,
}

/// Fingers and a part come together, or part.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Touched {
    /// Simulated seconds.
    pub t: f64,
    /// The part's place in the scene.
    pub part: usize,
    /// Whether they came together.
    pub contact: bool,
}

impl Touched {
    fn at(t: f64, touch: Touch) -> Self {
        match touch {
            Touch::Contact(part) => Self { t, part, contact: true },
            Touch::Release(part) => Self { t, part, contact: false },
        }
    }
}

/// How an episode ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Ended {
    /// The goal state held.
    GoalMet,
    /// The planner found no way.
    Stuck(Obstacle),
    /// No part could be taken and put as the action wants.
    NoWay {
        /// The action.
        action: String,
    },
    /// Something lies where the action would put a part.
    Occupied {
        /// The action.
        action: String,
    },
    /// Simulated time or skills were used up.
    GaveUp,
}

/// What happened in an episode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EpisodeReport {
    /// How it ended.
    pub ended: Ended,
    /// Whether the task's judge takes it to be solved.
    pub assembled: bool,
    /// Every decision.
    pub decisions: Vec<Decided>,
    /// Every skill.
    pub skills: Vec<SkillReport>,
    /// Every touch of the fingers.
    pub touches: Vec<Touched>,
    /// Parts that were in no state when last looked at, or are gone from the table.
    pub in_no_state: usize,
    /// Times that a part was found in no state that had not been so when looked at before.
    pub strays: usize,
    /// Whether what [`EpisodeSpec::perturbation`] says was done.
    pub perturbed: bool,
    /// Steps of the physics.
    pub steps: u64,
    /// Simulated seconds.
    pub simulated_s: f64,
}

impl EpisodeReport {
    /// Times a part left the hand on the way.
    pub fn drops(&self) -> usize {
        self.skills.iter().filter(|s| s.outcome == SkillOutcome::Dropped).count()
    }

    /// Times a part was in the hand.
    pub fn picks(&self) -> usize {
        self.skills.iter().filter(|s| s.picked).count()
    }

    /// What was decided and how the skill that came of it ended, in order.
    pub fn attempts(&self) -> impl Iterator<Item = (&str, SkillOutcome)> {
        let begun = self.decisions.iter().filter(|d| d.begun);
        let acted = begun.filter_map(|d| d.action.as_deref());
        acted.zip(self.skills.iter().map(|s| s.outcome))
    }

    /// Skills that did not put their part where they should: each is followed by a new decision.
    pub fn replans(&self) -> usize {
        self.skills.iter().filter(|s| s.outcome != SkillOutcome::Placed).count()
    }

    /// Whether the goal was taken to be met and is not.
    pub fn false_goal(&self) -> bool {
        self.ended == Ended::GoalMet && !self.assembled
    }
}

/// An episode that is over.
#[derive(Debug, Clone)]
pub struct Episode {
    /// What happened: the same for the same seed.
    pub report: EpisodeReport,
    /// The frames kept.
    pub frames: Vec<SceneFrame>,
    /// Time that the steps of the physics took on this machine.
    pub physics_wall: Duration,
}

/// Runs one episode towards `goal`; `seed` draws the scene and the drops.
///
/// # Errors
/// As [`EpisodeSpec::check`]; [`TaskError::Unknown`] for a goal that is no state; [`TaskError::Sim`] if the
/// graph does not fit the world.
pub fn episode(
    planner: &Arc<Planner>,
    grounding: Grounding,
    goal: &str,
    spec: &EpisodeSpec,
    seed: Seed,
) -> Result<Episode, TaskError> {
    episode_watched(planner, grounding, goal, spec, seed, &mut |_, _| {})
}

/// As [`episode`]; after every tick `watch` can look at the graph and the world.
///
/// # Errors
/// As [`episode`].
pub fn episode_watched(
    planner: &Arc<Planner>,
    grounding: Grounding,
    goal: &str,
    spec: &EpisodeSpec,
    seed: Seed,
    watch: &mut dyn FnMut(&SimView<'_>, &AssemblyWorld),
) -> Result<Episode, TaskError> {
    let world = AssemblyWorld::new(planner.clone(), grounding, goal, spec)?;
    let run = RunConfig::seeded(seed).in_world(world);
    let mut sim = Simulator::new(planner.graph().clone(), run)?;
    // The world gives up by itself; this is only to be sure.
    let limit = SimDuration::from_millis((spec.limit_s * 1e3) as u64 + 120_000);
    sim.run_until(limit, |view| {
        let Some(world) = AssemblyWorld::of(view.world()) else {
            return ControlFlow::Break(StopReason::Condition("another world"));
        };
        watch(&view, world);
        match world.ended() {
            Some(_) => ControlFlow::Break(StopReason::Condition("over")),
            None => ControlFlow::Continue(()),
        }
    })?;
    match AssemblyWorld::of(sim.world()) {
        Some(world) => Ok(world.report()),
        None => Err(TaskError::BadDomain { reason: "the world was exchanged".into() }),
    }
}

impl AssemblyWorld {
    /// What has happened so far.
    fn report(&self) -> Episode {
        let (scene, log) = (self.scene(), self.log());
        let report = EpisodeReport {
            ended: self.ended().cloned().unwrap_or(Ended::GaveUp),
            assembled: scene.is_some_and(|s| self.judge(s).solved),
            decisions: log.decisions.clone(),
            skills: log.skills.clone(),
            touches: log.touches.clone(),
            in_no_state: log.in_no_state,
            strays: log.strays,
            perturbed: self.perturbed(),
            steps: scene.map_or(0, |s| s.steps()),
            simulated_s: scene.map_or(0.0, |s| s.time_s()),
        };
        let physics_wall = scene.map_or(Duration::ZERO, |s| s.wall());
        Episode { report, frames: log.frames.clone(), physics_wall }
    }
}
