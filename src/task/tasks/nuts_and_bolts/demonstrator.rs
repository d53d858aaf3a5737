//! The scripted demonstrator. It follows the three rules of the paper (section II.C):
//!
//! - If a nut is on the table and the pocket is empty, put the nut into the pocket.
//! - If a bolt is on the table and the hole is empty, put the bolt into the hole.
//! - If both are in the jig, put the bolt through the nut.
//!
//! Demonstrations alternate between nut first and bolt first. The seed draws which comes first.

use rand::RngExt;

use super::settings::{BOLT, NUT, NutsAndBolts};
use crate::robot::scene::Scene;
use crate::robot::skill::Target;
use crate::robot::{SkillOutcome, SkillReport};
use crate::sim::Seed;
use crate::task::tasks::{Demonstrator, Step};

/// The rules, applied in one demonstration.
pub(super) struct Rules {
    settings: NutsAndBolts,
    nut_first: bool,
}

impl Rules {
    pub(super) fn new(settings: &NutsAndBolts, seed: Seed, demo: usize) -> Self {
        let flip = seed.derive("demonstrator", "order").rng().random::<bool>();
        // Alternates from a drawn start, so that even two demonstrations show both orders.
        Self { settings: settings.clone(), nut_first: demo.is_multiple_of(2) == flip }
    }
}

impl Demonstrator for Rules {
    fn next(&mut self, scene: &Scene, so_far: &[SkillReport]) -> Option<Step> {
        let assembly = self.settings.assembly(scene);
        if assembly.is_assembled() {
            return None;
        }
        let NutsAndBolts { jig, part, .. } = &self.settings;
        let put = |part, [x, y]: [f64; 2], z| Step { part, target: Target::upright([x, y, z]) };
        if let (Some(nut), Some(bolt)) = (assembly.nut_in_pocket, assembly.bolt_in_hole) {
            let [x, y, _] = scene.part(nut)?.position;
            return Some(put(bolt, [x, y], jig.pocket_floor_m + part.nut_height_m));
        }
        // Leave a part that could not be taken and try another.
        let stuck = |part: usize| {
            so_far.iter().any(|r| r.part == part && r.outcome == SkillOutcome::Unreachable)
        };
        let free = |kind: usize| {
            let mut kinds = scene.kinds().enumerate();
            kinds.position(|(i, k)| k == kind && !stuck(i) && !assembly.holds(i))
        };
        let nut = assembly.nut_in_pocket.is_none().then(|| free(NUT)).flatten();
        let bolt = assembly.bolt_in_hole.is_none().then(|| free(BOLT)).flatten();
        let nut_z = jig.pocket_floor_m + part.nut_height_m / 2.0;
        let put_nut = nut.map(|nut| put(nut, jig.pocket, nut_z));
        let put_bolt = bolt.map(|bolt| put(bolt, jig.hole, jig.hole_top_m));
        if self.nut_first { put_nut.or(put_bolt) } else { put_bolt.or(put_nut) }
    }
}
