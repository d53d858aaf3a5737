//! Typed handles to ports. The builder connects ports by their handles.

use std::any::TypeId;
use std::fmt;
use std::marker::PhantomData;
use std::sync::Arc;

use super::kind::Kind;

/// The port that a handle refers to, or a port name that was not found.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum PortRef {
    Known { builder: u64, node: usize, port: usize, name: Arc<str> },
    Unknown { node: String, port: String, kind: String, choices: Vec<String> },
}

/// A handle to an output port of kind `K`.
pub struct Out<K: Kind> {
    pub(crate) port: PortRef,
    kind: PhantomData<fn() -> K>,
}

/// A handle to an input port of kind `K`.
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

impl<K: Kind> Out<K> {
    /// Names the setting that adds the port, for the fault if the node does not have it.
    pub(crate) fn added_by(mut self, setting: &'static str) -> Self {
        self.port.set_added_by(setting);
        self
    }
}

impl<K: Kind> In<K> {
    /// As [`Out::added_by`].
    pub(crate) fn added_by(mut self, setting: &'static str) -> Self {
        self.port.set_added_by(setting);
        self
    }
}

impl PortRef {
    fn set_added_by(&mut self, setting: &'static str) {
        if let Self::Unknown { port, kind, choices, .. } = self {
            choices.push(format!("{port}: {kind} (with {setting})"));
        }
    }

    /// Returns the name of the port as faults call it.
    pub(crate) fn name(&self) -> String {
        match self {
            Self::Known { name, .. } => name.to_string(),
            Self::Unknown { node, port, .. } => format!("{node}.{port}"),
        }
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

/// The ports of a node, looked up by name.
///
/// Looking up a name or kind that the node does not have returns a faulty handle. If you use this handle, `build`
/// reports a fault that lists the node's ports.
#[derive(Debug, Clone)]
pub struct NodePorts {
    pub(crate) builder: u64,
    pub(crate) node: usize,
    pub(crate) path: String,
    pub(crate) inputs: Arc<[(String, TypeId, String)]>,
    pub(crate) outputs: Arc<[(String, TypeId, String)]>,
}

impl NodePorts {
    /// Returns the input `name`.
    pub fn input<K: Kind>(&self, name: &str) -> In<K> {
        In::new(self.find(&self.inputs, name, TypeId::of::<K>(), K::label))
    }

    /// Returns the output `name`.
    pub fn output<K: Kind>(&self, name: &str) -> Out<K> {
        Out::new(self.find(&self.outputs, name, TypeId::of::<K>(), K::label))
    }

    fn find(
        &self,
        ports: &[(String, TypeId, String)],
        name: &str,
        kind: TypeId,
        label: fn() -> String,
    ) -> PortRef {
        match ports.iter().position(|(n, k, _)| n == name && *k == kind) {
            Some(port) => {
                let name = format!("{}.{name}", self.path).into();
                PortRef::Known { builder: self.builder, node: self.node, port, name }
            }
            None => PortRef::Unknown {
                node: self.path.clone(),
                port: name.into(),
                kind: label(),
                choices: ports.iter().map(|(n, _, label)| format!("{n}: {label}")).collect(),
            },
        }
    }
}

/// Ports of a module or layer with one input and one output.
pub struct Ports<A: Kind, B: Kind = A> {
    /// Input. The docs of the module say whether it adds any number of connections.
    pub input: In<A>,
    /// Output.
    pub output: Out<B>,
}

impl<A: Kind, B: Kind> Ports<A, B> {
    /// Returns the ports `in` and `out` of a node.
    pub fn of(node: &NodePorts) -> Self {
        Self { input: node.input("in"), output: node.output("out") }
    }
}
