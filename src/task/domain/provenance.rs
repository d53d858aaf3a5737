//! Provenance of a learned domain: program version, settings and data.

use serde::{Deserialize, Serialize};

/// How the poses of one kind were divided into clusters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KindClusters {
    /// Kind of object.
    pub kind: String,
    /// Clustering threshold used, in metres; `None` if no attempt moved an object of this kind to another state. All
    /// poses then form one cluster.
    pub threshold_m: Option<f64>,
    /// Linkage of the lowest merge at or above the threshold, in metres; `None` if there is no such merge.
    pub next_merge_m: Option<f64>,
}

/// How a learned domain was made: program version, settings and amount of data.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Provenance {
    /// Version of symbolt.
    pub symbolt: String,
    /// Seed from the settings. Learning itself uses no random numbers.
    pub seed: u64,
    /// Exponent of the p-norm distance.
    pub p: f64,
    /// Clustering threshold from the settings, in metres; `None` if the learner found it from the data.
    pub threshold_m: Option<f64>,
    /// Number of demonstrations in the recording.
    pub demonstrations: usize,
    /// Number of snapshots in the recording.
    pub snapshots: usize,
    /// Clustering of each kind of object that moved.
    pub clusters: Vec<KindClusters>,
}
