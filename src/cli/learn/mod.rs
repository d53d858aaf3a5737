//! `symbolt learn`: states and actions from a recording.

mod threshold;

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::PathBuf;

use anyhow::{Error, bail};
use clap::Args;
use serde_json::{Value, json};
use symbolt::doubt::Doubt;
use symbolt::files::Limit;
use symbolt::study::asking::{Question, ask};
use symbolt::task::Recording;
use symbolt::task::domain::{KindClusters, RelationalDomain};
use symbolt::task::learn::{
    AttemptOutcome, AttemptReport, Failure, LearnReport, Learned, Method, Settings, check_exponent,
    learn_attributed,
};

use super::check::doubted;
use super::domain_tables::{self, domain_tables, mm};
use super::end::{BadArgument, Outcome};
use super::kind::{Given, Kind, parsed};
use super::options::{Common, METHODS, OutFile, named, number};
use super::output::{Place, Progress, answer, keys, use_threads, warn};
use super::table::{Grid, counted, note, section, unbroken, wrapped};
use super::watch::ProgressLine;

#[derive(Debug, Clone, Args)]
pub(crate) struct LearnArgs {
    /// Recording with one JSON object per line; - for standard input
    pub recording: PathBuf,
    #[command(flatten)]
    pub common: Common,
    /// Learner: relational (states in the frames of objects, actions with
    /// parameters) or paper (states in the world frame, as in the paper)
    /// [default: relational; paper if --threshold is given]
    #[arg(verbatim_doc_comment, hide_possible_values = true)]
    #[arg(long, value_name = "METHOD", value_parser = named(&METHODS))]
    pub method: Option<Method>,
    /// Clustering threshold for every kind, such as 1.169mm (the paper's)
    /// or 0.001169m; without a unit in metres; needs the method paper
    /// [default: found from the data]
    #[arg(verbatim_doc_comment, long, value_name = "LENGTH", allow_negative_numbers = true)]
    pub threshold: Option<String>,
    /// Exponent p of the p-norm that measures distances; not 0
    #[arg(long, default_value_t = -2.0, value_parser = number::<f64>)]
    pub p: f64,
    #[command(flatten)]
    pub out: OutFile,
}

pub(crate) fn learn(args: &LearnArgs) -> Result<Outcome, Error> {
    let out = args.out.place()?;
    let threshold_m = args.threshold.as_deref().map(threshold::metres).transpose()?;
    let method = match (args.method, threshold_m) {
        (Some(Method::Relational), Some(_)) => {
            let problem =
                "--threshold needs --method paper: the relational learner has no threshold";
            bail!(BadArgument(problem.into()));
        }
        (Some(method), _) => method,
        (None, Some(_)) => Method::Paper,
        (None, None) => Method::Relational,
    };
    check_exponent(args.p)?;
    use_threads(&args.common)?;
    let progress = Progress::new(&args.common);
    progress.say(format!("reading {}", args.recording.display()));
    let recording = Given { path: &args.recording, takes: &[Kind::Recording] };
    let (mut recording, _, attributes) =
        parsed(recording, Limit::RECORDING, &[], Recording::parse_whole)?;
    let settings = Settings { method, p: args.p, threshold_m, seed: args.common.seed };
    let doubts = doubted(&recording);
    let line = &mut ProgressLine::new(&progress);
    let learned = learn_attributed(&mut recording, &attributes, &settings, line)?;
    let empty = learned.domain.operators.is_empty();
    drop(progress);
    if !matches!(out, Place::Default) && !empty {
        out.write(&learned.domain.to_json()?)?;
    }
    for warning in warnings(&learned, method) {
        warn(&warning);
    }
    // With the domain file, standard output holds nothing else.
    if matches!(out, Place::Stdout) {
        learned.remarks.iter().for_each(|remark| warn(&remark.to_string()));
    } else {
        let question = ask(&learned.domain, &recording, &[]);
        let json = || summary(&learned, question.as_ref(), &doubts);
        let text = || {
            let asked = question.as_ref().map(|q| question_text(q, &learned.domain));
            tables(&learned) + &asked.unwrap_or_default()
        };
        answer(&args.common, json, text)?;
    }
    if empty {
        let sentence = "no action was learned: no attempt brought a part into a new state";
        return Ok(Outcome::Failed(sentence.into()));
    }
    Ok(Outcome::Done)
}

/// Returns tables of the learned domain, the failed attempts and the poses in no state.
pub(crate) fn tables(learned: &Learned) -> String {
    let mut text = domain_tables(&learned.domain);
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
    if !learned.unsure_frames.is_empty() {
        let mut grid = Grid::new(&["state, learned in the world", "may be a place beside a"]);
        learned
            .unsure_frames
            .iter()
            .for_each(|(state, kind)| grid.row([state.clone(), kind.clone()]));
        section(&mut text, UNSURE, &grid);
    }
    for remark in &learned.remarks {
        let _ = writeln!(text, "{}\n", wrapped(&note(remark), 0));
    }
    text += &report_tables(&learned.report);
    if learned.outliers > 0 {
        let poses = counted(learned.outliers, "pose");
        let title = "left out, because they disagree with the other poses of their object";
        let _ = writeln!(text, "{}\n", wrapped(&format!("{poses} {title}"), 0));
    }
    text
}

/// The title of what a single demonstration leaves open.
const UNSURE: &str = "What one demonstration cannot decide (one with all objects elsewhere would)";

/// Returns the question for a further demonstration.
fn question_text(question: &Question, domain: &RelationalDomain) -> String {
    let words = |action: &str| domain.in_words(action).into_owned();
    let moves = question.moves.iter();
    let moves = moves.map(|(action, object)| format!("{} ({object})", words(action)));
    let without = match &question.without[..] {
        [] => String::new(),
        ids => format!(" without {}", ids.join(" and ")),
    };
    let title = format!(
        "One more demonstration would decide most if it began as demo {}{without} and went: {}. If it cannot be \
         done so, that decides, too. It would show whether these conditions are needed:",
        question.demo,
        moves.collect::<Vec<_>>().join(", then "),
    );
    let mut grid = Grid::new(&["action", "undecided condition"]);
    question.decides.iter().for_each(|(action, need)| grid.row([words(action), need.clone()]));
    format!("{}\n\n{grid}\n", wrapped(&title, 0))
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
fn summary(learned: &Learned, question: Option<&Question>, doubts: &[Doubt]) -> Value {
    let (report, clusters) = (&learned.report, &learned.domain.provenance.clusters);
    let by_kind = |value: fn(&KindClusters) -> Option<f64>| -> Value {
        clusters.iter().map(|c| (c.kind.clone(), json!(value(c)))).collect()
    };
    let failed = failed(report).map(|(t, why)| {
        json!({
            "demo": t.demo, "snapshot": t.before, "object": t.object,
            "inferred": t.inferred, "reason": reason(why),
        })
    });
    let unexplained = report.unexplained.iter().map(
        |s| json!({"kind": s.kind, "count": s.count, "position": s.mean.position, "seen": s.seen}),
    );
    let remarks = learned.remarks.iter();
    let remarks = remarks.map(|said| json!({"kind": said.name(), "text": said.to_string()}));
    // `tries` counts attempts, `strays` lists unexplained poses. Scripts rely on these old keys.
    let own = json!({
        "next_merge_m": by_kind(|c| c.next_merge_m),
        "threshold_m": by_kind(|c| c.threshold_m),
        "tries": report.attempts.len(),
        "failed": failed.collect::<Vec<_>>(),
        "strays": unexplained.collect::<Vec<_>>(),
        "fixed_kinds": report.fixed_kinds,
        "outliers": learned.outliers,
        "unachieved": learned.unachieved,
        "unsure_frames": learned.unsure_frames,
        "remarks": remarks.collect::<Vec<_>>(),
        "ask": question,
        "warnings": doubts,
    });
    let mut all = domain_tables::summary(&learned.domain);
    all.extend(keys(own));
    Value::Object(all)
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
        Failure::StartUnknown => "it began in no learned state",
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
