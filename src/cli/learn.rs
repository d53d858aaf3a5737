//! `symbolt learn`: states and operators from a recording.

use std::fmt::Write as _;

use anyhow::Error;
use serde_json::{Value, json};
use symbolt::files::write_atomic;
use symbolt::task::learn::{
    AttemptOutcome, AttemptReport, Failure, LearnReport, Learned, Settings, learn_observed,
};
use symbolt::task::{Domain, Origin, Recording, StateId};

use super::Outcome;
use super::args::LearnArgs;
use super::output::{Grid, Progress, counted, emit, emit_json, mm, refuse_existing, use_threads};
use super::watch::ProgressLine;

pub(crate) fn learn(args: &LearnArgs) -> Result<Outcome, Error> {
    refuse_existing(args.out.out.as_deref(), args.out.force)?;
    use_threads(&args.common)?;
    let progress = Progress::new(&args.common);
    progress.say(format!("reading {}", args.recording.display()));
    let recording = Recording::read(&args.recording)?;
    let settings = Settings { p: args.p, threshold_m: args.threshold, seed: args.common.seed };
    let learned = learn_observed(&recording, &settings, &mut ProgressLine::new(&progress))?;
    let empty = learned.domain.operators().is_empty();
    if let Some(path) = args.out.out.as_ref().filter(|_| !empty) {
        write_atomic(path, learned.domain.to_json()?, args.out.overwrite())?;
    }
    drop(progress);
    if args.common.json {
        emit_json(&[summary(&learned)])?;
    } else {
        emit(&tables(&learned))?;
    }
    if empty {
        let sentence = "no action was learned: no attempt left a part in a state that was new";
        return Ok(Outcome::Failed(sentence.into()));
    }
    Ok(Outcome::Done)
}

/// The learned domain as one JSON object.
fn summary(learned: &Learned) -> Value {
    let domain = &learned.domain;
    let states: Vec<Value> = domain
        .states()
        .iter()
        .filter_map(|s| Some((s, s.learned.as_ref()?)))
        .map(|(s, learned)| {
            json!({
                "name": s.name, "kind": s.kind, "count": learned.count,
                "distinct": learned.distinct, "origin": learned.origin,
                "position": learned.mean.position, "orientation": learned.mean.orientation,
                "spread": learned.spread(),
            })
        })
        .collect();
    let operators: Vec<Value> = domain
        .operators()
        .iter()
        .map(|o| {
            json!({
                "name": o.name, "preconditions": domain.names(&o.preconditions),
                "effects": domain.names(&o.effects), "absent": domain.names(&o.absent),
                "removes": domain.names(&o.removes), "kind": o.kind(),
                "from": o.from.map(|s| &domain[s].name), "to": domain[o.to].name,
                "instances": o.instances(),
            })
        })
        .collect();
    let clusters = domain.provenance().map_or(&[][..], |p| &p.clusters);
    let by_kind = |value: fn(&symbolt::task::KindClusters) -> Option<f64>| -> Value {
        clusters.iter().map(|c| (c.kind.clone(), json!(value(c)))).collect()
    };
    let failed: Vec<Value> = failed(&learned.report)
        .map(|(t, why)| {
            json!({
                "demo": t.demo, "snapshot": t.before, "object": t.object,
                "inferred": t.inferred, "reason": reason(why),
            })
        })
        .collect();
    let unexplained: Vec<Value> = learned
        .report
        .unexplained
        .iter()
        .map(|s| {
            json!({"kind": s.kind, "count": s.count, "position": s.mean.position, "seen": s.seen})
        })
        .collect();
    json!({
        "states": states,
        "next_merge_m": by_kind(|c| c.next_merge_m),
        "threshold_m": by_kind(|c| c.threshold_m),
        "operators": operators,
        "goal": domain.goal_name(),
        // The keys `tries` and `strays` are older than the words for them.
        "tries": learned.report.attempts.len(),
        "failed": failed,
        "strays": unexplained,
        "fixed_kinds": learned.report.fixed_kinds,
    })
}

fn failed(report: &LearnReport) -> impl Iterator<Item = (&AttemptReport, Failure)> {
    report.attempts.iter().filter_map(|attempt| match attempt.outcome {
        AttemptOutcome::Failed(why) => Some((attempt, why)),
        AttemptOutcome::Action(_) => None,
    })
}

fn reason(why: Failure) -> &'static str {
    match why {
        Failure::NothingMoved => "nothing moved",
        Failure::PartLost => "the part was lost",
        Failure::NothingNew => "no state was newly present",
        Failure::Detour => "the part ended in a place that others did without",
        Failure::Undone => "the part came back to where it had been",
        _ => "it achieved nothing",
    }
}

/// The learned domain and how it was learned, as tables.
pub(crate) fn tables(learned: &Learned) -> String {
    let mut text = domain_tables(&learned.domain);
    let report = &learned.report;
    let mut grid = Grid::new(&[">demo", ">snapshot", "object", "failed because"]);
    for (t, why) in failed(report) {
        let object = t.object.clone().unwrap_or_else(|| "-".into());
        grid.row([t.demo.to_string(), t.before.to_string(), object, reason(why).into()]);
    }
    if !grid.is_empty() {
        let (failed, all) = (report.failed(), report.attempts.len());
        let all = counted(all, "attempt");
        let _ = writeln!(text, "{failed} of {all} failed:\n\n{grid}");
    }
    let mut grid =
        Grid::new(&["kind", ">poses", ">x m", ">y m", ">z m", "seen at (demo, snapshot)"]);
    for poses in &report.unexplained {
        let [x, y, z] = poses.mean.position.map(|v| format!("{v:.4}"));
        let seen: Vec<String> =
            poses.seen.iter().take(6).map(|(d, s)| format!("({d}, {s})")).collect();
        let more = if poses.seen.len() > 6 { ", ..." } else { "" };
        let seen = seen.join(", ") + more;
        grid.row([poses.kind.clone(), poses.count.to_string(), x, y, z, seen]);
    }
    if !grid.is_empty() {
        let _ = writeln!(text, "Poses seen only around failed attempts, in no state:\n\n{grid}");
    }
    text
}

/// States and operators of a domain, as tables; only what there is, for a domain written in code has no geometry and
/// no counts.
pub(crate) fn domain_tables(domain: &Domain) -> String {
    let mut text = String::new();
    section(&mut text, &counted(domain.states().len(), "state"), &state_table(domain));
    section(&mut text, &counted(domain.operators().len(), "action"), &action_table(domain));
    let mut grid = Grid::new(&["kind", ">threshold mm", ">next merge mm"]);
    let provenance = domain.provenance();
    for clusters in provenance.map_or(&[][..], |p| &p.clusters) {
        let threshold = clusters.threshold_m.map_or_else(|| "-".into(), mm);
        let next = clusters.next_merge_m.map_or_else(|| "-".into(), mm);
        grid.row([clusters.kind.clone(), threshold, next]);
    }
    if !grid.is_empty() {
        let given = provenance.and_then(|p| p.threshold_m).is_some();
        let given = if given { "given" } else { "found from the data" };
        section(&mut text, &format!("Clustering thresholds ({given})"), &grid);
    }
    if let Some(goal) = domain.goal_name() {
        let _ = writeln!(text, "Goal of the demonstrations: {goal}\n");
    }
    text
}

/// A title with its table, if that has rows.
fn section(text: &mut String, title: &str, grid: &Grid) {
    let _ = match grid.is_empty() {
        true => writeln!(text, "{title}\n"),
        false => writeln!(text, "{title}:\n\n{grid}"),
    };
}

fn state_table(domain: &Domain) -> Grid {
    if domain.states().iter().all(|state| state.learned.is_none()) {
        let mut grid = Grid::new(&["state", "kind"]);
        for state in domain.states() {
            grid.row([state.name.clone(), state.kind.clone()]);
        }
        return grid;
    }
    let mut grid = Grid::new(&[
        "state", "kind", "origin", ">poses", ">x m", ">y m", ">z m", ">sd x mm", ">sd y mm",
        ">sd z mm",
    ]);
    for state in domain.states() {
        let mut row = vec![state.name.clone(), state.kind.clone()];
        if let Some(learned) = &state.learned {
            let origin = match learned.origin {
                Origin::Found => "found",
                Origin::Placed => "placed",
            };
            row.extend([origin.into(), learned.count.to_string()]);
            row.extend(learned.mean.position.map(|v| format!("{v:.4}")));
            row.extend(learned.spread().map(mm));
        } else {
            row.resize(10, "-".into());
        }
        grid.row(row);
    }
    grid
}

fn action_table(domain: &Domain) -> Grid {
    let operators = domain.operators();
    let learned = operators.iter().any(|o| o.evidence.is_some());
    // Of an action that was not learned, nothing was seen.
    let absent = if learned { "never seen before it" } else { "needs absent" };
    let with_absent = learned || operators.iter().any(|o| !o.absent.is_empty());
    let mut columns = vec!["action"];
    columns.extend(learned.then_some(">instances"));
    columns.extend(["needs", "brings about"]);
    columns.extend(with_absent.then_some(absent));
    let mut grid = Grid::new(&columns);
    for operator in operators {
        let evidence = operator.evidence.as_ref();
        let need = |state: &StateId| {
            let name = &domain[*state].name;
            evidence.map_or_else(
                || name.clone(),
                |e| {
                    let count = e.before.get(state.index()).copied().unwrap_or(0);
                    format!("{name} ({count}/{})", e.instances)
                },
            )
        };
        let needs: Vec<String> = operator.preconditions.iter().map(need).collect();
        let mut row = vec![operator.name.clone()];
        if learned {
            row.push(evidence.map_or_else(|| "-".into(), |e| e.instances.to_string()));
        }
        row.extend([needs.join(", "), domain.names(&operator.effects).join(", ")]);
        row.extend(with_absent.then(|| domain.names(&operator.absent).join(", ")));
        grid.row(row);
    }
    grid
}
