//! Areas in which things of several kinds lie: what few poses of one kind do not show, those of the others do.

use std::collections::BTreeSet;

use super::frames::Frames;
use super::places::Group;

/// Number of poses of other kinds from which they show an area.
const MANY: usize = 6;
/// How far beyond the poses of the others the area goes, as a share of their range, and in metres.
const BEYOND: f64 = 0.5;
const BEYOND_M: f64 = 5e-3;

impl Frames<'_, '_> {
    /// Returns the frame, not the world, in which all these poses of a kind lie among those of at least two other kinds, so that they are
    /// no outliers; `None` if there is none. Of several, it is that with the smallest area. `all` are the states with their kinds. Costs
    /// O(frames x rests).
    pub fn shared(
        &self,
        kind: usize,
        rests: &[usize],
        all: &[(usize, bool, Vec<Group>)],
    ) -> Option<usize> {
        let areas = (1..=self.kinds.len()).filter(|frame| frame - 1 != kind).filter_map(|frame| {
            let (mut kinds, mut count) = (BTreeSet::new(), 0);
            let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
            for (own, _, groups) in all.iter().filter(|(own, ..)| *own != kind) {
                let there = groups.iter().filter(|g| g.frame == frame && g.rests.len() > 1);
                for pose in there.flat_map(|g| &g.rests).filter_map(|r| self.pose(*r, frame)) {
                    kinds.insert(*own);
                    count += 1;
                    for (range, value) in range.iter_mut().zip(pose.position) {
                        *range = [range[0].min(value), range[1].max(value)];
                    }
                }
            }
            if kinds.len() < 2 || count < MANY {
                return None;
            }
            let among = |rest: &usize| {
                let at = self.pose(*rest, frame)?.position;
                let inside = range.iter().zip(at).all(|([low, high], value)| {
                    let beyond = BEYOND_M.max(BEYOND * (high - low));
                    value >= low - beyond && value <= high + beyond
                });
                inside.then_some(())
            };
            rests.iter().map(among).collect::<Option<()>>()?;
            Some((range.iter().map(|[low, high]| (high - low).powi(2)).sum::<f64>(), frame))
        });
        let smallest = areas.min_by(|a, b| a.0.total_cmp(&b.0));
        smallest.map(|(_, frame)| frame)
    }
}
