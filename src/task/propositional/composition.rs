//! Compositions: what the pointers of a domain's states and actions are made of.

use std::collections::BTreeMap;

/// The part that a filler plays in a state or an action.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Part {
    /// The state or operator itself.
    Symbol,
    /// The object that is in the state, or that the action moves.
    Object,
    /// The reference of the state, or the target reference of the action.
    Reference,
    /// The reference that the object leaves.
    Origin,
    /// The place of the state.
    Place,
    /// The state that the object leaves.
    From,
    /// An object that does not count.
    Except,
    /// The number of objects.
    Count,
}

impl Part {
    /// Returns the name of the part's role, such as `OBJECT`.
    pub fn role(self) -> &'static str {
        match self {
            Self::Symbol => "SYMBOL",
            Self::Object => "OBJECT",
            Self::Reference => "REFERENCE",
            Self::Origin => "ORIGIN",
            Self::Place => "PLACE",
            Self::From => "FROM",
            Self::Except => "EXCEPT",
            Self::Count => "COUNT",
        }
    }
}

/// A part and its filler: the name of an identity, such as `PLATE_1`.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Factor {
    /// The part.
    pub part: Part,
    /// Name of the filler: upper-case letters, digits and `_`.
    pub filler: String,
}

/// What the pointers of a domain's states and actions are made of, by name.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Composition {
    of: BTreeMap<String, Vec<Factor>>,
}

impl Composition {
    /// Creates a composition from the factors of each state and action.
    pub fn new(of: BTreeMap<String, Vec<Factor>>) -> Self {
        Self { of }
    }

    /// Returns the factors of the state or action called `name`; none if it is unknown.
    pub fn factors(&self, name: &str) -> &[Factor] {
        self.of.get(name).map_or(&[], Vec::as_slice)
    }

    /// Returns the filler of a part of the state or action called `name`, if there is one.
    pub fn filler(&self, name: &str, part: Part) -> Option<&str> {
        let factors = self.factors(name).iter();
        factors.filter(|f| f.part == part).map(|f| f.filler.as_str()).next()
    }
}
