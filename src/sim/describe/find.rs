//! Finds the outputs and layers of a description by name.

use std::any::TypeId;
use std::cmp::Reverse;

use super::draft::{Body, NodeDraft};
use super::kind::Kind;
use crate::sim::error::BuildError;
use crate::sim::path::is_inside;
use crate::sim::words::{apart, nearest};

/// Finds the output of kind `K` with a name that [`probe_at`](crate::sim::GraphBuilder::probe_at) accepts: indices of node and
/// port.
pub(in crate::sim) fn output<K: Kind>(
    nodes: &[NodeDraft],
    name: &str,
) -> Result<(usize, usize), BuildError> {
    let of_module = format!("{name}.output");
    let (path, port) = name.rsplit_once('.').unwrap_or((name, "out"));
    let mut all = Vec::new();
    for (index, node) in nodes.iter().enumerate() {
        for (output, declared) in node.ports.outputs.iter().enumerate() {
            let exposed = declared.exposed.as_deref();
            let called = node.path == path && declared.name == port
                || declared.is_exposed_as(name)
                || declared.is_exposed_as(&of_module);
            if called && declared.spec.kind == TypeId::of::<K>() {
                return Ok((index, output));
            }
            let full = format!("{}.{}", node.path, declared.name);
            let label = &declared.spec.kind_label;
            let shown = exposed.unwrap_or(&full);
            all.push((Reverse(called), apart(name, shown), format!("{shown}: {label}")));
        }
    }
    all.sort();
    let choices = all.into_iter().map(|(.., choice)| choice).collect();
    Err(BuildError::UnknownOutput { asked: name.into(), kind: K::label(), choices })
}

/// Finds the layer or node with events at `path`, or the only one inside the module at `path`.
pub(in crate::sim) fn layer(nodes: &[NodeDraft], path: &str) -> Result<usize, BuildError> {
    let fires = |node: &NodeDraft| match &node.body {
        Body::Layer(_) => true,
        Body::Node(node) => node.units() > 0,
        Body::Process(_) | Body::World(_) => false,
    };
    if let Some(index) = nodes.iter().position(|node| node.path == path && fires(node)) {
        return Ok(index);
    }
    let within = |node: &NodeDraft| is_inside(&node.path, path) && fires(node);
    let mut inside = (0..nodes.len()).filter(|index| within(&nodes[*index]));
    if let (Some(index), None) = (inside.next(), inside.next()) {
        return Ok(index);
    }
    let firing = nodes.iter().filter(|node| fires(node));
    let choices = nearest(path, firing.map(|node| node.path.clone()));
    Err(BuildError::UnknownLayer { asked: path.into(), choices })
}
