//! Standard networks that plan in the paper's domain.

use super::{Reading, Standard, Watched};
use crate::neurons::SelectRule;
use crate::sim::{
    Constant, GraphBuilder, In, Module, Out, Pointer, ProbeSpec, Real, Scalar, Scope, SimDuration,
    Stimulus, Synapse, Vector, VocabTag,
};
use crate::spa::{
    AssociativeMemory, BasalGanglia, CleanupMemory, Gate, Linear, RECURRENT, State, Unbind,
    Vocabulary,
};
use crate::task::TaskError;
use crate::task::planner::Unbinding;
use crate::task::planner::{ActionSpace, Encoded, PRECONDITION, StateSpace, deep_preconditions};
use crate::task::propositional::Domain;
use crate::task::propositional::DomainBuilder;

type Described = (Watched, Reading);

const WINNER: SelectRule = SelectRule::WinnerTakeAll { level: 0.3 };
const EVERY: SelectRule = SelectRule::Threshold { level: 0.3 };
/// The goal.
const GOAL: &str = "BOLT_ASSEMBLED";
/// Preconditions of the action that causes the goal.
const NEEDED: [&str; 2] = ["NUT_IN_JIG", "BOLT_IN_JIG"];

/// The paper's domain and its pointers.
struct Symbols {
    domain: Domain,
    encoded: Encoded,
}

impl Symbols {
    fn new(of: &Standard) -> Result<Self, TaskError> {
        let domain = DomainBuilder::of_the_paper().build()?;
        let encoded = Encoded::new(&domain, of.dimensions, 0.1, of.seed)?;
        Ok(Self { domain, encoded })
    }

    fn names(&self) -> Vec<&str> {
        self.domain.states().iter().map(|s| s.name.as_str()).collect()
    }

    fn needed(&self) -> Result<[usize; 2], TaskError> {
        let [nut, bolt] = NEEDED;
        Ok([self.domain.state(nut)?.index(), self.domain.state(bolt)?.index()])
    }

    /// Returns a stimulus that shows twice the goal's pointer for `ms` simulated ms.
    fn given(&self, ms: u64) -> Result<Stimulus<Pointer<StateSpace>>, TaskError> {
        let states = &self.encoded.states;
        let wanted = states.parse(&format!("2 * {GOAL}"))?;
        Ok(Stimulus::pointer(states.space(), &wanted).silent_from(SimDuration::from_millis(ms)))
    }

    /// Returns a memory from each state to the action that causes it.
    fn cause(&self) -> Result<AssociativeMemory<StateSpace, ActionSpace>, TaskError> {
        let Encoded { states, actions, .. } = &self.encoded;
        let pairs = self.domain.operators().iter().map(|o| (&*self.domain[o.to].name, &*o.name));
        Ok(AssociativeMemory::new(states, actions, pairs, WINNER)?)
    }

    /// Returns a memory from each action to its deep pointer, the sum of its bound preconditions.
    fn deep(&self) -> Result<AssociativeMemory<ActionSpace, StateSpace>, TaskError> {
        let Encoded { states, actions, .. } = &self.encoded;
        let operators = self.domain.operators().iter();
        let deep: Vec<(&str, String)> = operators
            .map(|o| {
                let bound = deep_preconditions(self.domain.names(&o.preconditions));
                (o.name.as_str(), bound)
            })
            .collect();
        let pairs = deep.iter().map(|(action, deep)| (*action, deep.as_str()));
        Ok(AssociativeMemory::new(actions, states, pairs, EVERY)?)
    }

    /// Returns a memory from each action to the state that it causes.
    fn effect(&self) -> Result<AssociativeMemory<ActionSpace, StateSpace>, TaskError> {
        let Encoded { states, actions, .. } = &self.encoded;
        let pairs = self.domain.operators().iter().map(|o| (&*o.name, &*self.domain[o.to].name));
        Ok(AssociativeMemory::new(actions, states, pairs, EVERY)?)
    }

    /// Returns a cleanup memory of all states.
    fn states(&self, rule: SelectRule) -> Result<CleanupMemory<StateSpace>, TaskError> {
        Ok(CleanupMemory::new(&self.encoded.states, self.names(), rule)?)
    }
}

/// Adds a module that unbinds the preconditions from a deep pointer. Returns its output.
fn unbind(
    graph: &mut GraphBuilder,
    symbols: &Symbols,
    unbinding: Unbinding,
    deep: &Out<Pointer<StateSpace>>,
) -> Result<Out<Pointer<StateSpace>>, TaskError> {
    let states = &symbols.encoded.states;
    Ok(match unbinding {
        Unbinding::Products => {
            let role = Constant::pointer(states.space(), &states.get(PRECONDITION)?);
            let role = graph.add("role", role);
            let unbind = graph.add("unbind", Unbind::new(states));
            graph.connect(deep, &unbind.bound, Synapse::None);
            graph.connect(&role, &unbind.role, Synapse::None);
            unbind.output
        }
        Unbinding::Fixed => {
            let unbind = graph.add("unbind", Linear::unbind(states, PRECONDITION)?);
            graph.connect(deep, &unbind.input, Synapse::None);
            unbind.output
        }
    })
}

/// Adds the loop of a planner. It leads from the goal's memory to the action that causes the goal, then to the action's
/// deep pointer, its preconditions, the unsatisfied preconditions, and a closed gate back to the goal. The activity of
/// each precondition is probed.
pub(super) fn loop_of_memories(
    of: &Standard,
    graph: &mut GraphBuilder,
    probed: ProbeSpec,
) -> Result<Described, TaskError> {
    let symbols = Symbols::new(of)?;
    let Encoded { states, actions, .. } = &symbols.encoded;
    let none = Synapse::None;
    let given = graph.add("given", symbols.given(50)?);
    let goal = graph.add("goal", State::new(states).recurrent(RECURRENT));
    let cause = graph.add("cause", symbols.cause()?);
    let action = graph.add("action", State::new(actions));
    let deep = graph.add("deep", symbols.deep()?);
    let effect = graph.add("effect", symbols.effect()?);
    let unbound = unbind(graph, &symbols, of.unbinding, &deep.output)?;
    let preconditions = graph.add("preconditions", State::new(states));
    let cleanup = graph.add("cleanup", symbols.states(EVERY)?);
    let unsatisfied = graph.add("unsatisfied", symbols.states(EVERY)?);
    let change = graph.add("goal_change", Gate::new(states));
    let closed = graph.add("closed", Constant::scalar(0.0));
    graph.connect(&given, &goal.input, none);
    graph.connect(&goal.output, &cause.input, none);
    graph.connect(&cause.output, &action.input, none);
    graph.connect(&action.output, &deep.input, none);
    graph.connect(&action.output, &effect.input, none);
    graph.connect(&unbound, &preconditions.input, none);
    graph.connect(&preconditions.output, &cleanup.input, none);
    graph.connect(&cleanup.output, &unsatisfied.input, none);
    graph.connect(&unsatisfied.output, &change.input, none);
    graph.connect(&closed, &change.open, none);
    graph.connect(&change.output, &goal.input, none);
    let probe = Watched::Vector(graph.probe(&cleanup.items, probed));
    Ok((probe, Reading::Both(symbols.needed()?)))
}

/// A module with a pointer population behind a gate. It holds its value if it is recurrent.
pub(super) struct Slot<'a, V: VocabTag> {
    pub vocabulary: &'a Vocabulary<V>,
    pub recurrent: bool,
}

pub(super) struct SlotPorts<V: VocabTag> {
    pub input: In<Pointer<V>>,
    pub open: In<Scalar>,
    pub output: Out<Pointer<V>>,
}

impl<V: VocabTag> Module for Slot<'_, V> {
    type Ports = SlotPorts<V>;

    fn expand(self, scope: &mut Scope<'_>) -> SlotPorts<V> {
        let gate = scope.add("gate", Gate::new(self.vocabulary));
        let state = State::new(self.vocabulary);
        let state = if self.recurrent { state.recurrent(RECURRENT) } else { state };
        let memory = scope.add("memory", state);
        scope.connect(&gate.output, &memory.input, Synapse::None);
        SlotPorts {
            input: scope.input("input", gate.input),
            open: scope.input("open", gate.open),
            output: scope.output("output", memory.output),
        }
    }
}

/// A rule's name, and the gates that it opens.
pub(super) type Rule = (&'static str, &'static [&'static str]);

/// Adds a slot whose gate opens, by `weight`, with each rule that names it as `gate`. `chosen` has the activities of the rules.
pub(super) fn gated_slot<V: VocabTag>(
    graph: &mut GraphBuilder,
    (path, gate): (&str, &str),
    slot: Slot<'_, V>,
    (chosen, rules, weight): (&Out<Vector>, &[Rule], Real),
) -> SlotPorts<V> {
    let slot = graph.add(path, slot);
    let row = rules.iter().map(|(_, gates)| if gates.contains(&gate) { weight } else { 0.0 });
    let open = graph.add(&format!("open_{path}"), Linear::weighted_sum(row.collect()));
    graph.connect(chosen, &open.input, Synapse::None);
    graph.connect(&open.output, &slot.open, Synapse::None);
    slot
}

/// Returns the utilities of rules of which one has its turn.
pub(super) fn turn(rule: usize, rules: usize) -> Vec<Real> {
    (0..rules).map(|r| if r == rule { 0.8 } else { 0.3 }).collect()
}

/// Rules of the goal stack, each with the slots whose gates it opens.
const RULES: [Rule; 11] = [
    ("plan", &["goal", "action", "deep", "preconditions", "unsatisfied", "world"]),
    ("expect", &["effect"]),
    ("descend", &["subgoal"]),
    ("push", &["stack_1"]),
    ("push_again", &["stack_2"]),
    ("push_last", &["stack_3"]),
    ("refocus", &["goal", "subgoal"]),
    ("look", &["world"]),
    ("act", &["motor"]),
    ("confirm", &["achieved", "world"]),
    ("pop", &["goal", "stack_1"]),
];

/// Time for which each rule has the highest utility, in simulated ms.
const RULE_MS: u64 = 400;

/// Adds the parts of a goal-stack planner. Each slot is a memory behind a gate. Basal ganglia choose a rule, which
/// opens the gates of some slots. The input gives each rule the highest utility in turn, beginning with `plan`.
pub(super) fn goal_stack(
    of: &Standard,
    graph: &mut GraphBuilder,
    probed: ProbeSpec,
) -> Result<Described, TaskError> {
    let symbols = Symbols::new(of)?;
    let Encoded { states, actions, .. } = &symbols.encoded;
    let none = Synapse::None;

    let turn = |rule| turn(rule, RULES.len());
    let turns = (1..RULES.len()).fold(Stimulus::vector(&turn(0)), |turns, rule| {
        turns.from(SimDuration::from_millis(RULE_MS * rule as u64), &turn(rule))
    });
    let turns = graph.add("turns", turns);
    let selection = graph.add("selection", BasalGanglia::new(RULES.len()));
    graph.connect(&turns, &selection.utilities, none);
    let rules = (&selection.chosen, &RULES[..], 1.0);
    let state_slot = |graph: &mut GraphBuilder, name: &str| {
        gated_slot(graph, (name, name), Slot { vocabulary: states, recurrent: true }, rules)
    };
    let action_slot = |graph: &mut GraphBuilder, name: &str| {
        gated_slot(graph, (name, name), Slot { vocabulary: actions, recurrent: true }, rules)
    };

    let goal = state_slot(graph, "goal");
    let action = action_slot(graph, "action");
    let [deep, preconditions, unsatisfied, effect, subgoal] =
        ["deep", "preconditions", "unsatisfied", "effect", "subgoal"]
            .map(|name| state_slot(graph, name));
    let stack = ["stack_1", "stack_2", "stack_3"].map(|name| state_slot(graph, name));
    let [world, achieved] = ["world", "achieved"].map(|name| state_slot(graph, name));
    let motor = action_slot(graph, "motor");

    let given = graph.add("given", symbols.given(RULE_MS)?);
    let seen = symbols.encoded.states.parse("NUT_ON_TABLE + BOLT_ON_TABLE")?;
    let seen = graph.add("seen", Constant::pointer(states.space(), &seen));
    let cause = graph.add("cause", symbols.cause()?);
    let cause_deep = graph.add("cause_deep", symbols.deep()?);
    let cause_effect = graph.add("cause_effect", symbols.effect()?);
    let names = actions.names().iter().map(String::as_str);
    let command = graph.add("command", CleanupMemory::new(actions, names, WINNER)?);
    let required = graph.add("required", symbols.states(EVERY)?);
    let present = graph.add("present", symbols.states(EVERY)?);
    let open_ones = graph.add("open_ones", symbols.states(EVERY)?);
    let next = graph.add("next", symbols.states(WINNER)?);
    let pushed = graph.add("pushed", symbols.states(WINNER)?);
    let pushed_again = graph.add("pushed_again", symbols.states(WINNER)?);
    let popped = graph.add("popped", symbols.states(WINNER)?);
    let caused = graph.add("caused", symbols.states(EVERY)?);
    let unbound = unbind(graph, &symbols, Unbinding::Fixed, &deep.output)?;

    graph.connect(&given, &goal.input, none);
    graph.connect(&goal.output, &cause.input, none);
    graph.connect(&cause.output, &action.input, none);
    graph.connect(&action.output, &cause_deep.input, none);
    graph.connect(&cause_deep.output, &deep.input, none);
    graph.connect(&unbound, &preconditions.input, none);
    graph.connect(&preconditions.output, &required.input, none);
    graph.connect(&required.output, &unsatisfied.input, none);
    graph.connect(&seen, &world.input, none);
    graph.connect(&world.output, &present.input, none);
    graph.connect(&unsatisfied.output, &open_ones.input, none);
    graph.connect(&present.items, &open_ones.inhibit, none);
    graph.connect(&open_ones.output, &next.input, none);
    graph.connect(&next.output, &subgoal.input, none);
    graph.connect(&subgoal.output, &goal.input, none);
    graph.connect(&goal.output, &pushed.input, none);
    graph.connect(&pushed.output, &stack[0].input, none);
    graph.connect(&stack[0].output, &pushed_again.input, none);
    graph.connect(&pushed_again.output, &stack[1].input, none);
    graph.connect(&stack[1].output, &popped.input, none);
    graph.connect(&popped.output, &stack[2].input, none);
    graph.connect(&action.output, &cause_effect.input, none);
    graph.connect(&cause_effect.output, &effect.input, none);
    graph.connect(&effect.output, &caused.input, none);
    graph.connect(&caused.output, &achieved.input, none);
    graph.connect(&action.output, &command.input, none);
    graph.connect(&command.output, &motor.input, none);
    let probe = Watched::Vector(graph.probe(&required.items, probed));
    Ok((probe, Reading::Both(symbols.needed()?)))
}
