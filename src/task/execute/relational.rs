//! Episodes over relational domains: the mind for objects and references, and the loop that compiles the problem.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::{Duration, Instant};

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::guess::{UNSEEN_M, assumed, is_loose};
use super::mind::{Belief, Choice, Choices, Memory, Mind, Remembered, Seen};
use super::recorder::Recorder;
use super::recovery::attempts::{Attempts, What};
use super::world::EpisodeWorld;
use super::{Episode, EpisodeSpec, Teller, senses};
use crate::sim::{RunConfig, Seed, SimError, Simulator, StopReason, WorldError};
use crate::task::domain::{ActionId, ObjectPose, Pose, Snapshot, StateId};
use crate::task::error::TaskError;
use crate::task::event::{Chosen, Ended, Event, InNoState, Observer};
use crate::task::planner::{Decider, PlannerBuild};
use crate::task::relational::{
    Fact, GroundProblem, Grounder, LaidOut, Layout, Located, Move, Problem, RelationalDomain,
    Situation, TargetPose, Turn,
};
use crate::task::scene::Scene;
use crate::task::skill::{Facing, Target};

/// The result of an episode over a relational domain.
#[derive(Debug, Clone)]
pub struct RelationalEpisode {
    /// Report, frames and times. If the episode ended stuck, the obstacle's ids belong to the last of `grounds`.
    pub episode: Episode,
    /// The ground problems, in the order in which the planner graphs over them were used. There is more than one if
    /// undecided needs turned out to be impossible, or if objects appeared.
    pub grounds: Vec<Arc<GroundProblem>>,
    /// Number of moves that the reference planner still finds to the goal, if the graph was stuck; `None` if it finds no
    /// plan either, or if the graph was not stuck.
    pub reference_moves: Option<usize>,
    /// Wall time of compiling problems and building planner graphs.
    pub build_wall: Duration,
}

/// An episode over a relational domain that is ready to run: the scene is drawn, the problem is compiled, and the
/// planner graph is built.
pub struct PreparedEpisode<'d> {
    domain: &'d RelationalDomain,
    build: PlannerBuild,
    spec: EpisodeSpec,
    seed: Seed,
    scene: Scene,
    mind: Arc<Relational>,
    build_wall: Duration,
}

/// Height by which a target is raised each time that something was in the way there, in metres.
const RAISE_M: f64 = 2e-3;
/// Number of heights that are tried in turn.
const RAISES: usize = 4;
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
        spec.check()?;
        // The same scene as a simulator with this seed draws.
        let own = seed.derive("", "world");
        let scene = Scene::new(spec.task.scene(own)?)?;
        let seen = senses::look(&Recorder::default(), &scene, &spec.sensing, own);
        let began = Instant::now();
        let mind = Arc::new(Relational::new(domain, build, spec, &seen, None)?);
        let build_wall = began.elapsed();
        let (build, spec) = (build.clone(), spec.clone());
        Ok(Self { domain, build, spec, seed, scene, mind, build_wall })
    }

    /// Returns the planner graph over the first scene, for recording its activity.
    pub fn planner(&self) -> &Arc<dyn Decider> {
        &self.mind.planner
    }

    /// Returns the ground problem of the first scene.
    pub fn ground(&self) -> &Arc<GroundProblem> {
        &self.mind.ground
    }

    /// Runs the episode and sends its events to `observer`. If the problem is compiled anew, the new graph sends no
    /// [`Event::Ticked`].
    ///
    /// # Errors
    /// [`TaskError::Sim`] if the graph does not fit the world or the simulation fails; as [`PreparedEpisode::new`] if
    /// the problem is compiled anew.
    pub fn run(self, observer: &mut dyn Observer) -> Result<RelationalEpisode, TaskError> {
        let Self { domain, build, spec, seed, scene, mut mind, mut build_wall } = self;
        let mut grounds = vec![mind.ground.clone()];
        let goals: Vec<&str> =
            mind.ground.goals().iter().map(|g| &*mind.ground.domain()[*g].name).collect();
        observer.observe(&Event::EpisodeBegan { goal: &goals.join(" + ") });
        let mut teller = Teller::default();
        let mut start = EpisodeWorld::begun(mind.clone(), &spec, scene, seed)?;
        loop {
            let world = EpisodeWorld::continued(mind.clone(), &spec, start)?;
            let run = RunConfig::seeded(seed).in_world(world).with_threads(spec.threads);
            let mut sim = Simulator::new(mind.planner.graph().clone(), run)?;
            follow(&mut sim, &spec, grounds.len() == 1, &mut teller, observer)?;
            let tick = sim.tick();
            let lost = || {
                let source = WorldError::new("it is no longer the world of this episode");
                TaskError::from(SimError::World { tick, source })
            };
            let world = EpisodeWorld::of(sim.world()).ok_or_else(lost)?;
            if world.ended().is_none() && grounds.len() < MOST_COMPILED {
                let (seen, memory) = world.last_look().ok_or_else(lost)?;
                let began = Instant::now();
                mind =
                    Arc::new(Relational::new(domain, &build, &spec, &seen, Some((&mind, memory)))?);
                build_wall += began.elapsed();
                grounds.push(mind.ground.clone());
                start = world.handed_over().map_err(|source| SimError::World { tick, source })?;
                continue;
            }
            let episode = world.report();
            let stuck = matches!(episode.report.ended, Ended::Stuck(_));
            let memory = world.last_look().map(|(_, memory)| memory);
            let reference_moves =
                memory.filter(|_| stuck).and_then(|memory| mind.reference_moves(memory));
            observer.observe(&Event::EpisodeEnded(&episode.report));
            return Ok(RelationalEpisode { episode, grounds, reference_moves, build_wall });
        }
    }
}

/// Runs one episode over a relational domain. `seed` draws the scene, the drops and the errors of sensing.
///
/// The planner graph is built for the objects of the scene. If it is stuck because of undecided needs, or if an object
/// appears, the problem is compiled anew from the present situation.
///
/// # Errors
/// As [`PreparedEpisode::new`] and [`PreparedEpisode::run`].
pub fn relational_episode(
    domain: &RelationalDomain,
    build: &PlannerBuild,
    spec: &EpisodeSpec,
    seed: Seed,
    observer: &mut dyn Observer,
) -> Result<RelationalEpisode, TaskError> {
    PreparedEpisode::new(domain, build, spec, seed)?.run(observer)
}

/// Runs a simulator until its episode is over or its problem must be compiled anew.
fn follow(
    sim: &mut Simulator,
    spec: &EpisodeSpec,
    first: bool,
    teller: &mut Teller,
    observer: &mut dyn Observer,
) -> Result<(), TaskError> {
    let parts = spec.task.scene(Seed::new(0))?.parts.len();
    sim.run_until(spec.safeguard(parts), |view| {
        let Some(world) = EpisodeWorld::of(view.world()) else {
            return ControlFlow::Break(StopReason::Condition("another world"));
        };
        teller.tell(world, observer);
        if first {
            observer.observe(&Event::Ticked { view: &view, doing: world.doing() });
        }
        if world.ended().is_some() || world.relents() {
            return ControlFlow::Break(StopReason::Condition("over"));
        }
        ControlFlow::Continue(())
    })?;
    Ok(())
}

/// The mind for a relational domain over the objects of one scene.
pub(super) struct Relational {
    domain: RelationalDomain,
    grounder: Grounder,
    planner: Arc<dyn Decider>,
    pub ground: Arc<GroundProblem>,
    /// The objects, with their part in the scene; `None` for landmarks.
    objects: Vec<(LaidOut, Option<usize>)>,
    /// Whether objects in no state are taken to be in a state that some action leaves.
    assume: bool,
}

impl Relational {
    /// Compiles the problem of the objects in `seen`. `before` is the mind before, with its memory: its objects are
    /// kept.
    fn new(
        domain: &RelationalDomain,
        build: &PlannerBuild,
        spec: &EpisodeSpec,
        seen: &Seen,
        before: Option<(&Self, &Memory)>,
    ) -> Result<Self, TaskError> {
        let sensing = &spec.sensing;
        // The executor's look is the middle of several frames, but an error of the recording may remain.
        let grounder = Grounder::new(domain)
            .with_noise(sensing.pose_noise_m, sensing.pose_noise_deg.to_radians());
        let mut objects: Vec<(LaidOut, Option<usize>)> =
            before.map_or_else(Vec::new, |(mind, _)| mind.objects.clone());
        for (object, part) in seen.snapshot.objects.iter().zip(&seen.parts) {
            let same = |known: &(LaidOut, Option<usize>)| is_same(known, object, *part);
            if !objects.iter().any(same) {
                let pose = object.pose;
                // The ids of parts depend on what is seen; those of the ground problem must differ.
                let taken = objects.iter().any(|(o, _)| o.id == object.id);
                let id = match part {
                    Some(part) if taken => format!("{}_part_{part}", object.kind).into(),
                    _ => object.id.clone(),
                };
                objects.push((LaidOut { id, kind: object.kind.clone(), pose }, *part));
            }
        }
        let domain = domain.clone();
        let mut memory = before.map_or_else(Vec::new, |(_, memory)| memory.clone());
        let layout = laid_out(&grounder, &objects, seen, &mut memory);
        let problem = Problem::new(&domain, &layout)?;
        let mut assume = before.is_some_and(|(mind, _)| mind.assume);
        let mut ground = problem.ground(&assumed(&problem, &layout, assume))?;
        // If there is nothing left to drop, objects in no state are the only hope.
        let same = |mind: &Self| {
            mind.ground.dropped() == ground.dropped() && mind.objects.len() == objects.len()
        };
        if !assume && before.is_some_and(|(mind, _)| same(mind)) {
            assume = true;
            ground = problem.ground(&assumed(&problem, &layout, assume))?;
        }
        let ground = Arc::new(ground);
        let planner = build.over_ground(&ground)?;
        Ok(Self { grounder, planner, ground, objects, domain, assume })
    }

    /// Returns the layout that the memory holds.
    fn remembered(&self, memory: &Memory) -> Layout {
        layout_of(&self.objects, memory)
    }

    fn reference_moves(&self, memory: &Memory) -> Option<usize> {
        let layout = self.remembered(memory);
        let problem = Problem::new(&self.domain, &layout).ok()?;
        problem.plan(&layout.situation(), &[]).map(|plan| plan.len())
    }

    fn choice(&self, problem: &Problem<'_>, layout: &Layout, m: &Move) -> Option<Choice> {
        let part = self.objects[m.object].1?;
        let TargetPose { pose, turn } = problem.target(m, layout);
        let chosen = Chosen {
            operator: self.domain.operators[m.operator].name.clone(),
            object: layout.objects[m.object].id.to_string(),
            reference: m.reference.map(|r| layout.objects[r].id.to_string()),
            place: m.place,
            target: pose,
            turn: turn.name().into(),
            goal: self.goal_name(&layout.situation()),
        };
        let what = What {
            action: chosen.operator.clone(),
            part,
            reference: chosen.reference.clone(),
            place: m.place,
        };
        let reference = m.reference.and_then(|r| self.objects[r].1);
        let target = target_of(&pose, &turn);
        Some(Choice { part, target, what, reference, chosen: Some(chosen) })
    }

    fn goal_name(&self, situation: &Situation) -> String {
        let goal = self.ground.goal(situation);
        goal.map_or_else(String::new, |g| self.ground.domain()[g].name.clone())
    }
}

/// Returns the target of a skill for a pose of which `turn` says how much matters.
fn target_of(pose: &Pose, turn: &Turn) -> Target {
    let [x, y, z, w] = pose.orientation;
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
    let facing = match turn {
        Turn::Free => Facing::Any,
        // A skill turns parts about their z axis only; about another axis, the mean orientation is one of the allowed.
        Turn::Axis { axis, .. } if axis[2].abs() > 0.99 => {
            Facing::Axis((rotation * Vector3::z()).into())
        }
        Turn::Axis { .. } | Turn::Full { .. } => Facing::Full(pose.orientation),
    };
    Target { position: pose.position, facing }
}

/// Returns whether an object of a snapshot is a known object. Parts keep their index; landmarks keep their id.
fn is_same(known: &(LaidOut, Option<usize>), object: &ObjectPose, part: Option<usize>) -> bool {
    match (known.1, part) {
        (Some(own), Some(part)) => own == part,
        (None, None) => known.0.id == object.id,
        _ => false,
    }
}

fn layout_of(objects: &[(LaidOut, Option<usize>)], memory: &Memory) -> Layout {
    let located = memory.iter().map(|r| {
        let fact = r.fact.map(|(state, place, reference)| Fact { state, place, reference });
        Located { fact, distance: None, ambiguous: false, taken: r.taken, miss: None }
    });
    let located = located.collect();
    let laid =
        |((object, _), r): (&(LaidOut, _), &Remembered)| LaidOut { pose: r.pose, ..object.clone() };
    Layout { objects: objects.iter().zip(memory).map(laid).collect(), located }
}

/// Finds the states of all known objects, and remembers them. An object that neither moved nor lost its reference keeps
/// its state.
fn laid_out(
    grounder: &Grounder,
    objects: &[(LaidOut, Option<usize>)],
    seen: &Seen,
    memory: &mut Memory,
) -> Layout {
    let mut unseen = vec![false; objects.len()];
    let posed = objects.iter().enumerate().map(|(i, known)| {
        let mut found = seen.snapshot.objects.iter().zip(&seen.parts);
        let found = found.find(|(object, part)| is_same(known, object, **part));
        let pose = found.map(|(object, _)| object.pose);
        unseen[i] = pose.is_none();
        let pose = pose.unwrap_or(Pose::at([0.0, 0.0, UNSEEN_M * (1.0 + i as f64)]));
        ObjectPose { id: known.0.id.clone(), kind: known.0.kind.clone(), pose }
    });
    let snapshot = Snapshot { objects: posed.collect(), ..seen.snapshot.clone() };
    let mut layout = if memory.is_empty() {
        grounder.layout(&snapshot)
    } else {
        let known = memory.len().min(objects.len());
        grounder.layout_after(&layout_of(&objects[..known], memory), &snapshot)
    };
    for (located, unseen) in layout.located.iter_mut().zip(&unseen) {
        if *unseen {
            (located.fact, located.miss) = (None, None);
        }
    }
    *memory = layout
        .objects
        .iter()
        .zip(&layout.located)
        .map(|(object, located)| Remembered {
            pose: object.pose,
            fact: located.fact.map(|f| (f.state, f.place, f.reference)),
            taken: located.taken,
        })
        .collect();
    layout
}

impl Mind for Relational {
    fn planner(&self) -> &dyn Decider {
        &*self.planner
    }

    fn goals(&self) -> Vec<StateId> {
        self.ground.goals().to_vec()
    }

    fn look(&self, seen: &Seen, memory: &mut Memory) -> Belief {
        let layout = laid_out(&self.grounder, &self.objects, seen, memory);
        let situation = layout.situation();
        let guessed = match Problem::new(&self.domain, &layout) {
            Ok(problem) => assumed(&problem, &layout, self.assume),
            Err(_) => situation.clone(),
        };
        // The goal must hold in fact.
        let mut present = self.ground.present(&guessed);
        for goal in self.ground.goals() {
            if !self.ground.holds(*goal, &situation) {
                present.remove(*goal);
            }
        }
        let has_states = |kind: &str| self.domain.states.iter().any(|s| s.kind == kind);
        let explained = self.objects.iter().zip(&situation).filter_map(|((object, part), fact)| {
            let known = fact.is_some() || !has_states(&object.kind);
            part.filter(|_| known)
        });
        let known = |(object, part): (&ObjectPose, &Option<usize>)| {
            self.objects.iter().any(|known| is_same(known, object, *part))
        };
        let in_no_state = layout.objects.iter().zip(&layout.located).filter_map(|(object, l)| {
            let miss = l.miss?;
            let nearest = &self.domain.states[miss.nearest.state].name;
            Some(InNoState::new(&object.id, nearest, &miss.offset))
        });
        let all_met = self.ground.goals().last().copied().unwrap_or(StateId::new(0));
        Belief {
            present,
            goal: self.ground.goal(&situation).unwrap_or(all_met),
            explained: explained.collect(),
            in_no_state: in_no_state.collect(),
            outgrown: !seen.snapshot.objects.iter().zip(&seen.parts).all(known),
        }
    }

    fn choices(
        &self,
        action: ActionId,
        _scene: &Scene,
        _seen: &Seen,
        memory: &Memory,
        attempts: &Attempts,
    ) -> Choices {
        let layout = self.remembered(memory);
        let Ok(problem) = Problem::new(&self.domain, &layout) else { return Choices::default() };
        let situation = assumed(&problem, &layout, self.assume);
        let moves = self.ground.moves_for(&problem, action, &situation);
        let mut all: Vec<Choice> =
            moves.iter().filter_map(|m| self.choice(&problem, &layout, m)).collect();
        // After a failure, another object or another place may succeed.
        all.sort_by_key(|choice| attempts.weight(&choice.what));
        for choice in &mut all {
            // A target that is a little too low is occupied by what lies below it.
            choice.target.position[2] +=
                RAISE_M * (attempts.occupied(&choice.what) % RAISES) as f64;
        }
        Choices { all, blocked: Vec::new() }
    }

    fn took_effect(&self, what: &What, _seen: &Seen, memory: &Memory) -> bool {
        let Some(operator) = self.domain.operators.iter().find(|o| o.name == what.action) else {
            return true;
        };
        let own = self.objects.iter().position(|(_, part)| *part == Some(what.part));
        let fact = own.and_then(|own| memory.get(own)?.fact);
        fact.is_some_and(|(state, _, reference)| {
            let id = reference.map(|r| &*self.objects[r].0.id);
            state == operator.to && id == what.reference.as_deref()
        })
    }

    fn in_the_way(&self, fact: StateId, memory: &Memory) -> Vec<(usize, String)> {
        let situation = self.remembered(memory).situation();
        let name = &self.ground.domain()[fact].name;
        let mut objects = self.ground.in_the_way(fact, &situation);
        objects.extend(self.ground.misplaced(&situation));
        let part = |object: usize| Some((self.objects.get(object)?.1?, name.clone()));
        objects.into_iter().filter_map(part).collect()
    }

    fn can_relent(&self, memory: &Memory) -> bool {
        let layout = self.remembered(memory);
        let Ok(problem) = Problem::new(&self.domain, &layout) else { return false };
        let again = problem.ground(&assumed(&problem, &layout, self.assume));
        let loose = || {
            let all = layout.objects.iter().zip(&layout.located);
            all.into_iter().any(|(o, l)| l.fact.is_none() && is_loose(&self.domain, o))
        };
        again.is_ok_and(|again| again.dropped() != self.ground.dropped())
            || (!self.assume && loose())
    }
}
