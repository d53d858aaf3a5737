//! Long recordings: learning takes time that grows as the recording does, and classifying little more memory than it.

// Both are measured by what the kernel tells of processes.
#![cfg(target_os = "linux")]
#![allow(clippy::expect_used)]

use rand::RngExt;
use symbolt::robot::Pose;
use symbolt::sim::Seed;
use symbolt::task::learn::{Settings, learn};
use symbolt::task::{Demonstration, ObjectPose, Recording, Snapshot};

/// How a long recording was made.
#[derive(Clone, Copy)]
struct Shape {
    demos: usize,
    snapshots: usize,
    objects: usize,
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
            if step + 2 == per {
                at[moving] = places[moving];
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

/// Time for which this thread was on a processor, in seconds. What else the machine does is not in it.
fn on_processor_s() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").expect("it counts");
    1e-9 * text.split_whitespace().next().expect("a number").parse::<f64>().expect("a number")
}

#[test]
fn learning_takes_no_time_that_grows_with_the_square_of_the_demonstrations() {
    // Above 600 rests, the clusters of a kind are found from a sample, which takes the same time for all three.
    for (demos, shape) in [
        (4_000, Shape { demos: 0, snapshots: 4, objects: 1, noise_m: 0.0 }),
        (1_500, Shape { demos: 0, snapshots: 8, objects: 2, noise_m: 1e-3 }),
    ] {
        let times = [1, 4, 16].map(|times| {
            let recording = record(Shape { demos: demos * times, ..shape }, 1);
            let begin = on_processor_s();
            let learned = learn(&recording, &Settings::default()).expect("it learns");
            let domain = learned.domain;
            assert!(domain.states.len() > shape.objects && !domain.goals.is_empty(), "{domain:?}");
            on_processor_s() - begin
        });
        let [short, middle, long] = times;
        let growth = (long - middle) / (middle - short);
        // It is 4 if time is linear, and 16 if it is quadratic.
        assert!(growth < 8.0, "{growth}: {times:?}");
        println!("{growth:.1}: {times:?}");
    }
}

/// Most memory that a program took so far, in bytes; `None` if it has ended.
#[cfg(feature = "cli")]
fn most_memory(process: u32) -> Option<f64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    Some(1024.0 * line.split_whitespace().nth(1)?.parse::<f64>().ok()?)
}

#[cfg(feature = "cli")]
#[test]
fn classifying_takes_little_more_memory_than_the_recording() {
    use std::io::Read;
    use std::process::{Command, Stdio};

    let folder = tempfile::tempdir().expect("a folder");
    let shape = Shape { demos: 100, snapshots: 40, objects: 1, noise_m: 0.0 };
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
