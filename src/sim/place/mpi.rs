//! MPI: ranks that are processes, on one machine or on many. Needs the feature `mpi`.

use std::collections::BTreeMap;
use std::error::Error;
use std::io::Write;
use std::process::ExitCode;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use ::mpi::datatype::PartitionMut;
use ::mpi::environment::Universe;
use ::mpi::point_to_point::MatchedReceiveVec;
use ::mpi::topology::SimpleCommunicator;
use ::mpi::traits::{Communicator, CommunicatorCollectives, Destination, Source};
use ::mpi::{Tag, Threading};
use thiserror::Error;

use super::ends::{End, Failure, verdict};
use super::ranks::{Exchange, ExchangeFault, Launched, Lengths, Ranks, launched};
use crate::sim::real::Real;

/// MPI for the time of a program.
///
/// Start the program with `mpirun -n 4 PROGRAM`, or with the launcher of the cluster. [`run`](Self::run) is the frame of
/// its `main`. All processes end together. A process that exchanges values with one that has ended, or has failed, gets
/// [`SimError::Rank`](crate::sim::SimError::Rank). If MPI itself fails, as when a connection breaks, or if a process panics or
/// is killed, all end at once.
///
/// Only rank 0 should write files. No error of another rank cuts it off: the others wait until it exchanges values or ends.
///
/// MPI's point-to-point messages with the tag 21,587 belong to this type.
///
/// ```no_run
/// use std::error::Error;
/// use std::process::ExitCode;
///
/// use symbolt::neurons::{LifSpec, Population, PopulationPlan};
/// use symbolt::sim::{MpiSession, Ranks};
///
/// fn main() -> ExitCode {
///     MpiSession::run(model)
/// }
///
/// fn model(ranks: &Ranks) -> Result<(), Box<dyn Error>> {
///     let lif = Population::Lif(LifSpec::default());
///     let plan = PopulationPlan::all(lif).shared(ranks);
///     // Describe, build and run the graph with this plan, in all processes alike.
///     # let _ = plan;
///     if ranks.rank() == 0 {
///         println!("this process writes");
///     }
///     Ok(())
/// }
/// ```
pub struct MpiSession {
    ranks: Ranks,
    ends: Arc<Mutex<Ends>>,
    /// `None` once MPI has ended.
    universe: Option<Universe>,
}

/// The error of starting MPI.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum MpiStartError {
    /// MPI was started before in this process.
    #[error("MPI was started before in this process")]
    Twice,
    /// The launcher belongs to another MPI library than the program. Each process would be alone.
    #[error(
        "the launcher started {launched} processes, but MPI joins {joined} of them; \
         start the program with the launcher of the MPI library that it was built with"
    )]
    Apart {
        /// Number of processes that the launcher's variables tell.
        launched: usize,
        /// Number of processes that MPI joins.
        joined: usize,
    },
}

/// Time in which the other processes can end after rank 0 has failed.
const LIMIT: Duration = Duration::from_secs(2);

impl MpiSession {
    /// Runs `main` in this process, and ends together with the others. An error that all processes have is told once;
    /// an error of some is told with their ranks. Returns success only if no process has failed.
    pub fn run<E: Into<Box<dyn Error>>>(main: impl FnOnce(&Ranks) -> Result<(), E>) -> ExitCode {
        let session = match Self::start() {
            Ok(session) => session,
            Err(error) => {
                if launched().rank == 0 {
                    print_error(&error.to_string());
                }
                return ExitCode::FAILURE;
            }
        };
        let outcome = main(&session.ranks);
        let failure = outcome.err().map(|error| {
            let sentence = with_causes(&*error.into());
            Failure { code: 1, sentence }
        });
        ExitCode::from(session.end(failure, print_error))
    }

    /// Starts MPI. A session that is dropped before it has [ended](Self::end) ends all processes.
    ///
    /// # Errors
    /// [`MpiStartError`] if MPI was started before, or if it does not join the processes of the launcher.
    pub fn start() -> Result<Self, MpiStartError> {
        // The caller's thread makes all calls, but it need not be the main thread.
        let universe = ::mpi::initialize_with_threading(Threading::Serialized);
        let (universe, _) = universe.ok_or(MpiStartError::Twice)?;
        let world = universe.world();
        let (rank, joined) = (world.rank() as usize, world.size() as usize);
        let launched = launched().processes;
        if launched > 1 && joined == 1 {
            return Err(MpiStartError::Apart { launched, joined });
        }
        let ends = Arc::<Mutex<Ends>>::default();
        let place = Launched { rank, processes: joined };
        let ranks = Ranks::new(place, Mpi { ends: ends.clone() });
        Ok(Self { ranks, ends, universe: Some(universe) })
    }

    /// Returns the rank of this process.
    pub fn ranks(&self) -> Ranks {
        self.ranks.clone()
    }

    /// Tells the other processes that this one has ended, waits for their ends, and ends MPI. Rank 0 calls `tell` for
    /// every sentence that the user should read. Returns the exit code, the same for all: 0 if no process has failed.
    ///
    /// A rank 0 that has failed waits 2 seconds and then ends the others.
    pub fn end(mut self, failure: Option<Failure>, tell: impl Fn(&str)) -> u8 {
        let (rank, ranks) = (self.ranks.rank(), self.ranks.ranks());
        let world = SimpleCommunicator::world();
        let mut ends = lock(&self.ends);
        let told = self.ranks.told() || !ends.heard.is_empty();
        let limit = (rank == 0 && failure.is_some()).then_some(LIMIT);
        let own = End { exchanges: ends.exchanges, failure, told };
        let bytes = serde_json::to_vec(&own).unwrap_or_default();
        ends.heard.insert(rank, own);
        let tell_all = |ends: &Ends| {
            let (code, sentences) = verdict(ranks, &ends.heard);
            if rank == 0 {
                sentences.iter().for_each(|sentence| tell(sentence));
            }
            code
        };
        let code = ::mpi::request::scope(|scope| {
            let others = (0..ranks).filter(|other| *other != rank);
            let sent: Vec<_> = others
                .map(|other| {
                    let other = world.process_at_rank(other as i32);
                    other.immediate_send_with_tag(scope, &bytes[..], NOTICE)
                })
                .collect();
            let since = Instant::now();
            while ends.heard.len() < ranks {
                if limit.is_some_and(|limit| since.elapsed() > limit) {
                    let code = tell_all(&ends);
                    world.abort(i32::from(code));
                }
                thread::sleep(NAP);
                ends.listen();
            }
            for request in sent {
                request.wait();
            }
            tell_all(&ends)
        });
        // A process that waited for others in vain has begun an exchange more than they. MPI wants all to begin it.
        let begun = ends.heard.values().map(|end| end.exchanges).max().unwrap_or(0);
        for _ in ends.exchanges..begun {
            world.immediate_barrier().wait();
        }
        drop(ends);
        self.universe = None;
        code
    }
}

impl Drop for MpiSession {
    fn drop(&mut self) {
        if self.universe.is_some() {
            let rank = self.ranks.rank();
            print_error(&format!("rank {rank} ends before the others; all ranks end"));
            SimpleCommunicator::world().abort(1);
        }
    }
}

/// Prints one error to standard error, in one piece: the launcher mixes what its processes and itself write.
fn print_error(sentence: &str) {
    // If standard error is closed, the message is lost.
    let _ = std::io::stderr().write_all(format!("error: {sentence}\n").as_bytes());
}

fn with_causes(error: &dyn Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        text += &format!(": {error}");
        cause = error.source();
    }
    text
}

/// Tag of the messages in which processes tell their ends.
const NOTICE: Tag = 21_587;

/// Time for which a process waits without giving its core to others. Most exchanges are over before.
const SPIN: Duration = Duration::from_micros(500);

/// Time between two looks at what has arrived.
const NAP: Duration = Duration::from_micros(50);

/// The exchanges of this process, and the ends of the others.
#[derive(Default)]
struct Ends {
    exchanges: u64,
    heard: BTreeMap<usize, End>,
    /// The fault that ended the exchanges.
    fault: Option<ExchangeFault>,
}

fn lock(ends: &Mutex<Ends>) -> MutexGuard<'_, Ends> {
    ends.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Ends {
    /// Receives the ends that have been told since the last call.
    fn listen(&mut self) {
        let world = SimpleCommunicator::world();
        while let Some(message) = world.any_process().immediate_matched_probe_with_tag(NOTICE) {
            let (bytes, status) = message.matched_receive_vec::<u8>();
            let end = serde_json::from_slice(&bytes).unwrap_or_default();
            self.heard.insert(status.source_rank() as usize, end);
        }
    }

    /// Waits until all processes have called this method equally often, or one has ended without it.
    ///
    /// A barrier that does not block costs half a microsecond between two processes in shared memory. A gather that does
    /// not block would cost 1 to 4 microseconds more than one that does, and more with many processes, since in Open MPI
    /// every process sends to every other.
    fn meet(&mut self) -> Result<(), ExchangeFault> {
        if let Some(fault) = &self.fault {
            return Err(fault.clone());
        }
        self.exchanges += 1;
        let since = Instant::now();
        let mut barrier = SimpleCommunicator::world().immediate_barrier();
        loop {
            barrier = match barrier.test() {
                Ok(_) => return Ok(()),
                Err(barrier) => barrier,
            };
            if since.elapsed() < SPIN {
                continue;
            }
            self.listen();
            let gone = self.heard.iter().find(|(_, end)| end.exchanges < self.exchanges);
            if let Some((rank, end)) = gone {
                let reason = match &end.failure {
                    Some(failure) => format!("stopped: {}", failure.sentence),
                    None => "has ended".into(),
                };
                let fault = ExchangeFault { rank: *rank, reason };
                self.fault = Some(fault.clone());
                // The request cannot end yet. The others begin it when they have ended.
                std::mem::forget(barrier);
                return Err(fault);
            }
            thread::sleep(NAP);
        }
    }
}

/// The exchange by `MPI_Allgatherv`.
struct Mpi {
    ends: Arc<Mutex<Ends>>,
}

impl Exchange for Mpi {
    fn all_gather(
        &mut self,
        own: &[Real],
        lengths: &Lengths,
        all: &mut [Real],
    ) -> Result<(), ExchangeFault> {
        lock(&self.ends).meet()?;
        let mut all = PartitionMut::new(all, lengths.counts(), lengths.starts());
        SimpleCommunicator::world().all_gather_varcount_into(own, &mut all);
        Ok(())
    }
}
