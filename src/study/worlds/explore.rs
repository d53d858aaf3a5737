//! Explores a world with legal moves, right and wrong ones, to find what always holds when an action is possible.

use std::collections::BTreeSet;
use std::sync::Arc;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::Stage;
use super::run::{At, Run, pose};
use super::spec::Spec;
use super::truth::Need;
use crate::robot::Pose;
use crate::sim::Seed;

/// Number of walks for each stage.
const WALKS: u64 = 12;

/// Number of moves of a walk.
const MOVES: usize = 50;

/// Probability that a move is the demonstrator's.
const DEMONSTRATED: f64 = 0.4;

/// Returns for each job the needs that were met whenever a move of the job was possible. Such a need may be asserted:
/// either the world demands it, or it follows from what the world demands.
pub(super) fn explore(spec: &Arc<Spec>) -> Vec<BTreeSet<Need>> {
    let mut always = vec![None; spec.jobs.len()];
    for walk in 0..WALKS {
        for stage in [Stage::Demonstration(0), Stage::Demonstration(1), Stage::Test] {
            let seed = Seed::new(walk).derive(spec.name, "explore");
            let mut rng = seed.derive("walk", "moves").rng();
            let mut run = Run::begin(spec.clone(), seed, stage);
            for _ in 0..MOVES {
                let demonstrated = rng.random::<f64>() < DEMONSTRATED;
                let next = if demonstrated { run.next_move() } else { None };
                let wander = || run.legal_move(&mut rng);
                let Some((object, target)) = next.or_else(wander) else { break };
                run.note(&mut always);
                run.act(&object, &target);
            }
        }
    }
    always.into_iter().map(Option::unwrap_or_default).collect()
}

impl Run {
    /// Draws a state that is possible now, and a move into it.
    fn legal_move(&self, rng: &mut ChaCha8Rng) -> Option<(Arc<str>, Pose)> {
        let mut rules: Vec<usize> = (0..self.spec.states.len()).collect();
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

    /// The allowed moves into a state, but not those to the place that the object is at.
    fn entries(&self, rule: usize) -> Vec<(usize, At)> {
        let mut found = self.moves_into(rule);
        found.retain(|(body, at)| self.bodies[*body].at != Some(*at));
        found
    }

    /// Keeps, for each job, the needs that are met in all situations in which it is possible now.
    fn note(&self, always: &mut [Option<BTreeSet<Need>>]) {
        for (job, always) in self.spec.jobs.iter().zip(always) {
            let Some(rule) = self.rule(job.to) else { continue };
            for (body, at) in self.entries(rule) {
                if !self.vacant(
                    Some(body),
                    self.kind(body).radius_m,
                    at,
                    &self.place(at, self.bodies[body].half_m),
                ) && self.spec.states[rule].is_spot()
                {
                    continue;
                }
                let now = self.literals(body, at.on);
                match always {
                    None => *always = Some(now),
                    Some(always) => always.retain(|need| now.contains(need)),
                }
            }
        }
    }

    /// All needs that would be met by a move of `body` onto `on`.
    fn literals(&self, body: usize, on: Option<usize>) -> BTreeSet<Need> {
        let mut found = BTreeSet::new();
        for rule in &self.spec.states {
            let state = rule.name;
            if self.is_in(body, state) {
                found.insert(Need::Object(state));
            }
            if on.is_some_and(|on| self.is_in(on, state)) {
                found.insert(Need::Reference(state));
            }
            let others = |b: &usize| *b != body && Some(*b) != on;
            if self.holds(&Need::Every(state), body, on) {
                found.insert(Need::Every(state));
            }
            let somewhere = (0..self.bodies.len()).filter(others).any(|b| self.is_in(b, state));
            let need = if somewhere { Need::Somewhere(state) } else { Need::Nowhere(state) };
            found.insert(need);
            // A state in another frame has nothing to do with the reference object.
            if let Some(on) = on.filter(|on| rule.frame == Some(self.kind(*on).name)) {
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
