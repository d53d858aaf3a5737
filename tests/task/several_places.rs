//! Which of several objects a place belongs to, and whether several places are several, from few demonstrations and through noise.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use symbolt::robot::Pose;
use symbolt::sim::Seed;
use symbolt::task::classify::Classifier;
use symbolt::task::compile::Problem;
use symbolt::task::domain::{FrameState, Origin, RelationalDomain};
use symbolt::task::learn::learn;
use symbolt::task::{ObjectPose, Recording, Sensing, Snapshot};

use super::modes::{Draw, recording, shown};

/// A pose turned by yaw, then pitch, in degrees.
pub(super) fn at(position: [f64; 3], yaw: f64, pitch: f64) -> Pose {
    let turn = |axis, degrees: f64| UnitQuaternion::from_axis_angle(&axis, degrees.to_radians());
    let turn = turn(Vector3::z_axis(), yaw) * turn(Vector3::y_axis(), pitch);
    let q = turn.into_inner().coords;
    Pose { position, orientation: [q.x, q.y, q.z, q.w] }
}

pub(super) fn flat(x: f64, y: f64, z: f64, yaw: f64) -> Pose {
    at([x, y, z], yaw, 0.0)
}

/// A pose in the frame of another.
pub(super) fn on(reference: &Pose, pose: &Pose) -> Pose {
    let isometry = |pose: &Pose| {
        let [x, y, z, w] = pose.orientation;
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        Isometry3::from_parts(Translation3::from(Vector3::from(pose.position)), turn)
    };
    let whole = isometry(reference) * isometry(pose);
    let q = whole.rotation.into_inner().coords;
    let position = whole.translation.vector.into();
    Pose { position, orientation: [q.x, q.y, q.z, q.w] }
}

/// Objects whose ids are their kinds with their numbers.
pub(super) fn objects(poses: &[(&str, Pose)]) -> Vec<ObjectPose> {
    let named = poses.iter().enumerate().map(|(i, (kind, pose))| ObjectPose {
        id: format!("{kind}_{i}").into(),
        kind: (*kind).into(),
        pose: *pose,
    });
    named.collect()
}

impl Draw {
    pub fn yaw(&mut self) -> f64 {
        self.within(-180.0, 180.0)
    }

    /// Somewhere on the table, on the near side of the fixtures.
    pub fn lying(&mut self, z: f64) -> Pose {
        flat(self.within(-0.4, 0.4), self.within(-0.4, 0.0), z, self.yaw())
    }

    /// A fixture that stands somewhere else in each demonstration, turned.
    pub fn fixture(&mut self, z: f64) -> Pose {
        flat(self.within(-0.3, 0.3), self.within(0.2, 0.4), z, self.yaw())
    }
}

pub(super) fn noisy(recording: &Recording, mm_deg: f64, seed: u64) -> Recording {
    sensing(mm_deg).apply_recording(recording, Seed::new(seed))
}

pub(super) fn sensing(mm_deg: f64) -> Sensing {
    Sensing { pose_noise_m: 1e-3 * mm_deg, pose_noise_deg: mm_deg, ..Sensing::default() }
}

pub(super) fn learned(recording: &Recording) -> RelationalDomain {
    learn(recording, &Default::default()).expect("it can be learned").domain
}

/// The states in which objects of a kind are put.
pub(super) fn put<'d>(domain: &'d RelationalDomain, kind: &str) -> Vec<&'d FrameState> {
    let of = |s: &&FrameState| s.kind == kind && s.origin == Origin::Placed;
    domain.states.iter().filter(of).collect()
}

/// A shelf, a stand, a vase and a flower, with the poses of the vase on the shelf and on the stand.
fn vase(draw: &mut Draw) -> (Vec<ObjectPose>, [Pose; 2]) {
    let shelf = flat(draw.within(-0.4, 0.4), 0.55, 0.25, draw.yaw());
    let stand = flat(draw.within(-0.4, 0.4), -0.55, 0.1, draw.yaw());
    let (vase, flower) = (draw.lying(0.08), draw.lying(0.01));
    let all = [("shelf", shelf), ("stand", stand), ("vase", vase), ("flower", flower)];
    let (high, low) = (flat(0.0, 0.0, 0.09, draw.yaw()), flat(0.0, 0.0, 0.1, draw.yaw()));
    (objects(&all), [on(&shelf, &high), on(&stand, &low)])
}

#[test]
fn a_place_on_a_shelf_and_one_on_a_stand_are_no_strips_of_the_world_and_either_will_do() {
    for seed in 0..5 {
        let mut draw = Draw(1000 + seed);
        let demo = |number: usize| {
            let (all, places) = vase(&mut draw);
            let stood = places[number % 2];
            let flower = on(&stood, &at([0.0, 0.0, 0.1], 0.0, 90.0));
            shown(all, &[(2, stood), (3, flower)])
        };
        let domain = learned(&recording((0..5).map(demo)));
        let mut frames: Vec<&str> = put(&domain, "vase").iter().map(|s| s.frame.name()).collect();
        frames.sort_unstable();
        assert_eq!(frames, ["shelf", "stand"], "seed {seed}");
        let (objects, places) = vase(&mut Draw(2000 + seed));
        let scene = Snapshot { objects, ..Snapshot::default() };
        let layout = Classifier::new(&domain).classify(&scene);
        let problem = Problem::new(&domain, &layout).expect("a problem");
        let plan = problem.plan(&layout.situation(), &[]).expect("a plan");
        let objects: Vec<usize> = plan.iter().map(|step| step.action.object).collect();
        assert_eq!(objects, [2, 3], "the vase first: seed {seed}");
        let target = problem.target(&plan[0].action, &layout).pose;
        let off = places.iter().map(|place| place.distance(&target)).fold(f64::INFINITY, f64::min);
        assert!(off < 2e-3, "{off} m off, seed {seed}");
    }
}

/// Mugs hang on two pairs of hooks that face each other, at two heights, each hook with its own direction.
fn hooks(seed: u64) -> Recording {
    let mut draw = Draw(seed);
    let demo = |number: usize| {
        let tree = draw.fixture(0.2);
        let (first, second) = (number % 4, (number + 1 + number / 4) % 4);
        let hook = |k: usize| {
            let (yaw, z) = (90.0 * k as f64, if k % 2 == 1 { 0.05 } else { -0.05 });
            let (sin, cos) = yaw.to_radians().sin_cos();
            on(&tree, &at([0.06 * cos, 0.06 * sin, z], yaw, 90.0))
        };
        let all = objects(&[("tree", tree), ("mug", draw.lying(0.05)), ("mug", draw.lying(0.05))]);
        shown(all, &[(1, hook(first)), (2, hook(second))])
    };
    recording((0..5).map(demo))
}

#[test]
fn hooks_that_face_each_other_are_no_rail() {
    let right = (0..20u64).filter(|seed| {
        let domain = learned(&noisy(&hooks(3000 + seed), 1.0, *seed));
        let states = put(&domain, "mug");
        states.len() == 1
            && states[0].places.len() == 4
            && states[0].places.iter().all(|p| p.coordinates.iter().all(|c| !c.is_open()))
    });
    // Two of the hooks were used twice. By positions alone, two of thirty recordings tell them apart.
    let right = right.count();
    assert!(right >= 12, "{right} of 20");
}

/// Three of five slots of a rack are filled, in any order; or three tokens are put anywhere along its groove.
fn rack(seed: u64, groove: bool) -> Recording {
    let mut draw = Draw(seed);
    let demo = |number: usize| {
        let rack = draw.fixture(0.02);
        let tokens: Vec<Pose> = (0..5).map(|_| draw.lying(0.01)).collect();
        let mut all = vec![("rack", rack)];
        all.extend(tokens.iter().map(|pose| ("token", *pose)));
        let moves = (0..3).map(|k| {
            let slot = 0.05 * ((number + 2 * k) % 5) as f64 - 0.1;
            let x = if groove { draw.within(-0.1, 0.1) } else { slot };
            (1 + k, on(&rack, &flat(x, 0.0, 0.02, draw.yaw())))
        });
        let moves: Vec<(usize, Pose)> = moves.collect();
        shown(objects(&all), &moves)
    };
    recording((0..5).map(demo))
}

#[test]
fn slots_of_a_rack_are_no_groove_in_noise_and_a_groove_is_no_row_of_slots() {
    let count = |groove: bool, places: usize| {
        let right = (0..10u64).filter(|seed| {
            let domain = learned(&noisy(&rack(4000 + seed, groove), 2.0, *seed));
            let states = put(&domain, "token");
            states.len() == 1 && states[0].places.len() == places
        });
        right.count()
    };
    let right = [count(false, 5), count(true, 1)];
    assert!(right.iter().all(|n| *n >= 9), "{right:?} of 10 each");
}

/// Four tokens for six slots of a rack. Some are in slots at first: of those in the first slot two of three.
fn partly_filled(seed: u64) -> Recording {
    const SLOTS: [(usize, [usize; 4]); 5] = [
        (0, [1, 2, 3, 4]),
        (1, [0, 3, 5, 1]),
        (2, [0, 2, 4, 5]),
        (0, [0, 1, 5, 3]),
        (1, [4, 5, 2, 1]),
    ];
    let mut draw = Draw(seed);
    let demo = |(found, slots): (usize, [usize; 4])| {
        let rack = draw.fixture(0.02);
        let slots = slots.map(|s| on(&rack, &flat(0.05 * s as f64 - 0.125, 0.0, 0.02, draw.yaw())));
        let mut all = vec![("rack", rack)];
        let start = |(at, slot): (usize, &Pose)| if at < found { *slot } else { draw.lying(0.01) };
        all.extend(slots.iter().enumerate().map(start).map(|pose| ("token", pose)));
        let moves: Vec<(usize, Pose)> = (found..4).map(|at| (1 + at, slots[at])).collect();
        shown(objects(&all), &moves)
    };
    recording(SLOTS.into_iter().map(demo))
}

#[test]
fn a_slot_that_was_taken_at_first_more_often_than_filled_is_one_of_the_slots() {
    let right = (0..10u64).filter(|seed| {
        let domain = learned(&noisy(&partly_filled(9000 + seed), 1.0, *seed));
        let states: Vec<&FrameState> = domain
            .states
            .iter()
            .filter(|s| &*s.kind == "token" && s.frame.name() == "rack")
            .collect();
        states.len() == 1 && states[0].places.len() == 6 && domain.operators.len() == 1
    });
    let right = right.count();
    assert!(right >= 9, "{right} of 10");
}

/// A plug is put into a bracket, turned by any angle, and a cover over it, in one direction of the bracket.
fn bracket(seed: u64) -> Recording {
    let mut draw = Draw(seed);
    let demo = |_| {
        let bracket = draw.fixture(0.05);
        let plug = on(&bracket, &flat(0.06, 0.02, 0.0, draw.yaw()));
        let cover = on(&bracket, &flat(0.06, 0.02, 0.03, 90.0));
        let all = [("bracket", bracket), ("plug", draw.lying(0.01)), ("cover", draw.lying(0.01))];
        shown(objects(&all), &[(1, plug), (2, cover)])
    };
    recording((0..5).map(demo))
}

#[test]
fn a_cover_belongs_to_what_it_is_turned_with_and_not_to_what_lies_below() {
    let right = (0..20u64).filter(|seed| {
        let domain = learned(&noisy(&bracket(5000 + seed), 2.0, *seed));
        let states = put(&domain, "cover");
        states.len() == 1 && states[0].frame.name() == "bracket"
    });
    let right = right.count();
    assert!(right >= 19, "{right} of 20");
}

/// Bottles go from two slots of a fridge to two of a crate; what was in the left slot always goes to the left one.
fn fridge(seed: u64, demos: usize) -> Recording {
    let mut draw = Draw(seed);
    let demo = |_| {
        let (fridge, crate_) = (draw.fixture(0.5), draw.lying(0.1));
        let from = [-0.15, 0.15].map(|x| on(&fridge, &flat(x, 0.0, -0.1, draw.yaw())));
        let to = [-0.05, 0.05].map(|x| on(&crate_, &flat(x, 0.0, 0.1, draw.yaw())));
        let all = [("fridge", fridge), ("crate", crate_), ("bottle", from[0]), ("bottle", from[1])];
        shown(objects(&all), &[(2, to[0]), (3, to[1])])
    };
    recording((0..demos).map(demo))
}

#[test]
fn slots_that_were_left_for_slots_of_their_own_by_chance_are_places_of_one_state() {
    for seed in 0..5 {
        let of = |demos| learned(&fridge(6000 + seed, demos)).states.len();
        assert_eq!(of(3), 2, "three moves each may be chance: seed {seed}");
        assert_eq!(of(8), 4, "eight moves each are not: seed {seed}");
    }
}

#[test]
fn what_is_far_from_its_reference_keeps_its_state_in_noise() {
    let mut draw = Draw(7000);
    let scene = |draw: &mut Draw, aside: f64| {
        let wall = draw.fixture(0.5);
        let door = on(&wall, &flat(0.45, -0.3 + aside, 0.0, 0.0));
        (wall, door)
    };
    let demo = |_| {
        let (wall, door) = scene(&mut draw, 0.0);
        let all = objects(&[("wall", wall), ("door", draw.lying(0.3))]);
        shown(all, &[(1, door)])
    };
    let domain = learned(&noisy(&recording((0..5).map(demo)), 1.0, 1));
    let classifier = Classifier::new(&domain);
    let found = |aside: f64| {
        let mut draw = Draw(8000);
        let seen = (0..50u64).filter(|tick| {
            let (wall, door) = scene(&mut draw, aside);
            let objects = objects(&[("wall", wall), ("door", door)]);
            let scene = Snapshot { objects, ..Snapshot::default() };
            let scene = sensing(1.0).apply(&scene, Seed::new(2), *tick);
            classifier.classify_object(&scene, 1).fact.is_some()
        });
        seen.count()
    };
    let (there, aside) = (found(0.0), found(0.1));
    assert!(there >= 49, "{there} of 50 are in place");
    assert_eq!(aside, 0, "10 cm aside is not in place");
    assert_eq!(found(100.0), 0, "100 m aside is not in place");
}

#[test]
fn what_a_hand_put_down_is_not_where_the_hand_is() {
    for seed in 0..5 {
        let mut draw = Draw(9000 + seed);
        let demo = |_| {
            let socket = draw.fixture(0.0);
            let peg = on(&socket, &flat(0.05, 0.0, 0.02, draw.yaw()));
            let hand = on(&peg, &at([0.0, 0.0, 0.1], 0.0, 180.0));
            let home = flat(-0.4, 0.5, 0.4, 0.0);
            let all = [("socket", socket), ("hand", home), ("peg", draw.lying(0.03))];
            let mut shown = shown(objects(&all), &[(2, peg)]);
            // The hand is seen where it let go.
            let released = shown.snapshots.len() - 2;
            shown.snapshots[released..].iter_mut().for_each(|s| s.objects[1].pose = hand);
            shown
        };
        let domain = learned(&recording((0..5).map(demo)));
        let frames: Vec<&str> = put(&domain, "peg").iter().map(|s| s.frame.name()).collect();
        assert_eq!(frames, ["socket"], "seed {seed}");
    }
}
