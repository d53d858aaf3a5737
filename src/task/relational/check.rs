//! Checks a relational domain.

use super::state::{Coordinate, Turn};
use super::{FrameState, GoalTerm, Quantity, RelationalDomain, RelationalOperator};
use crate::task::domain::check_names;
use crate::task::error::TaskError;

/// Greatest length of a coordinate in metres. Larger numbers would overflow when squared.
const FARTHEST_M: f64 = 1e6;
/// Greatest number of objects that a need or a goal can ask for.
const MOST: usize = 1_000_000;
/// Largest accepted deviation of the square of an orientation's norm, or of an axis's length, from 1.
const UNIT: f64 = 1e-3;

impl RelationalDomain {
    /// Checks that all names are valid and unique, all indices are in range and all numbers are usable.
    ///
    /// # Errors
    /// [`TaskError::BadDomain`], with the state or operator and what is wrong with it.
    pub fn check(&self) -> Result<(), TaskError> {
        let bad = |reason: String| TaskError::BadDomain { reason };
        let states = self.states.iter().map(|s| &s.name);
        check_names(states.chain(self.operators.iter().map(|o| &o.name))).map_err(bad)?;
        for state in &self.states {
            let named = |why: &str| bad(format!("state `{}` {why}", state.name));
            fault_of_state(state).map_or(Ok(()), |why| Err(named(why)))?;
        }
        for operator in &self.operators {
            let named = |why: String| bad(format!("action `{}` {why}", operator.name));
            self.fault_of_operator(operator).map_or(Ok(()), |why| Err(named(why)))?;
        }
        for (index, goal) in self.goals.iter().enumerate() {
            self.fault_of_goal(index, goal)
                .map_or(Ok(()), |why| Err(bad(format!("the goal {why}"))))?;
        }
        let noise = [self.noise_m, self.noise_rad];
        if noise.iter().any(|v| !(v.is_finite() && (0.0..FARTHEST_M).contains(v))) {
            return Err(bad(
                "the noise is not usable; expected finite numbers of at least 0".into()
            ));
        }
        Ok(())
    }

    fn fault_of_operator(&self, operator: &RelationalOperator) -> Option<String> {
        let conditions = operator.needs.iter().map(|n| n.condition.state);
        let effects = operator.side_effects.iter().map(|e| e.condition.state);
        let mut all = conditions
            .chain(effects)
            .chain(operator.from.iter().copied())
            .chain(operator.never_seen.iter().copied())
            .chain([operator.to]);
        let count = self.states.len();
        if let Some(state) = all.find(|state| *state >= count) {
            return Some(format!("names state number {state}; expected a number below {count}"));
        }
        if operator.needs.iter().any(|n| !(1..=MOST).contains(&n.least)) {
            return Some(format!("has a need for no object or too many; expected 1 to {MOST}"));
        }
        let numbers = operator.displacement.iter().flat_map(|d| d.mean.iter().chain([&d.sd]));
        if numbers.into_iter().any(|v| !(v.is_finite() && v.abs() < FARTHEST_M)) {
            return Some("has a displacement that is not usable; expected finite metres".into());
        }
        let kind = &self.states[operator.to].kind;
        let other = operator.from.iter().find(|s| self.states[**s].kind != *kind)?;
        let other = &self.states[*other];
        Some(format!(
            "moves a `{kind}` out of `{}`, a state of `{}`; expected states of one kind",
            other.name, other.kind
        ))
    }

    fn fault_of_goal(&self, index: usize, goal: &GoalTerm) -> Option<String> {
        let count = self.states.len();
        let Some(state) = self.states.get(goal.state) else {
            return Some(format!(
                "names state number {}; expected a number below {count}",
                goal.state
            ));
        };
        if let Some(why) = goal.reference.and_then(|within| self.fault_of_within(index, within)) {
            return Some(format!("has `references_in` for `{}`; {why}", state.name));
        }
        let (each, least) = match goal.quantity {
            Quantity::AtLeast(n) => (false, n),
            Quantity::EachReference(n) => (true, n),
            Quantity::EachObject => (false, 1),
        };
        if each && state.frame.kind().is_none() {
            let name = &state.name;
            return Some(format!(
                "asks for `{name}` at each reference; expected a state in the frame of a kind"
            ));
        }
        let usable = (1..=MOST).contains(&least);
        (!usable).then(|| format!("asks for {least} of `{}`; expected 1 to {MOST}", state.name))
    }

    /// Returns why the references of a term of the goal cannot be asked to be in the state `within`. The planner relies on
    /// these rules: it finds no action that moves a reference into place on behalf of the objects at it.
    fn fault_of_within(&self, index: usize, within: usize) -> Option<String> {
        let GoalTerm { state, ref quantity, .. } = self.goals[index];
        let Some(asked) = self.states.get(within) else {
            return Some(format!("expected a state, not number {within}"));
        };
        let (kind, name) = (self.states[state].frame.kind(), &asked.name);
        if !matches!(quantity, Quantity::AtLeast(_)) {
            return Some("expected a term without `each`".into());
        }
        let Some(kind) = kind else {
            return Some("expected a state in the frame of a kind".into());
        };
        if *asked.kind != *kind {
            return Some(format!(
                "`{name}` is a state of `{}`; expected one of `{kind}`",
                asked.kind
            ));
        }
        if !self.goals[..index].iter().any(|earlier| earlier.state == within) {
            return Some(format!("expected `{name}` as an earlier term of the goal"));
        }
        let lacks = |o: &&RelationalOperator| o.to == state && !o.needs_of_target(within);
        let lacking = self.operators.iter().find(lacks)?;
        let lacking = &lacking.name;
        Some(format!("expected that `{lacking}` requires `{name}` of its target"))
    }
}

/// Greatest number of places of a state.
const MOST_PLACES: usize = 200;

fn fault_of_state(state: &FrameState) -> Option<&'static str> {
    if !(1..=MOST_PLACES).contains(&state.places.len()) {
        return Some("has no places or too many; expected 1 to 200");
    }
    for place in &state.places {
        let square: f64 = place.orientation.iter().map(|v| v * v).sum();
        // A comparison with a number that is not finite is false.
        if (square - 1.0).abs() >= UNIT || !square.is_finite() {
            return Some("has an orientation of another norm than 1; expected a unit quaternion");
        }
        for coordinate in &place.coordinates {
            let (a, b, ordered) = match *coordinate {
                Coordinate::Tight { mean, sd } => (mean, sd, sd >= 0.0),
                Coordinate::Open { low, high } => (low, high, low <= high),
            };
            let usable = |v: f64| v.is_finite() && v.abs() < FARTHEST_M;
            if !(usable(a) && usable(b) && ordered) {
                return Some(
                    "has a coordinate that is not usable; expected finite metres, a spread of at least 0 and `low` \
                     below `high`",
                );
            }
        }
    }
    let (axis, sd) = match state.turn {
        Turn::Free => ([0.0, 0.0, 1.0], 0.0),
        Turn::Axis { axis, sd } => (axis, sd),
        Turn::Full { sd } => ([0.0, 0.0, 1.0], sd),
    };
    let square: f64 = axis.iter().map(|v| v * v).sum();
    let usable = (square - 1.0).abs() < UNIT && sd >= 0.0 && sd.is_finite();
    (!usable)
        .then_some("has a turn that is not usable; expected a unit axis and a spread of at least 0")
}
