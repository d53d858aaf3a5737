//! The executive: opens the planner graph's gates and decides when a question is answered.
//!
//! It is control, not representation: it reads which items of the graph's memories are active, and
//! writes gates and one-hot item vectors; it holds no pointers and has no neural form. It walks from the goal
//! along open preconditions, keeping a path (to notice circles and find the way back) and the set of states
//! that are shown to be within reach:
//!
//! 1. *load* the state in question into the goal buffer, then close its gate;
//! 2. let the graph *settle*: the action that causes it, its preconditions, those that are open;
//! 3. nothing active among the actions: stuck, nothing causes the state;
//!    all preconditions hold: the action can be done, and the state is remembered if it is the first;
//!    some open: the chosen one is next, unless it is on the path (stuck, it needs itself);
//!    none open but not all hold: all the others are within reach, and so is this one;
//! 4. a state within reach goes off the path, back to the one before; if it is the goal, the remembered
//!    state is loaded once more, and the motor gate lets its action out.
//!
//! An answer counts as settled when the active items have not changed for [`Timing::hold`], at least
//! [`Timing::settle`] after the state began to be loaded.

use super::graph::PlannerSpec;
use crate::sim::{
    AdvanceIo, FNV_START, Fingerprint, In, InputSpec, Module, Node, NodeFault, Out, OutputSpec,
    PortDecl, Real, Scalar, Scope, SimDuration, StateSpec, StepCx, Vector, fnv1a_word,
};
use crate::task::domain::Commitment;

/// The executive's waits, in simulated time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timing {
    /// How long the goal buffer's gate stays open.
    pub load: SimDuration,
    /// How long after the gate opened an answer counts at the earliest. It has to exceed the
    /// delay from the goal buffer to the choice of a subgoal, six synapses.
    pub settle: SimDuration,
    /// How long the active items must stay the same.
    pub hold: SimDuration,
    /// How long to wait for an answer that does not settle.
    pub patience: SimDuration,
}

impl Default for Timing {
    fn default() -> Self {
        Self {
            load: SimDuration::from_millis(40),
            settle: SimDuration::from_millis(50),
            hold: SimDuration::from_millis(10),
            patience: SimDuration::from_millis(200),
        }
    }
}

/// What the executive is doing; the first number of its `trace`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Phase {
    /// Waiting to be asked, and for the goal to be recognised.
    Idle,
    /// Loading a state into the goal buffer.
    Load,
    /// Waiting for the graph to answer.
    Settle,
    /// The goal holds already.
    Met,
    /// The action recalled is to be done.
    Act,
    /// Nothing causes the state in question.
    NothingCauses,
    /// The second state in question must be absent and is not.
    MustBeAbsent,
    /// The state in question is needed to bring itself about.
    NeedsItself,
    /// The goal is no state, or the graph's answer did not settle.
    Lost,
}

impl Phase {
    const ALL: [Self; 9] = [
        Self::Idle,
        Self::Load,
        Self::Settle,
        Self::Met,
        Self::Act,
        Self::NothingCauses,
        Self::MustBeAbsent,
        Self::NeedsItself,
        Self::Lost,
    ];

    pub fn from_trace(value: Real) -> Self {
        Self::ALL.get(value.round() as usize).copied().unwrap_or(Self::Lost)
    }

    fn from_word(word: u32) -> Self {
        Self::ALL.get(word as usize).copied().unwrap_or(Self::Lost)
    }

    fn word(self) -> u32 {
        Self::ALL.iter().position(|p| *p == self).unwrap_or(0) as u32
    }

    pub fn is_final(self) -> bool {
        !matches!(self, Self::Idle | Self::Load | Self::Settle)
    }
}

/// The node.
pub(crate) struct Executive {
    states: usize,
    actions: usize,
    commitment: Commitment,
    timing: Timing,
}

/// The executive's ports; all vectors hold one number an item, 1 when active.
pub(crate) struct ExecutivePorts {
    /// 1 while an answer is wanted.
    pub ready: In<Scalar>,
    /// The state that is the goal.
    pub goal: In<Vector>,
    /// The state in the goal buffer.
    pub focus: In<Vector>,
    /// The action that causes it.
    pub action: In<Vector>,
    /// The action's preconditions; one more item, at the end, for none.
    pub required: In<Vector>,
    /// Those that neither hold nor are within reach.
    pub open: In<Vector>,
    /// One of those.
    pub chosen: In<Vector>,
    /// States that hold and must be absent.
    pub barred: In<Vector>,
    /// States that hold.
    pub present: In<Vector>,
    /// Opens the goal buffer.
    pub load: Out<Scalar>,
    /// The state to be loaded.
    pub next: Out<Vector>,
    /// States shown to be within reach.
    pub reachable: Out<Vector>,
    /// 1 when the recalled action is to be done.
    pub act: Out<Scalar>,
    /// Phase, number of states examined so far, the state in question, a second state.
    pub trace: Out<Vector>,
}

/// Numbers in the trace.
pub(crate) const TRACE: usize = 4;

// Inputs in the order of declaration.
const READY: usize = 0;
const GOAL: usize = 1;
const FOCUS: usize = 2;
const ACTION: usize = 3;
const REQUIRED: usize = 4;
const OPEN: usize = 5;
const CHOSEN: usize = 6;
const BARRED: usize = 7;
const PRESENT: usize = 8;

// Words of state; the path follows them, one word a state: its place on the path, 0 for off it.
const PHASE: usize = 0;
const EXAMINED: usize = 1;
const SUBJECT: usize = 2;
const SECOND: usize = 3;
const TIMER: usize = 4;
const STABLE: usize = 5;
const CANDIDATE: usize = 6;
const TOP: usize = 7;
const DEPTH: usize = 8;
const RECALLING: usize = 9;
const PATH: usize = 10;

impl Executive {
    pub fn new(states: usize, actions: usize, spec: &PlannerSpec) -> Self {
        Self { states, actions, commitment: spec.commitment, timing: spec.timing }
    }
}

fn active(value: Real) -> bool {
    value > 0.5
}

fn first_active(values: &[Real]) -> Option<usize> {
    values.iter().position(|v| active(*v))
}

fn only_active(values: &[Real]) -> Option<usize> {
    let first = first_active(values)?;
    values[first + 1..].iter().all(|v| !active(*v)).then_some(first)
}

impl Node for Executive {
    fn declare(&self, ports: &mut PortDecl) {
        let vector = |width: usize| InputSpec::vector(width).at_advance();
        ports
            .input("ready", InputSpec::scalar().at_advance())
            .input("goal", vector(self.states))
            .input("focus", vector(self.states))
            .input("action", vector(self.actions))
            .input("required", vector(self.states + 1))
            .input("open", vector(self.states))
            .input("chosen", vector(self.states))
            .input("barred", vector(self.states).optional())
            .input("present", vector(self.states))
            .output("load", OutputSpec::scalar().registered())
            .output("next", OutputSpec::vector(self.states).registered())
            .output("reachable", OutputSpec::vector(self.states).registered())
            .output("act", OutputSpec::scalar().registered())
            .output("trace", OutputSpec::vector(TRACE).registered())
            // The reals are the reachable states; the long is a hash of what is active.
            .state(StateSpec { reals: self.states, words: PATH + self.states, longs: 1 });
        let t = &self.timing;
        if t.load.is_zero() || t.settle.is_zero() || t.hold.is_zero() || t.patience <= t.settle {
            ports.fault(
                "the executive's waits must be above zero, and its patience longer than settling",
            );
        }
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        let Timing { load, settle, hold, patience } = self.timing;
        hash.text(&format!("{:?}", self.commitment));
        for wait in [load, settle, hold, patience] {
            hash.number(wait.as_micros());
        }
    }

    fn advance(&self, cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let inputs = io.inputs;
        let read = |port: usize| inputs.get(port);
        let ticks = |span: SimDuration| (span.as_secs_f64() / cx.dt_s()).ceil().max(1.0) as u32;
        let words = &mut *io.state.words;
        let reachable = &mut *io.state.reals;
        let phase = Phase::from_word(words[PHASE]);
        words[TIMER] = words[TIMER].saturating_add(1);

        // How long the active items have been the same.
        let mut hash = FNV_START;
        let compared: &[usize] = match phase {
            Phase::Idle => &[GOAL],
            _ => &[FOCUS, ACTION, REQUIRED, OPEN, CHOSEN, BARRED],
        };
        for port in compared {
            for value in read(*port) {
                hash = fnv1a_word(hash, u64::from(active(*value)));
            }
        }
        words[STABLE] = if io.state.longs[0] == hash { words[STABLE].saturating_add(1) } else { 0 };
        io.state.longs[0] = hash;
        let stable = words[STABLE] >= ticks(self.timing.hold);

        let mut walk = Walk { words, reachable };
        let ready = active(read(READY)[0]);
        match phase {
            Phase::Idle if ready => match only_active(read(GOAL)) {
                Some(goal) if stable && active(read(PRESENT)[goal]) => {
                    walk.words[SUBJECT] = goal as u32;
                    walk.enter(Phase::Met);
                }
                Some(goal) if stable => {
                    walk.words[TOP] = goal as u32;
                    walk.push(goal);
                }
                _ if walk.words[TIMER] > ticks(self.timing.patience) => walk.enter(Phase::Lost),
                _ => {}
            },
            Phase::Idle => walk.words[TIMER] = 0,
            Phase::Load => {
                let subject = walk.words[SUBJECT] as usize;
                if only_active(read(FOCUS)) != Some(subject) {
                    if walk.words[TIMER] > ticks(self.timing.patience) {
                        walk.enter(Phase::Lost);
                    }
                } else if walk.words[TIMER] >= ticks(self.timing.load) {
                    // The timer goes on: settling counts from the opening of the gate.
                    walk.words[PHASE] = Phase::Settle.word();
                }
            }
            Phase::Settle => {
                if stable && walk.words[TIMER] >= ticks(self.timing.settle) {
                    self.answer(&mut walk, &read);
                }
                if walk.words[PHASE] == Phase::Settle.word()
                    && walk.words[TIMER] > ticks(self.timing.patience)
                {
                    walk.enter(Phase::Lost);
                }
            }
            // An answer stands until it has been taken; then everything is forgotten.
            _ if !ready => {
                walk.words.fill(0);
                walk.reachable.fill(0.0);
            }
            _ => {}
        }

        let phase = Phase::from_word(walk.words[PHASE]);
        let outputs = &mut io.outputs;
        outputs.set(0, Real::from(phase == Phase::Load));
        let next = outputs.get_mut(1);
        next.fill(0.0);
        if matches!(phase, Phase::Load | Phase::Settle) {
            next[walk.words[SUBJECT] as usize] = 1.0;
        }
        outputs.get_mut(2).copy_from_slice(walk.reachable);
        outputs.set(3, Real::from(phase == Phase::Act));
        let trace = outputs.get_mut(4);
        for (value, word) in trace.iter_mut().zip([PHASE, EXAMINED, SUBJECT, SECOND]) {
            *value = walk.words[word] as Real;
        }
        Ok(())
    }
}

impl Executive {
    /// Draws the conclusion from a settled graph.
    fn answer<'a>(&self, walk: &mut Walk<'_>, read: &impl Fn(usize) -> &'a [Real]) {
        match first_active(read(ACTION)) {
            None => return walk.enter(Phase::NothingCauses),
            // Two actions at once: not settled yet.
            Some(_) if only_active(read(ACTION)).is_none() => return,
            Some(_) => {}
        }
        if walk.words[RECALLING] > 0 {
            walk.enter(Phase::Act);
            return;
        }
        let required = read(REQUIRED);
        if first_active(required).is_none() {
            return;
        }
        let present = read(PRESENT);
        let can_be_done =
            (0..self.states).all(|state| !active(required[state]) || active(present[state]));
        if can_be_done {
            if let Some(state) = first_active(read(BARRED)) {
                walk.words[SECOND] = state as u32;
                walk.enter(Phase::MustBeAbsent);
            } else {
                if walk.words[CANDIDATE] == 0 {
                    walk.words[CANDIDATE] = walk.words[SUBJECT] + 1;
                }
                self.within_reach(walk);
            }
            return;
        }
        match (first_active(read(OPEN)), only_active(read(CHOSEN))) {
            (None, _) => self.within_reach(walk),
            (Some(_), Some(next)) if walk.words[PATH + next] > 0 => {
                walk.words[SUBJECT] = next as u32;
                walk.enter(Phase::NeedsItself);
            }
            (Some(_), Some(next)) => walk.push(next),
            // Still choosing.
            (Some(_), None) => {}
        }
    }

    /// The state in question can be brought about: done, or back to the one that asked for it.
    fn within_reach(&self, walk: &mut Walk<'_>) {
        let subject = walk.words[SUBJECT] as usize;
        let done = walk.words[SUBJECT] == walk.words[TOP] || self.commitment == Commitment::First;
        if let (true, Some(candidate)) = (done, walk.words[CANDIDATE].checked_sub(1)) {
            if candidate as usize == subject {
                walk.enter(Phase::Act);
            } else {
                walk.words[RECALLING] = 1;
                walk.words[SUBJECT] = candidate;
                walk.words[EXAMINED] += 1;
                walk.enter(Phase::Load);
            }
            return;
        }
        walk.reachable[subject] = 1.0;
        walk.words[PATH + subject] = 0;
        walk.words[DEPTH] = walk.words[DEPTH].saturating_sub(1);
        let depth = walk.words[DEPTH];
        match (0..self.states).find(|s| depth > 0 && walk.words[PATH + s] == depth) {
            Some(back) => {
                walk.words[SUBJECT] = back as u32;
                walk.words[EXAMINED] += 1;
                walk.enter(Phase::Load);
            }
            None => walk.enter(Phase::Lost),
        }
    }
}

/// The executive's state, seen as a walk.
struct Walk<'a> {
    words: &'a mut [u32],
    reachable: &'a mut [Real],
}

impl Walk<'_> {
    fn enter(&mut self, phase: Phase) {
        self.words[PHASE] = phase.word();
        self.words[TIMER] = 0;
        self.words[STABLE] = 0;
    }

    /// Goes down to a state that is not on the path.
    fn push(&mut self, state: usize) {
        self.words[DEPTH] += 1;
        self.words[PATH + state] = self.words[DEPTH];
        self.words[SUBJECT] = state as u32;
        self.words[EXAMINED] += 1;
        self.enter(Phase::Load);
    }
}

impl Module for Executive {
    type Ports = ExecutivePorts;

    fn expand(self, scope: &mut Scope<'_>) -> ExecutivePorts {
        let node = scope.leaf(self);
        ExecutivePorts {
            ready: node.input("ready"),
            goal: node.input("goal"),
            focus: node.input("focus"),
            action: node.input("action"),
            required: node.input("required"),
            open: node.input("open"),
            chosen: node.input("chosen"),
            barred: node.input("barred"),
            present: node.input("present"),
            load: node.output("load"),
            next: node.output("next"),
            reachable: node.output("reachable"),
            act: node.output("act"),
            trace: node.output("trace"),
        }
    }
}
