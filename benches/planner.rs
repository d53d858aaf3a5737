//! The planner graph: a tick, a decision, and the build.

#![allow(clippy::unwrap_used, clippy::expect_used)]
#![allow(missing_docs)]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use symbolt::neurons::{LifSpec, Population};
use symbolt::plan::goal_sets::{GoalSetSpec, StripsWorld, pursue};
use symbolt::sim::{Seed, SimDuration};
use symbolt::study::problems::{Breakfast, Kitchen, breakfast};
use symbolt::task::planner::{Planner, PlannerSpec, Unbinding};
use symbolt::task::{Commitment, DomainBuilder};

fn planner(c: &mut Criterion) {
    let domain = DomainBuilder::new()
        .action("PUT_NUT_IN_JIG", ["NUT_ON_TABLE"], ["NUT_IN_JIG"])
        .action("PUT_BOLT_IN_JIG", ["BOLT_ON_TABLE"], ["BOLT_IN_JIG"])
        .action("ASSEMBLE", ["NUT_IN_JIG", "BOLT_IN_JIG"], ["BOLT_ASSEMBLED"])
        .build()
        .expect("sound");
    let world = domain.world(["NUT_ON_TABLE", "BOLT_ON_TABLE"]).expect("states");
    let goal = domain.state("BOLT_ASSEMBLED").expect("a state");
    let mut group = c.benchmark_group("planner");
    let ticks = 200;
    for (name, unbinding) in [("tick", Unbinding::Fixed), ("tick_products", Unbinding::Products)] {
        let spec = PlannerSpec { unbinding, ..PlannerSpec::default() };
        let planner = Planner::new(&domain, spec, Seed::new(1)).expect("builds");
        let mut sim = planner.simulator(&world, goal).expect("starts");
        group.throughput(Throughput::Elements(ticks));
        group.bench_function(BenchmarkId::new(name, 256), |b| {
            b.iter(|| {
                sim.reset().expect("resets");
                sim.run_for(SimDuration::from_millis(ticks)).expect("runs")
            });
        });
    }
    group.throughput(Throughput::Elements(1));
    for (name, commitment) in
        [("decide_proven", Commitment::Proven), ("decide_first", Commitment::First)]
    {
        let spec = PlannerSpec { commitment, ..PlannerSpec::default() };
        let planner = Planner::new(&domain, spec, Seed::new(1)).expect("builds");
        group.bench_function(BenchmarkId::new(name, 256), |b| {
            b.iter(|| planner.decide(&world, goal).expect("decides"));
        });
    }
    group.bench_function(BenchmarkId::new("build", 256), |b| {
        b.iter(|| Planner::new(&domain, PlannerSpec::default(), Seed::new(1)).expect("builds"));
    });
    group.finish();
}

/// The planner of goal sets in spikes: a build and 300 simulated ms, in which it only plans.
fn goal_sets(c: &mut Criterion) {
    let mut group = c.benchmark_group("goal_sets");
    let ms = 300;
    group.throughput(Throughput::Elements(ms));
    group.sample_size(10);
    let kitchen = Kitchen::default().problem(5).expect("a problem").grounded;
    let tea = breakfast(Breakfast::TeaAndToast).expect("a problem").grounded;
    for (name, problem) in [("kitchen", kitchen), ("breakfast", tea)] {
        for slots in [24, 48] {
            let spec = GoalSetSpec {
                slots: Some(slots),
                limit: SimDuration::from_millis(ms),
                population: Population::Lif(LifSpec::default()),
                ..GoalSetSpec::default()
            };
            group.bench_function(BenchmarkId::new(name, slots), |b| {
                b.iter(|| {
                    let world = StripsWorld::new(&problem, SimDuration::from_millis(100));
                    pursue(&problem, world, &spec, Seed::new(1)).expect("runs")
                });
            });
        }
    }
    group.finish();
}

criterion_group!(benches, planner, goal_sets);
criterion_main!(benches);
