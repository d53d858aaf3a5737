//! The planner that decides the moves of an episode.

use crate::sim::{Seed, SimDuration};
use crate::task::classify::Layout;
use crate::task::compile::{GroundProblem, Move, Problem};
use crate::task::domain::Situation;
use crate::task::planner::{PlanEnd, PlannerBuild, PlannerKind, Prediction};
use crate::task::propositional::{ActionId, StateId, WorldState};

/// The planner of an episode. It plans anew after each move.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Planning {
    /// The symbolic reference planner, [`Problem::plan`]. No neuron takes part.
    #[default]
    Symbolic,
    /// The planner of goal sets, whose network computes in direct mode.
    GoalSets,
}

/// Longest simulated time of a decision.
const LIMIT: SimDuration = SimDuration::from_millis(10_000);

impl Planning {
    /// All planners by name.
    pub const ALL: [(&'static str, Self); 2] =
        [("symbolic", Self::Symbolic), ("goal-sets", Self::GoalSets)];

    /// Returns the first move of a plan; `None` if the goal is met, and the reason if there is no plan. The symbolic planner
    /// does not move the objects in `avoid`.
    pub(super) fn first(
        self,
        problem: &Problem<'_>,
        layout: &Layout,
        avoid: &[usize],
        seed: Seed,
    ) -> Result<Option<Move>, String> {
        let situation = layout.situation();
        match self {
            Self::Symbolic => match problem.plan(&situation, avoid) {
                Ok(plan) => Ok(plan.first().map(|step| step.action)),
                Err(_) => Err(format!("no plan from {}", in_words(problem, layout))),
            },
            Self::GoalSets if problem.lacking(&situation) == 0 => Ok(None),
            Self::GoalSets => decided(problem, situation, seed),
        }
    }
}

fn in_words(problem: &Problem<'_>, layout: &Layout) -> String {
    let states = &problem.domain().states;
    let objects = layout.objects.iter().zip(&layout.located).map(|(object, located)| {
        let state = located.fact.map_or("none", |fact| &states[fact.state].name[..]);
        format!("{} {state}", object.id)
    });
    objects.collect::<Vec<_>>().join(", ")
}

/// Lets the planner of goal sets decide once.
fn decided(
    problem: &Problem<'_>,
    situation: Situation,
    seed: Seed,
) -> Result<Option<Move>, String> {
    let ground = problem.ground(&situation).map_err(|e| e.to_string())?;
    let build = PlannerBuild { kind: PlannerKind::GoalSets, seed, ..PlannerBuild::default() };
    let planner = build.over_ground(&ground).map_err(|e| e.to_string())?;
    let mut first = First { problem, ground: &ground, situation, chosen: None };
    let plan = planner.roll_out(&mut first, LIMIT).map_err(|e| e.to_string())?;
    match (first.chosen, plan.end) {
        (Some(chosen), _) => Ok(Some(chosen)),
        (None, PlanEnd::Met) => Ok(None),
        (None, end) => Err(format!("{end:?}")),
    }
}

/// A situation that ends with the first action.
struct First<'p> {
    problem: &'p Problem<'p>,
    ground: &'p GroundProblem,
    situation: Situation,
    chosen: Option<Move>,
}

impl Prediction for First<'_> {
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
        self.chosen = moves.first().copied();
        // The world is looked at before the next move, so the plan goes no further.
        Some(PlanEnd::Impossible(action))
    }
}
