//! The planner graph: goal buffer, memories, unbinding, cleanup, comparison, choice.
//!
//! ```text
//!  goal -> goal cleanup ------------------------------------------------------+
//!                                                                             v
//!  next state -> GOAL BUFFER -> cause memory -> deep memory                executive -> gates,
//!                     |            |               |                          ^        next state
//!                     v            v               v                          |
//!                   focus      motor gate   unbind PRECONDITION -> cleanup -> open -> chosen
//!                                  |                                          ^  (less present,
//!                                  v                                          |      reachable)
//!                             motor -> action                    the states that hold
//! ```
//!
//! The cause memory holds the states with one cause. States with several have a contest beside it
//! (`alternatives`), whose winner is added to what the memory recalls; where there are none it is left out.
//!
//! Every module is one 5 ms synapse; from goal buffer to choice there are six, seven through the contest. At D = 256 a tick of the
//! nut-and-bolt graph takes 6 to 8 microseconds.

use std::sync::Arc;

use super::executive::{Executive, Timing};
use super::parts::{Required, Violated, states_required, unbind_by_products};
use super::recall::{Circumstances, Recall};
use crate::neurons::SelectRule;
use crate::sim::{
    Add, AsPointer, Constant, In, Module, Out, Pointer, Real, Scalar, Scope, SimDuration, Synapse,
    Vector,
};
use crate::spa::{
    AssociativeMemory, CleanupMemory, Gate, GoalBuffer, Linear, PointerValue, Selection,
    UnbindFixed, dot,
};
use crate::task::domain::{Commitment, Domain, Operator, Rules, StateId};
use crate::task::error::TaskError;
use crate::task::planner::encode::{
    ABSENT, ActionSpace, Encoded, NOTHING, PRECONDITION, StateSpace, deep_preconditions,
};

/// How a role is taken out of a deep pointer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Unbinding {
    /// By a fixed linear map, without a tick of delay.
    #[default]
    Fixed,
    /// By a layer of products, as two running pointers are unbound: one more synapse.
    Products,
}

/// A part of the planner graph that can be taken out, to see what it is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The cleanup of unbound preconditions: similarities are taken as they are.
    Cleanup,
    /// The gate before the motor output: it is always open.
    Gate,
}

/// How a planner graph is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlannerSpec {
    /// Dimensions of all pointers.
    pub dimensions: usize,
    /// Greatest magnitude of the cosine between any two pointers of a vocabulary.
    pub max_similarity: Real,
    /// When to commit to an action.
    pub commitment: Commitment,
    /// Whether states that never held before an action must be absent.
    pub absent: bool,
    /// How preconditions are unbound.
    pub unbinding: Unbinding,
    /// The executive's waits.
    pub timing: Timing,
    /// The time constant of the goal buffer's and the gate's feed-forward synapses; all others keep their
    /// modules' own.
    pub synapse: SimDuration,
    /// What the goal buffer feeds back of its own output, 0 to 1: 1 keeps a goal for good, less lets it fade.
    pub retention: Real,
    /// A part that is left out.
    pub without: Option<Part>,
}

impl Default for PlannerSpec {
    fn default() -> Self {
        Self {
            dimensions: 256,
            max_similarity: 0.1,
            commitment: Commitment::default(),
            absent: false,
            unbinding: Unbinding::default(),
            timing: Timing::default(),
            synapse: SimDuration::from_millis(5),
            retention: 1.0,
            without: None,
        }
    }
}

impl PlannerSpec {
    /// What the reference planner has to be told to answer the same.
    pub fn rules(&self) -> Rules {
        Rules { commitment: self.commitment, absent: self.absent }
    }
}

/// Least similarity at which the best item of a memory counts.
pub(super) const RECOGNISED: Real = 0.5;
/// Least distance from that level that every state has to keep when preconditions are unbound.
const MARGIN: Real = 0.05;

/// The planner graph as a module.
pub struct PlanningGraph {
    states: usize,
    executive: Executive,
    state_pointers: Vec<PointerValue<StateSpace>>,
    /// The pointers of the role PRECONDITION and of NOTHING.
    precondition: PointerValue<StateSpace>,
    nothing: PointerValue<StateSpace>,
    spec: PlannerSpec,
    encoded: Arc<Encoded>,
    goal: CleanupMemory<StateSpace>,
    focus: CleanupMemory<StateSpace>,
    recall: Recall,
    deep: AssociativeMemory<ActionSpace, StateSpace>,
    required: CleanupMemory<StateSpace>,
    motor: CleanupMemory<ActionSpace>,
    violated: Option<Violated>,
    unbind: UnbindFixed<StateSpace>,
}

/// The planner graph's ports.
pub struct PlanningPorts {
    /// 1 while an answer is wanted; back to 0 makes the graph forget the last one.
    pub ready: In<Scalar>,
    /// One number a state of the domain: 1 if it holds.
    pub present: In<Vector>,
    /// The pointer of the state that is wanted.
    pub goal: In<Pointer<StateSpace>>,
    /// The pointer of the action to be done; zero while there is none.
    pub action: Out<Pointer<ActionSpace>>,
    /// One number an action of the domain: 1 for the one to be done.
    pub actions: Out<Vector>,
    /// What the graph is doing: phase, states examined, the state in question, a second state, an action.
    pub trace: Out<Vector>,
    /// What is in the goal buffer.
    pub goal_buffer: Out<Pointer<StateSpace>>,
    /// The action recalled as the cause of the goal buffer's state.
    pub cause: Out<Pointer<ActionSpace>>,
    /// The preconditions as unbound from that action's deep pointer.
    pub unbound: Out<Pointer<StateSpace>>,
    /// The cleaned-up preconditions.
    pub preconditions: Out<Pointer<StateSpace>>,
    /// What comes through the motor gate.
    pub gated: Out<Pointer<ActionSpace>>,
    /// One number an action: 1 for those that turned out impossible; none where every state has one cause at most.
    pub ruled_out: Option<Out<Vector>>,
    /// One number an action: 1 for the one recalled.
    pub(crate) recalled: Out<Vector>,
    pub(crate) watched: [Out<Vector>; 5],
}

impl PlanningGraph {
    /// A planner graph over `domain` with the pointers of `encoded`.
    ///
    /// # Errors
    /// [`TaskError::BadDomain`] if the domain has no operator; [`TaskError::Setting`] for a retention outside its
    /// range; [`TaskError::TooFewDimensions`] if some
    /// action's preconditions cannot be told from other states once they are bound and unbound.
    pub fn new(
        domain: &Domain,
        encoded: Arc<Encoded>,
        spec: PlannerSpec,
    ) -> Result<Self, TaskError> {
        if domain.operators().is_empty() {
            let reason = "it has no action, so nothing can be planned".into();
            return Err(TaskError::BadDomain { reason });
        }
        if !(0.0..=1.0).contains(&spec.retention) {
            let (value, expected) = (spec.retention.to_string(), "0 to 1");
            return Err(TaskError::Setting { name: "retention", value, expected });
        }
        let (states, actions) = (&encoded.states, &encoded.actions);
        let names: Vec<&str> = domain.states().iter().map(|s| s.name.as_str()).collect();
        let action_names: Vec<&str> = domain.operators().iter().map(|o| o.name.as_str()).collect();
        let winner = SelectRule::WinnerTakeAll { level: RECOGNISED };
        let every = SelectRule::Threshold { level: RECOGNISED };
        let deep: Vec<(&str, String)> = domain
            .operators()
            .iter()
            .map(|o| (&o.name[..], deep_preconditions(domain.names(&o.preconditions))))
            .collect();
        Self::check_unbinding(domain, &encoded, spec.absent)?;
        let violated =
            if spec.absent { Violated::of(domain, &encoded, winner, every)? } else { None };
        let state_pointers =
            names.iter().map(|name| states.parse(name)).collect::<Result<_, _>>()?;
        Ok(Self {
            states: names.len(),
            state_pointers,
            precondition: states.parse(PRECONDITION)?,
            nothing: states.parse(NOTHING)?,
            spec,
            goal: CleanupMemory::new(states, names.iter().copied(), winner)?,
            focus: CleanupMemory::new(states, names.iter().copied(), winner)?,
            recall: Recall::of(domain, &encoded)?,
            executive: Executive::new(domain, &spec),
            deep: AssociativeMemory::new(
                actions,
                states,
                deep.iter().map(|(name, deep)| (*name, deep.as_str())),
                winner,
            )?,
            required: CleanupMemory::new(states, names.iter().copied().chain([NOTHING]), every)?,
            motor: CleanupMemory::new(actions, action_names.iter().copied(), winner)?,
            violated,
            unbind: UnbindFixed::new(states, PRECONDITION)?,
            encoded,
        })
    }

    /// Unbinds every deep pointer and compares with the table: with too few dimensions for so many
    /// preconditions, others would be read out of it.
    fn check_unbinding(domain: &Domain, encoded: &Encoded, absent: bool) -> Result<(), TaskError> {
        let states = &encoded.states;
        let mut sums: Vec<(&Operator, &str, &[StateId])> = Vec::new();
        for operator in domain.operators() {
            sums.push((operator, PRECONDITION, &operator.preconditions));
            if absent {
                sums.push((operator, ABSENT, &operator.absent));
            }
        }
        for (operator, role, bound) in sums.into_iter().filter(|(_, _, bound)| !bound.is_empty()) {
            let bound = domain.names(bound);
            let out = states.parse(&format!("{role} * ({}) * ~{role}", bound.join(" + ")))?;
            for name in states.names().iter().filter(|n| *n != PRECONDITION && *n != ABSENT) {
                let read = dot(&out, &states.get(name)?);
                let margin = if bound.contains(&name.as_str()) {
                    read - RECOGNISED
                } else {
                    RECOGNISED - read
                };
                if margin < MARGIN {
                    return Err(TaskError::TooFewDimensions {
                        dimensions: states.dim(),
                        action: operator.name.clone(),
                        states: bound.len(),
                        other: name.clone(),
                    });
                }
            }
        }
        Ok(())
    }
}

impl Module for PlanningGraph {
    type Ports = PlanningPorts;

    fn expand(self, scope: &mut Scope<'_>) -> PlanningPorts {
        let none = Synapse::None;
        let m = self.states;
        let executive = scope.add("executive", self.executive);
        let state_space = self.encoded.states.space().clone();
        let goal = scope.add("goal", self.goal);
        let pointers = || self.state_pointers.iter().map(PointerValue::as_pointer);
        let next = scope.add("next", Linear::combination(&state_space, pointers()));
        let synapse = Synapse::lowpass(self.spec.synapse);
        let without = |part| self.spec.without == Some(part);
        let buffer =
            GoalBuffer::new(&self.encoded.states).synapse(synapse).retention(self.spec.retention);
        let buffer = scope.add("goal_buffer", buffer);
        let focus = scope.add("focus", self.focus);
        let deep = scope.add("deep", self.deep);
        let required = if without(Part::Cleanup) {
            let keys = pointers().chain([self.nothing.as_pointer()]);
            Required::as_they_are(scope, &state_space, keys)
        } else {
            let required = scope.add("required", self.required);
            Required { input: vec![required.input], items: required.items, output: required.output }
        };
        let head = states_required(scope, m);
        let unmet =
            scope.add("open", Selection::new(m, SelectRule::Threshold { level: RECOGNISED }));
        let chosen =
            scope.add("chosen", Selection::new(m, SelectRule::WinnerTakeAll { level: RECOGNISED }));
        let present = scope.add("present", Add::vector(m));
        let gate = scope.add("motor_gate", Gate::new(&self.encoded.actions).synapse(synapse));
        let motor = scope.add("motor", self.motor);

        scope.connect(&goal.items, &executive.goal, none);
        scope.connect(&executive.next, &next.input, none);
        scope.connect(&next.output, &buffer.input, none);
        scope.connect(&executive.load, &buffer.open, none);
        scope.connect(&buffer.output, &focus.input, none);
        scope.connect(&focus.items, &executive.focus, none);
        let told = Circumstances {
            state: &buffer.output,
            present: &present.output,
            ruled_out: executive.ruled_out.as_ref(),
        };
        let recalled = self.recall.expand(scope, &told, &self.encoded);
        scope.connect(&recalled.actions, &executive.action, none);
        scope.connect(&recalled.pointer, &deep.input, none);
        let unbound = match self.spec.unbinding {
            Unbinding::Fixed => {
                let unbind = scope.add("unbind", self.unbind);
                scope.connect(&deep.output, &unbind.input, none);
                unbind.output
            }
            Unbinding::Products => {
                unbind_by_products(scope, &self.encoded, &self.precondition, &deep.output)
            }
        };
        required.connect(scope, &unbound);
        scope.connect(&required.items, &executive.required, none);
        scope.connect(&required.items, &head.input, none);
        scope.connect(&head.output, &unmet.utilities, none);
        scope.connect(&present.output, &unmet.inhibit, none);
        scope.connect(&executive.reachable, &unmet.inhibit, none);
        scope.connect(&present.output, &executive.present, none);
        scope.connect(&unmet.items, &executive.unmet, none);
        scope.connect(&unmet.items, &chosen.utilities, none);
        scope.connect(&chosen.items, &executive.chosen, none);
        if let Some(violated) = self.violated {
            let items = violated.expand(scope, &recalled.pointer, &present.output, m);
            scope.connect(&items, &executive.violated, none);
        }
        scope.connect(&recalled.pointer, &gate.input, none);
        if without(Part::Gate) {
            let open = scope.add("open_gate", Constant::scalar(1.0));
            scope.connect(&open, &gate.open, none);
        } else {
            scope.connect(&executive.act, &gate.open, none);
        }
        scope.connect(&gate.output, &motor.input, none);
        PlanningPorts {
            ready: scope.input("ready", executive.ready),
            present: scope.input("present", present.input),
            goal: scope.input("goal", goal.input),
            action: scope.output("action", motor.output),
            actions: scope.output("actions", motor.items),
            trace: executive.trace,
            goal_buffer: buffer.output,
            cause: recalled.pointer,
            unbound,
            gated: gate.output,
            ruled_out: executive.ruled_out,
            recalled: recalled.actions,
            preconditions: required.output,
            watched: [focus.items, recalled.watched, required.items, unmet.items, chosen.items],
        }
    }
}
