//! Converts the domain that the paper's learner infers.

use super::goal::{GoalTerm, Quantity};
use super::operator::{Condition, Need, RelationalOperator, Subject, Verdict};
use super::state::{Coordinate, FrameState, Place, Turn};
use super::{Frame, RelationalDomain};
use crate::task::domain::{Domain, GaussianGate, LearnedState, MIN_DISTINCT, Origin, State};
use crate::task::error::TaskError;

impl RelationalDomain {
    /// Returns a learned domain without frames as a relational domain: every state lies in the world frame, and every
    /// precondition is about any object.
    ///
    /// # Errors
    /// [`TaskError::BadDomain`] for a domain with a state without geometry, such as a domain written in code.
    pub fn from_domain(domain: &Domain) -> Result<Self, TaskError> {
        let bad = |reason: String| TaskError::BadDomain { reason };
        let states = domain.states().iter().map(|s| match &s.learned {
            Some(learned) => Ok(state(s, learned)),
            None => Err(bad(format!("`{}` has no geometry; expected a learned state", s.name))),
        });
        let states = states.collect::<Result<Vec<_>, _>>()?;
        let operators = domain.operators().iter().map(|o| {
            let of = o.instances().max(1) as usize;
            let need = |state: usize, verdict, holds| Need {
                condition: Condition { state, subject: Subject::Any },
                verdict,
                holds,
                least: 1,
                held: if holds { of } else { 0 },
                of,
            };
            // The state that the object leaves is the condition on the object itself.
            let required = o.preconditions.iter().filter(|p| Some(**p) != o.from);
            RelationalOperator {
                name: o.name.clone(),
                from: o.from.iter().map(|s| s.index()).collect(),
                to: o.to.index(),
                needs: required.map(|s| need(s.index(), Verdict::Required, true)).collect(),
                side_effects: Vec::new(),
                displacement: None,
                instances: of,
                never_seen: o.absent.iter().map(|s| s.index()).collect(),
            }
        });
        let operators = operators.collect();
        let goal = domain.goal();
        let goals = goal.iter().map(|goal| GoalTerm {
            state: goal.index(),
            reference: None,
            quantity: Quantity::AtLeast(1),
            held: 1,
            of: 1,
        });
        let goals = goals.collect();
        let Some(provenance) = domain.provenance().cloned() else {
            return Err(bad("it was not learned; expected a learned domain".into()));
        };
        let domain = Self { states, operators, goals, noise_m: 0.0, noise_rad: 0.0, provenance };
        domain.check()?;
        Ok(domain)
    }
}

fn state(state: &State, learned: &LearnedState) -> FrameState {
    let gate = GaussianGate::default();
    let found = learned.origin == Origin::Found;
    let broad = if found { gate.broad_found_m } else { gate.broad_m };
    let spread = learned.spread();
    let coordinates = std::array::from_fn(|i| {
        let (mean, sd) = (learned.mean.position[i], spread[i]);
        if learned.distinct >= 2 && sd >= broad {
            Coordinate::Open { low: mean - 2.0 * sd, high: mean + 2.0 * sd }
        } else {
            Coordinate::Tight { mean, sd }
        }
    });
    FrameState {
        name: state.name.clone(),
        kind: state.kind.clone(),
        frame: Frame::World,
        places: vec![Place {
            coordinates,
            orientation: learned.mean.orientation,
            count: learned.distinct,
        }],
        turn: match learned.tilt_sd() {
            Some(sd) if !found => Turn::Axis { axis: [0.0, 0.0, 1.0], sd },
            _ => Turn::Free,
        },
        turn_matters: false,
        origin: learned.origin,
        count: learned.count,
        any_coordinate: found && learned.distinct < MIN_DISTINCT,
    }
}
