//! Typed handles of ports, by which a description connects them.

use std::any::TypeId;
use std::fmt;
use std::marker::PhantomData;
use std::sync::Arc;

use super::kind::Kind;

/// Where a handle points: a port of a node of one builder, or a name that was not found.
#[derive(Debug, Clone)]
pub(crate) enum PortRef {
    Known { builder: u64, node: usize, port: usize },
    Unknown { node: String, port: String, kind: String, choices: Vec<String> },
}

/// A handle to an output of kind `K`.
pub struct Out<K: Kind> {
    pub(crate) port: PortRef,
    kind: PhantomData<fn() -> K>,
}

/// A handle to an input of kind `K`.
pub struct In<K: Kind> {
    pub(crate) port: PortRef,
    kind: PhantomData<fn(K)>,
}

impl<K: Kind> Out<K> {
    pub(crate) fn new(port: PortRef) -> Self {
        Self { port, kind: PhantomData }
    }
}

impl<K: Kind> In<K> {
    pub(crate) fn new(port: PortRef) -> Self {
        Self { port, kind: PhantomData }
    }
}

impl<K: Kind> Clone for Out<K> {
    fn clone(&self) -> Self {
        Self::new(self.port.clone())
    }
}

impl<K: Kind> Clone for In<K> {
    fn clone(&self) -> Self {
        Self::new(self.port.clone())
    }
}

impl<K: Kind> fmt::Debug for Out<K> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Out<{}>({:?})", K::label(), self.port)
    }
}

impl<K: Kind> fmt::Debug for In<K> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "In<{}>({:?})", K::label(), self.port)
    }
}

/// The ports of an added node, looked up by name.
///
/// A name or kind that the node does not have gives a handle that makes `build` report the fault
/// together with the ports that exist.
#[derive(Debug, Clone)]
pub struct NodePorts {
    pub(crate) builder: u64,
    pub(crate) node: usize,
    pub(crate) path: String,
    pub(crate) inputs: Arc<[(String, TypeId, String)]>,
    pub(crate) outputs: Arc<[(String, TypeId, String)]>,
}

impl NodePorts {
    /// The input called `name`.
    pub fn input<K: Kind>(&self, name: &str) -> In<K> {
        In::new(self.find::<K>(&self.inputs, name))
    }

    /// The output called `name`.
    pub fn output<K: Kind>(&self, name: &str) -> Out<K> {
        Out::new(self.find::<K>(&self.outputs, name))
    }

    /// The node's full path.
    pub fn path(&self) -> &str {
        &self.path
    }

    fn find<K: Kind>(&self, ports: &[(String, TypeId, String)], name: &str) -> PortRef {
        let kind = TypeId::of::<K>();
        match ports.iter().position(|(n, k, _)| n == name && *k == kind) {
            Some(port) => PortRef::Known { builder: self.builder, node: self.node, port },
            None => PortRef::Unknown {
                node: self.path.clone(),
                port: name.into(),
                kind: K::label(),
                choices: ports.iter().map(|(n, _, label)| format!("{n}: {label}")).collect(),
            },
        }
    }
}
