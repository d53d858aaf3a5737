//! Counts the spikes of a planner, and what they reach.

use super::wiring::Reach;
use crate::sim::{EventSource, Graph, Simulator};

/// Spikes of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SpikeCount {
    /// Spikes of all neurons.
    pub spikes: u64,
    /// Synaptic events: each spike counts once for every weight that leads from its unit, through plain sums as well. Plastic
    /// synapses do not count.
    pub synaptic_events: u64,
}

/// The neurons of a graph, with the weights that lead from each unit.
pub(super) struct SpikeCounter {
    groups: Vec<(EventSource, Vec<u32>)>,
    pub count: SpikeCount,
}

impl SpikeCounter {
    pub fn new(graph: &Graph, reach: &Reach) -> Self {
        let of = |path: &str| {
            let inside = path.strip_prefix("planner/")?;
            let group = inside.rsplit_once('/')?.0;
            reach.get(group).or_else(|| reach.get(group.rsplit_once('/')?.0)).cloned()
        };
        let groups = graph.event_sources();
        let groups = groups.map(|(path, source)| (source, of(path).unwrap_or_default())).collect();
        Self { groups, count: SpikeCount::default() }
    }

    /// Counts the spikes of the last tick. Costs O(neurons).
    pub fn look(&mut self, sim: &Simulator) {
        for (source, reach) in &self.groups {
            let of_unit = source.units.checked_div(reach.len()).unwrap_or(1).max(1);
            for neuron in (0..source.units).filter(|neuron| sim.event(*source, *neuron)) {
                let weights = reach.get(neuron / of_unit).copied().unwrap_or(0);
                self.count.spikes += 1;
                self.count.synaptic_events += u64::from(weights);
            }
        }
    }
}
