//! The planner that decides the moves of an episode.

use crate::sim::{Seed, SimDuration};
use crate::task::classify::Layout;
use crate::task::compile::{Move, Problem};
use crate::task::planner::{PlannerBuild, PlannerKind, SceneEnd};

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
        match self {
            Self::Symbolic => match problem.plan(&layout.situation(), avoid) {
                Ok(plan) => Ok(plan.first().map(|step| step.action)),
                Err(_) => Err(format!("no plan from {}", in_words(problem, layout))),
            },
            Self::GoalSets => decided(problem, layout, seed),
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

/// Lets the planner of goal sets decide once: the world is looked at before the next move.
fn decided(problem: &Problem<'_>, layout: &Layout, seed: Seed) -> Result<Option<Move>, String> {
    let build = PlannerBuild { kind: PlannerKind::GoalSets, seed, ..PlannerBuild::default() };
    let plan = build.plan_moves(problem, layout, LIMIT, 1).map_err(|e| e.to_string())?;
    match (plan.moves.first(), plan.end) {
        (Some(first), _) => Ok(Some(first.chosen)),
        (None, SceneEnd::Met) => Ok(None),
        (None, SceneEnd::Circle) => Err("the predicted situations repeat".to_owned()),
        (None, SceneEnd::Stuck(reason)) => Err(reason),
    }
}
