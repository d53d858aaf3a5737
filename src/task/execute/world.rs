//! The scene as the planner graph's world: looks at the scene, asks the graph, and lets the robot carry out the
//! decision.

use std::any::Any;
use std::sync::Arc;
use std::time::Duration;

use serde_json::Value;

use super::EpisodeSpec;
use super::cell::Cell;
use super::episode::ended_in_words;
use super::live::{Live, Phase, Tools};
use super::log::Log;
use super::model::{Seen, TaskModel};
use crate::robot::scene::Scene;
use crate::robot::scene::SceneFrame;
use crate::sim::{Real, Seed, SimDuration, Simulator, World, WorldError, WorldSave};
use crate::task::classify::Layout;
use crate::task::error::TaskError;
use crate::task::event::{Decided, Doing, Ended, EpisodeReport};
use crate::task::planner::PlannerInput;
use crate::task::propositional::StateId;

/// A world in which an executor carries out the decisions of a planner graph. [`PreparedEpisode::into_world`] makes one.
///
/// [`PreparedEpisode::into_world`]: super::PreparedEpisode::into_world
pub struct EpisodeWorld {
    model: Arc<TaskModel>,
    spec: EpisodeSpec,
    step_ms: u64,
    /// Whether the next reset keeps the scene: it was drawn already, or belongs to an episode that goes on.
    kept: bool,
    live: Option<Live>,
}

impl EpisodeWorld {
    /// Returns the world of an episode that begins in `scene`, for a simulator with this seed.
    pub(super) fn begun(
        model: Arc<TaskModel>,
        spec: &EpisodeSpec,
        cell: Cell,
        seed: Seed,
    ) -> Result<Self, TaskError> {
        spec.check()?;
        let step_ms = cell.truth().spec().step_ms;
        let mut world = Self { model, spec: spec.clone(), step_ms, kept: true, live: None };
        world.live = Some(world.fresh(cell, seed.derive("", "world")));
        Ok(world)
    }

    /// Goes on with another model, which looks at the scene first.
    pub(super) fn hand_over(&mut self, model: Arc<TaskModel>) {
        self.model = model;
        // The states of another model have other numbers.
        let (empty, goal) = (self.model.planner.domain().empty_world(), self.first_goal());
        if let Some(live) = &mut self.live {
            live.hand_over();
            (live.present, live.goal) = (empty, goal);
        }
        self.kept = true;
    }

    /// Returns what the executor sees now; `None` before the first reset.
    pub(super) fn look(&mut self) -> Option<Seen> {
        self.live.as_mut().map(|live| live.cell.look())
    }

    /// Returns the layout of the last look; `None` before the first.
    pub(super) fn memory(&self) -> Option<&Layout> {
        self.live.as_ref()?.memory.as_ref()
    }

    /// Ends the episode.
    pub(super) fn end(&mut self, ended: Ended) {
        if let Some(live) = &mut self.live {
            live.phase = Phase::Over(ended);
        }
    }

    /// Returns whether the problem must be compiled anew.
    pub(super) fn must_recompile(&self) -> bool {
        self.live.as_ref().is_some_and(|live| live.phase == Phase::Recompile)
    }

    fn goals(&self) -> &[StateId] {
        self.model.ground.goals()
    }

    fn first_goal(&self) -> StateId {
        self.goals().first().copied().unwrap_or(StateId::new(0))
    }

    fn fresh(&self, cell: Cell, seed: Seed) -> Live {
        let goal = self.first_goal();
        Live::new(cell, seed, self.model.planner.domain().empty_world(), goal)
    }

    /// Returns a simulator's world as an `EpisodeWorld`; `None` if it is another kind of world.
    pub fn of(world: Option<&dyn World>) -> Option<&Self> {
        let world: &dyn Any = world?;
        world.downcast_ref()
    }

    /// Returns the world of a run that is over; `None` if it has another kind of world.
    pub(super) fn of_run(sim: Simulator) -> Option<Box<Self>> {
        let world: Box<dyn Any> = sim.into_world()?;
        world.downcast().ok()
    }

    /// Returns the report, the frames and the wall time of the physics so far.
    pub(super) fn report(&self) -> (EpisodeReport, Vec<SceneFrame>, Duration) {
        let (scene, log) = (self.scene(), self.log());
        let report = EpisodeReport {
            ended: self.ended().cloned().unwrap_or(Ended::GaveUp),
            ended_words: String::new(),
            solved: scene.is_some_and(|s| self.spec.task.judge(s).solved),
            decisions: log.decisions.clone(),
            touches: log.touches.clone(),
            in_no_state: log.in_no_state,
            unexplained: log.unexplained,
            lost: self.live.as_ref().map_or_else(Vec::new, Live::lost),
            displaced: log.displaced.clone(),
            steps: scene.map_or(0, |s| s.steps()),
            simulated_s: scene.map_or(0.0, |s| s.time_s()),
        };
        (report, log.frames.clone(), scene.map_or(Duration::ZERO, |s| s.wall()))
    }

    /// Returns how the episode ended; `None` while it runs.
    pub fn ended(&self) -> Option<&Ended> {
        match &self.live.as_ref()?.phase {
            Phase::Over(ended) => Some(ended),
            _ => None,
        }
    }

    /// Returns how the episode ended, as a part of a sentence; `None` while it runs.
    pub fn ended_in_words(&self) -> Option<String> {
        self.ended().map(|ended| ended_in_words(ended, &self.model.ground))
    }

    /// Returns the scene; `None` before the first reset.
    pub fn scene(&self) -> Option<&Scene> {
        self.live.as_ref().map(|live| live.cell.truth())
    }

    /// Returns the decisions so far.
    pub fn decisions(&self) -> &[Decided] {
        &self.log().decisions
    }

    /// Returns what the executor is doing.
    pub fn doing(&self) -> Doing<'_> {
        let Some(live) = &self.live else { return Doing::Looking };
        match live.phase {
            Phase::Rest { .. } | Phase::Recognise { .. } | Phase::Recompile => Doing::Looking,
            Phase::Ask { .. } => Doing::Deciding,
            Phase::Act => {
                let decided = live.log.decisions.last();
                let detour = decided.filter(|d| d.is_detour()).and_then(|d| d.recovery.as_ref());
                let action = detour.map(|r| r.kind.name());
                let action = action.or_else(|| decided.and_then(|d| d.action.as_deref()));
                action.map_or(Doing::Looking, Doing::Acting)
            }
            Phase::Over(_) => Doing::Over,
        }
    }

    /// Refuses a saved state whose scene does not match this world's task.
    fn check_own(&self, live: &Live) -> Result<(), WorldError> {
        let own = self.spec.task.scene(live.seed).map_err(fault)?;
        let scene = live.cell.truth();
        let saved = scene.spec();
        for (what, saved, own) in [
            ("parts", scene.part_count(), own.parts.len()),
            ("kinds of parts", saved.kinds.len(), own.kinds.len()),
        ] {
            if saved != own {
                return Err(fault(format_args!(
                    "the checkpoint's scene has {saved} {what}; expected {own}, as in this world's task"
                )));
            }
        }
        Ok(())
    }

    pub(super) fn log(&self) -> &Log {
        static EMPTY: Log = Log::EMPTY;
        self.live.as_ref().map_or(&EMPTY, |live| &live.log)
    }
}

fn fault(error: impl std::fmt::Display) -> WorldError {
    WorldError::new(error.to_string())
}

impl World for EpisodeWorld {
    fn period(&self) -> SimDuration {
        SimDuration::from_millis(self.step_ms)
    }

    fn sense_width(&self) -> usize {
        self.model.planner.sense_width()
    }

    fn command_width(&self) -> usize {
        self.model.planner.command_width()
    }

    fn sense(&self, out: &mut [Real]) {
        match &self.live {
            Some(live) => {
                let asked = self.goals().contains(&live.goal);
                let goal = if asked { live.goal } else { self.first_goal() };
                self.model
                    .planner
                    .sense(&PlannerInput { goal, ..live.planner_input(self.goals()) }, out);
            }
            None => out.fill(0.0),
        }
    }

    fn advance(&mut self, command: &[Real]) -> Result<(), WorldError> {
        let tools = Tools { model: &self.model, spec: &self.spec };
        if let Some(live) = &mut self.live {
            live.step(&tools, command);
        }
        Ok(())
    }

    fn reset(&mut self, seed: Seed) -> Result<(), WorldError> {
        if std::mem::take(&mut self.kept) {
            return Ok(());
        }
        let scene = Scene::new(self.spec.task.scene(seed).map_err(fault)?).map_err(fault)?;
        self.live = Some(self.fresh(Cell::new(scene, self.spec.sensing, seed), seed));
        Ok(())
    }

    /// Another hand moves a body or takes a part away: `{"move":{"object":"part_0","position":[0.4,0.1,0.02]}}`, with an
    /// `orientation` if it is to be another, or `{"remove":{"object":"part_0"}}`. Refused where there is no room, and while the
    /// robot handles the body.
    fn intervene(&mut self, wish: &Value) -> Result<(), WorldError> {
        let Some(live) = self.live.as_mut().filter(|live| !matches!(live.phase, Phase::Over(_)))
        else {
            return Err(WorldError::new("the episode is not running"));
        };
        let displaced = live.cell.grant(wish).map_err(WorldError::new)?;
        live.log.displaced.push(displaced);
        Ok(())
    }

    fn save(&self) -> Result<WorldSave, WorldError> {
        postcard::to_stdvec(&self.live).map(WorldSave).map_err(fault)
    }

    fn restore(&mut self, saved: &WorldSave) -> Result<(), WorldError> {
        let live: Option<Live> = postcard::from_bytes(&saved.0).map_err(fault)?;
        if let Some(live) = &live {
            self.check_own(live)?;
        }
        self.live = live;
        Ok(())
    }
}
