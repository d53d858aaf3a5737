//! The operators of an action with its objects, one for each way in which its condition and those of its effects hold.

use std::collections::{HashMap, VecDeque};

use super::reach::Call;
use super::schema::Schema;
use super::ways::{Code, Known, Way, absorb, join, within};
use super::{GroundOperator, OPERATORS, TooLarge};
use crate::plan::strips::formula::Number;

/// Greatest number of operators of one action with its objects.
const MAX_OPERATORS: usize = 2_048;

/// An operator by codes of facts.
pub(super) struct Compiled {
    /// Position of the call; `None` for an operator that is no action.
    pub call: Option<usize>,
    pub needs: Way,
    /// Facts that become true or false, sorted. No fact becomes both.
    pub effects: Way,
    pub cost: Number,
}

impl Known<'_, '_> {
    /// Says that all facts are known that the calls reach, and finds those that hold for ever.
    pub fn settle(&mut self, schemas: &[Schema], calls: &[Call]) -> Result<(), TooLarge> {
        let mut always = vec![false; self.facts.len()];
        for (fact, number) in &self.facts {
            always[*number as usize] = self.base.start.contains(fact);
        }
        for call in calls {
            let schema = &schemas[call.schema];
            let deleted =
                |effects: &[(super::lower::Atom, bool)], bound: &[u32], always: &mut Vec<bool>| {
                    for (atom, _) in effects.iter().filter(|(_, positive)| !positive) {
                        let number = atom.ground(bound).and_then(|fact| self.facts.get(&fact));
                        if let Some(number) = number {
                            always[*number as usize] = false;
                        }
                    }
                };
            deleted(&schema.effects, &call.objects, &mut always);
            let mut bound = call.objects.to_vec();
            for effect in &schema.conditional {
                let possible = (&effect.holds, false);
                self.each(&effect.slots, &schema.fitting, possible, &mut bound, &mut |bound| {
                    deleted(&effect.effects, bound, &mut always);
                    Ok(())
                })?;
            }
        }
        (self.always, self.complete) = (always, true);
        Ok(())
    }

    /// Returns the codes of effects on facts that can be reached.
    fn codes(&self, effects: &[(super::lower::Atom, bool)], bound: &[u32]) -> Vec<Code> {
        let code = |(atom, positive): &(super::lower::Atom, bool)| {
            let number = self.facts.get(&atom.ground(bound)?)?;
            Some(2 * number + u32::from(!positive))
        };
        effects.iter().filter_map(code).collect()
    }
}

/// Effects under one condition: the ways in which it holds and in which it does not.
struct Group {
    holds: Vec<Way>,
    lacks: Vec<Way>,
    effects: Vec<Code>,
}

/// Adds the operators of a call.
pub(super) fn of_call(
    known: &Known<'_, '_>,
    schema: &Schema,
    at: usize,
    call: &Call,
    cost: Number,
    into: &mut Vec<Compiled>,
) -> Result<(), TooLarge> {
    let variant = &schema.variants[call.variant];
    let mut bound = call.objects.to_vec();
    let mut parts = Vec::new();
    for need in &variant.needs {
        parts.push(known.fact_ways(need, true, &bound)?);
    }
    for check in &variant.checks {
        parts.push(known.ways(check, &schema.fitting, &mut bound)?);
        if parts.last().is_some_and(Vec::is_empty) {
            return Ok(());
        }
    }
    let needs = known.product(parts)?;
    let mut effects = known.codes(&schema.effects, &bound);
    let groups = groups(known, schema, &mut bound, &mut effects)?;
    let mut open: Vec<(Way, Vec<Code>)> =
        needs.into_iter().map(|way| (way, effects.clone())).collect();
    for group in &groups {
        let mut next = Vec::new();
        for (way, mut effects) in open {
            known.steps(1 + (way.len() + effects.len()) / 16)?;
            if group.holds.iter().any(|holds| within(holds, &way)) {
                effects.extend(&group.effects);
                next.push((way, effects));
                continue;
            }
            let fired = || [effects.as_slice(), &group.effects].concat();
            let split = |ways: &[Way]| {
                let mut found: Vec<Way> = ways.iter().filter_map(|w| join(&way, w)).collect();
                absorb(&mut found);
                found
            };
            next.extend(split(&group.holds).into_iter().map(|way| (way, fired())));
            next.extend(split(&group.lacks).into_iter().map(|way| (way, effects.clone())));
        }
        open = next;
        if open.len() > MAX_OPERATORS {
            let action = &known.base.domain.actions[call.schema].name;
            let what = format!(
                "{OPERATORS}: `{action}` has {} effects whose conditions are not certain, each of which doubles them",
                groups.len()
            );
            return Err(TooLarge { what, most: MAX_OPERATORS });
        }
    }
    for (needs, mut effects) in open {
        effects.sort_unstable();
        effects.dedup();
        // What an action makes true and false is true afterwards.
        let both = effects.clone();
        effects.retain(|code| code % 2 == 0 || both.binary_search(&(code ^ 1)).is_err());
        into.push(Compiled { call: Some(at), needs, effects, cost });
    }
    Ok(())
}

/// Returns the effects whose conditions are not certain. Those whose conditions hold join `effects`.
fn groups(
    known: &Known<'_, '_>,
    schema: &Schema,
    bound: &mut Vec<u32>,
    effects: &mut Vec<Code>,
) -> Result<Vec<Group>, TooLarge> {
    let mut groups: Vec<Group> = Vec::new();
    let mut places: HashMap<Vec<Way>, usize> = HashMap::new();
    for effect in &schema.conditional {
        let possible = (&effect.holds, false);
        known.each(&effect.slots, &schema.fitting, possible, bound, &mut |bound| {
            let codes = known.codes(&effect.effects, bound);
            if codes.is_empty() {
                return Ok(());
            }
            let holds = known.ways(&effect.holds, &schema.fitting, bound)?;
            if holds.is_empty() {
                return Ok(());
            }
            if holds.iter().any(Vec::is_empty) {
                effects.extend(codes);
            } else if let Some(at) = places.get(&holds) {
                groups[*at].effects.extend(codes);
            } else {
                let lacks = known.ways(&effect.lacks, &schema.fitting, bound)?;
                places.insert(holds.clone(), groups.len());
                groups.push(Group { holds, lacks, effects: codes });
            }
            Ok(())
        })?;
    }
    // What happens anyway splits nothing.
    let certain: std::collections::HashSet<Code> = effects.iter().copied().collect();
    groups.retain(|group| !group.effects.iter().all(|code| certain.contains(code)));
    Ok(groups)
}

/// Keeps the operators that can be reached if a fact that holds at first must be made false before a negative condition on
/// it is met. Returns which codes their effects reach.
pub(super) fn with_negation(operators: &mut Vec<Compiled>, holds_first: &[bool]) -> Vec<bool> {
    let mut reached = vec![false; 2 * holds_first.len()];
    let met = |code: Code| holds_first[(code / 2) as usize] == code.is_multiple_of(2);
    let mut waiting: HashMap<Code, Vec<usize>> = HashMap::new();
    let mut unmet = vec![0; operators.len()];
    let mut open = VecDeque::new();
    for (at, operator) in operators.iter().enumerate() {
        for code in operator.needs.iter().filter(|code| !met(**code)) {
            waiting.entry(*code).or_default().push(at);
            unmet[at] += 1;
        }
        if unmet[at] == 0 {
            open.push_back(at);
        }
    }
    let mut kept = vec![false; operators.len()];
    while let Some(at) = open.pop_front() {
        kept[at] = true;
        for code in &operators[at].effects {
            if std::mem::replace(&mut reached[*code as usize], true) {
                continue;
            }
            for waiting in waiting.get(code).into_iter().flatten() {
                unmet[*waiting] -= 1;
                if unmet[*waiting] == 0 {
                    open.push_back(*waiting);
                }
            }
        }
    }
    let mut keep = kept.iter();
    operators.retain(|_| keep.next() == Some(&true));
    reached
}

/// Number of operators of one name up to which each is compared with every other.
const COMPARED: usize = 64;

/// Removes operators that need more than another of the same name with the same effects.
pub(super) fn without_doubles(operators: Vec<GroundOperator>) -> Vec<GroundOperator> {
    let mut kept: Vec<GroundOperator> = Vec::with_capacity(operators.len());
    let mut first = 0;
    for operator in operators {
        if kept.last().is_none_or(|last| last.name != operator.name) {
            first = kept.len();
        }
        let has = |whole: &[usize], fluent: &usize| whole.binary_search(fluent).is_ok();
        let no_wider = |narrow: &GroundOperator, wide: &GroundOperator| {
            within(&wide.preconditions, &narrow.preconditions)
                && within(&narrow.adds, &wide.adds)
                // What the narrow one needs, the wide one need not add.
                && wide.adds.iter().all(|a| has(&narrow.adds, a) || has(&narrow.preconditions, a))
                && narrow.deletes == wide.deletes
                && narrow.cost == wide.cost
        };
        let from = first.max(kept.len().saturating_sub(COMPARED));
        if kept[from..].iter().any(|other| no_wider(&operator, other)) {
            continue;
        }
        let mut at = from;
        while at < kept.len() {
            if no_wider(&kept[at], &operator) {
                kept.remove(at);
            } else {
                at += 1;
            }
        }
        kept.push(operator);
    }
    kept
}
