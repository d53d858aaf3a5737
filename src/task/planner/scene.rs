//! Plans for a scene: the moves of a learned domain that lead to its goal, with the poses that they aim at.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::build::PlannerBuild;
use super::decision::Decision;
use super::rollout::{PlanEnd, PlannedStep, Prediction};
use crate::sim::SimDuration;
use crate::task::classify::Layout;
use crate::task::compile::{
    GroundProblem, Move, Problem, ProblemError, TargetPose, assumed, lies_as_high,
};
use crate::task::domain::Situation;
use crate::task::error::TaskError;
use crate::task::propositional::{ActionId, StateId, WorldState};

/// Height above or below a known place, in metres, and tilt, in radians, up to which an object in no state lies as in that place, only
/// elsewhere.
const AS_HIGH_M: f64 = 4e-3;
const AS_UPRIGHT_RAD: f64 = 0.1;

/// Number of moves after which a plan is cut short.
const MOST_MOVES: usize = 200;

/// A move of a plan, in words.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneMove {
    /// The move.
    pub chosen: Move,
    /// Name of the action.
    pub action: String,
    /// The move as a sentence, such as `put cup 0 in the drawer`.
    pub words: String,
    /// Id of the object that moves.
    pub object: Arc<str>,
    /// Id of the object that it is put onto, into or beside; `None` in the world frame.
    pub onto: Option<Arc<str>>,
    /// Pose in which the object is to be put, where all earlier moves went as planned.
    pub target: TargetPose,
    /// Whether all undecided needs are met when the move is due.
    pub decided: bool,
    /// Name of the ground action that the planner decided for.
    pub ground_action: String,
    /// The decision for this move.
    pub decision: Decision,
}

/// How a plan for a scene ends.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SceneEnd {
    /// The goal is met.
    Met,
    /// The predicted situations repeat.
    Circle,
    /// The goal cannot be reached, for this reason in words.
    Stuck(String),
}

/// A plan for a scene. The robot plans again after each move, so only the first is a commitment.
#[derive(Debug, Clone)]
pub struct ScenePlan {
    /// The moves, in order.
    pub moves: Vec<SceneMove>,
    /// How the plan ends.
    pub end: SceneEnd,
    /// The last decision; `None` if nothing was asked.
    pub last: Option<Decision>,
    /// The ground problem that the decisions are about; `None` if nothing was asked.
    pub ground: Option<GroundProblem>,
    /// Ids of the objects in no state that were taken to be in a state that some action leaves, because the plan is better so.
    pub assumed: Vec<Arc<str>>,
    /// Whether the moves were found object by object, because no way was found where the objects of a kind are taken as one.
    pub apart: bool,
}

impl ScenePlan {
    fn without_decision(end: SceneEnd) -> Self {
        let (moves, assumed) = (Vec::new(), Vec::new());
        Self { moves, end, last: None, ground: None, assumed, apart: false }
    }

    /// Returns the plan for a goal that cannot be asked for.
    pub fn impossible(error: &ProblemError) -> Self {
        Self::without_decision(SceneEnd::Stuck(error.to_string()))
    }

    /// Returns the number of undecided conditions that the plan does without.
    fn given_up(&self) -> usize {
        self.ground.as_ref().map_or(0, |ground| ground.dropped().len())
    }

    /// Returns the decision about the scene itself. The other decisions are about predicted situations.
    pub fn first(&self) -> Option<&Decision> {
        self.moves.first().map(|step| &step.decision).or(self.last.as_ref())
    }
}

impl SceneEnd {
    fn of(ground: &GroundProblem, end: PlanEnd) -> Self {
        match end {
            PlanEnd::Met => Self::Met,
            PlanEnd::Circle => Self::Circle,
            PlanEnd::Stuck(obstacle) => Self::Stuck(ground.obstacle_in_words(obstacle)),
            PlanEnd::Impossible(action) => {
                let words = ground.action_in_words(action);
                Self::Stuck(format!("no object in the scene can be used to {words}"))
            }
        }
    }
}

/// A situation that changes as the operators predict.
#[derive(Clone)]
struct Predicted<'p> {
    problem: &'p Problem<'p>,
    ground: &'p GroundProblem,
    layout: Layout,
    situation: Situation,
    seen: Vec<Situation>,
    most_moves: usize,
    moves: Vec<(Move, TargetPose, bool)>,
}

impl Prediction for Predicted<'_> {
    fn present(&self) -> WorldState {
        self.ground.present(&self.situation)
    }

    fn goals(&self) -> &[StateId] {
        self.ground.goals()
    }

    fn goal(&self) -> Option<StateId> {
        self.ground.goal(&self.situation)
    }

    fn act(&mut self, action: ActionId) -> Option<PlanEnd> {
        let moves = self.ground.moves_for(self.problem, action, &self.situation);
        let Some(chosen) = moves.first().copied() else {
            return Some(PlanEnd::Impossible(action));
        };
        self.carry_out(chosen);
        let circle = self.seen.contains(&self.situation) || self.moves.len() >= self.most_moves;
        circle.then_some(PlanEnd::Circle)
    }
}

impl Predicted<'_> {
    /// Lets a move have its effects.
    fn carry_out(&mut self, chosen: Move) {
        let target = self.problem.target(&chosen, &self.layout);
        let decided = self.problem.decided(&chosen, &self.situation);
        self.moves.push((chosen, target, decided));
        self.problem.displace(&chosen, &target, &self.situation, &mut self.layout);
        let after = self.problem.after(&chosen, &self.situation);
        let before = std::mem::replace(&mut self.situation, after);
        self.seen.push(before);
    }
}

impl PlannerBuild {
    /// Plans in the scene of a problem: asks the planner for one move after another, in situations predicted from the
    /// operators. If the goal is out of reach, or only within reach without some undecided conditions, objects in no state that lie as high
    /// and as upright as in a known place are taken to be in a state that some action leaves, if that helps. Where the planner of goal
    /// sets finds no way in a problem that takes the objects of a kind as one, it plans object by object. A decision of the planner of goal sets takes at most the simulated time `limit`.
    ///
    /// ```
    /// use symbolt::neurons::Population;
    /// use symbolt::sim::Seed;
    /// use symbolt::task::learn::learn;
    /// use symbolt::task::planner::{PlannerBuild, PlannerKind};
    /// use symbolt::task::classify::Classifier;
    /// use symbolt::task::compile::Problem;
    /// use symbolt::task::tasks::nuts_and_bolts::SyntheticDemonstrations;
    ///
    /// let synthetic = SyntheticDemonstrations::default();
    /// let domain = learn(&synthetic.record(Seed::new(1))?.recording, &Default::default())?.domain;
    /// let layout = Classifier::new(&domain).classify(&synthetic.scene(Seed::new(2))?);
    /// let build = PlannerBuild::new(PlannerKind::GoalSets, &Population::Direct, Seed::new(1))?;
    /// let plan = build.plan(&Problem::new(&domain, &layout)?, &layout, PlannerBuild::LIMIT)?;
    /// let objects: Vec<&str> = plan.moves.iter().map(|m| &*m.object).collect();
    /// assert_eq!(objects, ["bolt_0", "nut_0", "bolt_0"]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`PlannerBuild::over_ground`]; [`TaskError::Problem`] if the scene has too many objects;
    /// [`TaskError::Undecided`] if the graph does not settle.
    ///
    /// # Panics
    /// If `layout` has fewer objects than the problem.
    pub fn plan(
        &self,
        problem: &Problem<'_>,
        layout: &Layout,
        limit: SimDuration,
    ) -> Result<ScenePlan, TaskError> {
        self.plan_moves(problem, layout, limit, MOST_MOVES)
    }

    /// Plans as [`plan`](Self::plan) does, up to a number of moves. A plan that is cut short ends with
    /// [`SceneEnd::Circle`].
    ///
    /// # Errors
    /// As [`PlannerBuild::plan`].
    ///
    /// # Panics
    /// As [`PlannerBuild::plan`].
    pub fn plan_moves(
        &self,
        problem: &Problem<'_>,
        layout: &Layout,
        limit: SimDuration,
        most_moves: usize,
    ) -> Result<ScenePlan, TaskError> {
        let seen = layout.situation();
        if problem.lacking(&seen) == 0 {
            return Ok(ScenePlan::without_decision(SceneEnd::Met));
        }
        let plan = self.plan_from(problem, layout, seen.clone(), limit, most_moves)?;
        if !matches!(plan.end, SceneEnd::Stuck(_)) && plan.given_up() == 0 {
            return Ok(plan);
        }
        // Objects in no state are the only hope, but not what floats or leans: it may be held, or jammed.
        let domain = problem.domain();
        let lies = |object: usize| {
            let offset = layout.located[object].miss.map(|miss| miss.offset);
            offset.is_some_and(|o| {
                let high =
                    o.high_m.abs() <= AS_HIGH_M || lies_as_high(domain, layout, object, AS_HIGH_M);
                high && o.off_rad <= AS_UPRIGHT_RAD
            })
        };
        let all = assumed(problem, layout, true).into_iter().zip(&seen).enumerate();
        let guessed: Situation =
            all.map(|(i, (guess, seen))| if lies(i) { guess } else { *seen }).collect();
        if guessed == seen {
            return Ok(plan);
        }
        let problem = &problem.starting_from(&guessed);
        let again = self.plan_from(problem, layout, guessed.clone(), limit, most_moves)?;
        let new = |object: &usize| seen[*object] != guessed[*object];
        let moved: BTreeSet<usize> =
            again.moves.iter().map(|step| step.chosen.object).filter(new).collect();
        let hopeless = plan.moves.is_empty() && matches!(plan.end, SceneEnd::Stuck(_));
        let better = again.end == SceneEnd::Met
            && (plan.end != SceneEnd::Met || again.given_up() < plan.given_up());
        if moved.is_empty() || !(hopeless || better) {
            return Ok(plan);
        }
        let assumed = moved.iter().map(|object| problem.objects()[*object].id.clone()).collect();
        Ok(ScenePlan { assumed, ..again })
    }

    /// Plans as [`plan_moves`](Self::plan_moves) does, from a situation that need not be that of the layout.
    fn plan_from(
        &self,
        problem: &Problem<'_>,
        layout: &Layout,
        situation: Situation,
        limit: SimDuration,
        most_moves: usize,
    ) -> Result<ScenePlan, TaskError> {
        let ground = match problem.ground(&situation) {
            Ok(ground) => ground,
            Err(error @ ProblemError::Nothing { .. }) => {
                return Ok(ScenePlan::without_decision(SceneEnd::Stuck(error.to_string())));
            }
            Err(error) => return Err(error.into()),
        };
        let planner = self.over_ground(&ground)?;
        let (layout, seen, moves) = (layout.clone(), Vec::new(), Vec::new());
        let start = situation.clone();
        let begin =
            Predicted { problem, ground: &ground, layout, situation, seen, most_moves, moves };
        let mut predicted = begin.clone();
        let mut plan = planner.roll_out(&mut predicted, limit)?;
        let mut apart = false;
        if matches!(plan.end, PlanEnd::Stuck(_) | PlanEnd::Circle)
            && let Some(found) = self.plan_apart(problem, &ground, &start, limit)
            && found.len() <= most_moves
        {
            (apart, predicted) = (true, begin);
            // The robot waits for both planners before its first move.
            let stuck = plan.last.as_ref().filter(|_| matches!(plan.end, PlanEnd::Stuck(_)));
            let before = plan.steps.iter().map(|step| &step.decision).chain(stuck);
            let mut waited_ms: f64 = before.map(|decision| decision.time_ms).sum();
            let steps = found.into_iter().map(|(chosen, action, mut decision)| {
                predicted.carry_out(chosen);
                decision.time_ms += std::mem::take(&mut waited_ms);
                PlannedStep { action, decision }
            });
            plan.steps = steps.collect();
            plan.end = PlanEnd::Met;
        }
        let id = |object: usize| problem.objects()[object].id.clone();
        let moves = predicted.moves.into_iter().zip(plan.steps);
        let moves = moves.map(|((chosen, target, decided), step)| SceneMove {
            words: ground.move_in_words(&chosen, problem.domain()),
            chosen,
            action: problem.domain().operators[chosen.operator].name.clone(),
            object: id(chosen.object),
            onto: chosen.reference.map(id),
            target,
            decided,
            ground_action: ground.domain()[step.action].name.clone(),
            decision: step.decision,
        });
        let (moves, end) = (moves.collect(), SceneEnd::of(&ground, plan.end));
        let (last, ground, assumed) = (plan.last, Some(ground), Vec::new());
        Ok(ScenePlan { moves, end, last, ground, assumed, apart })
    }
}
