//! Asks a planner graph for a decision and records the time of every milestone.

use std::ops::ControlFlow;
use std::sync::Arc;

use super::encode::{Encoded, MOST_DIMENSIONS, StateSpace};
use super::executive::TRACE;
use super::graph::{PlannerSpec, PlanningGraph, PlanningPorts};
use super::views::{ModuleView, views};
use super::walk::Phase;
use super::watch::Watch;
use crate::neurons::PopulationPlan;
use crate::sim::{
    Graph, GraphBuilder, InputSpec, OutputSpec, Pointer, Real, RunConfig, Seed, SimDuration,
    Simulator, StopReason, Synapse, Threads, Timebase, WorldLink,
};
use crate::task::error::TaskError;
use crate::task::planner::board::Board;
use crate::task::planner::decider::{Decider, PlannerInput, Request};
use crate::task::planner::decision::{Decision, Milestone, Stage};
use crate::task::planner::rollout::{Counts, LIMIT, Prediction, RolledOut, roll_out};
use crate::task::propositional::{
    ActionId, Composition, Domain, Obstacle, StateId, Verdict, WorldState,
};

/// A planner graph over one domain, built and ready to be asked.
///
/// ```
/// use symbolt::sim::Seed;
/// use symbolt::task::planner::{Planner, PlannerSpec};
/// use symbolt::task::{DomainBuilder, Verdict};
///
/// let domain = DomainBuilder::of_the_paper().build()?;
/// let planner = Planner::new(&domain, PlannerSpec::default(), Seed::new(1))?;
///
/// let world = domain.world(["NUT_ON_TABLE", "BOLT_ON_TABLE"])?;
/// let decision = planner.decide(&world, domain.state("BOLT_ASSEMBLED")?)?;
/// let Verdict::Act(action) = decision.verdict else { panic!("there is something to do") };
/// assert!(domain[action].name.starts_with("PUT_"));
/// # Ok::<(), symbolt::task::TaskError>(())
/// ```
pub struct Planner {
    domain: Domain,
    encoded: Arc<Encoded>,
    graph: Arc<Graph>,
    spec: PlannerSpec,
    ports: PlanningPorts,
    modules: Vec<ModuleView>,
    threads: Threads,
}

impl Planner {
    /// Builds the graph in direct mode with a tick of 1 ms.
    ///
    /// # Errors
    /// [`TaskError::BadDomain`] if the domain has no action; [`TaskError::Vocabulary`] or
    /// [`TaskError::TooFewDimensions`] if the number of dimensions is invalid or too small; [`TaskError::Setting`] or
    /// [`TaskError::Build`] for settings outside their ranges.
    pub fn new(domain: &Domain, spec: PlannerSpec, seed: Seed) -> Result<Self, TaskError> {
        Self::with_plan(domain, spec, &PopulationPlan::direct(), seed)
    }

    /// Builds the graph with the populations of `plan`, with a tick of 1 ms.
    ///
    /// # Errors
    /// As [`Planner::new`]; [`TaskError::Build`] also if the plan names layers that the graph does not have.
    pub fn with_plan(
        domain: &Domain,
        spec: PlannerSpec,
        plan: &PopulationPlan,
        seed: Seed,
    ) -> Result<Self, TaskError> {
        let encoded = Arc::new(Encoded::new(domain, spec.dimensions, spec.max_similarity, seed)?);
        Self::with_pointers(domain, encoded, spec, plan, seed)
    }

    /// Builds the graph over a ground problem. The pointers are built from roles bound to identities
    /// ([`Encoded::composed`]). The number of dimensions is at least `spec.dimensions`, and more if the capacity of the
    /// memories demands it ([`Encoded::dimensions_for`]).
    ///
    /// # Errors
    /// As [`Planner::with_plan`]; [`TaskError::TooFewDimensions`] if 8192 dimensions are too few.
    pub fn composed(
        domain: &Domain,
        composition: &Composition,
        spec: PlannerSpec,
        plan: &PopulationPlan,
        seed: Seed,
    ) -> Result<Self, TaskError> {
        let mut dimensions = Encoded::dimensions_for(domain, spec.dimensions);
        loop {
            let spec = PlannerSpec { dimensions, ..spec };
            let built = Encoded::composed(domain, composition, dimensions, seed)
                .and_then(|e| Self::with_pointers(domain, Arc::new(e), spec, plan, seed));
            match built {
                Err(TaskError::TooFewDimensions { .. }) if dimensions < MOST_DIMENSIONS => {
                    dimensions *= 2;
                }
                other => return other,
            }
        }
    }

    fn with_pointers(
        domain: &Domain,
        encoded: Arc<Encoded>,
        spec: PlannerSpec,
        plan: &PopulationPlan,
        seed: Seed,
    ) -> Result<Self, TaskError> {
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
        builder.connect(&world.output("ready"), &ports.ready, Synapse::None);
        builder.connect(&world.output("present"), &ports.present, Synapse::None);
        builder.connect(&world.output("goal"), &ports.goal, Synapse::None);
        builder.connect(&ports.actions, &world.input("action"), Synapse::None);
        builder.connect(&ports.trace, &world.input("trace"), Synapse::None);
        builder.describe(
            "world",
            "robot and scene",
            "Tells the planner what holds, and takes the action to do.",
        );
        let graph = Arc::new(builder.build(Timebase::default(), plan, seed)?);
        let modules = views(domain, &encoded, &ports, &graph)?;
        let (domain, threads) = (domain.clone(), Threads::Auto);
        Ok(Self { domain, encoded, graph, spec, ports, modules, threads })
    }

    /// Sets the threads that compute the ticks of this planner's own runs: [`simulator`](Self::simulator),
    /// [`decide`](Self::decide), [`plan`](Self::plan) and [`first_shown`](Self::first_shown). The default is
    /// [`Threads::Auto`]. [`Threads::Serial`] suits a caller that asks many planners at once. The results have the same
    /// bits either way. Runs in a scene use [`EpisodeSpec::threads`](crate::task::execute::EpisodeSpec::threads)
    /// instead.
    pub fn with_threads(mut self, threads: Threads) -> Self {
        self.threads = threads;
        self
    }

    /// Returns the vocabularies of states and actions.
    pub fn encoded(&self) -> &Encoded {
        &self.encoded
    }

    /// Returns the specification that the graph was built from.
    pub fn spec(&self) -> &PlannerSpec {
        &self.spec
    }

    /// Returns a simulator that asks for `goal` in `world` from its first tick.
    ///
    /// # Errors
    /// [`TaskError::Setting`] for a goal or a world of another domain.
    pub fn simulator(&self, world: &WorldState, goal: StateId) -> Result<Simulator, TaskError> {
        self.check_world(world)?;
        self.check_goal(goal)?;
        let board = Board::new(self);
        let request = Request::Decide;
        board.write(
            self,
            &PlannerInput { request, present: world, pretended: &[], goal, goals: &[goal] },
        );
        Ok(Simulator::new(
            self.graph.clone(),
            RunConfig::default().in_world(board).with_threads(self.threads),
        )?)
    }

    /// Decides the next action towards `goal` in `world`.
    ///
    /// # Errors
    /// As [`Planner::simulator`]; [`TaskError::Undecided`] if the graph does not settle. In direct mode this happens
    /// only if the pointers have too few dimensions to be distinguished.
    pub fn decide(&self, world: &WorldState, goal: StateId) -> Result<Decision, TaskError> {
        let mut sim = self.simulator(world, goal)?;
        let mut watch = Watch::new(&self.domain, &self.ports, world);
        let looks = self.max_looks();
        let limit = SimDuration::from_micros(3 * looks * self.spec.timing.patience.as_micros());
        let report = sim.run_until(limit, |view| watch.look(&view))?;
        let time_ms = report.span.as_millis_f64();
        let trace = sim.value(&self.ports.trace);
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

    /// Returns the first action that the motor output shows, and the simulated time at which it appears, in
    /// milliseconds; `None` if no action appears within the time `within`. The action counts even if the planner has
    /// not decided yet.
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
            let action = view.value(&self.ports.actions).iter().position(|active| *active > 0.5);
            shown = action.map(|action| (ActionId::new(action), view.time().as_millis_f64()));
            match shown {
                Some(_) => ControlFlow::Break(StopReason::Condition("an action")),
                None => ControlFlow::Continue(()),
            }
        })?;
        Ok(shown)
    }

    /// Plans from a scene to `goal`. `objects` gives the number of objects in each state, as
    /// [`Domain::counts`](crate::task::propositional::Domain::counts) returns it; [`Counts`] predicts what actions do.
    ///
    /// # Errors
    /// As [`Planner::decide`].
    pub fn plan(&self, objects: &[usize], goal: StateId) -> Result<RolledOut, TaskError> {
        self.roll_out(&mut Counts::new(&self.domain, objects, goal), LIMIT)
    }

    /// Returns the greatest possible number of questions in one decision.
    fn max_looks(&self) -> u64 {
        let (states, actions) = (self.domain.states().len(), self.domain.operators().len());
        // Every state is examined when the walk reaches it, and again when the walk returns to it from another state.
        // Each state is returned from at most once.
        let once = 2 * states as u64 + 2;
        // Ruling out an action costs a question. Every state found reachable can readmit the actions that are ruled out
        // for now.
        let again = self.ports.ruled_out.as_ref().map_or(1, |_| states as u64 + 1);
        (once + self.ports.ruled_out.as_ref().map_or(0, |_| 2 * actions as u64)) * again
    }

    fn state_name(&self, state: usize) -> String {
        self.domain.states().get(state).map_or_else(String::new, |s| s.name.clone())
    }

    /// Returns the verdict that the graph's trace shows, if there is one yet. `action` is the active action.
    fn read(&self, trace: &[Real], action: Option<ActionId>) -> Option<Verdict> {
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
            Phase::Act => {
                format!("opening the motor gate for the action that causes {subject}")
            }
            _ => format!("examining the preconditions of {subject}"),
        };
        TaskError::Undecided { limit_ms, doing }
    }
}

impl Decider for Planner {
    fn domain(&self) -> &Domain {
        &self.domain
    }

    fn graph(&self) -> &Arc<Graph> {
        &self.graph
    }

    fn modules(&self) -> &[ModuleView] {
        &self.modules
    }

    fn sense_width(&self) -> usize {
        1 + self.domain.states().len() + self.spec.dimensions
    }

    fn command_width(&self) -> usize {
        self.domain.operators().len() + TRACE
    }

    /// Writes whether to decide, the states that hold, and the goal's pointer.
    fn sense(&self, input: &PlannerInput<'_>, out: &mut [Real]) {
        let states = self.domain.states();
        let (flags, pointer) = out.split_at_mut(1 + states.len());
        flags[0] = Real::from(u8::from(input.request == Request::Decide));
        for (state, flag) in flags[1..].iter_mut().enumerate() {
            *flag = Real::from(u8::from(input.holds(StateId::new(state))));
        }
        // The vocabulary has a pointer for every state.
        let name = states.get(input.goal.index()).map_or("", |state| &state.name);
        match self.encoded.states.get(name) {
            Ok(goal) => pointer.copy_from_slice(&goal),
            Err(_) => pointer.fill(0.0),
        }
    }

    fn verdict(&self, command: &[Real], _input: &PlannerInput<'_>) -> Option<Verdict> {
        let (actions, trace) = command.split_at(self.domain.operators().len());
        self.read(trace, actions.iter().position(|a| *a > 0.5).map(ActionId::new))
    }

    /// Asks for one goal after the other, each time with a new run of the graph. The graph has its own limit.
    fn roll_out(
        &self,
        prediction: &mut dyn Prediction,
        _limit: SimDuration,
    ) -> Result<RolledOut, TaskError> {
        roll_out(prediction, |present, goal| self.decide(present, goal))
    }
}
