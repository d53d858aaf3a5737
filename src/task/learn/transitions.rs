//! Transitions of parts between clusters: finds clusters that are detours and attempts that were undone.

use std::collections::{BTreeMap, BTreeSet};

use super::observations::{Cluster, Observations};

/// Findings from the transitions of parts between clusters.
#[derive(Default)]
pub(super) struct Transitions {
    /// Clusters that are detours: parts reached them only by attempts and left them again in most demonstrations,
    /// although parts went directly to the next cluster at least as often.
    pub detours: BTreeSet<usize>,
    /// Attempts that returned a part to a cluster that it had left earlier. The exception is a part that stayed there,
    /// if parts return to stay in this cluster in at least half of the demonstrations.
    pub undone: BTreeSet<usize>,
}

impl Observations<'_> {
    /// Follows the parts from cluster to cluster and finds detours and undone attempts.
    pub fn transitions(&self, clusters: &[Cluster]) -> Transitions {
        let mut found = Transitions::default();
        let mut direct: BTreeMap<(usize, usize), usize> = BTreeMap::new();
        let mut through: BTreeMap<(usize, usize, usize), usize> = BTreeMap::new();
        let (mut passed, mut entered) = (BTreeSet::new(), BTreeSet::new());
        let mut manipulated: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
        let mut kept: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
        let mut returned: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
        let mut back_for_good: Vec<(usize, usize)> = Vec::new();
        let mut by_track: BTreeMap<(usize, usize), Vec<usize>> = BTreeMap::new();
        for (index, attempt) in self.attempts.iter().enumerate() {
            if let Some(track) = attempt.track {
                by_track.entry((attempt.demo, track)).or_default().push(index);
            }
        }
        for ((demo, track), attempts) in by_track {
            if let Some(kind) = self.kind_of(demo, track) {
                manipulated.entry(kind).or_default().insert(demo);
            }
            let ends = |index: usize| {
                let t = &self.attempts[index];
                Some((self.label(demo, track, t.before)?, self.label(demo, track, t.after)?))
            };
            let moves: Vec<(usize, usize, usize)> = attempts
                .iter()
                .filter_map(|index| ends(*index).map(|(from, to)| (*index, from, to)))
                .filter(|(_, from, to)| from != to)
                .collect();
            let final_label = self.recording.demos[demo]
                .snapshots
                .len()
                .checked_sub(1)
                .and_then(|s| self.label(demo, track, s));
            // Clusters visited so far, without loops.
            let mut route: Vec<usize> = Vec::new();
            for (at, (index, from, to)) in moves.iter().copied().enumerate() {
                if route.last() != Some(&from) {
                    route.push(from);
                }
                *direct.entry((from, to)).or_default() += 1;
                let stays = at + 1 == moves.len() && final_label == Some(to);
                if stays {
                    kept.entry(to).or_default().insert(demo);
                }
                if let Some((_, next_from, next_to)) = moves.get(at + 1)
                    && *next_from == to
                    && !route.contains(next_to)
                {
                    *through.entry((from, to, *next_to)).or_default() += 1;
                }
                if let Some(earlier) = route.iter().position(|w| *w == to) {
                    route.truncate(earlier + 1);
                    if stays {
                        returned.entry(to).or_default().insert(demo);
                        back_for_good.push((index, to));
                    } else {
                        found.undone.insert(index);
                    }
                } else {
                    route.push(to);
                }
                let goes_on = moves.get(at + 1).is_some_and(|(_, next_from, _)| *next_from == to);
                if goes_on {
                    passed.insert(to);
                }
                if goes_on || !stays {
                    entered.insert(to);
                }
            }
        }
        // An event in fewer than half of the demonstrations is taken as an accident, not as part of the task.
        let seldom = |cluster: usize, demos: Option<&BTreeSet<usize>>| {
            let all = manipulated.get(&clusters[cluster].kind).map_or(0, BTreeSet::len);
            2 * demos.map_or(0, BTreeSet::len) < all
        };
        for (index, to) in back_for_good {
            if seldom(to, returned.get(&to)) {
                found.undone.insert(index);
            }
        }
        found.detours = entered
            .into_iter()
            .filter(|by| clusters[*by].found == 0 && seldom(*by, kept.get(by)))
            .filter(|by| passed.contains(by) || !kept.contains_key(by))
            .filter(|by| {
                through.iter().filter(|((_, b, _), _)| b == by).all(|((from, _, to), times)| {
                    direct.get(&(*from, *to)).is_some_and(|straight| straight >= times)
                })
            })
            .collect();
        found
    }
}
