//! Plans object by object, where a planner that takes objects of a kind as one finds no way.
//!
//! A ground problem has one action for all objects of a kind that is nobody's reference, and does not know how many are left where one is
//! taken from. So it may end in a situation from which nothing leads on, or see no way to begin with. The problem as
//! [`of_relational`] writes it knows each object. It is larger, and is searched in both directions.

use std::collections::BTreeSet;

use super::build::{PlannerBuild, PlannerKind};
use super::decision::Decision;
use crate::plan::goal_sets::{GoalSetSpec, StripsWorld, pursue_with};
use crate::plan::strips::{Fact, Grounded};
use crate::sim::SimDuration;
use crate::task::compile::{GroundProblem, Move, Problem};
use crate::task::domain::Situation;
use crate::task::pddl::{facts_of, of_relational};
use crate::task::propositional::{ActionId, Verdict};

/// Time for which the motor is locked after an action has begun.
const LOCK: SimDuration = SimDuration::from_millis(100);

/// Greatest number of fluents and operators that are planned with; in spikes, so many take about a minute.
const MOST: usize = 2_000;

/// A move, with the ground action that it carries out and the decision for it.
pub(super) type Decided = (Move, ActionId, Decision);

impl PlannerBuild {
    /// Plans from a situation to the goal, object by object. `ground` is the ground problem of the situation, of which the conditions
    /// that it gives up are given up here as well. Returns `None` if there is no plan, the problem is too large, the planner is another
    /// than that of goal sets, or `limit` is over.
    pub(super) fn plan_apart(
        &self,
        problem: &Problem<'_>,
        ground: &GroundProblem,
        start: &Situation,
        limit: SimDuration,
    ) -> Option<Vec<Decided>> {
        if self.kind != PlannerKind::GoalSets {
            return None;
        }
        let dropped: Vec<(usize, usize)> = ground.dropped().iter().copied().collect();
        let pddl = of_relational(problem, &dropped, start, "scene").ok()?;
        let grounded = Grounded::new(&pddl.domain, &pddl.problem).ok()?;
        if grounded.fluents.len() + grounded.operators.len() > MOST {
            return None;
        }
        let world = StripsWorld::new(&grounded, LOCK);
        let spec = GoalSetSpec { limit, ..GoalSetSpec::default() };
        let course = pursue_with(&grounded, world, &spec, &self.plan, self.seed).ok()?;
        if !course.reached {
            return None;
        }
        // What is hidden is no state of an object, and what never changes is no fluent.
        let is_state = |fact: &Fact| {
            pddl.domain.predicates.iter().any(|predicate| predicate.name == fact.predicate)
        };
        let fluents = grounded.fluents.iter().filter(|f| f.holds && is_state(&f.fact));
        let known: BTreeSet<&Fact> = fluents.map(|fluent| &fluent.fact).collect();
        let written = facts_of(problem);
        let facts = |now: &Situation| -> BTreeSet<Fact> {
            written(now).into_iter().filter(|fact| known.contains(fact)).collect()
        };
        let mut holding: BTreeSet<usize> = grounded.start.iter().copied().collect();
        let mut now = start.clone();
        let (mut moves, mut free_ms) = (Vec::new(), 0);
        for begun in course.begun.iter().filter(|begun| begun.done) {
            let operator = &grounded.operators[begun.operator];
            operator.deletes.iter().for_each(|fluent| _ = holding.remove(fluent));
            holding.extend(&operator.adds);
            // A hidden operator changes no state of an object.
            if operator.name.is_empty() {
                continue;
            }
            let then = holding.iter().map(|fluent| &grounded.fluents[*fluent]);
            let then = then.filter(|fluent| fluent.holds && known.contains(&fluent.fact));
            let then: BTreeSet<Fact> = then.map(|fluent| fluent.fact.clone()).collect();
            let leads = |m: &&Move| facts(&problem.after(m, &now)) == then;
            let chosen = *problem.moves(&now).iter().find(leads)?;
            // The action of which the move is the best one, or else another that it carries out.
            let rank = |action: ActionId| {
                let moves = ground.moves_for(problem, action, &now);
                Some((moves.iter().position(|m| *m == chosen)?, action))
            };
            let (_, action) = ground.domain().action_ids().filter_map(rank).min()?;
            let decision = Decision {
                verdict: Verdict::Act(action),
                milestones: Vec::new(),
                time_ms: begun.ms.saturating_sub(free_ms) as f64,
                questions: if moves.is_empty() { course.goal_sets() as u32 } else { 0 },
                choices: Vec::new(),
            };
            free_ms = begun.ms + LOCK.as_micros() / 1000;
            now = problem.after(&chosen, &now);
            moves.push((chosen, action, decision));
        }
        (problem.lacking(&now) == 0).then_some(moves)
    }
}
