//! Cleanup among 25,000 vectors of 1,000 dimensions, compared with the time to read the vectors, and decoding of sums
//! of bound pairs.

#![allow(clippy::unwrap_used, clippy::expect_used)]
#![allow(missing_docs)]

use std::time::Duration;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use multiversion::multiversion;
use std::hint::black_box;
use symbolt::sim::Seed;
use symbolt::spa::{Algebra, Hrr, ItemMemory, PairDecoder, random_pointer};

/// Reads every number once. A query in single precision cannot be faster than this.
#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1"))]
fn read_all(values: &[f32]) -> f32 {
    let mut sums = [0.0f32; 64];
    for chunk in values.as_chunks::<64>().0 {
        for lane in 0..64 {
            sums[lane] += chunk[lane];
        }
    }
    sums.iter().sum()
}

fn memory(c: &mut Criterion) {
    let (items, dim, batch) = (25_000u64, 1_000usize, 256u64);
    let rows: Vec<f32> = (0..items).flat_map(|i| random_pointer(dim, Seed::new(i))).collect();
    let memory = ItemMemory::new(rows.clone(), dim).expect("sound");
    // Half of the queries are noisy items; the others are unrelated to all items.
    let queries: Vec<f32> = (0..batch)
        .flat_map(|q| {
            let item = &rows[(q as usize * 97) * dim..(q as usize * 97 + 1) * dim];
            let noise = random_pointer(dim, Seed::new(1_000_000 + q));
            let share = if q % 2 == 0 { 0.5 } else { 0.0 };
            item.iter().zip(noise).map(move |(i, n)| share * i + n).collect::<Vec<_>>()
        })
        .collect();
    let found = memory.best_batch(&queries);
    let right = (0..batch)
        .step_by(2)
        .filter(|q| found[*q as usize].is_some_and(|f| f.index == *q as usize * 97));
    assert_eq!(right.count() as u64, batch / 2);

    let mut group = c.benchmark_group("memory");
    group.measurement_time(Duration::from_secs(4)).sample_size(20);
    let shape = "25000x1000";
    group.throughput(Throughput::Elements(1));
    group.bench_function(BenchmarkId::new("read_all", shape), |b| {
        b.iter(|| read_all(black_box(&rows)));
    });
    group.bench_function(BenchmarkId::new("similarities", shape), |b| {
        let mut out = vec![0.0; items as usize];
        b.iter(|| memory.similarities_into(black_box(&queries[..dim]), &mut out));
    });
    for (name, query) in [("noisy_item", &queries[..dim]), ("nothing", &queries[dim..2 * dim])] {
        group.bench_function(BenchmarkId::new(format!("cleanup_{name}"), shape), |b| {
            b.iter(|| memory.best(black_box(query)));
        });
    }
    group.throughput(Throughput::Elements(batch));
    group.bench_function(BenchmarkId::new("cleanup_batch_256", shape), |b| {
        b.iter(|| memory.best_batch(black_box(&queries)));
    });
    group.finish();
}

/// Decodes all fillers of a sum of bound pairs, compared with unbinding a single filler.
fn pairs(c: &mut Criterion) {
    let mut group = c.benchmark_group("pairs");
    for (dim, bound, items) in [(256usize, 4u64, 64u64), (256, 16, 256)] {
        let vectors = |from: u64, count: u64| -> Vec<f32> {
            (from..from + count).flat_map(|i| random_pointer(dim, Seed::new(i))).collect()
        };
        let (roles, fillers) = (vectors(0, bound), vectors(1_000, items));
        let (mut work, mut pair, mut sum) = (Hrr.scratch(dim), vec![0.0; dim], vec![0.0; dim]);
        for (role, filler) in roles.chunks(dim).zip(fillers.chunks(dim)) {
            Hrr.bind_into(role, filler, &mut pair, &mut work);
            sum.iter_mut().zip(&pair).for_each(|(s, p)| *s += p);
        }
        let shape = format!("{bound} of {items}, D {dim}");
        let memory = ItemMemory::new(fillers.clone(), dim).expect("sound");
        group.bench_function(BenchmarkId::new("one_linearly", &shape), |b| {
            let mut inverse = vec![0.0; dim];
            Hrr.inverse_into(&roles[..dim], &mut inverse);
            b.iter(|| {
                Hrr.bind_into(black_box(&sum), &inverse, &mut pair, &mut work);
                memory.best(&pair)
            });
        });
        let mut decoder = PairDecoder::new(dim, &roles, &fillers).expect("sound");
        group.bench_function(BenchmarkId::new("all_by_decoder", &shape), |b| {
            b.iter(|| decoder.read(black_box(&sum)).len());
        });
    }
    group.finish();
}

criterion_group!(benches, memory, pairs);
criterion_main!(benches);
