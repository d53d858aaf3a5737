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
//! Every module is one 5 ms synapse; from goal buffer to choice there are six. At D = 256 a tick of the
//! nut-and-bolt graph takes 6 to 8 microseconds.

use super::executive::{Executive, Timing};
use crate::neurons::SelectRule;
use crate::sim::{
    Add, Constant, In, InputSpec, Module, Out, OutputSpec, Pointer, Real, Scalar, Scope, Scratch,
    ScratchSpec, SimDuration, Synapse, Vector,
};
use crate::spa::{
    AssociativeMemory, CleanupMemory, Gate, GoalBuffer, Linear, LinearMap, LinearPorts, Selection,
    Unbind, UnbindFixed, VocabError, dot,
};
use crate::task::domain::{Commitment, Domain, Operator, Rules, StateId};
use crate::task::error::TaskError;
use crate::task::planner::encode::{
    ABSENT, ActionSpace, Encoded, NOTHING, PRECONDITION, StateSpace, deep_absent,
    deep_preconditions,
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
const RECOGNISED: Real = 0.5;
/// Least distance from that level that every state has to keep when preconditions are unbound.
const MARGIN: Real = 0.05;

/// The planner graph as a module.
pub struct PlanningGraph {
    states: usize,
    actions: usize,
    state_rows: Vec<Real>,
    /// The pointers of the role PRECONDITION and of NOTHING.
    precondition: Vec<Real>,
    nothing: Vec<Real>,
    cause_rows: Vec<Real>,
    spec: PlannerSpec,
    encoded: std::sync::Arc<Encoded>,
    goal: CleanupMemory<StateSpace>,
    focus: CleanupMemory<StateSpace>,
    cause: AssociativeMemory<StateSpace, ActionSpace>,
    deep: AssociativeMemory<ActionSpace, StateSpace>,
    required: CleanupMemory<StateSpace>,
    motor: CleanupMemory<ActionSpace>,
    barred: Option<Barred>,
    unbind: UnbindFixed<StateSpace>,
}

struct Barred {
    deep: AssociativeMemory<ActionSpace, StateSpace>,
    unbind: UnbindFixed<StateSpace>,
    forbidden: CleanupMemory<StateSpace>,
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
    /// What the graph is doing: phase, states examined, the state in question, a second state.
    pub trace: Out<Vector>,
    /// What is in the goal buffer.
    pub goal_buffer: Out<Pointer<StateSpace>>,
    /// The action that causes the goal buffer's state.
    pub cause: Out<Pointer<ActionSpace>>,
    /// The preconditions as unbound from that action's deep pointer.
    pub unbound: Out<Pointer<StateSpace>>,
    /// The cleaned-up preconditions.
    pub preconditions: Out<Pointer<StateSpace>>,
    /// What comes through the motor gate.
    pub gated: Out<Pointer<ActionSpace>>,
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
        encoded: std::sync::Arc<Encoded>,
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
        let causes: Vec<(usize, usize)> = domain
            .state_ids()
            .filter_map(|state| Some((state.index(), domain.causes(state).first()?.index())))
            .collect();
        // Which action each item of the cause memory stands for: several states can have one cause.
        let mut cause_rows = vec![0.0; causes.len() * action_names.len()];
        for (item, (_, action)) in causes.iter().enumerate() {
            cause_rows[item * action_names.len() + action] = 1.0;
        }
        let causes = causes.iter().map(|(state, action)| (names[*state], action_names[*action]));
        let deep: Vec<(&str, String)> = domain
            .operators()
            .iter()
            .map(|o| (&o.name[..], deep_preconditions(domain.names(&o.preconditions))))
            .collect();
        Self::check_unbinding(domain, &encoded, spec.absent)?;
        let barred =
            if spec.absent { Self::barred(domain, &encoded, winner, every)? } else { None };
        let mut state_rows = Vec::with_capacity(names.len() * states.dim());
        for name in &names {
            state_rows.extend_from_slice(&states.get(name)?);
        }
        Ok(Self {
            states: names.len(),
            actions: action_names.len(),
            state_rows,
            precondition: states.get(PRECONDITION)?.to_vec(),
            nothing: states.get(NOTHING)?.to_vec(),
            cause_rows,
            spec,
            goal: CleanupMemory::new(states, names.iter().copied(), winner)?,
            focus: CleanupMemory::new(states, names.iter().copied(), winner)?,
            cause: AssociativeMemory::new(states, actions, causes, winner)?,
            deep: AssociativeMemory::new(
                actions,
                states,
                deep.iter().map(|(name, deep)| (*name, deep.as_str())),
                winner,
            )?,
            required: CleanupMemory::new(states, names.iter().copied().chain([NOTHING]), every)?,
            motor: CleanupMemory::new(actions, action_names.iter().copied(), winner)?,
            barred,
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

    fn barred(
        domain: &Domain,
        encoded: &Encoded,
        winner: SelectRule,
        every: SelectRule,
    ) -> Result<Option<Barred>, VocabError> {
        let deep: Vec<(&str, String)> = domain
            .operators()
            .iter()
            .filter_map(|o| Some((&o.name[..], deep_absent(domain, o)?)))
            .collect();
        if deep.is_empty() {
            return Ok(None);
        }
        let names = domain.states().iter().map(|s| s.name.as_str());
        Ok(Some(Barred {
            deep: AssociativeMemory::new(
                &encoded.actions,
                &encoded.states,
                deep.iter().map(|(name, deep)| (*name, deep.as_str())),
                winner,
            )?,
            unbind: UnbindFixed::new(&encoded.states, ABSENT)?,
            forbidden: CleanupMemory::new(&encoded.states, names, every)?,
        }))
    }
}

/// Where unbound preconditions are told apart.
struct Required {
    input: Vec<In<Pointer<StateSpace>>>,
    items: Out<Vector>,
    output: Out<Pointer<StateSpace>>,
}

impl Required {
    fn connect(&self, scope: &mut Scope<'_>, unbound: &Out<Pointer<StateSpace>>) {
        for input in &self.input {
            scope.connect(unbound, input, Synapse::None);
        }
    }
}

/// The first numbers of a longer vector.
struct Head {
    from: usize,
    to: usize,
}

impl LinearMap for Head {
    fn input_width(&self) -> usize {
        self.from
    }

    fn output_width(&self) -> usize {
        self.to
    }

    fn scratch(&self) -> ScratchSpec {
        ScratchSpec::default()
    }

    fn apply_into(&self, input: &[Real], out: &mut [Real], _scratch: &mut Scratch<'_>) {
        out.copy_from_slice(&input[..self.to]);
    }
}

impl Module for PlanningGraph {
    type Ports = PlanningPorts;

    fn expand(self, scope: &mut Scope<'_>) -> PlanningPorts {
        let none = Synapse::None;
        let (m, a) = (self.states, self.actions);
        let executive = scope.add("executive", Executive::new(m, a, &self.spec));
        let state_space = self.encoded.states.space().clone();
        let goal = scope.add("goal", self.goal);
        let next: LinearPorts<Vector, Pointer<StateSpace>> = scope.add(
            "next",
            Linear::weighted_rows(
                InputSpec::vector(m),
                OutputSpec::pointer(&state_space),
                self.state_rows.clone(),
            ),
        );
        let synapse = Synapse::lowpass(self.spec.synapse);
        let without = |part| self.spec.without == Some(part);
        let buffer =
            GoalBuffer::new(&self.encoded.states).synapse(synapse).retention(self.spec.retention);
        let buffer = scope.add("goal_buffer", buffer);
        let focus = scope.add("focus", self.focus);
        let cause = scope.add("cause", self.cause);
        let deep = scope.add("deep", self.deep);
        let required = if without(Part::Cleanup) {
            let mut rows = self.state_rows;
            rows.extend(self.nothing);
            let raw: LinearPorts<Pointer<StateSpace>, Vector> = scope.add(
                "required",
                Linear::rows(InputSpec::pointer(&state_space), OutputSpec::vector(m + 1), rows),
            );
            let pointer = scope.add("required_pointer", Add::pointer(&state_space));
            Required {
                input: vec![raw.input, pointer.input],
                items: raw.output,
                output: pointer.output,
            }
        } else {
            let required = scope.add("required", self.required);
            Required { input: vec![required.input], items: required.items, output: required.output }
        };
        let head: LinearPorts<Vector, Vector> = scope.add(
            "states_required",
            Linear::new(
                InputSpec::vector(m + 1),
                OutputSpec::vector(m),
                Box::new(Head { from: m + 1, to: m }),
            ),
        );
        let open =
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
        scope.connect(&buffer.output, &cause.input, none);
        let caused: LinearPorts<Vector, Vector> = scope.add(
            "caused",
            Linear::weighted_rows(
                InputSpec::vector(self.cause_rows.len() / a),
                OutputSpec::vector(a),
                self.cause_rows,
            ),
        );
        scope.connect(&cause.items, &caused.input, none);
        scope.connect(&caused.output, &executive.action, none);
        scope.connect(&cause.output, &deep.input, none);
        let unbound = match self.spec.unbinding {
            Unbinding::Fixed => {
                let unbind = scope.add("unbind", self.unbind);
                scope.connect(&deep.output, &unbind.input, none);
                required.connect(scope, &unbind.output);
                unbind.output
            }
            Unbinding::Products => {
                let role = Constant::pointer(&state_space, &self.precondition);
                let role = scope.add("precondition", role);
                let unbind = scope.add("unbind", Unbind::new(&self.encoded.states));
                scope.connect(&deep.output, &unbind.bound, none);
                scope.connect(&role, &unbind.role, none);
                required.connect(scope, &unbind.output);
                unbind.output
            }
        };
        scope.connect(&required.items, &executive.required, none);
        scope.connect(&required.items, &head.input, none);
        scope.connect(&head.output, &open.utilities, none);
        scope.connect(&present.output, &open.inhibit, none);
        scope.connect(&executive.reachable, &open.inhibit, none);
        scope.connect(&present.output, &executive.present, none);
        scope.connect(&open.items, &executive.open, none);
        scope.connect(&open.items, &chosen.utilities, none);
        scope.connect(&chosen.items, &executive.chosen, none);
        if let Some(Barred { deep, unbind, forbidden }) = self.barred {
            let deep = scope.add("deep_absent", deep);
            let unbind = scope.add("unbind_absent", unbind);
            let forbidden = scope.add("forbidden", forbidden);
            // Forbidden and present: both halves of the level.
            let both = SelectRule::Threshold { level: 1.0 + RECOGNISED };
            let barred = scope.add("barred", Selection::new(m, both));
            scope.connect(&cause.output, &deep.input, none);
            scope.connect(&deep.output, &unbind.input, none);
            scope.connect(&unbind.output, &forbidden.input, none);
            scope.connect(&forbidden.items, &barred.utilities, none);
            scope.connect(&present.output, &barred.utilities, none);
            scope.connect(&barred.items, &executive.barred, none);
        }
        scope.connect(&cause.output, &gate.input, none);
        if without(Part::Gate) {
            let open = scope.add("open_gate", Constant::scalar(1.0));
            scope.connect(&open, &gate.open, none);
        } else {
            scope.connect(&executive.act, &gate.open, none);
        }
        scope.connect(&gate.output, &motor.input, none);
        PlanningPorts {
            ready: executive.ready,
            present: present.input,
            goal: goal.input,
            action: motor.output,
            actions: motor.items,
            trace: executive.trace,
            goal_buffer: buffer.output,
            cause: cause.output,
            unbound,
            gated: gate.output,
            preconditions: required.output,
            watched: [focus.items, cause.items, required.items, open.items, chosen.items],
        }
    }
}
