//! Plans collision-free paths: to a grasp, and from a lifted part to its target.

use std::cell::Cell;
use std::rc::Rc;

use rapier3d::math::{Pose as Frame, Rotation, Vector};
use serde::{Deserialize, Serialize};

use super::grasp::{self, Grasp, Target};
use crate::robot::arm::ArmSpec;
use crate::robot::arm::kinematics::{self, Angles, HOME};
use crate::robot::arm::path::Path;
use crate::robot::scene::Sensed;

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
/// Distance by which the hand moves back after it has let go of a part, in metres.
pub(crate) const BACK_M: f64 = 0.07;
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
/// Greatest number of tests for collisions in one plan.
const LOOKS: usize = 60_000;
/// Number of tests for collisions that take as long as the straight lines from a posture.
const LOOKS_FOR_LINES: usize = 8;
/// Greatest turn of a joint between two points of a path that are tested for collisions, in radians. One joint alone then
/// moves the hand by at most 8 mm. With four times as much, fingers passed through the corners of parts.
const LOOK_RAD: f64 = 0.01;
/// Height by which the end effector rises first if no other way is free, in metres.
const RISE_M: f64 = 0.12;
/// Turn of the hand about its own axis while it rises, if it cannot rise without, in radians.
const ROLL_RAD: f64 = 0.8;

struct Search<'s> {
    scene: &'s Sensed<'s>,
    /// Searches for joint angles that are left.
    left: usize,
    /// Tests for collisions that are left.
    looks: Looks,
    /// Distance that the arm keeps from everything on its way, in metres.
    clear_m: f64,
    /// Whether a held part stays inside the table's rim on its way, so that it is not lost if it is dropped.
    inside: bool,
}

/// Returns whether the arm has a posture that brings the end effector to `tool`.
pub(crate) fn has_posture(current: &Angles, tool: &Frame) -> bool {
    kinematics::may_reach(tool)
        && kinematics::starts(current, tool).any(|start| kinematics::solve(tool, &start).is_some())
}

/// Returns the distances from everything else that are tried for a part, the greatest first.
fn clearances(scene: &Sensed<'_>, part: usize) -> impl Iterator<Item = f64> + use<> {
    let clear_m = scene.handling(part).clear_m;
    (clear_m > 0.0).then_some(clear_m).into_iter().chain([0.0])
}

/// Counts tests for collisions. A plan that would need too many is given up: its cost is bounded, and still the same for
/// the same scene.
#[derive(Clone)]
struct Looks(Rc<Cell<usize>>);

impl Looks {
    fn new() -> Self {
        Self(Rc::new(Cell::new(LOOKS)))
    }

    /// Takes `count` tests; returns `false` if none are left.
    fn take(&self, count: usize) -> bool {
        let left = self.0.get();
        self.0.set(left.saturating_sub(count));
        left > 0
    }
}

impl<'s> Search<'s> {
    fn new(scene: &'s Sensed<'s>, clear_m: f64) -> Self {
        Self { scene, left: BUDGET, looks: Looks::new(), clear_m, inside: false }
    }

    fn air(&self, opening: f64, held: Option<(usize, Frame)>) -> Air<'s> {
        let (clear_m, looks) = (self.clear_m, self.looks.clone());
        Air { scene: self.scene, opening, held, clear_m, looks, inside: self.inside }
    }

    fn is_spent(&self) -> bool {
        self.left == 0 || self.looks.0.get() == 0
    }

    /// Finds joint angles that bring the end effector to `tool` and satisfy `fits`.
    fn posture(
        &mut self,
        tool: &Frame,
        current: &Angles,
        mut fits: impl FnMut(&Angles) -> bool,
    ) -> Option<Angles> {
        if !kinematics::may_reach(tool) {
            return None;
        }
        for start in kinematics::starts(current, tool) {
            if self.is_spent() {
                return None;
            }
            self.left -= 1;
            self.looks.take(1);
            if let Some(q) = kinematics::solve(tool, &start)
                && self.looks.take(LOOKS_FOR_LINES)
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
    scene: &Sensed<'_>,
    current: &Angles,
    part: usize,
    target: &Target,
    grasps: &[Grasp],
) -> Option<Lift> {
    let mut ways = clearances(scene, part);
    ways.find_map(|clear_m| lift_with(scene, current, part, target, grasps, clear_m))
}

fn lift_with(
    scene: &Sensed<'_>,
    current: &Angles,
    part: usize,
    target: &Target,
    grasps: &[Grasp],
    clear_m: f64,
) -> Option<Lift> {
    let frame = scene.part_frame(part);
    let mut search = Search::new(scene, clear_m);
    for grasp in grasps {
        let Some(tool) = grasp.tool() else { continue };
        let line = |q: &Angles| Path::line(q, Vector::Z * LIFT_M, scene.arm());
        let Some(plan) = take(&mut search, current, part, grasp, line) else { continue };
        let in_hand = frame.inv_mul(&tool);
        let from = plan.lift.end();
        if placing(&mut search, &from, part, target, &in_hand, plan.opening).is_some() {
            return Some(plan);
        }
        if search.is_spent() {
            break;
        }
    }
    None
}

/// Plans how to take `part` by the first of `grasps` from which it can be slid along its guide to `target`; `None`
/// also if the target is not on the guide or the part has no guide.
pub(crate) fn plan_slide(
    scene: &Sensed<'_>,
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
    clearances(scene, part).find_map(|clear_m| {
        let mut search = Search::new(scene, clear_m);
        let looks = search.looks.clone();
        grasps.iter().find_map(|grasp| {
            let line = |q: &Angles| {
                let path = Path::line(q, shift, scene.arm())?;
                let clear =
                    |q: Angles| looks.take(1) && !scene.collides(&q, grasp.opening_m, &[part]);
                let free = path.samples(path.looks(LOOK_RAD)).all(clear);
                free.then_some(path)
            };
            take(&mut search, current, part, grasp, line)
        })
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
    let air = search.air(opening, None);
    let tool = grasp.tool()?;
    let approach = tool.rotation * Vector::Z;
    let mut found = None;
    search.posture(&tool, current, |q| {
        if scene.collides(q, opening, &[part]) {
            return false;
        }
        let back = Path::line(q, -approach * BEFORE_M, scene.arm());
        let Some((back, lift)) = back.zip(line(q)) else { return false };
        if scene.collides(&back.end(), opening, &[]) {
            return false;
        }
        let reach = free_way(&air, current, &back.end());
        found = reach.map(|reach| Lift { reach, approach: back.reversed(), lift, opening });
        found.is_some()
    });
    found
}

/// Plans how to put a part that is in the hand at `target` and let go of it with the fingers at `opening`.
pub(crate) fn plan_placing(
    scene: &Sensed<'_>,
    current: &Angles,
    part: usize,
    target: &Target,
    in_hand: &Frame,
    opening: f64,
) -> Option<Placing> {
    let plan = |inside: bool, clear_m: f64| {
        let mut search = Search { inside, ..Search::new(scene, clear_m) };
        placing(&mut search, current, part, target, in_hand, opening)
    };
    let mut ways = [true, false].into_iter();
    ways.find_map(|inside| clearances(scene, part).find_map(|clear_m| plan(inside, clear_m)))
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
    let air = search.air(opening, Some((part, *in_hand)));
    let handling = scene.handling(part);
    let held = kinematics::tool(from) * in_hand.inverse();
    let rise = Vector::Z * handling.rise_m;
    let careful = search.clear_m > 0.0;
    let placements = grasp::placements(&handling.symmetry, target, &held);
    let tools = grasp::place_tools(&placements, in_hand);
    let over = heights(handling.fall_m);
    let ways = over.iter().flat_map(|height| tools.iter().map(move |tool| (*height, tool)));
    for (height, tool) in ways {
        let tool = Frame::from_parts(tool.translation + Vector::Z * height, tool.rotation);
        // Spare the search for joint angles where the hand alone has no room.
        if !search.looks.take(1)
            || !kinematics::may_reach(&tool)
            || scene.hand_collides(&tool, opening, &[part])
        {
            continue;
        }
        let mut carry = None;
        let found = search.posture(&tool, from, |q| {
            if scene.collides(q, opening, &[part]) {
                return false;
            }
            let Some(up) = Path::line(q, rise, scene.arm()) else { return false };
            if careful && !leaves(q, scene.arm()) {
                return false;
            }
            let above = up.end();
            let hangs = kinematics::tool(&above) * in_hand.inverse();
            if scene.collides(&above, opening, &[part]) || scene.part_collides(part, &hangs) {
                return false;
            }
            carry = free_way(&air, from, &above);
            carry.is_some()
        });
        if found.is_some() {
            let part = tool * in_hand.inverse();
            return carry.map(|carry| Placing { carry, part });
        }
        if search.is_spent() {
            return None;
        }
    }
    None
}

/// A plan for a push.
pub(crate) struct Shove {
    pub reach: Vec<Path>,
    pub approach: Path,
    pub push: Path,
}

/// Plans how to bring the tips of the closed fingers to the beginning of a push, with the end effector at `tool`, and
/// how to move them straight by `shift`, in metres, with the part `part` in front of them.
pub(crate) fn plan_push(
    scene: &Sensed<'_>,
    current: &Angles,
    part: usize,
    tool: &Frame,
    shift: Vector,
) -> Option<Shove> {
    let mut search = Search::new(scene, 0.0);
    let air = search.air(0.0, None);
    let before = tool.rotation * -Vector::Z * BEFORE_M;
    let arm_spec = scene.arm();
    let mut found = None;
    search.posture(tool, current, |q| {
        if scene.collides(q, 0.0, &[]) {
            return false;
        }
        let Some(back) = Path::line(q, before, arm_spec) else { return false };
        let Some(push) = Path::line(q, shift, arm_spec) else { return false };
        let free = |q: Angles| !scene.collides(&q, 0.0, &[part]);
        if scene.collides(&back.end(), 0.0, &[]) || !push.samples(push.looks(LOOK_RAD)).all(free) {
            return false;
        }
        let reach = free_way(&air, current, &back.end());
        found = reach.map(|reach| Shove { reach, approach: back.reversed(), push });
        found.is_some()
    });
    found
}

/// Finds a short way out for an arm that touches something: up, back along the hand, or to the waiting posture. `None` if
/// the arm touches nothing or if there is no such way.
pub(crate) fn escape(scene: &Sensed<'_>, current: &Angles, opening: f64) -> Option<Path> {
    if !scene.collides(current, opening, &[]) {
        return None;
    }
    let arm_spec = scene.arm();
    let back = kinematics::tool(current).rotation * -Vector::Z;
    let lines = [0.04, RISE_M].into_iter().flat_map(|by| [Vector::Z * by, back * by]);
    let lines = lines.filter_map(|shift| Path::line(current, shift, arm_spec));
    let home = Path::joints(current, &HOME, arm_spec, false);
    lines.chain([home]).find(|path| {
        let count = path.looks(LOOK_RAD);
        let mut later = path.samples(count).skip(count / 2);
        later.all(|q| !scene.collides(&q, opening, &[]))
    })
}

/// Returns whether the hand at `q` can move back and then up, so that a way leads on from there.
fn leaves(q: &Angles, arm_spec: &ArmSpec) -> bool {
    let back = kinematics::tool(q).rotation * Vector::Z * -BACK_M;
    let back = Path::line(q, back, arm_spec);
    back.is_some_and(|back| Path::line(&back.end(), Vector::Z * RISE_M, arm_spec).is_some())
}

/// Returns the heights above the target at which the hand may let go of a part, the lowest first.
fn heights(fall_m: f64) -> Vec<f64> {
    let falls = (1..=FALLS).map(|n| f64::from(n) * fall_m / f64::from(FALLS));
    std::iter::once(RELEASE_M).chain(falls.filter(|height| *height > RELEASE_M)).collect()
}

/// The arm on its way through the air.
struct Air<'s> {
    scene: &'s Sensed<'s>,
    opening: f64,
    /// The part in the hand, and the end effector's frame relative to it.
    held: Option<(usize, Frame)>,
    /// Distance that the arm keeps from everything, in metres.
    clear_m: f64,
    looks: Looks,
    /// Whether the held part stays inside the table's rim.
    inside: bool,
}

impl Air<'_> {
    /// Returns whether the arm at `q` keeps `clear_m` metres from everything, and a held part touches nothing. An arm
    /// that keeps a distance does not run into itself either. Also returns `false` if no tests are left.
    fn is_clear(&self, q: &Angles, clear_m: f64) -> bool {
        if !self.looks.take(1) {
            return false;
        }
        let held = self.held.map(|(part, in_hand)| (part, kinematics::tool(q) * in_hand.inverse()));
        let ignored = held.map(|(part, _)| part);
        let away = |(_, frame): (usize, Frame)| !self.scene.is_over_table(frame.translation);
        let touches = (self.inside && held.is_some_and(away))
            || self.scene.comes_near(q, self.opening, ignored.as_slice(), clear_m)
            || held.is_some_and(|(part, frame)| self.scene.part_collides(part, &frame))
            || (self.clear_m > 0.0 && self.scene.folds(q, self.opening, held));
        !touches
    }
}

/// Finds paths between two postures on which neither the arm nor a held part touches anything, by way of
/// higher postures if necessary. If there are none, tries again from a point above the first posture, and, for an arm
/// that keeps a distance, to a point above the last posture.
fn free_way(air: &Air<'_>, from: &Angles, to: &Angles) -> Option<Vec<Path>> {
    let arm_spec = air.scene.arm();
    let line = |q: &Angles, height: f64| match height {
        0.0 => Some(None),
        _ => Path::line(q, Vector::Z * height, arm_spec).map(Some),
    };
    let roll = |roll: f64| {
        let tool = kinematics::tool(from);
        let up = tool.translation + Vector::Z * RISE_M;
        let target = Frame::from_parts(up, tool.rotation * Rotation::from_rotation_z(roll));
        Path::line_to(from, &target, arm_spec).map(Some)
    };
    let (first, last): (&[f64], &[f64]) = match air.clear_m {
        0.0 => (&[0.0, RISE_M], &[0.0]),
        _ => (&[0.0, RISE_M, RISE_M / 2.0, RISE_M / 4.0], &[0.0, RISE_M, RISE_M / 2.0]),
    };
    // A joint at its limit can keep the hand from rising without a turn.
    let rolls: &[f64] = if air.clear_m > 0.0 { &[-ROLL_RAD, ROLL_RAD] } else { &[] };
    let rises = first.iter().map(|height| line(from, *height));
    for rise in rises.chain(rolls.iter().map(|turn| roll(*turn))) {
        let Some(rise) = rise else { continue };
        if rise.as_ref().is_some_and(|rise| !free(air, rise, true)) {
            continue;
        }
        for height in last {
            let Some(fall) = line(to, *height) else { continue };
            if fall.as_ref().is_some_and(|fall| !free(air, fall, false)) {
                continue;
            }
            let begin = rise.as_ref().map_or(*from, Path::end);
            let end = fall.as_ref().map_or(*to, Path::end);
            if let Some(legs) = legs(air, &begin, &end, rise.is_none()) {
                let fall = fall.map(Path::reversed);
                return Some(rise.into_iter().chain(legs).chain(fall).collect());
            }
        }
    }
    None
}

/// Finds paths that are straight in joint angles, directly or by way of postures above the table. With `begins_here`,
/// the arm is already at the first posture.
fn legs(air: &Air<'_>, begin: &Angles, to: &Angles, begins_here: bool) -> Option<Vec<Path>> {
    let over = |bearing: f64, hand: &Angles| {
        let mut q = HOME;
        q[0] = bearing;
        q[4..].copy_from_slice(&hand[4..]);
        q
    };
    let arm_spec = air.scene.arm();
    let joints = |a: &Angles, b: &Angles| Path::joints(a, b, arm_spec, air.held.is_some());
    let waypoints: [&[Angles]; 4] =
        [&[], &[over(to[0], to)], &[over(begin[0], begin), over(to[0], to)], &[HOME]];
    let mut ways: Vec<Vec<Path>> = waypoints
        .iter()
        .map(|via| {
            let points: Vec<Angles> = std::iter::once(*begin).chain(via.iter().copied()).collect();
            let ends = points.iter().skip(1).chain([to]);
            points.iter().zip(ends).map(|(a, b)| joints(a, b)).collect()
        })
        .collect();
    // Try the quickest way first.
    let lasts = |way: &[Path]| way.iter().map(Path::duration_s).sum::<f64>();
    ways.sort_by(|a, b| lasts(a).total_cmp(&lasts(b)));
    let free_leg = |(leg, path): (usize, &Path)| free(air, path, leg == 0 && begins_here);
    ways.into_iter().find(|legs| legs.iter().enumerate().all(free_leg))
}

/// Returns whether nothing is touched along a path. With `begins_here`, contact at the very beginning is
/// allowed, because the arm is already there.
fn free(air: &Air<'_>, path: &Path, begins_here: bool) -> bool {
    // Test every eighth point first: this finds most blocked paths quickly.
    let count = path.looks(LOOK_RAD);
    let (points, most) = (path.samples(count).collect::<Vec<_>>(), if begins_here { 2 } else { 0 });
    let far = |i: &usize| *i >= most.min(count);
    // Near its beginning, the arm may be closer to things than it should keep.
    let near = if begins_here { count / 8 } else { 0 };
    let clear = |i: usize| air.is_clear(&points[i], if i < near { 0.0 } else { air.clear_m });
    let coarse = (0..=count).step_by(8);
    coarse.chain((0..=count).filter(|i| i % 8 != 0)).filter(far).all(clear)
}
