//! Episodes: the scene is drawn, the problem is compiled, and the planner graph controls the robot until the episode is over.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::EpisodeSpec;
use super::cell::Cell;
use super::model::{BuildDecider, TaskModel};
use super::reporter::LogReporter;
use super::world::EpisodeWorld;
use crate::robot::scene::Scene;
use crate::robot::scene::SceneFrame;
use crate::sim::{
    InterventionLog, Live, LiveError, LiveOptions, RunConfig, Seed, SimDuration, SimError, SimView,
    Simulator, Stop, StopReason, WorldError,
};
use crate::task::compile::GroundProblem;
use crate::task::domain::RelationalDomain;
use crate::task::error::TaskError;
use crate::task::event::{Ended, EpisodeReport, Event, Ignore, Observer};
use crate::task::planner::{Decider, PlannerBuild};

/// Moves the run of an episode on: a window, for example, in which a person stops it and goes back.
pub trait Driver {
    /// Returns how far the run can go back.
    fn options(&self) -> LiveOptions;

    /// Runs `live` until `stop`, which is to be called after every tick, returns a break. Returns whether the episode is to go on;
    /// otherwise it is given up. After a break because the problem is compiled anew ([`RECOMPILE`]) the run cannot go back any more.
    ///
    /// # Errors
    /// As [`Live::run_until`].
    fn drive(
        &mut self,
        live: &mut Live,
        stop: &mut dyn FnMut(SimView<'_>) -> Stop,
    ) -> Result<bool, LiveError>;
}

/// Why a run stops if the problem is compiled anew.
pub const RECOMPILE: StopReason = StopReason::Condition("the problem is compiled anew");

/// Runs an episode to its end.
struct Straight;

impl Driver for Straight {
    fn options(&self) -> LiveOptions {
        LiveOptions { memory_bytes: 0, ..LiveOptions::default() }
    }

    fn drive(
        &mut self,
        live: &mut Live,
        stop: &mut dyn FnMut(SimView<'_>) -> Stop,
    ) -> Result<bool, LiveError> {
        // `stop` ends every run long before.
        live.run_until(SimDuration::from_secs(31_536_000), stop)?;
        Ok(true)
    }
}

/// The result of an episode.
#[derive(Debug, Clone)]
pub struct Episode {
    /// Report of the episode. The same seed gives the same report. If the episode ended stuck, the obstacle's ids belong to
    /// the last of `grounds`.
    pub report: EpisodeReport,
    /// Frames kept for pictures.
    pub frames: Vec<SceneFrame>,
    /// Wall time of the physics steps.
    pub physics_wall: Duration,
    /// The ground problems, in the order in which the planner graphs over them were used. There is more than one if
    /// undecided needs turned out to be impossible, or if objects appeared.
    pub grounds: Vec<Arc<GroundProblem>>,
    /// Number of moves that the reference planner still finds to the goal, if the graph was stuck; `None` if it finds no
    /// plan either, or if the graph was not stuck.
    pub reference_moves: Option<usize>,
    /// Wall time of compiling problems and building planner graphs.
    pub build_wall: Duration,
    /// Number of interventions that were not made, because the episode ended or its problem was compiled anew before their
    /// ticks.
    pub not_made: usize,
}

impl Episode {
    /// Returns the result of an episode whose problem cannot be compiled from the first look: one that failed before the
    /// robot moved. Sends its beginning and end to `observer`.
    pub fn without_problem(why: &TaskError, observer: &mut dyn Observer) -> Self {
        let report = EpisodeReport::without_problem(why.to_string());
        observer.observe(&Event::EpisodeBegan { goal: "" });
        observer.observe(&Event::EpisodeEnded(&report));
        Self {
            report,
            frames: Vec::new(),
            physics_wall: Duration::ZERO,
            grounds: Vec::new(),
            reference_moves: None,
            build_wall: Duration::ZERO,
            not_made: 0,
        }
    }
}

/// An episode that is ready to run: the scene is drawn, the problem is compiled, and the
/// planner graph is built.
pub struct PreparedEpisode<'d> {
    domain: &'d RelationalDomain,
    build: Arc<BuildDecider<'d>>,
    spec: EpisodeSpec,
    seed: Seed,
    cell: Cell,
    model: Arc<TaskModel>,
    build_wall: Duration,
}

/// Number of times that one episode may compile its problem.
const MOST_COMPILED: usize = 20;

impl<'d> PreparedEpisode<'d> {
    /// Draws the scene from `seed`, compiles the problem of its first snapshot, and builds the planner graph.
    ///
    /// # Errors
    /// As [`EpisodeSpec::check`] and [`PlannerBuild::over_ground`]; [`TaskError::Problem`] if the goal cannot be asked for in
    /// the scene.
    pub fn new(
        domain: &'d RelationalDomain,
        build: &PlannerBuild,
        spec: &EpisodeSpec,
        seed: Seed,
    ) -> Result<Self, TaskError> {
        let build = build.clone();
        Self::with_decider(domain, move |ground| build.over_ground(ground), spec, seed)
    }

    /// Prepares an episode, as [`PreparedEpisode::new`] does, with a planner of your own.
    ///
    /// # Errors
    /// As [`EpisodeSpec::check`] and `build`; [`TaskError::Problem`] if the goal cannot be asked for in the scene.
    pub fn with_decider(
        domain: &'d RelationalDomain,
        build: impl Fn(&GroundProblem) -> Result<Arc<dyn Decider>, TaskError> + Send + Sync + 'd,
        spec: &EpisodeSpec,
        seed: Seed,
    ) -> Result<Self, TaskError> {
        spec.check()?;
        // The same scene as a simulator with this seed draws.
        let own = seed.derive("", "world");
        let scene = Scene::new(spec.task.scene(own)?)?;
        let mut cell = Cell::new(scene, spec.sensing, own);
        let seen = cell.look();
        let began = Instant::now();
        let build: Arc<BuildDecider<'d>> = Arc::new(build);
        let model = Arc::new(TaskModel::new(domain, &*build, spec, &seen, None)?);
        let build_wall = began.elapsed();
        let spec = spec.clone();
        Ok(Self { domain, build, spec, seed, cell, model, build_wall })
    }

    /// Returns the planner graph over the first scene, for recording its activity.
    pub fn planner(&self) -> &Arc<dyn Decider> {
        &self.model.planner
    }

    /// Returns the scene as the world of the planner's graph. A simulator with the seed of the episode begins in this scene; a
    /// later reset draws another one.
    ///
    /// # Errors
    /// As [`EpisodeSpec::check`].
    pub fn into_world(self) -> Result<EpisodeWorld, TaskError> {
        EpisodeWorld::begun(self.model, &self.spec, self.cell, self.seed)
    }

    /// Runs the episode and sends its events to `observer`. If the problem is compiled anew, the new graph sends no
    /// [`Event::Ticked`].
    ///
    /// # Errors
    /// [`TaskError::Sim`] if the graph does not fit the world or the simulation fails. If the problem cannot be compiled
    /// anew, the episode ends with [`Ended::NoProblem`].
    pub fn run(self, observer: &mut dyn Observer) -> Result<Episode, TaskError> {
        self.run_driven(observer, &mut Straight)
    }

    /// Runs the episode, as [`run`](Self::run) does, but as `driver` wants it. If it goes back, what it does again is sent to
    /// `observer` again.
    ///
    /// # Errors
    /// As [`run`](Self::run).
    pub fn run_driven(
        self,
        observer: &mut dyn Observer,
        driver: &mut dyn Driver,
    ) -> Result<Episode, TaskError> {
        let Self { domain, build, spec, seed, cell, mut model, mut build_wall } = self;
        let mut grounds = vec![model.ground.clone()];
        let goals: Vec<&str> =
            model.ground.goals().iter().map(|g| &*model.ground.domain()[*g].name).collect();
        observer.observe(&Event::EpisodeBegan { goal: &goals.join(" + ") });
        let mut reporter = LogReporter::default();
        let parts = cell.sensed().part_count();
        let mut not_made = 0;
        let mut world = EpisodeWorld::begun(model.clone(), &spec, cell, seed)?;
        loop {
            let run = RunConfig::seeded(seed).in_world(world).with_threads(spec.threads);
            let sim = Simulator::new(model.planner.graph().clone(), run)?;
            let first = grounds.len() == 1;
            let interventions = first.then_some(&spec.interventions);
            let limit = spec.safeguard(parts);
            let (live, goes_on) =
                follow(sim, limit, interventions, &mut reporter, observer, driver)?;
            if first {
                not_made = live.ahead().len();
            }
            let sim = live.into_simulator();
            let tick = sim.tick();
            world = *EpisodeWorld::of_run(sim).ok_or_else(|| {
                let source = WorldError::new("it is no longer the world of this episode");
                SimError::World { tick, source }
            })?;
            if !goes_on && world.ended().is_none() {
                world.end(Ended::GaveUp);
            }
            if world.ended().is_none()
                && grounds.len() < MOST_COMPILED
                && let Some(seen) = world.look()
            {
                let began = Instant::now();
                let before = world.memory().map(|layout| (&*model, layout));
                let anew = TaskModel::new(domain, &*build, &spec, &seen, before);
                build_wall += began.elapsed();
                match anew {
                    Ok(anew) => {
                        model = Arc::new(anew);
                        grounds.push(model.ground.clone());
                        world.hand_over(model.clone());
                        continue;
                    }
                    Err(error) => world.end(Ended::NoProblem { why: error.to_string() }),
                }
            }
            let stuck = matches!(world.ended(), Some(Ended::Stuck(_)));
            let reference_moves =
                world.memory().filter(|_| stuck).and_then(|layout| model.reference_moves(layout));
            let (mut report, frames, physics_wall) = world.report();
            report.ended_words = ended_in_words(&report.ended, &model.ground);
            observer.observe(&Event::EpisodeEnded(&report));
            return Ok(Episode {
                report,
                frames,
                physics_wall,
                grounds,
                reference_moves,
                build_wall,
                not_made,
            });
        }
    }
}

/// Runs one episode. `seed` draws the scene, the drops and the errors of sensing.
///
/// The planner graph is built for the objects of the scene. If it is stuck because of undecided needs, or if an object
/// appears, the problem is compiled anew from the present situation.
///
/// # Errors
/// As [`PreparedEpisode::new`] and [`PreparedEpisode::run`].
pub fn episode(
    domain: &RelationalDomain,
    build: &PlannerBuild,
    spec: &EpisodeSpec,
    seed: Seed,
) -> Result<Episode, TaskError> {
    episode_observed(domain, build, spec, seed, &mut Ignore)
}

/// Runs one episode, as [`episode`] does, and sends its events to `observer`.
///
/// Within one physics step, events come in the order in which they happened: decision, touch, end of a skill,
/// frame, tick.
///
/// # Errors
/// As [`episode`].
pub fn episode_observed(
    domain: &RelationalDomain,
    build: &PlannerBuild,
    spec: &EpisodeSpec,
    seed: Seed,
    observer: &mut dyn Observer,
) -> Result<Episode, TaskError> {
    PreparedEpisode::new(domain, build, spec, seed)?.run(observer)
}

/// Returns how an episode ended, as a part of a sentence. `ground` is the problem that the planner had last.
pub(super) fn ended_in_words(ended: &Ended, ground: &GroundProblem) -> String {
    let action = |symbol: &str| ground.in_words(symbol).unwrap_or(symbol).to_owned();
    let named = |id: &String| {
        let mut names = ground.object_names();
        names.find(|(own, _)| own == id).map_or_else(|| id.clone(), |(_, name)| name.to_owned())
    };
    match ended {
        Ended::GoalMet => "the goal is met".into(),
        Ended::Stuck(obstacle) => ground.obstacle_in_words(*obstacle),
        Ended::NoWay { action: a } => {
            format!("no part could be grasped and placed to {}", action(a))
        }
        Ended::Occupied { action: a } => {
            format!("another part lies where one is to be put to {}", action(a))
        }
        Ended::Lost { objects } => {
            let objects: Vec<String> = objects.iter().map(named).collect();
            format!("{} fell off the table, and the goal needs more parts", objects.join(", "))
        }
        Ended::GaveUp => "the limit on time or skills was reached".into(),
        Ended::NoProblem { why } => why.clone(),
    }
}

/// Runs a simulator until its episode is over or its problem must be compiled anew. The first graph of an episode has interventions.
/// Returns whether the episode goes on, if it is not over.
fn follow(
    sim: Simulator,
    limit: SimDuration,
    interventions: Option<&InterventionLog>,
    reporter: &mut LogReporter,
    observer: &mut dyn Observer,
    driver: &mut dyn Driver,
) -> Result<(Live, bool), TaskError> {
    let mut live = Live::new(sim, driver.options())?;
    // A safeguard: the world itself ends the episode before this limit.
    let end = live.sim().graph().timebase().ticks(limit).map_err(SimError::from)?;
    if let Some(log) = interventions.filter(|log| !log.entries().is_empty()) {
        log.check(live.sim().graph(), end).map_err(LiveError::from)?;
        live.follow(log)?;
    }
    let mut stop = |view: SimView<'_>| {
        let Some(world) = EpisodeWorld::of(view.world()) else {
            return ControlFlow::Break(StopReason::Condition("another world"));
        };
        reporter.report(world, observer);
        if interventions.is_some() {
            observer.observe(&Event::Ticked { view: &view, doing: world.doing() });
        }
        if world.ended().is_some() {
            return ControlFlow::Break(StopReason::Condition("over"));
        }
        if world.must_recompile() {
            return ControlFlow::Break(RECOMPILE);
        }
        match view.tick() >= end {
            true => ControlFlow::Break(StopReason::TimeUp),
            false => ControlFlow::Continue(()),
        }
    };
    let goes_on = driver.drive(&mut live, &mut stop)?;
    Ok((live, goes_on))
}
