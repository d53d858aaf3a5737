//! What the machine can do: bare loops that only move memory, or only compute, and the name of the machine.

use std::hint::black_box;
use std::panic::resume_unwind;
use std::path::Path;
use std::sync::Barrier;
use std::time::{Duration, Instant};

use multiversion::multiversion;

use super::Measured;
use crate::files::read_beginning;
use crate::neurons::Traffic;
use crate::sim::Real;

/// Speeds of bare loops on as many threads as a run had.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Bytes per second of a loop that reads and updates as much memory as the neurons of the run do in a tick. What fits
    /// a cache comes from there, as in the run.
    pub bytes_per_s: f64,
    /// Multiplications and additions per second of a loop without memory.
    pub operations_per_s: f64,
}

/// The least time of a tick, as a machine's limits give it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bound {
    /// Nanoseconds of a neuron's tick.
    pub ns_per_neuron_step: f64,
    /// Whether memory takes longer than arithmetic.
    pub by_memory: bool,
}

/// Rounds of each loop, of which the fastest counts, and the time of one.
const ROUNDS: usize = 5;
const ROUND: Duration = Duration::from_millis(20);

/// Steps of the loop that computes, between two looks at the clock.
const STEPS: usize = 4_096;
/// Numbers that the loop computes at once: enough for all registers of any processor.
const LANES: usize = 128;

impl Limits {
    /// Measures the limits for a run. Takes a fifth of a second.
    pub fn of(run: &Measured) -> Self {
        let threads = run.threads.max(1);
        let share = |bytes: f64| (bytes / threads as f64) as usize / size_of::<Real>() + 1;
        let (read, kept) = (share(run.traffic.read), share(run.traffic.written));
        let moved = Traffic { read: read as f64, written: kept as f64, ..Traffic::default() };
        let bytes_per_s = fastest(threads, || {
            let (read, mut kept) = (vec![1.0; read], vec![1.0; kept]);
            move || {
                black_box(sum(black_box(&read)));
                update(black_box(&mut kept));
                moved.bytes() * size_of::<Real>() as f64
            }
        });
        let operations_per_s = fastest(threads, || {
            let mut lanes = [1.0; LANES];
            move || {
                compute(black_box(&mut lanes));
                (2 * LANES * STEPS) as f64
            }
        });
        Self { bytes_per_s, operations_per_s }
    }

    /// Returns the least time that the neurons of a run need; `None` without neurons.
    pub fn bound(&self, run: &Measured) -> Option<Bound> {
        let memory_s = run.traffic.bytes() / self.bytes_per_s;
        let arithmetic_s = run.traffic.operations / self.operations_per_s;
        (run.neurons > 0).then(|| Bound {
            ns_per_neuron_step: memory_s.max(arithmetic_s) * 1e9 / run.neurons as f64,
            by_memory: memory_s >= arithmetic_s,
        })
    }
}

/// Runs loops on several threads at the same time. Returns what they do in a second, all together, in the fastest round.
fn fastest<W: FnMut() -> f64>(threads: usize, make: impl Fn() -> W + Sync) -> f64 {
    let barrier = Barrier::new(threads);
    let rounds = || {
        let mut work = make();
        work();
        std::array::from_fn::<f64, ROUNDS, _>(|_| {
            barrier.wait();
            let (begun, mut done) = (Instant::now(), 0.0);
            while begun.elapsed() < ROUND {
                done += work();
            }
            done / begun.elapsed().as_secs_f64()
        })
    };
    let all: Vec<[f64; ROUNDS]> = std::thread::scope(|scope| {
        let started: Vec<_> = (1..threads).map(|_| scope.spawn(rounds)).collect();
        let own = rounds();
        let others =
            started.into_iter().map(|thread| thread.join().unwrap_or_else(|e| resume_unwind(e)));
        others.chain([own]).collect()
    });
    let of_round = |round: usize| all.iter().map(|speeds| speeds[round]).sum();
    (0..ROUNDS).map(of_round).fold(0.0, f64::max)
}

/// Adds numbers in as many lanes as the widest registers take.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "x86_64+sse4.1"))]
fn sum(numbers: &[Real]) -> Real {
    let mut sums = [0.0; LANES];
    let (chunks, rest) = numbers.as_chunks::<LANES>();
    for chunk in chunks {
        for lane in 0..LANES {
            sums[lane] += chunk[lane];
        }
    }
    sums.iter().chain(rest).sum()
}

#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "x86_64+sse4.1"))]
fn update(numbers: &mut [Real]) {
    for number in numbers {
        *number = 0.5 * *number + 0.5;
    }
}

#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "x86_64+sse4.1"))]
fn compute(lanes: &mut [Real; LANES]) {
    let mut own = *lanes;
    for _ in 0..STEPS {
        for lane in &mut own {
            *lane = 0.999 * *lane + 0.001;
        }
    }
    *lanes = own;
}

/// Returns the machine in words: processor, number of cores that this process may use, and widest registers.
pub fn machine() -> String {
    let listed = read_beginning(Path::new("/proc/cpuinfo"), 1 << 12).unwrap_or_default();
    let listed = String::from_utf8_lossy(&listed);
    let name = listed.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    let name = name.map_or(std::env::consts::ARCH, |(_, name)| name.trim());
    let cores = match std::thread::available_parallelism().map_or(1, usize::from) {
        1 => "1 core".to_owned(),
        cores => format!("{cores} cores"),
    };
    match registers() {
        "" => format!("{name}, {cores}"),
        registers => format!("{name}, {cores}, {registers}"),
    }
}

#[cfg(target_arch = "x86_64")]
fn registers() -> &'static str {
    match (is_x86_feature_detected!("avx512f"), is_x86_feature_detected!("avx2")) {
        (true, _) => "AVX-512",
        (_, true) => "AVX2",
        _ => "SSE",
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn registers() -> &'static str {
    ""
}
