//! What a move needs and changes, as facts of single objects that hold or do not.

use std::collections::{BTreeMap, BTreeSet};

use super::WriteFault;
use crate::task::compile::{Move, Problem};
use crate::task::domain::{Condition, Counted, Fact, Need, NeedVerdict};

/// An object in a state.
pub(super) type At = (usize, Fact);

/// One way in which a move can be made: what must hold and not hold before, and what it ends and begins.
#[derive(Debug, Clone, Default)]
pub(super) struct Way {
    pub holds: BTreeSet<At>,
    pub lacks: BTreeSet<At>,
    pub ends: BTreeSet<At>,
    pub begins: BTreeSet<At>,
}

impl Way {
    /// Returns whether the conditions can hold together: no object is in two states, and nothing holds and lacks.
    fn possible(&self) -> bool {
        let mut places = BTreeMap::new();
        self.holds.iter().all(|(object, fact)| {
            !self.lacks.contains(&(*object, *fact))
                && places.insert(*object, *fact).is_none_or(|other| other == *fact)
        })
    }
}

/// The facts that the objects of a scene can have.
pub(super) struct Possible<'p> {
    pub problem: &'p Problem<'p>,
    /// Facts of each object.
    pub facts: Vec<Vec<Fact>>,
    /// Needs that do not count, as pairs of operator and need.
    dropped: BTreeSet<(usize, usize)>,
}

impl<'p> Possible<'p> {
    pub fn new(problem: &'p Problem<'p>, dropped: BTreeSet<(usize, usize)>) -> Self {
        let facts = (0..problem.objects().len()).map(|object| problem.facts_of(object));
        Self { problem, facts: facts.collect(), dropped }
    }

    /// Returns the facts of all objects but one that pass a test.
    fn others(&self, object: usize, test: impl Fn(usize, &Fact) -> bool) -> Vec<At> {
        let all = self.facts.iter().enumerate().filter(|(i, _)| *i != object);
        let all = all.flat_map(|(i, facts)| facts.iter().map(move |fact| (i, *fact)));
        all.filter(|(i, fact)| test(*i, fact)).collect()
    }

    /// Returns the facts that a condition of a move from a state counts.
    fn holders(&self, m: &Move, from: &Fact, counted: &Counted<'_>) -> Vec<At> {
        let own = Some((m.object, *from)).filter(|(object, fact)| counted.includes(*object, fact));
        let others = self.others(m.object, |i, fact| counted.includes(i, fact));
        own.into_iter().chain(others).collect()
    }

    /// Returns the ways to make a move from a state. `most` is the greatest number.
    pub fn ways(&self, m: &Move, from: &Fact, most: usize) -> Result<Vec<Way>, WriteFault> {
        let domain = self.problem.domain();
        let operator = &domain.operators[m.operator];
        let mut way = Way::default();
        way.holds.insert((m.object, *from));
        let excluded = self.problem.excluded_by(operator.to, m.place);
        way.lacks.extend(self.others(m.object, |_, fact| {
            fact.reference == m.reference && excluded.contains(&(fact.state, fact.place))
        }));
        let mut ways = vec![way];
        if let Some(reference) = m.reference {
            ways = self.unsupported(ways, reference, m.object, most)?;
        }
        for (n, need) in operator.needs.iter().enumerate() {
            if !self.dropped.contains(&(m.operator, n)) {
                ways = self.with_need(ways, m, from, need, most)?;
            }
        }
        ways = self.with_side_effects(ways, m, from, most)?;
        for way in &mut ways {
            way.ends.insert((m.object, *from));
            way.begins.insert((m.object, m.result(operator)));
        }
        Ok(ways)
    }

    /// Splits ways by what a reference rests on, so that it does not rest on the object.
    fn unsupported(
        &self,
        ways: Vec<Way>,
        reference: usize,
        object: usize,
        most: usize,
    ) -> Result<Vec<Way>, WriteFault> {
        let (mut done, mut open) = (Vec::new(), Vec::new());
        open.extend(ways.into_iter().map(|way| (way, vec![reference])));
        while let Some((mut way, chain)) = open.pop() {
            if done.len() + open.len() > most {
                return Err(WriteFault::TooLarge);
            }
            let top = *chain.last().unwrap_or(&reference);
            if !self.can_rest_on(top, object) {
                done.push(way);
                continue;
            }
            let facts = &self.facts[top];
            let further = |r: &usize| *r != object && !chain.contains(r);
            for fact in facts {
                let Some(next) = fact.reference.filter(further) else { continue };
                if self.can_rest_on(next, object) {
                    let mut longer = way.clone();
                    longer.holds.insert((top, *fact));
                    open.push((longer, [chain.clone(), vec![next]].concat()));
                }
            }
            // Otherwise it rests on nothing that could rest on the object.
            let lacks = facts.iter().filter(|fact| {
                fact.reference.is_some_and(|r| r == object || self.can_rest_on(r, object))
            });
            way.lacks.extend(lacks.map(|fact| (top, *fact)));
            done.push(way);
        }
        Ok(done)
    }

    /// Returns whether an object of one's kind can rest on another, by way of other kinds.
    fn can_rest_on(&self, object: usize, base: usize) -> bool {
        let mut reached = BTreeSet::from([object]);
        let mut open = vec![object];
        while let Some(at) = open.pop() {
            for r in self.facts[at].iter().filter_map(|fact| fact.reference) {
                if r == base {
                    return true;
                }
                if reached.insert(r) {
                    open.push(r);
                }
            }
        }
        false
    }

    fn with_need(
        &self,
        ways: Vec<Way>,
        m: &Move,
        from: &Fact,
        need: &Need,
        most: usize,
    ) -> Result<Vec<Way>, WriteFault> {
        let counted = need.counted(&m.parameters(Some(from)));
        let (holders, least) = match &counted {
            None if need.verdict == NeedVerdict::Required => return Ok(ways),
            None => (Vec::new(), 1),
            Some(c) => (self.holders(m, from, c), self.problem.least(need, c, None)),
        };
        let mut met = Vec::new();
        if !need.is_positive() {
            for mut way in ways {
                way.lacks.extend(&holders);
                met.push(way);
            }
        } else {
            for way in ways {
                let mut open = vec![(way, 0, 0)];
                while let Some((way, next, count)) = open.pop() {
                    if met.len() + open.len() > most {
                        return Err(WriteFault::TooLarge);
                    }
                    if count == least {
                        met.push(way);
                    } else if let Some(holder) = holders.get(next) {
                        open.push((way.clone(), next + 1, count));
                        let mut way = way;
                        // An object is in one state alone, so it counts once.
                        way.holds.insert(*holder);
                        if way.possible() {
                            open.push((way, next + 1, count + 1));
                        }
                    }
                }
            }
        }
        met.retain(Way::possible);
        Ok(met)
    }

    fn with_side_effects(
        &self,
        mut ways: Vec<Way>,
        m: &Move,
        from: &Fact,
        most: usize,
    ) -> Result<Vec<Way>, WriteFault> {
        let domain = self.problem.domain();
        let operator = &domain.operators[m.operator];
        let parameters = m.parameters(Some(from));
        let holders = |condition: &Condition| {
            let counted = condition.counted(&parameters);
            counted.map_or_else(Vec::new, |counted| self.holders(m, from, &counted))
        };
        for effect in operator.side_effects.iter().filter(|e| !e.begins) {
            // To end what does not hold has no effect.
            let holders = holders(&effect.condition);
            ways.iter_mut().for_each(|way| way.ends.extend(&holders));
        }
        for effect in operator.side_effects.iter().filter(|e| e.begins) {
            let changed = match self.problem.changeable(&effect.condition, &parameters)[..] {
                [] => continue,
                [changed] if changed == m.object => continue,
                [changed] => changed,
                _ => {
                    return Err(WriteFault::Uncertain {
                        action: operator.name.clone(),
                        state: domain.states[effect.condition.state].name.clone(),
                    });
                }
            };
            let holders = holders(&effect.condition);
            let mut split = Vec::new();
            for way in ways {
                for now in self.facts[changed].iter().map(Some).chain([None]) {
                    let mut way = way.clone();
                    match now {
                        Some(fact) => {
                            way.holds.insert((changed, *fact));
                        }
                        None => way.lacks.extend(self.facts[changed].iter().map(|f| (changed, *f))),
                    }
                    if now.is_none_or(|fact| !holders.contains(&(changed, *fact))) {
                        let begun = self.problem.begun(&effect.condition, &parameters, now);
                        way.ends.extend(now.map(|fact| (changed, *fact)));
                        way.begins.insert((changed, begun));
                    }
                    if way.possible() {
                        split.push(way);
                    }
                    if split.len() > most {
                        return Err(WriteFault::TooLarge);
                    }
                }
            }
            ways = split;
        }
        Ok(ways)
    }
}
