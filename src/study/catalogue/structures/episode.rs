//! An episode: a world, a goal, and a planner that has states and actions only as noisy pointers.

use rand_distr::{Distribution, StandardNormal};

use super::decoders::{Decoder, Nearest, Paper};
use super::noise::{Noise, Source};
use super::world::{
    CAUSES, FACTS, Fact, GOAL, NEEDS, PRECONDITION, Structure, Tools, Vector, World, unbind,
    with_tools,
};
use crate::sim::{Real, Seed};

/// An episode of three steps.
pub(super) struct Episode<'a> {
    pub(super) world: &'a World,
    pub(super) decoder: &'a dyn Decoder,
    pub(super) noise: Noise,
    /// Current state of the nut and of the bolt.
    pub(super) things: [Fact; 2],
}

impl Episode<'_> {
    /// Retrieves a deep pointer and unbinds it by each of the probes. All pointers are retrieved with noise.
    pub(super) fn unbound(
        &mut self,
        tools: &mut Tools,
        deep: usize,
        probes: &[usize],
    ) -> Vec<Vector> {
        let pointer =
            self.world.states.get(deep).unwrap_or_else(|| &self.world.actions[deep - FACTS.len()]);
        let retrieved = self.noise.onto(Source::Deep(deep), pointer);
        probes
            .iter()
            .map(|probe| {
                let role = self.noise.onto(Source::Role(deep, *probe), &self.world.atoms[*probe]);
                let out = unbind(tools, &retrieved, &role);
                self.noise.onto(Source::Unbound(deep, *probe), &out)
            })
            .collect()
    }

    /// Calls `decode` with a source of noise for its comparisons: the noise of an item along a query of given length.
    pub(super) fn comparing<T>(
        &mut self,
        deep: usize,
        decode: impl FnOnce(&dyn Decoder, &World, &mut dyn FnMut(usize, Real) -> Real) -> T,
    ) -> T {
        let sd = self.noise.sd;
        let mut streams: Vec<_> =
            (0..3).map(|part| self.noise.rng(Source::Items(deep, part))).collect();
        decode(self.decoder, self.world, &mut |part, length| {
            let noise: f32 = StandardNormal.sample(&mut streams[part]);
            sd * length * noise
        })
    }

    /// Returns whether a decoded state holds in the world.
    pub(super) fn satisfied(&mut self, tools: &mut Tools, state: usize) -> bool {
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

    /// Returns the action that the planner takes; `None` if it finds none.
    pub(super) fn decide(&mut self, tools: &mut Tools) -> Option<usize> {
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

    /// Returns whether the planner takes three right actions in a row.
    pub(super) fn succeeds(&mut self, tools: &mut Tools) -> bool {
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

/// Runs an episode with each of the given decoders, with the same noise. Returns whether each decoder succeeds.
pub(super) fn episodes(
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
