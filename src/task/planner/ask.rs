//! Asking a planner graph: one question, one decision, with the time of every milestone.

use std::fmt;
use std::ops::ControlFlow;
use std::sync::Arc;

use super::executive::{Phase, TRACE};
use super::graph::{PlannerSpec, PlanningGraph, PlanningPorts};
use super::views::{ModuleView, views};
use crate::neurons::PopulationPlan;
use crate::sim::{
    Graph, GraphBuilder, InputSpec, Out, OutputSpec, Pointer, Real, RunConfig, Seed, SimDuration,
    SimView, Simulator, StopReason, Synapse, Timebase, Vector, World, WorldError, WorldLink,
    WorldSave,
};
use crate::task::domain::Domain;
use crate::task::domain::{Obstacle, Outlook};
use crate::task::error::TaskError;
use crate::task::planner::encode::{Encoded, StateSpace};

/// What a planner answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Do this action next; its place in the domain.
    Act(usize),
    /// The goal holds already.
    Met,
    /// The goal cannot be had, and why.
    Stuck(Obstacle),
}

impl Verdict {
    /// Whether it is among the right answers.
    pub fn accepted_by(&self, right: &Outlook) -> bool {
        match self {
            Self::Met => right.met,
            Self::Act(action) => !right.met && right.actions.contains(action),
            Self::Stuck(why) => !right.met && right.obstacles.contains(why),
        }
    }
}

/// A step on the way to a decision.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Stage {
    /// The goal buffer holds the state in question.
    Goal,
    /// The action that causes it is recalled.
    Action,
    /// The action's preconditions are unbound and cleaned up.
    Preconditions,
    /// They are compared with the world, and one that is open is chosen.
    Comparison,
    /// The executive has drawn its conclusion about this state.
    Conclusion,
    /// The decision stands at the graph's outputs.
    Decision,
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Goal => "goal",
            Self::Action => "action",
            Self::Preconditions => "preconditions",
            Self::Comparison => "comparison",
            Self::Conclusion => "conclusion",
            Self::Decision => "decision",
        })
    }
}

/// When a step was reached: when the last item concerned took on the activity that the conclusion was
/// drawn from.
#[derive(Debug, Clone, PartialEq)]
pub struct Milestone {
    /// The how-manieth state the planner was looking at, from 1.
    pub question: u32,
    /// What was reached.
    pub stage: Stage,
    /// The name of the state in question.
    pub subject: String,
    /// Simulated milliseconds since the question was put.
    pub time_ms: f64,
}

/// A planner's answer.
#[derive(Debug, Clone, PartialEq)]
pub struct Decision {
    /// The answer.
    pub verdict: Verdict,
    /// The steps to it, in the order of time.
    pub milestones: Vec<Milestone>,
    /// Simulated milliseconds from question to answer.
    pub time_ms: f64,
    /// How many states were looked at, counting a second look.
    pub questions: u32,
}

/// A planner graph over one domain, built and ready to be asked.
///
/// ```
/// use symbolt::sim::Seed;
/// use symbolt::task::planner::{Planner, PlannerSpec, Verdict};
/// use symbolt::task::{learn, tasks::nuts_and_bolts::SyntheticDemonstrations};
///
/// let recording = SyntheticDemonstrations::default().record(Seed::new(1))?.recording;
/// let domain = learn::learn(&recording, &Default::default())?.domain;
/// let planner = Planner::new(&domain, PlannerSpec::default(), Seed::new(1))?;
///
/// let world = domain.world(["NUT_AT_START", "BOLT_AT_START"])?;
/// let decision = planner.decide(&world, "BOLT_AT_NUT_POCKET")?;
/// let Verdict::Act(action) = decision.verdict else { panic!("there is something to do") };
/// assert!(domain.operators()[action].name.starts_with("PUT_"));
/// # Ok::<(), symbolt::task::TaskError>(())
/// ```
pub struct Planner {
    domain: Domain,
    encoded: Arc<Encoded>,
    graph: Arc<Graph>,
    spec: PlannerSpec,
    trace: Out<Vector>,
    actions: Out<Vector>,
    watched: [Out<Vector>; 5],
    modules: Vec<ModuleView>,
}

impl Planner {
    /// Builds the graph in exact maths with a tick of 1 ms.
    ///
    /// # Errors
    /// If the domain has no action, the dimension cannot be used or is too small for the
    /// similarity ceiling, or the executive's waits make no sense.
    pub fn new(domain: &Domain, spec: PlannerSpec, seed: Seed) -> Result<Self, TaskError> {
        Self::with_plan(domain, spec, &PopulationPlan::direct(), seed)
    }

    /// Builds the graph with the populations of `plan`.
    ///
    /// # Errors
    /// As [`Planner::new`], and if the plan names layers that the graph does not have.
    pub fn with_plan(
        domain: &Domain,
        spec: PlannerSpec,
        plan: &PopulationPlan,
        seed: Seed,
    ) -> Result<Self, TaskError> {
        let encoded = Arc::new(Encoded::new(domain, spec.dimensions, spec.max_similarity, seed)?);
        let (states, actions) = (domain.states().len(), domain.operators().len());
        let mut builder = GraphBuilder::new();
        let space = encoded.states.space();
        let world = builder.world(
            "world",
            WorldLink::new()
                .sense("ready", OutputSpec::scalar())
                .sense("present", OutputSpec::vector(states))
                .sense("goal", OutputSpec::<Pointer<StateSpace>>::pointer(space))
                .command("action", InputSpec::vector(actions))
                .command("trace", InputSpec::vector(TRACE)),
        );
        let planning = PlanningGraph::new(domain, encoded.clone(), spec)?;
        let ports = builder.add("planner", planning);
        let modules = views(domain, &encoded, &ports)?;
        let PlanningPorts { ready, present, goal, actions, trace, watched, .. } = ports;
        builder.connect(&world.output("ready"), &ready, Synapse::None);
        builder.connect(&world.output("present"), &present, Synapse::None);
        builder.connect(&world.output("goal"), &goal, Synapse::None);
        builder.connect(&actions, &world.input("action"), Synapse::None);
        builder.connect(&trace, &world.input("trace"), Synapse::None);
        let graph = Arc::new(builder.build(Timebase::default(), plan, seed)?);
        let domain = domain.clone();
        Ok(Self { domain, encoded, graph, spec, trace, actions, watched, modules })
    }

    /// The domain.
    pub fn domain(&self) -> &Domain {
        &self.domain
    }

    /// The pointers.
    pub fn encoded(&self) -> &Encoded {
        &self.encoded
    }

    /// The built graph, for pictures and for running it otherwise.
    pub fn graph(&self) -> &Arc<Graph> {
        &self.graph
    }

    /// The graph's modules on the way of a decision, to be looked at while it runs.
    pub fn modules(&self) -> &[ModuleView] {
        &self.modules
    }

    /// How the graph was made.
    pub fn spec(&self) -> &PlannerSpec {
        &self.spec
    }

    /// A simulator of the graph in which `goal` is wanted while the states flagged in `world`
    /// hold, from its first tick.
    ///
    /// # Errors
    /// [`TaskError::Unknown`] for a goal that is no state, [`TaskError::Setting`] for a world that has
    /// not one flag a state.
    pub fn simulator(&self, world: &[bool], goal: &str) -> Result<Simulator, TaskError> {
        let states = self.domain.states().len();
        self.domain.state_index(goal)?;
        if world.len() != states {
            let value = format!("{} flags", world.len());
            let expected = "one flag for each state of the domain";
            return Err(TaskError::Setting { name: "world", value, expected });
        }
        let mut senses = vec![1.0];
        senses.extend(world.iter().map(|p| Real::from(*p)));
        senses.extend_from_slice(&self.encoded.states.get(goal)?);
        let board = Board {
            period: self.graph.timebase().tick(),
            senses,
            commands: self.domain.operators().len() + TRACE,
        };
        Ok(Simulator::new(self.graph.clone(), RunConfig::default().in_world(board))?)
    }

    /// Asks what to do next towards `goal` when the states flagged in `world` hold.
    ///
    /// # Errors
    /// As [`Planner::simulator`]; [`TaskError::Undecided`] if the graph does not settle, which in exact
    /// maths happens only where the pointers are too few-dimensional to be told apart.
    pub fn decide(&self, world: &[bool], goal: &str) -> Result<Decision, TaskError> {
        let mut sim = self.simulator(world, goal)?;
        let mut watch = Watch::new(self);
        // Every state is looked at once for itself and once for each time that it asks for another.
        let looks = 2 * self.domain.states().len() as u64 + 2;
        let limit = SimDuration::from_micros(3 * looks * self.spec.timing.patience.as_micros());
        let report = sim.run_until(limit, |view| watch.look(&view))?;
        let time_ms = report.span.as_millis_f64();
        let trace = sim.value(&self.trace);
        let subject = trace[2] as usize;
        let Some(verdict) = self.read(trace, watch.action) else {
            let phase = match Phase::from_trace(trace[0]) {
                last @ (Phase::Act | Phase::MustBeAbsent) => last,
                _ => watch.last_phase,
            };
            return Err(self.undecided(time_ms, phase, subject));
        };
        let questions = trace[1] as u32;
        watch.note(questions, Stage::Decision, subject, time_ms);
        let milestones = watch
            .milestones
            .into_iter()
            .map(|(question, stage, subject, time_ms)| Milestone {
                question,
                stage,
                subject: self.state_name(subject),
                time_ms,
            })
            .collect();
        Ok(Decision { verdict, milestones, time_ms, questions })
    }

    /// The action that the motor output shows first, whether or not the planner is done with thinking, and the
    /// simulated milliseconds at which it does; `None` if it shows none for as long as `within`.
    ///
    /// ```
    /// use symbolt::sim::{Seed, SimDuration};
    /// use symbolt::task::SymbolicDomain;
    /// use symbolt::task::planner::{Planner, PlannerSpec};
    ///
    /// let domain = SymbolicDomain::of_the_paper().build()?;
    /// let planner = Planner::new(&domain, PlannerSpec::default(), Seed::new(1))?;
    /// let world = domain.world(["NUT_ON_TABLE", "BOLT_ON_TABLE"])?;
    /// let shown = planner.first_shown(&world, "BOLT_ASSEMBLED", SimDuration::from_millis(400))?;
    /// let (action, _ms) = shown.expect("there is something to do");
    /// assert_eq!(domain.operators()[action].name, "PUT_NUT_IN_JIG");
    /// # Ok::<(), symbolt::task::TaskError>(())
    /// ```
    ///
    /// # Errors
    /// As [`Planner::simulator`].
    pub fn first_shown(
        &self,
        world: &[bool],
        goal: &str,
        within: SimDuration,
    ) -> Result<Option<(usize, f64)>, TaskError> {
        let mut sim = self.simulator(world, goal)?;
        let mut shown = None;
        sim.run_until(within, |view| {
            let action = view.value(&self.actions).iter().position(|active| *active > 0.5);
            shown = action.map(|action| (action, view.time().as_millis_f64()));
            match shown {
                Some(_) => ControlFlow::Break(StopReason::Condition("an action")),
                None => ControlFlow::Continue(()),
            }
        })?;
        Ok(shown)
    }

    fn state_name(&self, state: usize) -> String {
        self.domain.states().get(state).map_or_else(String::new, |s| s.name.clone())
    }

    /// The verdict that the graph's trace shows, if it has come to one; `action` is the active one.
    pub(crate) fn read(&self, trace: &[Real], action: Option<usize>) -> Option<Verdict> {
        let (subject, second) = (trace[2] as usize, trace[3] as usize);
        Some(match Phase::from_trace(trace[0]) {
            Phase::Met => Verdict::Met,
            Phase::NothingCauses => Verdict::Stuck(Obstacle::NothingCauses { state: subject }),
            Phase::NeedsItself => Verdict::Stuck(Obstacle::NeedsItself { state: subject }),
            Phase::MustBeAbsent => {
                let action = self.domain.cause(subject)?;
                Verdict::Stuck(Obstacle::MustBeAbsent { action, state: second })
            }
            Phase::Act => Verdict::Act(action?),
            _ => return None,
        })
    }

    fn undecided(&self, limit_ms: f64, phase: Phase, subject: usize) -> TaskError {
        let subject = self.state_name(subject);
        let doing = match phase {
            Phase::Idle => "recognising the goal".into(),
            Phase::Load => format!("loading {subject} into the goal buffer"),
            Phase::Act => format!("letting out the action that causes {subject}"),
            _ => format!("looking for what {subject} needs"),
        };
        TaskError::Undecided { limit_ms, doing }
    }
}

/// Notes when the graph's items last changed while a state is in question.
struct Watch<'p> {
    planner: &'p Planner,
    active: Vec<Vec<bool>>,
    changed_ms: [f64; 5],
    asked: (u32, usize),
    last_phase: Phase,
    milestones: Vec<(u32, Stage, usize, f64)>,
    action: Option<usize>,
}

impl<'p> Watch<'p> {
    fn new(planner: &'p Planner) -> Self {
        Self {
            planner,
            active: vec![Vec::new(); 5],
            changed_ms: [0.0; 5],
            asked: (0, 0),
            last_phase: Phase::Idle,
            milestones: Vec::new(),
            action: None,
        }
    }

    fn note(&mut self, question: u32, stage: Stage, subject: usize, time_ms: f64) {
        self.milestones.push((question, stage, subject, time_ms));
    }

    fn look(&mut self, view: &SimView<'_>) -> ControlFlow<StopReason> {
        let now = view.time().as_millis_f64();
        for (index, output) in self.planner.watched.iter().enumerate() {
            let values = view.value(output);
            let was = &mut self.active[index];
            was.resize(values.len(), false);
            for (flag, value) in was.iter_mut().zip(values) {
                if *flag != (*value > 0.5) {
                    *flag = !*flag;
                    self.changed_ms[index] = now;
                }
            }
        }
        let trace = view.value(&self.planner.trace);
        let (phase, question, subject) =
            (Phase::from_trace(trace[0]), trace[1] as u32, trace[2] as usize);
        if self.last_phase == Phase::Settle && phase != Phase::Settle && phase != Phase::Lost {
            let (asked, about) = self.asked;
            let stages = [Stage::Goal, Stage::Action, Stage::Preconditions, Stage::Comparison];
            let mut reached: Vec<(Stage, f64)> = Vec::new();
            for (at, stage) in stages.into_iter().enumerate() {
                // The comparison is done when the choice is; without an open state, when that shows.
                let time = if at == 3 {
                    self.changed_ms[3].max(self.changed_ms[4])
                } else {
                    self.changed_ms[at]
                };
                let any = self.active[at].iter().any(|a| *a) || at == 3;
                let after = reached.last().map_or(0.0, |(_, t)| *t);
                if any && !(at == 3 && phase == Phase::NothingCauses) {
                    reached.push((stage, time.max(after)));
                }
            }
            for (stage, time) in reached {
                self.note(asked, stage, about, time);
            }
            self.note(asked, Stage::Conclusion, about, now);
        }
        if phase != Phase::Lost {
            self.last_phase = phase;
            self.asked = (question, subject);
        }
        if phase.is_final() {
            let actions = view.value(&self.planner.actions);
            self.action = actions.iter().position(|a| *a > 0.5);
            if phase != Phase::Act || self.action.is_some() {
                return ControlFlow::Break(StopReason::Condition("decided"));
            }
        }
        ControlFlow::Continue(())
    }
}

/// A world that shows the same thing for ever.
struct Board {
    period: SimDuration,
    senses: Vec<Real>,
    commands: usize,
}

impl World for Board {
    fn period(&self) -> SimDuration {
        self.period
    }

    fn sense_width(&self) -> usize {
        self.senses.len()
    }

    fn command_width(&self) -> usize {
        self.commands
    }

    fn sense(&self, out: &mut [Real]) {
        out.copy_from_slice(&self.senses);
    }

    fn advance(&mut self, _command: &[Real]) -> Result<(), WorldError> {
        Ok(())
    }

    fn reset(&mut self, _seed: Seed) -> Result<(), WorldError> {
        Ok(())
    }

    fn save(&self) -> WorldSave {
        WorldSave(Vec::new())
    }

    fn restore(&mut self, _saved: &WorldSave) -> Result<(), WorldError> {
        Ok(())
    }
}
