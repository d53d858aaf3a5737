//! Logs of robots as others write them: bags of messages, arrays, and what may be said of their topics, frames and datasets.

#[cfg(feature = "hdf5")]
pub(crate) mod arrays;
#[cfg(feature = "mcap")]
pub(crate) mod bag;
#[cfg(feature = "mcap")]
mod cdr;
#[cfg(feature = "mcap")]
pub(crate) mod frames;
mod maps;
#[cfg(feature = "mcap")]
pub(crate) mod messages;
mod pattern;
#[cfg(feature = "mcap")]
pub(crate) mod topics;

pub use maps::{DatasetMap, PoseDatasets, Take, TopicMap};
pub(crate) use pattern::captured;
pub use pattern::fits;

/// A fault in a log without lines: the topic or the dataset, what was found, and what was expected.
#[cfg(feature = "mcap")]
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Fault {
    pub field: String,
    pub problem: String,
    pub expected: String,
}

/// Returns an error with its cause, in one line of at most 200 characters.
#[cfg(any(feature = "mcap", feature = "hdf5"))]
pub(crate) fn words(error: &dyn std::error::Error) -> String {
    let own = error.to_string();
    let cause = error.source().map(ToString::to_string).filter(|cause| !own.contains(cause));
    let text = cause.iter().fold(own, |own, cause| format!("{own}: {cause}"));
    text.lines().map(str::trim).collect::<Vec<_>>().join(" ").chars().take(200).collect()
}

/// An orientation that was not seen.
pub(crate) const UNSEEN: [f64; 4] = [f64::NAN; 4];

/// Returns a unit quaternion; one that was not seen if all numbers are zero.
///
/// # Errors
/// What is wrong, in words, if the norm is not about 1.
pub(crate) fn unit(q: [f64; 4]) -> Result<[f64; 4], String> {
    let norm = q.iter().map(|v| v * v).sum::<f64>().sqrt();
    if norm < 1e-6 {
        return Ok(UNSEEN);
    }
    if !(0.9..1.1).contains(&norm) {
        return Err(format!("the quaternion has the norm {norm:.3}"));
    }
    Ok(q.map(|v| v / norm))
}
