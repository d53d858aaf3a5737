//! The planner of goal sets over a domain, in place of the chain of questions.

pub(super) mod run;
use std::collections::BTreeSet;
use std::sync::Arc;

use super::chain::views::ModuleView;
use super::decider::{Decider, PlannerInput, Request};
use super::rollout::{Prediction, RolledOut, roll_out};
use crate::neurons::PopulationPlan;
use crate::plan::goal_sets::{
    GoalSetGraph, GoalSetPorts, Mutexes, Regression, check_units, phase_names,
};
use crate::plan::strips::{Fact, Fluent, GroundOperator, Grounded, Number};
use crate::sim::{
    Graph, GraphBuilder, InputSpec, OutputSpec, Real, Seed, SimDuration, Synapse, Timebase, Vector,
    WorldLink,
};
use crate::task::error::TaskError;
use crate::task::propositional::{
    ActionId, Domain, Obstacle, Rules, StateId, Verdict, WorldState, obstacles,
};
use run::GoalSetRun;

/// Fewest and most goal sets that the planner remembers.
const SLOTS: [usize; 2] = [6, 48];
/// Time for which an action must be shown before it counts. A goal that holds since the last look hides its action sooner.
const STEADY_MS: u64 = 20;
/// Time for which the planner must find no way before that counts. Until the costs have followed a change of the world, it
/// may still show what was true before.
const STUCK_MS: u64 = 200;

/// Time after which a search counts as one that finds nothing.
const PATIENCE_MS: u64 = 10_000;

/// A planner of goal sets ([`GoalSetGraph`]) over a domain, with every decision made by neurons.
///
/// It plans once and keeps the plan while the robot acts. Each further action takes about 100 simulated ms; a surprise
/// begins a new plan, and so does a goal that counts objects and needs another one. Why a goal is out of reach is not
/// found by neurons. States that a learned operator removes are its deletes.
///
/// ```
/// use symbolt::neurons::PopulationPlan;
/// use symbolt::sim::Seed;
/// use symbolt::task::planner::{Decider, GoalSetPlanner};
/// use symbolt::task::{DomainBuilder, Rules};
///
/// let domain = DomainBuilder::of_the_paper().build()?;
/// let direct = PopulationPlan::direct();
/// let planner = GoalSetPlanner::new(&domain, Rules::default(), &[], &direct, Seed::new(1))?;
/// assert_eq!(planner.command_width(), domain.operators().len() + 16);
/// # Ok::<(), symbolt::task::TaskError>(())
/// ```
pub struct GoalSetPlanner {
    domain: Domain,
    rules: Rules,
    /// State of each fluent, and whether the fluent holds when the state does.
    fluents: Vec<(StateId, bool)>,
    graph: Arc<Graph>,
    ports: GoalSetPorts,
    modules: Vec<ModuleView>,
    phases: usize,
    met: usize,
    stuck: usize,
}

impl GoalSetPlanner {
    /// Builds the graph, with a tick of 1 ms. Only [`Rules::absent`] has an effect. `exclusions` are pairs of states that
    /// never hold together, whatever surprises there are; they spare the planner dead ends. Pairs that only cannot be
    /// reached from some start do not belong here: after a surprise the planner would find no way.
    ///
    /// [`populations`](crate::plan::goal_sets::populations) returns the plan that suits its units.
    ///
    /// # Errors
    /// [`TaskError::BadDomain`] if the domain has no action; [`TaskError::GoalSets`] if the graph would have more than
    /// [`MAX_UNITS`](crate::plan::goal_sets::MAX_UNITS) units; [`TaskError::Build`] if the plan names layers that the graph
    /// does not have.
    ///
    /// # Panics
    /// If `exclusions` has states of another domain.
    pub fn new(
        domain: &Domain,
        rules: Rules,
        exclusions: &[[StateId; 2]],
        plan: &PopulationPlan,
        seed: Seed,
    ) -> Result<Self, TaskError> {
        if domain.operators().is_empty() {
            return Err(TaskError::BadDomain { reason: "the domain has no action".into() });
        }
        let (problem, sensed) = grounded(domain, rules);
        let (fluents, operators) = (problem.fluents.len(), problem.operators.len());
        let [least, most] = SLOTS;
        let slots = (2 * operators + 2).clamp(least, most);
        check_units(&problem, slots)?;
        // A state and its absence exclude each other as well.
        let absences = sensed.iter().enumerate().filter(|(_, (_, holds))| !holds);
        let absences = absences.map(|(fluent, (state, _))| [state.index(), fluent]);
        let pairs = exclusions.iter().map(|pair| pair.map(StateId::index)).chain(absences);
        let regression = Regression::with_mutexes(&problem, Mutexes::of(fluents, pairs));
        let mut builder = GraphBuilder::new();
        let phases = phase_names();
        let link = WorldLink::new()
            .sense("ready", OutputSpec::vector(1))
            .sense("busy", OutputSpec::vector(1))
            .sense("holds", OutputSpec::vector(fluents))
            .sense("goal", OutputSpec::vector(fluents))
            .command("actions", InputSpec::vector(operators))
            .command("phases", InputSpec::vector(phases.len()));
        let world = builder.world("world", link);
        let ports = builder.add("planner", GoalSetGraph::new(regression.into(), slots));
        for (sense, input) in [
            ("ready", &ports.ready),
            ("busy", &ports.busy),
            ("holds", &ports.holds),
            ("goal", &ports.goal),
        ] {
            builder.connect(&world.output::<Vector>(sense), input, Synapse::None);
        }
        for (output, command) in [(&ports.actions, "actions"), (&ports.phases, "phases")] {
            builder.connect(output, &world.input::<Vector>(command), Synapse::None);
        }
        builder.describe("planner", "planner", "Searches from the goal, through goal sets.");
        builder.describe(
            "world",
            "robot and scene",
            "Tells the planner what holds, and takes the action to do.",
        );
        let graph = Arc::new(builder.build(Timebase::default(), plan, seed)?);
        let states = sensed.iter().map(|(state, holds)| match holds {
            true => domain[*state].name.clone(),
            false => format!("not {}", domain[*state].name),
        });
        let states: Vec<String> = states.collect();
        let actions: Vec<String> = domain.operators().iter().map(|o| o.name.clone()).collect();
        let numbers: Vec<String> = (1..=slots).map(|slot| slot.to_string()).collect();
        let modules = vec![
            ModuleView::items(&graph, "phase", &ports.phases, &phases),
            ModuleView::items(&graph, "goal_set", &ports.goals, &states),
            ModuleView::rows(&graph, "cost", &ports.costs, &states),
            ModuleView::items(&graph, "utility", &ports.utilities, &actions),
            ModuleView::items(&graph, "winner", &ports.winner, &actions),
            ModuleView::items(&graph, "slot", &ports.slot, &numbers),
            ModuleView::items(&graph, "motor", &ports.actions, &actions),
        ];
        let place = |name: &str| phases.iter().position(|p| p == name).unwrap_or(usize::MAX);
        let (met, stuck) = (place("Done"), place("Stuck"));
        let (domain, phases) = (domain.clone(), phases.len());
        Ok(Self { domain, rules, fluents: sensed, graph, ports, modules, phases, met, stuck })
    }

    /// Returns the reason why the goals cannot be reached, as the symbolic planner finds it: that of the first goal that is
    /// out of reach by itself.
    fn obstacle(&self, input: &PlannerInput<'_>) -> Obstacle {
        let states = 0..self.domain.states().len();
        let world: WorldState = states.map(|s| input.holds(StateId::new(s))).collect();
        let of = |goal: &StateId| obstacles(&self.domain, &world, *goal, self.rules).pop_first();
        let first = input.goals.iter().find_map(of);
        first.unwrap_or(Obstacle::NoPlan { state: input.goal })
    }
}

/// Returns the problem of reaching goals from a situation in a domain, for [`pursue`](crate::plan::goal_sets::pursue).
///
/// There is one fluent for each state of the domain, in its order, and behind them one for each state that must be absent
/// under [`Rules::absent`].
///
/// # Panics
/// If `world` does not have as many states as `domain`.
pub fn strips_problem(
    domain: &Domain,
    rules: Rules,
    world: &WorldState,
    goals: &[StateId],
) -> Grounded {
    let (mut problem, meant) = grounded(domain, rules);
    problem.start = holding(&meant, world);
    problem.goal = goals.iter().map(|goal| goal.index()).collect();
    problem.goal.sort_unstable();
    problem.goal.dedup();
    problem
}

/// Returns the positions of the fluents that hold.
fn holding(meant: &[(StateId, bool)], world: &WorldState) -> Vec<usize> {
    let holds = |at: &usize| world.holds(meant[*at].0) == meant[*at].1;
    (0..meant.len()).filter(holds).collect()
}

/// Returns the problem of a domain, and what its fluents mean: there is one for each state and, under [`Rules::absent`],
/// one for each state that must be absent. Everything may hold at first, so no pair of fluents excludes each other.
fn grounded(domain: &Domain, rules: Rules) -> (Grounded, Vec<(StateId, bool)>) {
    let states = domain.states();
    let needed = domain.operators().iter().flat_map(|o| o.absent.iter().copied());
    let negated: BTreeSet<StateId> = needed.filter(|_| rules.absent).collect();
    let meant = domain.state_ids().map(|state| (state, true));
    let meant: Vec<_> = meant.chain(negated.iter().map(|state| (*state, false))).collect();
    let fluents = meant.iter().map(|(state, holds)| {
        let predicate = domain[*state].name.clone();
        Fluent { fact: Fact { predicate, arguments: Vec::new() }, holds: *holds }
    });
    let fluents: Vec<Fluent> = fluents.collect();
    let complement =
        |state: &StateId| negated.iter().position(|n| n == state).map(|at| states.len() + at);
    let sorted = |mut positions: Vec<usize>| {
        positions.sort_unstable();
        positions.dedup();
        positions
    };
    let operators = domain.operators().iter().enumerate().map(|(action, o)| {
        let own = |list: &[StateId]| list.iter().map(|s| s.index()).collect::<Vec<_>>();
        let not = |list: &[StateId]| list.iter().filter_map(complement).collect::<Vec<_>>();
        let mut preconditions = own(&o.preconditions);
        if rules.absent {
            preconditions.extend(not(&o.absent));
        }
        let gone: Vec<StateId> =
            o.removes.iter().filter(|s| !o.effects.contains(s)).copied().collect();
        let preconditions = sorted(preconditions);
        let mut adds = sorted([own(&o.effects), not(&gone)].concat());
        adds.retain(|f| !preconditions.contains(f));
        let deletes = sorted([own(&gone), not(&o.effects)].concat());
        let (name, cost) = (o.name.clone(), Number::default());
        GroundOperator { action, name, preconditions, adds, deletes, cost }
    });
    let operators = operators.collect();
    let start = (0..fluents.len()).collect();
    (Grounded { fluents, operators, start, goal: Vec::new(), warnings: Vec::new() }, meant)
}

impl Decider for GoalSetPlanner {
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
        2 + 2 * self.fluents.len()
    }

    fn command_width(&self) -> usize {
        self.domain.operators().len() + self.phases
    }

    /// Writes whether a goal is wanted, whether the motor is busy, what holds, and the goals.
    fn sense(&self, input: &PlannerInput<'_>, out: &mut [Real]) {
        let (requests, rest) = out.split_at_mut(2);
        requests[0] = Real::from(u8::from(input.request != Request::Forget));
        requests[1] = Real::from(u8::from(input.request == Request::Wait));
        let (holds, goal) = rest.split_at_mut(self.fluents.len());
        for ((state, positive), value) in self.fluents.iter().zip(holds) {
            *value = Real::from(u8::from(input.holds(*state) == *positive));
        }
        goal.fill(0.0);
        for wanted in input.goals {
            if let Some(goal) = goal.get_mut(wanted.index()) {
                *goal = 1.0;
            }
        }
    }

    fn verdict(&self, command: &[Real], input: &PlannerInput<'_>) -> Option<Verdict> {
        let (actions, phases) = command.split_at(self.domain.operators().len());
        let active = |place: usize| phases.get(place).is_some_and(|p| *p > 0.5);
        let action = || actions.iter().position(|a| *a > 0.5).map(ActionId::new);
        match (active(self.met), active(self.stuck)) {
            (true, false) => Some(Verdict::Met),
            (false, true) => Some(Verdict::Stuck(self.obstacle(input))),
            _ => action().map(Verdict::Act),
        }
    }

    fn plans_for_all_goals(&self) -> bool {
        true
    }

    fn steady_ms(&self, verdict: &Verdict) -> u64 {
        match verdict {
            Verdict::Stuck(_) => STUCK_MS,
            _ => STEADY_MS,
        }
    }

    fn patience_ms(&self) -> Option<u64> {
        Some(PATIENCE_MS)
    }

    /// Runs the graph once, from the first decision to the last. The motor is busy for 100 ms with each action.
    fn roll_out(
        &self,
        prediction: &mut dyn Prediction,
        limit: SimDuration,
    ) -> Result<RolledOut, TaskError> {
        prediction.goals().iter().try_for_each(|goal| self.check_goal(*goal))?;
        let goals = prediction.goals().to_vec();
        let mut run = GoalSetRun::new(self)?;
        roll_out(prediction, |present, goal| {
            self.check_world(present)?;
            let request = Request::Decide;
            run.decide(
                &PlannerInput { request, present, pretended: &[], goal, goals: &goals },
                limit,
            )
        })
    }
}
