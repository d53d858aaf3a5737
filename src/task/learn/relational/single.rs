//! States, actions and goal of a single demonstration.

use crate::task::classify::{Classifier, Layout};
use crate::task::domain::{GoalTerm, Origin, Quantity, RelationalDomain};
use crate::task::error::TaskError;
use crate::task::event::Observer;
use crate::task::learn::{Learned, Settings, paper};
use crate::task::recording::{ObjectPose, Recording};

/// Learns from a single demonstration as the paper does. If an attempt seems to have failed, learns again with the
/// Euclidean distance, and takes the result with fewer failed attempts.
///
/// The paper's distance holds two places for one that agree in one coordinate. With a single demonstration this happens
/// by chance: about one object in twenty lies within a millimetre of a later place in one coordinate.
pub(super) fn learn(
    recording: &Recording,
    settings: &Settings,
    observer: &mut dyn Observer,
) -> Result<Learned, TaskError> {
    let learned = paper::learn(recording, settings, observer)?;
    if learned.report.failed() == 0 || settings.p > 0.0 {
        return Ok(learned);
    }
    let euclidean = Settings { p: 2.0, ..*settings };
    let again = paper::learn(recording, &euclidean, observer)?;
    let fewer = again.report.failed() < learned.report.failed();
    Ok(if fewer { again } else { learned })
}

/// Returns the states into which objects were put, each with the kind of the nearest other object at the end. What did not
/// move comes first.
pub(super) fn unsure_frames(
    domain: &RelationalDomain,
    recording: &Recording,
) -> Vec<(String, String)> {
    let end = recording.demos.iter().find_map(|demo| demo.snapshots.last());
    let placed = domain.states.iter().filter(|state| state.origin == Origin::Placed);
    let beside = placed.filter_map(|state| {
        let at = state.places.first()?.pose();
        let others = end?.objects.iter().filter(|o| *o.kind != *state.kind);
        let moved = |o: &ObjectPose| domain.states.iter().any(|s| *s.kind == *o.kind);
        let far = |o: &ObjectPose| o.pose.distance(&at);
        let near = others.min_by(|a, b| moved(a).cmp(&moved(b)).then(far(a).total_cmp(&far(b))))?;
        Some((state.name.clone(), near.kind.to_string()))
    });
    beside.collect()
}

/// Returns the states that some action achieves and that hold at the end for more objects than at some time before, in
/// the order in which they were completed; the goal of the domain if there is none, or if its state is not among them.
pub(super) fn goals(domain: &RelationalDomain, recording: &Recording) -> Vec<GoalTerm> {
    let classifier = Classifier::new(domain);
    let snapshots = recording.demos.iter().flat_map(|demo| &demo.snapshots);
    let mut last: Option<Layout> = None;
    let counts: Vec<Vec<usize>> = snapshots
        .map(|snapshot| {
            let layout = match &last {
                Some(before) => classifier.classify_after(before, snapshot),
                None => classifier.classify(snapshot),
            };
            let mut counts = vec![0; domain.states.len()];
            layout.located.iter().filter_map(|l| l.fact).for_each(|f| counts[f.state] += 1);
            last = Some(layout);
            counts
        })
        .collect();
    let mut achieved: Vec<usize> = domain.operators.iter().map(|o| o.to).collect();
    achieved.sort_unstable();
    achieved.dedup();
    let mut terms: Vec<(usize, GoalTerm)> = Vec::new();
    for state in achieved {
        let end = counts.last().map_or(0, |counts| counts[state]);
        let Some(lacked) = counts.iter().rposition(|counts| counts[state] < end) else { continue };
        let quantity = Quantity::AtLeast(end);
        terms.push((
            lacked,
            GoalTerm { state, or: Vec::new(), quantity, reference: None, held: 1, of: 1 },
        ));
    }
    terms.sort_by_key(|(lacked, term)| (*lacked, term.state));
    let terms: Vec<GoalTerm> = terms.into_iter().map(|(_, term)| term).collect();
    let whole = domain.goals.iter().all(|goal| terms.iter().any(|t| t.state == goal.state));
    if whole && !terms.is_empty() { terms } else { domain.goals.clone() }
}
