//! The state of an episode that changes, and the closed loop: rest, look, ask, act.

use serde::{Deserialize, Serialize};

use super::EpisodeSpec;
use super::cell::Cell;
use super::log::Log;
use super::model::TaskModel;
use super::recovery::attempts::{Attempts, Meddled, near};
use super::recovery::plight::Wanted;
use crate::robot::Pose;
use crate::sim::{Real, Seed};
use crate::task::classify::Layout;
use crate::task::event::{Decided, Ended, InNoState, Touched};
use crate::task::planner::{PlannerInput, Request};
use crate::task::propositional::{Obstacle, StateId, Verdict, WorldState};

/// The executor's phase.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) enum Phase {
    /// The graph forgets its last answer; then the executor looks.
    Rest { left: u32 },
    /// The graph recognises another goal; then the executor looks.
    Recognise { left: u32 },
    /// The graph is deciding.
    Ask { since_step: u64 },
    /// The robot is carrying out a skill.
    Act,
    /// The episode is over.
    Over(Ended),
    /// The problem must be compiled anew; another model takes over.
    Recompile,
}

/// Steps of rest between two requests to the graph.
pub(super) const REST: u32 = 5;
/// Steps in which the graph recognises another goal.
const RECOGNISE: u32 = 10;

/// The state that changes during an episode.
#[derive(Serialize, Deserialize)]
pub(super) struct Live {
    pub cell: Cell,
    pub phase: Phase,
    pub present: WorldState,
    /// The goal that the graph is asked for.
    pub goal: StateId,
    /// The verdict that the graph shows, and for how many steps.
    pub shown: Option<(Verdict, u64)>,
    /// The layout of the last look; `None` before the first.
    pub memory: Option<Layout>,
    /// For each part, whether it was in no state at the last look.
    pub in_no_state: Vec<bool>,
    /// For each part, whether it was in a state in which parts were found.
    pub as_found: Vec<bool>,
    /// The parts in no state at the last look, with the nearest states.
    pub off: Vec<InNoState>,
    pub log: Log,
    pub seed: Seed,
    pub perturbed: bool,
    /// What was tried, and how it ended.
    pub attempts: Attempts,
    /// States that the graph is told to hold although they do not, so that it decides for another order.
    pub pretended: Vec<StateId>,
    /// What the decided action wanted, if it could not be carried out.
    pub wanted: Vec<Wanted>,
    /// The action that could not be carried out.
    pub impossible: Option<String>,
    /// For each part, the pose in which it was first seen.
    pub homes: Vec<Option<Pose>>,
}

/// The parts of the world that the executor only reads.
pub(super) struct Tools<'w> {
    pub model: &'w TaskModel,
    pub spec: &'w EpisodeSpec,
}

impl Live {
    /// Returns the state at the beginning of an episode.
    pub fn new(cell: Cell, seed: Seed, empty: WorldState, goal: StateId) -> Self {
        let parts = cell.sensed().part_count();
        Self {
            cell,
            phase: Phase::Rest { left: REST },
            present: empty,
            goal,
            shown: None,
            memory: None,
            in_no_state: vec![false; parts],
            as_found: vec![false; parts],
            off: Vec::new(),
            log: Log::default(),
            seed,
            perturbed: false,
            attempts: Attempts::default(),
            pretended: Vec::new(),
            wanted: Vec::new(),
            impossible: None,
            homes: vec![None; parts],
        }
    }

    /// Forgets everything that refers to the states of one model.
    pub fn hand_over(&mut self) {
        self.phase = Phase::Rest { left: REST };
        self.pretended.clear();
        self.wanted.clear();
        self.impossible = None;
    }

    pub fn step(&mut self, tools: &Tools<'_>, command: &[Real]) {
        if let Some(perturbation) = tools.spec.perturbation.filter(|_| !self.perturbed)
            && let Some(displaced) = self.cell.perturb(&perturbation)
        {
            self.perturbed = true;
            self.log.displaced.push(displaced);
        }
        match self.phase.clone() {
            Phase::Rest { left: 0 } | Phase::Recognise { left: 0 } => self.look(tools),
            Phase::Rest { left } => self.phase = Phase::Rest { left: left - 1 },
            Phase::Recognise { left } => self.phase = Phase::Recognise { left: left - 1 },
            Phase::Ask { since_step } => self.listen(tools, command, since_step),
            Phase::Act | Phase::Over(_) | Phase::Recompile => {}
        }
        let stepped = self.cell.step();
        let scene = self.cell.truth();
        if let Some(touch) = stepped.touch {
            self.log.touches.push(Touched::at(scene.time_s(), touch));
        }
        if let Some(report) = stepped.ended {
            // A skill always belongs to the last decision.
            if let Some(decided) = self.log.decisions.last_mut() {
                decided.skill = Some(report);
            }
            let sensed = self.cell.sensed();
            self.attempts.end(report.outcome, |part| sensed.part(part));
            self.phase = Phase::Rest { left: REST };
        }
        if let Some(every) = tools.spec.frame_ms
            && (scene.steps() * scene.spec().step_ms).is_multiple_of(every.max(1))
        {
            self.log.frames.push(scene.frame());
        }
        let (limit_s, _) = tools.spec.limits(scene.part_count());
        let late = scene.time_s() > limit_s;
        if late && !matches!(self.phase, Phase::Over(_)) {
            self.phase = Phase::Over(Ended::GaveUp);
        }
    }

    fn look(&mut self, tools: &Tools<'_>) {
        let seen = self.cell.look();
        let belief = tools.model.look(&seen, &mut self.memory);
        let (sensed, memory) = (self.cell.sensed(), self.memory.as_ref());
        let mut shift = None;
        let meddled = self.attempts.unsettled().and_then(|attempt| {
            let target = attempt.what.reference.as_deref().and_then(|id| memory?.pose(id));
            attempt.meddled = attempt.meddled(sensed.part(attempt.what.part).as_ref(), target);
            if attempt.meddled == Some(Meddled::Target) {
                shift = attempt.target.zip(target.copied());
            }
            attempt.meddled
        });
        if let (Some(decided), Some(layout)) = (self.log.decisions.last_mut(), memory)
            && decided.skill.is_some()
            && decided.landed.is_none()
            && !decided.is_detour()
        {
            let chosen = decided.chosen.as_ref();
            decided.landed =
                chosen.and_then(|own| tools.model.landed(own, layout, &self.homes, meddled, shift));
        }
        self.attempts.settle(|attempt| match attempt.detour {
            true => sensed.part(attempt.what.part).is_some_and(|pose| !near(&pose, &attempt.start)),
            false => tools.model.took_effect(&attempt.what, memory),
        });
        if self.present != belief.present {
            self.pretended.clear();
        }
        // Where the goal itself is pretended, another goal may come first.
        let mut goal = belief.goal;
        if self.pretended.contains(&goal) {
            let open = |g: &StateId| !belief.present.holds(*g) && !self.pretended.contains(g);
            goal = tools.model.ground.goals().iter().copied().find(open).unwrap_or(goal);
        }
        // The graph needs time to recognise another goal before it is asked.
        let another = self.goal != goal && !tools.model.planner.plans_for_all_goals();
        (self.present, self.goal) = (belief.present, goal);
        self.off = belief.in_no_state;
        let mut in_no_state = vec![true; self.in_no_state.len()];
        for part in belief.explained {
            in_no_state[part] = false;
        }
        self.as_found.fill(false);
        for part in belief.as_found {
            self.as_found[part] = true;
        }
        for (object, part) in seen.snapshot.objects.iter().zip(&seen.parts) {
            if let Some(home) = part.and_then(|part| self.homes.get_mut(part)) {
                home.get_or_insert(object.pose);
            }
        }
        let newly =
            in_no_state.iter().zip(&self.in_no_state).filter(|(now, before)| **now && !**before);
        self.log.unexplained += newly.count();
        self.log.in_no_state = in_no_state.iter().filter(|s| **s).count();
        self.in_no_state = in_no_state;
        self.shown = None;
        self.phase = match (belief.outgrown, another) {
            (true, _) => Phase::Recompile,
            (false, true) => Phase::Recognise { left: RECOGNISE },
            (false, false) => Phase::Ask { since_step: self.cell.truth().steps() },
        };
    }

    fn listen(&mut self, tools: &Tools<'_>, command: &[Real], since_step: u64) {
        let planner = &tools.model.planner;
        let (domain, step_ms) = (planner.domain(), self.cell.truth().spec().step_ms);
        let verdict = planner.verdict(command, &self.planner_input(tools.model.ground.goals()));
        let steps =
            self.shown.filter(|(shown, _)| Some(*shown) == verdict).map_or(1, |(_, n)| n + 1);
        self.shown = verdict.map(|verdict| (verdict, steps));
        let lasting = verdict.filter(|v| steps * step_ms >= planner.steady_ms(v));
        let waited_ms = (self.cell.truth().steps() - since_step) * step_ms;
        let late = planner.patience_ms().is_some_and(|patience| waited_ms >= patience);
        let no_plan = || Verdict::Stuck(Obstacle::NoPlan { state: self.goal });
        let Some(verdict) = lasting.or_else(|| late.then(no_plan)) else { return };
        let action = if let Verdict::Act(action) = verdict { Some(&domain[action]) } else { None };
        let names = |states: &[StateId]| -> Vec<String> {
            states.iter().map(|state| domain[*state].name.clone()).collect()
        };
        let goals = tools.model.ground.goals().iter();
        let unmet: Vec<_> = goals.copied().filter(|goal| !self.present.holds(*goal)).collect();
        self.log.decisions.push(Decided {
            asked_s: (since_step * step_ms) as f64 / 1e3,
            took_ms: waited_ms as f64,
            holds: self.present.iter().map(|state| domain[state].name.clone()).collect(),
            action: action.map(|operator| operator.name.clone()),
            unmet: names(&unmet),
            needs: action.map_or_else(Vec::new, |operator| names(&operator.preconditions)),
            undecided: match verdict {
                Verdict::Act(action) => tools.model.undecided(action),
                _ => Vec::new(),
            },
            gives: action.map_or_else(Vec::new, |operator| names(&operator.effects)),
            landed: None,
            words: match verdict {
                Verdict::Act(action) => Some(tools.model.ground.action_in_words(action).into()),
                _ => None,
            },
            begun: false,
            skill: None,
            chosen: None,
            recovery: None,
            in_no_state: self.off.clone(),
        });
        let (_, most_skills) = tools.spec.limits(self.in_no_state.len());
        let spent = self.log.skill_count() >= most_skills;
        self.phase = match verdict {
            Verdict::Met if self.pretended.is_empty() => Phase::Over(Ended::GoalMet),
            Verdict::Stuck(_)
                if self.pretended.is_empty() && tools.model.can_recompile(self.memory.as_ref()) =>
            {
                Phase::Recompile
            }
            _ if spent => Phase::Over(Ended::GaveUp),
            Verdict::Act(action) => self.act(tools, action),
            // With pretended states, this is no verdict about the goal: there is no other order.
            Verdict::Met => self.recover(tools, None),
            Verdict::Stuck(obstacle) => self.recover(tools, Some(obstacle)),
        };
        if let (Phase::Act, Some(decided)) = (&self.phase, self.log.decisions.last_mut()) {
            decided.begun = true;
        }
    }

    /// Returns the input of the planner graph. `goals` are all goals of the model.
    pub fn planner_input<'l>(&'l self, goals: &'l [StateId]) -> PlannerInput<'l> {
        let request = match self.phase {
            Phase::Ask { .. } => Request::Decide,
            Phase::Recognise { .. } => Request::Forget,
            Phase::Rest { .. } | Phase::Act | Phase::Over(_) | Phase::Recompile => Request::Wait,
        };
        let Self { present, pretended, goal, .. } = self;
        PlannerInput { request, present, pretended, goal: *goal, goals }
    }
}
