//! Which further demonstration would decide most about the undecided conditions of a learned domain.
//!
//! A demonstration decides a condition if an action is shown in it while the condition does not hold. [`ask`] looks for moves
//! to the goal that do so for as many conditions as possible, from the first scenes of the recording, whole or with some
//! objects left out. A condition that always held in `n` instances counts `1 / (n + 2)`: by Laplace's rule of succession
//! this is the chance that it does not hold in the next one, if nothing keeps it.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;

use crate::task::classify::Classifier;
use crate::task::compile::{Key, Move, Problem};
use crate::task::domain::{RelationalDomain, Situation};
use crate::task::recording::{Recording, Snapshot};

/// A further demonstration, and what it would decide.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Question {
    /// Number of the demonstration in whose first scene it begins.
    pub demo: u64,
    /// Ids of the objects of this scene that are left out.
    pub without: Vec<String>,
    /// The moves to the goal: the name of the action, and the id of the object.
    pub moves: Vec<(String, String)>,
    /// The undecided conditions that do not hold before some of its moves: the name of the action, and the condition in
    /// words.
    pub decides: Vec<(String, String)>,
}

/// Greatest number of first scenes, of situations after each number of moves, of moves, and of moves that are tried in all.
const MOST_SCENES: usize = 3;
const MOST_SITUATIONS: usize = 40;
const MOST_MOVES: usize = 16;
const MOST_TRIED: usize = 50_000;

/// Moves from the first scene, the situation after them, and the undecided needs that they leave unmet.
#[derive(Clone)]
struct Walk {
    situation: Situation,
    moves: Vec<Move>,
    unmet: BTreeSet<(usize, usize)>,
}

/// Returns the demonstration that would decide most; `None` if no order of moves to the goal decides anything.
///
/// `needed` has the conditions that are known to be needed, as in [`Question::decides`]: those without which an earlier
/// question could not be shown. All moves meet them. Tries at most 50,000 moves, fewer where there are many conditions,
/// which takes some hundred milliseconds. With many objects it may therefore miss the best.
pub fn ask(
    domain: &RelationalDomain,
    recording: &Recording,
    needed: &[(String, String)],
) -> Option<Question> {
    let said = |(o, n): (usize, usize)| {
        let operator = &domain.operators[o];
        (operator.name.clone(), domain.need_in_words(operator, &operator.needs[n]))
    };
    let first = |number: usize, ids: &[&str]| {
        let mut scene = recording.demos[number].snapshots.first()?.clone();
        scene.object = None;
        scene.objects.retain(|object| !ids.contains(&&*object.id));
        Some(scene)
    };
    let mut tries = MOST_TRIED;
    let mut best: Option<(f64, Question)> = None;
    for number in 0..recording.demos.len().min(MOST_SCENES) {
        let Some(whole) = first(number, &[]) else { continue };
        let mut left_out: Vec<Vec<&str>> = vec![Vec::new()];
        let kinds: BTreeSet<&str> = domain.states.iter().map(|s| &*s.kind).collect();
        for kind in kinds {
            let own = whole.objects.iter().filter(|o| *o.kind == *kind);
            let ids: Vec<&str> = own.map(|o| &*o.id).collect();
            left_out.extend((1..=ids.len()).map(|count| ids[..count].to_vec()));
        }
        for ids in left_out {
            let Some(scene) = first(number, &ids) else { continue };
            let known = |need| needed.contains(&said(need));
            let Some((weight, walk)) = widest(domain, &scene, known, &mut tries) else { continue };
            // Objects are left out only where that decides more.
            if best.as_ref().is_none_or(|(most, _)| weight > *most + 1e-9) {
                let named = |m: &Move| {
                    let (action, object) =
                        (&domain.operators[m.operator], &scene.objects[m.object]);
                    (action.name.clone(), object.id.to_string())
                };
                let question = Question {
                    demo: recording.demos[number].number,
                    without: ids.iter().map(|id| (*id).to_owned()).collect(),
                    moves: walk.moves.iter().map(named).collect(),
                    decides: walk.unmet.into_iter().map(said).collect(),
                };
                best = Some((weight, question));
            }
        }
    }
    best.map(|(_, question)| question)
}

/// Returns the moves from a scene to the goal that leave most unmet, with the sum of what the needs count; `None` if they
/// leave nothing unmet, or no more moves may be tried. Of equals, the fewest moves are taken. No object makes an action twice.
fn widest(
    domain: &RelationalDomain,
    scene: &Snapshot,
    needed: impl Fn((usize, usize)) -> bool,
    tries: &mut usize,
) -> Option<(f64, Walk)> {
    if *tries == 0 {
        return None;
    }
    let layout = Classifier::new(domain).classify(scene);
    let problem = Problem::new(domain, &layout).ok()?;
    let (needed, undecided): (BTreeSet<(usize, usize)>, BTreeSet<_>) =
        problem.undecided().partition(|need| needed(*need));
    // A move takes longer where there are more conditions.
    let cost = 1 + undecided.len() / 16;
    let weight = |walk: &Walk| -> f64 {
        let of = |(o, n): &(usize, usize)| domain.operators[*o].needs[*n].of as f64;
        walk.unmet.iter().map(|need| 1.0 / (of(need) + 2.0)).sum()
    };
    let start = layout.situation();
    let mut layer = vec![Walk { situation: start, moves: Vec::new(), unmet: BTreeSet::new() }];
    let mut best: Option<(f64, Walk)> = None;
    for _ in 0..=MOST_MOVES {
        let mut next: BTreeMap<Vec<Key>, Walk> = BTreeMap::new();
        for walk in &layer {
            if problem.lacking(&walk.situation) == 0 {
                let own = weight(walk);
                if own > best.as_ref().map_or(0.0, |(most, _)| most + 1e-9) {
                    best = Some((own, walk.clone()));
                }
                continue;
            }
            for m in problem.moves(&walk.situation) {
                if *tries == 0 {
                    return best;
                }
                *tries = tries.saturating_sub(cost);
                let again = |e: &Move| (e.operator, e.object) == (m.operator, m.object);
                let lacks = problem.unmet(&m, &walk.situation, &needed).next().is_some();
                if lacks || walk.moves.iter().any(again) {
                    continue;
                }
                let mut longer = walk.clone();
                longer.unmet.extend(problem.unmet(&m, &walk.situation, &undecided));
                longer.situation = problem.after(&m, &walk.situation);
                longer.moves.push(m);
                let key = problem.key(&longer.situation);
                if next.get(&key).is_none_or(|known| weight(known) < weight(&longer)) {
                    next.insert(key, longer);
                }
            }
        }
        layer = next.into_values().collect();
        layer.sort_by_cached_key(|walk| {
            let decided = (1e9 * weight(walk)).round() as u64;
            (Reverse(decided), problem.lacking(&walk.situation), walk.moves.clone())
        });
        layer.truncate(MOST_SITUATIONS);
    }
    best
}
