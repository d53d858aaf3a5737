//! The executor's model of its task: what holds in a snapshot, which goal to ask for, and which parts an action can move
//! where.

use std::sync::Arc;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::EpisodeSpec;
use super::recovery::attempts::{Attempts, Intent, Meddled};
use crate::robot::Pose;
use crate::robot::skill::{Facing, Target};
use crate::task::classify::{Classifier, Layout};
use crate::task::compile::{GroundProblem, Move, Problem, TargetPose, UNSEEN_M, assumed, is_loose};
use crate::task::domain::{Fact, Origin, RelationalDomain, Situation, Turn, relative};
use crate::task::error::TaskError;
use crate::task::event::{Chosen, InNoState, Landed, Undecided};
use crate::task::planner::Decider;
use crate::task::propositional::{ActionId, StateId, WorldState};
use crate::task::recording::{ObjectPose, Snapshot};

/// Builds the planner over a ground problem.
pub(super) type BuildDecider<'d> =
    dyn Fn(&GroundProblem) -> Result<Arc<dyn Decider>, TaskError> + Send + Sync + 'd;

/// A snapshot of the scene, as sensed.
pub(super) struct Seen {
    pub snapshot: Snapshot,
    /// For each object of the snapshot, the index of its part; `None` for a landmark.
    pub parts: Vec<Option<usize>>,
}

/// What the executor takes to be true after a look.
pub(super) struct Belief {
    /// The states that hold.
    pub present: WorldState,
    /// The goal to ask for. If it holds, the episode's goal is met.
    pub goal: StateId,
    /// The parts that are in a state, or of a kind without states.
    pub explained: Vec<usize>,
    /// The parts in states in which parts were found.
    pub as_found: Vec<usize>,
    /// The parts in no state of kinds with states.
    pub in_no_state: Vec<InNoState>,
    /// Whether the scene has objects that the planner graph does not know.
    pub outgrown: bool,
}

/// A part that an action can move, and its target.
pub(super) struct Choice {
    pub part: usize,
    pub target: Target,
    /// What is tried, for the failure memory.
    pub what: Intent,
    /// Part that the part is put onto, into or beside.
    pub reference: Option<usize>,
    /// The choice by its symbols, and as a sentence.
    pub chosen: Chosen,
    pub words: String,
}

/// Height by which a target is raised each time that something was in the way there, in metres.
const RAISE_M: f64 = 2e-3;
/// Number of heights that are tried in turn.
const RAISES: usize = 4;

/// A learned domain over the objects of one scene, with the planner that was built for them.
pub(super) struct TaskModel {
    domain: RelationalDomain,
    classifier: Classifier,
    pub planner: Arc<dyn Decider>,
    pub ground: Arc<GroundProblem>,
    /// The objects, with their part in the scene; `None` for landmarks. The poses are those of the first look.
    objects: Vec<(ObjectPose, Option<usize>)>,
    /// Whether objects in no state are taken to be in a state that some action leaves.
    assume: bool,
}

impl TaskModel {
    /// Compiles the problem of the objects in `seen`. `before` is the model before, with what it remembers: its
    /// objects are kept.
    pub fn new(
        domain: &RelationalDomain,
        build: &BuildDecider<'_>,
        spec: &EpisodeSpec,
        seen: &Seen,
        before: Option<(&Self, &Layout)>,
    ) -> Result<Self, TaskError> {
        let sensing = &spec.sensing;
        // The executor's look is the middle of several frames, but an error of the recording may remain.
        let classifier = Classifier::new(domain)
            .with_noise(sensing.pose_noise_m, sensing.pose_noise_deg.to_radians())
            .with_vertical(2);
        let mut objects: Vec<(ObjectPose, Option<usize>)> =
            before.map_or_else(Vec::new, |(model, _)| model.objects.clone());
        for (object, part) in seen.snapshot.objects.iter().zip(&seen.parts) {
            let same = |known: &(ObjectPose, Option<usize>)| is_same(known, object, *part);
            if !objects.iter().any(same) {
                // The ids of parts depend on what is seen; those of the ground problem must differ.
                let taken = objects.iter().any(|(o, _)| o.id == object.id);
                let id = match part {
                    Some(part) if taken => format!("{}_part_{part}", object.kind).into(),
                    _ => object.id.clone(),
                };
                objects.push((ObjectPose { id, ..object.clone() }, *part));
            }
        }
        let domain = domain.clone();
        let layout = laid_out(&classifier, &objects, seen, before.map(|(_, layout)| layout));
        let problem = Problem::new(&domain, &layout)?;
        let mut assume = before.is_some_and(|(model, _)| model.assume);
        let mut ground = problem.ground(&assumed(&problem, &layout, assume))?;
        // If there is nothing left to drop, objects in no state are the only hope.
        let same = |model: &Self| {
            model.ground.dropped() == ground.dropped() && model.objects.len() == objects.len()
        };
        if !assume && before.is_some_and(|(model, _)| same(model)) {
            assume = true;
            ground = problem.ground(&assumed(&problem, &layout, assume))?;
        }
        let ground = Arc::new(ground);
        let planner = build(&ground)?;
        Ok(Self { classifier, planner, ground, objects, domain, assume })
    }

    /// Returns the number of moves that the reference planner finds from a layout to the goal.
    pub fn reference_moves(&self, layout: &Layout) -> Option<usize> {
        let problem = Problem::new(&self.domain, layout).ok()?;
        problem.plan(&layout.situation(), &[]).ok().map(|plan| plan.len())
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
        let what = Intent {
            action: chosen.operator.clone(),
            part,
            reference: chosen.reference.clone(),
            place: m.place,
        };
        let reference = m.reference.and_then(|r| self.objects[r].1);
        let target = target_of(&pose, &turn);
        let words = self.ground.move_in_words(m, &self.domain);
        Some(Choice { part, target, what, reference, chosen, words })
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
        Turn::Axis { axis, .. } | Turn::Line { axis, .. } if axis[2].abs() > 0.99 => {
            Facing::Axis((rotation * Vector3::z()).into())
        }
        Turn::Axis { .. } | Turn::Line { .. } | Turn::Full { .. } | Turn::Sides { .. } => {
            Facing::Full(pose.orientation)
        }
    };
    Target { position: pose.position, facing }
}

/// Returns whether an object of a snapshot is a known object. Parts keep their index; landmarks keep their id.
fn is_same(known: &(ObjectPose, Option<usize>), object: &ObjectPose, part: Option<usize>) -> bool {
    match (known.1, part) {
        (Some(own), Some(part)) => own == part,
        (None, None) => known.0.id == object.id,
        _ => false,
    }
}

/// Finds the states of all known objects. An object that neither moved nor lost its reference since the look before keeps its
/// state.
fn laid_out(
    classifier: &Classifier,
    objects: &[(ObjectPose, Option<usize>)],
    seen: &Seen,
    before: Option<&Layout>,
) -> Layout {
    let mut unseen = vec![false; objects.len()];
    let posed = objects.iter().enumerate().map(|(i, known)| {
        let mut found = seen.snapshot.objects.iter().zip(&seen.parts);
        let found = found.find(|(object, part)| is_same(known, object, **part));
        let pose = found.map(|(object, _)| object.pose);
        unseen[i] = pose.is_none();
        let pose = pose.unwrap_or(Pose::at([0.0, 0.0, UNSEEN_M * (1.0 + i as f64)]));
        ObjectPose { pose, ..known.0.clone() }
    });
    let snapshot = Snapshot { objects: posed.collect(), ..seen.snapshot.clone() };
    let mut layout = match before {
        None => classifier.classify(&snapshot),
        Some(before) => classifier.classify_after(before, &snapshot),
    };
    for (located, unseen) in layout.located.iter_mut().zip(&unseen) {
        if *unseen {
            (located.fact, located.miss) = (None, None);
        }
    }
    layout
}

impl TaskModel {
    /// Finds what holds in a snapshot. `memory` is the layout of the look before, and becomes that of this one.
    pub fn look(&self, seen: &Seen, memory: &mut Option<Layout>) -> Belief {
        let layout = laid_out(&self.classifier, &self.objects, seen, memory.as_ref());
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
        let objects = layout.objects.iter().zip(&layout.located).enumerate();
        let in_no_state = objects.filter_map(|(index, (object, l))| {
            let miss = l.miss?;
            let nearest = &self.domain.states[miss.nearest.state].name;
            let words = layout.fact_in_words(&self.domain, index, &miss.nearest);
            Some(InNoState::new(&object.id, nearest, &miss.offset, words))
        });
        let in_no_state = in_no_state.collect();
        let explained = explained.collect();
        let as_found = |fact: &Fact| self.domain.states[fact.state].origin == Origin::Found;
        let as_found =
            self.objects.iter().zip(&situation).filter_map(|((_, part), fact)| {
                part.filter(|_| fact.as_ref().is_some_and(as_found))
            });
        let as_found = as_found.collect();
        *memory = Some(layout);
        let all_met = self.ground.goals().last().copied().unwrap_or(StateId::new(0));
        Belief {
            present,
            goal: self.ground.goal(&situation).unwrap_or(all_met),
            explained,
            as_found,
            in_no_state,
            outgrown: !seen.snapshot.objects.iter().zip(&seen.parts).all(known),
        }
    }

    /// Returns the parts that an action can move, and their targets. Those that failed least come first.
    pub fn choices(
        &self,
        action: ActionId,
        layout: Option<&Layout>,
        attempts: &Attempts,
    ) -> Vec<Choice> {
        let Some(layout) = layout else { return Vec::new() };
        let Ok(problem) = Problem::new(&self.domain, layout) else { return Vec::new() };
        let situation = assumed(&problem, layout, self.assume);
        let moves = self.ground.moves_for(&problem, action, &situation);
        let mut all: Vec<Choice> =
            moves.iter().filter_map(|m| self.choice(&problem, layout, m)).collect();
        // After a failure, another object or another place may succeed.
        all.sort_by_key(|choice| attempts.weight(&choice.what));
        for choice in &mut all {
            // A target that is a little too low is occupied by what lies below it.
            choice.target.position[2] +=
                RAISE_M * (attempts.occupied(&choice.what) % RAISES) as f64;
        }
        all
    }

    /// Returns whether an attempt that placed its part achieved the intended state.
    pub fn took_effect(&self, what: &Intent, layout: Option<&Layout>) -> bool {
        let own = self.objects.iter().position(|(_, part)| *part == Some(what.part));
        let fact = own.and_then(|own| layout?.located.get(own)?.fact);
        self.is_effect(&what.action, fact, what.reference.as_deref())
    }

    /// Returns whether an action leads to a fact at a reference.
    fn is_effect(&self, action: &str, fact: Option<Fact>, reference: Option<&str>) -> bool {
        let Some(operator) = self.domain.operators.iter().find(|o| o.name == action) else {
            return true;
        };
        fact.is_some_and(|fact| {
            let id = fact.reference.map(|r| &*self.objects[r].0.id);
            fact.state == operator.to && id == reference
        })
    }

    /// Returns where the part of a move is; `None` if it is not known. `homes` are the poses in which the parts were first seen;
    /// `meddled` is what moved meanwhile, and `shift` where the reference was and is, if it moved.
    pub fn landed(
        &self,
        chosen: &Chosen,
        layout: &Layout,
        homes: &[Option<Pose>],
        meddled: Option<Meddled>,
        shift: Option<(Pose, Pose)>,
    ) -> Option<Landed> {
        let own = layout.objects.iter().position(|object| *object.id == *chosen.object)?;
        let (pose, located) = (&layout.objects[own].pose, layout.located.get(own)?);
        let home = self.objects.get(own).and_then(|(_, part)| homes.get((*part)?)?.as_ref());
        let names = layout.object_names();
        let mut words = match (&located.fact, &located.miss) {
            (Some(fact), _) => {
                let first = home.unwrap_or(pose);
                self.domain.whereabouts(fact, own, &names, &layout.objects, first)
            }
            (None, Some(miss)) => {
                let nearest = &self.domain.states[miss.nearest.state].name;
                let words = self.domain.fact_in_words(&miss.nearest, own, &names);
                InNoState::new(&chosen.object, nearest, &miss.offset, words).to_string()
            }
            (None, None) => format!("{} is out of sight", names[own]),
        };
        let as_planned =
            self.is_effect(&chosen.operator, located.fact, chosen.reference.as_deref());
        if let Some(meddled) = meddled.filter(|_| !as_planned) {
            words = format!("{words}; {}", meddled.text());
        }
        let seen = located.fact.is_some() || located.miss.is_some();
        let target = match shift {
            Some((was, is)) => is.after(&relative(&was, &chosen.target)),
            None => chosen.target,
        };
        let off_m = target.distance(pose);
        Some(Landed {
            as_planned,
            state: located.fact.map(|fact| self.domain.states[fact.state].name.clone()),
            words,
            // To the nearest micrometre: the number is for people, and is written and read as text.
            off_mm: seen.then(|| (1e6 * off_m).round() / 1e3),
        })
    }

    /// Returns the preconditions of an action that are undecided needs, and how often they held.
    pub fn undecided(&self, action: ActionId) -> Vec<Undecided> {
        let needs = &self.domain.operators[self.ground.operator(action)].needs;
        let own = self.ground.undecided(action).iter();
        let own = own.map(|(fact, need)| {
            let need = &needs[*need];
            let held =
                if need.is_positive() { need.held } else { need.of - need.held.min(need.of) };
            let fact = self.ground.domain()[*fact].name.clone();
            Undecided { fact, held, of: need.of }
        });
        own.collect()
    }

    /// Returns the parts whose states forbid a fact, and those that are in a state of the goal at a reference out of place,
    /// with their references. Each comes with the fact's name. The planner is stuck because no action takes them away.
    pub fn in_the_way(&self, fact: StateId, layout: Option<&Layout>) -> Vec<(usize, String)> {
        let Some(situation) = layout.map(Layout::situation) else { return Vec::new() };
        let name = &self.ground.domain()[fact].name;
        let mut objects = self.ground.in_the_way(fact, &situation);
        objects.extend(self.ground.misplaced(&situation));
        let part = |object: usize| Some((self.objects.get(object)?.1?, name.clone()));
        objects.into_iter().filter_map(part).collect()
    }

    /// Returns whether compiling the problem anew would give the planner other needs, now that it is stuck.
    pub fn can_recompile(&self, layout: Option<&Layout>) -> bool {
        let Some(layout) = layout else { return false };
        let Ok(problem) = Problem::new(&self.domain, layout) else { return false };
        let again = problem.ground(&assumed(&problem, layout, self.assume));
        let loose = || {
            let all = layout.objects.iter().zip(&layout.located);
            all.into_iter().any(|(o, l)| l.fact.is_none() && is_loose(&self.domain, o))
        };
        again.is_ok_and(|again| again.dropped() != self.ground.dropped())
            || (!self.assume && loose())
    }
}
