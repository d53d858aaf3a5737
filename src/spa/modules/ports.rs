//! Ports that several modules have in common.

use crate::sim::{In, Kind, Out, Scalar};

/// Ports of a module that takes a value and is opened and closed, such as a [`Gate`](super::Gate).
pub struct GatePorts<K: Kind> {
    /// Value. The docs of the module say whether it adds any number of connections.
    pub input: In<K>,
    /// 1 opens and 0 closes. Adds any number of connections.
    pub open: In<Scalar>,
    /// Output.
    pub output: Out<K>,
}

/// Ports of a bilinear function of two values, such as [`Bind`](super::Bind).
pub struct BilinearPorts<A: Kind, B: Kind = A, C: Kind = A> {
    /// First value; takes one connection.
    pub a: In<A>,
    /// Second value; takes one connection.
    pub b: In<B>,
    /// Value of the function.
    pub output: Out<C>,
}
