//! The ways in which a condition can hold: sets of facts that hold or do not, each of which suffices.

use std::cell::{Cell, RefCell};
use std::collections::{HashMap, HashSet};
use std::rc::Rc;

use super::lower::{Argument, Atom, Base, Fitting, Formula, Ground, UNBOUND};
use super::rounds::{Derivation, DerivedWays, Round};
use super::stand_ins::StandIns;
use super::{BINDINGS, MAX_TRIED, TooLarge, WAYS};

/// Greatest number of ways in which one condition of an action with its objects can hold.
pub(super) const MAX_WAYS: usize = 2_048;

/// Number of ways up to which each is compared with every other.
const COMPARED: usize = 300;

/// A fact by its number, with whether it holds: `2 x number` if it does, otherwise `2 x number + 1`.
pub(super) type Code = u32;

/// Sorted codes.
pub(super) type Way = Vec<Code>;

/// A part of a goal: the ways to meet it, and its name.
pub(super) type Part = (Vec<Way>, String);

/// A rule for a derived predicate.
pub(super) struct Rule {
    pub fitting: Vec<Rc<Fitting>>,
    pub parameters: usize,
    pub holds: Formula,
    pub lacks: Formula,
}

/// What is known of the facts.
pub(super) struct Known<'b, 'a> {
    pub base: &'b Base<'a>,
    /// Numbers of the facts that can be reached.
    pub facts: HashMap<Ground, u32>,
    /// Whether all facts that can be reached are known.
    pub complete: bool,
    /// Whether each fact holds at first, and for ever.
    pub always: Vec<bool>,
    /// Rules by predicate.
    pub rules: HashMap<u32, Vec<Rule>>,
    /// The stratum of each predicate that needs itself.
    pub recursive: HashMap<u32, usize>,
    pub tried: Cell<usize>,
    /// Greatest number of ways that are written out now.
    pub most_ways: Cell<usize>,
    /// Greatest number of ways of a derived fact that may need itself, if another fact can stand for it.
    pub most_recursive: usize,
    pub stand_ins: StandIns,
    /// Predicates that need themselves and hold in too many ways.
    pub too_wide: RefCell<HashSet<u32>>,
    pub derived: RefCell<DerivedWays>,
    /// What is being derived, the lowest stratum last.
    pub rounds: RefCell<Vec<Round>>,
}

/// Joins two ways; `None` if they contradict each other.
pub(super) fn join(a: &[Code], b: &[Code]) -> Option<Way> {
    let mut joined = Vec::with_capacity(a.len() + b.len());
    let (mut a, mut b) = (a.iter().peekable(), b.iter().peekable());
    loop {
        let next = match (a.peek(), b.peek()) {
            (None, None) => return Some(joined),
            (Some(x), Some(y)) if x == y => {
                b.next();
                a.next()
            }
            (Some(x), Some(y)) if x < y => a.next(),
            (Some(_), None) => a.next(),
            (_, Some(_)) => b.next(),
        };
        let next = *next?;
        // The codes of a fact and of its opposite follow each other.
        if joined.last().is_some_and(|last| *last == next ^ 1) {
            return None;
        }
        joined.push(next);
    }
}

/// Returns whether every element of `part` is in `whole`. Both are sorted.
pub(super) fn within<T: PartialEq>(part: &[T], whole: &[T]) -> bool {
    let mut whole = whole.iter();
    part.len() <= whole.len() && part.iter().all(|code| whole.any(|other| other == code))
}

/// Removes ways that are no narrower than another, if there are not too many to compare.
pub(super) fn absorb(ways: &mut Vec<Way>) {
    match ways.len() > COMPARED {
        true => sort(ways),
        false => absorb_all(ways),
    }
}

/// Removes ways that are no narrower than another. Costs O(ways^2 x their length).
pub(super) fn absorb_all(ways: &mut Vec<Way>) {
    sort(ways);
    let mut kept: Vec<Way> = Vec::with_capacity(ways.len());
    for way in ways.drain(..) {
        if !kept.iter().any(|known| within(known, &way)) {
            kept.push(way);
        }
    }
    *ways = kept;
}

/// Sorts ways, the narrowest first, and leaves one of equal ones.
fn sort(ways: &mut Vec<Way>) {
    ways.sort_unstable_by(|a, b| (a.len(), a).cmp(&(b.len(), b)));
    ways.dedup();
}

impl<'b, 'a> Known<'b, 'a> {
    pub fn new(base: &'b Base<'a>) -> Self {
        Self {
            base,
            facts: HashMap::new(),
            complete: false,
            always: Vec::new(),
            rules: HashMap::new(),
            recursive: HashMap::new(),
            tried: Cell::new(0),
            most_ways: Cell::new(MAX_WAYS),
            most_recursive: MAX_WAYS,
            stand_ins: StandIns::default(),
            too_wide: RefCell::default(),
            derived: RefCell::default(),
            rounds: RefCell::default(),
        }
    }

    /// Counts a step. The number of all steps is bounded.
    pub fn step(&self) -> Result<(), TooLarge> {
        self.steps(1)
    }

    pub fn steps(&self, steps: usize) -> Result<(), TooLarge> {
        self.tried.set(self.tried.get() + steps);
        if self.tried.get() > MAX_TRIED { Err(TooLarge::new(BINDINGS, MAX_TRIED)) } else { Ok(()) }
    }

    /// Returns whether a fact holds for ever or never does; `None` if it can change.
    fn settled(&self, fact: &Ground) -> Option<bool> {
        if !self.base.changing[fact.0 as usize] {
            return Some(self.base.start.contains(fact));
        }
        if !self.complete {
            return None;
        }
        match self.facts.get(fact) {
            None => Some(false),
            Some(number) => self.always[*number as usize].then_some(true),
        }
    }

    fn same(&self, left: Argument, right: Argument, bound: &[u32]) -> Option<bool> {
        let (left, right) = (left.object(bound), right.object(bound));
        (left != UNBOUND && right != UNBOUND).then_some(left == right)
    }

    /// Returns whether a condition holds for ever or never does, whatever the variables that are not bound; `None` if this
    /// is not known at once.
    pub fn judge(&self, formula: &Formula, bound: &[u32]) -> Option<bool> {
        self.tried.set(self.tried.get() + 1);
        match formula {
            Formula::Fact(atom, _) if self.base.derived[atom.predicate as usize] => None,
            Formula::Fact(atom, holds) => {
                self.settled(&atom.ground(bound)?).map(|settled| settled == *holds)
            }
            Formula::Same(left, right, holds) => {
                self.same(*left, *right, bound).map(|same| same == *holds)
            }
            Formula::Compare(of, holds, slots) => {
                let named = of.1.functions().into_iter().chain(of.2.functions());
                let terms = named.flat_map(|atom| &atom.arguments);
                let unbound = |term: &crate::plan::strips::Term| match term {
                    crate::plan::strips::Term::Parameter(at) => {
                        slots.get(*at).is_some_and(|slot| bound[*slot] == UNBOUND)
                    }
                    crate::plan::strips::Term::Constant(_) => false,
                };
                if terms.into_iter().any(unbound) {
                    return None;
                }
                let value = |side| self.base.value(side, slots, bound);
                let sides = value(&of.1).zip(value(&of.2));
                Some(sides.is_some_and(|(left, right)| of.0.holds(left, right)) == *holds)
            }
            Formula::All(parts) | Formula::Any(parts) => {
                let all = matches!(formula, Formula::All(_));
                let mut open = false;
                for part in parts {
                    match self.judge(part, bound) {
                        Some(judged) if judged != all => return Some(!all),
                        Some(_) => {}
                        None => open = true,
                    }
                }
                (!open).then_some(all)
            }
            Formula::Each { .. } => None,
        }
    }

    /// Calls `visit` with each choice of objects for slots, without those for which it is known at once whether the condition
    /// holds, and it is as in `skip`.
    pub fn each(
        &self,
        slots: &[usize],
        fitting: &[Rc<Fitting>],
        (condition, skip): (&Formula, bool),
        bound: &mut Vec<u32>,
        visit: &mut impl FnMut(&mut Vec<u32>) -> Result<(), TooLarge>,
    ) -> Result<(), TooLarge> {
        self.step()?;
        if self.judge(condition, bound) == Some(skip) {
            return Ok(());
        }
        let Some((first, rest)) = slots.split_first() else { return visit(bound) };
        for object in &fitting[*first].list {
            bound[*first] = *object;
            self.each(rest, fitting, (condition, skip), bound, visit)?;
        }
        bound[*first] = UNBOUND;
        Ok(())
    }

    /// Returns the ways in which a condition can hold. All its variables without quantifier are bound.
    pub fn ways(
        &self,
        formula: &Formula,
        fitting: &[Rc<Fitting>],
        bound: &mut Vec<u32>,
    ) -> Result<Vec<Way>, TooLarge> {
        // It takes longer than a step of a join.
        self.steps(8)?;
        match formula {
            Formula::Fact(atom, holds) => self.fact_ways(atom, *holds, bound),
            Formula::Same(..) | Formula::Compare(..) => Ok(match self.judge(formula, bound) {
                Some(true) => vec![Way::new()],
                _ => Vec::new(),
            }),
            Formula::All(parts) => {
                let mut all = Vec::new();
                for part in parts {
                    let ways = self.ways(part, fitting, bound)?;
                    if ways.is_empty() {
                        return Ok(ways);
                    }
                    all.push(ways);
                }
                self.product(all)
            }
            Formula::Any(parts) => {
                let mut all = Vec::new();
                for part in parts {
                    all.extend(self.ways(part, fitting, bound)?);
                    if all.iter().any(Vec::is_empty) {
                        return Ok(vec![Way::new()]);
                    }
                }
                self.few(all)
            }
            Formula::Each { all: false, slots, inner } => {
                let mut found: Vec<Way> = Vec::new();
                self.each(slots, fitting, (inner, false), bound, &mut |bound| {
                    found.extend(self.ways(inner, fitting, bound)?);
                    if found.len() > 4 * self.most_ways.get() {
                        found = self.few(std::mem::take(&mut found))?;
                    }
                    Ok(())
                })?;
                self.few(found)
            }
            Formula::Each { all: true, slots, inner } => {
                let (mut factors, mut never) = (Vec::new(), false);
                self.each(slots, fitting, (inner, true), bound, &mut |bound| {
                    if never {
                        return Ok(());
                    }
                    let ways = self.ways(inner, fitting, bound)?;
                    never = ways.is_empty();
                    factors.push(ways);
                    Ok(())
                })?;
                if never { Ok(Vec::new()) } else { self.product(factors) }
            }
        }
    }

    /// Returns the ways in which each of several conditions can hold that together are one.
    pub fn conjuncts(
        &self,
        formula: &Formula,
        fitting: &[Rc<Fitting>],
        bound: &mut Vec<u32>,
    ) -> Result<Vec<Vec<Way>>, TooLarge> {
        let mut found = Vec::new();
        match formula {
            Formula::All(parts) => {
                for part in parts {
                    found.extend(self.conjuncts(part, fitting, bound)?);
                }
            }
            Formula::Each { all: true, slots, inner } => {
                self.each(slots, fitting, (inner, true), bound, &mut |bound| {
                    found.extend(self.conjuncts(inner, fitting, bound)?);
                    Ok(())
                })?;
            }
            other => found.push(self.ways(other, fitting, bound)?),
        }
        Ok(found)
    }

    /// Returns the parts of a goal, each with its ways and its name: first what is certain, then what has alternatives.
    /// The inner error names a part that contradicts another.
    pub fn parts(&self, parts: Vec<Part>) -> Result<Result<Vec<Part>, String>, TooLarge> {
        let (single, mut open): (Vec<_>, Vec<_>) =
            parts.into_iter().partition(|(ways, _)| ways.len() == 1);
        let mut certain = Way::new();
        for (ways, name) in &single {
            match self.product(vec![vec![std::mem::take(&mut certain)], ways.clone()])?.pop() {
                Some(way) => certain = way,
                None => return Ok(Err(name.clone())),
            }
        }
        for (ways, name) in &mut open {
            self.steps(ways.len() * (certain.len() / 16 + 1))?;
            ways.retain(|way| join(&certain, way).is_some());
            if ways.is_empty() {
                return Ok(Err(std::mem::take(name)));
            }
        }
        open.retain(|(ways, _)| !ways.iter().any(|way| within(way, &certain)));
        open.sort_by(|a, b| a.0.cmp(&b.0));
        open.dedup_by(|a, b| a.0 == b.0);
        let (mut product, mut sum) = (1_usize, 0);
        for (ways, _) in &open {
            (product, sum) = (product.saturating_mul(ways.len()), sum + ways.len());
        }
        if open.len() > 1 && product <= sum {
            let names: Vec<String> = open.iter().map(|(_, name)| name.clone()).collect();
            let ways = self.product(open.into_iter().map(|(ways, _)| ways).collect())?;
            if ways.is_empty() {
                return Ok(Err(names.last().cloned().unwrap_or_default()));
            }
            open = vec![(ways, names.join(" and "))];
        }
        open.insert(0, (vec![certain], String::new()));
        Ok(Ok(open))
    }

    pub fn fact_ways(&self, atom: &Atom, holds: bool, bound: &[u32]) -> Result<Vec<Way>, TooLarge> {
        let Some(fact) = atom.ground(bound) else { return Ok(Vec::new()) };
        if self.base.derived[fact.0 as usize] {
            return Ok(self.derived_ways(fact, holds)?.to_vec());
        }
        Ok(match self.settled(&fact) {
            Some(settled) if settled == holds => vec![Way::new()],
            Some(_) => Vec::new(),
            None => match self.facts.get(&fact) {
                Some(number) => vec![vec![2 * number + u32::from(!holds)]],
                None if holds => Vec::new(),
                None => vec![Way::new()],
            },
        })
    }

    /// Returns the ways of a derivation by its rules.
    pub fn ways_by_rules(&self, (fact, holds): &Derivation) -> Result<Vec<Way>, TooLarge> {
        let mut parts = Vec::new();
        for rule in self.rules.get(&fact.0).into_iter().flatten() {
            let fits = |(object, fitting): (&u32, &Rc<Fitting>)| fitting.fits[*object as usize];
            if !fact.1.iter().zip(&rule.fitting[..rule.parameters]).all(fits) {
                // The rule does not apply to these objects.
                parts.push(if *holds { Vec::new() } else { vec![Way::new()] });
                continue;
            }
            let mut bound = vec![UNBOUND; rule.fitting.len()];
            bound[..rule.parameters].copy_from_slice(&fact.1);
            let formula = if *holds { &rule.holds } else { &rule.lacks };
            parts.push(self.ways(formula, &rule.fitting, &mut bound)?);
        }
        match holds {
            true => self.few(parts.concat()),
            false if parts.iter().any(Vec::is_empty) => Ok(Vec::new()),
            false => self.product(parts),
        }
    }

    /// Returns whether facts stand for parts of conditions now. What is derived in rounds has other ways in the next one.
    pub fn abridges(&self) -> bool {
        self.stand_ins.used() && self.rounds.borrow().is_empty()
    }

    /// Refuses too many ways.
    fn few(&self, mut ways: Vec<Way>) -> Result<Vec<Way>, TooLarge> {
        self.steps(ways.len())?;
        absorb(&mut ways);
        let most = self.most_ways.get();
        if ways.len() > most && ways.len() <= 8 * most {
            self.steps(ways.len() * ways.len() / 64)?;
            absorb_all(&mut ways);
        }
        if ways.len() > most {
            return Err(TooLarge::new(WAYS, MAX_WAYS));
        }
        Ok(ways)
    }

    /// Returns the ways in which all of several conditions hold, each given by its ways.
    pub fn product(&self, mut factors: Vec<Vec<Way>>) -> Result<Vec<Way>, TooLarge> {
        factors.sort_by_key(Vec::len);
        let single = factors.iter().take_while(|ways| ways.len() == 1).count();
        let mut certain: Way = factors.drain(..single).flatten().flatten().collect();
        self.steps(certain.len() / 16 + 1)?;
        certain.sort_unstable();
        certain.dedup();
        // The codes of a fact and of its opposite follow each other.
        if certain.windows(2).any(|pair| pair[0] ^ 1 == pair[1]) {
            return Ok(Vec::new());
        }
        let mut open = Vec::new();
        for mut factor in factors {
            self.steps(factor.len() * (certain.len() / 16 + 1))?;
            factor.retain(|way| join(&certain, way).is_some());
            if factor.is_empty() {
                return Ok(Vec::new());
            }
            if !factor.iter().any(|way| within(way, &certain)) {
                open.push(factor);
            }
        }
        if open.len() > 1 && self.abridges() {
            certain.extend(open.into_iter().map(|factor| self.for_ways(factor)));
            certain.sort_unstable();
            certain.dedup();
            return Ok(vec![certain]);
        }
        let mut ways = vec![certain];
        for factor in open {
            let mut next = Vec::new();
            for way in &ways {
                for other in &factor {
                    next.extend(join(way, other));
                }
                self.steps(factor.len() * (way.len() / 16 + 1))?;
                if next.len() > 8 * self.most_ways.get() {
                    next = self.few(next)?;
                }
            }
            ways = self.few(next)?;
        }
        Ok(ways)
    }
}
