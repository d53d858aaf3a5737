//! How planners are built, whichever planner it is.

use std::sync::Arc;

use super::chain::ask::Planner;
use super::chain::graph::PlannerSpec;
use super::decider::Decider;
use super::goal_sets::GoalSetPlanner;
use super::rollout::LIMIT;
use crate::neurons::{PatternError, Population, PopulationPlan};
use crate::plan::goal_sets::populations;
use crate::sim::{Seed, SimDuration};
use crate::task::compile::GroundProblem;
use crate::task::error::TaskError;
use crate::task::propositional::{Domain, StateId};

/// A planner graph, by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PlannerKind {
    /// One state at a time, as in the paper ([`Planner`]). Its control is a program.
    Chain,
    /// Whole goal sets ([`GoalSetPlanner`]). Neurons make every decision.
    #[default]
    GoalSets,
}

impl PlannerKind {
    /// All planners.
    pub const ALL: [Self; 2] = [Self::Chain, Self::GoalSets];

    /// Returns the name: `chain` or `goal-sets`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Chain => "chain",
            Self::GoalSets => "goal-sets",
        }
    }
}

/// How a planner is built over a domain.
#[derive(Debug, Clone)]
pub struct PlannerBuild {
    /// Which planner.
    pub kind: PlannerKind,
    /// Settings of [`PlannerKind::Chain`]; the other planner takes its [`rules`](PlannerSpec::rules). Over a
    /// [`GroundProblem`], the number of dimensions is the least number; a scene with many objects takes more.
    pub spec: PlannerSpec,
    /// Populations.
    pub plan: PopulationPlan,
    /// Seed of the pointers and populations.
    pub seed: Seed,
}

impl Default for PlannerBuild {
    fn default() -> Self {
        let (kind, spec) = (PlannerKind::default(), PlannerSpec::default());
        Self { kind, spec, plan: PopulationPlan::direct(), seed: Seed::new(1) }
    }
}

impl PlannerBuild {
    /// Simulated time that a decision may take, unless another is given.
    pub const LIMIT: SimDuration = LIMIT;

    /// Returns how a planner is built with the populations that suit it in a mode.
    ///
    /// # Errors
    /// None for the planners of this crate; the type is that of all patterns.
    pub fn new(
        kind: PlannerKind,
        population: &Population,
        seed: Seed,
    ) -> Result<Self, PatternError> {
        let plan = match kind {
            PlannerKind::Chain => PopulationPlan::all(population.clone()),
            PlannerKind::GoalSets => populations(population)?,
        };
        Ok(Self { kind, spec: PlannerSpec::default(), plan, seed })
    }

    /// Builds the planner over the ground problem of a scene.
    ///
    /// # Errors
    /// As [`Planner::composed`] and [`GoalSetPlanner::new`].
    pub fn over_ground(&self, ground: &GroundProblem) -> Result<Arc<dyn Decider>, TaskError> {
        let Self { kind, spec, plan, seed } = self;
        let (domain, composition) = (ground.domain(), ground.composition());
        Ok(match kind {
            PlannerKind::Chain => {
                Arc::new(Planner::composed(domain, composition, *spec, plan, *seed)?)
            }
            PlannerKind::GoalSets => self.goal_sets(domain, ground.exclusions())?,
        })
    }

    fn goal_sets(
        &self,
        domain: &Domain,
        exclusions: &[[StateId; 2]],
    ) -> Result<Arc<dyn Decider>, TaskError> {
        let rules = self.spec.rules();
        let built = GoalSetPlanner::new(domain, rules, exclusions, &self.plan, self.seed)?;
        Ok(Arc::new(built))
    }
}
