//! scratch
#![allow(clippy::unwrap_used)]
use symbolt::sim::Seed;
use symbolt::task::scene::*;
use symbolt::task::*;
fn main() {
    let a = |n: usize, d: u64| std::env::args().nth(n).and_then(|s| s.parse().ok()).unwrap_or(d);
    let (demos, n) = (a(1, 5) as usize, a(2, 1) as usize);
    let spec = SceneSpec { nuts: n, bolts: n, ..SceneSpec::default() };
    let t = std::time::Instant::now();
    let d = demonstrate(&spec, demos, Seed::new(a(3, 1)), &mut |_| {}).unwrap();
    let wall = t.elapsed().as_secs_f64();
    for (k, s) in d.skills.iter().enumerate() {
        for r in s.iter().filter(|r| r.outcome != Outcome::Placed || r.slip_m > 1e-3) {
            println!("demo {k} {r:?}");
        }
        if s.len() != 3 {
            println!("demo {k}: {} skills", s.len());
        }
    }
    let slips: Vec<f64> = d.skills.iter().flatten().map(|r| r.slip_m * 1e3).collect();
    println!(
        "assembled {} of {demos}, {:.1} s simulated, {wall:.1} s wall, rt {:.1}, {:.1} us a step; slip max {:.2} mm, over 1 mm {}",
        d.assembled,
        d.simulated_s,
        d.simulated_s / wall,
        wall / d.steps as f64 * 1e6,
        slips.iter().cloned().fold(0.0, f64::max),
        slips.iter().filter(|s| **s > 1.0).count()
    );
    match learn::learn(&d.recording, &learn::Settings::default()) {
        Ok(l) => {
            for s in l.domain.states() {
                println!(
                    "{} {:?} n={} {:?} sd {:?}",
                    s.name,
                    s.origin,
                    s.count,
                    s.mean.position,
                    s.spread()
                );
            }
            for o in l.domain.operators() {
                println!(
                    "{} <- {:?} => {:?} absent {:?}",
                    o.name, o.preconditions, o.effects, o.absent
                );
            }
            println!("goal {:?} failed {}", l.domain.goal(), l.report.failed());
        }
        Err(e) => println!("{e}"),
    }
}
