//! Tells apart objects that were found on one side or another, where what is done first depends on it, and what fell over.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::frames::Frames;
use super::motion::Came;
use super::places::Group;

/// Angle between the directions of two sides, and between those of one side, in radians.
const OTHER_RAD: f64 = 0.8;
const SAME_RAD: f64 = 0.4;
/// Number of rests of a cluster from which one may have fallen over.
const FEW: usize = 4;
/// Probability up to which that objects of one side alone go somewhere is not taken for chance.
const CHANCE: f64 = 0.01;

impl Frames<'_, '_> {
    /// Splits clusters of found objects by the side on which they lie, if objects of one side alone go to one of the clusters:
    /// what lies face down is turned over before it is used. Returns each cluster with whether it was split.
    pub fn by_side(&self, groups: Vec<Group>) -> Vec<(Group, bool)> {
        let owner: BTreeMap<usize, usize> = (groups.iter().enumerate())
            .flat_map(|(index, group)| group.rests.iter().map(move |rest| (*rest, index)))
            .collect();
        let ends = self.motion.attempts.iter().filter_map(|attempt| self.motion.ends(attempt));
        let sinks: BTreeMap<usize, usize> = ends
            .filter_map(|(before, after)| Some((before, *owner.get(&self.origin(after))?)))
            .collect();
        let split = |group: Group| match self.sides(&group) {
            sides if sides.len() > 1 && decides(&sides, &sinks) => {
                let all = group.rests.len() as f64;
                let part = |rests: Vec<usize>| {
                    let evidence = group.evidence * rests.len() as f64 / all;
                    (Group { rests, evidence, scores: group.scores.clone(), ..group }, true)
                };
                sides.into_iter().map(part).collect()
            }
            _ => vec![(group, false)],
        };
        groups.into_iter().flat_map(split).collect()
    }

    /// Takes out of each cluster what fell over: the one rest of several in which the object lies on another side than in all others
    /// and than before. Returns these rests.
    pub fn without_fallen(&self, groups: &mut [Group]) -> Vec<usize> {
        let Some(up) = self.up else { return Vec::new() };
        let top =
            |rest: usize| self.motion.rests[rest].pose.rotation().inverse() * Vector3::ith(up, 1.0);
        let mut fallen = Vec::new();
        for group in groups.iter_mut().filter(|group| group.rests.len() >= FEW) {
            let tops: Vec<Vector3<f64>> = group.rests.iter().map(|rest| top(*rest)).collect();
            // Of the first three at most one lies otherwise, so that two of them show the side of the others.
            let alike = |i: usize, j: usize| tops[i].angle(&tops[j]) < SAME_RAD;
            let usual = if alike(0, 1) || alike(0, 2) { tops[0] } else { tops[1] };
            let mut others = (0..tops.len()).filter(|at| tops[*at].angle(&usual) >= SAME_RAD);
            let (Some(at), None) = (others.next(), others.next()) else { continue };
            let stood = self.motion.previous(group.rests[at]).map(top);
            let stood = stood.is_some_and(|before| before.angle(&usual) < SAME_RAD);
            if stood && tops[at].angle(&usual) > OTHER_RAD {
                group.evidence *= 1.0 - 1.0 / tops.len() as f64;
                fallen.push(group.rests.remove(at));
            }
        }
        fallen
    }

    /// Returns the rests of a cluster by the side of the object that is up; none if not all were found, or if they lie askew.
    fn sides(&self, group: &Group) -> Vec<Vec<usize>> {
        let Some(up) = self.up else { return Vec::new() };
        let mut sides: Vec<(Vector3<f64>, Vec<usize>)> = Vec::new();
        for rest in &group.rests {
            let rest_of = &self.motion.rests[*rest];
            let top = rest_of.pose.rotation().inverse() * Vector3::ith(up, 1.0);
            let near = sides.iter_mut().find(|(side, _)| side.angle(&top) < OTHER_RAD);
            match near {
                _ if rest_of.came != Came::Found => return Vec::new(),
                Some((side, _)) if side.angle(&top) > SAME_RAD => return Vec::new(),
                Some((_, rests)) => rests.push(*rest),
                None => sides.push((top, vec![*rest])),
            }
        }
        sides.into_iter().map(|(_, rests)| rests).collect()
    }
}

/// Returns whether objects of one side alone go to some cluster, more often than by chance. `sinks` is the cluster to which each
/// rest was left.
fn decides(sides: &[Vec<usize>], sinks: &BTreeMap<usize, usize>) -> bool {
    let moved = |side: &Vec<usize>| -> BTreeMap<usize, usize> {
        let mut ends = BTreeMap::new();
        for end in side.iter().filter_map(|rest| sinks.get(rest)) {
            *ends.entry(*end).or_default() += 1;
        }
        ends
    };
    let moved: Vec<BTreeMap<usize, usize>> = sides.iter().map(moved).collect();
    let all: usize = moved.iter().flat_map(BTreeMap::values).sum();
    moved.iter().enumerate().any(|(side, own)| {
        let of: usize = own.values().sum();
        let alone = |end: &usize| {
            moved.iter().enumerate().all(|(i, other)| i == side || !other.contains_key(end))
        };
        let chance = |count: usize| -> f64 {
            (0..count).map(|i| (of - i) as f64 / (all - i) as f64).product()
        };
        own.iter().any(|(end, count)| alone(end) && chance(*count) <= CHANCE)
    })
}
