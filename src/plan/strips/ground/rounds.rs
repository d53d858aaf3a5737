//! The ways of derived facts, also of those that need themselves: derived round after round, until they stay.

use std::collections::HashMap;
use std::rc::Rc;

use super::lower::Ground;
use super::ways::{Known, Way, absorb_all};
use super::{TooLarge, WAYS};

/// A derived fact, and whether it holds.
pub(super) type Derivation = (Ground, bool);

/// The ways in which derived facts hold, or do not.
pub(super) type DerivedWays = HashMap<Derivation, Rc<Vec<Way>>>;

/// Derivations of one stratum that need each other, with what is known of their ways so far.
pub(super) struct Round {
    stratum: usize,
    /// In the order in which they were asked for.
    asked: Vec<Derivation>,
    ways: DerivedWays,
}

impl Round {
    /// Adds a derivation. At first nothing is derived: no way leads to it, and all to its opposite.
    fn ask(&mut self, key: &Derivation) -> Rc<Vec<Way>> {
        let first = Rc::new(if key.1 { Vec::new() } else { vec![Way::new()] });
        self.asked.push(key.clone());
        self.ways.insert(key.clone(), Rc::clone(&first));
        first
    }
}

impl Known<'_, '_> {
    /// Returns the ways in which a derived fact holds, or does not.
    pub fn derived_ways(&self, fact: Ground, holds: bool) -> Result<Rc<Vec<Way>>, TooLarge> {
        let key = (fact, holds);
        if let Some(known) = self.derived.borrow().get(&key) {
            return Ok(Rc::clone(known));
        }
        if let Some(stratum) = self.recursive.get(&key.0.0) {
            if holds && self.abridges() {
                return Ok(Rc::new(vec![vec![self.for_derived(&key)]]));
            }
            if holds && !self.stand_ins.used() && self.too_wide.borrow().contains(&key.0.0) {
                return Err(TooLarge::new(WAYS, self.most_recursive));
            }
            return self.recursive_ways(key, *stratum);
        }
        let ways = Rc::new(self.ways_by_rules(&key)?);
        self.derived.borrow_mut().insert(key, Rc::clone(&ways));
        Ok(ways)
    }

    /// Returns the ways of a derivation that may need itself: round after round, each from the ways of the round before,
    /// until they stay. Rules only add ways to a fact, and take ways from its opposite, so they do.
    fn recursive_ways(&self, key: Derivation, stratum: usize) -> Result<Rc<Vec<Way>>, TooLarge> {
        if let Some(round) = self.rounds.borrow_mut().last_mut()
            && round.stratum == stratum
        {
            let known = round.ways.get(&key).cloned();
            return Ok(known.unwrap_or_else(|| round.ask(&key)));
        }
        let mut round = Round { stratum, asked: Vec::new(), ways: DerivedWays::new() };
        round.ask(&key);
        self.rounds.borrow_mut().push(round);
        let found = self.settle_round();
        let round = self.rounds.borrow_mut().pop();
        found?;
        let mut derived = self.derived.borrow_mut();
        derived.extend(round.into_iter().flat_map(|round| round.ways));
        Ok(derived.get(&key).cloned().unwrap_or_default())
    }

    /// Derives what is asked in the last round, and what that asks for, until nothing changes. What was asked for last is looked at
    /// first: it is what the others need.
    fn settle_round(&self) -> Result<(), TooLarge> {
        let asked = || self.rounds.borrow().last().map_or(0, |round| round.asked.len());
        let (mut looked_at, mut changed) = (0, true);
        while std::mem::take(&mut changed) {
            while looked_at < asked() {
                changed |= self.look_at(looked_at)?;
                looked_at += 1;
            }
            for at in (0..looked_at).rev() {
                changed |= self.look_at(at)?;
            }
            changed |= asked() > looked_at;
        }
        Ok(())
    }

    /// Derives what was asked for at a place in the last round anew. Returns whether its ways have changed.
    fn look_at(&self, at: usize) -> Result<bool, TooLarge> {
        let key = self.rounds.borrow().last().and_then(|round| round.asked.get(at).cloned());
        let Some(key) = key else { return Ok(false) };
        let mut ways = self.ways_by_rules(&key)?;
        // Ways around a circle are wider than others, and there are more of them in each round.
        self.steps(ways.len() * ways.len() / 64)?;
        absorb_all(&mut ways);
        if key.1 && self.complete && !self.stand_ins.used() && ways.len() > self.most_recursive {
            self.too_wide.borrow_mut().insert(key.0.0);
            return Err(TooLarge::new(WAYS, self.most_recursive));
        }
        let mut rounds = self.rounds.borrow_mut();
        let Some(round) = rounds.last_mut() else { return Ok(false) };
        let known = round.ways.get_mut(&key).filter(|known| ***known != ways);
        Ok(known.is_some_and(|known| {
            *known = Rc::new(ways);
            true
        }))
    }
}
