#![allow(missing_docs, clippy::unwrap_used)]
use symbolt::sim::Seed;
use symbolt::task::learn::*;
use symbolt::task::relational::*;
use symbolt::task::*;
fn main() {
    let dir = std::env::var("SYMBOLT_RECORDINGS").unwrap();
    let r = Recording::read(&std::path::Path::new(&dir).join("nut_bolt_pybullet.jsonl")).unwrap();
    let truth = learn_relational(&r, &Settings::default()).unwrap();
    // reference labels from the clean recording
    let g = Grounder::new(&truth.domain);
    let name = |d: &RelationalDomain, f: Option<Fact>| {
        f.map(|f| {
            let s = &d.states[f.state];
            format!("{} {:?}", s.kind, s.origin)
                + if s.kind == "bolt"
                    && s.places[0].pose().position[1] > 0.0
                    && s.origin == Origin::Placed
                {
                    if s.frame.kind() == Some("nut") || s.name.contains("NUT") {
                        " nut"
                    } else {
                        " hole"
                    }
                } else {
                    ""
                }
        })
    };
    let labels: Vec<Vec<Vec<Option<String>>>> = r
        .demos
        .iter()
        .map(|d| {
            d.snapshots
                .iter()
                .map(|s| g.layout(s).located.iter().map(|l| name(&truth.domain, l.fact)).collect())
                .collect()
        })
        .collect();
    for (what, sensing) in [
        ("clean", Sensing::default()),
        ("1mm 1deg", Sensing { pose_noise_m: 1e-3, pose_noise_deg: 1.0, ..Sensing::default() }),
        ("2mm 3deg", Sensing { pose_noise_m: 2e-3, pose_noise_deg: 3.0, ..Sensing::default() }),
        ("5mm 5deg", Sensing { pose_noise_m: 5e-3, pose_noise_deg: 5.0, ..Sensing::default() }),
        ("10mm", Sensing { pose_noise_m: 10e-3, pose_noise_deg: 5.0, ..Sensing::default() }),
        ("swaps 5%", Sensing { swap_rate: 0.05, ..Sensing::default() }),
        ("missing 5%", Sensing { missing_rate: 0.05, ..Sensing::default() }),
        ("outliers 5%", Sensing { outlier_rate: 0.05, ..Sensing::default() }),
    ] {
        let (mut good, mut right, mut all) = (0, 0, 0);
        let mut why = std::collections::BTreeMap::new();
        for seed in 0..20 {
            let noisy = sensing.apply_recording(&r, Seed::new(seed));
            let l = match learn_relational(&noisy, &Settings::default()) {
                Ok(l) => l,
                Err(e) => {
                    *why.entry(e.to_string()).or_insert(0) += 1;
                    continue;
                }
            };
            let count = |k: &str| l.domain.states.iter().filter(|s| s.kind == k).count();
            let ok = (count("nut"), count("bolt"), l.domain.operators.len()) == (2, 3, 3)
                && l.domain.states.len() == 5;
            good += usize::from(ok);
            if !ok {
                *why.entry(format!(
                    "{:?} ops {} {:?}",
                    l.domain.states.iter().map(|s| &s.name).collect::<Vec<_>>(),
                    l.domain.operators.len(),
                    l.outliers
                ))
                .or_insert(0) += 1;
            }
            let g = Grounder::new(&l.domain);
            for (d, demo) in r.demos.iter().enumerate() {
                for (s, snap) in demo.snapshots.iter().enumerate() {
                    for (o, loc) in g.layout(snap).located.iter().enumerate() {
                        if let Some(t) = &labels[d][s][o] {
                            all += 1;
                            right += usize::from(name(&l.domain, loc.fact).as_ref() == Some(t));
                        }
                    }
                }
            }
        }
        println!("{what}: {good}/20 poses {:.4}", right as f64 / all as f64);
        for (k, v) in why.iter().take(4) {
            println!("    {v}x {k}");
        }
    }
}
