//! The standard spiking networks: 300 simulated milliseconds of each, and its build. A bare loop over
//! voltages is `graph/lif_bank`.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::hint::black_box;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use symbolt::task::standard::{Model, Standard};

fn neurons(c: &mut Criterion) {
    let mut group = c.benchmark_group("neurons");
    group.sample_size(10).measurement_time(Duration::from_secs(5));
    for (name, model) in Model::ALL {
        let spec = Standard { sim_ms: 300, ..Standard::default() };
        let built = spec.build(model).expect("builds");
        let neurons = built.run().expect("runs").neurons as u64;
        // Elements are neurons times ticks.
        group.throughput(Throughput::Elements(300 * neurons));
        group.bench_function(BenchmarkId::new("run_300_ms", name), |b| {
            b.iter(|| black_box(built.run()).expect("runs"));
        });
        group.throughput(Throughput::Elements(neurons));
        group.bench_function(BenchmarkId::new("build", name), |b| {
            b.iter(|| black_box(spec.build(model)).expect("builds"));
        });
    }
    group.finish();
}

criterion_group!(benches, neurons);
criterion_main!(benches);
