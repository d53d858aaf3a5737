//! Finding the clustering threshold from the data: a manipulation is done to change a state.
//!
//! For each attempt the dendrogram gives the height at which its two poses join one cluster. A cut below that
//! height explains the attempt. The coarsest cut that explains nearly all attempts is wanted. Failed attempts (a
//! part dropped back on the table) must not pull the cut down:
//!
//! * an attempt counts only if its two poses are told apart by every coordinate to at least a thousandth of the
//!   way the part went ([`RESOLUTION`]): a part that was carried half a metre and lies at the same
//!   height to a few micrometres has not changed its state;
//! * the cut goes down for attempts that a coarser one leaves unexplained only if at least a quarter of the
//!   demonstrations have one, and if it makes at most two new clusters for each attempt that it explains.

use super::linkage::Dendrogram;

/// Least ratio of join height to distance travelled for an attempt to count.
pub const RESOLUTION: f64 = 1e-3;

/// A manipulation of one part, seen from the dendrogram of its kind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Manipulation {
    /// Which demonstration it belongs to.
    pub demo: usize,
    /// The point before.
    pub before: usize,
    /// The point after.
    pub after: usize,
    /// Metres between the two.
    pub moved: f64,
}

/// Where to cut the dendrogram of one kind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Choice {
    /// Merges at or above this are not made.
    pub threshold: f64,
    /// How many manipulations end in another cluster than they began in.
    pub explained: usize,
}

/// The threshold for one kind, from the manipulations of its parts.
pub(crate) fn choose(tree: &Dendrogram, manipulations: &[Manipulation]) -> Choice {
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
        // Nothing was manipulated: one state.
        return Choice { threshold: f64::INFINITY, explained: 0 };
    };
    let mut demos: Vec<usize> = manipulations.iter().map(|m| m.demo).collect();
    demos.sort_unstable();
    demos.dedup();

    let mut explained = counted.iter().take_while(|(join, _)| *join >= cut).count();
    let first = explained;
    for (end, &(join, _)) in counted.iter().enumerate().skip(first) {
        // Take all of one height together.
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
    // Any threshold down to the next lower merge gives the same clusters: stand in the middle.
    let below = tree.last_merge(cut).unwrap_or(0.0);
    let threshold = if below > 0.0 { (below * cut).sqrt().min(cut) } else { cut / 2.0 };
    Choice { threshold, explained: joins.iter().filter(|j| **j >= cut).count() }
}
