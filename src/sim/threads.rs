//! The threads that compute a tick. They are a setting of the run and do not depend on the calling thread.

/// The threads that compute a tick. The results have the same bits either way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Threads {
    /// Only the calling thread.
    #[default]
    Serial,
    /// The threads of a Rayon pool: the pool that the caller runs in, otherwise the global pool. Nodes that
    /// declare themselves [`parallel`](super::PortDecl::parallel) share their work among these threads. A graph without
    /// such nodes runs as with `Serial`.
    Pool,
}
