//! A physics step, the inverse kinematics, the plan of a skill, and a whole episode.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::hint::black_box;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use symbolt::robot::Pose;
use symbolt::robot::SkillReport;
use symbolt::robot::arm::inverse_kinematics;
use symbolt::robot::scene::Scene;
use symbolt::robot::skill::{Robot, Target};
use symbolt::sim::Seed;
use symbolt::task::demonstrate;
use symbolt::task::execute::{EpisodeSpec, episode};
use symbolt::task::learn::{Settings, learn};
use symbolt::task::planner::{PlannerBuild, PlannerKind};
use symbolt::task::tasks::Task;
use symbolt::task::tasks::nuts_and_bolts::NutsAndBolts;

fn target(spec: &NutsAndBolts) -> Target {
    let [x, y] = spec.jig.pocket;
    Target::upright([x, y, spec.jig.pocket_floor_m + 0.008])
}

fn built(spec: &NutsAndBolts) -> Scene {
    Scene::new(spec.scene(Seed::new(1)).expect("it can be drawn")).expect("it can be built")
}

fn begin(robot: &mut Robot, scene: &Scene, spec: &NutsAndBolts) -> Result<(), SkillReport> {
    robot.begin(&scene.sensed(), 0, target(spec), &spec.grasps(&scene.sensed(), 0), None)
}

fn world(c: &mut Criterion) {
    let mut group = c.benchmark_group("world");
    for parts in [1, 3] {
        let spec = NutsAndBolts { nuts: parts, bolts: parts, ..NutsAndBolts::default() };
        let mut scene = built(&spec);
        group.bench_function(BenchmarkId::new("step_at_rest", parts), |b| b.iter(|| scene.step()));
        // The arm moves a nut repeatedly. Each measurement is a single step.
        let mut robot = Robot::default();
        group.bench_function(BenchmarkId::new("step_moving", parts), |b| {
            b.iter(|| {
                if !robot.busy() {
                    scene = built(&spec);
                    robot = Robot::default();
                    begin(&mut robot, &scene, &spec).expect("it is within reach");
                }
                robot.step(&mut scene)
            });
        });
    }
    let above = Pose { position: [0.5, 0.1, 0.2], orientation: [1.0, 0.0, 0.0, 0.0] };
    let near = [0.1, -0.5, 0.1, -2.3, 0.1, 1.8, 0.8];
    group.bench_function("inverse_kinematics", |b| {
        b.iter(|| inverse_kinematics(black_box(&above), &near).expect("it is within reach"));
    });
    let spec = NutsAndBolts::default();
    let scene = built(&spec);
    // A plan has postures for approach, grasp, lift and placing, with their collision checks.
    group.bench_function("plan_a_skill", |b| {
        b.iter(|| {
            let mut robot = Robot::default();
            black_box(begin(&mut robot, &scene, &spec)).expect("it is within reach");
        });
    });
    let shown = demonstrate(&spec, 2, Seed::new(1)).expect("sound");
    let domain = learn(&shown.recording, &Settings::paper()).expect("teaches").domain;
    let build = PlannerBuild { kind: PlannerKind::Chain, ..PlannerBuild::default() };
    group.sample_size(10).measurement_time(Duration::from_secs(40));
    group.bench_function("episode", |b| {
        b.iter(|| {
            let spec = EpisodeSpec::default();
            episode(&domain, &build, &spec, Seed::new(5)).expect("runs")
        });
    });
    group.finish();
}

criterion_group!(benches, world);
criterion_main!(benches);
