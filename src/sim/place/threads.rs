//! The threads that compute a tick. They are a setting of the run and do not depend on the calling thread.

/// The threads that compute a tick. The results have the same bits in all cases.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Threads {
    /// Only the calling thread.
    #[default]
    Serial,
    /// One thread for each thread of Rayon's global pool, but only as many as the graph has work for. A run that is
    /// started on a thread of a Rayon pool uses that thread alone, since its caller already shares the cores.
    Auto,
    /// This number of threads, 1 to 1024, but at most one for each part of the graph ([`Parts`](crate::sim::Parts)).
    Exactly(usize),
}

/// Work for which a second thread is worth its cost. A tick of so many neurons takes about 15 microseconds.
const MIN_WORK: u64 = 6_000;

impl Threads {
    /// Returns the number of threads for a graph with `parts` parts that do `work` in a tick.
    pub(crate) fn count(self, parts: usize, work: u64) -> usize {
        let most = match self {
            Self::Serial => 1,
            Self::Auto if rayon::current_thread_index().is_some() => 1,
            Self::Auto => rayon::current_num_threads().min((work / MIN_WORK + 1) as usize),
            Self::Exactly(threads) => threads.min(1024),
        };
        most.clamp(1, parts.max(1))
    }
}
