//! Synapses that keep what was tried where: one from each slot to each operator.

use crate::sim::{
    AdvanceIo, Fingerprint, In, InputSpec, Module, Node, NodeFault, Out, OutputSpec, PortDecl,
    Real, Scope, StateSpec, StepCx, Vector,
};

/// Activity below which a slot recalls nothing.
const SILENT: Real = 1e-2;
/// Activity of a slot, an operator and the gate together from which on a synapse grows.
const TOGETHER: Real = 0.5;
/// How much it grows in a millisecond. It is full well before a phase ends.
const GROWTH: Real = 0.3;

/// Plastic synapses from `slots` slots to `operators` operators: while the gate is open, the one from an active slot to an active
/// operator grows to 1 (Hebbian learning with a third factor). An active slot recalls the operators that were tried in it.
///
/// Without them, an operator whose set was visited would win the race and be barred anew each time that the search comes back to the
/// slot: in tangled domains that took a third of the time. Takes one number a synapse and no units.
///
/// Costs O(operators) per active slot and tick.
pub(super) struct Tried {
    pub slots: usize,
    pub operators: usize,
}

/// Ports of [`Tried`].
pub(super) struct TriedPorts {
    /// One number for each slot: 1 for the present one.
    pub slots: In<Vector>,
    /// One number for each operator: 1 for the one that is tried.
    pub operators: In<Vector>,
    /// One number: synapses grow while this is about 1.
    pub gate: In<Vector>,
    /// One number: all synapses are forgotten while this is about 1.
    pub forget: In<Vector>,
    /// One number for each operator: 1 if it was tried in the active slot.
    pub tried: Out<Vector>,
}

impl Node for Tried {
    fn declare(&self, ports: &mut PortDecl) {
        for (name, width) in
            [("slots", self.slots), ("operators", self.operators), ("gate", 1), ("forget", 1)]
        {
            ports.input(name, InputSpec::vector(width).at_advance());
        }
        ports.output("tried", OutputSpec::vector(self.operators).registered());
        ports.state(StateSpec { reals: self.slots * self.operators, words: 0, longs: 0 });
    }

    fn fingerprint(&self, _hash: &mut Fingerprint) {}

    fn advance(&self, _cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let [slots, operators, gate, forget] = std::array::from_fn(|input| io.inputs.get(input));
        let weights = &mut *io.state.reals;
        if forget[0] > SILENT {
            let kept = 1.0 - forget[0].min(1.0);
            weights.iter_mut().for_each(|w| *w *= kept);
        }
        let tried = io.outputs.get_mut(0);
        tried.fill(0.0);
        for (slot, active) in slots.iter().enumerate().filter(|(_, active)| **active > SILENT) {
            let row = &mut weights[slot * self.operators..(slot + 1) * self.operators];
            for ((w, operator), tried) in row.iter_mut().zip(operators).zip(tried.iter_mut()) {
                if active * operator * gate[0] > TOGETHER {
                    *w = (*w + GROWTH).min(1.0);
                }
                *tried += active * *w;
            }
        }
        Ok(())
    }
}

impl Module for Tried {
    type Ports = TriedPorts;

    fn expand(self, scope: &mut Scope<'_>) -> TriedPorts {
        let node = scope.leaf(self);
        TriedPorts {
            slots: node.input("slots"),
            operators: node.input("operators"),
            gate: node.input("gate"),
            forget: node.input("forget"),
            tried: node.output("tried"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::neurons::PopulationPlan;
    use crate::sim::{
        Constant, GraphBuilder, ProbeSpec, RunConfig, Seed, SimDuration, Simulator, Synapse,
        Timebase,
    };

    /// Returns what the second of two slots recalls after ten milliseconds.
    fn recalled(slot: Real, operator: Real, gate: Real, forget: Real) -> Vec<Real> {
        let mut graph = GraphBuilder::new();
        let ports = graph.add("tried", Tried { slots: 2, operators: 3 });
        for (name, values, to) in [
            ("slots", &[0.0, slot][..], &ports.slots),
            ("operators", &[operator, 0.0, 0.0], &ports.operators),
            ("gate", &[gate], &ports.gate),
            ("forget", &[forget], &ports.forget),
        ] {
            let constant = graph.add(name, Constant::vector(values));
            graph.connect(&constant, to, Synapse::None);
        }
        let probe = graph.probe(&ports.tried, ProbeSpec::default());
        let plan = PopulationPlan::direct();
        let graph = graph.build(Timebase::default(), &plan, Seed::new(1)).expect("a graph");
        let mut sim = Simulator::new(graph.into(), RunConfig::seeded(Seed::new(1))).expect("a run");
        sim.run_for(SimDuration::from_millis(10)).expect("ten ticks");
        let samples = sim.samples(&probe);
        let last = samples.iter().last().map(|(_, row)| row.to_vec());
        last.expect("a sample")
    }

    #[test]
    fn a_slot_recalls_what_was_tried_in_it_while_the_gate_was_open() {
        assert_eq!(recalled(1.0, 1.0, 1.0, 0.0), [1.0, 0.0, 0.0]);
        // The gate is shut, the operator is noise, or all is forgotten.
        assert_eq!(recalled(1.0, 1.0, 0.3, 0.0), [0.0; 3]);
        assert_eq!(recalled(1.0, 0.3, 1.0, 0.0), [0.0; 3]);
        assert!(recalled(1.0, 1.0, 1.0, 1.0)[0] < 0.5);
    }
}
