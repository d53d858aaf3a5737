//! Checks a relational domain.

use std::collections::BTreeSet;

use super::RelationalDomain;
use super::state::{Coordinate, Turn};
use crate::task::domain::is_symbol;
use crate::task::error::TaskError;

/// Greatest length of a coordinate in metres. Larger numbers would overflow when squared.
const FARTHEST_M: f64 = 1e6;

impl RelationalDomain {
    /// Checks that all names are valid and unique, all indices are in range and all numbers are usable.
    ///
    /// # Errors
    /// [`TaskError::BadDomain`], with the state or operator and what is wrong with it.
    pub fn check(&self) -> Result<(), TaskError> {
        self.fault().map_or(Ok(()), |reason| Err(TaskError::BadDomain { reason }))
    }

    fn fault(&self) -> Option<String> {
        let mut names = BTreeSet::new();
        let all = self.states.iter().map(|s| &s.name);
        for name in all.chain(self.operators.iter().map(|o| &o.name)) {
            if !is_symbol(name) {
                return Some(format!(
                    "`{name}` is no name; expected an upper-case letter, then letters, digits and `_`"
                ));
            }
            if !names.insert(name) {
                return Some(format!(
                    "`{name}` is used twice; expected a different name for each state and action"
                ));
            }
        }
        for state in &self.states {
            let fault = |what: &str| Some(format!("state `{}` {what}", state.name));
            if state.places.is_empty() {
                return fault("has no places; expected at least one");
            }
            for place in &state.places {
                let square: f64 = place.orientation.iter().map(|v| v * v).sum();
                let unit = (square - 1.0).abs() < 1e-3;
                if !unit {
                    return fault("has an orientation that is not a unit quaternion");
                }
                for coordinate in &place.coordinates {
                    let (a, b, ordered) = match *coordinate {
                        Coordinate::Tight { mean, sd } => (mean, sd, sd >= 0.0),
                        Coordinate::Open { low, high } => (low, high, low <= high),
                    };
                    let usable = |v: f64| v.is_finite() && v.abs() < FARTHEST_M;
                    if !(usable(a) && usable(b) && ordered) {
                        return fault(
                            "has a coordinate that is not usable; expected finite metres, a spread of at least 0 and `low` below `high`",
                        );
                    }
                }
            }
            let (axis, sd) = match state.turn {
                Turn::Free => ([0.0, 0.0, 1.0], 0.0),
                Turn::Axis { axis, sd } => (axis, sd),
                Turn::Full { sd } => ([0.0, 0.0, 1.0], sd),
            };
            let length: f64 = axis.iter().map(|v| v * v).sum();
            if !((length - 1.0).abs() < 1e-3 && sd >= 0.0 && sd.is_finite()) {
                return fault(
                    "has a turn that is not usable; expected a unit axis and a spread of at least 0",
                );
            }
        }
        let known = |state: usize| state < self.states.len();
        for operator in &self.operators {
            let conditions = operator.needs.iter().map(|n| n.condition.state);
            let effects = operator.side_effects.iter().map(|e| e.condition.state);
            let mut all = conditions
                .chain(effects)
                .chain(operator.from.iter().copied())
                .chain(operator.never_seen.iter().copied())
                .chain([operator.to]);
            if !all.all(known) {
                return Some(format!(
                    "operator `{}` names a state that does not exist",
                    operator.name
                ));
            }
            let kind = &self.states[operator.to].kind;
            if let Some(other) = operator.from.iter().find(|s| self.states[**s].kind != *kind) {
                return Some(format!(
                    "operator `{}` moves a {kind} out of `{}`, a state of another kind",
                    operator.name, self.states[*other].name
                ));
            }
        }
        if self.goals.iter().any(|g| !known(g.state)) {
            return Some("the goal names a state that does not exist".into());
        }
        let noise = [self.noise_m, self.noise_rad];
        if noise.iter().any(|v| !(v.is_finite() && (0.0..FARTHEST_M).contains(v))) {
            return Some("its noise is not a finite number of at least 0".into());
        }
        None
    }
}
