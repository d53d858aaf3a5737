//! `symbolt actions`: every move that is allowed in a scene.

use std::fmt::Write as _;
use std::path::PathBuf;

use anyhow::Error;
use clap::Args;
use serde_json::{Value, json};
use symbolt::task::TaskError;
use symbolt::task::classify::Layout;
use symbolt::task::compile::{Move, Problem};
use symbolt::task::domain::{RelationalDomain, Situation};

use super::end::Outcome;
use super::look::{look, loose, position, read, target_json};
use super::options::{Common, GroundingArgs, OutFile};
use super::output::use_threads;
use super::table::Grid;

#[derive(Debug, Clone, Args)]
pub(crate) struct ActionsArgs {
    /// Learned domain; - for standard input
    pub domain: PathBuf,
    /// Scene, a file with one JSON object; - for standard input
    #[arg(long, value_name = "FILE")]
    pub scene: PathBuf,
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    pub grounding: GroundingArgs,
    #[command(flatten)]
    pub out: OutFile,
}

/// Prints every move that the operators allow in a scene.
pub(crate) fn actions(args: &ActionsArgs) -> Result<Outcome, Error> {
    let out = args.out.place()?;
    use_threads(&args.common)?;
    let (domain, scene) = read(&args.domain, &args.scene)?;
    let layout = look(&args.grounding, &domain, &scene)?;
    let situation = layout.situation();
    // Which moves are allowed does not depend on the goal.
    let problem = Problem::with_goals(&domain, &layout, Vec::new()).map_err(TaskError::from)?;
    let moves = problem.moves(&situation);
    let names = layout.object_names();
    let text = if args.common.json {
        let lines = moves.iter().map(|m| {
            let mut line = move_json(&problem, m, &layout, &situation);
            line["words"] = json!(words(&domain, m, &names));
            line.to_string()
        });
        lines.collect::<Vec<_>>().join("\n")
    } else {
        let mut grid = Grid::new(&["action", "target m", "not yet true"]);
        for m in &moves {
            let mut row = vec![words(&domain, m, &names)];
            row.push(position(&problem.target(m, &layout)));
            row.push(problem.open_needs(m, &situation).join(", "));
            grid.row(row);
        }
        let mut text = String::new();
        if moves.is_empty() {
            let _ = writeln!(text, "No action is possible in this scene.");
        } else {
            text += &grid.to_string();
        }
        if let Some(loose) = loose(&domain, &layout) {
            let _ = writeln!(text, "\n{loose}");
        }
        text
    };
    out.write(&text)
}

/// Returns a move as a sentence. `names` are the names of the scene's objects.
fn words(domain: &RelationalDomain, m: &Move, names: &[String]) -> String {
    let target = m.reference.map(|r| names[r].as_str());
    domain.move_in_words(&domain.operators[m.operator], Some(&names[m.object]), target)
}

fn onto<'l>(m: &Move, layout: &'l Layout) -> Option<&'l str> {
    m.reference.map(|r| &*layout.objects[r].id)
}

fn move_json(problem: &Problem<'_>, m: &Move, layout: &Layout, situation: &Situation) -> Value {
    json!({
        "action": problem.domain().operators[m.operator].name,
        "object": *layout.objects[m.object].id,
        "onto": onto(m, layout),
        "target": target_json(&problem.target(m, layout)),
        "decided": problem.decided(m, situation),
        "open": problem.open_needs(m, situation),
    })
}
