//! The demonstrator and the judge. Both look at the geometry of the scene alone.

use super::scene::{DRAWER, HALF_M, INSIDE_M, OPEN_M};
use crate::robot::SkillReport;
use crate::task::robot::vector::{add, scale, sub};
use crate::task::scene::Scene;
use crate::task::skill::Target;
use crate::task::tasks::{Demonstrator, Judgement, Step};

/// Greatest coordinate of a drawer that counts as closed, in metres.
const CLOSED_M: f64 = 4e-3;
/// Least coordinate of a drawer that counts as open, in metres.
const OPENED_M: f64 = 0.095;
/// Distance between the places of two blocks in the drawer, in metres.
const BESIDE_M: f64 = 0.044;

/// Returns a part's position in the frame of the drawer.
fn in_drawer(scene: &Scene, part: usize) -> Option<[f64; 3]> {
    let (drawer, part) = (scene.body_frame(DRAWER)?, scene.body_frame(part)?);
    let from = sub(part.position, drawer.position);
    let along = |axis: [f64; 3]| {
        let axis = drawer.turn.apply(axis);
        from.iter().zip(axis).map(|(a, b)| a * b).sum()
    };
    Some([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(along))
}

/// Returns whether a block lies in the drawer.
fn is_in(scene: &Scene, block: usize) -> bool {
    in_drawer(scene, block).is_some_and(|[x, y, z]| {
        x.abs() < INSIDE_M[0] && y.abs() < INSIDE_M[1] && (z - HALF_M).abs() < 3e-3
    })
}

fn slid(scene: &Scene) -> f64 {
    scene.slid_m(DRAWER).unwrap_or(0.0)
}

/// Judges whether every block is in the drawer and the drawer is closed.
pub(super) fn judge(scene: &Scene) -> Judgement {
    let closed = slid(scene) < CLOSED_M;
    let blocks = DRAWER + 1..scene.part_count();
    let inside: Vec<usize> = blocks.clone().filter(|block| is_in(scene, *block)).collect();
    let mut achieved: Vec<String> =
        inside.iter().map(|block| format!("part {block} is in the drawer")).collect();
    achieved.push(if closed { "the drawer is closed" } else { "the drawer is open" }.into());
    Judgement { solved: closed && inside.len() == blocks.len(), achieved }
}

/// Opens the drawer, fills it and closes it.
pub(super) struct Filler;

impl Demonstrator for Filler {
    fn next(&mut self, scene: &Scene, _so_far: &[SkillReport]) -> Option<Step> {
        let drawer = scene.body_frame(DRAWER)?;
        let slide = |to: f64| {
            let way = drawer.turn.apply([to - slid(scene), 0.0, 0.0]);
            Step { part: DRAWER, target: Target::anyhow(add(drawer.position, way)) }
        };
        let blocks: Vec<usize> = (DRAWER + 1..scene.part_count()).collect();
        let Some(block) = blocks.iter().copied().find(|block| !is_in(scene, *block)) else {
            return (slid(scene) >= CLOSED_M).then(|| slide(0.0));
        };
        if slid(scene) < OPENED_M {
            return Some(slide(OPEN_M));
        }
        let middle = (blocks.len() - 1) as f64 / 2.0;
        let place = |slot: usize| [0.0, BESIDE_M * (slot as f64 - middle), HALF_M];
        let taken = |slot: &usize| {
            let others = blocks.iter().filter_map(|block| in_drawer(scene, *block));
            others.into_iter().any(|at| {
                let [x, y, _] = scale(sub(at, place(*slot)), 1.0 / BESIDE_M);
                x.hypot(y) < 0.8
            })
        };
        let slot = (0..blocks.len()).find(|slot| !taken(slot))?;
        let at = add(drawer.position, drawer.turn.apply(place(slot)));
        Some(Step { part: block, target: Target::upright(at) })
    }
}
