//! `symbolt learn`: states and actions from a recording.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use anyhow::Error;
use serde_json::{Map, Value, json};
use symbolt::task::Recording;
use symbolt::task::domain::KindClusters;
use symbolt::task::learn::{
    AttemptOutcome, AttemptReport, Failure, LearnReport, Learned, Method, Settings, check_exponent,
    learn_observed,
};

use super::Outcome;
use super::args::{BadArgument, LearnArgs, MethodArg};
use super::output::{
    Grid, Place, Progress, counted, emit, emit_json, mm, section, unbroken, use_threads, warn,
    wrapped,
};
use super::watch::ProgressLine;
use super::{relational, threshold};

pub(crate) fn learn(args: &LearnArgs) -> Result<Outcome, Error> {
    let out = args.out.place()?;
    let threshold_m = args.threshold.as_deref().map(threshold::metres).transpose()?;
    let method = match (args.method, threshold_m) {
        (Some(MethodArg::Relational), Some(_)) => {
            let problem =
                "--threshold needs --method paper: the relational learner has no threshold";
            return Err(BadArgument(problem.into()).into());
        }
        (Some(method), _) => method.into(),
        (None, Some(_)) => Method::Paper,
        (None, None) => Method::Relational,
    };
    check_exponent(args.p)?;
    use_threads(&args.common)?;
    let progress = Progress::new(&args.common);
    progress.say(format!("reading {}", args.recording.display()));
    let recording = Recording::read(&args.recording)?;
    let settings = Settings { method, p: args.p, threshold_m, seed: args.common.seed };
    let learned = learn_observed(&recording, &settings, &mut ProgressLine::new(&progress))?;
    let empty = learned.domain.operators.is_empty();
    drop(progress);
    if !matches!(out, Place::Default) && !empty {
        out.write(&learned.domain.to_json()?)?;
    }
    for warning in warnings(&learned, method) {
        warn(&warning);
    }
    if matches!(out, Place::Stdout) {
        // Standard output holds the domain file and nothing else.
    } else if args.common.json {
        emit_json(&[summary(&learned)])?;
    } else {
        emit(&tables(&learned))?;
    }
    if empty {
        let sentence = "no action was learned: no attempt brought a part into a new state";
        return Ok(Outcome::Failed(sentence.into()));
    }
    Ok(Outcome::Done)
}

/// Returns tables of the learned domain, the failed attempts and the poses in no state.
pub(crate) fn tables(learned: &Learned) -> String {
    let mut text = relational::domain_tables(&learned.domain);
    let mut grid = Grid::new(&["kind", ">threshold mm", ">next merge mm"]);
    let provenance = &learned.domain.provenance;
    for clusters in &provenance.clusters {
        let [threshold, next] = [clusters.threshold_m, clusters.next_merge_m]
            .map(|length| length.map_or_else(|| "-".into(), mm));
        grid.row([clusters.kind.clone(), threshold, next]);
    }
    if !grid.is_empty() {
        let given = provenance.threshold_m.map_or("found from the data", |_| "given");
        section(&mut text, &format!("Clustering thresholds ({given})"), &grid);
    }
    for state in &learned.unachieved {
        let note = format!(
            "{state} held at the end of the demonstrations, but no action that achieves it was learned. It is \
             not part of the goal."
        );
        let _ = writeln!(text, "{}\n", wrapped(&note, 0));
    }
    text += &report_tables(&learned.report);
    if learned.outliers > 0 {
        let poses = counted(learned.outliers, "pose");
        let title = "left out, because they disagree with the other poses of their object";
        let _ = writeln!(text, "{}\n", wrapped(&format!("{poses} {title}"), 0));
    }
    text
}

/// Returns a warning for each kind of moved object that has no state.
fn warnings(learned: &Learned, method: Method) -> Vec<String> {
    let provenance = &learned.domain.provenance;
    let why = match (method, provenance.threshold_m) {
        (Method::Relational, _) => "its poses agree in no frame".into(),
        (Method::Paper, Some(given)) if learned.domain.states.is_empty() => {
            format!("the threshold of {} mm is probably too large", mm(given))
        }
        (Method::Paper, Some(given)) => {
            format!("the threshold of {} mm may not suit this kind", mm(given))
        }
        (Method::Paper, None) => "no attempt put such an object into a new place".into(),
    };
    let unexplained = learned.report.unexplained.iter().map(|u| &u.kind);
    let kinds: BTreeSet<&String> =
        unexplained.chain(provenance.clusters.iter().map(|c| &c.kind)).collect();
    let stateless = |kind: &&String| learned.domain.states.iter().all(|s| s.kind != **kind);
    let warning = |kind: &String| format!("no state was found for `{kind}`: {why}");
    kinds.into_iter().filter(stateless).map(warning).collect()
}

/// Returns the learned domain and the report as one JSON object.
fn summary(learned: &Learned) -> Value {
    let mut keys = relational::summary(&learned.domain);
    keys.extend(report_json(&learned.report, &learned.domain.provenance.clusters));
    keys.insert("outliers".into(), json!(learned.outliers));
    keys.insert("unachieved".into(), json!(learned.unachieved));
    Value::Object(keys)
}

/// Returns the keys of `symbolt learn --json` that describe the attempts and the clustering.
fn report_json(report: &LearnReport, clusters: &[KindClusters]) -> Map<String, Value> {
    let by_kind = |value: fn(&KindClusters) -> Option<f64>| -> Value {
        clusters.iter().map(|c| (c.kind.clone(), json!(value(c)))).collect()
    };
    let failed: Vec<Value> = failed(report)
        .map(|(t, why)| {
            json!({
                "demo": t.demo, "snapshot": t.before, "object": t.object,
                "inferred": t.inferred, "reason": reason(why),
            })
        })
        .collect();
    let unexplained: Vec<Value> = report
        .unexplained
        .iter()
        .map(|s| {
            json!({"kind": s.kind, "count": s.count, "position": s.mean.position, "seen": s.seen})
        })
        .collect();
    let keys = [
        ("next_merge_m", by_kind(|c| c.next_merge_m)),
        ("threshold_m", by_kind(|c| c.threshold_m)),
        // `tries` counts attempts, `strays` lists unexplained poses. Scripts rely on these old keys.
        ("tries", json!(report.attempts.len())),
        ("failed", json!(failed)),
        ("strays", json!(unexplained)),
        ("fixed_kinds", json!(report.fixed_kinds)),
    ];
    keys.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
}

/// Returns the failed attempts and why they failed.
fn failed(report: &LearnReport) -> impl Iterator<Item = (&AttemptReport, Failure)> {
    report.attempts.iter().filter_map(|attempt| match attempt.outcome {
        AttemptOutcome::Failed(why) => Some((attempt, why)),
        AttemptOutcome::Action(_) => None,
    })
}

/// Returns the reason why an attempt failed, in words.
fn reason(why: Failure) -> &'static str {
    match why {
        Failure::NothingMoved => "nothing moved",
        Failure::PartLost => "the part was lost",
        Failure::NothingNew => "it led to no new state",
        Failure::Detour => "it was a detour that other demonstrations avoided",
        Failure::Undone => "the part returned to an earlier state",
        _ => "it achieved nothing",
    }
}

/// Returns tables of the failed attempts, and of the poses in no state.
fn report_tables(report: &LearnReport) -> String {
    let mut text = String::new();
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
        let place = |(d, s): &(u64, u64)| unbroken(&format!("({d}, {s})"));
        let seen: Vec<String> = poses.seen.iter().take(6).map(place).collect();
        let more = if poses.seen.len() > 6 { ", ..." } else { "" };
        let seen = seen.join(", ") + more;
        grid.row([poses.kind.clone(), poses.count.to_string(), x, y, z, seen]);
    }
    if !grid.is_empty() {
        section(&mut text, "Poses in no state", &grid);
    }
    text
}
