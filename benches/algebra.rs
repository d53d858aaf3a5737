//! Binding and unbinding for several dimensions, and binding computed as the sum that defines it.

#![allow(clippy::unwrap_used, clippy::expect_used)]
#![allow(missing_docs)]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use symbolt::sim::Seed;
use symbolt::spa::{Algebra, Hrr, random_pointer};

fn algebra(c: &mut Criterion) {
    let mut group = c.benchmark_group("algebra");
    group.throughput(Throughput::Elements(1));
    for dim in [256, 512, 1024] {
        let (a, b) = (random_pointer(dim, Seed::new(1)), random_pointer(dim, Seed::new(2)));
        let (mut out, mut inverse) = (vec![0.0f32; dim], vec![0.0f32; dim]);
        let mut work = Hrr.scratch(dim);
        group.bench_function(BenchmarkId::new("bind", dim), |bench| {
            bench.iter(|| Hrr.bind_into(black_box(&a), black_box(&b), &mut out, &mut work));
        });
        group.bench_function(BenchmarkId::new("unbind", dim), |bench| {
            bench.iter(|| {
                Hrr.inverse_into(black_box(&b), &mut inverse);
                Hrr.bind_into(black_box(&a), &inverse, &mut out, &mut work);
            });
        });
    }
    let dim = 256;
    let (a, b) = (random_pointer(dim, Seed::new(1)), random_pointer(dim, Seed::new(2)));
    let doubled = [&b[..], &b[..]].concat();
    group.bench_function(BenchmarkId::new("bind_by_definition", dim), |bench| {
        bench.iter(|| {
            let bound: Vec<f32> =
                (0..dim).map(|j| (0..dim).map(|k| a[k] * doubled[dim + j - k]).sum()).collect();
            black_box(bound)
        });
    });
    group.finish();
}

criterion_group!(benches, algebra);
criterion_main!(benches);
