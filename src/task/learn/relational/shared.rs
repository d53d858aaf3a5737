//! Areas in which things of several kinds lie: what few poses of one kind do not show, those of the others do.

use super::frames::Frames;
use super::places::Group;

/// Number of poses of other kinds from which they show an area.
const MANY: usize = 6;
/// How far beyond the poses of the others the area goes, as a share of their range, and in metres.
const BEYOND: f64 = 0.5;
const BEYOND_M: f64 = 5e-3;

impl Frames<'_, '_> {
    /// Returns the frame, not the world, in which all these poses of a kind lie among those of other kinds, so that they are no outliers;
    /// `None` if there is none. `all` are the states with their kinds.
    pub fn shared(
        &self,
        kind: usize,
        rests: &[usize],
        all: &[(usize, bool, Vec<Group>)],
    ) -> Option<usize> {
        let others = |frame: usize| {
            let groups = all.iter().filter(move |(own, ..)| *own != kind).flat_map(|(.., g)| g);
            let groups = groups.filter(move |group| group.frame == frame && group.rests.len() > 1);
            groups.flat_map(|group| &group.rests).filter_map(move |rest| self.pose(*rest, frame))
        };
        (1..=self.kinds.len()).find(|frame| {
            let there: Vec<[f64; 3]> = others(*frame).map(|pose| pose.position).collect();
            let among = |at: [f64; 3]| {
                (0..3).all(|i| {
                    let values = there.iter().map(|other| other[i]);
                    let low = values.clone().fold(f64::INFINITY, f64::min);
                    let high = values.fold(f64::NEG_INFINITY, f64::max);
                    let beyond = BEYOND_M.max(BEYOND * (high - low));
                    at[i] >= low - beyond && at[i] <= high + beyond
                })
            };
            let own =
                |rest: &usize| self.pose(*rest, *frame).is_some_and(|pose| among(pose.position));
            there.len() >= MANY && rests.iter().all(own)
        })
    }
}
