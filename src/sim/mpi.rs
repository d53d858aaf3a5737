//! MPI: ranks that are processes, on one machine or on many. Needs the feature `mpi`.

use std::error::Error;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use ::mpi::Threading;
use ::mpi::datatype::PartitionMut;
use ::mpi::environment::Universe;
use ::mpi::topology::SimpleCommunicator;
use ::mpi::traits::{Communicator, CommunicatorCollectives};

use super::node::Real;
use super::ranks::{Exchange, ExchangeFault, Lengths, Ranks};

/// MPI for the time of a program.
///
/// Start the program with `mpirun -n 4 PROGRAM`, or with the launcher of the cluster. [`run`](Self::run) is the frame of
/// its `main`. If one process fails or panics, all end, since they would wait for it forever. So they do if MPI itself
/// fails, as when a connection breaks, and if a process is killed; the launcher names it.
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
/// fn model(seat: &Ranks) -> Result<(), Box<dyn Error>> {
///     let lif = Population::Lif(LifSpec::default());
///     let plan = PopulationPlan::all(lif).shared(seat);
///     // Describe, build and run the graph with this plan, in all processes alike.
///     # let _ = plan;
///     if seat.rank() == 0 {
///         println!("this process writes");
///     }
///     Ok(())
/// }
/// ```
pub struct MpiSession {
    ranks: Ranks,
    /// A communicator for the end of the program alone, so that it cannot be mistaken for an exchange; then MPI itself,
    /// which must be dropped last. `None` once MPI has ended.
    open: Option<(SimpleCommunicator, Universe)>,
}

impl MpiSession {
    /// Runs `main` in this process, and ends together with the others. An error that all processes have is told once;
    /// an error of one is told with its rank, and ends all.
    pub fn run<E: Into<Box<dyn Error>>>(main: impl FnOnce(&Ranks) -> Result<(), E>) -> ExitCode {
        let Some(session) = Self::start() else {
            eprintln!("error: MPI was started before in this process");
            return ExitCode::FAILURE;
        };
        let Err(error) = main(&session.ranks) else {
            session.end();
            return ExitCode::SUCCESS;
        };
        let (rank, error) = (session.ranks.rank(), with_causes(&*error.into()));
        if session.all_end(TOGETHER) {
            if rank == 0 {
                eprintln!("error: {error}");
            }
            session.end();
            return ExitCode::FAILURE;
        }
        eprintln!("error: rank {rank}: {error}");
        session.abort(1)
    }

    /// Starts MPI; `None` if it was started before in this process. A session that is dropped before it has
    /// [ended](Self::end) ends all processes.
    pub fn start() -> Option<Self> {
        // The caller's thread makes all calls, but it need not be the main thread.
        let (universe, _) = ::mpi::initialize_with_threading(Threading::Serialized)?;
        let world = universe.world();
        let (rank, ranks) = (world.rank() as usize, world.size() as usize);
        let apart = world.duplicate();
        Some(Self { ranks: Ranks::new(Mpi { rank, ranks }), open: Some((apart, universe)) })
    }

    /// Returns the seat of this process.
    pub fn ranks(&self) -> Ranks {
        self.ranks.clone()
    }

    /// Waits until all processes have called this method, and ends MPI.
    pub fn end(mut self) {
        self.open = None;
    }

    /// Waits until all processes have called this method, but at most for `limit`. Returns whether they have. A program
    /// that fails calls it to find out whether the others failed as well.
    pub fn all_end(&self, limit: Duration) -> bool {
        let Some((apart, _)) = &self.open else { return true };
        let since = Instant::now();
        let mut waiting = apart.immediate_barrier();
        loop {
            waiting = match waiting.test() {
                Ok(_) => return true,
                Err(waiting) => waiting,
            };
            if since.elapsed() > limit {
                // A request must not be dropped before it ends.
                std::mem::forget(waiting);
                return false;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    /// Ends all processes at once. This one exits with `code`.
    pub fn abort(&self, code: i32) -> ! {
        if let Some((apart, _)) = &self.open {
            apart.abort(code);
        }
        std::process::exit(code)
    }
}

impl Drop for MpiSession {
    fn drop(&mut self) {
        if self.open.is_some() {
            eprintln!("error: rank {} ends before the others; all ranks end", self.ranks.rank());
            self.abort(1);
        }
    }
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

/// Time in which processes with the same error end, one after the other.
const TOGETHER: Duration = Duration::from_secs(1);

/// The exchange by `MPI_Allgatherv`.
struct Mpi {
    rank: usize,
    ranks: usize,
}

impl Exchange for Mpi {
    fn rank(&self) -> usize {
        self.rank
    }

    fn ranks(&self) -> usize {
        self.ranks
    }

    fn all_gather(
        &mut self,
        own: &[Real],
        lengths: &Lengths,
        all: &mut [Real],
    ) -> Result<(), ExchangeFault> {
        let mut all = PartitionMut::new(all, lengths.counts(), lengths.starts());
        SimpleCommunicator::world().all_gather_varcount_into(own, &mut all);
        Ok(())
    }
}
