//! `symbolt learn`: states and actions from a recording.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use anyhow::Error;
use serde_json::{Map, Value, json};
use symbolt::files::write_atomic;
use symbolt::task::event::Observer;
use symbolt::task::learn::{
    self, AttemptOutcome, AttemptReport, Failure, LearnReport, Learned, RelationallyLearned,
    Settings, learn_observed, learn_relational_observed,
};
use symbolt::task::{Domain, KindClusters, Origin, Recording, StateId, TaskError};

use super::Outcome;
use super::args::{BadArgument, LearnArgs, Method};
use super::output::{
    Grid, Progress, counted, emit, emit_json, mm, refuse_existing, section, unbroken, use_threads,
    warn, wrapped,
};
use super::watch::ProgressLine;
use super::{relational, threshold};

pub(crate) fn learn(args: &LearnArgs) -> Result<Outcome, Error> {
    refuse_existing(args.out.out.as_deref(), args.out.force)?;
    let threshold_m = args.threshold.as_deref().map(threshold::metres).transpose()?;
    let method = match (args.method, threshold_m) {
        (Some(Method::Relational), Some(_)) => {
            let problem =
                "--threshold needs --method paper: the relational learner has no threshold";
            return Err(BadArgument(problem.into()).into());
        }
        (Some(method), _) => method,
        (None, Some(_)) => Method::Paper,
        (None, None) => Method::Relational,
    };
    use_threads(&args.common)?;
    let progress = Progress::new(&args.common);
    progress.say(format!("reading {}", args.recording.display()));
    let recording = Recording::read(&args.recording)?;
    let settings = Settings { p: args.p, threshold_m, seed: args.common.seed };
    let mut line = ProgressLine::new(&progress);
    let learned = AnyLearned::from(method, &recording, &settings, &mut line)?;
    let empty = learned.actions() == 0;
    if let Some(path) = args.out.out.as_ref().filter(|_| !empty) {
        write_atomic(path, learned.to_json()?, args.out.overwrite())?;
    }
    drop(progress);
    for warning in learned.warnings() {
        warn(&warning);
    }
    if args.common.json {
        emit_json(&[learned.summary(&recording, &settings)])?;
    } else {
        emit(&learned.tables())?;
    }
    if empty {
        let sentence = "no action was learned: no attempt brought a part into a new state";
        return Ok(Outcome::Failed(sentence.into()));
    }
    Ok(Outcome::Done)
}

/// What either learner has learned.
pub(crate) enum AnyLearned {
    Relational(RelationallyLearned),
    Paper(Learned),
}

impl AnyLearned {
    /// Learns from a recording.
    pub fn from(
        method: Method,
        recording: &Recording,
        settings: &Settings,
        observer: &mut dyn Observer,
    ) -> Result<Self, TaskError> {
        Ok(match method {
            Method::Relational => {
                Self::Relational(learn_relational_observed(recording, settings, observer)?)
            }
            Method::Paper => Self::Paper(learn_observed(recording, settings, observer)?),
        })
    }

    /// Returns the goal in words; `None` if there is none.
    pub fn goal(&self) -> Option<String> {
        match self {
            Self::Relational(learned) => {
                let domain = &learned.domain;
                let terms: Vec<String> =
                    domain.goals.iter().map(|goal| domain.goal_in_words(goal)).collect();
                (!terms.is_empty()).then(|| terms.join(", "))
            }
            Self::Paper(learned) => learned.domain.goal_name().map(str::to_owned),
        }
    }

    pub fn states(&self) -> usize {
        match self {
            Self::Relational(learned) => learned.domain.states.len(),
            Self::Paper(learned) => learned.domain.states().len(),
        }
    }

    pub fn actions(&self) -> usize {
        match self {
            Self::Relational(learned) => learned.domain.operators.len(),
            Self::Paper(learned) => learned.domain.operators().len(),
        }
    }

    /// Returns the content of the domain file.
    pub fn to_json(&self) -> Result<String, TaskError> {
        match self {
            Self::Relational(learned) => learned.domain.to_json(),
            Self::Paper(learned) => learned.domain.to_json(),
        }
    }

    /// Returns tables of the learned domain, the failed attempts and the poses in no state.
    pub fn tables(&self) -> String {
        match self {
            Self::Relational(learned) => {
                let mut text = relational::domain_tables(&learned.domain);
                for state in &learned.unachieved {
                    let note = format!(
                        "{state} held at the end of the demonstrations, but no action that achieves it was learned. It is \
                         not part of the goal."
                    );
                    let _ = writeln!(text, "{}\n", wrapped(&note, 0));
                }
                text += &report_tables(&learned.report, "Poses in no state");
                if learned.outliers > 0 {
                    let poses = counted(learned.outliers, "pose");
                    let title =
                        "left out, because they disagree with the other poses of their object";
                    let _ = writeln!(text, "{}\n", wrapped(&format!("{poses} {title}"), 0));
                }
                text
            }
            Self::Paper(learned) => tables(learned),
        }
    }

    fn warnings(&self) -> Vec<String> {
        match self {
            Self::Relational(learned) => {
                let kinds = learned.report.unexplained.iter().map(|u| &u.kind);
                let kinds: BTreeSet<&String> = kinds.collect();
                let stateless =
                    |kind: &&String| learned.domain.states.iter().all(|state| state.kind != **kind);
                let warning = |kind: &String| {
                    format!("no state was found for `{kind}`: its poses agree in no frame")
                };
                kinds.into_iter().filter(stateless).map(warning).collect()
            }
            Self::Paper(learned) => kinds_without_states(&learned.domain),
        }
    }

    /// Returns the learned domain and the report as one JSON object.
    fn summary(&self, recording: &Recording, settings: &Settings) -> Value {
        let unachieved = match self {
            Self::Relational(found) => &found.unachieved[..],
            Self::Paper(_) => &[],
        };
        let (mut keys, report, clusters, outliers) = match self {
            Self::Relational(found) => {
                let keys = relational::summary(&found.domain);
                // The relational learner has no thresholds. These keys describe the clustering of the paper.
                let paper = match found.domain.provenance.clusters[..] {
                    [] => learn::learn(recording, settings).ok(),
                    [..] => None,
                };
                let paper = paper.as_ref().and_then(|p| p.domain.provenance());
                let clusters = paper.unwrap_or(&found.domain.provenance).clusters.clone();
                (keys, &found.report, clusters, found.outliers)
            }
            Self::Paper(learned) => {
                let clusters = learned.domain.provenance().map(|p| p.clusters.clone());
                (domain_json(&learned.domain), &learned.report, clusters.unwrap_or_default(), 0)
            }
        };
        keys.extend(report_json(report, &clusters));
        keys.insert("outliers".into(), json!(outliers));
        keys.insert("unachieved".into(), json!(unachieved));
        Value::Object(keys)
    }
}

/// Returns a warning for each kind of moved object that has no state.
fn kinds_without_states(domain: &Domain) -> Vec<String> {
    let provenance = domain.provenance();
    let advice = match provenance.and_then(|p| p.threshold_m) {
        Some(given) if domain.states().is_empty() => {
            format!("the threshold of {} mm is probably too large", mm(given))
        }
        Some(given) => format!("the threshold of {} mm may not suit this kind", mm(given)),
        None => "no attempt put such an object into a new place".into(),
    };
    provenance
        .map_or(&[][..], |p| &p.clusters)
        .iter()
        .filter(|clusters| domain.states().iter().all(|state| state.kind != clusters.kind))
        .map(|clusters| format!("no state was found for `{}`: {advice}", clusters.kind))
        .collect()
}

/// Returns the keys of `symbolt learn --json` that describe a domain without frames.
fn domain_json(domain: &Domain) -> Map<String, Value> {
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
    let keys = [
        ("states", json!(states)),
        ("operators", json!(operators)),
        ("goal", json!(domain.goal_name())),
    ];
    keys.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
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

/// Returns tables of the learned domain, the failed attempts and the poses in no state.
pub(crate) fn tables(learned: &Learned) -> String {
    let strays = "Poses in no state, seen only around failed attempts";
    domain_tables(&learned.domain) + &report_tables(&learned.report, strays)
}

/// Returns tables of the failed attempts, and of the poses in no state under the title `strays`.
fn report_tables(report: &LearnReport, strays: &str) -> String {
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
        section(&mut text, strays, &grid);
    }
    text
}

/// Returns tables of a domain. A domain written in code has no geometry and no counts, and none are printed.
pub(crate) fn domain_tables(domain: &Domain) -> String {
    let mut text = String::new();
    section(&mut text, &counted(domain.states().len(), "state"), &state_table(domain));
    let spreads = spread_table(domain);
    if !spreads.is_empty() {
        section(&mut text, "Standard deviations of the poses in each state", &spreads);
    }
    section(&mut text, &counted(domain.operators().len(), "action"), &action_table(domain));
    let evidence = evidence_table(domain);
    if !evidence.is_empty() {
        let title = "Evidence (a precondition marked 4/5 held before 4 of 5 instances)";
        section(&mut text, title, &evidence);
    }
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
        let whose = if provenance.is_some() { "Goal of the demonstrations" } else { "Goal" };
        let _ = writeln!(text, "{whose}: {goal}\n");
    }
    text
}

/// Returns the states with their mean positions.
fn state_table(domain: &Domain) -> Grid {
    let mut columns = vec!["state", "kind"];
    let learned = domain.states().iter().any(|state| state.learned.is_some());
    if learned {
        columns.extend(["origin", ">x m", ">y m", ">z m"]);
    }
    let mut grid = Grid::new(&columns);
    for state in domain.states() {
        let mut row = vec![state.name.clone(), state.kind.clone()];
        if let Some(learned) = &state.learned {
            let origin = match learned.origin {
                Origin::Found => "found",
                Origin::Placed => "placed",
            };
            row.push(origin.into());
            row.extend(learned.mean.position.map(|v| format!("{v:.4}")));
        } else {
            row.resize(columns.len(), "-".into());
        }
        grid.row(row);
    }
    grid
}

/// Returns the number and the spread of the poses in each learned state.
fn spread_table(domain: &Domain) -> Grid {
    let mut grid = Grid::new(&["state", ">poses", ">x mm", ">y mm", ">z mm"]);
    for state in domain.states() {
        if let Some(learned) = &state.learned {
            let mut row = vec![state.name.clone(), learned.count.to_string()];
            row.extend(learned.spread().map(mm));
            grid.row(row);
        }
    }
    grid
}

/// Returns the actions with their preconditions and effects.
fn action_table(domain: &Domain) -> Grid {
    let operators = domain.operators();
    // An action written in code requires its absent states to be absent. For a learned action, they were only observed
    // to be absent.
    let learned = operators.iter().any(|o| o.evidence.is_some());
    let with_absent = !learned && operators.iter().any(|o| !o.absent.is_empty());
    let mut columns = vec!["action", "preconditions", "effects"];
    columns.extend(with_absent.then_some("must be absent"));
    let mut grid = Grid::new(&columns);
    for operator in operators {
        let evidence = operator.evidence.as_ref();
        let need = |state: &StateId| {
            let name = &domain[*state].name;
            evidence.map_or_else(
                || name.clone(),
                |e| {
                    let count = e.before.get(state.index()).copied().unwrap_or(0);
                    unbroken(&format!("{name} ({count}/{})", e.instances))
                },
            )
        };
        let needs: Vec<String> = operator.preconditions.iter().map(need).collect();
        let effects = domain.names(&operator.effects).join(", ");
        let mut row = vec![operator.name.clone(), needs.join(", "), effects];
        row.extend(with_absent.then(|| domain.names(&operator.absent).join(", ")));
        grid.row(row);
    }
    grid
}

/// Returns the number of instances of each learned action, and the states that never held before it.
fn evidence_table(domain: &Domain) -> Grid {
    let mut grid = Grid::new(&["action", ">instances", "never held before it"]);
    for operator in domain.operators() {
        if let Some(evidence) = &operator.evidence {
            let absent = domain.names(&operator.absent).join(", ");
            grid.row([operator.name.clone(), evidence.instances.to_string(), absent]);
        }
    }
    grid
}
