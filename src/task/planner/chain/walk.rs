//! The executive's walk: from the goal down to an action that can be done, and back.
//!
//! The walk keeps a path of states and the set of reachable states. If every state has at most one cause, the
//! first failure ends the walk. If some states have several causes, an action that turns out to be impossible
//! is *ruled out*, and its state is examined again, until no cause is left. Then the state itself fails, and
//! with it the action that needed it.
//!
//! An action whose precondition is on the path may become possible once other states are reachable. It is ruled out
//! only *for now*, and is readmitted whenever another state becomes reachable. So the walk always ends, and it finds
//! the goal reachable exactly if the goal is reachable.

use crate::sim::Real;
use crate::task::propositional::{Commitment, Domain};

/// The executive's phase; the first number of its `trace`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::task::planner) enum Phase {
    /// Waiting for a request and for the goal to be recognised.
    Idle,
    /// Loading a state into the goal buffer.
    Load,
    /// Waiting for the graph to answer.
    Settle,
    /// The goal already holds.
    Met,
    /// The recalled action is the decision.
    Act,
    /// No action causes the examined state.
    NothingCauses,
    /// The second state in the trace must be absent but holds.
    MustBeAbsent,
    /// Reaching the state in the trace requires the state itself.
    NeedsItself,
    /// The goal is not a state of the domain, or the graph's answer did not settle.
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

    pub fn from_word(word: u32) -> Self {
        Self::ALL.get(word as usize).copied().unwrap_or(Self::Lost)
    }

    pub fn word(self) -> u32 {
        Self::ALL.iter().position(|p| *p == self).unwrap_or(0) as u32
    }

    pub fn is_final(self) -> bool {
        !matches!(self, Self::Idle | Self::Load | Self::Settle)
    }
}

// State words. Behind them stand, for each state: its place on the path, counted from 1, or 0 if it is not on the path;
// the action being tried for it; the first step towards it.
pub(in crate::task::planner) const PHASE: usize = 0;
pub(in crate::task::planner) const EXAMINED: usize = 1;
pub(in crate::task::planner) const SUBJECT: usize = 2;
pub(in crate::task::planner) const SECOND: usize = 3;
pub(in crate::task::planner) const TIMER: usize = 4;
pub(in crate::task::planner) const STABLE: usize = 5;
pub(in crate::task::planner) const TOP: usize = 6;
const DEPTH: usize = 7;
const RECALLING: usize = 8;
/// The action that an obstacle concerns.
pub(in crate::task::planner) const ACTION: usize = 9;
const PATH: usize = 10;

/// Number of words for each action: whether it is ruled out, and the fault.
const OF_ACTION: usize = 5;

const ALLOWED: u32 = 0;
const FOR_GOOD: u32 = 1;
const FOR_NOW: u32 = 2;

/// Why an action or a state is impossible.
#[derive(Clone, Copy)]
struct Fault {
    phase: Phase,
    state: u32,
    second: u32,
    action: u32,
}

/// The rules of a walk.
#[derive(Debug)]
pub(in crate::task::planner) struct Rules {
    pub states: usize,
    pub actions: usize,
    /// Whether some state has several causes.
    pub several: bool,
    /// For each state, the indices of its causes, in order of preference.
    causes: Vec<Vec<usize>>,
    commitment: Commitment,
}

impl Rules {
    pub fn new(domain: &Domain, commitment: Commitment) -> Self {
        let causes = |state| domain.causes(state).iter().map(|a| a.index()).collect();
        let causes: Vec<Vec<usize>> = domain.state_ids().map(causes).collect();
        let several = causes.iter().any(|causes| causes.len() > 1);
        let (states, actions) = (causes.len(), domain.operators().len());
        Self { states, actions, several, causes, commitment }
    }

    /// Number of state words that a walk uses.
    pub fn words(&self) -> usize {
        PATH + 3 * self.states + OF_ACTION * self.actions
    }

    /// Number of real state values that a walk uses: reachable states, then ruled-out actions.
    pub fn reals(&self) -> usize {
        self.states + self.actions
    }
}

/// The settled graph's answer about the examined state.
pub(in crate::task::planner) struct Answer<'a> {
    /// The recalled action.
    pub action: usize,
    /// The action's preconditions, then one more number for "no precondition".
    pub required: &'a [Real],
    pub present: &'a [Real],
    /// The first state that holds but must be absent.
    pub violated: Option<usize>,
    /// Whether some precondition neither holds nor is reachable. `chosen` is one such precondition.
    pub unmet: bool,
    pub chosen: Option<usize>,
}

/// Whether an item counts as active.
pub(in crate::task::planner) fn active(value: Real) -> bool {
    value > 0.5
}

/// The executive's state, interpreted as a walk.
pub(in crate::task::planner) struct Walk<'a> {
    pub rules: &'a Rules,
    pub words: &'a mut [u32],
    pub reals: &'a mut [Real],
}

impl Walk<'_> {
    pub fn enter(&mut self, phase: Phase) {
        self.words[PHASE] = phase.word();
        self.words[TIMER] = 0;
        self.words[STABLE] = 0;
    }

    pub fn subject(&self) -> usize {
        self.words[SUBJECT] as usize
    }

    /// Whether the walk is recalling the action found to be the first step.
    pub fn recalling(&self) -> bool {
        self.words[RECALLING] > 0
    }

    /// Examines a state that is not on the path yet.
    pub fn push(&mut self, state: usize) {
        self.words[DEPTH] += 1;
        self.words[PATH + state] = self.words[DEPTH];
        let (tried, first) = (self.tried(state), self.first(state));
        self.words[tried] = 0;
        self.words[first] = 0;
        self.ask(state);
    }

    /// Starts a question about a state, which may have been examined before.
    fn ask(&mut self, state: usize) {
        self.words[SUBJECT] = state as u32;
        self.words[EXAMINED] += 1;
        self.enter(Phase::Load);
    }

    /// Takes the examined state off the path and returns the state before it.
    fn pop(&mut self) -> Option<usize> {
        let subject = self.subject();
        self.words[PATH + subject] = 0;
        self.words[DEPTH] = self.words[DEPTH].saturating_sub(1);
        let depth = self.words[DEPTH];
        (0..self.rules.states).find(|s| depth > 0 && self.words[PATH + s] == depth)
    }

    /// Draws the conclusion about the examined state; does nothing if the answer is not complete yet.
    pub fn conclude(&mut self, answer: &Answer<'_>) {
        let (subject, action) = (self.subject(), answer.action);
        if self.rules.several {
            if let Some((fault, for_now)) = self.exhausted(subject) {
                return self.state_failed(fault, for_now);
            }
            // A graph of noisy neurons may recall an action that is ruled out or causes another state.
            if self.ruled_out(action) != ALLOWED || !self.rules.causes[subject].contains(&action) {
                return;
            }
            self.begin(subject, action);
        }
        let first = self.first(subject);
        if self.can_be_done(answer) {
            if let Some(state) = answer.violated {
                return self.rule_out(Fault::absent(subject, state, action), false);
            }
            if self.words[first] == 0 {
                self.words[first] = subject as u32 + 1;
            }
            return self.proven();
        }
        if !answer.unmet {
            if self.words[first] == 0 {
                let reached = |s: &usize| {
                    active(answer.required[*s])
                        && !active(answer.present[*s])
                        && active(self.reals[*s])
                };
                let below = (0..self.rules.states).find(reached);
                self.words[first] = below.map_or(0, |s| self.words[self.first(s)]);
            }
            return self.proven();
        }
        // Without a choice, the graph is still choosing.
        let Some(next) = answer.chosen else { return };
        if self.words[PATH + next] > 0 {
            return self.rule_out(Fault::circle(next), true);
        }
        match self.exhausted(next) {
            Some((fault, for_now)) if !self.rules.causes[next].is_empty() => {
                self.rule_out(fault, for_now);
            }
            _ => self.push(next),
        }
    }

    fn can_be_done(&self, answer: &Answer<'_>) -> bool {
        (0..self.rules.states).all(|s| !active(answer.required[s]) || active(answer.present[s]))
    }

    /// Notes the action that is tried for a state.
    fn begin(&mut self, state: usize, action: usize) {
        let (tried, first) = (self.tried(state), self.first(state));
        if self.words[tried] != action as u32 + 1 {
            self.words[tried] = action as u32 + 1;
            self.words[first] = 0;
        }
    }

    /// Handles an answer in which no action is recalled.
    pub fn nothing_causes(&mut self) {
        let subject = self.subject();
        if !self.rules.several {
            return self.end(Fault::nothing(subject));
        }
        // If some cause is not ruled out, the contest has no winner yet: wait.
        if let Some((fault, for_now)) = self.exhausted(subject) {
            self.state_failed(fault, for_now);
        }
    }

    /// Ends the walk: the goal cannot be reached.
    fn end(&mut self, fault: Fault) {
        self.words[SUBJECT] = fault.state;
        self.words[SECOND] = fault.second;
        self.words[ACTION] = fault.action;
        self.enter(fault.phase);
    }

    /// Word that holds the action being tried for a state on the path, counted from 1. Kept only if some state has several
    /// causes.
    fn tried(&self, state: usize) -> usize {
        PATH + self.rules.states + state
    }

    /// Word that holds the state, counted from 1, whose action is the first step towards `state`.
    fn first(&self, state: usize) -> usize {
        PATH + 2 * self.rules.states + state
    }

    fn of_action(&self, action: usize) -> usize {
        PATH + 3 * self.rules.states + OF_ACTION * action
    }

    fn ruled_out(&self, action: usize) -> u32 {
        self.words[self.of_action(action)]
    }

    fn fault(&self, action: usize) -> Fault {
        let at = self.of_action(action);
        let [phase, state, second, action] = std::array::from_fn(|i| self.words[at + 1 + i]);
        Fault { phase: Phase::from_word(phase), state, second, action }
    }

    /// If all causes of a state are ruled out, returns the fault, and whether it holds only for now.
    fn exhausted(&self, state: usize) -> Option<(Fault, bool)> {
        let causes = &self.rules.causes[state];
        let Some(preferred) = causes.first() else {
            return Some((Fault::nothing(state), false));
        };
        if causes.iter().any(|a| self.ruled_out(*a) == ALLOWED) {
            return None;
        }
        Some((self.fault(*preferred), causes.iter().any(|a| self.ruled_out(*a) == FOR_NOW)))
    }

    /// Handles a reachable state: finishes, or returns to the state that needed it.
    fn proven(&mut self) {
        let subject = self.subject();
        let step = self.words[self.first(subject)];
        let done =
            self.words[SUBJECT] == self.words[TOP] || self.rules.commitment == Commitment::First;
        if let (true, Some(candidate)) = (done, step.checked_sub(1)) {
            if candidate as usize == subject {
                self.enter(Phase::Act);
            } else {
                self.words[RECALLING] = 1;
                self.ask(candidate as usize);
            }
            return;
        }
        self.let_in_again();
        self.reals[subject] = 1.0;
        let Some(back) = self.pop() else { return self.enter(Phase::Lost) };
        let first = self.first(back);
        if self.words[first] == 0 {
            self.words[first] = step;
        }
        self.ask(back);
    }

    /// Rules out the action being tried for the examined state and asks for another.
    fn rule_out(&mut self, fault: Fault, for_now: bool) {
        if !self.rules.several {
            return self.end(fault);
        }
        let subject = self.subject();
        let (tried, first) = (self.tried(subject), self.first(subject));
        let Some(tried) = self.words[tried].checked_sub(1) else {
            return self.enter(Phase::Lost);
        };
        let at = self.of_action(tried as usize);
        let Fault { phase, state, second, action } = fault;
        let word = if for_now { FOR_NOW } else { FOR_GOOD };
        self.words[at..at + OF_ACTION].copy_from_slice(&[
            word,
            phase.word(),
            state,
            second,
            action,
        ]);
        self.reals[self.rules.states + tried as usize] = 1.0;
        self.words[first] = 0;
        match self.exhausted(subject) {
            Some((fault, for_now)) => self.state_failed(fault, for_now),
            None => self.ask(subject),
        }
    }

    /// Handles a state that cannot be reached: rules out the action that needed it.
    fn state_failed(&mut self, fault: Fault, for_now: bool) {
        if self.words[SUBJECT] == self.words[TOP] {
            return self.end(fault);
        }
        let Some(back) = self.pop() else { return self.enter(Phase::Lost) };
        self.words[SUBJECT] = back as u32;
        self.rule_out(fault, for_now);
    }

    /// Readmits the actions that were ruled out for now.
    fn let_in_again(&mut self) {
        for action in 0..self.rules.actions {
            let at = self.of_action(action);
            if self.words[at] == FOR_NOW {
                self.words[at] = ALLOWED;
                self.reals[self.rules.states + action] = 0.0;
            }
        }
    }
}

impl Fault {
    fn nothing(state: usize) -> Self {
        Self { phase: Phase::NothingCauses, state: state as u32, second: 0, action: 0 }
    }

    fn circle(state: usize) -> Self {
        Self { phase: Phase::NeedsItself, state: state as u32, second: 0, action: 0 }
    }

    fn absent(state: usize, second: usize, action: usize) -> Self {
        let [state, second, action] = [state, second, action].map(|v| v as u32);
        Self { phase: Phase::MustBeAbsent, state, second, action }
    }
}
