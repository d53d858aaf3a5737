//! `symbolt pddl`: a learned domain and a scene as PDDL.

use anyhow::Error;
use serde_json::json;
use symbolt::files::{Overwrite, ResultFolder, check_output, write_atomic};
use symbolt::task::pddl::{Written, of_relational};
use symbolt::task::relational::{Problem, RelationalDomain};
use symbolt::task::{Snapshot, TaskError};

use super::Outcome;
use super::actions::look;
use super::args::{BadArgument, PddlArgs};
use super::folder::not_standard_output;
use super::plan::wanted;
use super::output::{Progress, counted, emit, emit_json, use_threads, warn};

/// The files that the command writes.
const FILES: [&str; 2] = ["domain.pddl", "problem.pddl"];

pub(crate) fn pddl(args: &PddlArgs) -> Result<Outcome, Error> {
    not_standard_output(&args.out)?;
    if args.domain.as_os_str() == "-" && args.scene.as_os_str() == "-" {
        let problem = "the domain and the scene cannot both come from standard input (-)";
        return Err(BadArgument(problem.into()).into());
    }
    use_threads(&args.common)?;
    let progress = Progress::new(&args.common);
    let domain = RelationalDomain::read(&args.domain)?;
    let scene = Snapshot::read(&args.scene)?;
    let name = args.domain.file_stem().map_or_else(|| "domain".into(), |n| n.to_string_lossy());
    let written = write(args, &domain, &scene, &name)?;
    drop(progress);
    let overwrite = if args.force { Overwrite::Allowed } else { Overwrite::Never };
    let texts = [written.domain_text(), written.problem_text()];
    let folder = ResultFolder::open(&args.out)?;
    if let Some(warning) = folder.warning() {
        warn(&warning.to_string());
    }
    // Either both files are written or none.
    for file in FILES {
        check_output(&args.out.join(file), overwrite)?;
    }
    for (file, text) in FILES.iter().zip(texts) {
        write_atomic(&args.out.join(file), text, overwrite)?;
    }
    let [predicates, actions, facts] =
        [written.domain.predicates.len(), written.domain.actions.len(), written.problem.init.len()];
    if args.common.json {
        emit_json(&[json!({
            "domain": args.out.join(FILES[0]), "problem": args.out.join(FILES[1]),
            "predicates": predicates, "actions": actions, "facts": facts,
        })])?;
    } else if !args.common.quiet {
        let size =
            [counted(predicates, "predicate"), counted(actions, "action"), counted(facts, "fact")];
        emit(&format!("wrote {} and {}: {}", FILES[0], FILES[1], size.join(", ")))?;
    }
    Ok(Outcome::Done)
}

fn write(
    args: &PddlArgs,
    domain: &RelationalDomain,
    scene: &Snapshot,
    name: &str,
) -> Result<Written, Error> {
    let goals = wanted(domain, args.goal.as_deref())?;
    let layout = look(&args.grounding.classifier(domain)?, domain, scene);
    let now = layout.situation();
    let problem = Problem::with_goals(domain, &layout, goals).map_err(TaskError::from)?;
    let ground = problem.ground(&now).map_err(TaskError::from)?;
    let dropped: Vec<(usize, usize)> = ground.dropped().iter().copied().collect();
    for (operator, need) in &dropped {
        let operator = &domain.operators[*operator];
        let need = domain.need_in_words(operator, &operator.needs[*need]);
        warn(&format!("{} does without `{need}`, which is undecided", operator.name));
    }
    of_relational(&problem, &dropped, &now, name).map_err(Error::from)
}
