//! Agglomerative clustering with average linkage, and flat cuts of its dendrogram.
//!
//! The dendrogram is kodama's (nearest-neighbour chain, O(n^2) time). The flat cut follows the paper's tool:
//! clusters whose linkage is at or above the threshold are not merged.

use crate::task::domain::distance::distance_matrix;
use crate::task::error::TaskError;

/// Most points that are clustered: their distances take 1.6 GB.
pub const MAX_POINTS: usize = 20_000;

/// One merge of two clusters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Merge {
    /// The first cluster: a point if below the number of points, else the merge with that number
    /// less the number of points.
    pub first: usize,
    /// The second cluster, numbered likewise.
    pub second: usize,
    /// The mean distance between their points.
    pub height: f64,
}

/// A full hierarchy of merges, lowest first.
#[derive(Debug, Clone, PartialEq)]
pub struct Dendrogram {
    points: usize,
    merges: Vec<Merge>,
}

impl Dendrogram {
    /// Clusters positions by p-norm distance and average linkage. Costs O(n^2) time and memory.
    ///
    /// # Errors
    /// [`TaskError::TooManyPoses`] above [`MAX_POINTS`]; `kind` names the points there.
    pub fn new(points: &[[f64; 3]], p: f64, kind: &str) -> Result<Self, TaskError> {
        let n = points.len();
        if n > MAX_POINTS {
            return Err(TaskError::TooManyPoses {
                kind: kind.into(),
                poses: n,
                gigabytes: (n as f64).powi(2) * 4e-9,
                most: MAX_POINTS,
            });
        }
        if n < 2 {
            return Ok(Self { points: n, merges: Vec::new() });
        }
        Ok(Self::from_condensed(distance_matrix(points, p), n))
    }

    fn from_condensed(mut distances: Vec<f64>, n: usize) -> Self {
        let tree = kodama::linkage(&mut distances, n, kodama::Method::Average);
        let merges = tree
            .steps()
            .iter()
            .map(|s| Merge { first: s.cluster1, second: s.cluster2, height: s.dissimilarity })
            .collect();
        Self { points: n, merges }
    }

    /// How many points were clustered.
    pub fn len(&self) -> usize {
        self.points
    }

    /// Whether there were none.
    pub fn is_empty(&self) -> bool {
        self.points == 0
    }

    /// All merges, lowest first.
    pub fn merges(&self) -> &[Merge] {
        &self.merges
    }

    /// How many clusters a cut at `threshold` leaves: merges at or above it are not made.
    pub fn count_at(&self, threshold: f64) -> usize {
        self.points - self.merges.partition_point(|m| m.height < threshold)
    }

    /// The height of the first merge that a cut at `threshold` does not make.
    pub fn next_merge(&self, threshold: f64) -> Option<f64> {
        self.merges.get(self.merges.partition_point(|m| m.height < threshold)).map(|m| m.height)
    }

    /// The greatest height below `threshold`: the last merge that the cut makes.
    pub fn last_merge(&self, threshold: f64) -> Option<f64> {
        let made = self.merges.partition_point(|m| m.height < threshold);
        made.checked_sub(1).map(|i| self.merges[i].height)
    }

    /// The cluster of each point when merges at or above `threshold` are not made, numbered from
    /// 0 in the order in which clusters first appear.
    pub fn cut(&self, threshold: f64) -> Vec<usize> {
        let made = self.merges.partition_point(|m| m.height < threshold);
        let mut parent: Vec<usize> = (0..self.points + made).collect();
        for (index, merge) in self.merges[..made].iter().enumerate() {
            parent[merge.first] = self.points + index;
            parent[merge.second] = self.points + index;
        }
        // A merge's parent is a later merge, so going backwards every root is known in time.
        for node in (0..parent.len()).rev() {
            parent[node] = parent[parent[node]];
        }
        let mut names = std::collections::HashMap::new();
        parent[..self.points]
            .iter()
            .map(|root| {
                let next = names.len();
                *names.entry(*root).or_insert(next)
            })
            .collect()
    }

    /// For each pair of points, the height of the merge that first puts them into one cluster (the
    /// cophenetic distance); 0 for a point and itself. Costs O(n) a pair at worst.
    pub fn join_heights(&self, pairs: &[(usize, usize)]) -> Vec<f64> {
        let mut parent = vec![usize::MAX; self.points + self.merges.len()];
        for (index, merge) in self.merges.iter().enumerate() {
            parent[merge.first] = self.points + index;
            parent[merge.second] = self.points + index;
        }
        let join = |a: usize, b: usize| {
            let (mut a, mut b) = (a, b);
            while a != b {
                // The lower number cannot be an ancestor of the higher one.
                let lower = if a < b { &mut a } else { &mut b };
                *lower = parent[*lower];
            }
            if a < self.points { 0.0 } else { self.merges[a - self.points].height }
        };
        pairs.iter().map(|(a, b)| join(*a, *b)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::domain::distance::p_distance;

    fn points(n: usize) -> Vec<[f64; 3]> {
        let wave = |i: usize, k: f64| ((i as f64 + 1.0) * k).sin();
        (0..n).map(|i| [wave(i, 1.7), wave(i, 2.3), wave(i, 0.9)]).collect()
    }

    /// Average linkage by its definition: merge the two clusters of least mean pairwise distance.
    fn brute_force(points: &[[f64; 3]], p: f64) -> Vec<f64> {
        let mut clusters: Vec<Vec<usize>> = (0..points.len()).map(|i| vec![i]).collect();
        let mut heights = Vec::new();
        while clusters.len() > 1 {
            let (mut best, mut pair) = (f64::INFINITY, (0, 1));
            for i in 0..clusters.len() {
                for j in i + 1..clusters.len() {
                    let mut sum = 0.0;
                    for a in &clusters[i] {
                        for b in &clusters[j] {
                            sum += p_distance(&points[*a], &points[*b], p);
                        }
                    }
                    let mean = sum / (clusters[i].len() * clusters[j].len()) as f64;
                    if mean < best {
                        (best, pair) = (mean, (i, j));
                    }
                }
            }
            let taken = clusters.swap_remove(pair.1);
            clusters[pair.0].extend(taken);
            heights.push(best);
        }
        heights
    }

    fn tree(points: &[[f64; 3]]) -> Dendrogram {
        match Dendrogram::new(points, -2.0, "part") {
            Ok(tree) => tree,
            Err(error) => panic!("{error}"),
        }
    }

    #[test]
    fn heights_are_those_of_the_definition() {
        let points = points(30);
        let (tree, expected) = (tree(&points), brute_force(&points, -2.0));
        assert_eq!(tree.merges().len(), 29);
        for (merge, height) in tree.merges().iter().zip(expected) {
            assert!((merge.height - height).abs() < 1e-12, "{merge:?} {height}");
        }
    }

    #[test]
    fn cuts_and_join_heights_tell_the_same_story() {
        let points = points(40);
        let tree = tree(&points);
        let pairs: Vec<(usize, usize)> =
            (0..40).flat_map(|i| (0..40).map(move |j| (i, j))).collect();
        let joins = tree.join_heights(&pairs);
        let mut checked = 0;
        for merge in tree.merges().iter().step_by(5) {
            let labels = tree.cut(merge.height);
            let distinct = labels.iter().max().map_or(0, |m| m + 1);
            assert_eq!(distinct, tree.count_at(merge.height));
            assert_eq!(tree.next_merge(merge.height), Some(merge.height));
            for ((i, j), join) in pairs.iter().zip(&joins) {
                assert_eq!(labels[*i] == labels[*j], *join < merge.height || i == j);
                checked += 1;
            }
        }
        assert!(checked > 10_000);
        assert_eq!(tree.cut(f64::INFINITY), vec![0; 40]);
        assert_eq!(tree.cut(0.0), (0..40).collect::<Vec<_>>());
    }

    #[test]
    fn none_and_one_point_are_no_special_trouble() {
        assert!(tree(&[]).cut(1.0).is_empty());
        assert_eq!(tree(&[[0.0; 3]]).cut(1.0), [0]);
        assert_eq!(tree(&[[0.0; 3]]).next_merge(0.0), None);
    }

    #[test]
    fn too_many_points_are_refused_before_memory_is() {
        let many = vec![[0.0; 3]; MAX_POINTS + 1];
        assert!(matches!(
            Dendrogram::new(&many, -2.0, "nut"),
            Err(TaskError::TooManyPoses { poses: 20_001, .. })
        ));
    }
}
