//! Long recordings: learning takes time that grows with the recording, and reading and classifying a bounded part of memory.

#![allow(clippy::expect_used)]

use std::time::{Duration, Instant};

use rand::RngExt;
use symbolt::robot::Pose;
use symbolt::sim::Seed;
use symbolt::task::learn::{Learned, Settings, learn};
use symbolt::task::{Demonstration, ObjectPose, Recording, Snapshot};

/// How a long recording was made.
#[derive(Clone, Copy)]
struct Shape {
    demos: usize,
    snapshots: usize,
    objects: usize,
    /// Snapshots that a move lasts; 1 if objects are seen at rest alone.
    carry: usize,
    noise_m: f64,
}

/// Demonstrations without events in which each object in turn is put from anywhere on the table to its place, one of four.
fn record(shape: Shape, seed: u64) -> Recording {
    let mut rng = Seed::new(seed).rng();
    let names: Vec<std::sync::Arc<str>> =
        (0..shape.objects).map(|o| format!("o{o}").into()).collect();
    let mut demo = |number: usize| {
        let mut at: Vec<[f64; 3]> = (0..shape.objects)
            .map(|_| [rng.random::<f64>() - 0.5, rng.random::<f64>() - 0.5, 0.03])
            .collect();
        let places: Vec<[f64; 3]> = (0..shape.objects)
            .map(|o| {
                let place = 0.05 * rng.random_range(0..4) as f64;
                [0.8, 0.2 * o as f64 + place, 0.05 + 2e-4 * rng.random::<f64>()]
            })
            .collect();
        let per = shape.snapshots / shape.objects;
        let snapshots = (0..shape.snapshots).map(|s| {
            let (moving, step) = ((s / per).min(shape.objects - 1), s % per);
            let begin = per.saturating_sub(shape.carry + 1);
            if step >= begin && step <= begin + shape.carry {
                let left = (begin + shape.carry - step) as f64;
                let (from, to) = (at[moving], places[moving]);
                at[moving] =
                    std::array::from_fn(|i| to[i] + (from[i] - to[i]) * left / (left + 1.0));
            }
            let objects = names.iter().zip(&at).map(|(name, at)| {
                let off = |v: f64| v + shape.noise_m * (rng.random::<f64>() - 0.5);
                ObjectPose { id: name.clone(), kind: name.clone(), pose: Pose::at(at.map(off)) }
            });
            let objects = objects.collect();
            Snapshot { number: s as u64, objects, ..Snapshot::default() }
        });
        Demonstration { number: number as u64, snapshots: snapshots.collect() }
    };
    Recording { demos: (0..shape.demos).map(&mut demo).collect() }
}

/// Learns three times. Returns what was learned and the least time that it took.
fn timed(recording: &Recording) -> (Learned, Duration) {
    let runs = (0..3).map(|_| {
        let begin = Instant::now();
        let learned = learn(recording, &Settings::default()).expect("it learns");
        (learned, begin.elapsed())
    });
    runs.min_by_key(|(_, took)| *took).expect("three runs")
}

const SHAPES: [Shape; 4] = [
    Shape { demos: 250, snapshots: 4, objects: 1, carry: 1, noise_m: 0.0 },
    Shape { demos: 60, snapshots: 16, objects: 4, carry: 1, noise_m: 0.0 },
    Shape { demos: 60, snapshots: 16, objects: 2, carry: 1, noise_m: 1e-3 },
    Shape { demos: 40, snapshots: 60, objects: 1, carry: 40, noise_m: 0.0 },
];

#[test]
fn learning_from_sixteen_times_the_demonstrations_takes_no_hundred_times_as_long() {
    for (index, shape) in SHAPES.into_iter().enumerate() {
        // From this size on, the clusters of a kind are found from a sample of its poses.
        let small = Shape { demos: 4 * shape.demos, ..shape };
        let large = Shape { demos: 16 * small.demos, ..shape };
        let (few, short) = timed(&record(small, 1));
        let (many, long) = timed(&record(large, 1));
        let ratio = long.as_secs_f64() / short.as_secs_f64();
        println!("{index}: {short:?} {long:?} {ratio:.1}");
        assert!(ratio < 40.0, "shape {index}: {ratio:.1} times: {short:?}, {long:?}");
        for learned in [&few, &many] {
            let domain = &learned.domain;
            assert!(domain.states.len() >= 2 * shape.objects, "shape {index}: {:?}", domain.states);
            assert!(domain.goals.len() >= shape.objects, "shape {index}: {:?}", domain.goals);
        }
    }
}

/// Most memory that a program took so far, in bytes; `None` if it has ended.
#[cfg(target_os = "linux")]
fn most_memory(process: u32) -> Option<f64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    Some(1024.0 * line.split_whitespace().nth(1)?.parse::<f64>().ok()?)
}

#[cfg(all(target_os = "linux", feature = "cli"))]
#[test]
fn classifying_takes_little_more_memory_than_the_recording() {
    use std::io::Read;
    use std::process::{Command, Stdio};

    let folder = tempfile::tempdir().expect("a folder");
    let shape = Shape { demos: 100, snapshots: 40, objects: 1, carry: 1, noise_m: 0.0 };
    let domain = folder.path().join("domain.json");
    let learned = learn(&record(shape, 1), &Settings::default()).expect("it learns");
    std::fs::write(&domain, learned.domain.to_json().expect("text")).expect("written");
    for json in [false, true] {
        let taken = [1, 10].map(|times| {
            let recording = record(Shape { demos: 100 * times, ..shape }, 2);
            let text = recording.to_jsonl(None).expect("text");
            let path = folder.path().join("recording.jsonl");
            std::fs::write(&path, &text).expect("written");
            let mut command = Command::new(env!("CARGO_BIN_EXE_symbolt"));
            command.arg("classify").arg(&domain).arg(&path).args(json.then_some("--json"));
            let mut child = command.stdout(Stdio::piped()).spawn().expect("it starts");
            let mut out = child.stdout.take().expect("a pipe");
            let (mut most, mut lines, mut bytes) = (0.0f64, 0, vec![0; 1 << 16]);
            // It waits for its reader, so it is seen shortly before its end.
            while let length @ 1.. = out.read(&mut bytes).expect("an answer") {
                lines += bytes[..length].iter().filter(|b| **b == b'\n').count();
                most = most.max(most_memory(child.id()).unwrap_or_default());
            }
            assert!(child.wait().expect("it ends").success());
            assert!(lines >= 4_000 * times && most > 0.0, "{lines} {most}");
            (most, text.len() as f64)
        });
        let [(less, small), (more, large)] = taken;
        let ratio = (more - less) / (large - small);
        println!("{json}: {ratio:.1} bytes for each byte of the recording");
        assert!(ratio < 4.0, "json {json}: {ratio:.1} bytes for each byte of the recording");
    }
}
