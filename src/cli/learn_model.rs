//! `symbolt learn-model`: an action model in PDDL from trajectories.

use std::path::PathBuf;

use anyhow::{Error, bail};
use clap::Args;
use serde_json::{Value, json};
use symbolt::files::Limit;
use symbolt::plan::model::{LearnedAction, LearnedModel, Rule, learn};
use symbolt::plan::strips::{Bodies, Domain, Literal, Shown, Trajectory};

use super::end::{BadArgument, Outcome};
use super::kind::{Given, Kind, parsed};
use super::options::{Common, OutFile};
use super::output::{Place, Progress, answer_unless_quiet, use_threads, warn};
use super::table::counted;

#[derive(Debug, Clone, Args)]
pub(crate) struct LearnModelArgs {
    /// PDDL domain with types, predicates and the actions' parameters;
    /// preconditions and effects are not used; - for standard input
    #[arg(verbatim_doc_comment)]
    pub domain: PathBuf,
    /// Trajectories of SAM or AMLGym; - for standard input
    #[arg(required = true)]
    pub trajectories: Vec<PathBuf>,
    #[command(flatten)]
    pub common: Common,
    /// Keep every precondition that always held (safe action model
    /// learning); by default the evidence for each is weighed
    #[arg(verbatim_doc_comment, long)]
    pub safe: bool,
    #[command(flatten)]
    pub out: OutFile,
}

pub(crate) fn learn_model(args: &LearnModelArgs) -> Result<Outcome, Error> {
    let out = args.out.place()?;
    use_threads(&args.common)?;
    let inputs = std::iter::once(&args.domain).chain(&args.trajectories);
    if inputs.filter(|path| path.as_os_str() == "-").count() > 1 {
        let problem =
            "only one of the domain and the trajectories can come from standard input (-)";
        bail!(BadArgument(problem.into()));
    }
    let progress = Progress::new(&args.common);
    let domain = Given { path: &args.domain, takes: &[Kind::PddlDomain, Kind::Pddl] };
    let of = |path| Given { path, takes: &[Kind::Trajectory] };
    let others: Vec<Given<'_>> = args.trajectories.iter().map(|path| of(path)).collect();
    let domain = parsed(domain, Limit::PDDL, &others, |bytes, name| {
        Domain::parse(bytes, name, Bodies::Skip)
    })?;
    domain.warnings.iter().for_each(|warning| warn(warning));
    let mut trajectories = Vec::new();
    for path in &args.trajectories {
        progress.say(format!("reading {}", path.display()));
        trajectories.extend(parsed(of(path), Limit::PDDL, &[], |bytes, name| {
            Trajectory::parse(bytes, name, &domain)
        })?);
    }
    let rule = if args.safe { Rule::Safe } else { Rule::Evidence };
    let learned = learn(&domain, &trajectories, rule)?;
    drop(progress);
    for action in learned.actions.iter().filter(|a| a.steps == 0) {
        warn(&format!("the action `{}` was never done and is left out", action.name));
    }
    let printed = matches!(out, Place::Default);
    if !(printed && args.common.json) {
        out.write(learned.to_string())?;
    }
    // A model on standard output is alone there.
    if matches!(out, Place::File(..)) || printed && args.common.json {
        let done = learned.actions.iter().filter(|a| a.steps > 0).count();
        let from = match learned.trajectories {
            1 => "1 trajectory".to_owned(),
            n => format!("{n} trajectories"),
        };
        let text = || format!("learned {} from {from}", counted(done, "action"));
        answer_unless_quiet(&args.common, || summary(&learned), text)?;
    }
    Ok(Outcome::Done)
}

/// Returns the learned actions as one JSON object.
fn summary(learned: &LearnedModel) -> Value {
    json!({
        "domain": learned.domain().name,
        "trajectories": learned.trajectories,
        "actions": learned.actions.iter().map(action).collect::<Vec<_>>(),
    })
}

fn action(action: &LearnedAction) -> Value {
    let parameters = &action.parameters;
    let shown = |literal: &Literal| Shown { literal, parameters }.to_string();
    let all = |literals: &[Literal]| literals.iter().map(shown).collect::<Vec<_>>();
    let atoms = |literals: &[Literal]| {
        let positive = literals.iter().map(|l| Literal { positive: true, ..l.clone() });
        all(&positive.collect::<Vec<_>>())
    };
    let required = action.preconditions.iter().filter(|p| p.reason.is_required());
    let undecided = action.preconditions.iter().filter(|p| !p.reason.is_required());
    let undecided = undecided.map(|p| {
        let reason = p.explanation(parameters);
        json!({"literal": shown(&p.literal), "kept": p.kept, "reason": reason})
    });
    let typed = parameters.iter().map(|p| json!({"name": p.name, "types": p.types}));
    json!({
        "name": action.name,
        "parameters": typed.collect::<Vec<_>>(),
        "preconditions": required.map(|p| shown(&p.literal)).collect::<Vec<_>>(),
        "undecided": undecided.collect::<Vec<_>>(),
        "add": all(&action.add),
        "delete": atoms(&action.delete),
        "counts": {
            "steps": action.steps, "refused": action.refused,
            "unexplained": action.unexplained, "ambiguous": action.ambiguous,
        },
    })
}
