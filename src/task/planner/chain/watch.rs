//! Watches a planner graph while it decides: notes milestones and choices among several causes.

use std::ops::ControlFlow;

use super::graph::PlanningPorts;
use super::walk::Phase;
use crate::sim::{SimView, StopReason};
use crate::task::planner::decision::{Choice, Stage, Why};
use crate::task::propositional::{ActionId, Domain, StateId, WorldState};

/// Notes when the graph's items last changed during a question.
pub(in crate::task::planner) struct Watch<'p> {
    domain: &'p Domain,
    ports: &'p PlanningPorts,
    world: &'p WorldState,
    active: Vec<Vec<bool>>,
    changed_ms: [f64; 5],
    asked: (u32, usize),
    pub last_phase: Phase,
    pub milestones: Vec<(u32, Stage, usize, f64)>,
    pub action: Option<ActionId>,
    pub choices: Vec<Choice>,
    /// The recalled action and the ruled-out actions, as last seen during this question.
    recalled: Option<ActionId>,
    ruled_out: Vec<bool>,
}

impl<'p> Watch<'p> {
    pub fn new(domain: &'p Domain, ports: &'p PlanningPorts, world: &'p WorldState) -> Self {
        Self {
            domain,
            ports,
            world,
            active: vec![Vec::new(); 5],
            changed_ms: [0.0; 5],
            asked: (0, 0),
            last_phase: Phase::Idle,
            milestones: Vec::new(),
            action: None,
            choices: Vec::new(),
            recalled: None,
            ruled_out: vec![false; domain.operators().len()],
        }
    }

    pub fn note(&mut self, question: u32, stage: Stage, subject: usize, time_ms: f64) {
        self.milestones.push((question, stage, subject, time_ms));
    }

    /// Notes the cause that the conclusion is about, if the state has several causes.
    fn note_choice(&mut self, question: u32, about: usize) {
        let (state, domain) = (StateId::new(about), self.domain);
        let (Some(action), true) = (self.recalled, about < domain.states().len()) else { return };
        let causes = domain.causes(state);
        let last = self.choices.iter().rev().find(|c| c.state == state);
        if causes.len() < 2 || !causes.contains(&action) || last.is_some_and(|c| c.action == action)
        {
            return;
        }
        let unmet = |action: ActionId| {
            domain[action].preconditions.iter().filter(|p| !self.world.holds(**p)).count()
        };
        let left = causes.iter().filter(|a| !self.ruled_out[a.index()]);
        let among = left.clone().count();
        let (own, least) = (unmet(action), left.clone().map(|a| unmet(*a)).min());
        let mut equal = left.filter(|a| Some(unmet(**a)) == least);
        let why = match (equal.next(), equal.next()) {
            _ if among == 1 => Why::OnlyOneLeft,
            (Some(first), None) if *first == action => Why::FewestUnmet { unmet: own },
            (Some(first), Some(_)) if *first == action => Why::Preferred { unmet: own },
            _ => Why::Imprecision,
        };
        self.choices.push(Choice { question, state, action, among, why });
    }

    pub fn look(&mut self, view: &SimView<'_>) -> ControlFlow<StopReason> {
        let now = view.time().as_millis_f64();
        for (index, output) in self.ports.watched.iter().enumerate() {
            let values = view.value(output);
            let was = &mut self.active[index];
            was.resize(values.len(), false);
            for (flag, value) in was.iter_mut().zip(values) {
                if *flag != (*value > 0.5) {
                    *flag = !*flag;
                    self.changed_ms[index] = now;
                }
            }
        }
        let trace = view.value(&self.ports.trace);
        let (phase, question, subject) =
            (Phase::from_trace(trace[0]), trace[1] as u32, trace[2] as usize);
        if self.last_phase == Phase::Settle && phase != Phase::Settle && phase != Phase::Lost {
            let (asked, about) = self.asked;
            let stages = [Stage::Goal, Stage::Action, Stage::Preconditions, Stage::Comparison];
            let mut after = 0.0;
            for (at, stage) in stages.into_iter().enumerate() {
                // The comparison ends with the choice. If no precondition is unmet, the comparison ends when the last
                // open item becomes inactive.
                let (reached, time) = match stage {
                    Stage::Comparison => {
                        let time = self.changed_ms[3].max(self.changed_ms[4]);
                        (phase != Phase::NothingCauses, time)
                    }
                    _ => (self.active[at].iter().any(|a| *a), self.changed_ms[at]),
                };
                if reached {
                    after = time.max(after);
                    self.note(asked, stage, about, after);
                }
            }
            self.note(asked, Stage::Conclusion, about, now);
            self.note_choice(asked, about);
        }
        if let (Some(flags), Phase::Settle) = (&self.ports.ruled_out, phase) {
            let recalled = view.value(&self.ports.recalled);
            self.recalled = recalled.iter().position(|a| *a > 0.5).map(ActionId::new);
            for (flag, value) in self.ruled_out.iter_mut().zip(view.value(flags)) {
                *flag = *value > 0.5;
            }
        }
        if phase != Phase::Lost {
            self.last_phase = phase;
            self.asked = (question, subject);
        }
        if phase.is_final() {
            let actions = view.value(&self.ports.actions);
            self.action = actions.iter().position(|a| *a > 0.5).map(ActionId::new);
            if phase != Phase::Act || self.action.is_some() {
                return ControlFlow::Break(StopReason::Condition("decided"));
            }
        }
        ControlFlow::Continue(())
    }
}
