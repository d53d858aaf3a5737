//! What the ranks of a run tell one another: results in every tick, faults, and states for checkpoints.

use super::ranks::{ExchangeFault, Lengths, Ranks};
use crate::sim::build::graph::Graph;
use crate::sim::build::layout::HEADER;
use crate::sim::describe::fingerprint::Fingerprint;
use crate::sim::error::SimError;
use crate::sim::real::Real;

/// What a rank does when it speaks: the first number of all that it sends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Message {
    Tick = 1,
    Save = 2,
    Restore = 3,
    Fault = 4,
}

/// Ticks in which every value is compared between ranks once.
const ROUND: u64 = 64;

/// The exchange of a simulator with the other ranks.
pub(crate) struct Messages {
    ranks: Ranks,
    fingerprint: u32,
    /// What each rank sends in a tick.
    results: Lengths,
    states: Lengths,
    own: Vec<Real>,
}

impl Messages {
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
        let fingerprint = graph.fingerprint as u32;
        Ok(Self { ranks: ranks.clone(), fingerprint, results, states, own })
    }

    fn header(&self, word: Message, tick: u64, values: u64) -> [u32; HEADER] {
        [word as u32, tick as u32, self.fingerprint, values as u32]
    }

    /// Sends this rank's results of a tick and receives those of the others. Some of the values that every rank computes
    /// are compared.
    pub fn exchange(
        &mut self,
        tick: u64,
        held: &[Real],
        results: &mut [Real],
    ) -> Result<(), SimError> {
        let header = self.header(Message::Tick, tick, sample(held, tick));
        let own = self.results.of(self.ranks.rank());
        self.own.copy_from_slice(&results[own]);
        write(header, &mut self.own);
        let sent = self.ranks.all_gather(&self.own, &self.results, results);
        sent.and_then(|()| self.check(header, results)).map_err(rank_error)
    }

    /// Checks that all ranks restore a checkpoint with the same hash.
    pub fn check_restored(&self, hash: u64) -> Result<(), SimError> {
        // Ranks may come from different ticks.
        self.agree(self.header(Message::Restore, 0, hash))
    }

    /// Tells the other ranks of an error, unless they know it already. They then stop in the same tick.
    pub fn tell(&self, tick: u64, error: &SimError) {
        if matches!(error, SimError::Rank { .. } | SimError::Interrupted { .. }) {
            return;
        }
        // An error here means that the others have stopped for another reason.
        if self.send(self.header(Message::Fault, tick, 0)).is_ok() {
            let _ = self.ranks.reasons(&error.to_string());
        }
    }

    /// Replaces the states of the parts of all other ranks by those that they send. `all` holds those of this rank.
    pub fn gather_states(
        &self,
        tick: u64,
        graph: &Graph,
        all: &mut [Real],
    ) -> Result<(), SimError> {
        self.agree(self.header(Message::Save, tick, 0))?;
        let rank = self.ranks.rank();
        let own: Vec<Real> = graph
            .parts
            .iter()
            .filter(|part| part.rank as usize == rank)
            .flat_map(|part| &all[part.state.of()])
            .copied()
            .collect();
        let mut by_rank = vec![0.0; self.states.total()];
        self.ranks.all_gather(&own, &self.states, &mut by_rank).map_err(rank_error)?;
        let mut from: Vec<usize> =
            (0..self.ranks.ranks()).map(|rank| self.states.of(rank).start).collect();
        for part in &graph.parts {
            let from = &mut from[part.rank as usize];
            let len = part.state.len();
            all[part.state.of()].copy_from_slice(&by_rank[*from..*from + len]);
            *from += len;
        }
        Ok(())
    }

    /// Sends a header and checks that all ranks sent the same.
    fn agree(&self, header: [u32; HEADER]) -> Result<(), SimError> {
        self.send(header).and_then(|all| self.check(header, &all)).map_err(rank_error)
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
        if let Some(rank) = ranks.clone().find(|rank| theirs(*rank)[0] == Message::Fault as u32) {
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
                match word == Message::Restore as u32 {
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

/// Returns a hash of some of the values: of all of them in [`ROUND`] ticks.
fn sample(values: &[Real], tick: u64) -> u64 {
    let len = values.len().div_ceil(ROUND as usize);
    let start = (len * (tick % ROUND) as usize).min(values.len());
    let sample = &values[start..(start + len).min(values.len())];
    Fingerprint::default().reals(sample).value()
}
