//! What made a learned domain: program, settings, data.

use serde::{Deserialize, Serialize};

/// How the clusters of one kind were cut.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KindClusters {
    /// The kind.
    pub kind: String,
    /// The threshold used, in metres; `null` if there was nothing to tell apart.
    pub threshold_m: Option<f64>,
    /// The height of the first merge that was not made, in metres.
    pub next_merge_m: Option<f64>,
}

/// What made a learned domain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Provenance {
    /// The program's version.
    pub symbolt: String,
    /// The seed given; learning itself draws nothing.
    pub seed: u64,
    /// The exponent of the distance.
    pub p: f64,
    /// The threshold given, in metres; `null` if it was found from the data.
    pub threshold_m: Option<f64>,
    /// How many demonstrations were read.
    pub demonstrations: usize,
    /// How many snapshots were read.
    pub snapshots: usize,
    /// The clusters of each kind that moved.
    pub clusters: Vec<KindClusters>,
}
