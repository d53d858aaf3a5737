//! What a planner of goal sets does, step by step, read from its phases.

use super::control::Phase;
use crate::sim::Real;

/// A step of the planner's work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// It begins to plan, or begins anew.
    Start,
    /// It knows how far each fluent is from what holds.
    Costs,
    /// It has chosen an operator, and goes on with the goal set before it.
    GoalSet {
        /// Position of the operator.
        operator: usize,
    },
    /// It leaves a goal set from which no operator leads on.
    DeadEnd,
    /// The goal set holds: the plan is found.
    Plan,
}

/// A step, and when it began.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Moment {
    /// Simulated time in milliseconds.
    pub ms: u64,
    /// What began.
    pub step: Step,
}

/// Activity above which a phase is active, and below which it is over. Noise between the two counts for nothing.
const ACTIVE: Real = 0.5;
const OVER: Real = 0.3;

/// Finds the steps in the activities of the phases.
///
/// While one phase follows another, both are active for a moment. So each is followed by itself.
#[derive(Default)]
pub(crate) struct Moments {
    active: [bool; Phase::ALL.len()],
    /// The wave has passed, and no race has begun since.
    waved: bool,
    pub all: Vec<Moment>,
}

impl Moments {
    /// Takes the activities of all phases and of the winners of the race at one time.
    pub fn look(&mut self, ms: u64, phases: &[Real], winner: &[Real]) {
        for (phase, activity) in Phase::ALL.into_iter().zip(phases) {
            let active = &mut self.active[phase as usize];
            let began = !*active && *activity > ACTIVE;
            *active = began || (*active && *activity >= OVER);
            let step = match phase {
                _ if !began => None,
                Phase::Start => Some(Step::Start),
                Phase::Wave => {
                    self.waved = true;
                    None
                }
                Phase::Race => std::mem::take(&mut self.waved).then_some(Step::Costs),
                Phase::Write => {
                    let all = winner.iter().enumerate();
                    let most = all.max_by(|a, b| a.1.total_cmp(b.1));
                    most.map(|(operator, _)| Step::GoalSet { operator })
                }
                Phase::Back => Some(Step::DeadEnd),
                Phase::Begin => Some(Step::Plan),
                _ => None,
            };
            self.all.extend(step.map(|step| Moment { ms, step }));
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
