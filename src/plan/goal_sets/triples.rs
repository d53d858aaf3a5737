//! Sets of up to three fluents: which never hold together, although any two of them may, and how far the others are from what
//! holds at first.

use crate::plan::strips::{GroundOperator, Grounded};

/// Most fluents of a problem whose triples are found: a table has the cube of their number.
const MOST_FLUENTS: usize = 64;
/// Most operators of such a problem.
const MOST_OPERATORS: usize = 1_000;
/// Most sets whose distance is told. Of more, only single fluents and pairs are.
pub(super) const MOST_SETS: usize = 2_500;
/// Most steps of the search for triples. Where it takes more, nothing is known.
const MOST_STEPS: usize = 200_000_000;
/// Number of heights in which distances are told.
pub(super) const HEIGHTS: usize = 6;
/// Distance of what was not reached.
const NEVER: u16 = u16::MAX;

/// What is known of sets of up to three fluents.
#[derive(Default)]
pub(super) struct Triples {
    /// Pairs and triples that never hold together, without those that contain others.
    pub never: Vec<Vec<usize>>,
    /// Sets with their heights, from 1 to [`HEIGHTS`]: whatever contains them is at least as high. Sets that are no higher than their parts
    /// are left out.
    pub heights: Vec<(Vec<usize>, usize)>,
}

/// A table of distances.
struct Table {
    count: usize,
    /// The round in which a triple was first reached, by all orders of its parts. A pair is a triple with one part twice.
    distances: Vec<u16>,
    round: u16,
    steps: usize,
}

impl Table {
    fn distance(&self, [a, b, c]: [usize; 3]) -> u16 {
        self.distances[(a * self.count + b) * self.count + c]
    }

    /// Returns whether a triple was reached before this round.
    fn allowed(&self, triple: [usize; 3]) -> bool {
        self.distance(triple) < self.round
    }

    /// Reaches a triple in this round. Returns whether it was not reached before.
    fn reach(&mut self, [a, b, c]: [usize; 3]) -> bool {
        if self.distance([a, b, c]) != NEVER {
            return false;
        }
        for [a, b, c] in [[a, b, c], [a, c, b], [b, a, c], [b, c, a], [c, a, b], [c, b, a]] {
            self.distances[(a * self.count + b) * self.count + c] = self.round;
        }
        true
    }

    /// Reaches all triples of some fluents. Returns whether some are new.
    fn reach_all(&mut self, fluents: &[usize]) -> bool {
        let mut new = false;
        for a in fluents {
            for b in fluents {
                fluents.iter().for_each(|c| new |= self.reach([*a, *b, *c]));
            }
        }
        new
    }

    /// Returns whether three fluents of which one is in each part were reached before, whichever they are.
    fn allows(&self, first: &[usize], second: &[usize], third: &[usize]) -> bool {
        let allowed = |a, b| third.iter().all(|c| self.allowed([a, b, *c]));
        first.iter().all(|a| second.iter().all(|b| allowed(*a, *b)))
    }

    /// Reaches what an operator leads to. Returns whether something is new.
    fn apply(&mut self, operator: &GroundOperator) -> bool {
        let GroundOperator { preconditions: needs, adds, deletes, .. } = operator;
        if !self.allows(needs, needs, needs) {
            return false;
        }
        self.steps += needs.len().pow(3) + self.count;
        let mut new = self.reach_all(adds);
        let stays = |f: &usize| !adds.contains(f) && !deletes.contains(f);
        let with_needs = |f: &usize| self.allowed([*f; 3]) && self.allows(needs, needs, &[*f]);
        let kept = (0..self.count).filter(stays).filter(with_needs);
        let kept: Vec<usize> = kept.filter(|f| self.allows(needs, &[*f], &[*f])).collect();
        self.steps += kept.len().pow(2) * (needs.len() + adds.len()) / 2;
        for (place, a) in kept.iter().enumerate() {
            for x in adds {
                adds.iter().for_each(|y| new |= self.reach([*x, *y, *a]));
            }
            for b in &kept[place..] {
                if self.allowed([*a, *b, *b]) && self.allows(needs, &[*a], &[*b]) {
                    adds.iter().for_each(|x| new |= self.reach([*x, *a, *b]));
                }
            }
        }
        new
    }

    /// Returns the greatest distance.
    fn farthest(&self) -> usize {
        let reached = self.distances.iter().filter(|distance| **distance != NEVER);
        usize::from(reached.max().copied().unwrap_or(0))
    }

    /// Returns each set that is higher than its parts, with its height. `height` tells it from the distance.
    fn higher(&self, height: impl Fn(u16) -> usize) -> impl Iterator<Item = (Vec<usize>, usize)> {
        let pairs = (0..self.count).flat_map(|a| (a..self.count).map(move |b| [a, b]));
        let all = pairs.flat_map(|[a, b]| (b..self.count).map(move |c| [a, b, c]));
        all.filter(|[a, b, c]| !(a == b && b < c)).filter_map(move |[a, b, c]| {
            let parts = match (a == b, b == c) {
                (true, _) => vec![],
                (_, true) => vec![[a; 3], [b; 3]],
                _ => vec![[a, b, b], [a, c, c], [b, c, c]],
            };
            let of = |set| height(self.distance(set));
            let of_parts = parts.into_iter().map(of).max().unwrap_or(0);
            let own = of([a, b, c]);
            let mut set = vec![a, b, c];
            set.dedup();
            (own > of_parts).then_some((set, own))
        })
    }
}

/// Returns whether a problem is small enough for a table of triples.
pub(super) fn small(problem: &Grounded) -> bool {
    problem.fluents.len() <= MOST_FLUENTS && problem.operators.len() <= MOST_OPERATORS
}

/// Finds what is known of triples in a problem with at most 64 fluents and 1,000 operators. Of other problems nothing is known.
///
/// The distance of a set is the round in which a fixpoint over triples reaches it (h^3; Haslum and Geffner, "Admissible heuristics
/// for optimal planning", 2000): no plan that reaches the set has fewer actions. It is sound: what it does not reach never
/// holds in a plan. Operators that add nothing are left out. Heights are equal parts of the greatest distance.
///
/// Costs O(rounds x operators x fluents² x preconditions), up to a few tenths of a second.
pub(super) fn triples(problem: &Grounded) -> Triples {
    let Some(table) = filled(problem) else { return Triples::default() };
    let farthest = table.farthest().max(1);
    let height = |distance| match distance {
        NEVER => HEIGHTS + 1,
        distance => (usize::from(distance) * HEIGHTS).div_ceil(farthest),
    };
    let (never, mut heights): (Vec<_>, Vec<_>) =
        table.higher(height).partition(|(_, height)| *height > HEIGHTS);
    if heights.len() > MOST_SETS {
        heights.retain(|(set, _)| set.len() < 3);
    }
    Triples { never: never.into_iter().map(|(set, _)| set).collect(), heights }
}

/// Returns the table of a problem, if it is small and does not take too many steps.
fn filled(problem: &Grounded) -> Option<Table> {
    let count = problem.fluents.len();
    if !small(problem) {
        return None;
    }
    let mut table = Table { count, distances: vec![NEVER; count.pow(3)], round: 0, steps: 0 };
    table.reach_all(&problem.start);
    let useful = problem.operators.iter().filter(|operator| !operator.adds.is_empty());
    while table.steps <= MOST_STEPS && table.round < NEVER - 1 {
        table.round += 1;
        if !useful.clone().fold(false, |new, operator| table.apply(operator) | new) {
            return Some(table);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use std::collections::{BTreeMap, BTreeSet, VecDeque};

    use rand::RngExt;

    use super::*;
    use crate::plan::goal_sets::rules::Regression;
    use crate::plan::strips::{Bodies, Domain, Problem};
    use crate::sim::Seed;

    fn grounded(domain: &str, problem: &str) -> Option<Grounded> {
        let domain = Domain::parse(domain.as_bytes(), "d", Bodies::Read).expect("a domain");
        let problem = Problem::parse(problem.as_bytes(), "p", &domain).expect("a problem");
        Grounded::new(&domain, &problem).ok()
    }

    #[test]
    fn three_things_never_share_two_places_though_any_two_do() {
        // Two tokens are passed on among three places.
        let moves: String = [(0, 1), (1, 2), (2, 0), (1, 0), (2, 1), (0, 2)]
            .map(|(a, b)| {
                format!(
                    "(:action m{a}{b} :parameters () :precondition (and (at{a}) (free{b}))
                     :effect (and (at{b}) (free{a}) (not (at{a})) (not (free{b}))))"
                )
            })
            .concat();
        let domain = format!(
            "(define (domain d) (:predicates (at0) (at1) (at2) (free0) (free1) (free2)) {moves})"
        );
        let problem = "(define (problem p) (:domain d) (:init (at0) (at1) (free2)) (:goal (and (at1) (at2))))";
        let problem = grounded(&domain, problem).expect("a problem that can be reached");
        let found = triples(&problem).never;
        let names =
            |set: &Vec<usize>| set.iter().map(|f| problem.fluents[*f].to_string()).collect();
        let mut names: Vec<Vec<String>> = found.iter().map(names).collect();
        names.iter_mut().for_each(|n| n.sort());
        let three = ["(at0)", "(at1)", "(at2)"].map(String::from);
        assert!(names.iter().any(|set| *set == three), "{names:?}");
    }

    /// A problem of ten facts and fifteen actions, drawn at random; none if its goal is out of reach for certain.
    fn drawn(seed: u64) -> Option<Grounded> {
        let mut rng = Seed::new(seed).rng();
        let mut some = |most: usize| -> Vec<usize> {
            (0..rng.random_range(1..=most)).map(|_| rng.random_range(0..10)).collect()
        };
        let list = |facts: &[usize]| facts.iter().map(|f| format!("(f{f})")).collect::<String>();
        let actions: String = (0..15)
            .map(|a| {
                // Something adds each fact.
                let mut adds = some(2);
                adds[0] = if a < 10 { a } else { adds[0] };
                let (mut needs, mut lost) = (some(3), some(1));
                lost.extend(&needs[1..]);
                if a == 14 {
                    needs.clear();
                }
                let lost = lost.iter().filter(|f| !adds.contains(f));
                let lost: String = lost.map(|f| format!("(not (f{f}))")).collect();
                let (needs, adds) = (list(&needs), list(&adds));
                format!(
                    "(:action a{a} :parameters () :precondition (and {needs}) :effect (and {adds}{lost}))"
                )
            })
            .collect();
        let facts = list(&(0..10).collect::<Vec<_>>());
        let domain = format!("(define (domain d) (:predicates {facts}) {actions})");
        let (start, goal) = (list(&some(3)), list(&some(3)));
        let problem =
            format!("(define (problem p) (:domain d) (:init {start}) (:goal (and {goal})))");
        grounded(&domain, &problem)
    }

    /// Returns the states of a problem that can be reached, with the number of actions that it takes.
    fn reachable(problem: &Grounded) -> BTreeMap<BTreeSet<usize>, usize> {
        let start: BTreeSet<usize> = problem.start.iter().copied().collect();
        let mut seen = BTreeMap::from([(start.clone(), 0)]);
        let mut left = VecDeque::from([(start, 0)]);
        while let Some((state, distance)) = left.pop_front() {
            for operator in problem.operators.iter().filter(|o| !o.adds.is_empty()) {
                if operator.preconditions.iter().all(|need| state.contains(need)) {
                    let kept = state.iter().filter(|f| !operator.deletes.contains(f));
                    let next: BTreeSet<usize> = kept.chain(&operator.adds).copied().collect();
                    if !seen.contains_key(&next) {
                        seen.insert(next.clone(), distance + 1);
                        left.push_back((next, distance + 1));
                    }
                }
            }
        }
        seen
    }

    #[test]
    fn what_is_never_or_far_is_so_in_all_reachable_states() {
        let (mut never, mut missed, mut far) = (0, 0, 0);
        for problem in (0..150).filter_map(drawn) {
            let states = reachable(&problem);
            let found = triples(&problem);
            let distance = |set: &[usize]| {
                let with = states.iter().filter(|(state, _)| set.iter().all(|f| state.contains(f)));
                with.map(|(_, distance)| *distance).min()
            };
            assert!(found.never.iter().all(|set| distance(set).is_none()));
            never += found.never.iter().filter(|set| set.len() == 3).count();
            let most = filled(&problem).expect("a small problem").farthest();
            for (set, height) in &found.heights {
                // At least so many actions, and the height of a set that is never reached is not too low.
                let least = (height - 1) * most / HEIGHTS + 1;
                assert!(distance(set).is_none_or(|distance| distance >= least), "{set:?} {height}");
                far += usize::from(least > 1);
                missed += usize::from(distance(set).is_none() && set.len() == 3);
            }
        }
        // Most triples that never hold are told from those that do.
        assert!(never > 30 && never > 5 * missed && far > 300, "{never}, {missed}, {far}");
    }

    #[test]
    fn no_action_that_can_be_done_is_barred_from_what_it_leaves() {
        let (mut barred, mut done) = (0, 0);
        for problem in (0..150).filter_map(drawn) {
            let rules = Regression::new(&problem);
            barred += rules.bars.len();
            // What is barred holds in no plan. So states behind operators that are in no plan do not count.
            let mut useful = problem.clone();
            for (operator, seen) in useful.operators.iter_mut().zip(&rules.operators) {
                operator.adds.clone_from(&seen.adds);
            }
            for state in reachable(&useful).into_keys() {
                for (place, operator) in rules.operators.iter().enumerate() {
                    let possible = operator.preconditions.iter().all(|need| state.contains(need));
                    if operator.adds.is_empty() || !possible {
                        continue;
                    }
                    done += 1;
                    let deletes = &problem.operators[place].deletes;
                    let stays = |f: &usize| !operator.adds.contains(f) && !deletes.contains(f);
                    let left: Vec<usize> = state.iter().filter(|f| stays(f)).copied().collect();
                    assert!(!operator.threatens.iter().any(|f| left.contains(f)));
                    let mut bars = rules.bars.iter().filter(|(_, all)| all.contains(&place));
                    assert!(!bars.any(|(pair, _)| pair.iter().all(|f| left.contains(f))));
                }
            }
        }
        assert!(barred > 30 && done > 10_000, "{barred} {done}");
    }
}
