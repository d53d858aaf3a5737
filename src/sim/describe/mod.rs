//! Describes a graph: kinds of ports, nodes, modules, synapses and the builder.

pub(super) mod builder;
pub(super) mod draft;
pub(super) mod filter;
pub(super) mod find;
pub(super) mod fingerprint;
pub(super) mod handle;
pub(super) mod io;
pub(super) mod kind;
pub(super) mod lowering;
pub(super) mod node;
pub(super) mod parts;
pub(super) mod port;
pub(super) mod probe_spec;
pub(super) mod process;
pub(super) mod synapse;
