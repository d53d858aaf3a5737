//! Selection among utilities by a rule.

use super::{FEED_FORWARD, refuse_none};
use crate::neurons::{Layers, Select, SelectRule};
use crate::sim::{Add, In, Module, Out, Scope, Synapse, Vector};

/// Chooses among utilities by a [`SelectRule`]. The output is 1 for a chosen item and 0 for the others, one synapse
/// (5 ms) later.
pub struct Selection {
    items: usize,
    rule: SelectRule,
    synapse: Synapse,
}

/// Ports of a [`Selection`].
pub struct SelectionPorts {
    /// Utilities, one per item; adds any number of connections.
    pub utilities: In<Vector>,
    /// Inhibition, one number per item: 1 keeps the item from being chosen. Adds any number of connections, or none.
    pub inhibit: In<Vector>,
    /// Activity, one number per item: 1 if chosen, else 0.
    pub items: Out<Vector>,
}

impl Selection {
    /// Makes a module that chooses among `items` utilities (at least 1) by `rule`.
    pub fn new(items: usize, rule: SelectRule) -> Self {
        Self { items, rule, synapse: FEED_FORWARD }
    }

    /// Replaces the synapse on the output (default 5 ms).
    pub fn synapse(mut self, synapse: Synapse) -> Self {
        self.synapse = synapse;
        self
    }
}

impl Module for Selection {
    type Ports = SelectionPorts;

    fn expand(self, scope: &mut Scope<'_>) -> SelectionPorts {
        refuse_none(scope, "items", self.items);
        let select = scope.select("select", Select::new(self.items, self.rule));
        let items = scope.add("items", Add::vector(self.items));
        scope.connect(&select.output, &items.input, self.synapse);
        SelectionPorts {
            utilities: scope.input("utilities", select.input),
            inhibit: scope.input("inhibit", select.inhibit),
            items: scope.output("items", items.output),
        }
    }
}
