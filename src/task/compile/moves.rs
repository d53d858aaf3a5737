//! Moves: operators with their parameters bound to the objects of a scene.

use crate::task::domain::{Fact, Parameters, RelationalOperator};

/// An operator with its parameters bound.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Move {
    /// Index of the operator.
    pub operator: usize,
    /// Index of the object that moves.
    pub object: usize,
    /// Index of the target reference; `None` in the world frame.
    pub reference: Option<usize>,
    /// Index of the place in the operator's new state.
    pub place: usize,
}

impl Move {
    /// Returns the objects that the parameters of the operator stand for, with the fact that the object leaves.
    pub(crate) fn parameters(&self, from: Option<&Fact>) -> Parameters {
        Parameters::new(Some(self.object), from.and_then(|f| f.reference), self.reference)
    }

    /// Returns the fact that the object enters.
    pub(crate) fn result(&self, operator: &RelationalOperator) -> Fact {
        Fact { state: operator.to, place: self.place, reference: self.reference }
    }
}
