//! Learning from demonstrations, and clustering, which takes most of the time for long recordings.
//!
//! To measure on one core: `RAYON_NUM_THREADS=1 cargo bench --package symbolt-benches --bench learn`.

#![allow(clippy::unwrap_used, clippy::expect_used)]
#![allow(missing_docs)]

use std::time::Duration;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rand::RngExt;
use std::hint::black_box;
use symbolt::sim::Seed;
use symbolt::study::worlds;
use symbolt::task::learn::{Dendrogram, Settings, distance_matrix, learn};
use symbolt::task::tasks::nuts_and_bolts::SyntheticDemonstrations;

/// Returns positions as in a recording: most lie anywhere at two heights, the others at two places.
fn poses(count: usize) -> Vec<[f64; 3]> {
    let mut rng = Seed::new(1).derive("bench", "poses").rng();
    let mut spread = |width: f64| width * rng.random::<f64>();
    (0..count)
        .map(|i| match i % 5 {
            0 | 1 => [spread(0.5), spread(1.0), 0.0016 + spread(2e-5)],
            2 => [0.30 + spread(4e-3), -0.6 + spread(4e-3), 0.0522 + spread(2e-5)],
            3 => [0.12 + spread(4e-3), -0.5 + spread(4e-3), 0.0644 + spread(2e-5)],
            _ => [spread(0.5), spread(1.0), 0.0272 + spread(2e-5)],
        })
        .collect()
}

fn learning(c: &mut Criterion) {
    let mut group = c.benchmark_group("learn");
    let spec = SyntheticDemonstrations {
        demos: 7,
        nuts: 3,
        bolts: 3,
        events: false,
        ..SyntheticDemonstrations::default()
    };
    let recording = spec.record(Seed::new(1)).expect("sound").recording;
    group.throughput(Throughput::Elements(7));
    group.bench_function(BenchmarkId::new("demonstrations", 7), |b| {
        b.iter(|| learn(black_box(&recording), &Settings::paper()).expect("learns"));
    });
    group.bench_function(BenchmarkId::new("relational_demonstrations", 7), |b| {
        b.iter(|| learn(black_box(&recording), &Settings::default()).expect("learns"));
    });
    // About 5,000 rests of two kinds.
    let bins = worlds::named("bins").expect("it exists").record(620, Seed::new(1));
    group.bench_function(BenchmarkId::new("relational_rests", 5_000), |b| {
        b.iter(|| learn(black_box(&bins), &Settings::default()).expect("learns"));
    });
    group.sample_size(10).measurement_time(Duration::from_secs(5));
    for count in [300, 2_000, 5_000] {
        let points = poses(count);
        group.throughput(Throughput::Elements(count as u64));
        group.bench_function(BenchmarkId::new("distances", count), |b| {
            b.iter(|| distance_matrix(black_box(&points), -2.0));
        });
        group.bench_function(BenchmarkId::new("distances_linkage_cut", count), |b| {
            b.iter(|| {
                let tree = Dendrogram::new(black_box(&points), -2.0, "part").expect("not too many");
                tree.cut(0.001)
            });
        });
    }
    group.finish();
}

criterion_group!(benches, learning);
criterion_main!(benches);
