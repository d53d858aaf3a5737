//! `symbolt pddl`: a learned domain and a scene as PDDL.

use std::path::PathBuf;

use anyhow::Error;
use clap::Args;
use serde_json::json;
use symbolt::files::{ResultFolder, check_output, write_atomic};
use symbolt::task::compile::Problem;
use symbolt::task::domain::RelationalDomain;
use symbolt::task::pddl::{Written, of_relational};
use symbolt::task::{Snapshot, TaskError};

use super::end::Outcome;
use super::look::{fewer, look, read, wanted};
use super::options::{Common, GroundingArgs};
use super::output::{
    Progress, answer_unless_quiet, not_standard_output, overwrite, use_threads, warn, warn_of,
};
use super::table::counted;

#[derive(Debug, Clone, Args)]
pub(crate) struct PddlArgs {
    /// Learned domain; - for standard input
    pub domain: PathBuf,
    /// Scene, a file with one JSON object; - for standard input
    #[arg(long, value_name = "FILE")]
    pub scene: PathBuf,
    /// State to reach [default: the goal of the demonstrations]
    #[arg(long, value_name = "STATE")]
    pub goal: Option<String>,
    /// Folder for domain.pddl and problem.pddl
    #[arg(long, value_name = "FOLDER")]
    pub out: PathBuf,
    /// Replace the files if they exist
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    pub grounding: GroundingArgs,
}

/// The files that the command writes.
const FILES: [&str; 2] = ["domain.pddl", "problem.pddl"];

pub(crate) fn pddl(args: &PddlArgs) -> Result<Outcome, Error> {
    not_standard_output(&args.out)?;
    use_threads(&args.common)?;
    let progress = Progress::new(&args.common);
    let (domain, scene) = read(&args.domain, &args.scene)?;
    // `domain` is a word of PDDL.
    let name = args.domain.file_stem().map(|n| n.to_string_lossy());
    let name = name.filter(|name| !matches!(&**name, "domain" | "problem" | "-"));
    let name = name.unwrap_or_else(|| "learned".into());
    let (written, warnings) = write(args, &domain, &scene, &name)?;
    drop(progress);
    let overwrite = overwrite(args.force);
    let texts = [written.domain.to_string(), written.problem.to_string()];
    let folder = ResultFolder::open(&args.out)?;
    warn_of(&folder);
    // Either both files are written or none.
    for file in FILES {
        check_output(&args.out.join(file), overwrite)?;
    }
    for (file, text) in FILES.iter().zip(texts) {
        write_atomic(&args.out.join(file), text, overwrite)?;
    }
    let [predicates, actions, facts] =
        [written.domain.predicates.len(), written.domain.actions.len(), written.problem.init.len()];
    let json = || {
        json!({
            "domain": args.out.join(FILES[0]), "problem": args.out.join(FILES[1]),
            "predicates": predicates, "actions": actions, "facts": facts, "warnings": warnings,
        })
    };
    answer_unless_quiet(&args.common, json, || {
        let size =
            [counted(predicates, "predicate"), counted(actions, "action"), counted(facts, "fact")];
        format!("wrote {} and {}: {}", FILES[0], FILES[1], size.join(", "))
    })
}

fn write(
    args: &PddlArgs,
    domain: &RelationalDomain,
    scene: &Snapshot,
    name: &str,
) -> Result<(Written, Vec<String>), Error> {
    let goals = wanted(domain, args.goal.as_deref())?;
    // Each is told at once: what follows may fail.
    let mut warnings = Vec::new();
    let mut tell = |warning: String| {
        warn(&warning);
        warnings.push(warning);
    };
    fewer(domain, scene, &goals).into_iter().for_each(&mut tell);
    let layout = look(&args.grounding, domain, scene)?;
    let now = layout.situation();
    let problem = Problem::with_goals(domain, &layout, goals).map_err(TaskError::from)?;
    let mut dropped: Vec<(usize, usize)> = Vec::new();
    if problem.lacking(&now) == 0 {
        // There may be no action towards a goal that is met.
        tell("the goal is met in this scene: its plan is empty".into());
    } else {
        let ground = problem.ground(&now).map_err(TaskError::from)?;
        dropped.extend(ground.dropped());
    }
    for (operator, need) in &dropped {
        let operator = &domain.operators[*operator];
        let need = domain.need_in_words(operator, &operator.needs[*need]);
        tell(format!("{} does without `{need}`, which is undecided", operator.name));
    }
    let written = of_relational(&problem, &dropped, &now, name)?;
    Ok((written, warnings))
}
