//! Explores a world with legal moves, right and wrong ones, to find what always holds when an action is possible.

use std::collections::BTreeSet;
use std::sync::Arc;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::run::{At, RuleRun, pose};
use super::spec::Spec;
use super::truth::{Explored, Need};
use super::{Run, Stage};
use crate::sim::Seed;
use crate::task::domain::Pose;

/// Number of walks for each stage.
const WALKS: u64 = 12;

/// Number of moves of a walk.
const MOVES: usize = 50;

/// Probability that a move is the demonstrator's.
const DEMONSTRATED: f64 = 0.4;

/// What has held so far at each possible application of an action.
struct Record {
    to: &'static str,
    always: Option<BTreeSet<Need>>,
    from: BTreeSet<&'static str>,
    after: Option<BTreeSet<&'static str>>,
    count: usize,
}

pub(super) fn explore(spec: &Arc<Spec>) -> Vec<Explored> {
    let record = |to| Record { to, always: None, from: BTreeSet::new(), after: None, count: 0 };
    let mut records: Vec<Record> = spec.jobs.iter().map(|job| record(job.to)).collect();
    for walk in 0..WALKS {
        for stage in [Stage::Demonstration(0), Stage::Demonstration(1), Stage::Test] {
            let seed = Seed::new(walk).derive(spec.name, "explore");
            let mut rng = seed.derive("walk", "moves").rng();
            let mut run = RuleRun::begin(spec.clone(), seed, stage);
            let mut seen = BTreeSet::new();
            for _ in 0..MOVES {
                let states = run.bodies.iter().filter_map(|b| b.at);
                seen.extend(states.map(|at| spec.rules[at.rule].state.name));
                let demonstrated = rng.random::<f64>() < DEMONSTRATED;
                let next = if demonstrated { run.next() } else { None };
                let wander = || run.legal_move(&mut rng);
                let Some((object, target)) = next.or_else(wander) else { break };
                run.note(&mut records, &seen);
                run.act(&object, &target);
            }
        }
    }
    let explored = |r: Record| Explored {
        to: r.to,
        always: r.always.into_iter().flatten().collect(),
        origins: r.from.into_iter().collect(),
        after: r.after.into_iter().flatten().collect(),
        situations: r.count,
    };
    records.into_iter().map(explored).collect()
}

impl RuleRun {
    /// Draws a state that is possible now, and a move into it.
    fn legal_move(&self, rng: &mut ChaCha8Rng) -> Option<(Arc<str>, Pose)> {
        let mut rules: Vec<usize> = (0..self.spec.rules.len()).collect();
        while !rules.is_empty() {
            let rule = rules.swap_remove(rng.random_range(0..rules.len()));
            let mut entries = self.entries(rule);
            while !entries.is_empty() {
                let (body, at) = entries.swap_remove(rng.random_range(0..entries.len()));
                if let Some(target) = self.free_target(body, at, rng) {
                    return Some((self.bodies[body].id.clone(), pose(&target)));
                }
            }
        }
        None
    }

    /// All objects that the rules let enter a state, with the places, but not the places that they are at.
    fn entries(&self, rule: usize) -> Vec<(usize, At)> {
        let state = &self.spec.rules[rule].state;
        let mut found = Vec::new();
        for body in self.of_kind(state.kind) {
            for on in self.references(rule) {
                for place in 0..state.places.len() {
                    let at = At { rule, on, place };
                    if self.bodies[body].at != Some(at) && self.allowed(body, at) {
                        found.push((body, at));
                    }
                }
            }
        }
        found
    }

    /// Notes, for each action, what holds in the situations in which it is possible now. `seen` are the states that
    /// objects have been in.
    fn note(&self, records: &mut [Record], seen: &BTreeSet<&'static str>) {
        for record in records {
            let Some(rule) = self.rule(record.to) else { continue };
            for (body, at) in self.entries(rule) {
                if !self.vacant(Some(body), self.kind(body).radius_m, at, &self.place(at))
                    && self.spec.rules[rule].state.is_spot()
                {
                    continue;
                }
                record.count += 1;
                let from = self.bodies[body].at.map(|at| self.spec.rules[at.rule].state.name);
                record.from.extend(from);
                keep_common(&mut record.always, self.literals(body, at.on));
                keep_common(&mut record.after, seen.clone());
            }
        }
    }

    /// All needs that would be met by a move of `body` onto `on`.
    fn literals(&self, body: usize, on: Option<usize>) -> BTreeSet<Need> {
        let mut found = BTreeSet::new();
        for rule in &self.spec.rules {
            let state = rule.state.name;
            if self.is_in(body, state) {
                found.insert(Need::Object(state));
            }
            if on.is_some_and(|on| self.is_in(on, state)) {
                found.insert(Need::Reference(state));
            }
            let others = |b: &usize| *b != body && Some(*b) != on;
            let somewhere = (0..self.bodies.len()).filter(others).any(|b| self.is_in(b, state));
            let need = if somewhere { Need::Somewhere(state) } else { Need::Nowhere(state) };
            found.insert(need);
            // A state in another frame has nothing to do with the reference object.
            if let Some(on) = on.filter(|on| rule.state.frame == Some(self.kind(*on).name)) {
                let here = (0..self.bodies.len()).filter(others).filter(|b| {
                    self.is_in(*b, state) && self.bodies[*b].at.and_then(|at| at.on) == Some(on)
                });
                let count = here.count();
                if count == 0 {
                    found.insert(Need::Clear(state));
                }
                found.extend((1..=count).map(|at_least| Need::Holds { state, at_least }));
            }
        }
        found
    }
}

/// Removes from `common` what is not in `now`; `None` stands for everything.
fn keep_common<T: Ord>(common: &mut Option<BTreeSet<T>>, now: BTreeSet<T>) {
    match common {
        None => *common = Some(now),
        Some(common) => common.retain(|item| now.contains(item)),
    }
}
