//! What a planner of goal sets does, step by step, read from its phases.

use super::control::Phase;
use super::forward::control::Phase as Forward;
use crate::sim::Real;

/// A step of the planner's work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// It begins to plan, or begins anew.
    Start,
    /// It knows how far each fluent is from what holds.
    Costs,
    /// It has chosen an operator, and goes on with the goal set before it; forward, with the state after it.
    GoalSet {
        /// Position of the operator.
        operator: usize,
    },
    /// It leaves a goal set or state from which no operator leads on.
    DeadEnd,
    /// The goal set holds; forward, the state has the goal: the plan is found.
    Plan,
}

/// A step, and when it began.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Moment {
    /// Simulated time in milliseconds.
    pub ms: u64,
    /// What began.
    pub step: Step,
    /// Whether the search forward did it.
    pub forward: bool,
}

/// Activity above which a phase is active, and below which it is over. Noise between the two counts for nothing.
const ACTIVE: Real = 0.5;
const OVER: Real = 0.3;

/// The phases in which each step begins, as positions. `written` is a new set; what `costs` follows is a wave.
struct Watched {
    forward: bool,
    start: usize,
    wave: usize,
    costs: usize,
    written: usize,
    dead_end: usize,
    plan: usize,
}

const BACKWARD: Watched = Watched {
    forward: false,
    start: Phase::Start as usize,
    wave: Phase::Wave as usize,
    costs: Phase::Race as usize,
    written: Phase::Write as usize,
    dead_end: Phase::Back as usize,
    plan: Phase::Begin as usize,
};

const FORWARD: Watched = Watched {
    forward: true,
    start: Forward::Start as usize,
    wave: Forward::Wave as usize,
    costs: Forward::Race as usize,
    written: Forward::Write as usize,
    dead_end: Forward::Back as usize,
    plan: Forward::Step as usize,
};

/// Finds the steps in the activities of the phases.
///
/// While one phase follows another, both are active for a moment. So each is followed by itself.
pub(crate) struct Moments {
    watched: &'static Watched,
    active: Vec<bool>,
    /// The wave has passed, and no race has begun since.
    waved: bool,
    /// Whether no plan was found since it began.
    searching: bool,
    pub all: Vec<Moment>,
}

impl Default for Moments {
    fn default() -> Self {
        Self::of(&BACKWARD, Phase::ALL.len())
    }
}

impl Moments {
    fn of(watched: &'static Watched, phases: usize) -> Self {
        Self {
            watched,
            active: vec![false; phases],
            waved: false,
            searching: true,
            all: Vec::new(),
        }
    }

    /// Returns the steps of forward search.
    pub fn forward() -> Self {
        Self::of(&FORWARD, Forward::ALL.len())
    }

    /// Takes the activities of all phases and of the winners of the race at one time.
    pub fn look(&mut self, ms: u64, phases: &[Real], winner: &[Real]) {
        for (phase, activity) in phases.iter().enumerate() {
            let active = &mut self.active[phase];
            let began = !*active && *activity > ACTIVE;
            *active = began || (*active && *activity >= OVER);
            if !began {
                continue;
            }
            let Watched { forward, start, wave, costs, written, dead_end, plan } = *self.watched;
            let all = winner.iter().enumerate();
            let most = all.max_by(|a, b| a.1.total_cmp(b.1)).filter(|most| *most.1 > OVER);
            let step = match phase {
                phase if phase == start => Some(Step::Start),
                phase if phase == wave => {
                    self.waved = true;
                    None
                }
                phase if phase == costs => std::mem::take(&mut self.waved).then_some(Step::Costs),
                phase if phase == written => most.map(|(operator, _)| Step::GoalSet { operator }),
                phase if phase == dead_end => Some(Step::DeadEnd),
                // Forward search looks for the next slot after each action.
                phase if phase == plan && self.searching => Some(Step::Plan),
                _ => None,
            };
            match step {
                Some(Step::Start) => self.searching = true,
                Some(Step::Plan) => self.searching = false,
                _ => {}
            }
            self.all.extend(step.map(|step| Moment { ms, step, forward }));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns what begins in rows that have these activities and zeros.
    fn steps(rows: &[&[(Phase, Real)]]) -> Vec<Step> {
        let mut moments = Moments::default();
        for (ms, active) in rows.iter().enumerate() {
            let mut row = [0.0; Phase::ALL.len()];
            active.iter().for_each(|(phase, activity)| row[*phase as usize] = *activity);
            moments.look(ms as u64, &row, &[0.1, 0.9, 0.0]);
        }
        moments.all.iter().map(|moment| moment.step).collect()
    }

    #[test]
    fn a_start_that_is_never_active_alone_is_counted() {
        use Phase::{Back, Check, Start, Wave, Write};
        let rows: [&[(Phase, Real)]; 7] = [
            &[(Start, 1.0)],
            &[(Wave, 1.0)],
            &[(Check, 1.0)],
            &[(Check, 0.8), (Start, 0.7)],
            &[(Start, 0.9), (Wave, 0.8)],
            &[(Wave, 1.0)],
            &[(Write, 0.9), (Back, 0.9)],
        ];
        let written = Step::GoalSet { operator: 1 };
        assert_eq!(steps(&rows), [Step::Start, Step::Start, written, Step::DeadEnd]);
    }

    #[test]
    fn a_phase_that_fluctuates_begins_once() {
        let of = |activity| [(Phase::Start, activity)];
        let rows = [0.0, 0.6, 0.45, 0.31, 0.55, 0.9, 0.51, 0.29, 0.4, 0.5, 0.51, 0.0].map(of);
        let rows = rows.each_ref().map(<[_; 1]>::as_slice);
        assert_eq!(steps(&rows), [Step::Start, Step::Start]);
        assert_eq!(steps(&[]), []);
    }

    #[test]
    fn the_costs_are_known_at_the_first_race_after_the_wave() {
        use Phase::{Begin, Race, Settle, Wave, Write};
        let rows: [&[(Phase, Real)]; 6] = [
            &[(Wave, 1.0)],
            &[(Race, 1.0)],
            &[(Write, 1.0)],
            &[(Settle, 1.0)],
            &[(Race, 1.0)],
            &[(Begin, 1.0)],
        ];
        let written = Step::GoalSet { operator: 1 };
        assert_eq!(steps(&rows), [Step::Costs, written, Step::Plan]);
    }
}
