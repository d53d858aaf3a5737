//! Provenance of a learned domain: program version, settings and data.

use serde::{Deserialize, Serialize};

/// How the poses of one kind were divided into clusters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KindClusters {
    /// Kind of object.
    pub kind: String,
    /// Clustering threshold used, in metres; `None` if no attempt changed the state of such an object, so that
    /// all poses form one cluster.
    pub threshold_m: Option<f64>,
    /// Linkage of the first merge at or above the threshold, in metres; `None` if there is none.
    pub next_merge_m: Option<f64>,
}

/// How a learned domain was made: program version, settings and amount of data.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Provenance {
    /// Version of symbolt.
    pub symbolt: String,
    /// Seed given. Learning itself uses no random numbers.
    pub seed: u64,
    /// Exponent of the p-norm distance.
    pub p: f64,
    /// Clustering threshold given, in metres; `None` if it was found from the data.
    pub threshold_m: Option<f64>,
    /// Number of demonstrations in the recording.
    pub demonstrations: usize,
    /// Number of snapshots in the recording.
    pub snapshots: usize,
    /// Clustering of each kind that moved.
    pub clusters: Vec<KindClusters>,
}
