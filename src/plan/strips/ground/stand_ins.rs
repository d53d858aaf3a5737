//! Facts that stand for parts of conditions. They keep conditions short that hold in too many ways to be written out.
//!
//! Hidden operators make such a fact true, one for each way in which its part holds. Whatever changes a fact of one of these
//! ways makes it false. So it holds only while its part does, and where the part holds a hidden operator can make it true again.

use std::cell::{Cell, RefCell};
use std::collections::{HashMap, VecDeque};

use super::TooLarge;
use super::rounds::Derivation;
use super::ways::{Code, Known, MAX_WAYS, Way};

/// What a fact stands for.
#[derive(PartialEq, Eq, Hash, Clone)]
enum Part {
    Ways(Vec<Way>),
    /// A derived fact that may need itself.
    Derived(Derivation),
}

#[derive(Default)]
pub(super) struct StandIns {
    /// Whether parts get facts that stand for them.
    used: Cell<bool>,
    places: RefCell<HashMap<Part, usize>>,
    /// The ways of the part that each stands for.
    ways: RefCell<Vec<Vec<Way>>>,
    /// Derived facts whose ways are not known yet, with their places.
    open: RefCell<VecDeque<(usize, Derivation)>>,
}

impl StandIns {
    pub fn used(&self) -> bool {
        self.used.get()
    }

    /// Returns the place of what stands for a part, and whether it is new.
    fn place(&self, part: Part, ways: Vec<Way>) -> (usize, bool) {
        let mut all = self.ways.borrow_mut();
        let fresh = all.len();
        let place = *self.places.borrow_mut().entry(part).or_insert(fresh);
        if place == fresh {
            all.push(ways);
        }
        (place, place == fresh)
    }
}

impl Known<'_, '_> {
    /// Returns what `find` finds. If a condition holds in too many ways, or makes too many operators, it is asked again, and facts
    /// stand for its parts.
    pub fn abridged<T>(
        &self,
        mut find: impl FnMut() -> Result<T, TooLarge>,
    ) -> Result<T, TooLarge> {
        match find() {
            Err(fault) if fault.is_of_ways() && self.complete => {
                let most = self.most_ways.replace(MAX_WAYS);
                self.stand_ins.used.set(true);
                let found = find().and_then(|found| self.derive().map(|()| found));
                self.stand_ins.used.set(false);
                self.most_ways.set(most);
                // What stays too large says what it is too large by first.
                found.map_err(|second| if second.is_of_ways() { fault } else { second })
            }
            found => found,
        }
    }

    /// Finds the ways of the derived facts that are stood for, and of those that these need.
    fn derive(&self) -> Result<(), TooLarge> {
        loop {
            let next = self.stand_ins.open.borrow_mut().pop_front();
            let Some((place, key)) = next else { return Ok(()) };
            let ways = self.ways_by_rules(&key)?;
            self.stand_ins.ways.borrow_mut()[place] = ways;
        }
    }

    fn stand_in(&self, place: usize) -> Code {
        2 * (self.facts.len() + place) as Code
    }

    /// Returns the fact that stands for a part with these ways.
    pub fn for_ways(&self, ways: Vec<Way>) -> Code {
        self.stand_in(self.stand_ins.place(Part::Ways(ways.clone()), ways).0)
    }

    /// Returns the fact that stands for a derived fact.
    pub fn for_derived(&self, key: &Derivation) -> Code {
        let (place, fresh) = self.stand_ins.place(Part::Derived(key.clone()), Vec::new());
        if fresh {
            self.stand_ins.open.borrow_mut().push_back((place, key.clone()));
        }
        self.stand_in(place)
    }

    /// Returns the ways of the part that each fact stands for, in the order of their numbers, which follow those of other facts.
    pub fn parts_stood_for(&self) -> Vec<Vec<Way>> {
        self.stand_ins.ways.borrow().clone()
    }
}
