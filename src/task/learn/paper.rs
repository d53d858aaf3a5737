//! The method of the paper: states in the world frame.

use super::observations::Observations;
use super::{Learned, Settings, nothing};
use crate::task::error::TaskError;
use crate::task::event::{Event, LearningStep, Observer};
use crate::task::recording::Recording;

/// Learns from a recording whose settings were checked.
pub(super) fn learn(
    recording: &Recording,
    settings: &Settings,
    observer: &mut dyn Observer,
) -> Result<Learned, TaskError> {
    let mut observed = Observations::observe(recording, settings, observer)?;
    if observed.kinds.is_empty() {
        return Err(nothing(
            "no object moved; expected at least one object to move by 1 mm or more",
        ));
    }
    if observed.attempts.is_empty() {
        return Err(nothing("no object was picked up and released; expected at least one attempt"));
    }
    // The clusters depend on the guesses of manipulated objects, and the guesses depend on the clusters. Repeat until
    // nothing changes. No recording has needed five rounds.
    for _ in 0..5 {
        observed.cluster(settings);
        if !observed.reconsider() {
            break;
        }
    }
    observer.observe(&Event::Learning(LearningStep::Deciding));
    observed.infer(settings)
}
