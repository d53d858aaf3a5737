//! Synapses that keep rows of bits: a table with one row for each slot, written, read and compared at once.

use crate::sim::{
    AdvanceIo, Fingerprint, In, InputSpec, Module, Node, NodeFault, Out, OutputSpec, PortDecl,
    Real, Scope, ScratchSpec, StateSpec, StepCx, Vector,
};

/// Activity below which a unit is silent.
const SILENT: Real = 1e-2;
/// Activity of the gate from which on a slot is written.
const GATE: Real = 0.5;
/// Share of the way to its target that a synapse goes in a millisecond, while its slot is written.
const RATE: Real = 0.3;
/// Target of a synapse from an active unit, and from a silent one. Both lie beyond the range of a synapse, so that it
/// becomes exactly 1 or 0 well before the writing ends.
const TARGET: [Real; 2] = [-0.3, 1.4];

/// Plastic synapses between `columns` units and `slots` slots: a slot remembers a pattern of columns in one shot.
///
/// While a slot is gated, each of its synapses goes towards 1 if the column is active and towards 0 if it is not, within the
/// range from 0 to 1 (Hebbian learning with a third factor and bounded weights). The same weights are used in three
/// directions: from a slot to the columns of its pattern, from the columns to slots that lack one of them, and from a pattern
/// to the slots that share columns of a range. Takes one number a synapse and no units.
///
/// Costs O(columns) per active slot or column and tick.
pub(super) struct Synapses {
    pub slots: usize,
    pub columns: usize,
    /// Number of the first columns, which `sets` asks for. The next one marks the slot; `numbers` asks for those behind it.
    pub set: usize,
    /// Columns that are compared by `kin`.
    pub kin: std::ops::Range<usize>,
    /// Whether what is compared must be part of a row, or a row part of it.
    pub within: bool,
}

/// Ports of [`Synapses`].
pub(super) struct SynapsePorts {
    /// One number for each slot: it is written while this is about 1.
    pub write: In<Vector>,
    /// One number for each column: the pattern to write, and to compare by `kin`.
    pub pattern: In<Vector>,
    /// One number: all slots are forgotten while this is about 1.
    pub forget: In<Vector>,
    /// One number for each slot: whose set to recall.
    pub sets: In<Vector>,
    /// One number for each slot: whose numbers to recall.
    pub numbers: In<Vector>,
    /// One number for each column of the set: what to compare with all rows.
    pub compared: In<Vector>,
    /// One number for each column: what was asked for.
    pub recalled: Out<Vector>,
    /// One number for each slot: how many columns are missing on the other side of the comparison.
    pub missing: Out<Vector>,
    /// One number for each slot: how many columns of the range `kin` it shares with the pattern.
    pub kin: Out<Vector>,
    /// One number for each slot: 1 if it was written.
    pub marks: Out<Vector>,
}

impl Synapses {
    fn row(&self, slot: usize) -> std::ops::Range<usize> {
        slot * self.columns..(slot + 1) * self.columns
    }
}

impl Node for Synapses {
    fn declare(&self, ports: &mut PortDecl) {
        let (slots, columns) = (self.slots, self.columns);
        for (name, width) in [
            ("write", slots),
            ("pattern", columns),
            ("forget", 1),
            ("sets", slots),
            ("numbers", slots),
            ("compared", self.set),
        ] {
            ports.input(name, InputSpec::vector(width).at_advance());
        }
        for (name, width) in
            [("recalled", columns), ("missing", slots), ("kin", slots), ("marks", slots)]
        {
            ports.output(name, OutputSpec::vector(width).registered());
        }
        ports
            .state(StateSpec { reals: slots * columns, words: 0, longs: 0 })
            .scratch(ScratchSpec { reals: 0, complexes: 0, words: columns });
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text(if self.within { "within" } else { "around" });
        for number in [self.set, self.kin.start, self.kin.end] {
            hash.number(number as u64);
        }
    }

    fn advance(&self, _cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let [write, pattern, forget, sets, numbers, compared] =
            std::array::from_fn(|input| io.inputs.get(input));
        let (weights, active) = (&mut *io.state.reals, &mut *io.scratch.words);
        if forget[0] > SILENT {
            let kept = 1.0 - forget[0].min(1.0);
            weights.iter_mut().for_each(|w| *w *= kept);
        }
        for slot in (0..self.slots).filter(|slot| write[*slot] > GATE) {
            let rate = RATE * write[slot].min(1.0);
            for (w, x) in weights[self.row(slot)].iter_mut().zip(pattern) {
                let [low, high] = TARGET;
                let target = low + (high - low) * x.clamp(0.0, 1.0);
                *w = (*w + rate * (target - *w)).clamp(0.0, 1.0);
            }
        }

        let recalled = io.outputs.get_mut(0);
        recalled.fill(0.0);
        let parts = [(sets, 0..self.set), (numbers, self.set + 1..self.columns)];
        for (asked, columns) in parts {
            for slot in (0..self.slots).filter(|slot| asked[*slot] > SILENT) {
                let row = &weights[self.row(slot)][columns.clone()];
                let sum = recalled[columns.clone()].iter_mut().zip(row);
                sum.for_each(|(r, w)| *r += asked[slot] * w);
            }
        }

        let marks = io.outputs.get_mut(3);
        for (slot, mark) in marks.iter_mut().enumerate() {
            *mark = weights[slot * self.columns + self.set];
        }
        let compare = |columns: std::ops::Range<usize>, values: &[Real], active: &mut [u32]| {
            let loud = columns.filter(|c| values[*c] > SILENT);
            let mut count = 0;
            for column in loud {
                active[count] = column as u32;
                count += 1;
            }
            count
        };
        let count = compare(0..self.set, compared, active);
        let missing = io.outputs.get_mut(1);
        for (slot, sum) in missing.iter_mut().enumerate() {
            let row = &weights[self.row(slot)];
            let taken = row[self.set] > SILENT && count > 0;
            let columns = if taken { &active[..count] } else { &[] };
            let lacks = |c: usize| if self.within { 1.0 - row[c] } else { row[c] };
            *sum = columns.iter().map(|c| compared[*c as usize] * lacks(*c as usize)).sum();
        }
        let count = compare(self.kin.clone(), pattern, active);
        let kin = io.outputs.get_mut(2);
        for (slot, sum) in kin.iter_mut().enumerate() {
            let row = &weights[self.row(slot)];
            *sum = active[..count].iter().map(|c| pattern[*c as usize] * row[*c as usize]).sum();
        }
        Ok(())
    }
}

impl Module for Synapses {
    type Ports = SynapsePorts;

    fn expand(self, scope: &mut Scope<'_>) -> SynapsePorts {
        let node = scope.leaf(self);
        SynapsePorts {
            write: node.input("write"),
            pattern: node.input("pattern"),
            forget: node.input("forget"),
            sets: node.input("sets"),
            numbers: node.input("numbers"),
            compared: node.input("compared"),
            recalled: node.output("recalled"),
            missing: node.output("missing"),
            kin: node.output("kin"),
            marks: node.output("marks"),
        }
    }
}
