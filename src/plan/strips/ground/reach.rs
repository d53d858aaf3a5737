//! Finds the calls of actions that can be reached, by joining their conditions with the facts that are reached.
//!
//! What actions make false is ignored.

use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::rc::Rc;

use super::lower::{Argument, Atom, Base, Fitting, Formula, Ground, Lower, UNBOUND};
use super::ways::Known;
use super::{MAX_GROUND, TooLarge};
use crate::plan::strips::formula::{Condition, Increase};
use crate::plan::strips::pddl::{self, Action, Literal};

/// Greatest number of variants of one action. Further alternatives are tried after its objects are chosen.
const MAX_VARIANTS: usize = 32;

/// Greatest number of atoms in a condition that is split into variants.
const MAX_SPLIT: usize = 1_000;

/// One way to read the condition of an action: facts that must hold, and what else.
#[derive(Clone, Default)]
pub(super) struct Variant {
    /// The slots that are bound: parameters, and variables of which some objects must exist.
    pub slots: Vec<usize>,
    pub needs: Vec<Atom>,
    pub checks: Vec<Formula>,
}

/// Effects for each choice of objects for slots, under a condition.
pub(super) struct Effect {
    pub slots: Vec<usize>,
    pub holds: Formula,
    pub lacks: Formula,
    /// Atoms, with whether they become true.
    pub effects: Vec<(Atom, bool)>,
}

/// An action with numbers in place of names.
pub(super) struct Schema {
    pub parameters: usize,
    pub fitting: Vec<Rc<Fitting>>,
    pub variants: Vec<Variant>,
    pub effects: Vec<(Atom, bool)>,
    pub conditional: Vec<Effect>,
    /// Costs, with the slots of their parameters.
    pub increases: Vec<Increase>,
}

/// An action with objects: the positions of its schema and variant, and the objects of all slots.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct Call {
    pub schema: usize,
    pub objects: Box<[u32]>,
    pub variant: usize,
}

/// Returns whether reached facts choose objects for a condition. Otherwise all choices would be calls of their own.
fn joined(formula: &Formula, base: &Base<'_>) -> bool {
    match formula {
        Formula::Fact(atom, holds) => *holds && !base.derived[atom.predicate as usize],
        Formula::All(parts) => parts.iter().any(|part| joined(part, base)),
        Formula::Any(parts) => parts.iter().all(|part| joined(part, base)),
        Formula::Each { all, inner, .. } => !all && joined(inner, base),
        Formula::Same(..) | Formula::Compare(..) => false,
    }
}

impl Variant {
    /// Splits a condition into variants. What has too many alternatives stays a check.
    fn split(mut self, formula: &Formula, base: &Base<'_>) -> Vec<Self> {
        match formula {
            Formula::Fact(atom, true) if !base.derived[atom.predicate as usize] => {
                self.needs.push(atom.clone());
            }
            Formula::All(parts) => {
                let (plain, rest): (Vec<_>, Vec<_>) =
                    parts.iter().partition(|p| matches!(p, Formula::Fact(..) | Formula::Same(..)));
                let mut all = vec![self];
                for part in plain {
                    let split = all.into_iter().flat_map(|variant| variant.split(part, base));
                    all = split.collect();
                }
                for variant in &mut all {
                    let mut seen: Vec<Atom> = Vec::new();
                    if variant.needs.len() < MAX_SPLIT {
                        variant.needs.retain(|need| {
                            let fresh = !seen.contains(need);
                            seen.push(need.clone());
                            fresh
                        });
                    }
                }
                let mut full = false;
                for part in rest {
                    if let (false, [_]) = (full, all.as_slice()) {
                        all = all.swap_remove(0).split(part, base);
                        continue;
                    }
                    let next = all.iter().flat_map(|variant| variant.clone().split(part, base));
                    let next: Vec<Self> = match full {
                        true => Vec::new(),
                        false => next.take(MAX_VARIANTS + 1).collect(),
                    };
                    full = full || next.len() > MAX_VARIANTS;
                    match full {
                        true => all.iter_mut().for_each(|v| v.checks.push(part.clone())),
                        false => all = next,
                    }
                }
                return all;
            }
            Formula::Any(parts) if parts.len() <= MAX_VARIANTS => {
                let split = parts.iter().flat_map(|part| self.clone().split(part, base));
                let split: Vec<Self> = split.take(MAX_VARIANTS + 1).collect();
                if split.len() <= MAX_VARIANTS {
                    return split;
                }
                self.checks.push(formula.clone());
            }
            Formula::Each { all: false, slots, inner } if joined(inner, base) => {
                self.slots.extend(slots);
                return self.split(inner, base);
            }
            other => self.checks.push(other.clone()),
        }
        vec![self]
    }
}

impl Schema {
    /// Lowers an action. `matters` says which predicates some condition names.
    pub fn new(
        action: &Action,
        mut lower: Lower<'_, '_>,
        matters: &[bool],
    ) -> Result<Self, TooLarge> {
        let base = lower.base;
        let mut parts: Vec<Formula> =
            action.preconditions.iter().map(|literal| lower.literal(literal, true)).collect();
        parts.extend(action.conditions.iter().map(|c| lower.condition(c, true)));
        let slots: Vec<usize> = (0..action.parameters.len()).collect();
        let whole = Variant { slots, ..Variant::default() };
        let variants = match parts.iter().map(Formula::size).sum::<usize>() {
            0..=MAX_SPLIT => whole.split(&Formula::All(parts), base),
            // A condition of this size was made by a program.
            _ => vec![parts.into_iter().fold(whole, |mut whole, part| {
                match part {
                    Formula::Fact(atom, true) if !base.derived[atom.predicate as usize] => {
                        whole.needs.push(atom);
                    }
                    other => whole.checks.push(other),
                }
                whole
            })],
        };
        for check in variants.iter().flat_map(|variant| &variant.checks) {
            check_choices(&lower, check, || {
                format!("a condition of the action `{}`", action.name)
            })?;
        }
        let effect = |lower: &Lower<'_, '_>, effect: &Literal| {
            lower.atom(&effect.atom).map(|atom| (atom, effect.positive))
        };
        let effects = action.effects.iter().filter_map(|e| effect(&lower, e)).collect();
        let mut conditional: Vec<Effect> = Vec::new();
        for given in &action.conditional {
            let depth = lower.scope.len();
            let slots = lower.open(&given.variables);
            // Effects under the same condition belong together.
            let mut known: HashMap<Option<&pddl::Atom>, usize> = HashMap::new();
            for literal in &given.effects {
                let Some((atom, positive)) = effect(&lower, literal) else { continue };
                if !matters[atom.predicate as usize] {
                    continue;
                }
                let less = simplified(&given.condition, literal, action);
                let key = less.is_some().then_some(&literal.atom);
                if let Some(at) = known.get(&key) {
                    conditional[*at].effects.push((atom, positive));
                    continue;
                }
                let condition = less.as_ref().unwrap_or(&given.condition);
                let holds = lower.condition(condition, true);
                let lacks = lower.condition(condition, false);
                let each = lower.sizes(&slots).saturating_mul(lower.choices(&holds).max(1));
                refuse_choices(each, || format!("an effect of the action `{}`", action.name))?;
                known.insert(key, conditional.len());
                let effects = vec![(atom, positive)];
                conditional.push(Effect { slots: slots.clone(), holds, lacks, effects });
            }
            lower.scope.truncate(depth);
        }
        Ok(Self {
            parameters: action.parameters.len(),
            fitting: lower.fitting,
            variants,
            effects,
            conditional,
            increases: action.increases.clone(),
        })
    }
}

/// Returns the condition of an effect without what says nothing, if there is such a part: to make false what is false
/// changes nothing, so that it need not have been true.
fn simplified(condition: &Condition, effect: &Literal, action: &Action) -> Option<Condition> {
    let opposite = |part: &Condition| match part {
        Condition::Literal(l) => l.atom == effect.atom && l.positive != effect.positive,
        _ => false,
    };
    let parts = match condition {
        Condition::All(parts) if parts.len() < MAX_SPLIT => parts.as_slice(),
        one => std::slice::from_ref(one),
    };
    if !parts.iter().any(opposite) {
        return None;
    }
    // What is made true and false is true, so that to make it true can change more.
    let conditional = action.conditional.iter().flat_map(|c| &c.effects);
    let other = |e: &Literal| !e.positive && e.atom.predicate == effect.atom.predicate;
    if effect.positive && action.effects.iter().chain(conditional).any(other) {
        return None;
    }
    Some(Condition::All(parts.iter().filter(|part| !opposite(part)).cloned().collect()))
}

/// Greatest number of choices of objects for the quantifiers of one condition.
const MAX_CHOICES: u128 = 1_000_000;

pub(super) fn check_choices(
    lower: &Lower<'_, '_>,
    formula: &Formula,
    what: impl Fn() -> String,
) -> Result<(), TooLarge> {
    refuse_choices(lower.choices(formula), what)
}

fn refuse_choices(choices: u128, what: impl Fn() -> String) -> Result<(), TooLarge> {
    if choices <= MAX_CHOICES {
        return Ok(());
    }
    let count = match choices {
        u128::MAX => "more than 10^38".to_owned(),
        count => count.to_string(),
    };
    let what = format!("choices of objects in {} ({count})", what());
    Err(TooLarge { what, most: MAX_CHOICES as usize })
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
                    return Err(TooLarge::new("reachable actions", MAX_GROUND));
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
                    return Err(TooLarge::new("reachable actions", MAX_GROUND));
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
