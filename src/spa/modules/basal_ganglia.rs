//! Action selection by basal ganglia and thalamus.
//!
//! Five nuclei of rectified populations disinhibit the action of greatest utility. Weights, thresholds and slopes are
//! those of Gurney, Prescott and Redgrave, "A computational model of action selection in the basal ganglia" (2001), as
//! simplified for spiking neurons by Stewart, Choo and Eliasmith, "Dynamic behaviour of a spiking model of action
//! selection in the basal ganglia" (2010). Excitation has a synapse of 2 ms and inhibition a synapse of 8 ms.
//! Connections from the basal ganglia to the thalamus have a synapse of 5 ms, like other connections between modules.

use super::linear::Linear;
use super::maps::{Pooled, Spread};
use super::{FEED_FORWARD, refuse_none};
use crate::neurons::{Layers, Map};
use crate::sim::Ports;
use crate::sim::{
    Add, Constant, In, InputSpec, Module, Out, OutputSpec, Real, Scope, Synapse, Vector,
};
use crate::spa::algebra::LinearMap;

const AMPA: Synapse = Synapse::lowpass_ms(2);
const GABA: Synapse = Synapse::lowpass_ms(8);

/// Basal ganglia and thalamus: chooses the action of greatest utility.
///
/// Takes one utility per action, between 0.3 and 1. The output is about 1 for the chosen action and 0 for all others.
/// Weights, thresholds and slopes are those of Gurney, Prescott and Redgrave (2001), as simplified for spiking neurons
/// by Stewart, Choo and Eliasmith (2010).
///
/// Synapses on the way: 2 ms for excitation, 8 ms for inhibition, 5 ms to the thalamus and 5 ms on the output.
/// A tick costs O(actions), and as much again for each action whose thalamus is not silent.
pub struct BasalGanglia {
    actions: usize,
}

/// Ports of a [`BasalGanglia`].
pub struct BasalGangliaPorts {
    /// Utilities, one per action; adds any number of connections.
    pub utilities: In<Vector>,
    /// Activity of each action: about 1 if chosen, else 0.
    pub chosen: Out<Vector>,
    /// Output of the thalamus: `chosen` before its synapse. Every connection from it needs a synapse.
    pub thalamus: Out<Vector>,
}

impl BasalGanglia {
    /// Makes a module that chooses among `actions` actions (at least 1).
    pub fn new(actions: usize) -> Self {
        Self { actions }
    }
}

impl Module for BasalGanglia {
    type Ports = BasalGangliaPorts;

    fn expand(self, scope: &mut Scope<'_>) -> BasalGangliaPorts {
        let n = self.actions;
        refuse_none(scope, "actions", n);
        let mut nucleus = |name: &str, from: Real| -> Ports<Vector> {
            let rectified = Map::each(n, move |x| (x - from).max(0.0)).above(from).radius(1.5);
            scope.map(name, rectified)
        };
        let (d1, d2) = (nucleus("striatum_d1", 0.2), nucleus("striatum_d2", 0.2));
        let (stn, gpe) = (nucleus("stn", -0.25), nucleus("gpe", -0.2));
        let gpi = nucleus("gpi", -0.2);
        // A constant excites every action. The output nucleus inhibits all actions except the chosen one.
        let thalamus: Ports<Vector> =
            scope.map("thalamus", Map::each(n, |x| x.clamp(0.0, 1.0)).above(0.0).size(0.5));
        let utilities = scope.add("utilities", Add::vector(n));
        let bias = scope.add("bias", Constant::vector(&vec![1.0; n]));
        scope.connect(&bias, &thalamus.input, FEED_FORWARD);
        let mut weigh = |name: &str, from: &Out<Vector>, to: &In<Vector>, map, via| {
            let map =
                scope.add(name, Linear::new(InputSpec::vector(n), OutputSpec::vector(n), map));
            scope.connect(from, &map.input, via);
            scope.connect(&map.output, to, Synapse::None);
        };
        let own = |factor| -> Box<dyn LinearMap> { Box::new(Spread { from: n, to: n, factor }) };
        let pooled = |weight, others| -> Box<dyn LinearMap> {
            Box::new(Pooled { weights: vec![weight; n], others })
        };
        weigh("into_d1", &utilities.output, &d1.input, own(1.2), Synapse::None);
        weigh("into_d2", &utilities.output, &d2.input, own(0.8), Synapse::None);
        weigh("into_stn", &utilities.output, &stn.input, own(1.0), Synapse::None);
        weigh("d1_gpi", &d1.output, &gpi.input, own(-1.0), GABA);
        weigh("d2_gpe", &d2.output, &gpe.input, own(-1.0), GABA);
        weigh("stn_gpi", &stn.output, &gpi.input, pooled(0.9, false), AMPA);
        weigh("stn_gpe", &stn.output, &gpe.input, pooled(0.9, false), AMPA);
        weigh("gpe_gpi", &gpe.output, &gpi.input, own(-0.3), GABA);
        weigh("gpe_stn", &gpe.output, &stn.input, own(-1.0), GABA);
        weigh("gpi_thalamus", &gpi.output, &thalamus.input, own(-3.0), FEED_FORWARD);
        weigh("rivals", &thalamus.output, &thalamus.input, pooled(-1.0, true), GABA);
        let chosen = scope.add("chosen", Add::vector(n));
        scope.connect(&thalamus.output, &chosen.input, FEED_FORWARD);
        BasalGangliaPorts {
            utilities: scope.input("utilities", utilities.input),
            chosen: scope.output("chosen", chosen.output),
            thalamus: scope.output("thalamus", thalamus.output),
        }
    }
}
