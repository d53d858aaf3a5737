//! Who computes a tick: a setting of the run, never a matter of the thread that called.

/// Who computes a tick. The results have the same bits either way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Threads {
    /// The calling thread alone.
    #[default]
    Serial,
    /// The threads of a Rayon pool: of the one that the caller runs in, else of the global one. Large nodes
    /// share their work among them, and a run from outside the pool is moved into it. A graph without a node
    /// that declares itself [`parallel`](super::PortDecl::parallel) runs as with `Serial`.
    Pool,
}
