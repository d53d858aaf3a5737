//! Layers: places one over another between which other things are put.

use super::frames::Frames;
use super::places::{Group, PLACE_M, PLACE_SD};
use crate::robot::Pose;

/// Number of times that a place has to be filled before what lay below it says something.
const OFTEN: usize = 3;
/// Distance aside up to which one thing lies over another, in metres.
const OVER_M: f64 = 0.02;

impl Frames<'_, '_> {
    /// Returns whether a place lies over another, and things of other kinds that were put there lay between them each time that the
    /// upper one was filled. Both are no places of one state then: what closes a sandwich does not begin it.
    pub fn are_layers(&self, lower: &Group, upper: &Group) -> bool {
        let Some(up) = self.up.filter(|_| upper.rests.len() >= OFTEN) else { return false };
        let aside = |a: &Pose, b: &Pose| {
            let apart = |i: usize| a.position[i] - b.position[i];
            (0..3).filter(|i| *i != up).map(|i| apart(i).powi(2)).sum::<f64>().sqrt()
        };
        let margin = PLACE_M.max(PLACE_SD * self.motion.noise.position_m) / 2.0;
        let below = lower.rests.first().and_then(|rest| self.pose(*rest, upper.frame));
        let Some(below) = below else { return false };
        let covers = |rest: &usize| {
            let own = &self.motion.rests[*rest];
            let Some(above) = self.pose(*rest, upper.frame) else { return false };
            let depth = above.position[up] - below.position[up];
            let between = |track: usize| {
                let there = self.rest_during(*rest, track).filter(|there| self.was_put(*there));
                there.is_some_and(|there| {
                    let there = &self.motion.rests[there];
                    let under = own.pose.position[up] - there.pose.position[up];
                    self.motion.kind(there) != self.motion.kind(own)
                        && aside(&there.pose, &own.pose) <= OVER_M
                        && (margin..depth - margin).contains(&under)
                })
            };
            aside(&above, &below) <= OVER_M && (0..self.motion.tracks[own.demo].len()).any(between)
        };
        upper.rests.iter().all(covers)
    }
}
