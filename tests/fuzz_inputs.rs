//! Mutated files of every format, read in this process: no panic, no abort, and bounded time and memory.
//!
//! The inputs follow from their number alone. `SYMBOLT_FUZZ_INPUTS` sets how many are read (default 20,000) and
//! `SYMBOLT_FUZZ_FROM` the number of the first. The file of the last input that failed is named in the message. An
//! abort names no input: start again from the number in `symbolt-fuzz-progress` in the folder for temporary files.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::panic::AssertUnwindSafe;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use libtest_mimic::Arguments;

#[path = "support/formats.rs"]
mod formats;
#[path = "support/mutate.rs"]
mod mutate;
#[path = "support/needs.rs"]
mod needs;

use formats::{Format, formats};
use mutate::Mutator;
use needs::{named, only_if};

fn main() -> ExitCode {
    let mut trials = only_if(
        true,
        "",
        named![mutated_files_of_every_format_are_read_or_refused_in_bounded_time_and_memory],
    );
    let kept = std::env::var_os("SYMBOLT_FUZZ_FILE").is_some();
    trials.extend(only_if(kept, "needs SYMBOLT_FUZZ_FILE", named![a_kept_input_is_read_again]));
    libtest_mimic::run(&Arguments::from_args(), trials).exit_code()
}

/// Counts the bytes in use. A thread that takes far too many stops, so that the watcher can write the input.
struct Counting;

static USED: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);
static FULL: AtomicBool = AtomicBool::new(false);

/// Memory that no input may take.
const MEMORY: usize = 500_000_000;
/// Memory at which the process stops.
const STOP: usize = 2_000_000_000;

fn took(bytes: usize) {
    let used = USED.fetch_add(bytes, Ordering::Relaxed) + bytes;
    MOST.fetch_max(used, Ordering::Relaxed);
    if used > STOP {
        FULL.store(true, Ordering::SeqCst);
        loop {
            std::thread::sleep(Duration::from_secs(1));
        }
    }
}

// SAFETY: every call is passed unchanged to the system's allocator. Counting does not access the allocated memory.
#[allow(unsafe_code)]
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        took(layout.size());
        unsafe { System.alloc(layout) }
    }
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        took(layout.size());
        unsafe { System.alloc_zeroed(layout) }
    }
    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        USED.fetch_sub(layout.size(), Ordering::Relaxed);
        unsafe { System.dealloc(at, layout) }
    }
    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        if size > layout.size() {
            took(size - layout.size());
        } else {
            USED.fetch_sub(layout.size() - size, Ordering::Relaxed);
        }
        unsafe { System.realloc(at, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// An input: its number, its format, its bytes, and when reading it began.
type Input = (u64, &'static str, Vec<u8>, Instant);

/// The input that is being read.
static CURRENT: Mutex<Option<Input>> = Mutex::new(None);

fn number(variable: &str, default: u64) -> u64 {
    std::env::var(variable).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

fn temporary(name: &str) -> PathBuf {
    std::env::temp_dir().join(name)
}

/// Writes an input that failed and returns its path.
fn kept(index: u64, format: &str, bytes: &[u8]) -> PathBuf {
    let path = temporary(&format!("symbolt-fuzz-{}-{index}", format.replace(' ', "-")));
    let _ = std::fs::write(&path, bytes);
    path
}

/// Stops the process if an input takes too long or too much memory to ever end.
fn watch(longest: Duration) {
    std::thread::spawn(move || {
        loop {
            std::thread::sleep(Duration::from_millis(200));
            let current = CURRENT.lock().unwrap();
            let Some((index, format, bytes, began)) = &*current else { continue };
            let full = FULL.load(Ordering::SeqCst);
            if full || began.elapsed() > longest {
                let path = kept(*index, format, bytes);
                let why = if full { "memory" } else { "time" };
                eprintln!("input {index} ({format}) takes too much {why}: {}", path.display());
                std::process::exit(1);
            }
        }
    });
}

/// What a format cost.
#[derive(Clone, Default)]
struct Cost {
    inputs: u64,
    accepted: u64,
    total: Duration,
    slowest: (Duration, u64),
    largest: (usize, u64),
}

/// Returns the time that this thread has spent on a core, where the system tells it.
fn on_the_core() -> Option<Duration> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(Duration::from_nanos(text.split_whitespace().next()?.parse().ok()?))
}

fn read(format: &Format, index: u64, cost: &mut Cost, slowest_allowed: Duration) {
    let mut mutator = Mutator::new(index);
    let seed = &format.seeds[mutator.below(format.seeds.len())];
    let other = &format.seeds[mutator.below(format.seeds.len())];
    let bytes = (format.make)(&mut mutator, seed, other);
    *CURRENT.lock().unwrap() = Some((index, format.name, bytes.clone(), Instant::now()));
    let used = USED.load(Ordering::Relaxed);
    MOST.store(used, Ordering::Relaxed);
    let began = Instant::now();
    let read = std::panic::catch_unwind(AssertUnwindSafe(|| (format.read)(&bytes)));
    let mut time = began.elapsed();
    if time > slowest_allowed && read.is_ok() {
        // Other programs may have had the core: only time on the core counts.
        let before = on_the_core();
        let began = Instant::now();
        (format.read)(&bytes);
        let spent = before.and_then(|before| on_the_core()?.checked_sub(before));
        time = spent.unwrap_or(began.elapsed());
    }
    let memory = MOST.load(Ordering::Relaxed).saturating_sub(used);
    *CURRENT.lock().unwrap() = None;
    cost.inputs += 1;
    cost.total += time;
    cost.slowest = cost.slowest.max((time, index));
    cost.largest = cost.largest.max((memory, index));
    let fault = match &read {
        Err(_) => Some("a panic".to_owned()),
        Ok(_) if memory > MEMORY => Some(format!("{memory} bytes of memory")),
        Ok(_) if time > slowest_allowed => Some(format!("{time:?}")),
        Ok(accepted) => {
            cost.accepted += u64::from(*accepted);
            None
        }
    };
    if let Some(fault) = fault {
        let path = kept(index, format.name, &bytes);
        let message = format!("input {index} ({}): {fault}; {}", format.name, path.display());
        // The hook that prints panics may be silent.
        eprintln!("{message}");
        panic!("{message}");
    }
}

fn mutated_files_of_every_format_are_read_or_refused_in_bounded_time_and_memory() {
    let all = number("SYMBOLT_FUZZ_INPUTS", 20_000);
    let from = number("SYMBOLT_FUZZ_FROM", 0);
    // A run of the whole suite shares its cores, and a debug build is slow: only a long run bounds the time closely.
    // `SYMBOLT_FUZZ_MS` sets another bound.
    let allowed = match all {
        0..=100_000 => Duration::from_secs(30),
        _ => Duration::from_millis(number("SYMBOLT_FUZZ_MS", 1500)),
    };
    watch(Duration::from_secs(120));
    let formats = formats();
    for format in &formats {
        for seed in format.seeds.iter().filter(|_| format.sound) {
            assert!((format.read)(seed), "{}: a seed is refused", format.name);
        }
    }
    let shares: u64 = formats.iter().map(|format| format.share).sum();
    let mut costs = vec![Cost::default(); formats.len()];
    let long = all > 100_000;
    if long {
        std::panic::set_hook(Box::new(|_| {}));
    }
    for index in from..from + all {
        // The shares of the formats, spread evenly.
        let mut rest = (index.wrapping_mul(7919)) % shares;
        let at = formats.iter().position(|format| {
            let own = rest < format.share;
            rest = rest.saturating_sub(format.share);
            own
        });
        let at = at.unwrap_or(0);
        read(&formats[at], index, &mut costs[at], allowed);
        if index % 10_000 == 0 && long {
            let _ = std::fs::write(temporary("symbolt-fuzz-progress"), format!("{index}\n"));
        }
    }
    let _ = std::panic::take_hook();
    for (format, cost) in formats.iter().zip(&costs) {
        let mean = cost.total.as_secs_f64() * 1e6 / cost.inputs.max(1) as f64;
        if long {
            println!(
                "{:>16}: {} inputs, {} accepted, mean {mean:.0} us, slowest {:?} ({}), largest {:.1} MB ({})",
                format.name,
                cost.inputs,
                cost.accepted,
                cost.slowest.0,
                cost.slowest.1,
                cost.largest.0 as f64 / 1e6,
                cost.largest.1,
            );
        }
        assert!(all < 20_000 || cost.inputs > 0, "{} was never read", format.name);
        let refused = cost.inputs > cost.accepted;
        assert!(all < 20_000 || refused, "{}: every mutation was accepted", format.name);
    }
    assert_eq!(costs.iter().map(|cost| cost.inputs).sum::<u64>(), all);
}

/// Reads one file again: `SYMBOLT_FUZZ_FILE=path SYMBOLT_FUZZ_FORMAT=name`.
fn a_kept_input_is_read_again() {
    let path = std::env::var("SYMBOLT_FUZZ_FILE").expect("a path");
    let name = std::env::var("SYMBOLT_FUZZ_FORMAT").expect("a format");
    let formats = formats();
    let format = formats.iter().find(|format| format.name == name).expect("a known format");
    let bytes = std::fs::read(Path::new(&path)).expect("a file");
    let began = Instant::now();
    let accepted = (format.read)(&bytes);
    println!("{name}: accepted {accepted} in {:?}", began.elapsed());
}
