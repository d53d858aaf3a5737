//! Finds the calls of actions that can be reached, by joining their conditions with the facts that are reached.
//!
//! What actions make false is ignored.

use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::rc::Rc;

use super::lower::{Argument, Atom, Ground, UNBOUND};
use super::schema::{Schema, Variant};
use super::ways::Known;
use super::{CALLS, MAX_GROUND, TooLarge};

/// An action with objects: the positions of its schema and variant, and the objects of all slots.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct Call {
    pub schema: usize,
    pub objects: Box<[u32]>,
    pub variant: usize,
}

/// The facts that are reached, and an index of them.
pub(super) struct Reach<'s, 'b, 'a> {
    schemas: &'s [Schema],
    pub known: Known<'b, 'a>,
    /// Reached facts, by predicate, in the order in which they were reached.
    reached: Vec<Vec<Box<[u32]>>>,
    /// Reached facts by predicate, position of an argument, and object there.
    index: HashMap<(u32, u32, u32), Vec<u32>>,
}

/// A variant, and what it waits for.
struct Waiting<'s> {
    schema: usize,
    at: usize,
    variant: &'s Variant,
    /// Facts that it needs whatever the objects. Those at the end may be reached.
    facts: Vec<Ground>,
    /// Whether its calls were looked for.
    begun: bool,
}

/// A search for calls.
struct Join<'j> {
    schema: usize,
    variant: &'j Variant,
    at: usize,
    /// Needs that are not joined yet. Those without variables hold.
    open: Vec<bool>,
    bound: Vec<u32>,
    /// Slots that needs have bound, the last at the end.
    trail: Vec<usize>,
    /// The need that a fact of the last round meets. Those before it are met by earlier facts.
    fresh: usize,
    /// Numbers of facts of each predicate that were reached before the last round, and with it.
    old: &'j [usize],
    now: &'j [usize],
    found: HashSet<Call>,
}

impl Join<'_> {
    /// Returns how many facts of its predicate may meet a need.
    fn limit(&self, at: usize) -> usize {
        let facts = if at < self.fresh { self.old } else { self.now };
        facts[self.variant.needs[at].predicate as usize]
    }
}

impl<'s, 'b, 'a> Reach<'s, 'b, 'a> {
    pub fn new(schemas: &'s [Schema], known: Known<'b, 'a>) -> Self {
        let reached = vec![Vec::new(); known.base.changing.len()];
        let mut reach = Self { schemas, known, reached, index: HashMap::new() };
        let mut start: Vec<&Ground> = reach.known.base.start.iter().collect();
        start.sort_unstable();
        start.into_iter().for_each(|fact| reach.insert(fact.clone()));
        reach
    }

    fn insert(&mut self, fact: Ground) {
        let number = self.known.facts.len() as u32;
        if self.known.facts.contains_key(&fact) {
            return;
        }
        let (predicate, objects) = fact.clone();
        self.known.facts.insert(fact, number);
        let at = self.reached[predicate as usize].len() as u32;
        for (place, object) in (0..).zip(&objects) {
            self.index.entry((predicate, place, *object)).or_default().push(at);
        }
        self.reached[predicate as usize].push(objects);
    }

    /// Finds all calls that can be reached.
    pub fn explore(&mut self) -> Result<Vec<Call>, TooLarge> {
        let mut calls: HashSet<Call> = HashSet::new();
        // Facts before these counts were reached in earlier rounds.
        let mut old = vec![0; self.reached.len()];
        let none = old.clone();
        let mut waiting = self.waiting();
        loop {
            let now: Vec<usize> = self.reached.iter().map(Vec::len).collect();
            let mut found = Vec::new();
            for Waiting { schema, at, variant, facts, begun } in &mut waiting {
                while facts.last().is_some_and(|fact| self.known.facts.contains_key(fact)) {
                    facts.pop();
                }
                if !facts.is_empty() {
                    continue;
                }
                let first = !std::mem::replace(begun, true);
                let mut join = Join {
                    schema: *schema,
                    variant,
                    at: *at,
                    open: variant.needs.iter().map(Atom::has_slots).collect(),
                    bound: vec![UNBOUND; self.schemas[*schema].fitting.len()],
                    trail: Vec::new(),
                    fresh: 0,
                    old: if first { &none } else { &old },
                    now: &now,
                    found: HashSet::new(),
                };
                self.fresh(&mut join, first)?;
                found.extend(join.found.into_iter().filter(|call| !calls.contains(call)));
                if calls.len() + found.len() > MAX_GROUND {
                    return Err(TooLarge::new(CALLS, MAX_GROUND));
                }
            }
            old = now;
            let before = self.known.facts.len();
            found.sort_unstable();
            for call in found {
                self.add_effects(&call)?;
                calls.insert(call);
            }
            if self.known.facts.len() > MAX_GROUND {
                return Err(TooLarge::new("reachable facts", MAX_GROUND));
            }
            if self.known.facts.len() == before {
                let mut calls: Vec<Call> = calls.into_iter().collect();
                calls.sort_unstable();
                return Ok(calls);
            }
        }
    }

    fn waiting(&self) -> Vec<Waiting<'s>> {
        let all = self.schemas.iter().enumerate().flat_map(|(schema, own)| {
            own.variants.iter().enumerate().map(move |(at, variant)| {
                let certain = variant.needs.iter().filter(|need| !need.has_slots());
                let facts = certain.filter_map(|need| need.ground(&[])).collect();
                Waiting { schema, at, variant, facts, begun: false }
            })
        });
        all.collect()
    }

    /// Finds the calls of a variant for which some need is a fact of the last round.
    fn fresh(&self, join: &mut Join<'_>, first: bool) -> Result<(), TooLarge> {
        if !join.open.contains(&true) {
            return if first { self.extend(join) } else { Ok(()) };
        }
        for (at, need) in join.variant.needs.iter().enumerate().filter(|(_, n)| n.has_slots()) {
            let predicate = need.predicate as usize;
            join.fresh = at;
            let facts = self.candidates(need, &join.bound);
            self.with_facts(join, at, facts, join.old[predicate]..join.now[predicate])?;
        }
        Ok(())
    }

    /// Makes a need each of some facts in turn: of those listed, or of all of its predicate, that are in a range.
    fn with_facts(
        &self,
        join: &mut Join<'_>,
        at: usize,
        facts: Option<&[u32]>,
        range: Range<usize>,
    ) -> Result<(), TooLarge> {
        let need = &join.variant.needs[at];
        join.open[at] = false;
        match facts {
            Some(facts) => {
                let from = facts.partition_point(|fact| (*fact as usize) < range.start);
                for fact in facts[from..].iter().take_while(|fact| (**fact as usize) < range.end) {
                    self.with_fact(join, need, *fact as usize)?;
                }
            }
            None => {
                for fact in range {
                    self.with_fact(join, need, fact)?;
                }
            }
        }
        join.open[at] = true;
        Ok(())
    }

    /// Binds the variables of a need so that it is a fact, and goes on.
    fn with_fact(&self, join: &mut Join<'_>, need: &Atom, fact: usize) -> Result<(), TooLarge> {
        let objects = &self.reached[need.predicate as usize][fact];
        let fitting = &self.schemas[join.schema].fitting;
        let before = join.trail.len();
        let mut agrees = true;
        for (argument, object) in need.arguments.iter().zip(objects) {
            match argument {
                Argument::Object(own) => agrees = own == object,
                Argument::Slot(slot) if join.bound[*slot] == UNBOUND => {
                    agrees = fitting[*slot].fits[*object as usize];
                    if agrees {
                        join.bound[*slot] = *object;
                        join.trail.push(*slot);
                    }
                }
                Argument::Slot(slot) => agrees = join.bound[*slot] == *object,
            }
            if !agrees {
                break;
            }
        }
        if agrees {
            self.extend(join)?;
        } else {
            self.known.step()?;
        }
        for slot in join.trail.drain(before..) {
            join.bound[slot] = UNBOUND;
        }
        Ok(())
    }

    /// Finds the calls that agree with the objects so far and whose open needs are all reached.
    fn extend(&self, join: &mut Join<'_>) -> Result<(), TooLarge> {
        self.known.steps(1 + join.variant.needs.len() / 4)?;
        let checks = &join.variant.checks;
        if checks.iter().any(|check| self.known.judge(check, &join.bound) == Some(false)) {
            return Ok(());
        }
        // The need with the fewest facts that agree comes first.
        let variant = join.variant;
        let mut best: Option<(usize, Option<&[u32]>, usize)> = None;
        for (at, need) in variant.needs.iter().enumerate().filter(|(at, _)| join.open[*at]) {
            let facts = self.candidates(need, &join.bound);
            let count = facts.map_or(usize::MAX, <[u32]>::len).min(join.limit(at));
            if count == 0 {
                return Ok(());
            }
            if best.is_none_or(|(.., least)| count < least) {
                best = Some((at, facts, count));
            }
        }
        if let Some((at, facts, _)) = best {
            return self.with_facts(join, at, facts, 0..join.limit(at));
        }
        match variant.slots.iter().find(|slot| join.bound[**slot] == UNBOUND) {
            None => {
                let objects = join.bound.as_slice().into();
                join.found.insert(Call { schema: join.schema, objects, variant: join.at });
                if join.found.len() > MAX_GROUND {
                    return Err(TooLarge::new(CALLS, MAX_GROUND));
                }
            }
            Some(free) => {
                let fitting = Rc::clone(&self.schemas[join.schema].fitting[*free]);
                for object in &fitting.list {
                    join.bound[*free] = *object;
                    self.extend(join)?;
                }
                join.bound[*free] = UNBOUND;
            }
        }
        Ok(())
    }

    /// Returns the facts that may agree with a need; `None` for all facts of its predicate.
    fn candidates(&self, need: &Atom, bound: &[u32]) -> Option<&[u32]> {
        let mut best: Option<&[u32]> = None;
        for (place, argument) in (0..).zip(&need.arguments) {
            let object = argument.object(bound);
            if object == UNBOUND {
                continue;
            }
            match self.index.get(&(need.predicate, place, object)) {
                None => return Some(&[]),
                Some(facts) if best.is_none_or(|best| facts.len() < best.len()) => {
                    best = Some(facts);
                }
                Some(_) => {}
            }
        }
        best
    }

    fn add_effects(&mut self, call: &Call) -> Result<(), TooLarge> {
        let schema = &self.schemas[call.schema];
        let mut reached = Vec::new();
        let adds = |effects: &[(Atom, bool)], bound: &[u32], reached: &mut Vec<Ground>| {
            let added = effects.iter().filter(|(_, positive)| *positive);
            reached.extend(added.filter_map(|(atom, _)| atom.ground(bound)));
        };
        adds(&schema.effects, &call.objects, &mut reached);
        let mut bound = call.objects.to_vec();
        for effect in &schema.conditional {
            let possible = (&effect.holds, false);
            self.known.each(
                &effect.slots,
                &schema.fitting,
                possible,
                &mut bound,
                &mut |bound| {
                    adds(&effect.effects, bound, &mut reached);
                    Ok(())
                },
            )?;
        }
        reached.into_iter().for_each(|fact| self.insert(fact));
        Ok(())
    }
}
