//! Joins clusters into states with several places.

use std::collections::BTreeMap;

use statrs::distribution::{DiscreteCDF as _, Hypergeometric};

use super::frames::Frames;
use super::motion::Came;
use super::places::{Group, common_frame};

impl Frames<'_, '_> {
    /// Joins clusters into states with several places: clusters in one frame that are entered from the same clusters
    /// and left for the same clusters, or that overlap. `turns` says whether orientations tell clusters apart.
    pub fn together(&self, groups: Vec<Group>, turns: bool) -> Vec<Vec<Group>> {
        let n = groups.len();
        let mut owner: BTreeMap<usize, usize> = BTreeMap::new();
        for (g, group) in groups.iter().enumerate() {
            for r in &group.rests {
                let mut rest = Some(*r);
                while let Some(r) = rest {
                    owner.insert(r, g);
                    rest = self.carried_to.get(&r).copied();
                }
            }
        }
        let mut moves: BTreeMap<(usize, usize), usize> = BTreeMap::new();
        for attempt in &self.motion.attempts {
            let ends = self.motion.ends(attempt);
            let ends = ends.and_then(|(b, a)| Some((*owner.get(&b)?, *owner.get(&a)?)));
            if let Some(ends) = ends {
                *moves.entry(ends).or_default() += 1;
            }
        }
        // What objects do by themselves tells clusters apart as well, if no attempt leads there.
        for (index, group) in groups.iter().enumerate() {
            let came = |rest: &usize| self.motion.rests[*rest].came;
            if group.rests.iter().all(|rest| came(rest) == Came::Carried) {
                for before in group.rests.iter().filter_map(|rest| self.motion.previous(*rest)) {
                    let from = owner.get(&before).filter(|from| **from != index);
                    from.into_iter()
                        .for_each(|from| *moves.entry((*from, index)).or_default() += 1);
                }
            }
        }
        let found: Vec<bool> = groups
            .iter()
            .map(|g| {
                let found = g.rests.iter().filter(|r| self.motion.rests[**r].came == Came::Found);
                2 * found.count() > g.rests.len()
            })
            .collect();
        let mut state: Vec<usize> = (0..n).collect();
        loop {
            let mut merged = false;
            for a in 0..n {
                for b in a + 1..n {
                    let mixed = found[a] != found[b];
                    if state[a] == state[b]
                        || mixed && !self.as_often_found(&groups, &state, [a, b])
                    {
                        continue;
                    }
                    let ends = |x: usize, forwards: bool| -> BTreeMap<usize, usize> {
                        let mut ends = BTreeMap::new();
                        for ((f, t), count) in &moves {
                            let (f, t) = if forwards { (*f, *t) } else { (*t, *f) };
                            if state[f] == state[x] && state[t] != state[x] {
                                *ends.entry(state[t]).or_default() += count;
                            }
                        }
                        ends
                    };
                    let linked = moves.keys().any(|(f, t)| {
                        (state[*f], state[*t]) == (state[a], state[b])
                            || (state[*f], state[*t]) == (state[b], state[a])
                    });
                    let sources = ends(a, false);
                    let (of_a, of_b) = (state[a], state[b]);
                    let alike = by_chance(&sources, &ends(b, false))
                        && by_chance(&ends(a, true), &ends(b, true));
                    let reached = found[a] || !sources.is_empty();
                    let share = |a: usize, b: usize| {
                        let both = [state[a], state[b]];
                        let all: Vec<usize> =
                            (0..n).filter(|g| both.contains(&state[*g])).collect();
                        common_frame(&groups, &all)
                    };
                    // Each of two places was left for a place of its own, which few moves do by chance.
                    let crossed = || {
                        let (to_a, to_b) = (ends(a, true), ends(b, true));
                        let ends = only(&to_a).zip(only(&to_b));
                        let ((c, from_a), (d, from_b)) = ends.filter(|(a, b)| a.0 != b.0)?;
                        let beside = |frame: Option<usize>| frame.is_some_and(|frame| frame > 0);
                        let may =
                            found[c] == found[d] && beside(share(a, b)) && beside(share(c, d));
                        (may && apart(from_a, from_b) > CHANCE_BOTH).then_some((c, d))
                    };
                    let layers = || {
                        let (a, b) = (&groups[a], &groups[b]);
                        self.are_layers(a, b) || self.are_layers(b, a)
                    };
                    let one_place = || {
                        let put = !turns && !found[a] && !found[b];
                        put && self.overlap(&groups[a], &groups[b])
                    };
                    let may = !linked && share(a, b).is_some() && !layers();
                    if may && (alike && reached || one_place()) {
                        join(&mut state, of_a, of_b);
                        merged = true;
                    } else if found[a]
                        && !mixed
                        && !linked
                        && let Some((c, d)) = crossed()
                    {
                        join(&mut state, of_a, of_b);
                        join(&mut state, c, d);
                        merged = true;
                    }
                }
            }
            if !merged {
                break;
            }
        }
        let mut out: BTreeMap<usize, Vec<Group>> = BTreeMap::new();
        let frames: Vec<Option<usize>> = (0..n)
            .map(|g| {
                let all: Vec<usize> = (0..n).filter(|h| state[*h] == state[g]).collect();
                common_frame(&groups, &all)
            })
            .collect();
        for ((mut group, state), frame) in groups.into_iter().zip(state).zip(frames) {
            group.frame = frame.unwrap_or(group.frame);
            out.entry(state).or_default().push(group);
        }
        out.into_values().collect()
    }

    /// Returns whether things were put to the places of two states, and were found in the one more often than in the other
    /// by chance alone: a slot of a rack that happened to be taken at the start of some demonstrations.
    fn as_often_found(&self, groups: &[Group], state: &[usize], of: [usize; 2]) -> bool {
        let rests = of.map(|one| -> Vec<usize> {
            let own = groups.iter().zip(state).filter(|(_, s)| **s == state[one]);
            own.flat_map(|(group, _)| group.rests.clone()).collect()
        });
        let found = |rests: &Vec<usize>| {
            rests.iter().filter(|rest| self.motion.rests[**rest].came == Came::Found).count()
        };
        let [(a, of_a), (b, of_b)] = [0, 1].map(|i| (found(&rests[i]), rests[i].len()));
        let more = if a * of_b >= b * of_a { (a, of_a) } else { (b, of_b) };
        let put = |rests: &Vec<usize>| rests.iter().any(|rest| self.was_put(*rest));
        // Which places are the one state and which the other follows from how often things were found there: a row of them can be cut
        // in so many ways.
        let cuts = state.iter().filter(|s| of.map(|one| state[one]).contains(s)).count() - 1;
        rests.iter().all(put)
            && so_many_found(more, (a + b, of_a + of_b)) * cuts as f64 > CHANCE_BOTH
    }
}

/// Returns the probability that of some things so many or more were found, if those that were found of all were dealt out at random
/// (Fisher's exact test). Both are given with the number of things.
pub(super) fn so_many_found((found, of): (usize, usize), (all, of_all): (usize, usize)) -> f64 {
    let dealt = Hypergeometric::new(of_all as u64, all as u64, of as u64);
    dealt.map_or(0.0, |dealt| found.checked_sub(1).map_or(1.0, |less| dealt.sf(less as u64)))
}

/// Least probability at which a difference is taken for chance, of the sources or sinks of two places, and of both together.
const CHANCE: f64 = 0.05;
pub(super) const CHANCE_BOTH: f64 = 0.01;

/// Joins two states.
fn join(state: &mut [usize], a: usize, b: usize) {
    state.iter_mut().filter(|s| **s == a.max(b)).for_each(|s| *s = a.min(b));
}

/// Returns the only end of some moves, with their number; `None` if there are several.
fn only(ends: &BTreeMap<usize, usize>) -> Option<(usize, usize)> {
    let mut all = ends.iter().map(|(end, count)| (*end, *count));
    all.next().filter(|_| all.next().is_none())
}

/// Returns the probability that so many moves each, dealt out at random, are apart.
fn apart(a: usize, b: usize) -> f64 {
    (1..=a).map(|i| i as f64 / (b + i) as f64).product()
}

/// Returns whether two places have the same sources or sinks, given with their numbers of moves. One that only one of two
/// places has is taken for chance if all its moves would often be at that place, were they dealt out at random
/// (Fisher's exact test). The places must have one in common, unless neither has any.
fn by_chance(a: &BTreeMap<usize, usize>, b: &BTreeMap<usize, usize>) -> bool {
    let number = |of: &BTreeMap<usize, usize>| of.values().sum::<usize>();
    let (of_a, of_b) = (number(a), number(b));
    let often = |own: &BTreeMap<usize, usize>, other: &BTreeMap<usize, usize>, of: usize| {
        own.iter().filter(|(end, _)| !other.contains_key(end)).all(|(_, count)| {
            let here = |i: usize| (of - i) as f64 / (of_a + of_b - i) as f64;
            (0..*count).map(here).product::<f64>() > CHANCE
        })
    };
    let common = a.keys().any(|end| b.contains_key(end)) || (a.is_empty() && b.is_empty());
    common && often(a, b, of_a) && often(b, a, of_b)
}
