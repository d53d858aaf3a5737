#![allow(missing_docs, clippy::unwrap_used)]
use symbolt::sim::Seed;
use symbolt::task::learn::*;
use symbolt::task::relational::*;
use symbolt::task::tasks::nuts_and_bolts::SyntheticDemonstrations;
use symbolt::task::*;
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
fn main() {
    for (demos, nuts) in [(2, 1), (5, 1), (5, 3)] {
        let s = SyntheticDemonstrations { demos, nuts, bolts: nuts, ..Default::default() };
        let r = s.record(Seed::new(1)).unwrap();
        let t = std::time::Instant::now();
        let l = learn_relational(&r.recording, &Settings::default()).unwrap();
        println!("synthetic {demos} demos {nuts} nuts {:?}", t.elapsed());
        show(&l);
        let scene = SyntheticDemonstrations { nuts: 1, bolts: 1, ..Default::default() }
            .scene(Seed::new(7))
            .unwrap();
        let layout = Grounder::new(&l.domain).layout(&scene);
        match Problem::new(&l.domain, &layout) {
            Ok(p) => {
                let plan = p.plan(&layout.situation(), &[]);
                println!(
                    "  plan {:?}",
                    plan.map(|p| p
                        .iter()
                        .map(|m| (
                            l.domain.operators[m.action.operator].name.clone(),
                            layout.objects[m.action.object].id.clone(),
                            m.decided
                        ))
                        .collect::<Vec<_>>())
                );
            }
            Err(e) => println!("  {e}"),
        }
    }
    if let Ok(dir) = std::env::var("SYMBOLT_RECORDINGS") {
        let r =
            Recording::read(&std::path::Path::new(&dir).join("nut_bolt_pybullet.jsonl")).unwrap();
        let t = std::time::Instant::now();
        let l = learn_relational(&r, &Settings::default()).unwrap();
        println!("real all {:?}", t.elapsed());
        show(&l);
        let three =
            r.filter(|d| d.snapshots[0].objects.iter().filter(|o| &*o.kind == "nut").count() == 3);
        println!("real three: {} demos", three.demos.len());
        let l = learn_relational(&three, &Settings::default()).unwrap();
        show(&l);
    }
}
