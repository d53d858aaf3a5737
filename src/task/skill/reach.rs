//! Plans collision-free paths: to a grasp, and from a lifted part to its target.

use rapier3d::math::{Pose as Frame, Vector};
use serde::{Deserialize, Serialize};

use super::grasp::{self, Grasp, Target};
use crate::task::robot::arm::{self, Angles, HOME};
use crate::task::robot::path::Path;
use crate::task::scene::physics::Scene;

/// A plan for taking a part, and for lifting it or sliding it along its guide.
pub(crate) struct Lift {
    pub reach: Vec<Path>,
    pub approach: Path,
    pub lift: Path,
    pub opening: f64,
}

/// A plan for carrying a lifted part to above its target.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Placing {
    pub carry: Vec<Path>,
    /// Frame of the part when the hand lets go of it.
    pub part: Frame,
}

/// Distance in front of a grasp at which the approach begins, in metres.
const BEFORE_M: f64 = 0.06;
/// Height by which a part is lifted, in metres.
const LIFT_M: f64 = 0.10;
/// Height above its resting place at which the hand lets go of a part, in metres.
const RELEASE_M: f64 = 0.0013;
/// Greatest distance of a target from a part's guide, in metres.
const OFF_GUIDE_M: f64 = 0.02;
/// Number of heights from which the hand tries to let a part fall.
const FALLS: u32 = 4;
/// Greatest number of searches for joint angles in one plan.
const BUDGET: usize = 1_500;
/// Greatest turn of a joint between two points of a path that are tested for collisions, in radians.
const LOOK_RAD: f64 = 0.04;
/// Height by which the end effector rises first if no other way is free, in metres.
const RISE_M: f64 = 0.12;

struct Search<'s> {
    scene: &'s Scene,
    left: usize,
}

impl Search<'_> {
    /// Finds joint angles that bring the end effector to `tool` and satisfy `fits`.
    fn posture(
        &mut self,
        tool: &Frame,
        current: &Angles,
        mut fits: impl FnMut(&Angles) -> bool,
    ) -> Option<Angles> {
        for start in arm::starts(current, tool) {
            if self.left == 0 {
                return None;
            }
            self.left -= 1;
            if let Some(q) = arm::solve(tool, &start)
                && fits(&q)
            {
                return Some(q);
            }
        }
        None
    }
}

/// Plans how to take `part` by the first of `grasps` from which the part can also be put at `target`.
pub(crate) fn plan_lift(
    scene: &Scene,
    current: &Angles,
    part: usize,
    target: &Target,
    grasps: &[Grasp],
) -> Option<Lift> {
    let frame = scene.part_frame(part);
    let mut search = Search { scene, left: BUDGET };
    for grasp in grasps {
        let Some(tool) = grasp.tool() else { continue };
        let line = |q: &Angles| Path::line(q, Vector::Z * LIFT_M, &scene.spec().arm);
        let Some(plan) = take(&mut search, current, part, grasp, line) else { continue };
        let in_hand = frame.inv_mul(&tool);
        let from = plan.lift.end();
        if placing(&mut search, &from, part, target, &in_hand, plan.opening).is_some() {
            return Some(plan);
        }
        if search.left == 0 {
            break;
        }
    }
    None
}

/// Plans how to take `part` by the first of `grasps` from which it can be slid along its guide to `target`; `None` also if
/// the target is not on the guide or the part has no guide.
pub(crate) fn plan_slide(
    scene: &Scene,
    current: &Angles,
    part: usize,
    target: &Target,
    grasps: &[Grasp],
) -> Option<Lift> {
    let slider = scene.slider(part)?;
    let way = Vector::from(target.position) - scene.part_frame(part).translation;
    let along = way.dot(slider.axis);
    let [least, most] = slider.range_m;
    let goal = (slider.at_m + along).clamp(least, most);
    let past = (slider.at_m + along - goal).abs();
    if !((way - slider.axis * along).length() <= OFF_GUIDE_M && past <= OFF_GUIDE_M) {
        return None;
    }
    let shift = slider.axis * (goal - slider.at_m);
    let mut search = Search { scene, left: BUDGET };
    grasps.iter().find_map(|grasp| {
        let line = |q: &Angles| {
            let path = Path::line(q, shift, &scene.spec().arm)?;
            let looks = path.looks(LOOK_RAD);
            let clear = |q: Angles| !scene.collides(&q, grasp.opening_m, &[part]);
            let free = path.samples(looks).all(clear);
            free.then_some(path)
        };
        take(&mut search, current, part, grasp, line)
    })
}

/// Plans how to take `part` by `grasp` from a posture for which `line` gives the movement that follows.
fn take(
    search: &mut Search<'_>,
    current: &Angles,
    part: usize,
    grasp: &Grasp,
    line: impl Fn(&Angles) -> Option<Path>,
) -> Option<Lift> {
    let (scene, opening) = (search.scene, grasp.opening_m);
    let tool = grasp.tool()?;
    let approach = tool.rotation * Vector::Z;
    let mut found = None;
    search.posture(&tool, current, |q| {
        if scene.collides(q, opening, &[part]) {
            return false;
        }
        let back = Path::line(q, -approach * BEFORE_M, &scene.spec().arm);
        let Some((back, lift)) = back.zip(line(q)) else { return false };
        if scene.collides(&back.end(), opening, &[]) {
            return false;
        }
        let reach = free_way(scene, current, &back.end(), opening, None);
        found = reach.map(|reach| Lift { reach, approach: back.reversed(), lift, opening });
        found.is_some()
    });
    found
}

/// Plans how to put a part that is in the hand at `target`.
pub(crate) fn plan_placing(
    scene: &Scene,
    current: &Angles,
    part: usize,
    target: &Target,
    in_hand: &Frame,
) -> Option<Placing> {
    let mut search = Search { scene, left: BUDGET };
    let opening = scene.handling(part).release_m;
    placing(&mut search, current, part, target, in_hand, opening)
}

fn placing(
    search: &mut Search<'_>,
    from: &Angles,
    part: usize,
    target: &Target,
    in_hand: &Frame,
    opening: f64,
) -> Option<Placing> {
    let scene = search.scene;
    let handling = scene.handling(part);
    let held = arm::tool(from) * in_hand.inverse();
    let spec = scene.spec();
    let rise = Vector::Z * handling.rise_m;
    let placements = grasp::placements(&handling.symmetry, target, &held);
    let tools = grasp::place_tools(&placements, in_hand);
    let over = heights(handling.fall_m);
    let ways = over.iter().flat_map(|height| tools.iter().map(move |tool| (*height, tool)));
    for (height, tool) in ways {
        let tool = Frame::from_parts(tool.translation + Vector::Z * height, tool.rotation);
        // Spare the search for joint angles where the hand alone has no room.
        if handling.fall_m > 0.0 && scene.hand_collides(&tool, opening, &[part]) {
            continue;
        }
        let mut carry = None;
        let found = search.posture(&tool, from, |q| {
            if scene.collides(q, opening, &[part]) {
                return false;
            }
            let Some(up) = Path::line(q, rise, &spec.arm) else { return false };
            let above = up.end();
            let hangs = arm::tool(&above) * in_hand.inverse();
            if scene.collides(&above, opening, &[part]) || scene.part_collides(part, &hangs) {
                return false;
            }
            carry = free_way(scene, from, &above, opening, Some((part, *in_hand)));
            carry.is_some()
        });
        if found.is_some() {
            let part = tool * in_hand.inverse();
            return carry.map(|carry| Placing { carry, part });
        }
        if search.left == 0 {
            return None;
        }
    }
    None
}

/// Returns the heights above the target at which the hand may let go of a part, the lowest first.
fn heights(fall_m: f64) -> Vec<f64> {
    let falls = (1..=FALLS).map(|n| f64::from(n) * fall_m / f64::from(FALLS));
    std::iter::once(RELEASE_M).chain(falls.filter(|height| *height > RELEASE_M)).collect()
}

/// Finds paths between two postures on which neither the arm nor a held part touches anything, by way of
/// higher postures if necessary. If there are none, tries again from a point above the first posture.
fn free_way(
    scene: &Scene,
    from: &Angles,
    to: &Angles,
    opening: f64,
    held: Option<(usize, Frame)>,
) -> Option<Vec<Path>> {
    let arm_spec = &scene.spec().arm;
    let over = |bearing: f64, hand: &Angles| {
        let mut q = HOME;
        q[0] = bearing;
        q[4..].copy_from_slice(&hand[4..]);
        q
    };
    let joints = |a: &Angles, b: &Angles| Path::joints(a, b, arm_spec, held.is_some());
    let rise = || Path::line(from, Vector::Z * RISE_M, arm_spec);
    for above in [false, true] {
        let first = if above { Some(rise()?) } else { None };
        if first.as_ref().is_some_and(|rise| !free(scene, rise, opening, held, true)) {
            return None;
        }
        let begin = first.as_ref().map_or(*from, Path::end);
        let waypoints: [&[Angles]; 4] =
            [&[], &[over(to[0], to)], &[over(begin[0], &begin), over(to[0], to)], &[HOME]];
        let mut ways: Vec<Vec<Path>> = waypoints
            .iter()
            .map(|via| {
                let points: Vec<Angles> =
                    std::iter::once(begin).chain(via.iter().copied()).collect();
                let ends = points.iter().skip(1).chain([to]);
                points.iter().zip(ends).map(|(a, b)| joints(a, b)).collect()
            })
            .collect();
        // Try the quickest way first.
        let lasts = |way: &[Path]| way.iter().map(Path::duration_s).sum::<f64>();
        ways.sort_by(|a, b| lasts(a).total_cmp(&lasts(b)));
        for legs in ways {
            let begins_here = |leg: usize| leg == 0 && first.is_none();
            if legs.iter().enumerate().all(|(i, p)| free(scene, p, opening, held, begins_here(i))) {
                return Some(first.into_iter().chain(legs).collect());
            }
        }
    }
    None
}

/// Returns whether nothing is touched along a path. With `begins_here`, contact at the very beginning is
/// allowed, because the arm is already there.
fn free(
    scene: &Scene,
    path: &Path,
    opening: f64,
    held: Option<(usize, Frame)>,
    begins_here: bool,
) -> bool {
    let ignored = held.map(|(part, _)| part);
    let clear = |q: &Angles| {
        !scene.collides(q, opening, ignored.as_slice())
            && !held.is_some_and(|(part, in_hand)| {
                scene.part_collides(part, &(arm::tool(q) * in_hand.inverse()))
            })
    };
    // Test every eighth point first: this finds most blocked paths quickly.
    let count = path.looks(LOOK_RAD);
    let (points, most) = (path.samples(count).collect::<Vec<_>>(), if begins_here { 2 } else { 0 });
    let far = |i: &usize| *i >= most.min(count);
    let coarse = (0..=count).step_by(8);
    coarse.chain((0..=count).filter(|i| i % 8 != 0)).filter(far).all(|i| clear(&points[i]))
}
