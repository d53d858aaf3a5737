//! Words for states, conditions and goals, as tables and pages show them, and the names of a domain's states.

use super::state::{Coordinate, Turn};
use super::{
    Condition, FrameState, GoalTerm, Need, NeedVerdict, Quantity, RelationalDomain,
    RelationalOperator, Role, SideEffect, Subject,
};
use crate::task::error::TaskError;
use crate::task::propositional::find;

impl RelationalDomain {
    /// Returns the index of the state called `name`.
    ///
    /// # Errors
    /// [`TaskError::Unknown`] if there is no such state; the error lists all states.
    pub fn state(&self, name: &str) -> Result<usize, TaskError> {
        find(name, "state", self.states.iter().map(|s| s.name.as_str()))
    }

    /// Returns the goal that one object is in the state called `name`. If the demonstrations had a goal about this state that
    /// counts only some references, so does this one.
    ///
    /// # Errors
    /// As [`RelationalDomain::state`].
    pub fn goal(&self, name: &str) -> Result<GoalTerm, TaskError> {
        let (state, quantity) = (self.state(name)?, Quantity::AtLeast(1));
        let own = self.goals.iter().find(|goal| goal.state == state);
        let reference = own.and_then(|goal| goal.reference);
        Ok(GoalTerm { state, quantity, reference, held: 0, of: 0 })
    }

    /// Returns the goal of the demonstrations in words; `None` if there is none.
    pub fn goals_in_words(&self) -> Option<String> {
        let terms: Vec<String> = self.goals.iter().map(|goal| self.goal_in_words(goal)).collect();
        (!terms.is_empty()).then(|| terms.join(", "))
    }

    /// Returns the names of `states`, in the same order.
    pub fn names(&self, states: &[usize]) -> Vec<&str> {
        states.iter().map(|s| self.states[*s].name.as_str()).collect()
    }

    /// Returns a copy of the domain with new names for some states and actions, given as pairs of old and new name.
    /// All renames apply at once, so two names can be swapped.
    ///
    /// # Errors
    /// [`TaskError::Unknown`] if an old name is neither a state nor an action; [`TaskError::BadDomain`] if an old name
    /// is given twice or a new name is invalid or already used.
    pub fn rename(&self, renames: &[(String, String)]) -> Result<Self, TaskError> {
        let names = || {
            let states = self.states.iter().map(|s| s.name.as_str());
            states.chain(self.operators.iter().map(|o| o.name.as_str()))
        };
        for (index, (old, _)) in renames.iter().enumerate() {
            find(old, "state or action", names())?;
            if renames[..index].iter().any(|(earlier, _)| earlier == old) {
                let reason =
                    format!("`{old}` is renamed twice; expected one new name for each old name");
                return Err(TaskError::BadDomain { reason });
            }
        }
        let mut renamed = self.clone();
        let states = renamed.states.iter_mut().map(|s| &mut s.name);
        for name in states.chain(renamed.operators.iter_mut().map(|o| &mut o.name)) {
            if let Some((_, new)) = renames.iter().find(|(old, _)| old == name) {
                name.clone_from(new);
            }
        }
        renamed.check().map(|()| renamed)
    }

    /// Returns a copy of the domain in which no action may begin while a state holds that never held before it. With few
    /// demonstrations, a state can be absent by coincidence.
    pub fn with_unseen_absent(&self) -> Self {
        let mut domain = self.clone();
        for operator in &mut domain.operators {
            let of = operator.instances;
            let subject = Subject::Any;
            let unseen = operator.never_seen.iter().map(|state| Need {
                condition: Condition { state: *state, subject },
                or: Vec::new(),
                verdict: NeedVerdict::Absent,
                holds: false,
                least: 1,
                every: false,
                held: 0,
                of,
            });
            operator.needs.extend(unseen);
        }
        domain
    }

    /// Returns the kind of the object that a role of an operator stands for; `None` if there is no such object, or if it
    /// differs between the states that the object may leave.
    pub fn role_kind(&self, operator: &RelationalOperator, role: Role) -> Option<&str> {
        let to = &self.states[operator.to];
        match role {
            Role::Object => Some(&to.kind),
            Role::Target => to.frame.kind(),
            Role::Origin => {
                let mut kinds = operator.from.iter().map(|s| self.states[*s].frame.kind());
                let first = kinds.next()??;
                kinds.all(|kind| kind == Some(first)).then_some(first)
            }
        }
    }

    /// Returns a condition before an action in words, such as `4 x CHAIR_AT_TABLE at the target table`.
    pub fn need_in_words(&self, operator: &RelationalOperator, need: &Need) -> String {
        let subject = need.condition.subject;
        let states = need.states().map(|state| Condition { state, subject });
        let states: Vec<String> = states.map(|c| self.condition_in_words(operator, &c)).collect();
        let condition = states.join(" or ");
        match (need.is_positive(), need.every, need.least) {
            (false, ..) => format!("no {condition}"),
            (true, true, _) => {
                format!("every {}: {condition}", self.states[need.condition.state].kind)
            }
            (true, false, 1) => condition,
            (true, false, least) => format!("{least} x {condition}"),
        }
    }

    /// Returns a change of another object's state in words, such as `CUP_AT_DRAWER of some cup ends`.
    pub fn side_effect_in_words(
        &self,
        operator: &RelationalOperator,
        effect: &SideEffect,
    ) -> String {
        let condition = self.condition_in_words(operator, &effect.condition);
        let change = if effect.begins { "begins to hold" } else { "ends" };
        format!("{condition} {change}")
    }

    fn condition_in_words(&self, operator: &RelationalOperator, condition: &Condition) -> String {
        let state = &self.states[condition.state];
        let role = |role: Role| {
            let word = if role == Role::Object { "moved" } else { role.name() };
            match self.role_kind(operator, role) {
                Some(kind) => format!("{word} {kind}"),
                None => role.name().into(),
            }
        };
        match condition.subject {
            Subject::Is(r) => format!("{} of the {}", state.name, role(r)),
            Subject::At(r) => format!("{} at the {}", state.name, role(r)),
            Subject::Any => format!("{} of some {}", state.name, state.kind),
        }
    }

    /// Returns a term of the goal in words, such as `FORK_AT_PLATE at each plate`.
    pub fn goal_in_words(&self, goal: &GoalTerm) -> String {
        let state = &self.states[goal.state];
        let many = |n: usize| if n == 1 { String::new() } else { format!("{n} x ") };
        match goal.quantity {
            Quantity::AtLeast(n) => match (goal.reference, state.frame.kind()) {
                (Some(reference), Some(kind)) => {
                    let reference = &self.states[reference].name;
                    format!("{}{} at a {kind} in {reference}", many(n), state.name)
                }
                _ => many(n) + &state.name,
            },
            Quantity::EachReference(n) => {
                let kind = state.frame.kind().unwrap_or("reference");
                format!("{}{} at each {kind}", many(n), state.name)
            }
            Quantity::EachObject => format!("{} for each {}", state.name, state.kind),
        }
    }
}

impl Need {
    /// Returns why the condition has its verdict, in words, with the counts behind it.
    pub fn reason(&self) -> String {
        let Self { held, of, .. } = self;
        match (self.verdict, self.holds, self.condition.subject) {
            (NeedVerdict::Required, _, Subject::Is(_) | Subject::At(_)) => {
                format!("always held ({held} of {of}), and it is about an object of the action")
            }
            (NeedVerdict::Required, _, Subject::Any) => format!("held in {held} of {of}"),
            (NeedVerdict::Undecided, true, Subject::Any) => {
                format!("always held ({held} of {of}), but about another object")
            }
            (NeedVerdict::Undecided, true, _) => {
                format!("always held ({held} of {of}), but the other object may be there by chance")
            }
            (NeedVerdict::Undecided, false, _) => {
                format!("never held ({held} of {of}), but this may be by chance")
            }
            (NeedVerdict::Absent, ..) => {
                format!("never held ({held} of {of}), and it is about the object that moves")
            }
        }
    }
}

impl NeedVerdict {
    /// Returns `required`, `undecided` or `absent`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Required => "required",
            Self::Undecided => "undecided",
            Self::Absent => "absent",
        }
    }
}

impl FrameState {
    /// Returns how the orientation is constrained, in words, such as `one axis ±1.2°`, with the standard deviation.
    pub fn turn_in_words(&self) -> String {
        let fixed = |what: &str, sd: f64| {
            if sd > 0.0 { format!("{what} ±{:.1}°", sd.to_degrees()) } else { what.into() }
        };
        match self.turn {
            Turn::Free => "any".into(),
            Turn::Axis { sd, .. } => fixed("one axis", sd),
            Turn::Full { sd } => fixed("all axes", sd),
        }
    }
}

impl Coordinate {
    /// Returns the standard deviation, in metres: of an open coordinate that of a uniform distribution over its range.
    pub fn spread(&self) -> f64 {
        match *self {
            Self::Tight { sd, .. } => sd,
            Self::Open { low, high } => (high - low) / 12f64.sqrt(),
        }
    }
}
