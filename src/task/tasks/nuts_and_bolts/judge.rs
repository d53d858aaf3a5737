//! The judge: decides from the scene's geometry which parts are in the jig and whether a bolt is through a
//! nut.

use super::settings::{BOLT, NUT, NutsAndBolts};
use crate::robot::Pose;
use crate::robot::scene::Scene;
use crate::task::tasks::Judgement;

/// The parts in the jig, by their index in the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Assembly {
    /// The nut that lies flat in the pocket.
    pub nut_in_pocket: Option<usize>,
    /// The bolt that hangs in the hole.
    pub bolt_in_hole: Option<usize>,
    /// The bolt whose shaft is through the nut in the pocket and whose head rests on that nut.
    pub bolt_in_nut: Option<usize>,
}

/// Greatest deviation from the expected height, in metres.
const HEIGHT_M: f64 = 1e-3;

impl NutsAndBolts {
    /// Returns which parts are in the jig of a scene with these settings.
    pub fn assembly(&self, scene: &Scene) -> Assembly {
        let mut found = Assembly::default();
        let (part, jig) = (&self.part, &self.jig);
        let near = |pose: &Pose, at: [f64; 2], within: f64| {
            (pose.position[0] - at[0]).hypot(pose.position[1] - at[1]) <= within
        };
        let level = |pose: &Pose, z: f64| (pose.position[2] - z).abs() <= HEIGHT_M;
        let nut_z = jig.pocket_floor_m + part.nut_height_m / 2.0;
        let poses: Vec<(usize, Pose)> = scene
            .kinds()
            .enumerate()
            .filter_map(|(index, kind)| Some((kind, scene.part(index)?)))
            .collect();
        for (index, (kind, pose)) in poses.iter().enumerate() {
            let up = upright(pose);
            let flat = up.abs() > 0.99;
            // A nut's flats can come closer to the wall than its corners.
            let play = jig.pocket_clearance_m + 0.14 * part.across_flats_m / 2.0;
            if *kind == NUT && flat && level(pose, nut_z) && near(pose, jig.pocket, play) {
                found.nut_in_pocket = Some(index);
            }
            let play = 2.0 * jig.hole_clearance_m;
            let hangs = up > 0.99 && level(pose, jig.hole_top_m) && near(pose, jig.hole, play);
            if *kind == BOLT && hangs {
                found.bolt_in_hole = Some(index);
            }
        }
        if let Some(nut) = found.nut_in_pocket {
            let [x, y, _] = poses[nut].1.position;
            let on_nut = jig.pocket_floor_m + part.nut_height_m;
            let play = part.nut_hole_m / 0.866 - part.shaft_radius_m + 2e-4;
            found.bolt_in_nut = poses.iter().position(|(kind, pose)| {
                *kind == BOLT
                    && upright(pose) > 0.99
                    && level(pose, on_nut)
                    && near(pose, [x, y], play)
            });
        }
        found
    }
}

impl Assembly {
    /// Returns whether a bolt is through the nut in the pocket.
    pub fn is_assembled(&self) -> bool {
        self.bolt_in_nut.is_some()
    }

    /// Returns whether a part is in the jig.
    pub fn holds(&self, part: usize) -> bool {
        [self.nut_in_pocket, self.bolt_in_hole, self.bolt_in_nut].contains(&Some(part))
    }
}

impl From<Assembly> for Judgement {
    fn from(assembly: Assembly) -> Self {
        let said = [
            (assembly.nut_in_pocket, "is in the pocket"),
            (assembly.bolt_in_hole, "is in the hole"),
            (assembly.bolt_in_nut, "is through the nut"),
        ];
        let achieved = said
            .into_iter()
            .filter_map(|(part, what)| part.map(|part| format!("part {part} {what}")));
        Self { solved: assembly.is_assembled(), achieved: achieved.collect() }
    }
}

/// Returns the upward component of a part's axis: 1 upright, -1 upside down.
fn upright(pose: &Pose) -> f64 {
    let [x, y, _, _] = pose.orientation;
    1.0 - 2.0 * (x * x + y * y)
}
