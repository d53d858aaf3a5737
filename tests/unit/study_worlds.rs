//! Tests of the worlds: what they accept and refuse, what they record, and how they are scored.

#[path = "study_worlds_scoring.rs"]
mod scoring;

use std::collections::HashSet;

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::episode::carry_out;
use super::explore::explore;
use super::run::{isometry as iso, pose};
use super::score::{SaidState, score_needs, score_states};
use super::spec::Start;
use super::truth::{Extent, TrueState};
use super::*;
use crate::robot::Pose;
use crate::robot::pose::quaternion_array;

fn body(run: &Run, id: &str) -> usize {
    run.bodies.iter().position(|body| &*body.id == id).unwrap()
}

/// Whether the object is in the state.
fn is_in(run: &Run, object: &str, state: &str) -> bool {
    run.is_in(body(run, object), state)
}

/// The pose of an object.
fn find(run: &Run, object: &str) -> Isometry3<f64> {
    run.bodies[body(run, object)].pose
}

fn stages() -> [Stage; 3] {
    [Stage::Demonstration(0), Stage::Demonstration(1), Stage::Test]
}

fn of(name: &str) -> World {
    named(name).unwrap_or_else(|| panic!("no world {name}"))
}

impl World {
    fn state(&self, name: &str) -> &TrueState {
        self.0.states.iter().find(|state| state.name == name).unwrap()
    }
}

/// Every target that puts an object of the state's kind exactly into the state.
fn targets(world: &World, run: &Run, state: &str) -> Vec<(Arc<str>, Pose)> {
    let state = world.state(state);
    let scene = run.snapshot();
    let frames: Vec<(Option<&str>, Isometry3<f64>)> = match state.frame {
        None => vec![(None, Isometry3::identity())],
        Some(kind) => {
            let of_kind = scene.objects.iter().filter(|o| &*o.kind == kind);
            of_kind.map(|o| (Some(&*o.id), iso(&o.pose))).collect()
        }
    };
    let mut found = Vec::new();
    for object in scene.objects.iter().filter(|o| &*o.kind == state.kind) {
        for (id, frame) in &frames {
            if *id != Some(&*object.id) {
                let place = |p| (object.id.clone(), pose(&(frame * iso(p))));
                found.extend(state.places.iter().map(place));
            }
        }
    }
    found
}

#[test]
fn there_are_twenty_plain_worlds_and_each_world_names_only_its_own_kinds_and_states() {
    let worlds = all();
    assert_eq!((plain().len(), varied().len()), (20, worlds.len() - 20));
    let names: HashSet<&str> = worlds.iter().map(World::name).collect();
    assert_eq!(names.len(), worlds.len());
    for world in &worlds {
        let (name, spec) = (world.name(), &world.0);
        assert!(!world.about().is_empty() && !spec.goal.is_empty() && !spec.jobs.is_empty());
        let kinds: HashSet<&str> = spec.kinds.iter().map(|kind| kind.name).collect();
        for state in &spec.states {
            assert!(kinds.contains(state.kind), "{name}: {}", state.kind);
            assert!(state.frame.is_none_or(|f| kinds.contains(f)), "{name}: {:?}", state.frame);
        }
        let needs =
            spec.states.iter().flat_map(|s| s.needs.iter().chain(&s.either).chain(&s.reach));
        let sides = spec.triggers.iter().flat_map(|t| [t.when, t.then, t.otherwise]);
        let habits = spec.habits.iter().flat_map(|(a, b)| [*a, *b]);
        let goals = spec.goal.iter().chain(&spec.or_goal).map(|g| g.state);
        let own = spec.jobs.iter().map(|job| job.to);
        let starts = spec.kinds.iter().flat_map(|kind| match kind.start {
            Start::In(one) => vec![one],
            Start::Either(one, other) | Start::Seldom { usual: one, other, .. } => vec![one, other],
            Start::Fixed(_) | Start::Anywhere { .. } => Vec::new(),
        });
        let named = needs.map(Need::state).chain(sides).chain(habits).chain(goals).chain(own);
        for state in named.chain(starts) {
            assert!(spec.states.iter().any(|s| s.name == state), "{name}: {state}");
        }
    }
}

#[test]
fn a_move_against_an_order_that_the_world_needs_is_refused_and_changes_nothing() {
    // Each of these states cannot be entered from any scene at the beginning of a demonstration with even number.
    let early = [
        ("nuts", "BOLT_IN_NUT"),
        ("nuts_distractors", "BOLT_IN_NUT"),
        ("nuts_jig_anywhere", "BOLT_IN_NUT"),
        ("nuts_nut_first", "BOLT_IN_NUT"),
        ("flange", "COVER_ON_FLANGE"),
        ("keyed_peg", "CAP_ON_PEG"),
        ("tower", "GREEN_ON_RED"),
        ("tower", "BLUE_ON_GREEN"),
        ("tower_blocked", "RED_ON_BASE"),
        ("tower_blocked", "GREEN_ON_RED"),
        ("cup_turned", "BALL_IN_CUP"),
        ("drawer", "BOX_IN_DRAWER"),
        ("gate", "PARCEL_BEHIND_GATE"),
        ("gate", "GATE_UP"),
        ("lever", "PART_IN_CLAMP"),
    ];
    for (name, state) in early {
        let world = of(name);
        for seed in 0..4 {
            let mut run = world.begin(Seed::new(seed), Stage::Demonstration(0));
            let targets = targets(&world, &run, state);
            assert!(!targets.is_empty(), "{name}");
            for (object, target) in targets {
                let before = run.snapshot();
                if run.act(&object, &target) {
                    // A cap cannot stay on a peg that lies on its side: it ends beside it.
                    assert!(!is_in(&run, &object, state), "{name}: {object} into {state}");
                    assert_eq!(name, "keyed_peg");
                } else {
                    assert_eq!(run.snapshot(), before, "{name}");
                }
            }
        }
    }
}

#[test]
fn every_need_of_every_action_is_enforced() {
    // At the beginning no action with needs can be carried out at any exact target; the demonstrator can do it later.
    for world in plain() {
        for action in world.0.jobs.iter().filter(|job| world.0.needs_of(job.to).next().is_some()) {
            let (mut refused, mut accepted) = (0, 0);
            for seed in 0..4 {
                let mut run = world.begin(Seed::new(seed), Stage::Demonstration(0));
                if !targets(&world, &run, action.to).iter().any(|(object, target)| {
                    run.act(object, target) && is_in(&run, object, action.to)
                }) {
                    refused += 1;
                }
                let mut run = world.begin(Seed::new(seed), Stage::Demonstration(0));
                while let Some((object, target)) = run.next_move() {
                    run.act(&object, &target);
                }
                accepted += usize::from(run.solved());
            }
            assert_eq!((refused, accepted), (4, 4), "{}: {}", world.name(), action.to);
        }
    }
}

#[test]
fn a_target_within_the_tolerance_is_accepted_and_one_outside_is_refused() {
    let (mut off, mut tilted) = (0, 0);
    for world in plain() {
        let jobs = &world.0.jobs;
        let mut run = world.begin(Seed::new(3), Stage::Demonstration(0));
        while let Some((object, target)) = run.next_move() {
            let scene = run.snapshot();
            let kind = &scene.objects.iter().find(|o| o.id == object).unwrap().kind;
            let mut own = jobs.iter().map(|job| world.state(job.to)).filter(|s| *s.kind == **kind);
            if own.all(TrueState::is_spot) && !jobs.iter().any(|job| job.in_place) {
                let mut far = target;
                far.position[0] += 0.035;
                far.position[2] += 0.03;
                assert!(!run.act(&object, &far), "{}: {object}", world.name());
                off += 1;
                let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 0.4);
                let mut over = target;
                over.orientation = quaternion_array(&(turn * target.rotation()));
                assert!(!run.act(&object, &over), "{}: {object} tilted", world.name());
                tilted += 1;
                let mut near = target;
                near.position[2] += 0.001;
                assert!(run.act(&object, &near), "{}: {object} near", world.name());
            } else {
                assert!(run.act(&object, &target));
            }
        }
        assert!(run.solved(), "{}", world.name());
    }
    assert!(off > 30 && tilted > 30, "{off} {tilted}");
}

#[test]
fn nobody_moves_fixtures_or_what_carries_something() {
    let world = of("tower");
    let mut run = world.begin(Seed::new(2), Stage::Test);
    let away = targets(&world, &run, "RED_ON_TABLE")[0].1;
    assert!(!run.act("base_0", &away));
    assert!(!run.act("nobody", &away));
    while let Some((object, target)) = run.next_move() {
        run.act(&object, &target);
    }
    let red = find(&run, "red_0").translation.z;
    let loaded = if red > 0.035 { "red_0" } else { "red_1" };
    let mut moved = away;
    moved.position = [-0.34, 0.06, 0.02];
    assert!(!run.act(loaded, &moved));
}

#[test]
fn the_gate_follows_the_button() {
    let world = of("gate");
    let mut run = world.begin(Seed::new(4), Stage::Test);
    let gate = |run: &Run| find(run, "gate_0").translation.z;
    let weight = pose(&find(&run, "weight_0"));
    assert!((gate(&run) - 0.1).abs() < 1e-3);
    let on = targets(&world, &run, "WEIGHT_ON_BUTTON")[0].1;
    assert!(run.act("weight_0", &on));
    assert!((gate(&run) - 0.3).abs() < 1e-3);
    assert!(run.act("weight_0", &weight));
    assert!((gate(&run) - 0.1).abs() < 1e-3);
}

#[test]
fn objects_do_not_overlap_when_a_run_begins() {
    let mut checked = 0;
    for world in all() {
        for seed in 0..40 {
            for stage in stages() {
                let run = world.begin(Seed::new(seed), stage);
                for (index, body) in run.bodies.iter().enumerate() {
                    let heap = body.at.is_some_and(|at| {
                        let extent = run.spec.states[at.rule].extent;
                        !matches!(extent, Extent::Area { depth_m: 0.0, .. })
                    });
                    if !heap {
                        let on = body.at.and_then(|at| at.on);
                        let radius = run.kind(index).radius_m;
                        let clear = run.clear(Some(index), radius, on, &body.pose);
                        assert!(clear, "{} {seed} {stage:?}: {}", world.name(), body.id);
                        checked += 1;
                    }
                }
            }
        }
    }
    assert!(checked > 5000, "{checked}");
}

#[test]
fn the_truth_is_shown_beside_the_snapshots_of_the_recording() {
    for world in all() {
        let recording = world.record(3, Seed::new(9));
        let shown = world.show(3, Seed::new(9));
        assert_eq!(shown.recording, recording);
        for ((demo, states), labels) in recording.demos.iter().zip(&shown.states).zip(&shown.labels)
        {
            assert_eq!((states.len(), labels.len()), (demo.snapshots.len(), demo.snapshots.len()));
            let contacts = demo.snapshots.iter().map(|s| s.event == Some(SnapshotEvent::Contact));
            assert!(labels.iter().map(Option::is_some).eq(contacts), "{}", world.name());
        }
    }
}
