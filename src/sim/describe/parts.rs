//! Parts: the independent pieces in which a node advances, on several threads and in several processes.

use super::io::{Inputs, Outputs, Scratch, StepCx};
use crate::sim::real::{Real, Span};

/// A node that advances in independent parts, such as the ensembles of a population.
///
/// The engine hands out the parts among the threads of a run ([`Threads`](crate::sim::Threads)) and the processes of a graph
/// ([`Ranks`](crate::sim::Ranks)). It owns their states, as it owns those of other nodes. The results have the same bits,
/// whoever computes a part.
///
/// A node with parts keeps no other state. It is told apart by [`Node::parts`](crate::sim::Node::parts); the engine then
/// calls the methods below in place of [`Node::advance`](crate::sim::Node::advance) and [`Node::event`](crate::sim::Node::event).
/// [`Node::init`](crate::sim::Node::init) writes the states of all parts, one after another.
pub trait Parts: Send + Sync {
    /// Returns the number of parts, at least 1.
    fn count(&self) -> usize;

    /// Returns the sizes of a part. They must not change.
    fn part(&self, part: usize) -> PartSpec;

    /// Advances a part by one tick: updates its state and writes what [`collect`](Parts::collect) needs. Must neither
    /// allocate, lock nor log.
    fn advance(&self, cx: &StepCx<'_>, part: usize, io: &mut PartIo<'_>);

    /// Writes the results of a part, as `advance` left them, to the node's registered outputs.
    fn collect(&self, part: usize, results: &[Real], outputs: &mut Outputs<'_>);

    /// Returns whether unit number `unit` of this part had an event in the tick that produced this state.
    fn event(&self, part: usize, state: &[Real], unit: usize) -> bool {
        let _ = (part, state, unit);
        false
    }

    /// Advances several parts. Do not override this method.
    ///
    /// The loop stands here, and not around a call of [`advance`](Parts::advance), because a neuron's numbers stream through
    /// the caches: between two calls of the engine the node itself would leave them.
    fn advance_all(&self, cx: &StepCx<'_>, batch: Batch<'_>) {
        let Batch { items, inputs, state, results, mut scratch } = batch;
        for item in items {
            let (results, events) =
                results[item.results.of()].split_at_mut(item.own_results as usize);
            let state = &mut state[item.state.of()];
            let scratch = scratch.reborrow();
            let part = item.part as usize;
            let cx = &StepCx { part: Some(item.part), ..*cx };
            self.advance(cx, part, &mut PartIo { inputs, state: &mut *state, results, scratch });
            if !events.is_empty() {
                self.events(part, state, item.units as usize, events);
            }
        }
    }

    /// Writes the events of the first `units` units of this part as bits, 32 in a word.
    fn events(&self, part: usize, state: &[Real], units: usize, words: &mut [Real]) {
        for (word, bits) in words.iter_mut().enumerate() {
            let of_word = 32 * word..units.min(32 * (word + 1));
            let bit = |unit: usize| u32::from(self.event(part, state, unit)) << (unit % 32);
            *bits = Real::from_bits(of_word.map(bit).fold(0, |bits, bit| bits | bit));
        }
    }
}

/// The sizes of a part, and the process that computes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PartSpec {
    /// Number of values of its state.
    pub state: usize,
    /// Number of values of its results in one tick.
    pub results: usize,
    /// Number of units that have events.
    pub units: usize,
    /// Work of one tick. A spiking neuron of one dimension counts as 1.
    pub work: usize,
    /// Process that computes the part, modulo their number.
    pub rank: usize,
}

/// The inputs, state, results and scratch memory of a part.
#[derive(Debug)]
pub struct PartIo<'a> {
    /// All inputs of the node, with their values of this tick.
    pub inputs: Inputs<'a>,
    /// State of the part, to be updated for the next tick.
    pub state: &'a mut [Real],
    /// Results of the part.
    pub results: &'a mut [Real],
    /// Scratch memory, as the node declares it.
    pub scratch: Scratch<'a>,
}

/// Parts of one node that a thread advances, and the memory for them. Only the engine makes one.
#[derive(Debug)]
pub struct Batch<'a> {
    pub(crate) items: &'a [Item],
    pub(crate) inputs: Inputs<'a>,
    pub(crate) state: &'a mut [Real],
    pub(crate) results: &'a mut [Real],
    pub(crate) scratch: Scratch<'a>,
}

/// The place of a part in the memory of a thread.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Item {
    /// Index of the part in its node.
    pub part: u32,
    /// Range in the state.
    pub state: Span,
    /// Range in the results, with the words for events.
    pub results: Span,
    pub own_results: u32,
    pub units: u32,
}
