//! Finds the clustering threshold of a kind from the data.
//!
//! The idea is that a demonstrator manipulates an object to change its state. For each attempt, the dendrogram gives
//! the height at which the poses before and after join one cluster. A cut at or below that height *explains* the
//! attempt: it leaves the two poses in different clusters. The threshold is the coarsest cut that explains nearly all
//! attempts.
//!
//! Failed attempts, such as a part dropped back on the table, must not lower the cut. Two rules prevent this:
//!
//! * An attempt counts only if the part moved and the join height is at least [`RESOLUTION`] times the distance moved.
//!   A part that was carried half a metre and lies at the same height within micrometres has not changed its state.
//! * The cut is lowered to explain further attempts only if these occur in at least a quarter of the demonstrations and
//!   there are at most two new clusters for each attempt explained.

use super::linkage::Dendrogram;

/// Smallest ratio of join height to distance moved at which an attempt counts in the search for a threshold.
///
/// The join height is the linkage at which the clustering puts the object's poses before and after the attempt into one
/// cluster. A very small ratio means that the two poses agree in some coordinate, so that the object has probably not
/// changed its state.
pub const RESOLUTION: f64 = 1e-3;

/// A manipulation of one part, as points of the dendrogram of its kind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Manipulation {
    /// Index of the demonstration.
    pub demo: usize,
    /// Point of the pose before the manipulation.
    pub before: usize,
    /// Point of the pose after the manipulation.
    pub after: usize,
    /// Distance that the part moved, in metres.
    pub moved: f64,
}

/// Chooses the threshold at which to cut the dendrogram of one kind, from the manipulations of its parts. Merges at or above
/// it are not made.
pub(crate) fn choose(tree: &Dendrogram, manipulations: &[Manipulation]) -> f64 {
    let pairs: Vec<(usize, usize)> = manipulations.iter().map(|m| (m.before, m.after)).collect();
    let joins = tree.join_heights(&pairs);
    let mut counted: Vec<(f64, usize)> = manipulations
        .iter()
        .zip(&joins)
        .filter(|(m, join)| m.moved >= super::attempts::MOVED_M && **join >= RESOLUTION * m.moved)
        .map(|(m, join)| (*join, m.demo))
        .collect();
    counted.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let Some((mut cut, _)) = counted.first().copied() else {
        // Nothing was manipulated, so all poses form one cluster.
        return f64::INFINITY;
    };
    let mut demos: Vec<usize> = manipulations.iter().map(|m| m.demo).collect();
    demos.sort_unstable();
    demos.dedup();

    let mut explained = counted.iter().take_while(|(join, _)| *join >= cut).count();
    let first = explained;
    for (end, &(join, _)) in counted.iter().enumerate().skip(first) {
        // Attempts with equal join heights are explained together.
        if counted.get(end + 1).is_some_and(|next| next.0 == join) {
            continue;
        }
        let gain = &counted[explained..=end];
        let mut having: Vec<usize> = gain.iter().map(|(_, demo)| *demo).collect();
        having.sort_unstable();
        having.dedup();
        let new_clusters = tree.count_at(join) - tree.count_at(cut);
        if 4 * having.len() >= demos.len() && 2 * gain.len() >= new_clusters {
            cut = join;
            explained = end + 1;
        }
    }
    // Every threshold between the next lower merge and the cut gives the same clusters: take the geometric mean.
    let below = tree.last_merge(cut).unwrap_or(0.0);
    if below > 0.0 { (below * cut).sqrt().min(cut) } else { cut / 2.0 }
}
