//! Goals: conjunctions of quantified terms, in an order; and what was shown beside them.

use super::{RelationalDomain, RelationalOperator};

/// How many objects a goal term asks for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Quantity {
    /// At least this number of objects is in the state. Where there are fewer objects of the kind, all of them will do.
    AtLeast(usize),
    /// Every reference has at least this number of objects in the state.
    EachReference(usize),
    /// Every object of the state's kind is in the state.
    EachObject,
}

/// A term of a goal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GoalTerm {
    /// Index of the state.
    pub state: usize,
    /// Indices of further states of the same kind that count as well. Only a term with [`Quantity::EachObject`] can have some.
    pub or: Vec<usize>,
    /// How many objects have to be in the state.
    pub quantity: Quantity,
    /// Index of the state in which a reference has to be for its objects to count; `None` if all objects count. Only a
    /// term with [`Quantity::AtLeast`] can have one.
    pub reference: Option<usize>,
    /// Number of demonstrations that ended with the term fulfilled.
    pub held: usize,
    /// Number of demonstrations.
    pub of: usize,
}

impl GoalTerm {
    /// Returns the states whose objects count.
    pub fn states(&self) -> impl Iterator<Item = usize> + '_ {
        std::iter::once(self.state).chain(self.or.iter().copied())
    }
}

impl RelationalDomain {
    /// Returns the states that were brought about for nothing that is known: they belong to no term of the goal, no action
    /// needs them or begins in them, and bringing them about ends nothing that is in another action's way. If
    /// demonstrations end differently, what some of them were for is among these states.
    pub fn other_goals(&self) -> Vec<usize> {
        let served = |o: usize| {
            let (own, left) = (&self.operators[o], &self.operators[o].from);
            let begun = |s: usize| own.achieves().any(|state| state == s);
            let ended = |s: usize| {
                let ends = own.side_effects.iter().filter(|e| !e.begins);
                left.contains(&s) || ends.map(|e| e.condition.state).any(|state| state == s)
            };
            let serves = |(i, other): (usize, &RelationalOperator)| {
                let mut needs = other.needs.iter();
                i != o
                    && (other.from.contains(&own.to)
                        || needs.any(|n| {
                            n.states().any(|s| if n.is_positive() { begun(s) } else { ended(s) })
                        }))
            };
            self.goals.iter().any(|goal| goal.states().chain(goal.reference).any(begun))
                || self.operators.iter().enumerate().any(serves)
        };
        (0..self.operators.len()).filter(|o| !served(*o)).map(|o| self.operators[o].to).collect()
    }
}
