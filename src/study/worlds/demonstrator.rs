//! The demonstrator: does the jobs of a world in an order drawn from those that the world and the habits allow.

use std::sync::Arc;

use nalgebra::Isometry3;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::rest::draw;
use super::run::{At, Run, pose};
use super::spec::Quota;
use crate::robot::Pose;

/// Maximum number of draws of a free target.
const DRAWS: usize = 300;

impl Run {
    /// Returns the demonstrator's next move, as an object's id and a target pose; `None` once no job is left.
    pub fn next_move(&mut self) -> Option<(Arc<str>, Pose)> {
        self.complete_jobs();
        let mut rng = self.seed.derive_index("demonstrator", self.moves).rng();
        let mut open: Vec<(usize, Vec<(usize, At)>)> = (0..self.duties.len())
            .filter(|job| !self.duties[*job].done && self.may_begin(*job))
            .map(|job| (job, self.candidates(job)))
            .filter(|(_, candidates)| !candidates.is_empty())
            .collect();
        while !open.is_empty() {
            let chosen = rng.random_range(0..open.len());
            let (job, candidates) = &mut open[chosen];
            let (body, at) = candidates.swap_remove(rng.random_range(0..candidates.len()));
            let job = *job;
            if candidates.is_empty() {
                open.swap_remove(chosen);
            }
            if let Some(mut target) = self.free_target(body, at, &mut rng) {
                if self.spec.jobs[job].in_place {
                    target.translation = self.bodies[body].pose.translation;
                }
                return Some((self.bodies[body].id.clone(), pose(&target)));
            }
        }
        None
    }

    /// Marks the jobs whose quota is met. A complete job stays complete.
    fn complete_jobs(&mut self) {
        for _ in 0..self.duties.len() {
            for job in 0..self.duties.len() {
                if !self.duties[job].done && self.may_begin(job) && self.quota_met(job) {
                    self.duties[job].done = true;
                }
            }
        }
    }

    fn may_begin(&self, job: usize) -> bool {
        let spec = &self.spec;
        let to = spec.jobs[job].to;
        let habits = spec.habits.iter().filter(|(_, then)| *then == to).map(|(first, _)| first);
        spec.jobs[job].after.iter().chain(habits).all(|before| {
            spec.jobs.iter().zip(&self.duties).all(|(job, duty)| job.to != *before || duty.done)
        })
    }

    fn quota_met(&self, job: usize) -> bool {
        let to = self.spec.jobs[job].to;
        let Some(rule) = self.rule(to) else { return true };
        match self.duties[job].quota {
            Quota::Total(count) | Quota::Drawn(count, _) => self.count(to, None) >= count,
            Quota::EachReference => {
                self.references(rule).into_iter().all(|on| self.count(to, on) > 0)
            }
            Quota::EachObject => {
                self.of_kind(self.spec.states[rule].kind).all(|body| self.is_in(body, to))
            }
            Quota::Empty(state) => self.count(state, None) == 0,
            Quota::Unless(other) => self.count(to, None) + self.count(other, None) > 0,
        }
    }

    /// The moves that serve a job and that the rules allow now.
    fn candidates(&self, job: usize) -> Vec<(usize, At)> {
        let to = self.spec.jobs[job].to;
        let Some(rule) = self.rule(to) else { return Vec::new() };
        let quota = self.duties[job].quota;
        let serves = |(body, at): &(usize, At)| match quota {
            Quota::Empty(from) => self.is_in(*body, from),
            Quota::EachReference if self.count(to, at.on) > 0 => false,
            _ => !self.is_in(*body, to),
        };
        let mut found = self.moves_into(rule);
        found.retain(serves);
        found
    }

    /// Draws a free target in a state, in the world frame.
    pub(super) fn free_target(
        &self,
        body: usize,
        at: At,
        rng: &mut ChaCha8Rng,
    ) -> Option<Isometry3<f64>> {
        let place = self.place(at, self.bodies[body].half_m);
        let kind = self.kind(body);
        let careless = self.spec.careless;
        (0..DRAWS).find_map(|_| {
            let target = place * draw(&self.spec.states[at.rule], kind.lie, careless, rng);
            self.vacant(Some(body), kind.radius_m, at, &target).then_some(target)
        })
    }
}
