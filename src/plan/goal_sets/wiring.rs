//! Groups of logical units, and the weighted links between them.

use std::collections::{BTreeMap, BTreeSet};

use super::words;
use crate::neurons::{Layers, Map, Select, SelectRule};
use crate::sim::{
    Add, Constant, In, Module, Noise, Out, Real, Scope, SimDuration, Synapse, Vector,
};
use crate::spa::Linear;

/// Input at which a logical unit begins to respond. Its response is half of the full one about 0.15 above.
const LEVEL: Real = 0.35;
/// Bias of a unit that responds to two inputs together. An active input is 1 to 1.4.
pub(super) const AND: Real = -1.15;
/// Synapses of the outputs of units, in milliseconds: one that is quick, and one that lets less noise of spikes through. With the quick
/// one, the search forward takes states for dead ends in spikes: it reads its relaxed plans back through long chains of units.
pub(super) const QUICK_MS: u64 = 3;
pub(super) const CALM_MS: u64 = 4;

/// A weight from one item of a group to one item of another.
pub(super) type Weight = (usize, usize, Real);

/// Items side by side with one activity each.
pub(super) struct Group {
    name: String,
    pub count: usize,
    pub input: In<Vector>,
    pub out: Out<Vector>,
}

/// What the neurons of a group compute.
enum Units {
    /// Whether the input exceeds a level.
    Logic,
    /// Which input wins a race.
    Race(SimDuration),
    /// A function of the input.
    Analog(Map),
}

/// The neurons of a group.
struct Population {
    count: usize,
    units: Units,
    synapse_ms: u64,
}

struct PopulationPorts {
    input: In<Vector>,
    output: Out<Vector>,
}

impl Module for Population {
    type Ports = PopulationPorts;

    fn expand(self, scope: &mut Scope<'_>) -> PopulationPorts {
        let mut select = |name, rule| {
            let layer = scope.select(name, Select::new(self.count, rule));
            (layer.input, layer.output)
        };
        let (input, neurons) = match self.units {
            Units::Logic => select("logic", SelectRule::Threshold { level: LEVEL }),
            Units::Race(tau) => {
                select("race", SelectRule::IndependentAccumulators { level: 0.0, tau })
            }
            Units::Analog(map) => {
                let layer = scope.map("analog", map);
                (layer.input, layer.output)
            }
        };
        let output = scope.add("output", Add::vector(self.count));
        scope.connect(&neurons, &output.input, Synapse::lowpass_ms(self.synapse_ms));
        PopulationPorts {
            input: scope.input("input", input),
            output: scope.output("output", output.output),
        }
    }
}

/// A link to a plain sum: two groups, and which item of the first leads to which of the second.
type Summed = (String, String, Vec<(usize, usize)>);

/// Adds groups and links to a scope.
pub(super) struct Wiring<'a, 's> {
    pub scope: &'a mut Scope<'s>,
    synapse_ms: u64,
    /// Groups without links to others.
    cut: &'a [String],
    reach: Reach,
    /// Names of plain sums, and what leads to them: from which item of which group to which item.
    sums: BTreeSet<String>,
    summed: Vec<Summed>,
}

/// How many weights lead from each item of each group, by the name of the group.
pub(super) type Reach = BTreeMap<String, Vec<u32>>;

impl<'a, 's> Wiring<'a, 's> {
    /// Adds to a scope units with this synapse. Groups named in `cut` get no links to others.
    pub fn new(scope: &'a mut Scope<'s>, synapse_ms: u64, cut: &'a [String]) -> Self {
        Self {
            scope,
            synapse_ms,
            cut,
            reach: Reach::new(),
            sums: BTreeSet::new(),
            summed: Vec::new(),
        }
    }

    /// Returns how many weights lead from each item, those behind plain sums as well.
    pub fn reach(&mut self) -> Reach {
        let mut reach = std::mem::take(&mut self.reach);
        // Backward in time, so that a sum behind a sum has its weights before they are passed on.
        for (from, to, pairs) in self.summed.drain(..).rev() {
            let behind = reach.get(&to).cloned().unwrap_or_default();
            let Some(counts) = reach.get_mut(&from) else { continue };
            for (item, sum) in pairs {
                if let (Some(count), Some(more)) = (counts.get_mut(item), behind.get(sum)) {
                    *count += more;
                }
            }
        }
        reach
    }

    /// Returns whether the links from a group are cut.
    pub fn is_cut(&self, group: &Group) -> bool {
        self.cut.contains(&group.name)
    }

    /// Says what the module of this name is, as the table of words does.
    pub fn describe(&mut self, name: &str) {
        if let Some([name_in_words, meaning]) = words::of(name) {
            self.scope.describe_if_there(name, &name_in_words, &meaning);
        }
    }

    fn group(&mut self, name: &str, count: usize, units: Units) -> Group {
        self.describe(name);
        let synapse_ms = self.synapse_ms;
        let PopulationPorts { input, output } =
            self.scope.add(name, Population { count, units, synapse_ms });
        Group { name: name.into(), count, input, out: output }
    }

    /// Adds logical units: 1 while the sum of the inputs exceeds about a half.
    pub fn units(&mut self, name: &str, count: usize) -> Group {
        self.group(name, count, Units::Logic)
    }

    /// Adds units that respond to two inputs together.
    pub fn both(&mut self, name: &str, count: usize) -> Group {
        self.biased(name, count, AND)
    }

    /// Adds units that are active unless they are inhibited.
    pub fn tonic(&mut self, name: &str, count: usize) -> Group {
        self.biased(name, count, 1.0)
    }

    /// Adds logical units with a constant input.
    pub fn biased(&mut self, name: &str, count: usize, bias: Real) -> Group {
        let group = self.units(name, count);
        self.bias(&group, &vec![bias; count]);
        group
    }

    /// Adds units that stay active after their input has gone, until they are inhibited.
    pub fn latches(&mut self, name: &str, count: usize) -> Group {
        let group = self.units(name, count);
        self.link(&group, &group, each(count, 1.0));
        group
    }

    /// Adds a race of accumulators: the first item whose summed input reaches a bound is active.
    pub fn race(&mut self, name: &str, count: usize, tau: SimDuration) -> Group {
        self.group(name, count, Units::Race(tau))
    }

    /// Adds analog units.
    pub fn analog(&mut self, name: &str, count: usize, map: Map) -> Group {
        self.group(name, count, Units::Analog(map))
    }

    /// Adds a plain sum, for inputs from outside and for slow copies.
    pub fn sum(&mut self, name: &str, count: usize) -> Group {
        self.describe(name);
        let node = self.scope.add(name, Add::vector(count));
        self.sums.insert(name.into());
        Group { name: name.into(), count, input: node.input, out: node.output }
    }

    /// Adds a group that passes an output on.
    pub fn relay(&mut self, name: &str, from: &Out<Vector>, count: usize) -> Group {
        let group = self.sum(name, count);
        self.scope.connect(from, &group.input, Synapse::None);
        group
    }

    /// Adds a sum with noise, of which `sd` is left behind a low-pass of time constant `tau_ms`.
    pub fn noisy(&mut self, name: &str, count: usize, sd: Real, tau_ms: u64) -> Group {
        let white = sd * (2.0 * tau_ms as Real).sqrt();
        self.describe(name);
        let node = self.scope.add(name, Noise::vector(count, white).white());
        Group { name: name.into(), count, input: node.input, out: node.output }
    }

    /// Adds a copy of a group through a slow synapse.
    pub fn slow(&mut self, name: &str, from: &Group, tau_ms: u64) -> Group {
        let copy = self.sum(name, from.count);
        self.note(from, name, (0..from.count).map(|i| (i, i)).collect());
        self.scope.connect(&from.out, &copy.input, Synapse::lowpass_ms(tau_ms));
        copy
    }

    /// Notes what leads from a group to another one.
    fn note(&mut self, from: &Group, to: &str, pairs: Vec<(usize, usize)>) {
        let reach = self.reach.entry(from.name.clone()).or_insert_with(|| vec![0; from.count]);
        if self.sums.contains(to) {
            self.summed.push((from.name.clone(), to.into(), pairs));
        } else {
            pairs.iter().for_each(|(item, _)| reach[*item] += 1);
        }
    }

    /// Links two groups. There is at most one link from one group to another.
    pub fn link(&mut self, from: &Group, to: &Group, weights: impl IntoIterator<Item = Weight>) {
        self.lay(from, to, weights.into_iter().collect(), Synapse::None);
    }

    /// Links two groups through a synapse.
    pub fn link_by(
        &mut self,
        from: &Group,
        to: &Group,
        weights: impl IntoIterator<Item = Weight>,
        synapse: Synapse,
    ) {
        self.lay(from, to, weights.into_iter().collect(), synapse);
    }

    fn lay(&mut self, from: &Group, to: &Group, weights: Vec<Weight>, synapse: Synapse) {
        if self.is_cut(from) {
            return;
        }
        self.note(from, &to.name, weights.iter().map(|(item, to, _)| (*item, *to)).collect());
        let name = format!("{}_to_{}", from.name, to.name);
        self.describe(&name);
        let link = self.scope.add(&name, Linear::sparse(from.count, to.count, weights));
        self.scope.connect(&from.out, &link.input, Synapse::None);
        self.scope.connect(&link.output, &to.input, synapse);
    }

    /// Adds a constant to the input of each item.
    pub fn bias(&mut self, to: &Group, values: &[Real]) {
        let name = format!("bias_of_{}", to.name);
        self.describe(&name);
        let constant = self.scope.add(&name, Constant::vector(values));
        self.scope.connect(&constant, &to.input, Synapse::None);
    }
}

/// Moves the one active unit of a group to where that of another is.
///
/// The others are held down by the sum of the source, so that the weights are as many as the units.
pub(super) fn replace(w: &mut Wiring<'_, '_>, from: &Group, to: &Group) {
    if w.is_cut(from) {
        return;
    }
    let count = from.count;
    let any = w.sum(&format!("any_{}", from.name), 1);
    w.link(from, &any, gather(count, 0, 1.0));
    w.link(from, to, each(count, 2.7));
    w.link(&any, to, spread(0, count, -1.5));
}

/// Links each item to those behind it in the same of several `runs` of items, given by their lengths.
///
/// Items are summed in rows, by a group of this name, so that the weights of a run are as many as its items times the root of
/// their number.
pub(super) fn behind(
    w: &mut Wiring<'_, '_>,
    name: &str,
    from: &Group,
    to: &Group,
    runs: &[usize],
    weight: Real,
) {
    let (mut sums, mut before, mut beside) = (Vec::new(), Vec::new(), Vec::new());
    let (mut rows, mut first) = (0, 0);
    for length in runs {
        let side = length.isqrt().max(1);
        for i in 0..*length {
            let item = first + i;
            sums.push((item, rows + i / side, 1.0));
            before.extend((rows..rows + i / side).map(|row| (row, item, weight)));
            beside.extend((item - i % side..item).map(|other| (other, item, weight)));
        }
        rows += length.div_ceil(side);
        first += length;
    }
    let summed = w.sum(name, rows);
    w.link(from, &summed, sums);
    w.link(&summed, to, before);
    w.link(from, to, beside);
}

/// Weights from each item to the item of the same number.
pub(super) fn each(count: usize, weight: Real) -> impl Iterator<Item = Weight> {
    (0..count).map(move |i| (i, i, weight))
}

/// Weights from one item to all items of a group.
pub(super) fn spread(from: usize, count: usize, weight: Real) -> impl Iterator<Item = Weight> {
    (0..count).map(move |i| (from, i, weight))
}

/// Weights from all items of a group to one item.
pub(super) fn gather(count: usize, to: usize, weight: Real) -> impl Iterator<Item = Weight> {
    (0..count).map(move |i| (i, to, weight))
}

/// Returns the row, the column and the cell of all cells of a table.
pub(super) fn cells(
    rows: usize,
    columns: usize,
) -> impl Iterator<Item = (usize, usize, usize)> + Clone {
    (0..rows).flat_map(move |row| (0..columns).map(move |x| (row, x, row * columns + x)))
}
