//! What is found in logs of messages and arrays, as the mapping that takes the same; and what is wrong with one.

use crate::logs::{DatasetMap, TopicMap};
use crate::task::import::mapping::Mapping;

/// What was found in logs without a mapping, to be written into one.
#[derive(Debug, Default)]
pub(in crate::task::import) struct Found {
    pub topics: Vec<TopicMap>,
    pub datasets: Vec<DatasetMap>,
    /// The frames of reference, one if all files have the same.
    pub references: Vec<String>,
}

impl Found {
    /// Writes what was found into the mapping that found it.
    pub fn write(self, mapping: &mut Mapping) {
        if mapping.topics.is_empty() {
            mapping.topics = self.topics;
        }
        if mapping.datasets.is_empty() {
            mapping.datasets = self.datasets;
        }
        if let ([reference], None) = (&*self.references, &mapping.reference) {
            mapping.reference = Some(reference.clone());
        }
    }
}

impl Mapping {
    /// Returns what is wrong with the parts about logs: the field, the problem and what was expected.
    pub(in crate::task::import) fn fault_of_logs(&self) -> Option<(String, String, &'static str)> {
        for (index, topic) in self.topics.iter().enumerate() {
            if topic.topic.is_empty() {
                let expected = "the name of a topic, or a pattern such as /objects/*";
                return Some((format!("topics[{index}].topic"), "it is empty".into(), expected));
            }
        }
        if let Some(rate) = self.rate_hz
            && !(rate > 0.0 && rate.is_finite())
        {
            return Some(("rate_hz".into(), format!("it is {rate}"), "more than 0 Hz"));
        }
        None
    }
}
