//! Agglomerative clustering with average linkage, and flat cuts of the dendrogram.
//!
//! The `kodama` crate computes the dendrogram with the nearest-neighbour chain algorithm in O(n^2) time. As in the tool
//! that the paper uses, a flat cut merges only clusters whose linkage is below the threshold.

use crate::task::domain::distance::distance_matrix;
use crate::task::error::TaskError;

/// Maximum number of points that can be clustered. The distances of this many points take 1.6 GB.
pub const MAX_POINTS: usize = 20_000;

/// One merge of two clusters in a [`Dendrogram`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Merge {
    /// First cluster. With `n` points, a number `i < n` is point `i`; a number `n + m` is the result of merge `m`.
    pub first: usize,
    /// Second cluster, numbered in the same way.
    pub second: usize,
    /// Linkage of the two clusters: the mean distance over all pairs of a point of the first and a point of the second,
    /// in the unit of the points.
    pub height: f64,
}

/// The complete hierarchy of merges of a set of points, in order of increasing height.
#[derive(Debug, Clone, PartialEq)]
pub struct Dendrogram {
    points: usize,
    merges: Vec<Merge>,
}

impl Dendrogram {
    /// Clusters `points` by p-norm distance with exponent `p` and average linkage. Takes O(n^2) time and memory.
    ///
    /// # Errors
    /// [`TaskError::TooManyPoses`] for more than [`MAX_POINTS`] points. `kind` names the points in the error.
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

    /// Returns all merges, in order of increasing height.
    pub fn merges(&self) -> &[Merge] {
        &self.merges
    }

    /// Returns the number of clusters after a cut at `threshold`, which makes only the merges below it.
    pub fn count_at(&self, threshold: f64) -> usize {
        self.points - self.merges.partition_point(|m| m.height < threshold)
    }

    /// Returns the height of the lowest merge at or above `threshold`, the first that a cut there does not make. `None`
    /// if the cut makes all merges.
    pub fn next_merge(&self, threshold: f64) -> Option<f64> {
        self.merges.get(self.merges.partition_point(|m| m.height < threshold)).map(|m| m.height)
    }

    /// Returns the height of the highest merge below `threshold`, the last that a cut there makes. `None` if the cut
    /// makes no merge.
    pub fn last_merge(&self, threshold: f64) -> Option<f64> {
        let made = self.merges.partition_point(|m| m.height < threshold);
        made.checked_sub(1).map(|i| self.merges[i].height)
    }

    /// Returns the cluster of each point after a cut at `threshold`, which makes only the merges below it. Clusters are
    /// numbered from 0 in order of first appearance.
    pub fn cut(&self, threshold: f64) -> Vec<usize> {
        let made = self.merges.partition_point(|m| m.height < threshold);
        let mut parent: Vec<usize> = (0..self.points + made).collect();
        for (index, merge) in self.merges[..made].iter().enumerate() {
            parent[merge.first] = self.points + index;
            parent[merge.second] = self.points + index;
        }
        // The parent of a merge is always a later merge, so a backward pass finds each root before it is needed.
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

    /// Returns the cophenetic distance of each pair of points: the height of the merge that first joins them in one
    /// cluster, or 0 if both are the same point. Takes at most O(n) time per pair.
    ///
    /// # Panics
    /// If a pair has an index that is not below the number of points.
    pub fn join_heights(&self, pairs: &[(usize, usize)]) -> Vec<f64> {
        let mut parent = vec![usize::MAX; self.points + self.merges.len()];
        for (index, merge) in self.merges.iter().enumerate() {
            parent[merge.first] = self.points + index;
            parent[merge.second] = self.points + index;
        }
        let join = |a: usize, b: usize| {
            let (mut a, mut b) = (a, b);
            while a != b {
                // Ancestors have higher numbers, so step up from the lower number.
                let lower = if a < b { &mut a } else { &mut b };
                *lower = parent[*lower];
            }
            if a < self.points { 0.0 } else { self.merges[a - self.points].height }
        };
        pairs.iter().map(|(a, b)| join(*a, *b)).collect()
    }
}
