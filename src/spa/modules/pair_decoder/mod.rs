//! Decodes all fillers of a sum of role-filler pairs at once, in a recurrent network.
//!
//! Every item of every role has a small population, which represents the weight of the item: the degree to which the
//! network takes the item for the filler of the role. Let p be the item bound to its role, and e the sum of all bound
//! items times their weights. The population gets the evidence `p . (sum - e) + weight |p|^2`, the similarity of p to
//! what all other items leave of the sum. It is silent below a level and raises its weight in proportion above it. A
//! synapse of 30 ms averages the weights and feeds them back.
//!
//! Such networks of local competition solve sparse coding problems (Rozell et al., "Sparse coding via thresholding and
//! local competition in neural circuits", 2008). With the right weights, nothing of the sum is left, and each filler
//! supports itself. The gain above 1 makes the network decide between rivals instead of mixing them. As in multistage
//! detection (Divsalar, Simon and Raphaeli 1998), uncertain items have small weights, so the network subtracts little
//! while it knows little.
//!
//! The weights of a role should add up to 1. A population per role represents the excess and inhibits all items of the
//! role. Without it the network decodes a first sum almost as well, but after a change of the sum it often keeps the
//! old fillers beside the new ones.

use super::FEED_FORWARD;
use crate::neurons::{Layers, Map};
use crate::sim::Ports;
use crate::sim::{
    Add, EmitIo, Fingerprint, In, InputSpec, Module, Node, Out, OutputSpec, Pointer, PortDecl,
    Real, Scope, ScratchSpec, Space, StepCx, Synapse, Vector, VocabTag,
};
use crate::spa::algebra::norm;
use crate::spa::error::VocabError;
use crate::spa::item_memory::dots;
use crate::spa::vocabulary::Vocabulary;

/// Evidence below which an item has no weight. The evidence of a filler approaches 1.
const LEVEL: Real = 0.3;
/// Weight per evidence above the level. Greater gains decide faster and are wrong more often after a change.
const GAIN: Real = 2.0;
/// Evidence up to which neurons represent the weight.
const REACH: Real = LEVEL + 1.2 / GAIN;
/// Number of neurons per item, as a fraction of those of a function.
const SHARE: Real = 0.16;
/// Recurrent synapse, which averages the weights. 20 to 50 ms decode equally well.
const AVERAGING: Synapse = Synapse::lowpass_ms(30);
/// Inhibition per weight in excess of 1.
const INHIBITION: Real = 4.0;
/// Greatest sum of the weights of a role that neurons represent.
const MAX_TOTAL: Real = 3.0;
/// Magnitude below which a weight is taken for 0. A weight decays to this within 12 time constants.
const NEGLIGIBLE: Real = 1e-5;

/// Decodes all fillers of a sum `ROLE1 * FILLER1 + ROLE2 * FILLER2 + ...` at once.
///
/// The roles are known. Every filler is one of the items, which all roles share. A role that the sum lacks gets no
/// weight. [`Linear::unbind`](crate::spa::Linear::unbind) with a cleanup reads one role and takes all other pairs for noise;
/// this module explains all pairs together and reads more of them.
///
/// | port | kind | what it is |
/// |---|---|---|
/// | `input` | pointer | the sum |
/// | `weights` | one vector per role | weight of each item, about 0 to 1; the greatest marks the filler |
/// | `fillers` | one pointer per role | sum of the items times their weights |
///
/// Right fillers of 16 pairs of 256 random items and random roles in 128 dimensions, after 500 ms, in 12 sums:
///
/// | reader | right |
/// |---|---|
/// | this module in direct mode, without [cancellation](Self::cancellation): each role alone | 102 of 192 |
/// | this module in direct mode | 192 of 192 |
/// | this module in spikes, with the sum in a spiking [`State`](crate::spa::State) | 180 of 192 |
///
/// [`PairDecoder`](crate::spa::PairDecoder) does the same outside a graph.
///
/// # Delay
/// The outputs need no synapse. Most fillers are read after 100 ms, the rest within 300 ms, because decisions about one
/// role change the evidence for the others. All of these times are proportional to the
/// recurrent synapse, which has 30 ms.
///
/// # Cost
/// Roles x items x 16 neurons, and 100 neurons per role, by the default [`Tuning`](crate::neurons::Tuning). Few items
/// have evidence above the level, and the rest is silent and costs almost nothing. The network of the table has 67,136
/// neurons, and its state 6,400. Otherwise a tick costs roles x items x dimensions products. The bound items take 4 bytes
/// per product.
///
/// # Limits
/// - Above a number of pairs that depends on the dimensions and items, decoding breaks down.
/// - The network can settle on wrong fillers, most often when the sum changes to another sum at once. Let the input be
///   zero for 100 ms in between.
///
/// ```
/// use symbolt::prelude::*;
/// use symbolt::spa::DecodePairs;
///
/// # struct Things;
/// # impl VocabTag for Things { const NAME: &'static str = "things"; }
/// let things = VocabularyBuilder::<Things>::new(128, Seed::new(1))
///     .pointers(["COLOUR", "SHAPE", "RED", "BLUE", "CIRCLE"])
///     .build()?;
/// let scene = things.parse("COLOUR * BLUE + SHAPE * CIRCLE")?;
/// let mut graph = GraphBuilder::new();
/// let scene = graph.add("scene", Constant::pointer(things.space(), &scene));
/// let decode = DecodePairs::new(&things, ["COLOUR", "SHAPE"], ["RED", "BLUE", "CIRCLE"])?;
/// let decode = graph.add("decode", decode);
/// graph.connect(&scene, &decode.input, Synapse::None);
/// let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), SimDuration::from_millis(300))?;
/// assert!(cosine(&sim.value(&decode.fillers[0]), &things.get("BLUE")?) > 0.99);
/// assert!(cosine(&sim.value(&decode.fillers[1]), &things.get("CIRCLE")?) > 0.99);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct DecodePairs<V: VocabTag> {
    space: Space<V>,
    items: Vec<Real>,
    /// Each item bound to each role, role by role.
    pairs: Vec<Real>,
    scale: Real,
    cancellation: Real,
}

/// Ports of a [`DecodePairs`].
pub struct DecodePairsPorts<V: VocabTag> {
    /// Sum of the pairs; takes one connection.
    pub input: In<Pointer<V>>,
    /// For each role, the weights of the items, in the order of the roles and items.
    pub weights: Vec<Out<Vector>>,
    /// For each role, the sum of the items times their weights: nearly the filler once it is found.
    pub fillers: Vec<Out<Pointer<V>>>,
}

impl<V: VocabTag> DecodePairs<V> {
    /// Makes a decoder of sums of pairs of `roles` and `items`, expressions over `vocabulary`. It binds by the algebra
    /// of the vocabulary, with the role on the left.
    ///
    /// Costs one binding per role and item.
    ///
    /// # Errors
    /// As for [`Vocabulary::parse`] if an expression is invalid or a name unknown; [`VocabError::BadVector`] if there
    /// are no roles or no items.
    pub fn new<'n>(
        vocabulary: &Vocabulary<V>,
        roles: impl IntoIterator<Item = &'n str>,
        items: impl IntoIterator<Item = &'n str>,
    ) -> Result<Self, VocabError> {
        let (algebra, dim) = (vocabulary.algebra(), vocabulary.dim());
        let roles = rows(vocabulary, roles, "roles")?;
        let items = rows(vocabulary, items, "items")?;
        let mut work = algebra.scratch(dim);
        let mut pairs = vec![0.0; roles.len() / dim * items.len()];
        for (role, pairs) in roles.chunks_exact(dim).zip(pairs.chunks_exact_mut(items.len())) {
            for (item, pair) in items.chunks_exact(dim).zip(pairs.chunks_exact_mut(dim)) {
                algebra.bind_into(role, item, pair, &mut work);
            }
        }
        Ok(Self { space: vocabulary.space().clone(), items, pairs, scale: 1.0, cancellation: 1.0 })
    }

    /// Sets the weight of each pair in the sum (default 1; errors of up to 20% do little harm).
    ///
    /// A sum of K pairs has a norm of about `sqrt(K)`. For a population of radius 1, multiply the sum by `1 / sqrt(K)`,
    /// and tell the decoder by this method. Anything but a finite number above 0 is a fault when the graph is built.
    pub fn scale(mut self, weight: Real) -> Self {
        self.scale = weight;
        self
    }

    /// Sets the share of the other pairs' expected values that is subtracted from the sum, 0 to 1 (default 1).
    ///
    /// This is for ablations: with 0 each role is read alone, no better than by linear read-out. Any other number is a
    /// fault when the graph is built.
    pub fn cancellation(mut self, share: Real) -> Self {
        self.cancellation = share;
        self
    }
}

/// Returns the vectors of `expressions`, one after another. `what` names them in errors.
fn rows<'n, V: VocabTag>(
    vocabulary: &Vocabulary<V>,
    expressions: impl IntoIterator<Item = &'n str>,
    what: &str,
) -> Result<Vec<Real>, VocabError> {
    let mut rows = Vec::new();
    for expression in expressions {
        rows.extend_from_slice(&vocabulary.parse(expression)?);
    }
    if rows.is_empty() {
        let reason = format!("there are no {what}; expected at least one");
        return Err(VocabError::BadVector { name: what.into(), reason });
    }
    Ok(rows)
}

impl<V: VocabTag> Module for DecodePairs<V> {
    type Ports = DecodePairsPorts<V>;

    fn expand(self, scope: &mut Scope<'_>) -> DecodePairsPorts<V> {
        let Self { space, items, pairs, scale, cancellation } = self;
        let (roles, count) = (pairs.len() / items.len(), items.len() / space.width());
        let lengths = pairs.chunks_exact(space.width()).map(|pair| norm(pair).powi(2)).collect();
        let compare = Compare { space: space.clone(), count, pairs, lengths, scale, cancellation };
        let compare = scope.node("compare", compare);
        let weight = |evidence: Real| (GAIN * (evidence - LEVEL)).clamp(0.0, 1.0);
        let layer = Map::each(roles * count, weight).above(LEVEL).radius(REACH).size(SHARE);
        let chosen: Ports<Vector> = scope.map("items", layer);
        let weights = scope.add("weights", Add::vector(roles * count));
        let read = scope.node("read", Read { space, roles, items });
        let excess = Map::each(roles, |total| INHIBITION * (total - 1.0).max(0.0));
        let excess: Ports<Vector> = scope.map("excess", excess.above(1.0).radius(MAX_TOTAL));
        scope.connect::<Vector>(&compare.output("out"), &chosen.input, Synapse::None);
        scope.connect(&chosen.output, &weights.input, AVERAGING);
        scope.connect(&weights.output, &compare.input("weights"), Synapse::None);
        scope.connect(&weights.output, &read.input("weights"), Synapse::None);
        scope.connect(&read.output("totals"), &excess.input, Synapse::None);
        scope.connect(&excess.output, &compare.input("inhibit"), FEED_FORWARD);
        let weights = |role| read.output(&format!("weights{role}"));
        let fillers = |role| read.output(&format!("filler{role}"));
        DecodePairsPorts {
            input: scope.input("input", compare.input("sum")),
            weights: (0..roles)
                .map(|role| scope.output(&format!("weights[{role}]"), weights(role)))
                .collect(),
            fillers: (0..roles)
                .map(|role| scope.output(&format!("fillers[{role}]"), fillers(role)))
                .collect(),
        }
    }
}

/// Computes the evidence for every item of every role, less the inhibition of the role. Linear, without a tick.
struct Compare<V: VocabTag> {
    space: Space<V>,
    /// Number of items.
    count: usize,
    pairs: Vec<Real>,
    /// Squared norms of the pairs.
    lengths: Vec<Real>,
    scale: Real,
    cancellation: Real,
}

impl<V: VocabTag> Node for Compare<V> {
    fn declare(&self, ports: &mut PortDecl) {
        if !(self.scale.is_finite() && self.scale > 0.0) {
            let scale = self.scale;
            ports.fault(format!("the scale is {scale}; expected a finite number above 0"));
        }
        if !(0.0..=1.0).contains(&self.cancellation) {
            let share = self.cancellation;
            ports.fault(format!("the cancellation is {share}; expected a number from 0 to 1"));
        }
        let all = self.lengths.len();
        ports
            .input("sum", InputSpec::pointer(&self.space))
            .input("weights", InputSpec::vector(all))
            .input("inhibit", InputSpec::vector(all / self.count))
            .output("out", OutputSpec::vector(all))
            .scratch(ScratchSpec { reals: self.space.width(), ..ScratchSpec::default() });
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.reals(&self.pairs).reals(&[self.scale, self.cancellation]);
    }

    fn emit(&self, _cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
        let (sum, weights, inhibit) = (io.inputs.get(0), io.inputs.get(1), io.inputs.get(2));
        let rest = &mut *io.scratch.reals;
        for (rest, sum) in rest.iter_mut().zip(sum) {
            *rest = sum / self.scale;
        }
        add_weighted(weights, &self.pairs, -self.cancellation, rest);
        let out = io.outputs.get_mut(0);
        dots(&self.pairs, rest, out);
        for ((out, weight), length) in out.iter_mut().zip(weights).zip(&self.lengths) {
            *out += self.cancellation * weight * length;
        }
        for (out, inhibit) in out.chunks_exact_mut(self.count).zip(inhibit) {
            out.iter_mut().for_each(|out| *out -= inhibit);
        }
    }
}

/// Adds the rows of `matrix`, times their weights and `factor`, to `out`. Skips rows of negligible weight.
fn add_weighted(weights: &[Real], matrix: &[Real], factor: Real, out: &mut [Real]) {
    for (weight, row) in weights.iter().zip(matrix.chunks_exact(out.len())) {
        if weight.abs() > NEGLIGIBLE {
            let weight = factor * weight;
            out.iter_mut().zip(row).for_each(|(out, v)| *out += weight * v);
        }
    }
}

/// Splits the weights by role. Computes their sums and the fillers. Linear, without a tick.
struct Read<V: VocabTag> {
    space: Space<V>,
    roles: usize,
    items: Vec<Real>,
}

impl<V: VocabTag> Node for Read<V> {
    fn declare(&self, ports: &mut PortDecl) {
        let count = self.items.len() / self.space.width();
        ports
            .input("weights", InputSpec::vector(self.roles * count))
            .output("totals", OutputSpec::vector(self.roles));
        for role in 0..self.roles {
            ports
                .output(&format!("weights{role}"), OutputSpec::vector(count))
                .output(&format!("filler{role}"), OutputSpec::pointer(&self.space));
        }
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.reals(&self.items);
    }

    fn emit(&self, _cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
        let count = self.items.len() / self.space.width();
        for (role, weights) in io.inputs.get(0).chunks_exact(count).enumerate() {
            io.outputs.get_mut(0)[role] = weights.iter().sum();
            io.outputs.get_mut(1 + 2 * role).copy_from_slice(weights);
            let filler = io.outputs.get_mut(2 + 2 * role);
            filler.fill(0.0);
            add_weighted(weights, &self.items, 1.0, filler);
        }
    }
}
