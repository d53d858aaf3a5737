//! What the ranks of a run tell one another: results in every tick, faults, and states for checkpoints.

use super::error::SimError;
use super::fingerprint::Fingerprint;
use super::graph::Graph;
use super::layout::HEADER;
use super::node::Real;
use super::ranks::{ExchangeFault, Lengths, Ranks};
use super::simulator::Simulator;

/// What a rank does when it speaks: the first word of all that it sends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Word {
    Tick = 1,
    Save = 2,
    Restore = 3,
    Fault = 4,
}

/// Ticks in which every value is compared between ranks once.
const ROUND: u64 = 64;

/// The exchange of a simulator with the other ranks.
pub(super) struct Talk {
    ranks: Ranks,
    /// What each rank sends in a tick.
    results: Lengths,
    states: Lengths,
    own: Vec<Real>,
}

impl Talk {
    pub fn new(graph: &Graph, ranks: &Ranks) -> Result<Self, SimError> {
        let (mut results, mut states) = (vec![HEADER; ranks.ranks()], vec![0; ranks.ranks()]);
        for part in &graph.parts {
            let rank = part.rank as usize;
            if rank >= ranks.ranks() {
                let reason = format!("has a part but there are {} ranks", ranks.ranks());
                return Err(SimError::Rank { rank, reason });
            }
            results[rank] += part.results.len();
            states[rank] += part.state.len();
        }
        let lengths = |counts: Vec<usize>| {
            let values = counts.iter().sum();
            Lengths::new(counts).ok_or(SimError::TooMuchToExchange { values })
        };
        let (results, states) = (lengths(results)?, lengths(states)?);
        let own = vec![0.0; results.of(ranks.rank()).len()];
        Ok(Self { ranks: ranks.clone(), results, states, own })
    }

    /// Sends this rank's results and receives those of the others.
    fn exchange(
        &mut self,
        header: [u32; HEADER],
        results: &mut [Real],
    ) -> Result<(), ExchangeFault> {
        let own = self.results.of(self.ranks.rank());
        self.own.copy_from_slice(&results[own]);
        write(header, &mut self.own);
        self.ranks.all_gather(&self.own, &self.results, results)?;
        self.check(header, results)
    }

    /// Sends a header without results, in place of those of a tick. Returns what all ranks sent.
    fn send(&self, header: [u32; HEADER]) -> Result<Vec<Real>, ExchangeFault> {
        let (mut own, mut all) = (vec![0.0; self.own.len()], vec![0.0; self.results.total()]);
        write(header, &mut own);
        self.ranks.all_gather(&own, &self.results, &mut all)?;
        Ok(all)
    }

    /// Checks that all ranks sent this header.
    fn check(&self, header: [u32; HEADER], all: &[Real]) -> Result<(), ExchangeFault> {
        let theirs = |rank: usize| -> [u32; HEADER] {
            let theirs = &all[self.results.of(rank)];
            std::array::from_fn(|word| theirs[word].to_bits())
        };
        let ranks = 0..self.ranks.ranks();
        if let Some(rank) = ranks.clone().find(|rank| theirs(*rank)[0] == Word::Fault as u32) {
            let reason = self.ranks.reasons("")?.swap_remove(rank);
            return Err(ExchangeFault { rank, reason: format!("stopped: {reason}") });
        }
        let Some(rank) = ranks.into_iter().find(|rank| theirs(*rank) != header) else {
            return Ok(());
        };
        let [word, tick, graph, values] = header;
        let does = match theirs(rank) {
            [_, _, other, _] if other != graph => "runs another graph than this one".into(),
            [other, _, _, different] if other == word && different != values => {
                match word == Word::Restore as u32 {
                    true => "restores another checkpoint than this one".into(),
                    false => format!("has other values than this one in tick {tick}"),
                }
            }
            _ => format!("does not do what this one does in tick {tick}"),
        };
        let reason = format!(
            "{does}; all ranks must run one graph in the same way, on one kind of processor"
        );
        Err(ExchangeFault { rank, reason })
    }
}

fn write(header: [u32; HEADER], to: &mut [Real]) {
    for (word, value) in to.iter_mut().zip(header) {
        *word = Real::from_bits(value);
    }
}

fn rank_error(fault: ExchangeFault) -> SimError {
    SimError::Rank { rank: fault.rank, reason: fault.reason }
}

impl Simulator {
    fn header(&self, word: Word, values: u64) -> [u32; HEADER] {
        [word as u32, self.tick as u32, self.graph.fingerprint as u32, values as u32]
    }

    /// Exchanges the results of this tick, if the graph runs on several ranks.
    pub(super) fn exchange(&mut self) -> Result<(), SimError> {
        if self.talk.is_none() {
            return Ok(());
        }
        let header = self.header(Word::Tick, self.sample_of_values());
        let Some(talk) = &mut self.talk else { return Ok(()) };
        talk.exchange(header, &mut self.arenas.results).map_err(rank_error)
    }

    /// Returns a hash of some of the values that every rank computes: of all of them in [`ROUND`] ticks.
    fn sample_of_values(&self) -> u64 {
        let values = &self.arenas.held;
        let len = values.len().div_ceil(ROUND as usize);
        let start = (len * (self.tick % ROUND) as usize).min(values.len());
        let sample = &values[start..(start + len).min(values.len())];
        Fingerprint::default().reals(sample).value()
    }

    /// Checks that all ranks restore a checkpoint with the same hash.
    pub(super) fn check_restored(&self, hash: impl FnOnce() -> u64) -> Result<(), SimError> {
        let Some(talk) = &self.talk else { return Ok(()) };
        let [word, _, graph, values] = self.header(Word::Restore, hash());
        // Ranks may come from different ticks.
        let header = [word, 0, graph, values];
        talk.send(header).and_then(|all| talk.check(header, &all)).map_err(rank_error)
    }

    /// Tells the other ranks of an error, unless they know it already. They then stop in the same tick.
    pub(super) fn tell(&self, error: &SimError) {
        if matches!(error, SimError::Rank { .. }) {
            return;
        }
        let header = self.header(Word::Fault, 0);
        let Some(talk) = &self.talk else { return };
        // An error here means that the others have stopped for another reason.
        if talk.send(header).is_ok() {
            let _ = talk.ranks.reasons(&error.to_string());
        }
    }

    /// Returns the states of all parts.
    pub(super) fn states_of_parts(&self) -> Result<Vec<Real>, SimError> {
        let graph = &self.graph;
        let mut all = vec![0.0; graph.sizes.parts];
        let Some(talk) = &self.talk else {
            for (index, part) in graph.parts.iter().enumerate() {
                let into = &mut all[part.state.of()];
                self.team.with_state(index, |state| into.copy_from_slice(state));
            }
            return Ok(all);
        };
        let header = self.header(Word::Save, 0);
        talk.send(header).and_then(|all| talk.check(header, &all)).map_err(rank_error)?;
        let mut own = Vec::with_capacity(talk.states.of(talk.ranks.rank()).len());
        for index in 0..graph.parts.len() {
            self.team.with_state(index, |state| own.extend_from_slice(state));
        }
        let mut by_rank = vec![0.0; talk.states.total()];
        talk.ranks.all_gather(&own, &talk.states, &mut by_rank).map_err(rank_error)?;
        let mut from: Vec<usize> =
            (0..talk.ranks.ranks()).map(|rank| talk.states.of(rank).start).collect();
        for part in &graph.parts {
            let from = &mut from[part.rank as usize];
            let len = part.state.len();
            all[part.state.of()].copy_from_slice(&by_rank[*from..*from + len]);
            *from += len;
        }
        Ok(all)
    }
}
