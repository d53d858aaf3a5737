//! scratch
use symbolt::{
    sim::Seed,
    task::{kinematic::*, learn::*, *},
};
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let seeds: u64 = std::env::args().nth(1).map_or(200, |s| s.parse().unwrap());
    for events in [true, false] {
        for demos in [1, 2, 3, 5, 8] {
            for n in [1, 3] {
                for (fail, loss, knock) in [
                    (0.0, 0.0, 0.0),
                    (0.0, 0.0, 0.3),
                    (0.15, 0.0, 0.1),
                    (0.3, 0.0, 0.2),
                    (0.3, 0.3, 0.2),
                ] {
                    let (mut ok, mut states_ok, mut complete, mut label_ok, mut labels) =
                        (0, 0, 0, 0, 0);
                    let mut hist = std::collections::BTreeMap::new();
                    for seed in 0..seeds {
                        let r = Rehearsal {
                            demos,
                            nuts: n,
                            bolts: n,
                            fail_rate: fail,
                            loss_rate: loss,
                            knock_rate: knock,
                            events,
                            ..Default::default()
                        };
                        let rec = r.record(Seed::new(seed))?;
                        if rec.assembled == 0 {
                            continue;
                        }
                        complete += 1;
                        match learn(&rec.recording, &Settings::default()) {
                            Ok(l) => {
                                let s = l.domain.states().len();
                                let o = l.domain.operators().len();
                                if s == 5 {
                                    states_ok += 1;
                                }
                                if s == 5 && o == 3 {
                                    ok += 1;
                                }
                                *hist.entry((s, o)).or_insert(0) += 1;
                                // does inferred manip match labels
                                for t in &l.report.tries {
                                    let d = rec
                                        .recording
                                        .demos
                                        .iter()
                                        .position(|x| x.number == t.demo)
                                        .unwrap();
                                    if let Some(lab) = &rec.labels[d][t.before as usize] {
                                        labels += 1;
                                        let kind = if lab.contains("NUT") { "nut" } else { "bolt" };
                                        if t.object.as_deref().is_some_and(|o| o.starts_with(kind))
                                        {
                                            label_ok += 1;
                                        }
                                    }
                                }
                            }
                            Err(e) => {
                                *hist.entry((0, 0)).or_insert(0) += 1;
                                if seed < 2 {
                                    println!("{e}");
                                }
                            }
                        }
                    }
                    println!(
                        "events {events} demos {demos} n {n} fail {fail} loss {loss} knock {knock}: ok {ok}/{complete} states {states_ok} kind {label_ok}/{labels} {hist:?}"
                    );
                }
            }
        }
    }
    Ok(())
}
