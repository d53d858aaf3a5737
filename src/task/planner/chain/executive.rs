//! The executive: the planner's control. It opens the graph's gates and decides when a question is answered.
//!
//! The executive is control, not representation. It reads which items of the graph's memories are active, and writes
//! gates and one-hot item vectors. It holds no pointers and has no neural form. It walks from the goal along unmet
//! preconditions. It remembers its path, to detect circles and to find the way back, and the states shown to be
//! reachable ([`walk`](super::walk)):
//!
//! 1. *Load*: load the examined state into the goal buffer, then close the buffer's gate.
//! 2. *Settle*: wait for the graph to recall the action that causes the state, the action's preconditions, and which of
//!    them are unmet.
//! 3. *Conclude*. If no action is active, nothing causes the state: stuck. If all preconditions hold, the action can be
//!    done, and the executive remembers the first state for which this is so. If some preconditions neither hold nor
//!    are reachable, the graph chooses one of them, and the executive examines it next. If the chosen state is already
//!    on the path, it needs itself: stuck. If every precondition holds or is reachable, the examined state is reachable
//!    too.
//! 4. *Return*: take a reachable state off the path and examine the state before it again. If the reachable state is
//!    the goal, load the remembered state again and open the motor gate for its action.
//! 5. If states have several causes, *stuck* only rules out the current action. The executive tells the graph which
//!    actions are ruled out and examines the state again.
//!
//! An answer counts as settled once the active items have stayed the same for [`Timing::hold`], but not before
//! [`Timing::settle`] has passed since loading began.

use super::walk::{
    ACTION, Answer, EXAMINED, PHASE, Phase, Rules, SECOND, STABLE, SUBJECT, TIMER, TOP, Walk,
    active,
};
use crate::sim::{
    AdvanceIo, FNV_START, Fingerprint, InputSpec, Module, Node, NodeFault, NodePorts, OutputSpec,
    PortDecl, Real, Scope, SimDuration, StateSpec, StepCx, fnv1a_word,
};
use crate::task::propositional::{Commitment, Domain};

/// The executive's waits, in simulated time. Each must be above zero, and `patience` longer than `settle`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timing {
    /// Time for which the goal buffer's gate stays open.
    pub load: SimDuration,
    /// Time after the opening of the gate before which no answer counts. It must exceed the delay from the goal buffer
    /// to the choice of an unmet precondition: six synapses.
    pub settle: SimDuration,
    /// Time for which the active items must stay the same.
    pub hold: SimDuration,
    /// Time after which the executive gives up on an answer that does not settle.
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

/// The executive as a node.
pub(crate) struct Executive {
    timing: Timing,
    rules: Rules,
}

/// Width of the trace.
pub(crate) const TRACE: usize = 5;

// Inputs, in the order of declaration.
const READY: usize = 0;
const GOAL: usize = 1;
const FOCUS: usize = 2;
const RECALLED: usize = 3;
const REQUIRED: usize = 4;
const UNMET: usize = 5;
const CHOSEN: usize = 6;
const VIOLATED: usize = 7;
const PRESENT: usize = 8;

impl Executive {
    pub fn new(domain: &Domain, commitment: Commitment, timing: Timing) -> Self {
        Self { timing, rules: Rules::new(domain, commitment) }
    }
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
        // Every vector has one number for each item: 1 if it is active.
        let Rules { states, actions, .. } = self.rules;
        let vector = |width: usize| InputSpec::vector(width).at_advance();
        let shown = |width: usize| OutputSpec::vector(width).registered();
        ports
            // 1 while a decision is requested.
            .input("ready", InputSpec::scalar().at_advance())
            // The state that is the goal, and that in the goal buffer.
            .input("goal", vector(states))
            .input("focus", vector(states))
            // The action recalled as the cause of the state in the goal buffer.
            .input("action", vector(actions))
            // The action's preconditions, then one more item that is active if there are none.
            .input("required", vector(states + 1))
            // Preconditions that neither hold nor are reachable, and one of them.
            .input("unmet", vector(states))
            .input("chosen", vector(states))
            // States that hold but must be absent.
            .input("violated", vector(states).optional())
            // States that hold.
            .input("present", vector(states))
            // 1 while the goal buffer's gate is open, and the state to load into the buffer.
            .output("load", OutputSpec::scalar().registered())
            .output("next", shown(states))
            // States shown to be reachable.
            .output("reachable", shown(states))
            // 1 while the motor gate is open for the recalled action.
            .output("act", OutputSpec::scalar().registered())
            // Phase, number of questions so far, the examined state, a second state, an action.
            .output("trace", shown(TRACE))
            // The long is a hash of the active items.
            .state(StateSpec { reals: self.rules.reals(), words: self.rules.words(), longs: 1 });
        if self.rules.several {
            // Actions that turned out to be impossible.
            ports.output("ruled_out", shown(actions));
        }
        let t = &self.timing;
        if t.load.is_zero() || t.settle.is_zero() || t.hold.is_zero() || t.patience <= t.settle {
            ports.fault(
                "the planner's timing is unusable; expected waits above zero and `patience` longer than `settle`",
            );
        }
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        let Timing { load, settle, hold, patience } = self.timing;
        hash.text(&format!("{:?}", self.rules));
        for wait in [load, settle, hold, patience] {
            hash.number(wait.as_micros());
        }
    }

    fn advance(&self, cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let inputs = io.inputs;
        let read = |port: usize| inputs.get(port);
        let ticks = |span: SimDuration| (span.as_secs_f64() / cx.dt_s()).ceil().max(1.0) as u32;
        let words = &mut *io.state.words;
        let phase = Phase::from_word(words[PHASE]);
        words[TIMER] = words[TIMER].saturating_add(1);

        // Count the ticks for which the active items have stayed the same.
        let mut hash = FNV_START;
        let compared: &[usize] = match phase {
            Phase::Idle => &[GOAL],
            _ => &[FOCUS, RECALLED, REQUIRED, UNMET, CHOSEN, VIOLATED],
        };
        for port in compared {
            for value in read(*port) {
                hash = fnv1a_word(hash, u64::from(active(*value)));
            }
        }
        words[STABLE] = if io.state.longs[0] == hash { words[STABLE].saturating_add(1) } else { 0 };
        io.state.longs[0] = hash;
        let stable = words[STABLE] >= ticks(self.timing.hold);

        let mut walk = Walk { rules: &self.rules, words, reals: &mut *io.state.reals };
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
                let subject = walk.subject();
                if only_active(read(FOCUS)) != Some(subject) {
                    if walk.words[TIMER] > ticks(self.timing.patience) {
                        walk.enter(Phase::Lost);
                    }
                } else if walk.words[TIMER] >= ticks(self.timing.load) {
                    // The timer is not reset: settling counts from the opening of the gate.
                    walk.words[PHASE] = Phase::Settle.word();
                }
            }
            Phase::Settle => {
                if stable && walk.words[TIMER] >= ticks(self.timing.settle) {
                    Self::answer(&mut walk, &read);
                }
                if walk.words[PHASE] == Phase::Settle.word()
                    && walk.words[TIMER] > ticks(self.timing.patience)
                {
                    walk.enter(Phase::Lost);
                }
            }
            // The answer stands until `ready` falls; then the executive forgets everything.
            _ if !ready => {
                walk.words.fill(0);
                walk.reals.fill(0.0);
            }
            _ => {}
        }

        let phase = Phase::from_word(walk.words[PHASE]);
        let outputs = &mut io.outputs;
        outputs.set(0, Real::from(phase == Phase::Load));
        let next = outputs.get_mut(1);
        next.fill(0.0);
        if matches!(phase, Phase::Load | Phase::Settle) {
            next[walk.subject()] = 1.0;
        }
        let (reachable, ruled_out) = walk.reals.split_at(self.rules.states);
        outputs.get_mut(2).copy_from_slice(reachable);
        outputs.set(3, Real::from(phase == Phase::Act));
        let trace = outputs.get_mut(4);
        for (value, word) in trace.iter_mut().zip([PHASE, EXAMINED, SUBJECT, SECOND, ACTION]) {
            *value = walk.words[word] as Real;
        }
        if self.rules.several {
            outputs.get_mut(5).copy_from_slice(ruled_out);
        }
        Ok(())
    }
}

impl Executive {
    /// Draws the conclusion from a settled graph.
    fn answer<'a>(walk: &mut Walk<'_>, read: &impl Fn(usize) -> &'a [Real]) {
        let recalled = read(RECALLED);
        let action = match (first_active(recalled), only_active(recalled)) {
            (None, _) => return walk.nothing_causes(),
            // Two actions at once: not settled yet.
            (Some(_), None) => return,
            (Some(_), Some(action)) => action,
        };
        if walk.recalling() {
            walk.enter(Phase::Act);
            return;
        }
        let required = read(REQUIRED);
        if first_active(required).is_none() {
            return;
        }
        walk.conclude(&Answer {
            action,
            required,
            present: read(PRESENT),
            violated: first_active(read(VIOLATED)),
            unmet: first_active(read(UNMET)).is_some(),
            chosen: only_active(read(CHOSEN)),
        });
    }
}

impl Module for Executive {
    type Ports = NodePorts;

    fn expand(self, scope: &mut Scope<'_>) -> NodePorts {
        scope.leaf(self)
    }
}
