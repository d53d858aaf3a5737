//! The executive's walk from the goal down to what can be done, and back.
//!
//! The walk keeps a path of states and the set of states shown to be within reach. Where every state has one
//! cause, the first failure ends it. Where some have several, an action that turned out impossible is *ruled out*
//! and its state is asked again, until no cause is left; then the state itself fails, and with it the action that
//! asked for it.
//!
//! An action ruled out because its precondition is on the path may be possible once other states are within reach:
//! it is ruled out *for now*, and such actions are let in again with every state that comes within reach. So the
//! walk ends, and it ends at the goal if and only if the goal has a proof.

use super::executive::Phase;
use crate::sim::Real;
use crate::task::domain::{Commitment, Domain};

// Words of state. The path follows them, one word a state: its place on the path, 0 for off it.
pub(super) const PHASE: usize = 0;
pub(super) const EXAMINED: usize = 1;
pub(super) const SUBJECT: usize = 2;
pub(super) const SECOND: usize = 3;
pub(super) const TIMER: usize = 4;
pub(super) const STABLE: usize = 5;
const CANDIDATE: usize = 6;
pub(super) const TOP: usize = 7;
const DEPTH: usize = 8;
const RECALLING: usize = 9;
/// The action that an obstacle is about.
pub(super) const ACTION: usize = 10;
const PATH: usize = 11;

/// Words an action has of its own, where states have several causes: whether it is ruled out, and the fault.
const OF_ACTION: usize = 5;

const ALLOWED: u32 = 0;
const FOR_GOOD: u32 = 1;
const FOR_NOW: u32 = 2;

/// The causes of every state, where some state has several.
#[derive(Debug)]
pub(super) struct Alternatives {
    /// For each state, its causes by their places, preferred ones first.
    causes: Vec<Vec<usize>>,
    actions: usize,
}

impl Alternatives {
    /// `None` if no state has several causes.
    pub fn of(domain: &Domain) -> Option<Self> {
        let causes: Vec<Vec<usize>> = domain
            .state_ids()
            .map(|state| domain.causes(state).iter().map(|a| a.index()).collect())
            .collect();
        let several = causes.iter().any(|c: &Vec<usize>| c.len() > 1);
        several.then(|| Self { causes, actions: domain.operators().len() })
    }
}

/// Why an action or a state is impossible.
#[derive(Clone, Copy)]
struct Fault {
    phase: Phase,
    state: u32,
    second: u32,
    action: u32,
}

/// How a walk is done.
#[derive(Debug)]
pub(super) struct Rules {
    pub states: usize,
    pub commitment: Commitment,
    pub alternatives: Option<Alternatives>,
}

impl Rules {
    /// How many words a walk keeps.
    pub fn words(&self) -> usize {
        let more = self.alternatives.as_ref();
        // The action under which each state on the path is tried, and the first step towards each state.
        PATH + self.states + more.map_or(0, |a| 2 * self.states + OF_ACTION * a.actions)
    }

    /// How many numbers a walk keeps: the reachable states, and the actions ruled out.
    pub fn reals(&self) -> usize {
        self.states + self.alternatives.as_ref().map_or(0, |a| a.actions)
    }
}

/// What the settled graph says of the state in question.
pub(super) struct Answer<'a> {
    /// The action that is recalled.
    pub action: usize,
    /// Which states it needs; one more number at the end, for none.
    pub required: &'a [Real],
    pub present: &'a [Real],
    /// The first state that holds and must be absent.
    pub violated: Option<usize>,
    /// Whether needed states are left that neither hold nor are within reach, and the one chosen.
    pub unmet: bool,
    pub chosen: Option<usize>,
}

fn active(value: Real) -> bool {
    value > 0.5
}

/// The executive's state, seen as a walk.
pub(super) struct Walk<'a> {
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

    /// Whether the action that was found to be the first step is being recalled.
    pub fn recalling(&self) -> bool {
        self.words[RECALLING] > 0
    }

    /// Goes down to a state that is not on the path.
    pub fn push(&mut self, state: usize) {
        self.words[DEPTH] += 1;
        self.words[PATH + state] = self.words[DEPTH];
        if self.rules.alternatives.is_some() {
            let (tried, first) = (self.tried(state), self.first(state));
            self.words[tried] = 0;
            self.words[first] = 0;
        }
        self.ask(state);
    }

    /// Looks at a state, perhaps again.
    fn ask(&mut self, state: usize) {
        self.words[SUBJECT] = state as u32;
        self.words[EXAMINED] += 1;
        self.enter(Phase::Load);
    }

    /// Takes the state in question off the path; the one before it.
    fn pop(&mut self) -> Option<usize> {
        let subject = self.subject();
        self.words[PATH + subject] = 0;
        self.words[DEPTH] = self.words[DEPTH].saturating_sub(1);
        let depth = self.words[DEPTH];
        (0..self.rules.states).find(|s| depth > 0 && self.words[PATH + s] == depth)
    }

    /// Draws the conclusion about the state in question; none if the answer makes no sense yet.
    pub fn conclude(&mut self, answer: &Answer<'_>) {
        if self.rules.alternatives.is_some() {
            return self.weigh(answer);
        }
        let can_be_done = self.can_be_done(answer);
        match (answer.violated, answer.chosen) {
            (Some(state), _) if can_be_done => {
                self.end(Fault::absent(self.subject(), state, answer.action));
            }
            _ if can_be_done => {
                if self.words[CANDIDATE] == 0 {
                    self.words[CANDIDATE] = self.words[SUBJECT] + 1;
                }
                self.within_reach();
            }
            _ if !answer.unmet => self.within_reach(),
            (_, Some(next)) if self.words[PATH + next] > 0 => self.end(Fault::circle(next)),
            (_, Some(next)) => self.push(next),
            // Still choosing.
            (_, None) => {}
        }
    }

    fn can_be_done(&self, answer: &Answer<'_>) -> bool {
        (0..self.rules.states).all(|s| !active(answer.required[s]) || active(answer.present[s]))
    }

    /// No action is recalled for the state in question.
    pub fn nothing_causes(&mut self) {
        if self.rules.alternatives.is_none() {
            return self.end(Fault::nothing(self.subject()));
        }
        let subject = self.subject();
        // Otherwise it has causes that are allowed, and none has won yet.
        if let Some((fault, for_now)) = self.exhausted(subject) {
            self.state_failed(fault, for_now);
        }
    }

    /// The goal cannot be had.
    fn end(&mut self, fault: Fault) {
        self.words[SUBJECT] = fault.state;
        self.words[SECOND] = fault.second;
        self.words[ACTION] = fault.action;
        self.enter(fault.phase);
    }

    /// The state in question can be brought about: done, or back to the one that asked for it.
    fn within_reach(&mut self) {
        let subject = self.subject();
        let done =
            self.words[SUBJECT] == self.words[TOP] || self.rules.commitment == Commitment::First;
        if let (true, Some(candidate)) = (done, self.words[CANDIDATE].checked_sub(1)) {
            if candidate as usize == subject {
                self.enter(Phase::Act);
            } else {
                self.words[RECALLING] = 1;
                self.ask(candidate as usize);
            }
            return;
        }
        self.reals[subject] = 1.0;
        match self.pop() {
            Some(back) => self.ask(back),
            None => self.enter(Phase::Lost),
        }
    }
}

/// The walk where states have several causes.
impl Walk<'_> {
    /// The action under which a state on the path is tried, from 1.
    fn tried(&self, state: usize) -> usize {
        PATH + self.rules.states + state
    }

    /// The state, from 1, whose action is the first step towards a state.
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

    fn causes(&self, state: usize) -> &[usize] {
        self.rules.alternatives.as_ref().map_or(&[], |a| &a.causes[state])
    }

    /// Why a state cannot be brought about, if all its causes are ruled out, and whether only for now.
    fn exhausted(&self, state: usize) -> Option<(Fault, bool)> {
        let causes = self.causes(state);
        let Some(preferred) = causes.first() else {
            return Some((Fault::nothing(state), false));
        };
        if causes.iter().any(|a| self.ruled_out(*a) == ALLOWED) {
            return None;
        }
        Some((self.fault(*preferred), causes.iter().any(|a| self.ruled_out(*a) == FOR_NOW)))
    }

    fn weigh(&mut self, answer: &Answer<'_>) {
        let (subject, action) = (self.subject(), answer.action);
        if let Some((fault, for_now)) = self.exhausted(subject) {
            return self.state_failed(fault, for_now);
        }
        // A graph of noisy neurons may recall what is ruled out, or what causes something else.
        if self.ruled_out(action) != ALLOWED || !self.causes(subject).contains(&action) {
            return;
        }
        let (tried, first) = (self.tried(subject), self.first(subject));
        if self.words[tried] != action as u32 + 1 {
            self.words[tried] = action as u32 + 1;
            self.words[first] = 0;
        }
        if self.can_be_done(answer) {
            match answer.violated {
                Some(state) => self.rule_out(action, Fault::absent(subject, state, action), false),
                None => {
                    self.words[first] = subject as u32 + 1;
                    self.proven();
                }
            }
            return;
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
        let Some(next) = answer.chosen else { return };
        if self.words[PATH + next] > 0 {
            self.rule_out(action, Fault::circle(next), true);
        } else if let Some((fault, for_now)) =
            self.exhausted(next).filter(|_| self.has_causes(next))
        {
            self.rule_out(action, fault, for_now);
        } else {
            self.push(next);
        }
    }

    fn has_causes(&self, state: usize) -> bool {
        !self.causes(state).is_empty()
    }

    /// The state in question can be brought about.
    fn proven(&mut self) {
        let subject = self.subject();
        let step = self.words[self.first(subject)];
        self.words[CANDIDATE] = step;
        if subject as u32 == self.words[TOP] || self.rules.commitment == Commitment::First {
            return self.within_reach();
        }
        self.let_in_again();
        self.reals[subject] = 1.0;
        match self.pop() {
            Some(back) => {
                let first = self.first(back);
                if self.words[first] == 0 {
                    self.words[first] = step;
                }
                self.ask(back);
            }
            None => self.enter(Phase::Lost),
        }
    }

    /// The action under which the state in question is tried is impossible: asks for another.
    fn rule_out(&mut self, action: usize, fault: Fault, for_now: bool) {
        let at = self.of_action(action);
        let Fault { phase, state, second, action: about } = fault;
        let word = if for_now { FOR_NOW } else { FOR_GOOD };
        self.words[at..at + OF_ACTION].copy_from_slice(&[word, phase.word(), state, second, about]);
        self.reals[self.rules.states + action] = 1.0;
        let subject = self.subject();
        let first = self.first(subject);
        self.words[first] = 0;
        match self.exhausted(subject) {
            Some((fault, for_now)) => self.state_failed(fault, for_now),
            None => self.ask(subject),
        }
    }

    /// The state in question cannot be brought about: neither can what asked for it, in this way.
    fn state_failed(&mut self, fault: Fault, for_now: bool) {
        if self.words[SUBJECT] == self.words[TOP] {
            return self.end(fault);
        }
        let Some(back) = self.pop() else { return self.enter(Phase::Lost) };
        self.words[SUBJECT] = back as u32;
        match self.words[self.tried(back)].checked_sub(1) {
            Some(action) => self.rule_out(action as usize, fault, for_now),
            None => self.enter(Phase::Lost),
        }
    }

    /// Actions ruled out for now are allowed: another state is within reach.
    fn let_in_again(&mut self) {
        let actions = self.rules.alternatives.as_ref().map_or(0, |a| a.actions);
        for action in 0..actions {
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
