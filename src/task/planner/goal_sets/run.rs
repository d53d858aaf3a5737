//! A run of the planner of goal sets that is told one situation after another, for whole plans.

use std::ops::ControlFlow;

use super::GoalSetPlanner;
use crate::plan::goal_sets::{Moments, Step};
use crate::sim::{Real, RunConfig, SimDuration, Simulator, StopReason};
use crate::task::error::TaskError;
use crate::task::planner::board::Board;
use crate::task::planner::decider::{Decider, PlannerInput, Request};
use crate::task::planner::decision::{Decision, Milestone, Stage};
use crate::task::propositional::{ActionId, Obstacle, Verdict};

/// Time for which the motor is busy with an action of a plan that is rolled out.
const BUSY: SimDuration = SimDuration::from_millis(100);

/// A run of the graph that is told one situation after another.
pub(in crate::task::planner) struct GoalSetRun<'p> {
    planner: &'p GoalSetPlanner,
    sim: Simulator,
    board: Board,
    moments: Moments,
    ms: u64,
    /// Whether the motor is busy with the action decided last.
    busy: bool,
}

impl<'p> GoalSetRun<'p> {
    pub fn new(planner: &'p GoalSetPlanner) -> Result<Self, TaskError> {
        let board = Board::new(planner);
        let config = RunConfig::default().in_world(board.clone());
        let sim = Simulator::new(planner.graph().clone(), config)?;
        Ok(Self { planner, sim, board, moments: Moments::default(), ms: 0, busy: false })
    }

    /// Runs until `shown` returns a verdict for the commands, or for the whole span.
    fn run(
        &mut self,
        span: SimDuration,
        mut shown: impl FnMut(&[Real]) -> Option<Verdict>,
    ) -> Result<Option<Verdict>, TaskError> {
        let Self { planner, sim, moments, ms, .. } = self;
        let mut commands = vec![0.0; planner.command_width()];
        let mut verdict = None;
        sim.run_until(span, |view| {
            *ms += 1;
            let phases = view.value(&planner.ports.phases);
            moments.look(*ms, phases, view.value(&planner.ports.winner));
            let (actions, rest) = commands.split_at_mut(planner.domain().operators().len());
            actions.copy_from_slice(view.value(&planner.ports.actions));
            rest.copy_from_slice(phases);
            verdict = shown(&commands);
            match verdict {
                Some(_) => ControlFlow::Break(StopReason::Condition("a decision")),
                None => ControlFlow::Continue(()),
            }
        })?;
        Ok(verdict)
    }

    /// Asks for a decision, once the motor is done with the last. Without one within the limit, there is no plan.
    pub fn decide(
        &mut self,
        input: &PlannerInput<'_>,
        limit: SimDuration,
    ) -> Result<Decision, TaskError> {
        if self.busy {
            self.run(BUSY, |_| None)?;
        }
        self.board.write(self.planner, input);
        let (planner, begun, past) = (self.planner, self.ms, self.moments.all.len());
        let mut last = (None, 0);
        let verdict = self.run(limit, |commands| {
            let verdict = planner.verdict(commands, input);
            last = (verdict, if verdict == last.0 { last.1 + 1 } else { 1 });
            verdict.filter(|verdict| last.1 >= planner.steady_ms(verdict))
        })?;
        self.board.write(self.planner, &PlannerInput { request: Request::Wait, ..*input });
        self.busy = true;
        let no_plan = Verdict::Stuck(Obstacle::NoPlan { state: input.goal });
        let verdict = verdict.unwrap_or(no_plan);
        let goal = match input.goals {
            [goal] => planner.domain()[*goal].name.as_str(),
            _ => "all goals",
        };
        let action = |action: usize| planner.domain()[ActionId::new(action)].name.as_str();
        let mut milestones: Vec<Milestone> = Vec::new();
        let (mut written, mut step) = (0, 0);
        let mut add = |question: u32, stage, subject: &str, ms: u64| {
            let (subject, time_ms) = (subject.to_owned(), (ms - begun) as f64);
            milestones.push(Milestone { question, stage, subject, time_ms });
        };
        for moment in &self.moments.all[past..] {
            let (stage, subject) = match moment.step {
                Step::Start => (Stage::Start, goal),
                Step::Costs => (Stage::Costs, goal),
                Step::GoalSet { operator } => (Stage::GoalSet, action(operator)),
                Step::DeadEnd => (Stage::DeadEnd, goal),
                Step::Plan => (Stage::Plan, goal),
            };
            written += u32::from(stage == Stage::GoalSet);
            // No two milestones of a step are alike.
            step += u32::from(matches!(stage, Stage::Start | Stage::GoalSet | Stage::DeadEnd));
            add(step.max(1), stage, subject, moment.ms);
        }
        let subject = match verdict {
            Verdict::Act(decided) => action(decided.index()),
            _ => goal,
        };
        add(step.max(1), Stage::Decision, subject, self.ms);
        let time_ms = (self.ms - begun) as f64;
        Ok(Decision { verdict, milestones, time_ms, questions: written, choices: Vec::new() })
    }
}
