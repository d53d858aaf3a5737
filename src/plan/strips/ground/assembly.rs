//! Puts the fluents and operators of a problem together.

use std::collections::{BTreeSet, HashMap};

use super::lower::Ground;
use super::operators::{self, Compiled};
use super::reach::Call;
use super::schema::Schema;
use super::ways::{Code, Known, Part, Way, join};
use super::{Fluent, GroundFault, GroundOperator, Grounded};
use crate::plan::strips::formula::Number;
use crate::plan::strips::pddl::{Action, Fact, Literal, Problem};
use crate::plan::strips::sexpr::short;

/// Name of the facts that stand for parts of the goal with alternatives. No predicate has a blank in its name.
const GOAL: &str = "the goal";

/// Name of the facts that stand for parts of conditions.
const PART: &str = "a condition";

/// Greatest number of facts that stand for parts and that operators end, over all operators.
const MAX_ENDS: usize = 10_000_000;

/// Returns what ends with a change, by way of what ends with that.
fn closure(change: Code, changed: &HashMap<Code, BTreeSet<Code>>) -> BTreeSet<Code> {
    let (mut ends, mut open) = (BTreeSet::new(), vec![change]);
    while let Some(code) = open.pop() {
        let more = changed.get(&code).into_iter().flatten();
        open.extend(more.filter(|end| ends.insert(**end)));
    }
    ends
}

/// Puts the operators of a problem together.
pub(super) struct Assembly<'k, 'b, 'a> {
    pub known: &'k Known<'b, 'a>,
    pub schemas: &'k [Schema],
    pub calls: &'k [Call],
    pub problem: &'k Problem,
    pub compiled: Vec<Compiled>,
    /// The ways of the parts for which facts stand, whose numbers follow those of other facts.
    pub stood_for: Vec<Vec<Way>>,
    /// Parts of the goal that hold in one way, and what they are called.
    pub named: Vec<(Way, String)>,
}

impl Assembly<'_, '_, '_> {
    /// Returns the grounded problem. `literals` and one of the ways of each part must hold at the end.
    pub fn grounded(
        &mut self,
        literals: Vec<(Ground, bool)>,
        parts: &[Part],
    ) -> Result<Grounded, GroundFault> {
        let base = self.known.base;
        let count = self.known.facts.len();
        // The first fact that stands for a part of the goal.
        let first = count + self.stood_for.len();
        let mut facts: Vec<Option<&Ground>> = vec![None; count];
        for (fact, number) in &self.known.facts {
            facts[*number as usize] = Some(fact);
        }
        let mut holds_first: Vec<bool> =
            facts.iter().map(|fact| fact.is_some_and(|fact| base.start.contains(fact))).collect();
        let code = |(fact, holds): &(Ground, bool)| {
            self.known.facts.get(fact).map(|number| 2 * number + u32::from(!holds))
        };
        let mut goal: Way = Vec::new();
        for (pair, (holds, fact)) in literals.iter().zip(self.goal_facts()) {
            match code(pair) {
                Some(code) => goal.push(code),
                // It is never reached.
                None if !holds => {}
                None => return Err(self.unreachable(fact, *holds)),
            }
        }
        goal.sort_unstable();
        goal.dedup();
        let (single, open): (Vec<_>, Vec<_>) = parts.iter().partition(|(ways, _)| ways.len() == 1);
        goal.extend(single.iter().flat_map(|(ways, _)| &ways[0]));
        goal.sort_unstable();
        goal.dedup();
        // Facts that stand for what has alternatives. What changes one of its facts makes it false, unless it is all of the
        // goal: then its operator is the last.
        let last = open.len() == 1 && goal.is_empty();
        // Ways that contradict the rest of the goal lead nowhere.
        let possible = |way: &&Way| join(&goal, way).is_some();
        let of_goal = open.iter().map(|(ways, _)| ways.iter().filter(possible).collect());
        let of_parts = self.stood_for.iter().map(|ways| ways.iter().collect());
        let alternatives: Vec<Vec<&Way>> = of_parts.chain(of_goal).collect();
        let mut changed: HashMap<Code, BTreeSet<Code>> = HashMap::new();
        for (number, ways) in (count..).zip(&alternatives) {
            holds_first.push(false);
            let ends = number < first || !last;
            for code in ways.iter().copied().flatten().filter(|_| ends) {
                changed.entry(code ^ 1).or_default().insert(2 * number as u32 + 1);
            }
        }
        // What ends with each change, by way of other facts that stand for parts.
        let mut known: HashMap<Code, BTreeSet<Code>> = HashMap::new();
        let mut written = 0;
        for operator in &mut self.compiled {
            let mut ends: BTreeSet<Code> = BTreeSet::new();
            for effect in operator.effects.iter().filter(|code| changed.contains_key(code)) {
                let all = known.entry(*effect).or_insert_with(|| closure(*effect, &changed));
                ends.extend(&*all);
            }
            written += ends.len();
            if written > MAX_ENDS {
                let what = "changes that end what stands for a part of a condition".to_owned();
                let problem = self.problem.name.clone();
                return Err(GroundFault::TooLarge { problem, what, most: MAX_ENDS });
            }
            operator.effects.extend(ends);
        }
        for (number, ways) in (count..).zip(&alternatives) {
            let effects = vec![2 * number as u32];
            for way in ways {
                let (call, cost) = (None, Number::default());
                let (needs, effects) = ((*way).clone(), effects.clone());
                self.compiled.push(Compiled { call, needs, effects, cost });
            }
        }
        goal.extend((first..first + open.len()).map(|number| 2 * number as u32));
        goal.sort_unstable();
        goal.dedup();
        let reached = operators::with_negation(&mut self.compiled, &holds_first);
        let mut changing = vec![false; holds_first.len()];
        let mut complement = vec![false; holds_first.len()];
        for effect in self.compiled.iter().flat_map(|o| &o.effects) {
            let fact = (effect / 2) as usize;
            // A fact changes if a call makes true what does not hold at first, or makes false what can hold.
            changing[fact] |= match effect % 2 == 0 {
                true => !holds_first[fact],
                false => holds_first[fact] || reached[2 * fact],
            };
        }
        let needs = self.compiled.iter().flat_map(|o| &o.needs);
        for code in needs.chain(&goal).filter(|code| *code % 2 == 1) {
            complement[(code / 2) as usize] = true;
        }
        let fact = |number: usize| match facts.get(number).copied().flatten() {
            Some(fact) => base.fact(fact),
            None if number < first => {
                let arguments = vec![(number - count + 1).to_string()];
                Fact { predicate: PART.to_owned(), arguments }
            }
            None if open.len() == 1 => Fact { predicate: GOAL.to_owned(), arguments: Vec::new() },
            None => {
                let arguments = vec![(number - first + 1).to_string()];
                Fact { predicate: GOAL.to_owned(), arguments }
            }
        };
        let mut fluents: Vec<(Fluent, Code)> = Vec::new();
        for number in (0..changing.len()).filter(|number| changing[*number]) {
            fluents.push((Fluent { fact: fact(number), holds: true }, 2 * number as u32));
            if complement[number] {
                fluents.push((Fluent { fact: fact(number), holds: false }, 2 * number as u32 + 1));
            }
        }
        fluents.sort_by(|a, b| a.0.cmp(&b.0));
        let mut places: Vec<Option<usize>> = vec![None; 2 * changing.len()];
        for (place, (_, code)) in fluents.iter().enumerate() {
            places[*code as usize] = Some(place);
        }
        let mut wanted = BTreeSet::new();
        for code in &goal {
            let (number, holds) = ((code / 2) as usize, code % 2 == 0);
            match places[*code as usize] {
                Some(place) if reached[*code as usize] || holds_first[number] == holds => {
                    wanted.insert(place);
                }
                None if holds_first[number] == holds => {}
                _ if number >= first => {
                    let (_, fluent) = open[number - first];
                    let why = "no state that the actions can reach meets it".to_owned();
                    let problem = self.problem.name.clone();
                    return Err(GroundFault::Unreachable { problem, fluent: short(fluent), why });
                }
                _ if number >= count => {
                    let own = self.named.iter().find(|(way, _)| way.contains(code));
                    let fluent = own.map_or_else(String::new, |(_, name)| short(name));
                    let why = "no state that the actions can reach meets it".to_owned();
                    let problem = self.problem.name.clone();
                    return Err(GroundFault::Unreachable { problem, fluent, why });
                }
                _ => return Err(self.unreachable(&fact(number), holds)),
            }
        }
        let operators = self.operators(&places);
        let start = fluents.iter().enumerate();
        let start = start.filter(|(_, (_, c))| holds_first[(c / 2) as usize] == (c % 2 == 0));
        Ok(Grounded {
            start: start.map(|(place, _)| place).collect(),
            operators,
            goal: wanted.into_iter().collect(),
            fluents: fluents.into_iter().map(|(fluent, _)| fluent).collect(),
            warnings: Vec::new(),
        })
    }

    /// Returns the facts of the goal that are not derived.
    fn goal_facts(&self) -> impl Iterator<Item = &(bool, Fact)> {
        let base = self.known.base;
        self.problem.goal.iter().filter(move |(_, fact)| {
            base.ground(fact).is_some_and(|ground| !base.derived[ground.0 as usize])
        })
    }

    /// Returns the operators over fluents. `places` has the fluent of each code.
    fn operators(&self, places: &[Option<usize>]) -> Vec<GroundOperator> {
        let sorted = |found: BTreeSet<usize>| found.into_iter().collect::<Vec<_>>();
        let mut operators: Vec<GroundOperator> = Vec::new();
        for compiled in &self.compiled {
            let places_of = |codes: &mut dyn Iterator<Item = Code>| -> BTreeSet<usize> {
                codes.filter_map(|code| places[code as usize]).collect()
            };
            let preconditions = places_of(&mut compiled.needs.iter().copied());
            let mut adds = places_of(&mut compiled.effects.iter().copied());
            let deletes = places_of(&mut compiled.effects.iter().map(|code| code ^ 1));
            adds.retain(|fluent| !preconditions.contains(fluent));
            if adds.is_empty() && deletes.is_empty() {
                continue;
            }
            let (action, name) = match compiled.call {
                None => (self.schemas.len(), String::new()),
                Some(at) => {
                    let call = &self.calls[at];
                    (call.schema, self.name(call))
                }
            };
            operators.push(GroundOperator {
                action,
                name,
                preconditions: sorted(preconditions),
                adds: sorted(adds),
                deletes: sorted(deletes),
                cost: compiled.cost,
            });
        }
        operators::without_doubles(operators)
    }

    /// Returns the name of a call, as in a plan.
    pub fn name(&self, call: &Call) -> String {
        let base = self.known.base;
        let own = &call.objects[..self.schemas[call.schema].parameters];
        let name = |object: &u32| format!(" {}", base.objects[*object as usize].name);
        let objects: String = own.iter().map(name).collect();
        format!("({}{objects})", base.domain.actions[call.schema].name)
    }

    fn unreachable(&self, fact: &Fact, holds: bool) -> GroundFault {
        let own = |e: &Literal| {
            e.positive == holds
                && e.atom.predicate == fact.predicate
                && e.atom.arguments.len() == fact.arguments.len()
        };
        let achieves = |action: &&Action| {
            let conditional = action.conditional.iter().flat_map(|effect| &effect.effects);
            action.effects.iter().chain(conditional).any(own)
        };
        let actions = self.known.base.domain.actions.iter().filter(achieves);
        let names: Vec<String> = actions.map(|action| format!("`{}`", action.name)).collect();
        let why = match names.is_empty() {
            true if holds => format!("no action makes `{}` true", fact.predicate),
            true => format!("no action makes `{}` false", fact.predicate),
            false => format!("the preconditions of {} cannot be met for it", names.join(" and ")),
        };
        let fluent = Fluent { fact: fact.clone(), holds }.to_string();
        GroundFault::Unreachable { problem: self.problem.name.clone(), fluent, why }
    }
}
