//! The demonstrator and the judge. Both look at the geometry of the scene alone.

use super::scene::{CUBE, CUP, FLOOR_M, HALF_M, HEIGHT_M, INNER_M};
use crate::robot::SkillReport;
use crate::task::robot::vector::sub;
use crate::task::scene::Scene;
use crate::task::skill::Target;
use crate::task::tasks::{Demonstrator, Judgement, Step};

/// Returns the upward component of the cup's axis, from its floor to its opening, if the cup stands on the table.
fn standing(scene: &Scene) -> Option<f64> {
    let cup = scene.body_frame(CUP)?;
    let up = cup.turn.apply([0.0, 0.0, 1.0])[2];
    let stands = (cup.position[2] - HEIGHT_M / 2.0).abs() < 2e-3 && up.abs() > 0.99;
    stands.then_some(up)
}

/// Returns whether the cube is within the cup's walls and below its rim.
fn is_filled(scene: &Scene) -> bool {
    let (Some(cup), Some(cube)) = (scene.body_frame(CUP), scene.body_frame(CUBE)) else {
        return false;
    };
    let [x, y, z] = sub(cube.position, cup.position);
    x.hypot(y) < INNER_M && z.abs() < HEIGHT_M / 2.0
}

/// Judges whether the cup stands upright with the cube in it.
pub(super) fn judge(scene: &Scene) -> Judgement {
    let upright = standing(scene).is_some_and(|up| up > 0.0);
    let filled = upright && is_filled(scene);
    let said = [(upright, "the cup stands upright"), (filled, "the cube is in the cup")];
    let achieved = said.into_iter().filter(|(holds, _)| *holds).map(|(_, said)| said.into());
    Judgement { solved: filled, achieved: achieved.collect() }
}

/// Turns the cup over in place, then puts the cube into it.
pub(super) struct Filler;

impl Demonstrator for Filler {
    fn next(&mut self, scene: &Scene, _so_far: &[SkillReport]) -> Option<Step> {
        let up = standing(scene)?;
        let [x, y, _] = scene.part(CUP)?.position;
        if up < 0.0 {
            return Some(Step { part: CUP, target: Target::upright([x, y, HEIGHT_M / 2.0]) });
        }
        let inside = Target::upright([x, y, FLOOR_M + HALF_M]);
        (!is_filled(scene)).then_some(Step { part: CUBE, target: inside })
    }
}
