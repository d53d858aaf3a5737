//! Guesses about objects in no state, such as a part that was dropped.

use super::problem::Problem;
use crate::robot::UP;
use crate::task::classify::Layout;
use crate::task::domain::{Coordinate, Fact, RelationalDomain, Situation};
use crate::task::recording::ObjectPose;

/// Height at which an object that is not seen is remembered, in metres. No state and no reference is near it.
pub(crate) const UNSEEN_M: f64 = -1e3;

/// Returns the situation of a layout. With `assume`, an object in no state, such as one that was dropped, is taken to be
/// in a state that some action leaves: the one from which the reference planner would move this object first.
pub(crate) fn assumed(problem: &Problem<'_>, layout: &Layout, assume: bool) -> Situation {
    let mut situation = layout.situation();
    if !assume {
        return situation;
    }
    let domain = problem.domain();
    let unknown: Vec<(usize, Vec<Fact>)> = (0..layout.objects.len())
        .filter(|i| situation[*i].is_none() && is_loose(domain, &layout.objects[*i]))
        .map(|i| (i, guesses(domain, layout, i)))
        .collect();
    if unknown.is_empty() {
        return situation;
    }
    // All are guessed first: a goal that needs two of them has no plan with one alone.
    for (i, facts) in &unknown {
        situation[*i] = facts.first().copied();
    }
    let problem = &problem.starting_from(&situation);
    for (i, facts) in &unknown {
        let mut best: Option<((usize, usize), Fact)> = None;
        for fact in facts {
            let mut guess = situation.clone();
            guess[*i] = Some(*fact);
            let Ok(plan) = problem.plan(&guess, &[]) else { continue };
            let Some(at) = plan.iter().position(|m| m.action.object == *i) else { continue };
            if best.is_none_or(|(key, _)| (at, plan.len()) < key) {
                best = Some(((at, plan.len()), *fact));
            }
        }
        if let Some((_, fact)) = best {
            situation[*i] = Some(fact);
        }
    }
    situation
}

/// Returns whether an object is seen, and of a kind that some action moves.
pub(crate) fn is_loose(domain: &RelationalDomain, object: &ObjectPose) -> bool {
    let moved = |to: usize| *domain.states[to].kind == *object.kind;
    object.pose.position[UP] > UNSEEN_M / 2.0 && domain.operators.iter().any(|o| moved(o.to))
}

/// Returns whether an object lies as high, give or take `most_m`, as in some place from which actions take its kind: what lies in a
/// bowl, say, is higher than what lies beside it. Places in the frame of an object count from that object. Parts of one divided kind
/// lie as high as each other: a red shirt in a white basket as a blue one does.
pub(crate) fn lies_as_high(
    domain: &RelationalDomain,
    layout: &Layout,
    object: usize,
    most_m: f64,
) -> bool {
    let own = &layout.objects[object];
    let left = domain.operators.iter().flat_map(|o| &o.from).map(|state| &domain.states[*state]);
    let mut states = left.filter(|state| domain.are_alike(&state.kind, &own.kind));
    states.any(|state| {
        let from: Vec<f64> = match state.frame.kind() {
            None => vec![0.0],
            Some(kind) => {
                let all = layout.objects.iter().enumerate();
                let all = all.filter(|(i, o)| *i != object && domain.are_alike(&o.kind, kind));
                all.map(|(_, o)| o.pose.position[UP]).collect()
            }
        };
        let mut heights = state.places.iter().map(|place| place.coordinates[UP]);
        heights.any(|height| match height {
            Coordinate::Tight { mean, .. } => {
                from.iter().any(|from| (own.pose.position[UP] - from - mean).abs() <= most_m)
            }
            Coordinate::Open { .. } => false,
        })
    })
}

/// Returns the states that actions leave, with the nearest reference, for an object in no state.
fn guesses(domain: &RelationalDomain, layout: &Layout, object: usize) -> Vec<Fact> {
    let own = &layout.objects[object];
    let mut left: Vec<usize> = domain.operators.iter().flat_map(|o| o.from.clone()).collect();
    left.sort_unstable();
    left.dedup();
    left.retain(|s| *domain.states[*s].kind == *own.kind);
    let facts = left.into_iter().filter_map(|state| {
        let reference = match domain.states[state].frame.kind() {
            None => None,
            Some(kind) => {
                let all = layout.objects.iter().enumerate();
                let all = all.filter(|(i, o)| *i != object && *o.kind == *kind);
                let near = |o: &ObjectPose| o.pose.distance(&own.pose);
                Some(all.min_by(|a, b| near(a.1).total_cmp(&near(b.1)))?.0)
            }
        };
        Some(Fact { state, place: 0, reference })
    });
    facts.collect()
}
