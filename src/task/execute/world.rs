//! The scene as the planner graph's world: looks at the scene, asks the graph, and lets the robot carry out the
//! decision.

use std::any::Any;
use std::sync::Arc;

use rand::RngExt;
use serde::{Deserialize, Serialize};

use super::mind::{Memory, Mind, Propositional, Seen};
use super::{EpisodeSpec, senses};
use crate::sim::{Real, Seed, SimDuration, World, WorldError, WorldSave};
use crate::task::domain::{ActionId, Grounding, StateId, Verdict, WorldState};
use crate::task::error::TaskError;
use crate::task::event::{Decided, Doing, Ended, InNoState, SceneFrame, SkillReport, Touched};
use crate::task::execute::recorder::Recorder;
use crate::task::planner::Planner;
use crate::task::scene::{BodyId, Scene};
use crate::task::skill::Robot;
use crate::task::tasks::{Judgement, Perturbation};

/// The executor's phase.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
enum Phase {
    /// The graph forgets its last answer; then the executor looks.
    Rest { left: u32 },
    /// The graph is deciding.
    Ask { since_step: u64 },
    /// The robot is carrying out a skill.
    Act,
    /// The episode is over.
    Over(Ended),
    /// The problem must be compiled anew; another world takes over.
    Relent,
}

/// What has happened so far.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Log {
    #[serde(with = "as_text")]
    pub decisions: Vec<Decided>,
    pub in_no_state: usize,
    pub unexplained: usize,
    pub touches: Vec<Touched>,
    pub frames: Vec<SceneFrame>,
}

impl Log {
    /// Returns every finished skill, in order.
    fn skills(&self) -> impl Iterator<Item = &SkillReport> {
        self.decisions.iter().filter_map(|d| d.skill.as_ref())
    }

    /// Returns the number of finished skills.
    fn skill_count(&self) -> usize {
        self.skills().count()
    }
}

/// Saves decisions as JSON. Their optional fields are left out of the text, which a binary format cannot do.
mod as_text {
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serializer, ser};

    use crate::task::event::Decided;

    pub fn serialize<S: Serializer>(all: &[Decided], to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(&serde_json::to_string(all).map_err(ser::Error::custom)?)
    }

    pub fn deserialize<'d, D: Deserializer<'d>>(from: D) -> Result<Vec<Decided>, D::Error> {
        serde_json::from_str(&String::deserialize(from)?).map_err(D::Error::custom)
    }
}

/// The state that changes during an episode.
#[derive(Serialize, Deserialize)]
struct Live {
    scene: Scene,
    robot: Robot,
    phase: Phase,
    present: WorldState,
    /// The goal that the graph is asked for.
    goal: StateId,
    memory: Memory,
    /// For each part, whether it was in no state at the last look.
    in_no_state: Vec<bool>,
    /// The parts in no state at the last look, with the nearest states.
    lost: Vec<InNoState>,
    log: Log,
    seed: Seed,
    perturbed: bool,
}

/// A world in which an executor carries out the decisions of a planner graph.
pub struct EpisodeWorld {
    mind: Arc<dyn Mind>,
    recorder: Recorder,
    /// Pointers of the goals that the mind may ask for.
    goals: Vec<(StateId, Vec<Real>)>,
    spec: EpisodeSpec,
    step_ms: u64,
    /// The state at the start; `None` to draw a scene.
    start: Option<WorldSave>,
    live: Option<Live>,
}

/// Steps of rest between two requests to the graph.
const REST: u32 = 5;
/// Steps in which the graph recognises another goal.
const RECOGNISE: u32 = 10;

impl EpisodeWorld {
    /// Creates a world that asks for `goal`. It has no scene until it is reset.
    ///
    /// # Errors
    /// As [`EpisodeSpec::check`]; [`TaskError::Setting`] for a goal that is not a state of the planner's
    /// domain.
    pub fn new(
        planner: Arc<Planner>,
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
        let pointer = |goal: StateId| Ok((goal, mind.planner().goal_pointer(goal)?));
        let goals = mind.goals().into_iter().map(pointer).collect::<Result<Vec<_>, TaskError>>()?;
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
            live.phase = Phase::Rest { left: REST };
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

    fn fresh(&self, scene: Scene, seed: Seed) -> Live {
        let parts = scene.part_count();
        Live {
            scene,
            robot: Robot::default(),
            phase: Phase::Rest { left: REST },
            present: self.mind.planner().domain().empty_world(),
            goal: self.goals.first().map_or(StateId::new(0), |(goal, _)| *goal),
            memory: Memory::new(),
            in_no_state: vec![false; parts],
            lost: Vec::new(),
            log: Log::default(),
            seed,
            perturbed: false,
        }
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
            Phase::Rest { .. } | Phase::Relent => Doing::Looking,
            Phase::Ask { .. } => Doing::Deciding,
            Phase::Act => {
                let decided = live.log.decisions.last();
                decided.and_then(|d| d.action.as_deref()).map_or(Doing::Looking, Doing::Acting)
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

    pub(super) fn log(&self) -> &Log {
        static EMPTY: Log = Log {
            decisions: Vec::new(),
            in_no_state: 0,
            unexplained: 0,
            touches: Vec::new(),
            frames: Vec::new(),
        };
        self.live.as_ref().map_or(&EMPTY, |live| &live.log)
    }
}

/// The parts of the world that the executor only reads.
struct Tools<'w> {
    mind: &'w dyn Mind,
    recorder: &'w Recorder,
    spec: &'w EpisodeSpec,
}

impl Live {
    fn step(&mut self, tools: &Tools<'_>, command: &[Real]) {
        self.perturb(tools.spec);
        match self.phase.clone() {
            Phase::Rest { left: 0 } => self.look(tools),
            Phase::Rest { left } => self.phase = Phase::Rest { left: left - 1 },
            Phase::Ask { since_step } => self.listen(tools, command, since_step),
            Phase::Act | Phase::Over(_) | Phase::Relent => {}
        }
        let stepped = self.robot.step(&mut self.scene);
        if let Some(touch) = stepped.touch {
            self.log.touches.push(Touched::at(self.scene.time_s(), touch));
        }
        if let Some(report) = stepped.ended {
            // A skill always belongs to the last decision.
            if let Some(decided) = self.log.decisions.last_mut() {
                decided.skill = Some(report);
            }
            self.phase = Phase::Rest { left: REST };
        }
        if let Some(every) = tools.spec.frame_ms
            && (self.scene.steps() * self.scene.spec().step_ms).is_multiple_of(every.max(1))
        {
            self.log.frames.push(self.scene.frame());
        }
        let late = self.scene.time_s() > tools.spec.limit_s;
        if late && !matches!(self.phase, Phase::Over(_)) {
            self.phase = Phase::Over(Ended::GaveUp);
        }
    }

    fn perturb(&mut self, spec: &EpisodeSpec) {
        let Some(perturbation) = spec.perturbation.filter(|_| !self.perturbed) else { return };
        let Perturbation { at_s, body, pose } = perturbation;
        if self.scene.time_s() < at_s {
            return;
        }
        let handled = |part: usize| match body {
            BodyId::Part(own) => own == part,
            BodyId::Fixture(fixture) => self.scene.carried(fixture).contains(&part),
        };
        if !self.robot.part().is_some_and(handled) && self.scene.room_for(body, &pose) {
            self.scene.displace(body, &pose);
            self.perturbed = true;
        }
    }

    fn see(&self, tools: &Tools<'_>) -> Seen {
        senses::look(tools.recorder, &self.scene, &tools.spec.sensing, self.seed)
    }

    fn look(&mut self, tools: &Tools<'_>) {
        let seen = self.see(tools);
        let belief = tools.mind.look(&seen, &mut self.memory);
        // The graph needs time to recognise another goal before it is asked.
        let another = self.goal != belief.goal;
        (self.present, self.goal) = (belief.present, belief.goal);
        self.lost = belief.in_no_state;
        let mut in_no_state = vec![true; self.scene.part_count()];
        for part in belief.explained {
            in_no_state[part] = false;
        }
        let newly =
            in_no_state.iter().zip(&self.in_no_state).filter(|(now, before)| **now && !**before);
        self.log.unexplained += newly.count();
        self.log.in_no_state = in_no_state.iter().filter(|s| **s).count();
        self.in_no_state = in_no_state;
        self.phase = match (belief.outgrown, another) {
            (true, _) => Phase::Relent,
            (false, true) => Phase::Rest { left: RECOGNISE },
            (false, false) => Phase::Ask { since_step: self.scene.steps() },
        };
    }

    fn listen(&mut self, tools: &Tools<'_>, command: &[Real], since_step: u64) {
        let domain = tools.mind.planner().domain();
        let (actions, trace) = command.split_at(domain.operators().len());
        let action = actions.iter().position(|a| *a > 0.5).map(ActionId::new);
        let Some(verdict) = tools.mind.planner().read(trace, action) else { return };
        let step_ms = self.scene.spec().step_ms;
        let name = |action: ActionId| domain[action].name.clone();
        self.log.decisions.push(Decided {
            asked_s: (since_step * step_ms) as f64 / 1e3,
            took_ms: ((self.scene.steps() - since_step) * step_ms) as f64,
            holds: self.present.iter().map(|state| domain[state].name.clone()).collect(),
            action: if let Verdict::Act(action) = verdict { Some(name(action)) } else { None },
            begun: false,
            skill: None,
            chosen: None,
            in_no_state: self.lost.clone(),
        });
        self.phase = match verdict {
            Verdict::Met => Phase::Over(Ended::GoalMet),
            Verdict::Stuck(_) if tools.mind.can_relent(&self.memory) => Phase::Relent,
            Verdict::Stuck(obstacle) => Phase::Over(Ended::Stuck(obstacle)),
            Verdict::Act(_) if self.log.skill_count() >= tools.spec.most_skills => {
                Phase::Over(Ended::GaveUp)
            }
            Verdict::Act(action) => self.act(tools, action),
        };
        if let (Phase::Act, Some(decided)) = (&self.phase, self.log.decisions.last_mut()) {
            decided.begun = true;
        }
    }

    /// Begins to carry out an action with the first part that works.
    fn act(&mut self, tools: &Tools<'_>, action: ActionId) -> Phase {
        let seen = self.see(tools);
        if tools.mind.look(&seen, &mut self.memory).present != self.present {
            // The world state changed while the graph was deciding.
            return Phase::Rest { left: REST };
        }
        let past = &self.log.decisions;
        let choices = tools.mind.choices(action, &self.scene, &seen, &self.memory, past);
        for choice in choices.all {
            let drop_at = self.draw_drop(tools.spec.drop_rate);
            let grasps = tools.spec.task.grasps(&self.scene, choice.part);
            let begun = self.robot.begin(&self.scene, choice.part, choice.target, &grasps, drop_at);
            if begun.is_ok() {
                if let Some(decided) = self.log.decisions.last_mut() {
                    decided.chosen = choice.chosen;
                }
                return Phase::Act;
            }
        }
        let action = tools.mind.planner().domain()[action].name.clone();
        Phase::Over(match choices.blocked {
            true => Ended::Occupied { action },
            false => Ended::NoWay { action },
        })
    }

    /// Draws whether and when the next skill drops its part, from the seed and the number of skills so far.
    fn draw_drop(&self, rate: f64) -> Option<f64> {
        let mut rng = self.seed.derive_index("drop", self.log.skill_count() as u64).rng();
        let (chance, share): (f64, f64) = (rng.random(), rng.random());
        (chance < rate).then_some(share)
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
        1 + self.mind.planner().domain().states().len() + self.mind.planner().spec().dimensions
    }

    fn command_width(&self) -> usize {
        self.mind.planner().domain().operators().len() + crate::task::planner::TRACE
    }

    fn sense(&self, out: &mut [Real]) {
        let states = self.mind.planner().domain().states().len();
        out.fill(0.0);
        let goal = self.live.as_ref().map(|live| live.goal);
        let asked = self.goals.iter().find(|(own, _)| Some(*own) == goal).or(self.goals.first());
        if let Some((_, pointer)) = asked {
            out[1 + states..].copy_from_slice(pointer);
        }
        let Some(live) = &self.live else { return };
        out[0] = if matches!(live.phase, Phase::Ask { .. }) { 1.0 } else { 0.0 };
        for (value, holds) in out[1..=states].iter_mut().zip(live.present.flags()) {
            *value = if *holds { 1.0 } else { 0.0 };
        }
    }

    fn advance(&mut self, command: &[Real]) -> Result<(), WorldError> {
        let tools = Tools { mind: &*self.mind, recorder: &self.recorder, spec: &self.spec };
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
            let goal = self.goals.first().map_or(StateId::new(0), |(goal, _)| *goal);
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
