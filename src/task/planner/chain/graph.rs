//! The planner graph as one module: goal buffer, memories, unbinding, cleanup, comparison and choice.
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
//! The cause memory stores the states with one cause. For states with several causes, a contest
//! (`alternatives`) works beside the memory, and its winner is added to the memory's output. If no state has
//! several causes, the contest is left out.
//!
//! Every module adds one synapse of 5 ms. Between the goal buffer and the choice of an unmet precondition there are six
//! synapses, or seven through the contest. With 256 dimensions, a tick of the graph for the paper's domain takes 6 to 8
//! microseconds.

use std::sync::Arc;

use super::encode::{
    ABSENT, ActionSpace, Encoded, NOTHING, PRECONDITION, RECOGNISED, StateSpace, WINNER,
    deep_absent, deep_preconditions,
};
use super::executive::{Executive, Timing};
use super::recall::Recall;
use super::words::describe;
use crate::neurons::SelectRule;
use crate::sim::{
    Add, AsPointer, Constant, In, Module, Out, Pointer, Real, Scalar, Scope, SimDuration, Synapse,
    Vector,
};
use crate::spa::{
    AssociativeMemory, CleanupMemory, FlowExt, Gate, GoalBuffer, Linear, PointerValue, Routes,
    Selection, VocabError, dot,
};
use crate::task::error::TaskError;
use crate::task::propositional::{Commitment, Domain, Operator, Rules, StateId};

/// How the preconditions are unbound from a deep pointer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Unbinding {
    /// By a fixed linear map, without delay.
    #[default]
    Fixed,
    /// By a layer of products, which can also unbind two changing pointers. Adds one synapse.
    Products,
}

/// A part of the planner graph that can be left out, to see what it contributes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The cleanup of unbound preconditions. Without it, their similarities are used directly.
    Cleanup,
    /// The gate before the motor output. Without it, the gate is always open.
    Gate,
}

/// Settings of a planner graph.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlannerSpec {
    /// Number of dimensions of all pointers.
    pub dimensions: usize,
    /// Greatest magnitude of the cosine between any two pointers of a vocabulary, above 0 and at most 1.
    pub max_similarity: Real,
    /// When the planner commits to an action.
    pub commitment: Commitment,
    /// Whether states that never held before an action must be absent.
    pub absent: bool,
    /// How preconditions are unbound.
    pub unbinding: Unbinding,
    /// The executive's waits, in simulated time.
    pub timing: Timing,
    /// Time constant of the feed-forward synapses of the goal buffer and the motor gate. All other modules
    /// keep their defaults.
    pub synapse: SimDuration,
    /// Share of its output that the goal buffer feeds back to itself, 0 to 1. With 1 it keeps a goal indefinitely; with
    /// less the goal fades.
    pub retention: Real,
    /// The part to leave out, if any.
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
    /// Returns the rules under which the reference planner gives the same answers.
    pub fn rules(&self) -> Rules {
        Rules { commitment: self.commitment, absent: self.absent }
    }
}

/// Chooses every recognised item.
const EVERY: SelectRule = SelectRule::Threshold { level: RECOGNISED };
/// Least difference between [`RECOGNISED`] and the similarity of every state after unbinding.
const MARGIN: Real = 0.05;

/// The planner graph as a module.
pub struct PlanningGraph {
    executive: Executive,
    spec: PlannerSpec,
    encoded: Arc<Encoded>,
    state_pointers: Vec<PointerValue<StateSpace>>,
    nothing: PointerValue<StateSpace>,
    goal: CleanupMemory<StateSpace>,
    focus: CleanupMemory<StateSpace>,
    recall: Recall,
    required: Bound,
    /// The states that must be absent; `None` if no action names one.
    forbidden: Option<Bound>,
    motor: CleanupMemory<ActionSpace>,
}

/// States that the deep pointers of actions bind to a role: recalled, unbound and cleaned up.
struct Bound {
    deep: AssociativeMemory<ActionSpace, StateSpace>,
    role: PointerValue<StateSpace>,
    cleanup: CleanupMemory<StateSpace>,
}

impl Bound {
    /// Builds the memories. `deep` has the name and the deep pointer of each action; `names` are the states to find.
    fn new<'n>(
        encoded: &Encoded,
        role: &str,
        deep: &[(&str, String)],
        names: impl IntoIterator<Item = &'n str>,
    ) -> Result<Self, VocabError> {
        let Encoded { states, actions, .. } = encoded;
        let deep = deep.iter().map(|(name, deep)| (*name, deep.as_str()));
        Ok(Self {
            deep: AssociativeMemory::new(actions, states, deep, WINNER)?,
            role: states.parse(role)?,
            cleanup: CleanupMemory::new(states, names, EVERY)?,
        })
    }
}

/// The ports of a [`PlanningGraph`].
pub struct PlanningPorts {
    /// 1 while a decision is requested. When `ready` returns to 0, the graph forgets its last answer.
    pub ready: In<Scalar>,
    /// One number for each state of the domain: 1 if it holds.
    pub present: In<Vector>,
    /// Pointer of the goal.
    pub goal: In<Pointer<StateSpace>>,
    /// Pointer of the action to do; zero while there is none.
    pub action: Out<Pointer<ActionSpace>>,
    /// One number for each action of the domain: 1 for the action to do.
    pub actions: Out<Vector>,
    /// The executive's trace: phase, number of questions so far, the examined state, a second state, an action. The
    /// phase is 0 while idle, 1 while loading, 2 while settling, 3 for met, 4 for act, 5 if nothing causes the state, 6
    /// if the second state must be absent, 7 if the state needs itself, and 8 if the executive gave up.
    pub trace: Out<Vector>,
    /// Pointer in the goal buffer.
    pub goal_buffer: Out<Pointer<StateSpace>>,
    /// Pointer of the action recalled as the cause of the goal buffer's state.
    pub cause: Out<Pointer<ActionSpace>>,
    /// Preconditions as unbound from that action's deep pointer.
    pub unbound: Out<Pointer<StateSpace>>,
    /// Preconditions after the cleanup.
    pub preconditions: Out<Pointer<StateSpace>>,
    /// Pointer that passes through the motor gate.
    pub gated: Out<Pointer<ActionSpace>>,
    /// One number for each action: 1 if it turned out to be impossible. `None` if no state has more than one
    /// cause.
    pub ruled_out: Option<Out<Vector>>,
    /// One number for each action: 1 for the recalled action.
    pub(crate) recalled: Out<Vector>,
    pub(crate) watched: [Out<Vector>; 5],
}

impl PlanningGraph {
    /// Builds a planner graph over `domain` with the pointers of `encoded`.
    ///
    /// # Errors
    /// [`TaskError::BadDomain`] if the domain has no action; [`TaskError::Setting`] for a retention outside its range;
    /// [`TaskError::TooFewDimensions`] if the preconditions of some action cannot be distinguished from other states
    /// after unbinding.
    pub fn new(
        domain: &Domain,
        encoded: Arc<Encoded>,
        spec: PlannerSpec,
    ) -> Result<Self, TaskError> {
        if !(0.0..=1.0).contains(&spec.retention) {
            let (value, expected) = (spec.retention.to_string(), "0 to 1");
            return Err(TaskError::Setting { name: "retention", value, expected });
        }
        Self::check_unbinding(domain, &encoded, spec.absent)?;
        let Encoded { states, actions, .. } = &*encoded;
        let names = || domain.states().iter().map(|s| s.name.as_str());
        let operators = || domain.operators().iter();
        let needs = |o: &Operator| deep_preconditions(domain.names(&o.preconditions));
        let needs: Vec<_> = operators().map(|o| (&o.name[..], needs(o))).collect();
        let absent: Vec<_> = operators()
            .filter(|_| spec.absent)
            .filter_map(|o| Some((&o.name[..], deep_absent(domain, o)?)))
            .collect();
        let forbidden = (!absent.is_empty())
            .then(|| Bound::new(&encoded, ABSENT, &absent, names()))
            .transpose()?;
        Ok(Self {
            executive: Executive::new(domain, spec.commitment, spec.timing),
            state_pointers: names().map(|name| states.parse(name)).collect::<Result<_, _>>()?,
            nothing: states.parse(NOTHING)?,
            goal: CleanupMemory::new(states, names(), WINNER)?,
            focus: CleanupMemory::new(states, names(), WINNER)?,
            recall: Recall::of(domain, &encoded)?,
            required: Bound::new(&encoded, PRECONDITION, &needs, names().chain([NOTHING]))?,
            forbidden,
            motor: CleanupMemory::new(actions, operators().map(|o| &o.name[..]), WINNER)?,
            spec,
            encoded,
        })
    }

    /// Unbinds every deep pointer and compares the result with the action's preconditions. With too few dimensions,
    /// states that are not preconditions would be decoded too.
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
        let Encoded { states, actions, .. } = &*self.encoded;
        describe(scope);
        let count = self.state_pointers.len();
        let pointers = || self.state_pointers.iter().map(PointerValue::as_pointer);
        let synapse = Synapse::lowpass(self.spec.synapse);
        let without = |part| self.spec.without == Some(part);
        let several = !matches!(self.recall, Recall::Memory(_));
        let executive = scope.add("executive", self.executive);
        let vector = |name: &str| executive.input::<Vector>(name);
        let reachable = executive.output::<Vector>("reachable");
        let ruled_out = several.then(|| executive.output("ruled_out"));
        let goal = scope.add("goal", self.goal);
        let next = scope.add("next", Linear::combination(states.space(), pointers()));
        let buffer = GoalBuffer::new(states).synapse(synapse).retention(self.spec.retention);
        let buffer = scope.add("goal_buffer", buffer);
        let focus = scope.add("focus", self.focus);
        let deep = scope.add("deep", self.required.deep);
        let unbound = scope.add("unbound", Add::pointer(states.space()));
        let open = scope.add("open", Selection::new(count, EVERY));
        let chosen = scope.add("chosen", Selection::new(count, WINNER));
        let present = scope.add("present", Add::vector(count));
        let gate = scope.add("motor_gate", Gate::new(actions).synapse(synapse));
        let motor = scope.add("motor", self.motor);

        // From the goal to the action that causes it.
        scope.route(&goal.items >> &vector("goal"));
        scope.route(&executive.output::<Vector>("next") >> &next);
        scope.route(&next >> &buffer);
        scope.route(&executive.output::<Scalar>("load") >> &buffer.open);
        scope.route(&buffer >> &focus);
        scope.route(&focus.items >> &vector("focus"));
        let recalled = self.recall.expand(
            scope,
            &buffer.output,
            &present.output,
            ruled_out.as_ref(),
            &self.encoded,
        );
        scope.route(&recalled.actions >> &vector("action"));

        // From the action to its preconditions, and to one that does not hold.
        scope.route(&recalled.pointer >> &deep);
        let role = &self.required.role;
        let unbind = match self.spec.unbinding {
            Unbinding::Fixed => &deep * !role,
            Unbinding::Products => {
                let role = scope.add("precondition", Constant::pointer(states.space(), role));
                &deep * !&role
            }
        };
        scope.route((unbind >> &unbound).named("unbind"));
        let (required, preconditions) = if without(Part::Cleanup) {
            let keys = pointers().chain([self.nothing.as_pointer()]);
            let similarities = Linear::similarities(states.space(), keys);
            let required = scope.add("required", similarities);
            scope.route(&unbound >> &required);
            (required.output, unbound.output.clone())
        } else {
            let required = scope.add("required", self.required.cleanup);
            scope.route(&unbound >> &required);
            (required.items, required.output)
        };
        scope.route(&required >> &vector("required"));
        // The last item stands for "no precondition".
        scope.route(required.slice(0..count) >> &open.utilities);
        scope.route(&present >> &open.inhibit);
        scope.route(&reachable >> &open.inhibit);
        scope.route(&present >> &vector("present"));
        scope.route(&open.items >> &vector("unmet"));
        scope.route(&open.items >> &chosen.utilities);
        scope.route(&chosen.items >> &vector("chosen"));

        // The states that hold but must be absent: both forbidden and present.
        if let Some(Bound { deep, role, cleanup }) = self.forbidden {
            let deep = scope.add("deep_absent", deep);
            let forbidden = scope.add("forbidden", cleanup);
            let both = SelectRule::Threshold { level: 1.0 + RECOGNISED };
            let barred = scope.add("barred", Selection::new(count, both));
            scope.route(&recalled.pointer >> &deep);
            scope.route(&deep * !&role >> &forbidden);
            scope.route(&forbidden.items >> &barred.utilities);
            scope.route(&present >> &barred.utilities);
            scope.route(&barred.items >> &vector("violated"));
        }

        scope.route(&recalled.pointer >> &gate);
        scope.route(&gate >> &motor);
        match without(Part::Gate) {
            true => scope.route(1.0 >> &gate.open),
            false => scope.route(&executive.output::<Scalar>("act") >> &gate.open),
        }
        PlanningPorts {
            ready: scope.input("ready", executive.input("ready")),
            present: scope.input("present", present.input),
            goal: scope.input("goal", goal.input),
            action: scope.output("action", motor.output),
            actions: scope.output("actions", motor.items),
            trace: executive.output("trace"),
            goal_buffer: buffer.output,
            cause: recalled.pointer,
            unbound: unbound.output,
            gated: gate.output,
            ruled_out,
            recalled: recalled.actions,
            preconditions,
            watched: [focus.items, recalled.watched, required, open.items, chosen.items],
        }
    }
}
