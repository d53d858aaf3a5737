//! `symbolt learn`: states and operators from a recording.

use std::fmt::Write as _;

use anyhow::Error;
use serde_json::{Value, json};
use symbolt::files::write_atomic;
use symbolt::task::learn::{
    Failure, LearnReport, Learned, Outcome as TryOutcome, Settings, learn_observed,
};
use symbolt::task::{Domain, Origin, Recording};

use super::Outcome;
use super::args::LearnArgs;
use super::output::{Grid, Progress, emit, emit_json, mm, refuse_existing, use_threads};
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
        write_atomic(path, learned.domain.to_json(), args.out.overwrite())?;
    }
    drop(progress);
    if args.common.json {
        emit_json(&[summary(&learned)])?;
    } else {
        emit(&tables(&learned))?;
    }
    if empty {
        let sentence = "no action was learned: no try left a part in a state that was new";
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
        .map(|s| {
            json!({
                "name": s.name, "kind": s.kind, "count": s.count, "distinct": s.distinct,
                "origin": s.origin, "position": s.mean.position,
                "orientation": s.mean.orientation, "spread": s.spread(),
            })
        })
        .collect();
    let operators: Vec<Value> = domain
        .operators()
        .iter()
        .map(|o| {
            json!({
                "name": o.name, "preconditions": o.preconditions, "effects": o.effects,
                "absent": o.absent, "removes": o.removes, "kind": o.kind, "from": o.from,
                "to": o.to, "instances": o.evidence.instances,
            })
        })
        .collect();
    let clusters = &domain.provenance().clusters;
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
    let strays: Vec<Value> = learned
        .report
        .strays
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
        "goal": domain.goal(),
        "tries": learned.report.tries.len(),
        "failed": failed,
        "strays": strays,
        "fixed_kinds": learned.report.fixed_kinds,
    })
}

fn failed(
    report: &LearnReport,
) -> impl Iterator<Item = (&symbolt::task::learn::TryReport, Failure)> {
    report.tries.iter().filter_map(|t| match t.outcome {
        TryOutcome::Failed(why) => Some((t, why)),
        TryOutcome::Action(_) => None,
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
        let _ =
            writeln!(text, "{} of {} tries failed:\n\n{grid}", report.failed(), report.tries.len());
    }
    let mut grid =
        Grid::new(&["kind", ">poses", ">x m", ">y m", ">z m", "seen at (demo, snapshot)"]);
    for stray in &report.strays {
        let [x, y, z] = stray.mean.position.map(|v| format!("{v:.4}"));
        let seen: Vec<String> =
            stray.seen.iter().take(6).map(|(d, s)| format!("({d}, {s})")).collect();
        let more = if stray.seen.len() > 6 { ", ..." } else { "" };
        let seen = seen.join(", ") + more;
        grid.row([stray.kind.clone(), stray.count.to_string(), x, y, z, seen]);
    }
    if !grid.is_empty() {
        let _ = writeln!(text, "Poses seen only around failed tries, in no state:\n\n{grid}");
    }
    text
}

/// States and operators of a domain, as tables.
pub(crate) fn domain_tables(domain: &Domain) -> String {
    let mut text = String::new();
    let mut grid = Grid::new(&[
        "state", "kind", "origin", ">poses", ">x m", ">y m", ">z m", ">sd x mm", ">sd y mm",
        ">sd z mm",
    ]);
    for state in domain.states() {
        let [x, y, z] = state.mean.position.map(|v| format!("{v:.4}"));
        let [sx, sy, sz] = state.spread().map(mm);
        let origin = match state.origin {
            Origin::Found => "found",
            Origin::Placed => "placed",
        };
        let (name, kind) = (state.name.clone(), state.kind.clone());
        grid.row([name, kind, origin.into(), state.count.to_string(), x, y, z, sx, sy, sz]);
    }
    let _ = writeln!(text, "{} states:\n\n{grid}", domain.states().len());
    let mut grid =
        Grid::new(&["action", ">instances", "needs", "brings about", "never seen before it"]);
    for operator in domain.operators() {
        let count = |name: &String| {
            let at = domain.states().iter().position(|s| s.name == *name);
            at.and_then(|i| operator.evidence.before.get(i)).copied().unwrap_or(0)
        };
        let needs: Vec<String> = operator
            .preconditions
            .iter()
            .map(|p| format!("{p} ({}/{})", count(p), operator.evidence.instances))
            .collect();
        grid.row([
            operator.name.clone(),
            operator.evidence.instances.to_string(),
            needs.join(", "),
            operator.effects.join(", "),
            operator.absent.join(", "),
        ]);
    }
    let _ = writeln!(text, "{} actions:\n\n{grid}", domain.operators().len());
    let mut grid = Grid::new(&["kind", ">threshold mm", ">next merge mm"]);
    for clusters in &domain.provenance().clusters {
        let threshold = clusters.threshold_m.map_or_else(|| "-".into(), mm);
        let next = clusters.next_merge_m.map_or_else(|| "-".into(), mm);
        grid.row([clusters.kind.clone(), threshold, next]);
    }
    let given =
        if domain.provenance().threshold_m.is_some() { "given" } else { "found from the data" };
    let _ = writeln!(text, "Clustering thresholds ({given}):\n\n{grid}");
    if let Some(goal) = domain.goal() {
        let _ = writeln!(text, "Goal of the demonstrations: {goal}\n");
    }
    text
}
