#![allow(missing_docs, clippy::unwrap_used)]
use symbolt::sim::Seed;
use symbolt::study::worlds::*;
use symbolt::task::Sensing;
use symbolt::task::learn::*;
fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let only = args.first().filter(|a| *a != "all").cloned();
    let demos: Vec<usize> =
        args.get(1).map_or(vec![5, 10], |d| d.split(',').map(|v| v.parse().unwrap()).collect());
    let seeds: u64 = args.get(2).map_or(3, |s| s.parse().unwrap());
    let noise: (f64, f64) = args.get(3).map_or((0.0, 0.0), |s| {
        let v: Vec<f64> = s.split(',').map(|v| v.parse().unwrap()).collect();
        (v[0], v[1])
    });
    let first: u64 = args.get(4).map_or(1, |s| s.parse().unwrap());
    let (mut solved, mut all) = (0, 0);
    let mut needs = Rates::default();
    let mut states = Rates::default();
    let mut poses = Rates::default();
    for world in all_worlds() {
        if only.as_ref().is_some_and(|o| o != world.name()) {
            continue;
        }
        let t = std::time::Instant::now();
        let (mut s, mut a) = (0, 0);
        let mut n = Rates::default();
        let mut st = Rates::default();
        let mut po = Rates::default();
        let mut notes = std::collections::BTreeMap::new();
        for d in &demos {
            for seed in first..first + seeds {
                let trial = Trial {
                    demos: *d,
                    episodes: 5,
                    sensing: Sensing {
                        pose_noise_m: noise.0,
                        pose_noise_deg: noise.1,
                        ..Sensing::default()
                    },
                    seed: Seed::new(seed),
                };
                let e = evaluate(&*world, &trial).unwrap();
                s += e.solved();
                a += e.outcomes.len();
                n = n.plus(&e.needs);
                st = st.plus(&e.states.states);
                po = po.plus(&e.states.poses);
                for w in &e.wrong {
                    *notes.entry(format!("WRONG {w:?}")).or_insert(0) += 1
                }
                for w in &e.missed {
                    *notes.entry(format!("MISSED {w:?}")).or_insert(0) += 1
                }
                for w in &e.trouble {
                    let mut w = w.clone();
                    w.truncate(230);
                    *notes.entry(format!("d{d} s{seed} {w}")).or_insert(0) += 1
                }
            }
        }
        println!(
            "{:28} {s:3}/{a:3} states {:.2}/{:.2} poses {:.3}/{:.3} needs {:.2}/{:.2} {:?}",
            world.name(),
            st.precision(),
            st.recall(),
            po.precision(),
            po.recall(),
            n.precision(),
            n.recall(),
            t.elapsed()
        );
        if std::env::var("SHOW").is_ok() {
            let shown = world.show(demos[0], Seed::new(first));
            println!("{:#?}", world.truth().goal);
            if std::env::var("RAW").is_ok() {
                for s in &shown.recording.demos[0].snapshots {
                    println!("{:?} {:?}", s.event, s.object.map(|o| s.objects[o].id.clone()));
                    for o in &s.objects {
                        println!("   {} {:.4?} {:.3?}", o.id, o.pose.position, o.pose.orientation);
                    }
                }
            }
            let l = symbolt::task::learn::learn_relational(&shown.recording, &Default::default())
                .unwrap();
            show(&l);
        }
        if only.is_some() || std::env::var("NOTES").is_ok() {
            for (k, v) in notes.iter().take(14) {
                println!("      {v}x {k}");
            }
        }
        solved += s;
        all += a;
        needs = needs.plus(&n);
        states = states.plus(&st);
        poses = poses.plus(&po);
    }
    println!(
        "all {solved}/{all} states {:.3}/{:.3} poses {:.4}/{:.4} needs {:.3}/{:.3}",
        states.precision(),
        states.recall(),
        poses.precision(),
        poses.recall(),
        needs.precision(),
        needs.recall()
    );
}
fn show(l: &RelationallyLearned) {
    for s in &l.domain.states {
        println!(
            "  {} [{}] frame {} turn {:?} n{} {:?}",
            s.name,
            s.kind,
            s.frame.name(),
            s.turn,
            s.count,
            s.origin
        );
        for p in &s.places {
            println!("     {:?} n{}", p.coordinates, p.count);
        }
    }
    for o in &l.domain.operators {
        println!(
            "  {} from {:?} to {} n{} disp {:?}",
            o.name,
            o.from.iter().map(|s| &l.domain.states[*s].name).collect::<Vec<_>>(),
            l.domain.states[o.to].name,
            o.instances,
            o.displacement
        );
        for n in &o.needs {
            println!(
                "     {:?} {:?} {} least {} holds {} {}/{}",
                n.verdict,
                n.condition.subject,
                l.domain.states[n.condition.state].name,
                n.least,
                n.holds,
                n.held,
                n.of
            );
        }
        for e in &o.side_effects {
            println!(
                "     effect {} {:?} {} {}/{}",
                e.begins,
                e.condition.subject,
                l.domain.states[e.condition.state].name,
                e.changed,
                e.of
            );
        }
    }
    for g in &l.domain.goals {
        println!("  goal {} {:?} {}/{}", l.domain.states[g.state].name, g.quantity, g.held, g.of);
    }
    println!(
        "  outliers {} noise {:.5} failed {} unexplained {:?}",
        l.outliers,
        l.domain.noise_m,
        l.report.failed(),
        l.report.unexplained.iter().map(|u| (u.kind.clone(), u.count)).collect::<Vec<_>>()
    );
}
fn all_worlds() -> Vec<Box<dyn World>> {
    all()
}
