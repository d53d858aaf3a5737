//! Asking a planner graph: one question, one decision, with the time of every milestone.

use std::fmt;
use std::ops::ControlFlow;
use std::sync::Arc;

use super::executive::{Phase, TRACE};
use super::graph::{PlannerSpec, PlanningGraph, PlanningPorts};
use super::views::{ModuleView, views};
use super::watch::{Choice, Watch};
use crate::neurons::PopulationPlan;
use crate::sim::{
    Graph, GraphBuilder, InputSpec, Out, OutputSpec, Pointer, Real, RunConfig, Seed, SimDuration,
    Simulator, StopReason, Synapse, Threads, Timebase, Vector, World, WorldError, WorldLink,
    WorldSave,
};
use crate::task::domain::{ActionId, Domain, Obstacle, StateId, Verdict, WorldState};
use crate::task::error::TaskError;
use crate::task::planner::encode::{Encoded, StateSpace};

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
    /// Choices among several causes of a state, in the order of time; a later one about the same state replaces
    /// an earlier one. Empty where every state has one cause at most.
    pub choices: Vec<Choice>,
}

/// A planner graph over one domain, built and ready to be asked.
///
/// ```
/// use symbolt::sim::Seed;
/// use symbolt::task::planner::{Planner, PlannerSpec};
/// use symbolt::task::{Verdict, learn, tasks::nuts_and_bolts::SyntheticDemonstrations};
///
/// let recording = SyntheticDemonstrations::default().record(Seed::new(1))?.recording;
/// let domain = learn::learn(&recording, &Default::default())?.domain;
/// let planner = Planner::new(&domain, PlannerSpec::default(), Seed::new(1))?;
///
/// let world = domain.world(["NUT_AT_START", "BOLT_AT_START"])?;
/// let decision = planner.decide(&world, domain.state("BOLT_AT_NUT_POCKET")?)?;
/// let Verdict::Act(action) = decision.verdict else { panic!("there is something to do") };
/// assert!(domain[action].name.starts_with("PUT_"));
/// # Ok::<(), symbolt::task::TaskError>(())
/// ```
pub struct Planner {
    pub(super) domain: Domain,
    encoded: Arc<Encoded>,
    graph: Arc<Graph>,
    spec: PlannerSpec,
    pub(super) trace: Out<Vector>,
    pub(super) actions: Out<Vector>,
    pub(super) watched: [Out<Vector>; 5],
    pub(super) recalled: Out<Vector>,
    pub(super) ruled_out: Option<Out<Vector>>,
    modules: Vec<ModuleView>,
    threads: Threads,
}

/// What worlds and goals have to be.
const OWN: &str = "one of the planner's own domain";

impl Planner {
    /// Builds the graph in direct mode with a tick of 1 ms.
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
        let PlanningPorts {
            ready,
            present,
            goal,
            actions,
            trace,
            watched,
            recalled,
            ruled_out,
            ..
        } = ports;
        builder.connect(&world.output("ready"), &ready, Synapse::None);
        builder.connect(&world.output("present"), &present, Synapse::None);
        builder.connect(&world.output("goal"), &goal, Synapse::None);
        builder.connect(&actions, &world.input("action"), Synapse::None);
        builder.connect(&trace, &world.input("trace"), Synapse::None);
        let graph = Arc::new(builder.build(Timebase::default(), plan, seed)?);
        let domain = domain.clone();
        Ok(Self {
            domain,
            encoded,
            graph,
            spec,
            trace,
            actions,
            watched,
            recalled,
            ruled_out,
            modules,
            threads: Threads::Pool,
        })
    }

    /// Sets who computes the ticks of this planner's own runs: [`simulator`](Self::simulator),
    /// [`decide`](Self::decide), [`plan`](Self::plan) and [`first_shown`](Self::first_shown). The answers have the
    /// same bits either way. [`Threads::Pool`] unless set; [`Threads::Serial`] suits a caller that asks many planners
    /// at once. Runs in a scene take [`EpisodeSpec::threads`](crate::task::execute::EpisodeSpec::threads) instead.
    pub fn with_threads(mut self, threads: Threads) -> Self {
        self.threads = threads;
        self
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

    /// The pointer of a goal.
    ///
    /// # Errors
    /// [`TaskError::Setting`] for a goal of another domain.
    pub(crate) fn goal_pointer(&self, goal: StateId) -> Result<Vec<Real>, TaskError> {
        let states = self.domain.states();
        let Some(state) = states.get(goal.index()) else {
            let value = format!("state {} of {}", goal.index(), states.len());
            return Err(TaskError::Setting { name: "goal", value, expected: OWN });
        };
        Ok(self.encoded.states.get(&state.name)?.to_vec())
    }

    /// A simulator of the graph in which `goal` is wanted in `world`, from its first tick.
    ///
    /// # Errors
    /// [`TaskError::Setting`] for a goal or a world of another domain.
    pub fn simulator(&self, world: &WorldState, goal: StateId) -> Result<Simulator, TaskError> {
        let states = self.domain.states().len();
        if world.states() != states {
            let value = format!("over {} states", world.states());
            return Err(TaskError::Setting { name: "world", value, expected: OWN });
        }
        let mut senses = vec![1.0];
        senses.extend(world.flags().iter().map(|holds| Real::from(*holds)));
        senses.extend(self.goal_pointer(goal)?);
        let board = Board {
            period: self.graph.timebase().tick(),
            senses,
            commands: self.domain.operators().len() + TRACE,
        };
        Ok(Simulator::new(
            self.graph.clone(),
            RunConfig::default().in_world(board).with_threads(self.threads),
        )?)
    }

    /// Asks what to do next towards `goal` in `world`.
    ///
    /// # Errors
    /// As [`Planner::simulator`]; [`TaskError::Undecided`] if the graph does not settle, which in direct
    /// mode happens only where the pointers are too few-dimensional to be told apart.
    pub fn decide(&self, world: &WorldState, goal: StateId) -> Result<Decision, TaskError> {
        let mut sim = self.simulator(world, goal)?;
        let mut watch = Watch::new(self, world);
        let looks = self.max_looks();
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
        Ok(Decision { verdict, milestones, time_ms, questions, choices: watch.choices })
    }

    /// The action that the motor output shows first, whether or not the planner is done with thinking, and the
    /// simulated milliseconds at which it does; `None` if it shows none for as long as `within`.
    ///
    /// ```
    /// use symbolt::sim::{Seed, SimDuration};
    /// use symbolt::task::DomainBuilder;
    /// use symbolt::task::planner::{Planner, PlannerSpec};
    ///
    /// let domain = DomainBuilder::of_the_paper().build()?;
    /// let planner = Planner::new(&domain, PlannerSpec::default(), Seed::new(1))?;
    /// let world = domain.world(["NUT_ON_TABLE", "BOLT_ON_TABLE"])?;
    /// let goal = domain.state("BOLT_ASSEMBLED")?;
    /// let shown = planner.first_shown(&world, goal, SimDuration::from_millis(400))?;
    /// let (action, _ms) = shown.expect("there is something to do");
    /// assert_eq!(domain[action].name, "PUT_NUT_IN_JIG");
    /// # Ok::<(), symbolt::task::TaskError>(())
    /// ```
    ///
    /// # Errors
    /// As [`Planner::simulator`].
    pub fn first_shown(
        &self,
        world: &WorldState,
        goal: StateId,
        within: SimDuration,
    ) -> Result<Option<(ActionId, f64)>, TaskError> {
        let mut sim = self.simulator(world, goal)?;
        let mut shown = None;
        sim.run_until(within, |view| {
            let action = view.value(&self.actions).iter().position(|active| *active > 0.5);
            shown = action.map(|action| (ActionId::new(action), view.time().as_millis_f64()));
            match shown {
                Some(_) => ControlFlow::Break(StopReason::Condition("an action")),
                None => ControlFlow::Continue(()),
            }
        })?;
        Ok(shown)
    }

    /// The most states that are looked at for one answer, counting second looks.
    fn max_looks(&self) -> u64 {
        let (states, actions) = (self.domain.states().len(), self.domain.operators().len());
        // Every state is looked at once for itself and once for each time that it asks for another.
        let once = 2 * states as u64 + 2;
        // An action ruled out costs a look, and whatever was ruled out can be let in with every state that comes
        // within reach.
        let again = self.ruled_out.as_ref().map_or(1, |_| states as u64 + 1);
        (once + self.ruled_out.as_ref().map_or(0, |_| 2 * actions as u64)) * again
    }

    fn state_name(&self, state: usize) -> String {
        self.domain.states().get(state).map_or_else(String::new, |s| s.name.clone())
    }

    /// The verdict that the graph's trace shows, if it has come to one; `action` is the active one.
    pub(crate) fn read(&self, trace: &[Real], action: Option<ActionId>) -> Option<Verdict> {
        let [state, second] = [trace[2], trace[3]].map(|v| StateId::new(v as usize));
        Some(match Phase::from_trace(trace[0]) {
            Phase::Met => Verdict::Met,
            Phase::NothingCauses => Verdict::Stuck(Obstacle::NothingCauses { state }),
            Phase::NeedsItself => Verdict::Stuck(Obstacle::NeedsItself { state }),
            Phase::MustBeAbsent => {
                let action = ActionId::new(trace[4] as usize);
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

    fn save(&self) -> Result<WorldSave, WorldError> {
        Ok(WorldSave(self.senses.iter().flat_map(|sense| sense.to_le_bytes()).collect()))
    }

    fn restore(&mut self, saved: &WorldSave) -> Result<(), WorldError> {
        if *saved == self.save()? {
            return Ok(());
        }
        let reason =
            "the save shows another world state or goal; expected the planner's own question";
        Err(WorldError::new(reason))
    }
}
