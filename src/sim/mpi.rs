//! MPI: ranks that are processes, on one machine or on many. Needs the feature `mpi`.

use std::mem::ManuallyDrop;
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
/// Start the program with `mpirun -n 4 PROGRAM`, or with the launcher of the cluster, and call [`end`](Self::end) when
/// all simulators are gone. A process that drops its session without a call of `end`, as after an error or a panic, leaves
/// MPI open; when it exits, the launcher ends the other processes. Otherwise they would wait for it. If MPI itself fails,
/// as when a connection breaks, it ends all processes and names the one at fault. `mpirun` does the same when a process is
/// killed.
///
/// ```no_run
/// use symbolt::neurons::{LifSpec, Population, PopulationPlan};
/// use symbolt::sim::MpiSession;
///
/// let session = MpiSession::start().expect("the only session");
/// let lif = Population::Lif(LifSpec::default());
/// let plan = PopulationPlan::all(lif).shared(&session.ranks());
/// // Describe, build and run the graph with this plan, in all processes alike.
/// # let _ = plan;
/// if session.ranks().rank() == 0 {
///     println!("this process writes");
/// }
/// session.end();
/// ```
pub struct MpiSession {
    ranks: Ranks,
    /// For the end of the program alone, so that it cannot be mistaken for an exchange.
    apart: SimpleCommunicator,
    /// Ends MPI when it is dropped, which waits for all processes.
    universe: ManuallyDrop<Universe>,
}

impl MpiSession {
    /// Starts MPI; `None` if it was started before in this process.
    pub fn start() -> Option<Self> {
        // The caller's thread makes all calls, but it need not be the main thread.
        let (universe, _) = ::mpi::initialize_with_threading(Threading::Serialized)?;
        let world = universe.world();
        let (rank, ranks) = (world.rank() as usize, world.size() as usize);
        let apart = world.duplicate();
        let (ranks, universe) = (Ranks::new(Mpi { rank, ranks }), ManuallyDrop::new(universe));
        Some(Self { ranks, apart, universe })
    }

    /// Waits until all processes have called this method, and ends MPI.
    pub fn end(self) {
        let Self { ranks, apart, universe } = self;
        drop((ranks, apart));
        drop(ManuallyDrop::into_inner(universe));
    }

    /// Returns the seat of this process.
    pub fn ranks(&self) -> Ranks {
        self.ranks.clone()
    }

    /// Waits until all processes have called this method, but at most for `limit`. Returns whether they have. A program
    /// that fails calls it to find out whether the others failed as well.
    pub fn all_end(&self, limit: Duration) -> bool {
        let since = Instant::now();
        let mut waiting = self.apart.immediate_barrier();
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
        self.apart.abort(code)
    }
}

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
