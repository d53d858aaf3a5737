//! Clusters of rests of one kind, each in the frame in which its poses are most likely.
//!
//! Starting from single rests, the two clusters whose union raises the posterior most are merged until no union raises
//! it. The posterior is the marginal likelihood in the best frame, times a Chinese-restaurant prior. What was found and
//! what was put somewhere is evidence: each cluster has its own unknown share of found objects. What was found and never
//! taken says nothing of it. It also shows where to start: objects that were found and taken are merged first, and so are
//! those that were put. All are also merged at once, and the likelier result is taken. Single rests move to other clusters while this raises the posterior. Rigid motions keep volumes, so densities in different frames can be compared. Cost: the square of the number of rests, times the number
//! of frames. Of more than [`MOST`] rests, an even sample is clustered, and the others join the clusters in which they
//! are most likely.

use statrs::function::gamma::ln_gamma;

use super::likelihood::{Likelihood, Sums};

/// A rest to be clustered.
#[derive(Debug, Clone)]
pub(super) struct Item {
    /// Sums in each frame; `None` where the frame has no reference for the rest or was refused.
    pub frames: Vec<Option<Sums>>,
}

/// Log prior of a frame: among equals, an object belongs to a reference that is near.
#[derive(Debug, Clone, Copy)]
pub(super) struct FramePrior {
    /// At distance 0.
    pub base: f64,
    /// Loss for each doubling of the distance, measured from [`near`] below 0, in units of ln 2.
    pub slope: f64,
    /// Loss if another object that moves is always nearer.
    pub crowd: f64,
    /// Gain, less the share of objects that were found and taken.
    pub put: f64,
}

/// Distance at which the prior begins to fall, in metres, in scenes up to one metre wide. In a wider one things are larger.
const NEAR_M: f64 = 0.02;

/// Returns the distance at which the prior begins to fall in a scene of this size, in metres.
pub(super) fn near(extent: [f64; 3]) -> f64 {
    NEAR_M * extent.into_iter().fold(1.0, f64::max)
}

impl FramePrior {
    fn of(&self, n: usize, sums: &Sums, near_m: f64) -> f64 {
        let n = n as f64;
        let put = self.put * (1.0 - sums.found / n);
        self.base + put
            - self.slope * (sums.far / (n * near_m)).ln_1p()
            - self.crowd * sums.crowded / n
    }
}

/// A problem: the rests of one kind.
pub(super) struct Clustering<'a> {
    pub items: &'a [Item],
    /// Prior of each frame.
    pub priors: &'a [FramePrior],
    /// Size of the scene, in each frame.
    pub extents: &'a [[f64; 3]],
    /// Distance at which the prior of a frame begins to fall, in metres.
    pub near_m: f64,
    /// Attempts, as pairs of items before and after.
    pub attempts: &'a [(usize, usize)],
    pub likelihood: &'a Likelihood,
}

#[derive(Debug, Clone)]
pub(super) struct Cluster {
    pub members: Vec<usize>,
    pub frames: Vec<Option<Sums>>,
    /// Posterior in the best frame.
    pub score: f64,
    pub frame: usize,
}

/// Greatest number of rests that are compared pair by pair.
pub(super) const MOST: usize = 600;
/// Log concentration of the Chinese-restaurant prior. A lower one makes fewer clusters of chance coincidences.
const CONCENTRATION: f64 = -1.0;
/// Log probability that an attempt leaves its object in the same cluster; for kinds of which attempts only turn objects,
/// the second.
const SAME: (f64, f64) = (4.0, 40.0);
/// Greatest number of rests of which single ones move to other clusters, and how often each is tried.
const MOVED: usize = 120;
const SWEEPS: usize = 3;
impl Clustering<'_> {
    /// Returns the posterior of a cluster with these sums in each frame, without the prior of the partition.
    pub fn scores(&self, n: usize, frames: &[Option<Sums>]) -> Vec<f64> {
        (0..frames.len())
            .map(|f| match &frames[f] {
                Some(sums) => self.score_in(f, n, sums),
                None => f64::NEG_INFINITY,
            })
            .collect()
    }

    fn score_in(&self, frame: usize, n: usize, sums: &Sums) -> f64 {
        self.likelihood.poses(n, sums, &self.extents[frame]) + self.prior(frame, n, sums)
    }

    fn prior(&self, frame: usize, n: usize, sums: &Sums) -> f64 {
        self.priors[frame].of(n, sums, self.near_m)
    }

    /// Returns the best frame and the posterior of a cluster with these sums.
    pub fn score(&self, n: usize, frames: &[Option<Sums>]) -> (usize, f64) {
        let (mut best, mut found, mut put) = ((0, f64::NEG_INFINITY), 0.0, 0.0);
        // The prior tells frames apart. It is no cost of a cluster.
        let mut likeliest = f64::NEG_INFINITY;
        for (f, sums) in frames.iter().enumerate() {
            let Some(sums) = sums else { continue };
            likeliest = likeliest.max(self.prior(f, n, sums));
            let score = self.score_in(f, n, sums);
            (found, put) = (sums.found, sums.put);
            if score > best.1 + 1e-9 {
                best = (f, score);
            }
        }
        let n = n as f64;
        // A uniform prior of the share of found objects integrates out.
        let origins = ln_gamma(found + 1.0) + ln_gamma(put + 1.0) - ln_gamma(found + put + 2.0);
        (best.0, best.1 - likeliest + origins + ln_gamma(n) + CONCENTRATION)
    }

    /// Returns the best frame of a cluster of `n` items, and the posterior in each frame.
    ///
    /// Noise does not decide between frames, but orientation does: what is turned in every way beside a part that is turned
    /// in every way, and in one way beside another, belongs to the other. `turns` says whether it counts.
    pub fn frame(&self, n: usize, frames: &[Option<Sums>], turns: bool) -> (usize, Vec<f64>) {
        let mut turned = self.likelihood.clone();
        turned.turns |= turns;
        let clustering = Clustering { likelihood: &turned, ..*self };
        let quiet = frames.iter().map(|f| f.as_ref().map(|sums| sums.without_noise(n)));
        let quiet: Vec<Option<Sums>> = quiet.collect();
        (clustering.score(n, &quiet).0, clustering.scores(n, &quiet))
    }

    /// Returns the sums of some items in each frame.
    pub fn sums(&self, members: &[usize]) -> Vec<Option<Sums>> {
        let sums = members.iter().map(|i| self.items[*i].frames.clone());
        sums.reduce(|a, b| Self::union(&a, &b)).unwrap_or_default()
    }

    fn union(a: &[Option<Sums>], b: &[Option<Sums>]) -> Vec<Option<Sums>> {
        a.iter().zip(b).map(|(a, b)| Some(a.as_ref()?.add(b.as_ref()?))).collect()
    }

    /// Returns the clusters, in the order of their first members.
    pub fn run(&self) -> Vec<Cluster> {
        let n = self.items.len();
        let step = n.div_ceil(MOST).max(1);
        let sample: Vec<usize> = (0..n).step_by(step).collect();
        let mut clusters = self.merge(&sample);
        if step > 1 {
            let mut most = MOST.max(2 * clusters.len());
            for i in (0..n).filter(|i| i % step != 0) {
                self.join(&mut clusters, i);
                // Comparing clusters pair by pair takes the square of their number in memory.
                if clusters.len() > most {
                    clusters = self.agglomerate(clusters);
                    most = MOST.max(2 * clusters.len());
                }
            }
            clusters = self.agglomerate(clusters);
        }
        clusters.iter_mut().for_each(|c| c.members.sort_unstable());
        clusters.sort_by_key(|c| c.members[0]);
        clusters
    }

    fn single(&self, item: usize) -> Cluster {
        let frames = self.items[item].frames.clone();
        let (frame, score) = self.score(1, &frames);
        Cluster { members: vec![item], frames, score, frame }
    }

    fn merge(&self, sample: &[usize]) -> Vec<Cluster> {
        let singles = sample.iter().map(|i| self.single(*i));
        let is = |c: &Cluster, of: fn(&Sums) -> f64| c.frames.iter().flatten().any(|s| of(s) > 0.0);
        let (found, others): (Vec<Cluster>, Vec<Cluster>) =
            singles.partition(|c| is(c, |sums| sums.found));
        let (put, left): (Vec<Cluster>, Vec<Cluster>) =
            others.into_iter().partition(|c| is(c, |sums| sums.put));
        let at_once = self.agglomerate([&found[..], &put[..], &left[..]].concat());
        let parts = [self.agglomerate(found), self.agglomerate(put), left].concat();
        [at_once, self.agglomerate(parts)]
            .map(|clusters| self.moved(clusters))
            .into_iter()
            .max_by(|a, b| self.total(a).total_cmp(&self.total(b)))
            .unwrap_or_default()
    }

    /// Returns the posterior of a partition.
    fn total(&self, clusters: &[Cluster]) -> f64 {
        let scores: f64 = clusters.iter().map(|c| c.score).sum();
        let within = |(a, b): &(usize, usize)| {
            clusters.iter().any(|c| c.members.contains(a) && c.members.contains(b))
        };
        let within = self.attempts.iter().filter(|ends| within(ends)).count();
        scores - self.same() * within as f64
    }

    /// Returns the loss of posterior by an attempt that leaves its object in the same cluster.
    fn same(&self) -> f64 {
        if self.likelihood.turns { SAME.1 } else { SAME.0 }
    }

    /// Moves single items to other clusters while this raises the posterior.
    fn moved(&self, mut clusters: Vec<Cluster>) -> Vec<Cluster> {
        let few = self.items.len() <= MOVED;
        for item in (0..SWEEPS).flat_map(|_| 0..self.items.len()).filter(|_| few) {
            let holds = |c: &Cluster| c.members.contains(&item);
            let Some(from) = clusters.iter().position(holds) else { continue };
            let (old, single) = (&clusters[from], self.single(item));
            let others: Vec<usize> =
                old.members.iter().copied().filter(|other| *other != item).collect();
            let frames = self.sums(&others);
            let (frame, score) = match others.len() {
                0 => (0, 0.0),
                n => self.score(n, &frames),
            };
            let rest = Cluster { members: others, frames, score, frame };
            let gain = |with: &Cluster, without: &Cluster| {
                let ends = self.attempts.iter().filter(|(a, b)| {
                    *a == item && without.members.contains(b)
                        || *b == item && without.members.contains(a)
                });
                with.score - without.score - self.same() * ends.count() as f64
            };
            let stays = gain(old, &rest) + 1e-6;
            let moves = (0..clusters.len()).filter(|to| *to != from).map(|to| {
                let with = self.together(&clusters[to], &single);
                (gain(&with, &clusters[to]), to, with)
            });
            let best = moves.max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
            if let Some((_, to, with)) = best.filter(|(gain, ..)| *gain > stays) {
                (clusters[to], clusters[from]) = (with, rest);
                clusters.retain(|c| !c.members.is_empty());
            }
        }
        clusters
    }

    /// Adds an item to the cluster whose posterior it raises most, or makes a cluster of it.
    fn join(&self, clusters: &mut Vec<Cluster>, item: usize) {
        let single = self.single(item);
        let gain = |c: &Cluster| {
            let frames = Self::union(&c.frames, &single.frames);
            let (_, score) = self.score(c.members.len() + 1, &frames);
            score - c.score - single.score
        };
        let best = clusters
            .iter()
            .enumerate()
            .map(|(i, c)| (i, gain(c)))
            .max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
        match best {
            Some((i, gain)) if gain > 0.0 => {
                let cluster = &mut clusters[i];
                cluster.members.push(item);
                cluster.frames = Self::union(&cluster.frames, &single.frames);
                (cluster.frame, cluster.score) = self.score(cluster.members.len(), &cluster.frames);
            }
            _ => clusters.push(single),
        }
    }

    fn together(&self, a: &Cluster, b: &Cluster) -> Cluster {
        let members: Vec<usize> = a.members.iter().chain(&b.members).copied().collect();
        let frames = Self::union(&a.frames, &b.frames);
        let (frame, score) = self.score(members.len(), &frames);
        Cluster { members, frames, score, frame }
    }

    /// Merges clusters until no union raises the posterior.
    fn agglomerate(&self, mut clusters: Vec<Cluster>) -> Vec<Cluster> {
        let n = clusters.len();
        let mut owner = vec![usize::MAX; self.items.len()];
        for (c, cluster) in clusters.iter().enumerate() {
            cluster.members.iter().for_each(|i| owner[*i] = c);
        }
        let mut between = vec![0.0f32; n * n];
        for (a, b) in self.attempts {
            let (a, b) = (owner[*a], owner[*b]);
            if a < n && b < n && a != b {
                between[a * n + b] += 1.0;
                between[b * n + a] += 1.0;
            }
        }
        let gain = |clusters: &[Cluster], between: &[f32], a: usize, b: usize| {
            let (x, y) = (&clusters[a], &clusters[b]);
            let frames = Self::union(&x.frames, &y.frames);
            let (_, score) = self.score(x.members.len() + y.members.len(), &frames);
            score - x.score - y.score - self.same() * f64::from(between[a * n + b])
        };
        let mut alive: Vec<bool> = vec![true; n];
        // The best partner of each cluster among the later ones.
        let mut best: Vec<(f64, usize)> = vec![(f64::NEG_INFINITY, 0); n];
        let mut gains = vec![f64::NEG_INFINITY; n * n];
        for a in 0..n {
            for b in a + 1..n {
                let g = gain(&clusters, &between, a, b);
                gains[a * n + b] = g;
                if g > best[a].0 {
                    best[a] = (g, b);
                }
            }
        }
        loop {
            let chosen = (0..n)
                .filter(|a| alive[*a])
                .max_by(|a, b| best[*a].0.total_cmp(&best[*b].0).then(b.cmp(a)));
            let Some(a) = chosen.filter(|a| best[*a].0 > 0.0) else { break };
            let b = best[a].1;
            clusters[a] = self.together(&clusters[a], &clusters[b]);
            alive[b] = false;
            for c in 0..n {
                let sum = between[a * n + c] + between[b * n + c];
                between[a * n + c] = sum;
                between[c * n + a] = sum;
            }
            for c in (0..n).filter(|c| alive[*c] && *c != a) {
                let (low, high) = (a.min(c), a.max(c));
                gains[low * n + high] = gain(&clusters, &between, low, high);
            }
            for c in (0..n).filter(|c| alive[*c]) {
                let stale = c == a || best[c].1 == a || best[c].1 == b;
                let fresh = if c < a { gains[c * n + a] } else { f64::NEG_INFINITY };
                if stale {
                    best[c] = (c + 1..n)
                        .filter(|d| alive[*d])
                        .map(|d| (gains[c * n + d], d))
                        .fold((f64::NEG_INFINITY, 0), |x, y| if y.0 > x.0 { y } else { x });
                } else if fresh > best[c].0 {
                    best[c] = (fresh, a);
                }
            }
        }
        let mut kept = Vec::new();
        for (cluster, alive) in clusters.into_iter().zip(alive) {
            if alive {
                kept.push(cluster);
            }
        }
        kept
    }
}
