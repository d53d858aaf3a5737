//! The closed loop: look, ask the planner graph, do what it says, look again.
//!
//! The scene is the planner graph's world, so that planning and physics go on in the same simulated time:
//! while the graph thinks the parts lie and roll, and while the arm moves the graph idles. After every
//! skill, however it ended, everything is looked at and decided anew.
//!
//! The executor knows what was learned and, from the task, how to take hold of parts; of the task itself it knows
//! nothing. Which part goes where is a state's mean pose.

mod activity;
mod choose;
mod demonstrate;
mod recorder;
mod world;

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Duration;

use crate::sim::{RunConfig, Seed, SimDuration, Simulator, StopReason, Threads};
use crate::task::domain::{Grounding, StateId};
use crate::task::error::TaskError;
use crate::task::event::{Ended, EpisodeReport, Event, Ignore, Observer, SceneFrame};
use crate::task::planner::Planner;
pub use crate::task::tasks::Perturbation;
use crate::task::tasks::{self, Task};
pub use activity::{ActivityRecorder, ModuleSamples};
pub use demonstrate::{Demonstrated, demonstrate, demonstrate_observed};
pub use recorder::Recorder;
pub use world::EpisodeWorld;

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
    /// Who computes the planner graph's ticks. The episode is the same either way.
    pub threads: Threads,
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
            threads: Threads::Pool,
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
/// As [`EpisodeSpec::check`]; [`TaskError::Setting`] for a goal that is no state of the planner's domain;
/// [`TaskError::Sim`] if the graph does not fit the world.
pub fn episode(
    planner: &Arc<Planner>,
    grounding: Grounding,
    goal: StateId,
    spec: &EpisodeSpec,
    seed: Seed,
) -> Result<Episode, TaskError> {
    episode_observed(planner, grounding, goal, spec, seed, &mut Ignore)
}

/// [`episode`], telling `observer` of what happens.
///
/// Within one step of the physics, events come in the order in which they happened: a decision, a touch, a skill's end, a
/// frame, then the tick.
///
/// # Errors
/// As [`episode`].
pub fn episode_observed(
    planner: &Arc<Planner>,
    grounding: Grounding,
    goal: StateId,
    spec: &EpisodeSpec,
    seed: Seed,
    observer: &mut dyn Observer,
) -> Result<Episode, TaskError> {
    let world = EpisodeWorld::new(planner.clone(), grounding, goal, spec)?;
    let run = RunConfig::seeded(seed).in_world(world).with_threads(spec.threads);
    let mut sim = Simulator::new(planner.graph().clone(), run)?;
    observer.observe(&Event::EpisodeBegan { goal: &planner.domain()[goal].name });
    let mut teller = Teller::default();
    // The world gives up by itself; this is only to be sure.
    let limit = SimDuration::from_millis((spec.limit_s * 1e3) as u64 + 120_000);
    sim.run_until(limit, |view| {
        let Some(world) = EpisodeWorld::of(view.world()) else {
            return ControlFlow::Break(StopReason::Condition("another world"));
        };
        teller.tell(world, observer);
        observer.observe(&Event::Ticked { view: &view, doing: world.doing() });
        match world.ended() {
            Some(_) => ControlFlow::Break(StopReason::Condition("over")),
            None => ControlFlow::Continue(()),
        }
    })?;
    let Some(world) = EpisodeWorld::of(sim.world()) else {
        return Err(TaskError::BadDomain { reason: "the world was exchanged".into() });
    };
    let episode = world.report();
    observer.observe(&Event::EpisodeEnded(&episode.report));
    Ok(episode)
}

/// Turns what is new in a world's log into events.
#[derive(Default)]
struct Teller {
    steps: u64,
    decisions: usize,
    touches: usize,
    frames: usize,
    /// Whether the last decision's skill is still to be told of.
    acting: bool,
}

impl Teller {
    fn tell(&mut self, world: &EpisodeWorld, observer: &mut dyn Observer) {
        let Some(scene) = world.scene() else { return };
        if scene.steps() == self.steps {
            return;
        }
        self.steps = scene.steps();
        let (log, time_s) = (world.log(), scene.time_s());
        for decision in &log.decisions[self.decisions..] {
            observer.observe(&Event::Decided(decision));
            if decision.begun {
                self.acting = true;
                observer.observe(&Event::SkillBegan { time_s, decision: Some(decision) });
            }
        }
        self.decisions = log.decisions.len();
        for touch in &log.touches[self.touches..] {
            observer.observe(&Event::Touched(*touch));
        }
        self.touches = log.touches.len();
        if self.acting
            && let Some(decision) = log.decisions.last()
            && let Some(report) = &decision.skill
        {
            self.acting = false;
            observer.observe(&Event::SkillEnded { time_s, report, decision: Some(decision) });
        }
        for frame in &log.frames[self.frames..] {
            observer.observe(&Event::Framed(frame));
        }
        self.frames = log.frames.len();
        observer.observe(&Event::Stepped { time_s });
    }
}

impl EpisodeWorld {
    /// What has happened so far.
    fn report(&self) -> Episode {
        let (scene, log) = (self.scene(), self.log());
        let report = EpisodeReport {
            ended: self.ended().cloned().unwrap_or(Ended::GaveUp),
            solved: scene.is_some_and(|s| self.judge(s).solved),
            decisions: log.decisions.clone(),
            touches: log.touches.clone(),
            in_no_state: log.in_no_state,
            unexplained: log.unexplained,
            perturbed: self.perturbed(),
            steps: scene.map_or(0, |s| s.steps()),
            simulated_s: scene.map_or(0.0, |s| s.time_s()),
        };
        let physics_wall = scene.map_or(Duration::ZERO, |s| s.wall());
        Episode { report, frames: log.frames.clone(), physics_wall }
    }
}
