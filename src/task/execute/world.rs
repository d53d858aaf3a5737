//! The scene as the planner graph's world: looks at the scene, asks the graph, and lets the robot carry out the
//! decision.

use std::any::Any;
use std::sync::Arc;

use super::EpisodeSpec;
use super::live::{Live, Phase, Tools};
use super::log::Log;
use super::mind::{Memory, Mind, Propositional, Seen};
use super::senses;
use crate::sim::{Real, Seed, SimDuration, World, WorldError, WorldSave};
use crate::task::domain::{Grounding, StateId};
use crate::task::error::TaskError;
use crate::task::event::{Doing, Ended};
use crate::task::execute::recorder::Recorder;
use crate::task::planner::{Decider, Told};
use crate::task::scene::Scene;
use crate::task::tasks::Judgement;

/// A world in which an executor carries out the decisions of a planner graph.
pub struct EpisodeWorld {
    mind: Arc<dyn Mind>,
    recorder: Recorder,
    /// The goals that the mind may ask for.
    goals: Vec<StateId>,
    spec: EpisodeSpec,
    step_ms: u64,
    /// The state at the start; `None` to draw a scene.
    start: Option<WorldSave>,
    live: Option<Live>,
}

impl EpisodeWorld {
    /// Creates a world that asks for `goal`. It has no scene until it is reset.
    ///
    /// # Errors
    /// As [`EpisodeSpec::check`]; [`TaskError::Setting`] for a goal that is not a state of the planner's
    /// domain.
    pub fn new(
        planner: Arc<dyn Decider>,
        grounding: Grounding,
        goal: StateId,
        spec: &EpisodeSpec,
    ) -> Result<Self, TaskError> {
        let sensing = &spec.sensing;
        let grounding =
            grounding.with_noise(sensing.pose_noise_m, sensing.pose_noise_deg.to_radians());
        let mind = Arc::new(Propositional::new(planner, grounding, goal)?);
        Self::with_mind(mind, spec, None)
    }

    /// Creates a world that continues from a saved state.
    pub(super) fn continued(
        mind: Arc<dyn Mind>,
        spec: &EpisodeSpec,
        start: WorldSave,
    ) -> Result<Self, TaskError> {
        Self::with_mind(mind, spec, Some(start))
    }

    fn with_mind(
        mind: Arc<dyn Mind>,
        spec: &EpisodeSpec,
        start: Option<WorldSave>,
    ) -> Result<Self, TaskError> {
        spec.check()?;
        let goals = mind.goals();
        goals.iter().try_for_each(|goal| mind.planner().check_goal(*goal))?;
        // The step is the same for every seed.
        let step_ms = spec.task.scene(Seed::new(0))?.step_ms;
        let recorder = Recorder::default();
        Ok(Self { mind, recorder, goals, spec: spec.clone(), step_ms, start, live: None })
    }

    /// Returns the saved state of an episode that begins in `scene`, for a simulator with this seed.
    pub(super) fn begun(
        mind: Arc<dyn Mind>,
        spec: &EpisodeSpec,
        scene: Scene,
        seed: Seed,
    ) -> Result<WorldSave, TaskError> {
        let mut world = Self::with_mind(mind, spec, None)?;
        world.live = Some(world.fresh(scene, seed.derive("", "world")));
        let wrong = |source| crate::sim::SimError::World { tick: 0, source };
        Ok(world.save().map_err(wrong)?)
    }

    /// Returns the saved state for another world with another mind: it looks at the scene first.
    pub(super) fn handed_over(&self) -> Result<WorldSave, WorldError> {
        let saved = self.save()?;
        let mut live: Option<Live> = postcard::from_bytes(&saved.0).map_err(fault)?;
        if let Some(live) = &mut live {
            live.hand_over();
        }
        postcard::to_stdvec(&live).map(WorldSave).map_err(fault)
    }

    /// Returns what the executor sees now, and what it remembers; `None` before the first reset.
    pub(super) fn last_look(&self) -> Option<(Seen, &Memory)> {
        let live = self.live.as_ref()?;
        let seen = senses::look(&self.recorder, &live.scene, &self.spec.sensing, live.seed);
        Some((seen, &live.memory))
    }

    /// Returns whether the problem must be compiled anew.
    pub(super) fn relents(&self) -> bool {
        self.live.as_ref().is_some_and(|live| live.phase == Phase::Relent)
    }

    fn first_goal(&self) -> StateId {
        self.goals.first().copied().unwrap_or(StateId::new(0))
    }

    fn fresh(&self, scene: Scene, seed: Seed) -> Live {
        let goal = self.first_goal();
        Live::new(scene, seed, self.mind.planner().domain().empty_world(), goal)
    }

    /// Returns a simulator's world as an `EpisodeWorld`; `None` if it is another kind of world.
    pub fn of(world: Option<&dyn World>) -> Option<&Self> {
        let world: &dyn Any = world?;
        world.downcast_ref()
    }

    /// Returns how the episode ended; `None` while it runs.
    pub fn ended(&self) -> Option<&Ended> {
        match &self.live.as_ref()?.phase {
            Phase::Over(ended) => Some(ended),
            _ => None,
        }
    }

    /// Returns the scene; `None` before the first reset.
    pub fn scene(&self) -> Option<&Scene> {
        self.live.as_ref().map(|live| &live.scene)
    }

    /// Returns what the executor is doing.
    pub fn doing(&self) -> Doing<'_> {
        let Some(live) = &self.live else { return Doing::Looking };
        match live.phase {
            Phase::Rest { .. } | Phase::Recognise { .. } | Phase::Relent => Doing::Looking,
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
        let saved = live.scene.spec();
        for (what, saved, own) in [
            ("parts", live.scene.part_count(), own.parts.len()),
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

    /// Asks the task's judge about the scene.
    pub(super) fn judge(&self, scene: &Scene) -> Judgement {
        self.spec.task.judge(scene)
    }

    pub(super) fn perturbed(&self) -> bool {
        self.live.as_ref().is_some_and(|live| live.perturbed)
    }

    /// Returns the ids of the parts that fell off the table.
    pub(super) fn lost(&self) -> Vec<String> {
        self.live.as_ref().map_or_else(Vec::new, Live::lost)
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
        self.mind.planner().sense_width()
    }

    fn command_width(&self) -> usize {
        self.mind.planner().command_width()
    }

    fn sense(&self, out: &mut [Real]) {
        match &self.live {
            Some(live) => {
                let asked = self.goals.contains(&live.goal);
                let goal = if asked { live.goal } else { self.first_goal() };
                self.mind.planner().sense(&Told { goal, ..live.told(&self.goals) }, out);
            }
            None => out.fill(0.0),
        }
    }

    fn advance(&mut self, command: &[Real]) -> Result<(), WorldError> {
        let tools = Tools {
            mind: &*self.mind,
            goals: &self.goals,
            recorder: &self.recorder,
            spec: &self.spec,
        };
        if let Some(live) = &mut self.live {
            live.step(&tools, command);
        }
        Ok(())
    }

    fn reset(&mut self, seed: Seed) -> Result<(), WorldError> {
        if let Some(start) = self.start.clone() {
            self.restore(&start)?;
            // The states of another mind have other numbers.
            let empty = self.mind.planner().domain().empty_world();
            let goal = self.first_goal();
            if let Some(live) = &mut self.live {
                (live.present, live.goal) = (empty, goal);
            }
            return Ok(());
        }
        let scene = Scene::new(self.spec.task.scene(seed).map_err(fault)?).map_err(fault)?;
        self.live = Some(self.fresh(scene, seed));
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
