//! `table-4`: how often a planner succeeds with three structures of a state's pointer, over noise (section III.B).
//!
//! A trial is an episode of three steps from a fresh vocabulary of all atoms, states and actions. Whatever is
//! retrieved (a deep pointer, the role or object that it is unbound by, an item that it is compared
//! with) and whatever comes out of an unbinding has Gaussian noise of standard deviation sigma / sqrt(D) a
//! component added. The goal is judged satisfied or not by decoding its deep pointer part by part and comparing
//! with the world; if it is not, the action that causes it is looked up, its preconditions are unbound, and
//! the first that is not satisfied becomes the goal (sections II.E and II.F).
//!
//! The paper's decoder is matching pursuit over the one vocabulary: the greatest similarity to the normalised
//! query, from 0.3 up, names an item, which is subtracted. Ours compares the query with what every
//! structure that could have been stored would look like after the same unbinding, and takes the nearest (the most
//! likely under white noise); it is not told how many items there are. Both see the same noise: it is a
//! function of the trial, the step and what is retrieved how often.

use std::cell::RefCell;

use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use serde_json::{Value, json};

use super::{
    Axis, Cell, Experiment, Figure, Mark, Measure, Options, Outcome, Reading, Results, Series,
};
use crate::sim::{Real, Seed};
use crate::spa::{Algebra, Hrr, Workspace, dot, dots, norm, normalize};
use crate::task::error::TaskError;

const D: usize = 256;
/// The threshold of the paper's decoder.
const THRESHOLD: Real = 0.3;

// The vocabulary: two objects, two places, three states of assembly, roles, state and action names.
const OBJECTS: [usize; 2] = [0, 1];
const PLACES: [usize; 2] = [2, 3];
const ASSEMBLY: [usize; 3] = [4, 5, 6];
const ROLES: [usize; 3] = [7, 8, 9];
const EFFECT_OF: usize = 10;
const PRECONDITION: usize = 11;
const STATES: usize = 12;
const ACTIONS: usize = 17;
const ATOMS: usize = 20;

/// What is said of an object: which, where, and how far it is assembled, and the action that brought it
/// there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Fact {
    object: usize,
    place: usize,
    assembly: usize,
    cause: Option<usize>,
}

const fn fact(object: usize, place: usize, assembly: usize, cause: Option<usize>) -> Fact {
    Fact { object, place, assembly, cause }
}

/// NUT_ON_TABLE, BOLT_ON_TABLE, NUT_IN_JIG, BOLT_IN_JIG, BOLT_ASSEMBLED.
const FACTS: [Fact; 5] = [
    fact(0, 0, 0, None),
    fact(1, 0, 0, None),
    fact(0, 1, 1, Some(0)),
    fact(1, 1, 1, Some(1)),
    fact(1, 1, 2, Some(2)),
];
const GOAL: usize = 4;
/// Preconditions of PUT_NUT_IN_JIG, PUT_BOLT_IN_JIG, ASSEMBLE, and the state that each causes.
const NEEDS: [&[usize]; 3] = [&[0], &[1], &[2, 3]];
const CAUSES: [usize; 3] = [2, 3, 4];

/// How a state's deep pointer is put together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Structure {
    /// `object * (location + assembly)`.
    Compact = 1,
    /// A role for each part.
    Roles = 2,
    /// The first, and the action that causes it.
    Effect = 3,
}

const STRUCTURES: [Structure; 3] = [Structure::Compact, Structure::Roles, Structure::Effect];

/// Memory of a thread for transforms.
struct Tools {
    work: Workspace,
    inverse: Vec<Real>,
}

thread_local! {
    // A plan of transforms is as large as a trial; its contents never matter.
    static TOOLS: RefCell<Option<Tools>> = const { RefCell::new(None) };
}

fn with_tools<T>(call: impl FnOnce(&mut Tools) -> T) -> T {
    TOOLS.with_borrow_mut(|tools| {
        let new = || Tools { work: Hrr.scratch(D), inverse: vec![0.0; D] };
        call(tools.get_or_insert_with(new))
    })
}

type Vector = Vec<Real>;

fn bind(tools: &mut Tools, a: &[Real], b: &[Real]) -> Vector {
    let mut out = vec![0.0; D];
    Hrr.bind_into(a, b, &mut out, &mut tools.work);
    out
}

fn unbind(tools: &mut Tools, bound: &[Real], role: &[Real]) -> Vector {
    let mut inverse = std::mem::take(&mut tools.inverse);
    Hrr.inverse_into(role, &mut inverse);
    let out = bind(tools, bound, &inverse);
    tools.inverse = inverse;
    out
}

fn add(a: &mut [Real], b: &[Real]) {
    a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
}

/// A fresh vocabulary with the pointers put together from it.
struct World {
    structure: Structure,
    atoms: Vec<Vector>,
    /// The same, a row an atom.
    rows: Vec<Real>,
    states: Vec<Vector>,
    actions: Vec<Vector>,
}

impl World {
    fn draw<R: Rng>(tools: &mut Tools, structure: Structure, rng: &mut R) -> Self {
        let atoms: Vec<Vector> = (0..ATOMS)
            .map(|_| {
                let mut atom: Vector =
                    (0..D).map(|_| -> f32 { StandardNormal.sample(rng) }).collect();
                normalize(&mut atom);
                atom
            })
            .collect();
        let rows = atoms.concat();
        let mut world = Self { structure, atoms, rows, states: Vec::new(), actions: Vec::new() };
        let deep = |fact| world.compose(tools, &world.pairs(fact));
        let states = FACTS.iter().map(deep).collect();
        let needs = |needs: &&[usize]| world.compose(tools, &World::bound_needs(needs));
        let actions = NEEDS.iter().map(needs).collect();
        (world.states, world.actions) = (states, actions);
        world
    }

    /// The pairs of atoms that a state's deep pointer is the sum of.
    fn pairs(&self, fact: &Fact) -> Vec<[usize; 2]> {
        let parts = [OBJECTS[fact.object], PLACES[fact.place], ASSEMBLY[fact.assembly]];
        let mut pairs: Vec<[usize; 2]> = match self.structure {
            Structure::Roles => ROLES.iter().zip(parts).map(|(role, part)| [*role, part]).collect(),
            _ => vec![[parts[0], parts[1]], [parts[0], parts[2]]],
        };
        if let (Structure::Effect, Some(cause)) = (self.structure, fact.cause) {
            pairs.push([EFFECT_OF, ACTIONS + cause]);
        }
        pairs
    }

    /// The normalised sum of bound pairs.
    fn compose(&self, tools: &mut Tools, pairs: &[[usize; 2]]) -> Vector {
        let mut deep = vec![0.0; D];
        for [a, b] in pairs {
            add(&mut deep, &bind(tools, &self.atoms[*a], &self.atoms[*b]));
        }
        normalize(&mut deep);
        deep
    }

    /// The pairs that an action's deep pointer is the sum of.
    fn bound_needs(states: &[usize]) -> Vec<[usize; 2]> {
        states.iter().map(|state| [PRECONDITION, STATES + state]).collect()
    }

    /// By what a state's deep pointer is unbound, part by part.
    fn probes(&self) -> &'static [usize] {
        match self.structure {
            Structure::Compact => &[0, 1],
            Structure::Roles => &[7, 8, 9],
            Structure::Effect => &[0, 1, EFFECT_OF],
        }
    }

    /// Everything that could be said of an object in this structure.
    fn hypotheses(&self) -> Vec<Fact> {
        let causes: &[Option<usize>] = match self.structure {
            Structure::Effect => &[None, Some(0), Some(1), Some(2)],
            _ => &[None],
        };
        let mut all = Vec::new();
        for object in 0..OBJECTS.len() {
            for place in 0..PLACES.len() {
                for assembly in 0..ASSEMBLY.len() {
                    all.extend(causes.iter().map(|cause| fact(object, place, assembly, *cause)));
                }
            }
        }
        all
    }
}

/// What is fetched or computed with noise; a number for each.
#[derive(Debug, Clone, Copy)]
enum Event {
    /// The deep pointer of a state or action.
    Deep(usize),
    /// The role or object by which it is unbound.
    Role(usize, usize),
    /// What comes out.
    Unbound(usize, usize),
    /// Items compared with that.
    Items(usize, usize),
}

/// Deep pointers by number: five states, then three actions.
const DEEPS: usize = 8;

impl Event {
    fn number(self) -> usize {
        match self {
            Self::Deep(deep) => deep,
            Self::Role(deep, probe) => DEEPS * (1 + probe) + deep,
            Self::Unbound(deep, probe) => DEEPS * (1 + ATOMS + probe) + deep,
            Self::Items(deep, probe) => DEEPS * (1 + 2 * ATOMS + probe) + deep,
        }
    }
}

/// Noise as a function of trial, step, event and how often it has happened.
struct Noise {
    seed: Seed,
    /// Standard deviation of a component.
    sd: Real,
    step: u64,
    times: Vec<u64>,
}

impl Noise {
    fn new(seed: Seed, sigma: f64) -> Self {
        let sd = (sigma / (D as f64).sqrt()) as Real;
        Self { seed, sd, step: 0, times: vec![0; DEEPS * (1 + 3 * ATOMS)] }
    }

    fn next_step(&mut self) {
        self.step += 1;
        self.times.fill(0);
    }

    fn rng(&mut self, event: Event) -> impl Rng + use<> {
        let number = event.number();
        self.times[number] += 1;
        let key = (self.step << 32) | (self.times[number] << 16) | number as u64;
        self.seed.derive_index("noise", key).rng()
    }

    fn onto(&mut self, event: Event, vector: &[Real]) -> Vector {
        if self.sd == 0.0 {
            return vector.to_vec();
        }
        let mut rng = self.rng(event);
        vector
            .iter()
            .map(|v| {
                let noise: f32 = StandardNormal.sample(&mut rng);
                v + self.sd * noise
            })
            .collect()
    }
}

/// Something that tells what is in a pointer.
trait Decoder {
    /// What a state's deep pointer says, from it unbound by each of the structure's probes.
    fn fact(
        &self,
        world: &World,
        unbound: &[Vector],
        noise: &mut dyn FnMut(usize, Real) -> Real,
    ) -> Option<Fact>;
    /// The states that an unbound action names.
    fn needs(
        &self,
        world: &World,
        unbound: &[Real],
        noise: &mut dyn FnMut(usize, Real) -> Real,
    ) -> Vec<usize>;
}

/// Matching pursuit with a fixed threshold.
struct Paper;

impl Paper {
    /// Items from the most similar down. `noise` gives the noise of a similarity, by the length of what is
    /// compared.
    fn items(
        &self,
        world: &World,
        query: &[Real],
        noise: &mut dyn FnMut(usize, Real) -> Real,
        part: usize,
    ) -> Vec<usize> {
        let mut rest = query.to_vec();
        normalize(&mut rest);
        let (mut found, mut similarities) = (Vec::new(), [0.0; ATOMS]);
        while found.len() < ATOMS {
            let length = norm(&rest);
            let (mut best, mut most) = (0, Real::NEG_INFINITY);
            dots(&world.rows, &rest, &mut similarities);
            for (item, similarity) in similarities.iter().enumerate() {
                let similarity = similarity + noise(part, length);
                if similarity > most {
                    (best, most) = (item, similarity);
                }
            }
            if most < THRESHOLD || found.contains(&best) {
                break;
            }
            found.push(best);
            let along = dot(&world.atoms[best], &rest);
            rest.iter_mut().zip(&world.atoms[best]).for_each(|(r, a)| *r -= along * a);
        }
        found.sort_unstable();
        found
    }
}

/// The only item of a list that is one of `choices`, as its place there.
fn only(items: &[usize], choices: &[usize]) -> Option<usize> {
    match items {
        [item] => choices.iter().position(|c| c == item),
        _ => None,
    }
}

impl Decoder for Paper {
    fn fact(
        &self,
        world: &World,
        unbound: &[Vector],
        noise: &mut dyn FnMut(usize, Real) -> Real,
    ) -> Option<Fact> {
        let parts: Vec<Vec<usize>> = unbound
            .iter()
            .enumerate()
            .map(|(part, query)| self.items(world, query, noise, part))
            .collect();
        if world.structure == Structure::Roles {
            return Some(fact(
                only(&parts[0], &OBJECTS)?,
                only(&parts[1], &PLACES)?,
                only(&parts[2], &ASSEMBLY)?,
                None,
            ));
        }
        let cause = match parts.get(2) {
            None => None,
            Some(items) if items.is_empty() => None,
            Some(items) => Some(only(items, &[ACTIONS, ACTIONS + 1, ACTIONS + 2])?),
        };
        // The object by which the pointer comes apart into a place and a state of assembly.
        (0..OBJECTS.len()).find_map(|object| match parts[object].as_slice() {
            [place, assembly] => Some(fact(
                object,
                PLACES.iter().position(|p| p == place)?,
                ASSEMBLY.iter().position(|a| a == assembly)?,
                cause,
            )),
            _ => None,
        })
    }

    fn needs(
        &self,
        world: &World,
        unbound: &[Real],
        noise: &mut dyn FnMut(usize, Real) -> Real,
    ) -> Vec<usize> {
        let items = self.items(world, unbound, noise, 0);
        items.iter().filter_map(|i| (STATES..ACTIONS).position(|state| state == *i)).collect()
    }
}

/// The most likely of all that could have been stored.
struct Nearest {
    facts: Vec<Fact>,
    /// For each probe.
    fact_templates: Vec<Templates>,
    /// For each set of states, as bits.
    need_templates: Templates,
}

/// What normalised sums of pairs look like when they have been unbound by a role.
struct Templates {
    /// Pairs of atoms, bound and unbound again, a row each.
    rows: Vec<Real>,
    pairs: usize,
    /// For each sum its pairs, one over its length before it was normalised, and the square of what it has
    /// once it is unbound.
    sums: Vec<(Vec<usize>, Real, Real)>,
}

impl Templates {
    fn new(tools: &mut Tools, world: &World, sums: &[Vec<[usize; 2]>], role: usize) -> Self {
        let role = &world.atoms[role];
        let mut known: Vec<[usize; 2]> = sums.concat();
        known.sort_unstable();
        known.dedup();
        let bound: Vec<Vector> =
            known.iter().map(|[a, b]| bind(tools, &world.atoms[*a], &world.atoms[*b])).collect();
        let unbound: Vec<Vector> = bound.iter().map(|pair| unbind(tools, pair, role)).collect();
        let products = |one: &[Vector], other: &[Vector]| -> Vec<Vec<Real>> {
            one.iter().map(|a| other.iter().map(|b| dot(a, b)).collect()).collect()
        };
        let (lengths, squares) = (products(&bound, &bound), products(&unbound, &unbound));
        let sums = sums
            .iter()
            .map(|sum| {
                let pairs: Vec<usize> =
                    sum.iter().filter_map(|pair| known.iter().position(|k| k == pair)).collect();
                let of = |matrix: &[Vec<Real>]| -> Real {
                    pairs.iter().flat_map(|i| pairs.iter().map(|j| matrix[*i][*j])).sum()
                };
                let length = of(&lengths).sqrt();
                let scale = if length > 0.0 { 1.0 / length } else { 0.0 };
                let square = scale * scale * of(&squares);
                (pairs, scale, square)
            })
            .collect();
        Self { rows: unbound.concat(), pairs: known.len(), sums }
    }

    /// Adds for each sum twice its likelihood, but for what all share. Every pair is retrieved once, as
    /// noisily as any item.
    fn add_likelihoods(
        &self,
        query: &[Real],
        mut noise: impl FnMut(Real) -> Real,
        out: &mut [Real],
    ) {
        let mut products = vec![0.0; self.pairs];
        dots(&self.rows, query, &mut products);
        let length = norm(query);
        products.iter_mut().for_each(|product| *product += noise(length));
        for (out, (pairs, scale, square)) in out.iter_mut().zip(&self.sums) {
            let product: Real = pairs.iter().map(|pair| products[*pair]).sum();
            *out += 2.0 * scale * product - square;
        }
    }
}

/// The place of the greatest number.
fn greatest(of: &[Real]) -> usize {
    (0..of.len()).reduce(|best, i| if of[i] > of[best] { i } else { best }).unwrap_or(0)
}

impl Nearest {
    fn new(tools: &mut Tools, world: &World) -> Self {
        let facts = world.hypotheses();
        let of_facts: Vec<Vec<[usize; 2]>> = facts.iter().map(|fact| world.pairs(fact)).collect();
        let fact_templates = world
            .probes()
            .iter()
            .map(|probe| Templates::new(tools, world, &of_facts, *probe))
            .collect();
        let of_sets: Vec<Vec<[usize; 2]>> = (0..1usize << FACTS.len())
            .map(|set| {
                let states: Vec<usize> =
                    (0..FACTS.len()).filter(|state| set >> state & 1 == 1).collect();
                World::bound_needs(&states)
            })
            .collect();
        let need_templates = Templates::new(tools, world, &of_sets, PRECONDITION);
        Self { facts, fact_templates, need_templates }
    }
}

impl Decoder for Nearest {
    fn fact(
        &self,
        _world: &World,
        unbound: &[Vector],
        noise: &mut dyn FnMut(usize, Real) -> Real,
    ) -> Option<Fact> {
        let mut scores = vec![0.0; self.facts.len()];
        for (part, (templates, query)) in self.fact_templates.iter().zip(unbound).enumerate() {
            templates.add_likelihoods(query, |length| noise(part, length), &mut scores);
        }
        self.facts.get(greatest(&scores)).copied()
    }

    fn needs(
        &self,
        _world: &World,
        unbound: &[Real],
        noise: &mut dyn FnMut(usize, Real) -> Real,
    ) -> Vec<usize> {
        let mut scores = vec![0.0; 1 << FACTS.len()];
        self.need_templates.add_likelihoods(unbound, |length| noise(0, length), &mut scores);
        let best = greatest(&scores);
        (0..FACTS.len()).filter(|state| best >> state & 1 == 1).collect()
    }
}

/// An episode: what is there, and what is done to it.
struct Episode<'a> {
    world: &'a World,
    decoder: &'a dyn Decoder,
    noise: Noise,
    /// What holds of the nut and of the bolt.
    things: [Fact; 2],
}

impl Episode<'_> {
    /// A deep pointer as it is retrieved, unbound by what is retrieved of the probes.
    fn unbound(&mut self, tools: &mut Tools, deep: usize, probes: &[usize]) -> Vec<Vector> {
        let pointer =
            self.world.states.get(deep).unwrap_or_else(|| &self.world.actions[deep - FACTS.len()]);
        let retrieved = self.noise.onto(Event::Deep(deep), pointer);
        probes
            .iter()
            .map(|probe| {
                let role = self.noise.onto(Event::Role(deep, *probe), &self.world.atoms[*probe]);
                let out = unbind(tools, &retrieved, &role);
                self.noise.onto(Event::Unbound(deep, *probe), &out)
            })
            .collect()
    }

    /// The noise of a comparison: an item's noise along a query of some length.
    fn comparing<T>(
        &mut self,
        deep: usize,
        decode: impl FnOnce(&dyn Decoder, &World, &mut dyn FnMut(usize, Real) -> Real) -> T,
    ) -> T {
        let sd = self.noise.sd;
        let mut streams: Vec<_> =
            (0..3).map(|part| self.noise.rng(Event::Items(deep, part))).collect();
        decode(self.decoder, self.world, &mut |part, length| {
            let noise: f32 = StandardNormal.sample(&mut streams[part]);
            sd * length * noise
        })
    }

    fn satisfied(&mut self, tools: &mut Tools, state: usize) -> bool {
        let unbound = self.unbound(tools, state, self.world.probes());
        let said =
            self.comparing(state, |decoder, world, noise| decoder.fact(world, &unbound, noise));
        let structure = self.world.structure;
        said.is_some_and(|said| {
            self.things.iter().any(|thing| match structure {
                Structure::Effect => *thing == said,
                _ => Fact { cause: None, ..*thing } == said,
            })
        })
    }

    /// The action that the planner takes, if it comes to one.
    fn decide(&mut self, tools: &mut Tools) -> Option<usize> {
        let mut goal = GOAL;
        for _ in 0..FACTS.len() {
            if self.satisfied(tools, goal) {
                return None;
            }
            let action = CAUSES.iter().position(|caused| *caused == goal)?;
            let deep = FACTS.len() + action;
            let unbound = self.unbound(tools, deep, &[PRECONDITION]);
            let needs = self
                .comparing(deep, |decoder, world, noise| decoder.needs(world, &unbound[0], noise));
            match needs.iter().find(|state| !self.satisfied(tools, **state)) {
                None => return Some(action),
                Some(open) => goal = *open,
            }
        }
        None
    }

    /// Whether three right actions follow one another.
    fn succeeds(&mut self, tools: &mut Tools) -> bool {
        for _ in 0..3 {
            let Some(action) = self.decide(tools) else { return false };
            if !NEEDS[action].iter().all(|state| self.things.contains(&FACTS[*state])) {
                return false;
            }
            let effect = FACTS[CAUSES[action]];
            self.things[effect.object] = effect;
            self.noise.next_step();
        }
        true
    }
}

/// One episode with each decoder, under the same noise.
fn episodes(
    structure: Structure,
    sigma: f64,
    seed: Seed,
    decoders: [bool; 2],
) -> [Option<bool>; 2] {
    with_tools(|tools| {
        let world = World::draw(tools, structure, &mut seed.derive("", "vocabulary").rng());
        let run = |tools: &mut Tools, decoder: &dyn Decoder| {
            let noise = Noise::new(seed, sigma);
            let things = [FACTS[0], FACTS[1]];
            Episode { world: &world, decoder, noise, things }.succeeds(tools)
        };
        let paper = decoders[0].then(|| run(tools, &Paper));
        let best = decoders[1].then(|| {
            let nearest = Nearest::new(tools, &world);
            run(tools, &nearest)
        });
        [paper, best]
    })
}

/// The experiment: structures by noise, with one or both decoders.
pub(super) struct Structures {
    name: &'static str,
    sigmas: Vec<f64>,
    decoders: [bool; 2],
    trials: u64,
}

impl Structures {
    /// Table IV.
    pub fn new(options: &Options) -> Self {
        Self {
            name: "table-4",
            sigmas: vec![0.5, 0.4, 0.3, 0.2, 0.1],
            decoders: [true, true],
            trials: options.trials.unwrap_or(1_500),
        }
    }

    /// Our decoder, on to where it fails.
    pub fn beyond(options: &Options) -> Self {
        Self {
            name: "table-4-beyond",
            sigmas: (1..=8).map(|i| 0.25 * f64::from(i)).collect(),
            decoders: [false, true],
            trials: options.trials.unwrap_or(2_000),
        }
    }

    fn cell(&self, cell: usize) -> (Structure, f64) {
        (STRUCTURES[cell / self.sigmas.len()], self.sigmas[cell % self.sigmas.len()])
    }
}

const DECODERS: [&str; 2] = ["paper", "best"];

impl Experiment for Structures {
    fn name(&self) -> &'static str {
        self.name
    }

    fn question(&self) -> &'static str {
        "How often do three right actions follow one another, by structure of the states' pointers and noise?"
    }

    fn settings(&self) -> Value {
        json!({"dimensions": D, "atoms": ATOMS, "threshold_of_paper": 0.3})
    }

    fn cells(&self) -> Vec<Cell> {
        (0..STRUCTURES.len() * self.sigmas.len())
            .map(|cell| {
                let (structure, sigma) = self.cell(cell);
                let readings = (0..2)
                    .filter(|d| self.decoders[*d])
                    .map(|d| Reading::new(Measure::Rate, json!({"decoder": DECODERS[d]})))
                    .collect();
                let settings = json!({"structure": structure as u64, "sigma": sigma});
                Cell::new(settings, self.trials, readings)
            })
            .collect()
    }

    fn trial(&self, cell: usize, seed: Seed) -> Result<Outcome, TaskError> {
        let (structure, sigma) = self.cell(cell);
        let mut outcome = [f64::NAN; super::WIDTH];
        let results = episodes(structure, sigma, seed, self.decoders);
        for (out, result) in outcome.iter_mut().zip(results.into_iter().flatten()) {
            *out = if result { 1.0 } else { 0.0 };
        }
        Ok(outcome)
    }

    fn figure(&self, results: &Results) -> Option<Figure> {
        let mut series = Vec::new();
        for decoder in DECODERS {
            for structure in STRUCTURES {
                let of = |row: &&super::Row| {
                    row.is("decoder", &json!(decoder))
                        && row.is("structure", &json!(structure as u64))
                };
                let marks: Vec<Mark> = results
                    .rows
                    .iter()
                    .filter(of)
                    .filter_map(|row| {
                        let y = 100.0 * row.statistic.value();
                        let bar = Some(row.statistic.interval95().map(|v| 100.0 * v));
                        Some(Mark { x: row.number("sigma")?, y, bar })
                    })
                    .collect();
                if !marks.is_empty() {
                    let name = format!("structure {}, {decoder} decoder", structure as u64);
                    series.push(Series { name, marks, joined: true, dashed: false });
                }
            }
        }
        Some(Figure {
            title: "Episodes of three right actions".into(),
            x: Axis::new("noise sigma (length of the noise of a pointer of length 1)"),
            y: Axis::from_to("success (%)", 0.0, 102.0),
            series,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rate(structure: Structure, sigma: f64, trials: u64) -> [f64; 2] {
        let mut good = [0.0; 2];
        for trial in 0..trials {
            let seed = Seed::new(1).derive_index("trial", trial);
            for (good, result) in good.iter_mut().zip(episodes(structure, sigma, seed, [true; 2])) {
                *good += if result == Some(true) { 1.0 } else { 0.0 };
            }
        }
        good.map(|g| g / trials as f64)
    }

    #[test]
    fn without_noise_our_decoder_never_fails_and_with_much_both_do() {
        for structure in STRUCTURES {
            let [paper, best] = rate(structure, 0.0, 60);
            assert!(paper > 0.9 && best == 1.0, "{structure:?}: {paper} {best}");
            let [paper, best] = rate(structure, 4.0, 40);
            assert!(paper < 0.2 && best < 0.6, "{structure:?}: {paper} {best}");
        }
    }

    #[test]
    fn noise_of_zero_is_no_noise() {
        let mut noise = Noise::new(Seed::new(3), 0.0);
        let vector = vec![0.25; D];
        assert_eq!(noise.onto(Event::Deep(2), &vector), vector);
        let mut noise = Noise::new(Seed::new(3), 0.5);
        let noisy = noise.onto(Event::Deep(2), &vector);
        let length = norm(&noisy.iter().zip(&vector).map(|(a, b)| a - b).collect::<Vec<_>>());
        // Its length is sigma, give or take a tenth.
        assert!((length - 0.5).abs() < 0.1, "{length}");
    }

    #[test]
    fn the_same_event_has_the_same_noise_and_its_repetition_another() {
        let vector = vec![0.0; D];
        let (mut a, mut b) = (Noise::new(Seed::new(3), 0.5), Noise::new(Seed::new(3), 0.5));
        // Other events between do not matter.
        b.onto(Event::Role(1, 7), &vector);
        let first = a.onto(Event::Deep(2), &vector);
        assert_eq!(first, b.onto(Event::Deep(2), &vector));
        assert_ne!(first, a.onto(Event::Deep(2), &vector));
        a.next_step();
        assert_ne!(first, a.onto(Event::Deep(2), &vector));
    }
}
