//! Checks a relational domain.

use super::state::{Coordinate, MOST_SIDES, Turn};
use super::{
    FrameState, GoalTerm, Need, Quantity, RelationalDomain, RelationalOperator, Role, SubKinds,
    Subject,
};
use crate::sim::plain;
use crate::task::error::TaskError;
use crate::task::propositional::{Fault, check_names};
use crate::task::recording::{FIT_NAME, unfit};

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
        self.fault().map_or(Ok(()), |fault| Err(fault.into()))
    }

    /// Returns what is wrong with the domain, if anything is.
    pub(super) fn fault(&self) -> Option<Fault> {
        let states = self.states.iter().map(|s| &s.name);
        let names = check_names(states.chain(self.operators.iter().map(|o| &o.name))).err();
        let of_states = || {
            let of =
                |s: &FrameState| Some(fault_of_state(s)?.of(format_args!("state `{}`", s.name)));
            self.states.iter().find_map(of)
        };
        let of_operators = || {
            let of = |o: &RelationalOperator| {
                Some(self.fault_of_operator(o)?.of(format_args!("action `{}`", o.name)))
            };
            self.operators.iter().find_map(of)
        };
        let of_goals = || {
            let of =
                |(index, goal)| Some(self.fault_of_goal(index, goal)?.of(format_args!("the goal")));
            self.goals.iter().enumerate().find_map(of)
        };
        let of_noise = || {
            let noise = [self.noise_m, self.noise_rad];
            let usable = |v: &f64| v.is_finite() && (0.0..FARTHEST_M).contains(v);
            let expected = "finite numbers of at least 0";
            (!noise.iter().all(usable)).then(|| Fault::new("the noise is not usable", expected))
        };
        let of_level = || {
            let usable =
                |side: &[f64; 3]| (side.iter().map(|v| v * v).sum::<f64>() - 1.0).abs() < UNIT;
            self.level.iter().find_map(|(kind, side)| {
                let moves = self.states.iter().any(|s| *s.kind == **kind);
                let problem = format!("the side of `{}` that is up", plain(kind));
                if !usable(side) {
                    return Some(Fault::new(problem + " has no direction", "a vector of length 1"));
                }
                let expected = "a kind that no action moves";
                moves.then(|| Fault::new(problem + " is not that of a fixture", expected))
            })
        };
        let of_kinds = || SubKinds::fault_of(&self.sub_kinds);
        names
            .or_else(|| self.fault_of_words())
            .or_else(of_states)
            .or_else(of_operators)
            .or_else(of_goals)
            .or_else(of_noise)
            .or_else(of_level)
            .or_else(of_kinds)
    }

    fn fault_of_operator(&self, operator: &RelationalOperator) -> Option<Fault> {
        let conditions = operator.needs.iter().flat_map(Need::states);
        let effects = operator.side_effects.iter().map(|e| e.condition.state);
        let mut all = conditions
            .chain(effects)
            .chain(operator.from.iter().copied())
            .chain(operator.never_seen.iter().copied())
            .chain(operator.order.iter().flat_map(|o| o.one_of.iter().map(|(state, _)| *state)))
            .chain([operator.to]);
        let count = self.states.len();
        if let Some(state) = all.find(|state| *state >= count) {
            let problem = format!("names state number {state}");
            return Some(Fault::new(problem, format!("a number below {count}")));
        }
        if operator.needs.iter().any(|n| !(1..=MOST).contains(&n.least)) {
            let problem = "has a need for no object or too many";
            return Some(Fault::new(problem, format!("1 to {MOST}")));
        }
        if let Some(fault) = self.fault_of_roles(operator) {
            return Some(fault);
        }
        if let Some(fault) = self.fault_of_order(operator) {
            return Some(fault);
        }
        if let Some(need) = operator.needs.iter().find(|need| need.held > need.of) {
            let problem = format!("has a need that held {} times of {}", need.held, need.of);
            return Some(Fault::new(problem, "at most as many as there were"));
        }
        let numbers = operator.displacement.iter().flat_map(|d| d.mean.iter().chain([&d.sd]));
        if numbers.into_iter().any(|v| !(v.is_finite() && v.abs() < FARTHEST_M)) {
            return Some(Fault::new("has a displacement that is not usable", "finite metres"));
        }
        let kind = &self.states[operator.to].kind;
        let other = operator.from.iter().find(|s| self.states[**s].kind != *kind)?;
        let other = &self.states[*other];
        let problem =
            format!("moves a `{kind}` out of `{}`, a state of `{}`", other.name, other.kind);
        Some(Fault::new(problem, "states of one kind"))
    }

    /// Returns a place in the order of places that there is not, or that can never be filled.
    fn fault_of_order(&self, operator: &RelationalOperator) -> Option<Fault> {
        let to = &self.states[operator.to];
        let fault = |index: usize, (state, place): (usize, usize)| {
            let state = &self.states[state];
            let problem = format!("has `order[{index}]` with place {place} of `{}`", state.name);
            let of = to.places.len();
            Some(Fault::new(
                problem,
                format!(
                    "another place, from 0, of a state relative to {}; `{}` has {of}",
                    to.frame.name(),
                    to.name
                ),
            ))
        };
        operator.order.iter().enumerate().find_map(|(index, before)| {
            let own = (operator.to, before.place);
            let beside = |(state, place): &(usize, usize)| {
                let other = &self.states[*state];
                (*state, *place) != own && other.frame == to.frame && *place < other.places.len()
            };
            if before.place >= to.places.len() || before.one_of.is_empty() {
                return fault(index, own);
            }
            fault(index, before.one_of.iter().copied().find(|slot| !beside(slot))?)
        })
    }

    /// Returns a condition about a parameter that the operator does not have. It could never be looked at.
    fn fault_of_roles(&self, operator: &RelationalOperator) -> Option<Fault> {
        let needs = operator.needs.iter().map(|n| n.condition);
        let effects = operator.side_effects.iter().map(|e| e.condition);
        let framed = |state: &usize| self.states[*state].frame.kind().is_some();
        let lacking = needs.chain(effects).find_map(|condition| match condition.subject {
            Subject::Is(role) | Subject::At(role) => {
                let states = match role {
                    Role::Object => return None,
                    Role::Origin => &operator.from[..],
                    Role::Target => std::slice::from_ref(&operator.to),
                };
                (!states.iter().any(framed)).then_some((condition.state, role))
            }
            Subject::Any => None,
        });
        let (state, role) = lacking?;
        let (state, role) = (&self.states[state].name, role.name());
        let problem = format!("has a condition, `{state}`, about its {role}, and has no {role}");
        Some(Fault::new(problem, "a state in the frame of a kind for each parameter"))
    }

    fn fault_of_goal(&self, index: usize, goal: &GoalTerm) -> Option<Fault> {
        let count = self.states.len();
        let Some(state) = self.states.get(goal.state) else {
            let problem = format!("names state number {}", goal.state);
            return Some(Fault::new(problem, format!("a number below {count}")));
        };
        if let Some(fault) = goal.reference.and_then(|within| self.fault_of_within(index, within)) {
            let place = format!("has `references_in` for `{}`", state.name);
            let problem = if fault.problem.is_empty() {
                place
            } else {
                format!("{place}; {}", fault.problem)
            };
            return Some(Fault { problem, ..fault });
        }
        let foreign = |other: &usize| {
            self.states.get(*other).is_none_or(|o| o.kind != state.kind || *other == goal.state)
        };
        if let Some(other) = goal.or.iter().find(|o| foreign(o)) {
            let name =
                self.states.get(*other).map_or_else(|| other.to_string(), |o| o.name.clone());
            let problem = format!("has `or` with `{name}` for `{}`", state.name);
            return Some(Fault::new(problem, "other states of the same kind"));
        }
        let twice = goal.or.iter().enumerate().find(|(at, state)| goal.or[..*at].contains(state));
        if let Some((_, state)) = twice.filter(|_| goal.or.len() <= self.states.len()) {
            let problem = format!("has `{}` twice in `or`", self.states[*state].name);
            return Some(Fault::new(problem, "each state once"));
        }
        if goal.or.len() > self.states.len() {
            let problem = format!("has {} states in `or`", goal.or.len());
            return Some(Fault::new(problem, "each state once"));
        }
        if !goal.or.is_empty() && goal.quantity != Quantity::EachObject {
            let problem =
                format!("has `or` for `{}`, and does not ask for each object", state.name);
            return Some(Fault::new(problem, "no `or`, or `each` with `object`"));
        }
        let (each, least) = match goal.quantity {
            Quantity::AtLeast(n) => (false, n),
            Quantity::EachReference(n) => (true, n),
            Quantity::EachObject => (false, 1),
        };
        if each && state.frame.kind().is_none() {
            let name = &state.name;
            let problem = format!("asks for `{name}` at each reference");
            return Some(Fault::new(problem, "a state in the frame of a kind"));
        }
        let usable = (1..=MOST).contains(&least);
        let problem = || format!("asks for {least} of `{}`", state.name);
        (!usable).then(|| Fault::new(problem(), format!("1 to {MOST}")))
    }

    /// Returns why the references of a term of the goal cannot be asked to be in the state `within`. The planner relies on
    /// these rules: it finds no action that moves a reference into place on behalf of the objects at it.
    fn fault_of_within(&self, index: usize, within: usize) -> Option<Fault> {
        let GoalTerm { state, ref quantity, .. } = self.goals[index];
        let Some(asked) = self.states.get(within) else {
            return Some(Fault::new("", format!("a state, not number {within}")));
        };
        let (kind, name) = (self.states[state].frame.kind(), &asked.name);
        if !matches!(quantity, Quantity::AtLeast(_)) {
            return Some(Fault::new("", "a term without `each`"));
        }
        let Some(kind) = kind else {
            return Some(Fault::new("", "a state in the frame of a kind"));
        };
        if *asked.kind != *kind {
            let problem = format!("`{name}` is a state of `{}`", asked.kind);
            return Some(Fault::new(problem, format!("one of `{kind}`")));
        }
        if !self.goals[..index].iter().any(|earlier| earlier.state == within) {
            return Some(Fault::new("", format!("`{name}` as an earlier term of the goal")));
        }
        let lacks = |o: &&RelationalOperator| o.to == state && !o.needs_of_target(within);
        let lacking = self.operators.iter().find(lacks)?;
        let expected = format!("that `{}` requires `{name}` of its target", lacking.name);
        Some(Fault::new("", expected))
    }
}

/// Greatest number of places of a state.
const MOST_PLACES: usize = 200;

fn fault_of_state(state: &FrameState) -> Option<Fault> {
    let kinds = [Some(&*state.kind), state.frame.kind()];
    if let Some(problem) = kinds.into_iter().flatten().find_map(unfit) {
        return Some(Fault::new(format!("has a kind that cannot be a name: {problem}"), FIT_NAME));
    }
    if !(1..=MOST_PLACES).contains(&state.places.len()) {
        return Some(Fault::new("has no places or too many", format!("1 to {MOST_PLACES}")));
    }
    for place in &state.places {
        let square: f64 = place.orientation.iter().map(|v| v * v).sum();
        // A comparison with a number that is not finite is false.
        if (square - 1.0).abs() >= UNIT || !square.is_finite() {
            return Some(Fault::new(
                "has an orientation of another norm than 1",
                "a unit quaternion",
            ));
        }
        for coordinate in &place.coordinates {
            let (a, b, ordered) = match *coordinate {
                Coordinate::Tight { mean, sd } => (mean, sd, sd >= 0.0),
                Coordinate::Open { low, high } => (low, high, low <= high),
            };
            let usable = |v: f64| v.is_finite() && v.abs() < FARTHEST_M;
            if !(usable(a) && usable(b) && ordered) {
                let expected = "finite metres, a spread of at least 0 and `low` below `high`";
                return Some(Fault::new("has a coordinate that is not usable", expected));
            }
        }
    }
    let (axis, sd) = match state.turn {
        Turn::Free => ([0.0, 0.0, 1.0], 0.0),
        Turn::Axis { axis, sd } | Turn::Line { axis, sd } => (axis, sd),
        Turn::Full { sd } => ([0.0, 0.0, 1.0], sd),
        Turn::Sides { sides, .. } if !(2..=MOST_SIDES).contains(&sides) => {
            let expected = format!("2 to {MOST_SIDES}");
            return Some(Fault::new(format!("looks alike from {sides} sides"), expected));
        }
        Turn::Sides { axis, sd, .. } => (axis, sd),
    };
    let square: f64 = axis.iter().map(|v| v * v).sum();
    let usable = (square - 1.0).abs() < UNIT && sd >= 0.0 && sd.is_finite();
    let expected = "a unit axis and a spread of at least 0";
    (!usable).then(|| Fault::new("has a turn that is not usable", expected))
}
