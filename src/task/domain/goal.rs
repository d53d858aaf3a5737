//! Goals: conjunctions of quantified terms, in an order.

/// How many objects a goal term asks for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Quantity {
    /// At least this number of objects is in the state.
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
