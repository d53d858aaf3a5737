//! The node of a learned connection: computes its output, and lets the rules change its weights.

use std::ops::Range;
use std::sync::Arc;

use multiversion::multiversion;

use super::trace::Follower;
use super::{LearningRule, LearningTick, Needs, Side, Stretch, WeightShape};
use crate::sim::{
    AdvanceIo, EmitIo, Fingerprint, InputSpec, Inputs, Node, NodeFault, OutputSpec, Outputs,
    PortDecl, Process, Real, ScratchSpec, Seed, StateMut, StateSpec, StepCx, Timebase,
};

/// Weights that change together: they stay in the first-level cache from rule to rule.
const STRETCH: usize = 128;
/// Number of outputs up to which all sources are visited, active or not.
const FEW_ROWS: usize = 4;

/// A rule with its place in the connection.
#[derive(Debug, Clone)]
pub(super) struct Placed {
    pub rule: Arc<dyn LearningRule>,
    pub needs: Needs,
    /// Name and index of its input.
    pub signal: Option<(String, usize)>,
    pub state: Range<usize>,
}

/// What an exposed output shows.
#[derive(Debug, Clone)]
pub(super) enum Shown {
    State(Range<usize>),
    Delta,
}

/// A learned connection, before its synapses are made discrete.
pub(super) struct Connection {
    pub shape: WeightShape,
    /// Whether the output is computed in emit, from a value.
    pub emits: bool,
    /// Width of the first input, and the sources in it.
    pub pre: (usize, Range<usize>),
    pub post: Option<(usize, Range<usize>)>,
    pub switched: bool,
    pub rules: Vec<Placed>,
    pub start: Vec<f64>,
    pub layout: Arc<[(String, Range<usize>)]>,
    pub shown: Vec<(String, Shown)>,
}

/// The activities of a tick, with the sources that are active.
struct Sources<'a> {
    pre: &'a [Real],
    /// Indices of the active sources, if they are few: then only their weights are read.
    few: Option<&'a [u32]>,
}

impl<'a> Sources<'a> {
    /// Finds the active sources, for so many outputs. `active` has room for an index per source.
    fn of(pre: &'a [Real], active: &'a mut [u32], outputs: usize) -> Self {
        // Finding the active sources costs more than a few rows.
        if outputs <= FEW_ROWS {
            return Self { pre, few: None };
        }
        let mut count = 0;
        for (eight, of_eight) in pre.chunks(8).enumerate() {
            if of_eight.iter().fold(0, |bits, a| bits | a.to_bits()) == 0 {
                continue;
            }
            for (at, a) in of_eight.iter().enumerate() {
                active[count] = (8 * eight + at) as u32;
                count += usize::from(*a != 0.0);
            }
        }
        Self { pre, few: (4 * count <= pre.len()).then_some(&active[..count]) }
    }

    /// Returns the product of a row of weights and the activities.
    fn through(&self, row: &[f64]) -> Real {
        let add = |sum: f64, at: &u32| sum + row[*at as usize] * f64::from(self.pre[*at as usize]);
        self.few.map_or_else(|| dot(row, self.pre), |active| active.iter().fold(0.0, add)) as Real
    }

    /// Computes the product of all weights and the activities.
    fn apply(&self, weights: &[f64], out: &mut [Real]) {
        let rows = out.iter_mut().zip(weights.chunks_exact(self.pre.len()));
        rows.for_each(|(out, row)| *out = self.through(row));
    }
}

/// Returns the scalar product. Eight sums need no order, so they fit wide registers.
#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1"))]
pub(super) fn dot<T: Copy + Into<f64>>(weights: &[f64], values: &[T]) -> f64 {
    let mut sums = [0.0; 8];
    let (weights, values) = (weights.as_chunks::<8>(), values.as_chunks::<8>());
    for (weights, values) in weights.0.iter().zip(values.0) {
        for lane in 0..8 {
            sums[lane] += weights[lane] * values[lane].into();
        }
    }
    let rest = weights.1.iter().zip(values.1);
    rest.fold(sums.iter().sum(), |sum: f64, (w, v)| sum + w * (*v).into())
}

/// Multiplies changes by a factor and adds them to weights. Returns 0 if all weights are then finite.
#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1"))]
fn add(weights: &mut [f64], change: &mut [f64], factor: f64) -> f64 {
    let mut sums = [0.0; 8];
    let (weights, rest) = weights.as_chunks_mut::<8>();
    let (changes, last) = change.as_chunks_mut::<8>();
    for (weights, changes) in weights.iter_mut().zip(changes) {
        for lane in 0..8 {
            changes[lane] *= factor;
            weights[lane] += changes[lane];
            sums[lane] += weights[lane] * 0.0;
        }
    }
    for (weight, change) in rest.iter_mut().zip(last) {
        *change *= factor;
        *weight += *change;
        sums[0] += *weight * 0.0;
    }
    sums.iter().sum()
}

impl Placed {
    /// Returns what the rule reads.
    fn tick<'a>(&self, all: LearningTick<'a>, inputs: Inputs<'a>) -> LearningTick<'a> {
        let signal = self.signal.as_ref().map_or(&[][..], |(_, index)| inputs.get(*index));
        let output = if self.needs.output { all.output } else { &[] };
        LearningTick { signal, output, ..all }
    }
}

impl Connection {
    /// Number of values of the state: the weights, then the states of the rules.
    fn total(&self) -> usize {
        self.layout.last().map_or(0, |(_, range)| range.end)
    }

    fn pre<'a>(&self, inputs: Inputs<'a>) -> &'a [Real] {
        &inputs.get(0)[self.pre.1.clone()]
    }

    /// Changes all weights, and writes the changes to `delta` if it has room for them. `before` gets each row before it
    /// changes: a row that is in the cache is read twice at the cost of once. Returns whether the weights are finite.
    fn learn(
        &self,
        weights: &mut [f64],
        states: &[f64],
        (tick, inputs): (LearningTick<'_>, Inputs<'_>),
        mut before: impl FnMut(usize, &[f64]),
        delta: &mut [Real],
    ) -> bool {
        let (columns, learnt) = (self.shape.inputs, weights.len());
        let mut unsound = 0.0;
        let state = |rule: &Placed| &states[rule.state.start - learnt..rule.state.end - learnt];
        for (row, weights) in weights.chunks_exact_mut(columns).enumerate() {
            before(row, weights);
            let leaves = |placed: &Placed| {
                placed.rule.leaves(&placed.tick(tick, inputs), state(placed), row)
            };
            if delta.is_empty() && self.rules.iter().all(leaves) {
                continue;
            }
            for (index, own) in weights.chunks_mut(STRETCH).enumerate() {
                let from = index * STRETCH;
                let mut change = [0.0; STRETCH];
                let change = &mut change[..own.len()];
                let of = Stretch { row, columns: from..from + own.len(), weights: own };
                for rule in &self.rules {
                    rule.rule.change(&rule.tick(tick, inputs), state(rule), &of, change);
                }
                unsound += add(own, change, tick.learning);
                let delta = delta.get_mut(row * columns + from..).unwrap_or(&mut []);
                delta.iter_mut().zip(&*change).for_each(|(to, change)| *to = *change as Real);
            }
        }
        unsound == 0.0
    }

    /// Writes the exposed states.
    fn show(&self, state: &[f64], outputs: &mut Outputs<'_>) {
        for (index, (_, shown)) in self.shown.iter().enumerate() {
            if let Shown::State(range) = shown {
                let out = outputs.get_mut(index + 1).iter_mut();
                out.zip(&state[range.clone()]).for_each(|(to, value)| *to = *value as Real);
            }
        }
    }
}

/// The connection as a graph has it: it becomes a node when the length of a tick is known.
pub(super) struct Described(pub Arc<Connection>);

impl Process for Described {
    fn declare(&self, ports: &mut PortDecl) {
        self.0.declare(ports);
    }

    fn make(&self, time: Timebase, _seed: Seed) -> Result<Box<dyn Node>, String> {
        let (mut followers, mut singles) = (Vec::new(), 0);
        for Placed { rule, needs, state, .. } in &self.0.rules {
            let mut from = state.start;
            for (name, length) in &needs.state {
                for trace in needs.traces.iter().filter(|trace| trace.state == *name) {
                    let follower = Follower::new(
                        trace.of,
                        from..from + length,
                        trace.synapse,
                        (singles, time),
                    );
                    let follower = follower.map_err(|wrong| {
                        format!("rule `{}`: the synapse of `{name}` has {wrong}", rule.name())
                    })?;
                    singles += follower.singles();
                    followers.push(follower);
                }
                from += length;
            }
        }
        Ok(Box::new(Running { of: self.0.clone(), followers, singles }))
    }
}

/// The node of a learned connection.
struct Running {
    of: Arc<Connection>,
    followers: Vec<Follower>,
    /// Number of the followers' numbers in single precision.
    singles: usize,
}

impl Connection {
    /// Declares the ports.
    fn declare(&self, ports: &mut PortDecl) {
        let WeightShape { outputs, inputs } = self.shape;
        let (own, first) = (InputSpec::vector(self.pre.0), OutputSpec::vector(outputs));
        if self.emits {
            ports.input("input", own.sum()).output("output", first);
        } else {
            ports.input("pre", own.at_settle());
            ports.output("output", first.registered().filtered_only());
        }
        if let Some((width, _)) = self.post {
            ports.input("post", InputSpec::vector(width).at_settle());
        }
        if self.switched {
            ports.input("learning", InputSpec::scalar().sum().at_settle());
        }
        for rule in &self.rules {
            if let (Some((name, _)), Some((_, width))) = (&rule.signal, rule.needs.signal) {
                ports.input(name, InputSpec::vector(width).sum().at_settle());
            }
        }
        for (name, shown) in &self.shown {
            let width = match shown {
                Shown::State(range) => range.len(),
                Shown::Delta => outputs * inputs,
            };
            ports.output(name, OutputSpec::vector(width).registered());
        }
    }
}

impl Node for Running {
    fn declare(&self, ports: &mut PortDecl) {
        self.of.declare(ports);
        let WeightShape { outputs, inputs } = self.of.shape;
        let (longs, reals) = (self.of.total(), self.singles);
        ports.state(StateSpec { longs, reals, ..StateSpec::default() });
        ports.scratch(ScratchSpec { reals: outputs, words: inputs, ..ScratchSpec::default() });
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        for range in [Some(&self.of.pre.1), self.of.post.as_ref().map(|(_, range)| range)] {
            let range = range.cloned().unwrap_or_default();
            hash.number(range.start as u64).number(range.end as u64);
        }
        for placed in &self.of.rules {
            hash.text(placed.rule.name());
            placed.rule.fingerprint(hash);
        }
        self.of.start.iter().for_each(|weight| {
            hash.real(*weight);
        });
    }

    fn init(&self, cx: &StepCx<'_>, state: &mut StateMut<'_>, registered: &mut Outputs<'_>) {
        let all: &mut [f64] = bytemuck::cast_slice_mut(state.longs);
        all[..self.of.start.len()].copy_from_slice(&self.of.start);
        for placed in &self.of.rules {
            placed.rule.start(self.of.shape, cx.dt_s(), &mut all[placed.state.clone()]);
        }
        self.of.show(all, registered);
    }

    fn emit(&self, _cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
        let all: &[f64] = bytemuck::cast_slice(io.state.longs);
        let weights = &all[..self.of.start.len()];
        let outputs = self.of.shape.outputs;
        let sources = Sources::of(self.of.pre(io.inputs), io.scratch.words, outputs);
        sources.apply(weights, io.outputs.get_mut(0));
    }

    fn advance(&self, cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let (of, inputs) = (&*self.of, io.inputs);
        let all: &mut [f64] = bytemuck::cast_slice_mut(io.state.longs);
        let (weights, states) = all.split_at_mut(of.start.len());
        let (pre, output) = (of.pre(inputs), &mut io.scratch.reals[..of.shape.outputs]);
        let told = of.rules.iter().any(|rule| rule.needs.output);
        // What was emitted, and no rule is told, is not computed anew.
        let rows = if told || !of.emits { of.shape.outputs } else { 0 };
        let sources = Sources::of(pre, io.scratch.words, rows);
        // What no rule is told is computed row by row, while the rules change the weights.
        let (output, later): (&[Real], &mut [Real]) = match (told, of.emits) {
            (true, _) => {
                sources.apply(weights, output);
                (output, &mut [])
            }
            (false, true) => (&[], &mut []),
            (false, false) => (&[], output),
        };
        let learning_at = 1 + usize::from(of.post.is_some());
        let tick = LearningTick {
            dt_s: cx.dt_s(),
            shape: of.shape,
            pre,
            post: of.post.as_ref().map_or(&[], |(_, range)| &inputs.get(1)[range.clone()]),
            output,
            signal: &[],
            learning: if of.switched { inputs.scalar(learning_at).into() } else { 1.0 },
        };
        let learnt = weights.len();
        for follower in &self.followers {
            let activity = if follower.of == Side::Pre { tick.pre } else { tick.post };
            let trace = follower.trace.start - learnt..follower.trace.end - learnt;
            follower.follow(activity, &mut states[trace], io.state.reals);
        }
        for rule in &of.rules {
            let state = &mut states[rule.state.start - learnt..rule.state.end - learnt];
            rule.rule.observe(&rule.tick(tick, inputs), state);
        }
        let is_delta = |(_, shown): &(String, Shown)| matches!(shown, Shown::Delta);
        let delta: &mut [Real] = match of.shown.iter().position(is_delta) {
            Some(index) => io.outputs.get_mut(index + 1),
            None => &mut [],
        };
        let mut finite = true;
        if tick.learning == 0.0 {
            sources.apply(weights, later);
            delta.fill(0.0);
        } else {
            let before = |row: usize, weights: &[f64]| {
                if let Some(out) = later.get_mut(row) {
                    *out = sources.through(weights);
                }
            };
            finite = of.learn(weights, states, (tick, inputs), before, delta);
        }
        if !of.emits {
            io.outputs.get_mut(0).copy_from_slice(if later.is_empty() { output } else { later });
        }
        if !finite {
            let reason = "a weight is no longer a finite number; use a smaller learning rate";
            return Err(NodeFault { reason: reason.into() });
        }
        of.show(all, &mut io.outputs);
        Ok(())
    }
}
