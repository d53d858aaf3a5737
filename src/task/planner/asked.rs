//! A run of the planner of goal sets that is told one situation after another, for whole plans.

use std::ops::ControlFlow;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::decider::{Decider, Request, Told};
use super::decision::{Decision, Milestone, Stage};
use super::goal_sets::GoalSetPlanner;
use crate::sim::{
    Real, RunConfig, Seed, SimDuration, Simulator, StopReason, World, WorldError, WorldSave,
};
use crate::task::domain::{ActionId, Obstacle, Verdict};
use crate::task::error::TaskError;
use crate::task::regression::{Step, Watch};

/// Time for which the motor is busy with an action of a plan that is rolled out.
const BUSY: SimDuration = SimDuration::from_millis(100);

/// A run of the graph that is told one situation after another.
pub(super) struct Asked<'p> {
    planner: &'p GoalSetPlanner,
    sim: Simulator,
    senses: Arc<Mutex<Vec<Real>>>,
    watch: Watch,
    ms: u64,
}

impl<'p> Asked<'p> {
    pub fn new(planner: &'p GoalSetPlanner) -> Result<Self, TaskError> {
        let senses = Arc::new(Mutex::new(vec![0.0; planner.sense_width()]));
        let (period, commands) = (planner.graph().timebase().tick(), planner.command_width());
        let board = Board { period, senses: senses.clone(), commands };
        let sim = Simulator::new(planner.graph().clone(), RunConfig::default().in_world(board))?;
        Ok(Self { planner, sim, senses, watch: Watch::default(), ms: 0 })
    }

    fn tell(&self, told: &Told<'_>) {
        let mut senses = self.senses.lock().unwrap_or_else(PoisonError::into_inner);
        self.planner.sense(told, &mut senses);
    }

    /// Lets the motor be busy for a while.
    pub fn wait(&mut self, told: &Told<'_>) -> Result<(), TaskError> {
        self.tell(&Told { request: Request::Wait, ..*told });
        self.run(BUSY, |_| None)?;
        Ok(())
    }

    /// Runs until `shown` returns a verdict for the commands, or for the whole span.
    fn run(
        &mut self,
        span: SimDuration,
        mut shown: impl FnMut(&[Real]) -> Option<Verdict>,
    ) -> Result<Option<Verdict>, TaskError> {
        let Self { planner, sim, watch, ms, .. } = self;
        let mut commands = vec![0.0; planner.command_width()];
        let mut verdict = None;
        sim.run_until(span, |view| {
            *ms += 1;
            let phases = view.value(&planner.outputs.phases);
            watch.look(*ms, phases, view.value(&planner.outputs.winner));
            let (actions, rest) = commands.split_at_mut(planner.domain().operators().len());
            actions.copy_from_slice(view.value(&planner.outputs.actions));
            rest.copy_from_slice(phases);
            verdict = shown(&commands);
            match verdict {
                Some(_) => ControlFlow::Break(StopReason::Condition("a decision")),
                None => ControlFlow::Continue(()),
            }
        })?;
        Ok(verdict)
    }

    /// Asks for a decision. Without one within the limit, there is no plan.
    pub fn decide(&mut self, told: &Told<'_>, limit: SimDuration) -> Result<Decision, TaskError> {
        self.tell(told);
        let (planner, begun, past) = (self.planner, self.ms, self.watch.moments.len());
        let mut last = (None, 0);
        let verdict = self.run(limit, |commands| {
            let verdict = planner.verdict(commands, told);
            last = (verdict, if verdict == last.0 { last.1 + 1 } else { 1 });
            verdict.filter(|verdict| last.1 >= planner.steady_ms(verdict))
        })?;
        let no_plan = Verdict::Stuck(Obstacle::NoPlan { state: told.goal });
        let verdict = verdict.unwrap_or(no_plan);
        let goal = match told.goals {
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
        for moment in &self.watch.moments[past..] {
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

/// A world that senses what it is told, and does nothing.
struct Board {
    period: SimDuration,
    senses: Arc<Mutex<Vec<Real>>>,
    commands: usize,
}

impl Board {
    fn told(&self) -> MutexGuard<'_, Vec<Real>> {
        self.senses.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl World for Board {
    fn period(&self) -> SimDuration {
        self.period
    }

    fn sense_width(&self) -> usize {
        self.told().len()
    }

    fn command_width(&self) -> usize {
        self.commands
    }

    fn sense(&self, out: &mut [Real]) {
        out.copy_from_slice(&self.told());
    }

    fn advance(&mut self, _command: &[Real]) -> Result<(), WorldError> {
        Ok(())
    }

    fn reset(&mut self, _seed: Seed) -> Result<(), WorldError> {
        Ok(())
    }

    fn save(&self) -> Result<WorldSave, WorldError> {
        Err(WorldError::new("a plan that is rolled out cannot be saved"))
    }

    fn restore(&mut self, _saved: &WorldSave) -> Result<(), WorldError> {
        Err(WorldError::new("a plan that is rolled out cannot be restored"))
    }
}
