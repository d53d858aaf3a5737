//! Which poses are one place: heights, sizes and areas that are apart, areas that are one, and frames in few demonstrations.

use std::path::Path;
use std::sync::Arc;

use symbolt::robot::Pose;
use symbolt::sim::Seed;
use symbolt::task::classify::Classifier;
use symbolt::task::compile::Problem;
use symbolt::task::domain::{Coordinate, FrameState, Origin, RelationalDomain};
use symbolt::task::learn::learn;

use symbolt::task::{Demonstration, ObjectPose, Recording, Sensing, Snapshot, SnapshotEvent};

fn learned(recording: &Recording) -> RelationalDomain {
    learn(recording, &Default::default()).expect("it can be learned").domain
}

fn fixture(name: &str) -> RelationalDomain {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/learned");
    learned(&Recording::read(&folder.join(format!("{name}.jsonl"))).expect("a recording"))
}

fn scene(name: &str) -> Snapshot {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/learned");
    Snapshot::read(&folder.join(format!("{name}_scene.json"))).expect("a scene")
}

/// Uniform numbers of a seed.
pub(super) struct Draw(pub u64);

impl Draw {
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A careless hand: the sum of three uniform numbers, with about this standard deviation.
    fn about(&mut self, value: f64, sd: f64) -> f64 {
        value + (0..3).map(|_| self.within(-sd, sd)).sum::<f64>()
    }
}

/// Shows one demonstration: objects as kind and position, and moves as object and new position.
fn show(objects: &[(&str, [f64; 3])], moves: &[(usize, [f64; 3])]) -> Demonstration {
    let named = objects.iter().enumerate().map(|(i, (kind, at))| ObjectPose {
        id: format!("{kind}_{i}").into(),
        kind: Arc::from(*kind),
        pose: Pose::at(*at),
    });
    let moves: Vec<(usize, Pose)> = moves.iter().map(|(i, at)| (*i, Pose::at(*at))).collect();
    shown(named.collect(), &moves)
}

/// Shows one demonstration: moves as object and new pose.
pub(super) fn shown(objects: Vec<ObjectPose>, moves: &[(usize, Pose)]) -> Demonstration {
    acted(objects, &moves.iter().map(|m| vec![*m]).collect::<Vec<_>>())
}

/// Shows one demonstration: moves as object and new pose, with what else changes its pose meanwhile.
pub(super) fn acted(mut objects: Vec<ObjectPose>, moves: &[Vec<(usize, Pose)>]) -> Demonstration {
    let mut snapshots = Vec::new();
    let mut snap = |event, object, objects: &[ObjectPose]| {
        let (number, objects) = (snapshots.len() as u64, objects.to_vec());
        let event = Some(event);
        snapshots.push(Snapshot { number, event, object, objects, ..Snapshot::default() });
    };
    snap(SnapshotEvent::Start, None, &objects);
    for changes in moves {
        let object = changes.first().map(|(object, _)| *object);
        snap(SnapshotEvent::Contact, object, &objects);
        changes.iter().for_each(|(object, pose)| objects[*object].pose = *pose);
        snap(SnapshotEvent::Release, object, &objects);
    }
    snap(SnapshotEvent::End, None, &objects);
    Demonstration { number: 0, snapshots }
}

pub(super) fn recording(demos: impl Iterator<Item = Demonstration>) -> Recording {
    let number =
        |(number, demo): (usize, Demonstration)| Demonstration { number: number as u64, ..demo };
    Recording { demos: demos.enumerate().map(number).collect() }
}

fn range(coordinate: Coordinate) -> (f64, f64) {
    match coordinate {
        Coordinate::Open { low, high } => (low, high),
        Coordinate::Tight { mean, sd } => (mean - sd, mean + sd),
    }
}

fn placed<'d>(domain: &'d RelationalDomain, kind: &str) -> Vec<&'d FrameState> {
    let of = |s: &&FrameState| s.kind == kind && s.origin == Origin::Placed;
    domain.states.iter().filter(of).collect()
}

/// Parts are moved from one area to another of the same height, with a gap between. The first x is that of the gap.
fn areas(seed: u64, demos: usize, gap: f64) -> Recording {
    let mut draw = Draw(seed);
    let mut demo = |_| {
        let mut at = |low: f64| [draw.within(0.4, 0.6), draw.within(low, low + 0.2), 0.03];
        let (from, to) = (at(-0.2 - gap / 2.0), at(gap / 2.0));
        show(&[("part", from)], &[(0, to)])
    };
    recording((0..demos).map(&mut demo))
}

/// Returns whether there are two states, each within one area, one goal and one action.
fn are_two_areas(domain: &RelationalDomain, slack: f64) -> bool {
    let sides: Vec<bool> = (domain.states.iter().flat_map(|s| &s.places))
        .map(|p| range(p.coordinates[1]))
        .filter_map(|(low, high)| (low > -slack || high < slack).then_some(low > -slack))
        .collect();
    sides.len() == 2
        && sides[0] != sides[1]
        && domain.states.len() == 2
        && (domain.goals.len(), domain.operators.len()) == (1, 1)
}

#[test]
fn two_areas_of_one_height_are_not_one() {
    assert!(are_two_areas(&fixture("areas"), 0.0));
    for (gap, demos) in [(0.3, 3), (0.3, 5), (0.1, 5), (0.05, 5), (0.05, 10)] {
        let right =
            (0..20u64).filter(|seed| are_two_areas(&learned(&areas(*seed, demos, gap)), 0.0));
        let right = right.count();
        assert!(right >= 19, "{right} of 20, {demos} demonstrations, {gap} m apart");
    }
}

#[test]
fn two_areas_are_told_apart_through_noise() {
    let noise = Sensing { pose_noise_m: 1e-3, pose_noise_deg: 1.0, ..Sensing::default() };
    let right = (0..10u64).filter(|seed| {
        let noisy = noise.apply_recording(&areas(100 + seed, 10, 0.1), Seed::new(*seed));
        are_two_areas(&learned(&noisy), 0.01)
    });
    let right = right.count();
    assert!(right >= 9, "{right} of 10");
}

#[test]
fn the_goal_is_not_met_at_the_start_between_two_bins_of_one_height() {
    let (domain, scene) = (fixture("two_bins"), scene("two_bins"));
    assert_eq!((domain.states.len(), domain.operators.len(), domain.goals.len()), (4, 2, 2));
    let layout = Classifier::new(&domain).classify(&scene);
    let problem = Problem::new(&domain, &layout).expect("a problem");
    let plan = problem.plan(&layout.situation(), &[]).expect("a plan");
    assert_eq!(plan.len(), 2, "{plan:?}");
}

#[test]
fn heights_far_apart_against_their_noise_are_two() {
    // On the pad or on the other block. Above the pad, the second would be at 0.050 and 0.065.
    let domain = fixture("stack");
    for (kind, heights) in [("thick", [0.030, 0.035]), ("thin", [0.015, 0.035])] {
        let states = placed(&domain, kind);
        let mut found: Vec<(f64, f64)> =
            (states.iter().flat_map(|s| &s.places)).map(|p| range(p.coordinates[2])).collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        assert_eq!(found.len(), 2, "{kind}: {found:?}");
        for ((low, high), height) in found.iter().zip(heights) {
            assert!((0.5 * (low + high) - height).abs() < 2e-3 && high - low < 3e-3, "{found:?}");
        }
    }
}

#[test]
fn noise_of_2_mm_does_not_split_a_place() {
    let noise = Sensing { pose_noise_m: 2e-3, pose_noise_deg: 2.0, ..Sensing::default() };
    for seed in 0..20u64 {
        let mut draw = Draw(200 + seed);
        let demos = 5 + 5 * (seed as usize % 3);
        let mut demo = |_| {
            let pad = [draw.within(-0.2, 0.2), draw.within(0.1, 0.3), 0.0];
            let block = [draw.within(-0.3, 0.3), draw.within(-0.3, -0.1), 0.02];
            let on = pad.map(|x| draw.about(x, 5e-4));
            show(&[("pad", pad), ("block", block)], &[(1, [on[0], on[1], 0.03])])
        };
        let exact = recording((0..demos).map(&mut demo));
        let domain = learned(&noise.apply_recording(&exact, Seed::new(seed)));
        let states = placed(&domain, "block");
        assert_eq!(states.iter().map(|s| s.places.len()).collect::<Vec<_>>(), [1], "{seed}");
    }
}

#[test]
fn one_bin_is_not_split_into_half_bins() {
    for seed in 0..20u64 {
        let mut draw = Draw(300 + seed);
        let mut demo = |_| {
            let bin = [draw.within(0.5, 0.6), draw.within(0.1, 0.2), 0.0];
            let objects: Vec<(&str, [f64; 3])> = std::iter::once(("bin", bin))
                .chain(
                    (0..4)
                        .map(|_| ("cube", [draw.within(0.2, 0.4), draw.within(-0.3, 0.3), 0.015])),
                )
                .collect();
            // Two rows, as a careful hand fills a bin.
            let moves: Vec<(usize, [f64; 3])> = (1..5)
                .map(|i| {
                    let row = if i % 2 == 0 { 0.03 } else { -0.03 };
                    let at =
                        [bin[0] + draw.about(row, 4e-3), bin[1] + draw.within(-0.04, 0.04), 0.011];
                    (i, at)
                })
                .collect();
            show(&objects, &moves)
        };
        let domain = learned(&recording((0..5).map(&mut demo)));
        assert_eq!(placed(&domain, "cube").len(), 1, "{seed}");
        assert_eq!((domain.operators.len(), domain.goals.len()), (1, 1), "{seed}");
    }
}

#[test]
fn one_groove_is_not_split_into_places() {
    for seed in 0..20u64 {
        let mut draw = Draw(400 + seed);
        let demos = 5 + 5 * (seed as usize % 4);
        let mut demo = |_| {
            let rack = [draw.within(0.4, 0.6), draw.within(0.1, 0.3), 0.0];
            let roller = [draw.within(0.2, 0.6), draw.within(-0.3, 0.0), 0.01];
            let along = rack[0] + draw.within(-0.03, 0.03);
            show(
                &[("rack", rack), ("roller", roller)],
                &[(1, [along, draw.about(rack[1], 5e-4), 0.03])],
            )
        };
        let domain = learned(&recording((0..demos).map(&mut demo)));
        let states = placed(&domain, "roller");
        assert_eq!(states.iter().map(|s| s.places.len()).collect::<Vec<_>>(), [1], "{seed}");
    }
}

#[test]
fn sizes_7_mm_apart_are_told_apart() {
    let (domain, scene) = (fixture("pegs"), scene("pegs"));
    let classifier = Classifier::new(&domain);
    let states = |scene: &Snapshot| -> Vec<Option<usize>> {
        let layout = classifier.classify(scene);
        layout.located.iter().map(|l| l.fact.map(|fact| fact.state)).collect()
    };
    let found = states(&scene);
    assert!(found[1].is_some() && found[1] == found[2] && found[2] == found[3], "{found:?}");
    assert!(found[4].is_some() && found[4] != found[1], "{found:?}");
    // A size beyond both is nobody's.
    let mut larger = scene;
    larger.objects[1].pose.position[2] += 7e-3;
    assert_eq!(states(&larger)[1], None);
}

#[test]
fn what_is_put_beside_something_that_moves_belongs_to_what_stands_still() {
    // A knife and a cup are always put beside the same plate, the cup first.
    let mut right = 0;
    for seed in 0..20u64 {
        let mut draw = Draw(500 + seed);
        let (cup, knife) = ([draw.within(0.06, 0.1), 0.12], [0.15, draw.within(0.03, 0.1)]);
        let mut demo = |_| {
            let plate = [draw.within(-0.1, 0.1), draw.within(-0.1, 0.1), 0.0];
            let mut start = || [draw.within(0.4, 0.6), draw.within(-0.3, 0.3), 0.01];
            let objects = [("plate", plate), ("cup", start()), ("knife", start())];
            let mut beside = |by: [f64; 2]| {
                [draw.about(plate[0] + by[0], 1e-3), draw.about(plate[1] + by[1], 1e-3), 0.01]
            };
            let moves = [(1, beside(cup)), (2, beside(knife))];
            show(&objects, &moves)
        };
        let domain = learned(&recording((0..3).map(&mut demo)));
        let all = ["cup", "knife"].map(|kind| placed(&domain, kind)).concat();
        right += usize::from(all.iter().all(|s| s.frame.name() == "plate"));
    }
    assert!(right >= 18, "{right} of 20");
}

/// Four parts go into the four slots of a bin that stands elsewhere each time. `from` says where a part lies in a
/// demonstration.
fn into_slots(seed: u64, from: impl Fn(usize, usize, &mut Draw) -> [f64; 3]) -> Recording {
    let mut draw = Draw(seed);
    let mut demo = |demo: usize| {
        let bin = [draw.within(0.4, 0.6), draw.within(0.2, 0.3), 0.0];
        let starts: Vec<[f64; 3]> = (0..4).map(|part| from(demo, part, &mut draw)).collect();
        let slot = |part: usize, draw: &mut Draw| {
            let (x, y) = (0.06 * (part % 2) as f64 - 0.03, 0.06 * (part / 2) as f64 - 0.03);
            [bin[0] + draw.about(x, 0.003), bin[1] + draw.about(y, 0.003), 0.02]
        };
        let moves: Vec<(usize, [f64; 3])> = (0..4).map(|p| (p, slot(p, &mut draw))).collect();
        let parts = starts.iter().map(|at| ("part", *at));
        show(&parts.chain([("bin", bin)]).collect::<Vec<_>>(), &moves)
    };
    recording((0..5).map(&mut demo))
}

#[test]
fn slots_are_one_state_although_one_part_once_lay_elsewhere() {
    let heap = |draw: &mut Draw| [draw.within(0.4, 0.6), draw.within(-0.3, -0.1), 0.02];
    for seed in 0..10 {
        // The third part of the second demonstration lay on something.
        let recording = into_slots(seed, |demo, part, draw| match (demo, part) {
            (1, 2) => [0.2, -0.4, 0.09],
            _ => heap(draw),
        });
        let domain = learned(&recording);
        let placed = placed(&domain, "part");
        assert_eq!(placed.len(), 1, "seed {seed}: {:?}", placed.iter().map(|s| &s.name));
        assert_eq!(placed[0].places.iter().map(|p| p.count).sum::<usize>(), 20);
        assert_eq!(domain.operators.len(), 1);
    }
    // What comes from another place each time is another action.
    let recording = into_slots(1, |_, part, draw| match part {
        0 | 1 => heap(draw),
        _ => [draw.within(0.2, 0.3), draw.within(-0.5, -0.4), 0.09],
    });
    assert_eq!(placed(&learned(&recording), "part").len(), 2);
}

#[test]
fn what_tumbled_into_a_cup_may_lie_off_in_the_direction_that_few_demonstrations_show() {
    let mut draw = Draw(3);
    let orientations: Vec<[f64; 4]> = (0..5)
        .map(|_| {
            let q = [(); 4].map(|()| draw.within(-1.0, 1.0));
            let norm = q.iter().map(|v| v * v).sum::<f64>().sqrt();
            q.map(|v| v / norm)
        })
        .collect();
    // Along x the cube lay within 2 mm each time, by chance; along y within 14 mm.
    let (along_x, along_y) =
        ([0.001, -0.002, 0.0, 0.002, -0.001], [0.012, -0.014, 0.003, -0.011, 0.01]);
    let demo = |d: usize| {
        let cup = [0.45 + 0.02 * d as f64, 0.1 - 0.05 * (d % 3) as f64, 0.05];
        let start = [0.4 + 0.01 * (7 * d % 5) as f64, 0.3 - 0.02 * (3 * d % 5) as f64, 0.01];
        let end = [cup[0] + along_x[d], cup[1] + along_y[d], 0.015];
        let mut demo = show(&[("cube", start), ("cup", cup)], &[(0, end)]);
        for snapshot in &mut demo.snapshots[2..] {
            snapshot.objects[0].pose.orientation = orientations[d];
        }
        demo
    };
    let domain = learned(&recording((0..5).map(demo)));
    let classifier = Classifier::new(&domain);
    let holds = |x: f64, z: f64| {
        let cup = [0.5, 0.0, 0.05];
        let mut snapshot =
            show(&[("cube", [0.5 + x, 0.005, z]), ("cup", cup)], &[]).snapshots.remove(0);
        snapshot.objects[0].pose.orientation = orientations[1];
        let found = classifier.classify_object(&snapshot, 0).fact;
        found.is_some_and(|fact| domain.states[fact.state].origin == Origin::Placed)
    };
    assert!(holds(0.001, 0.015));
    assert!(holds(0.018, 0.015), "18 mm off along x");
    assert!(!holds(0.08, 0.015), "beside the cup");
    assert!(!holds(0.0, 0.05), "on the cup");
}
