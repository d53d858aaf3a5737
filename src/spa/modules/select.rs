//! Selection among utilities, as the basal ganglia and thalamus do.

use super::FEED_FORWARD;
use crate::neurons::{Layers, Select, SelectRule};
use crate::sim::{Add, In, Module, Out, Scope, Synapse, Vector};

/// Chooses among utilities: 1 for what is chosen, one synapse (5 ms) later.
pub struct Selection {
    items: usize,
    rule: SelectRule,
    synapse: Synapse,
}

/// Ports of a [`Selection`].
pub struct SelectionPorts {
    /// One utility an item; any number of sources.
    pub utilities: In<Vector>,
    /// An inhibition of 1 keeps an item from being chosen; may stay unfed.
    pub inhibit: In<Vector>,
    /// How active each item is: 1 when chosen.
    pub items: Out<Vector>,
}

impl Selection {
    /// A choice among `items` utilities by `rule`.
    pub fn new(items: usize, rule: SelectRule) -> Self {
        Self { items, rule, synapse: FEED_FORWARD }
    }

    /// Replaces the synapse behind the choice.
    pub fn synapse(mut self, synapse: Synapse) -> Self {
        self.synapse = synapse;
        self
    }
}

impl Module for Selection {
    type Ports = SelectionPorts;

    fn expand(self, scope: &mut Scope<'_>) -> SelectionPorts {
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
