//! Ranks: the processes that run one graph together.

use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use thiserror::Error;

use crate::sim::real::Real;

/// How the processes of a run exchange values. The feature `mpi` implements it for MPI.
pub trait Exchange: Send {
    /// Sends `own` to all processes and fills `all` with the values of all processes, in the order of their ranks.
    /// Process `r` sends `lengths.counts()[r]` values. Every process calls this method equally often. Must not allocate
    /// after a first call with the same lengths.
    ///
    /// # Errors
    /// An [`ExchangeFault`] if a process has ended or the values cannot be sent.
    fn all_gather(
        &mut self,
        own: &[Real],
        lengths: &Lengths,
        all: &mut [Real],
    ) -> Result<(), ExchangeFault>;
}

/// The error of an exchange.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("rank {rank} {reason}")]
pub struct ExchangeFault {
    /// Process at fault.
    pub rank: usize,
    /// What happened to it.
    pub reason: String,
}

/// The numbers of values that the processes send, with the place of each among all values.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Lengths {
    counts: Vec<i32>,
    starts: Vec<i32>,
    total: usize,
}

impl Lengths {
    /// Adds up `counts`. `None` if the sum exceeds the 32-bit lengths of MPI.
    pub fn new(counts: impl IntoIterator<Item = usize>) -> Option<Self> {
        let mut lengths = Self { counts: Vec::new(), starts: Vec::new(), total: 0 };
        for count in counts {
            lengths.starts.push(i32::try_from(lengths.total).ok()?);
            lengths.counts.push(i32::try_from(count).ok()?);
            lengths.total += count;
        }
        i32::try_from(lengths.total).ok().map(|_| lengths)
    }

    /// Returns the number of values of each process.
    pub fn counts(&self) -> &[i32] {
        &self.counts
    }

    /// Returns the place of each process's first value.
    pub fn starts(&self) -> &[i32] {
        &self.starts
    }

    /// Returns the number of all values.
    pub fn total(&self) -> usize {
        self.total
    }

    /// Returns the range of one process among all values.
    pub fn of(&self, rank: usize) -> std::ops::Range<usize> {
        let start = self.starts[rank] as usize;
        start..start + self.counts[rank] as usize
    }
}

/// The rank of a process among those that run one graph together. Clones are the same rank.
///
/// Give it to the plan with which the graph is built ([`PopulationPlan::shared`](crate::neurons::PopulationPlan::shared)). Each
/// process then solves and advances only its part of the neurons. All other nodes, the world and the probes are computed
/// by every process alike. In each tick the processes exchange the decoded values, so every process can read all
/// values and probes. A run has the same bits for any number of processes.
///
/// All processes must build the same graph and make the same calls in the same order, on one thread each:
/// [`run_until`](crate::sim::Simulator::run_until) with a condition that depends on simulated values alone,
/// [`checkpoint`](crate::sim::Simulator::checkpoint), [`restore`](crate::sim::Simulator::restore).
#[derive(Clone)]
pub struct Ranks {
    rank: usize,
    ranks: usize,
    exchange: Arc<Mutex<Box<dyn Exchange>>>,
    events: bool,
    /// Whether this process knows of the end or the fault of another one.
    told: Arc<AtomicBool>,
}

impl fmt::Debug for Ranks {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Ranks({} of {})", self.rank, self.ranks)
    }
}

impl PartialEq for Ranks {
    fn eq(&self, other: &Self) -> bool {
        self.rank == other.rank && Arc::ptr_eq(&self.exchange, &other.exchange)
    }
}

impl Ranks {
    /// Makes the rank of a process that exchanges values by `exchange`.
    pub fn new(place: Launched, exchange: impl Exchange + 'static) -> Self {
        let Launched { rank, processes: ranks } = place;
        let exchange: Box<dyn Exchange> = Box::new(exchange);
        let (exchange, told) = (Arc::new(Mutex::new(exchange)), Arc::default());
        Self { rank, ranks, exchange, events: false, told }
    }

    /// Sends the spikes of all neurons as well, one bit each, so that [`Simulator::event`](crate::sim::Simulator::event)
    /// knows those of other processes. Recorded spikes are sent in any case.
    pub fn with_events(mut self) -> Self {
        self.events = true;
        self
    }

    /// Creates the ranks of `ranks` processes that are threads of this process, for tests.
    pub fn in_process(ranks: usize) -> Vec<Self> {
        let table = Arc::new(Table {
            round: Mutex::new(Round {
                sent: vec![[Vec::new(), Vec::new()]; ranks],
                ..Round::default()
            }),
            turn: Condvar::new(),
        });
        let places = (0..ranks).map(|rank| Launched { rank, processes: ranks });
        places.map(|place| Self::new(place, Local { place, table: table.clone() })).collect()
    }

    /// Returns the number of this process, counted from 0.
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// Returns the number of processes.
    pub fn ranks(&self) -> usize {
        self.ranks
    }

    /// Returns whether the spikes of all neurons are sent.
    pub(crate) fn sends_events(&self) -> bool {
        self.events
    }

    /// Returns whether this process knows of the end or the fault of another one.
    #[cfg(feature = "mpi")]
    pub(in crate::sim) fn told(&self) -> bool {
        self.told.load(Relaxed)
    }

    /// Exchanges values with the other processes.
    ///
    /// # Errors
    /// As [`Exchange::all_gather`].
    pub(crate) fn all_gather(
        &self,
        own: &[Real],
        lengths: &Lengths,
        all: &mut [Real],
    ) -> Result<(), ExchangeFault> {
        let mut exchange = self.exchange.lock().unwrap_or_else(PoisonError::into_inner);
        exchange.all_gather(own, lengths, all).inspect_err(|_| self.told.store(true, Relaxed))
    }

    /// Tells the reason for a fault, empty without a fault, and returns those of all processes. A reason is cut at 256
    /// bytes.
    ///
    /// # Errors
    /// As [`Exchange::all_gather`].
    pub(crate) fn reasons(&self, own: &str) -> Result<Vec<String>, ExchangeFault> {
        let Some(lengths) = Lengths::new((0..self.ranks).map(|_| REASON)) else {
            return Ok(vec![String::new(); self.ranks]);
        };
        let mut bytes = [0; 4 * REASON];
        let mut end = own.len().min(bytes.len());
        while !own.is_char_boundary(end) {
            end -= 1;
        }
        bytes[..end].copy_from_slice(&own.as_bytes()[..end]);
        let (fours, _) = bytes.as_chunks::<4>();
        let sent: Vec<Real> = fours.iter().map(|four| Real::from_le_bytes(*four)).collect();
        let mut all = vec![0.0; lengths.total()];
        self.all_gather(&sent, &lengths, &mut all)?;
        let text = |values: &[Real]| {
            let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
            let end = bytes.iter().position(|b| *b == 0).unwrap_or(bytes.len());
            String::from_utf8_lossy(&bytes[..end]).into_owned()
        };
        let reasons: Vec<String> = all.chunks_exact(REASON).map(text).collect();
        if reasons.iter().enumerate().any(|(rank, text)| rank != self.rank && !text.is_empty()) {
            self.told.store(true, Relaxed);
        }
        Ok(reasons)
    }

    /// Returns the first process whose number differs from that of this process, if there is one. Processes use it
    /// to find out whether they have built the same.
    ///
    /// # Errors
    /// As [`Exchange::all_gather`].
    pub fn differs(&self, number: u64) -> Result<Option<usize>, ExchangeFault> {
        let halves = [number as u32, (number >> 32) as u32].map(Real::from_bits);
        let Some(lengths) = Lengths::new((0..self.ranks).map(|_| 2)) else { return Ok(None) };
        let mut all = vec![0.0; lengths.total()];
        self.all_gather(&halves, &lengths, &mut all)?;
        let bits = |values: &[Real]| [values[0].to_bits(), values[1].to_bits()];
        Ok(all.chunks_exact(2).position(|other| bits(other) != bits(&halves)))
    }
}

/// Number of values in which a process tells the reason for a fault, four bytes each.
const REASON: usize = 64;

/// A process among those that run one graph together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Launched {
    /// Number of the process, counted from 0.
    pub rank: usize,
    /// Number of processes; 1 without a launcher.
    pub processes: usize,
}

/// Returns the place of this process among those that a launcher started, as the launcher's variables tell: those of Open
/// MPI, of MPICH and its kin, and of `srun` for either.
pub fn launched() -> Launched {
    let number = |name: &str| std::env::var(name).ok()?.parse().ok();
    [
        ("OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE"),
        ("PMI_RANK", "PMI_SIZE"),
        ("PMIX_RANK", "SLURM_STEP_NUM_TASKS"),
    ]
    .into_iter()
    .find_map(|(rank, processes)| {
        Some(Launched { rank: number(rank)?, processes: number(processes)? })
    })
    .unwrap_or(Launched { rank: 0, processes: 1 })
}

/// The exchange of threads that stand for processes.
struct Local {
    place: Launched,
    table: Arc<Table>,
}

struct Table {
    round: Mutex<Round>,
    turn: Condvar,
}

#[derive(Default)]
struct Round {
    number: usize,
    arrived: usize,
    /// By rank, the values of even and of odd rounds: nobody is more than one round ahead.
    sent: Vec<[Vec<Real>; 2]>,
    ended: Option<usize>,
}

impl Table {
    fn lock(&self) -> MutexGuard<'_, Round> {
        self.round.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Exchange for Local {
    fn all_gather(
        &mut self,
        own: &[Real],
        lengths: &Lengths,
        all: &mut [Real],
    ) -> Result<(), ExchangeFault> {
        let mut round = self.table.lock();
        let number = round.number;
        let sent = &mut round.sent[self.place.rank][number % 2];
        sent.clear();
        sent.extend_from_slice(own);
        round.arrived += 1;
        if round.arrived == self.place.processes {
            round.arrived = 0;
            round.number += 1;
            self.table.turn.notify_all();
        }
        while round.number == number {
            if let Some(rank) = round.ended {
                return Err(ExchangeFault { rank, reason: "has ended".into() });
            }
            round = self.table.turn.wait(round).unwrap_or_else(PoisonError::into_inner);
        }
        for (rank, sent) in round.sent.iter().enumerate() {
            let (into, from) = (&mut all[lengths.of(rank)], &sent[number % 2]);
            if into.len() != from.len() {
                let (found, expected) = (from.len(), into.len());
                let reason = format!("sent {found} values; expected {expected}");
                return Err(ExchangeFault { rank, reason });
            }
            into.copy_from_slice(from);
        }
        Ok(())
    }
}

impl Drop for Local {
    fn drop(&mut self) {
        let mut round = self.table.lock();
        round.ended = round.ended.or(Some(self.place.rank));
        self.table.turn.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everyone_gets_all_values_in_the_order_of_ranks_round_by_round() {
        let lengths = Lengths::new([1, 0, 2]).expect("small");
        let group = Ranks::in_process(3);
        let threads: Vec<_> = group
            .into_iter()
            .map(|ranks| {
                let lengths = lengths.clone();
                std::thread::spawn(move || {
                    let mut rounds = Vec::new();
                    for round in 0..50 {
                        let own = vec![
                            (10 * round + ranks.rank()) as Real;
                            lengths.of(ranks.rank()).len()
                        ];
                        let mut all = vec![0.0; 3];
                        ranks.all_gather(&own, &lengths, &mut all).expect("all are there");
                        rounds.push(all);
                    }
                    (rounds, ranks)
                })
            })
            .collect();
        let ended: Vec<_> = threads.into_iter().map(|t| t.join().expect("no panic")).collect();
        for (rounds, _) in &ended {
            for (round, all) in rounds.iter().enumerate() {
                let at = |rank: usize| (10 * round + rank) as Real;
                assert_eq!(*all, [at(0), at(2), at(2)]);
            }
        }
    }

    #[test]
    fn reasons_are_cut_between_letters() {
        let group = Ranks::in_process(2);
        let long = format!("x{}", "ä".repeat(200));
        let found: Vec<_> = std::thread::scope(|scope| {
            let ask = |ranks: &Ranks| ranks.reasons(if ranks.rank() == 1 { &long } else { "" });
            let threads: Vec<_> =
                group.iter().map(|ranks| scope.spawn(move || ask(ranks))).collect();
            threads
                .into_iter()
                .map(|t| t.join().expect("no panic").expect("all are there"))
                .collect()
        });
        for reasons in found {
            assert_eq!(reasons, [String::new(), format!("x{}", "ä".repeat(127))]);
        }
    }
}
