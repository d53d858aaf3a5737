//! `symbolt actions`: every move that is allowed in a scene. Also a scene as a learned domain sees it.

use std::fmt::Write as _;

use anyhow::Error;
use serde_json::{Value, json};
use symbolt::task::classify::{Classifier, Layout};
use symbolt::task::compile::{Move, Problem, TargetPose};
use symbolt::task::domain::{RelationalDomain, Situation};
use symbolt::task::{Snapshot, TaskError};

use super::Outcome;
use super::args::{ActionsArgs, BadArgument};
use super::output::{Grid, listed, use_threads, warn};
use super::relational::metres;

/// Prints every move that the operators allow in a scene.
pub(crate) fn actions(args: &ActionsArgs) -> Result<Outcome, Error> {
    let out = args.out.place()?;
    use_threads(&args.common)?;
    if args.domain.as_os_str() == "-" && args.scene.as_os_str() == "-" {
        let problem = "the domain and the scene cannot both come from standard input (-)";
        return Err(BadArgument(problem.into()).into());
    }
    let domain = RelationalDomain::read(&args.domain)?;
    let scene = Snapshot::read(&args.scene)?;
    let classifier = args.grounding.classifier(&domain)?;
    let layout = look(&classifier, &domain, &scene);
    let situation = layout.situation();
    // Which moves are allowed does not depend on the goal.
    let problem = Problem::with_goals(&domain, &layout, Vec::new()).map_err(TaskError::from)?;
    let moves = problem.moves(&situation);
    let text = if args.common.json {
        let lines = moves.iter().map(|m| move_json(&problem, m, &layout, &situation).to_string());
        lines.collect::<Vec<_>>().join("\n")
    } else {
        let mut grid = Grid::new(&["action", "object", "onto", "target m", "still open"]);
        for m in &moves {
            let mut row = vec![domain.operators[m.operator].name.clone()];
            row.push(layout.objects[m.object].id.to_string());
            row.push(onto(m, &layout).unwrap_or("-").into());
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
    out.write(&text)?;
    Ok(Outcome::Done)
}

fn onto<'l>(m: &Move, layout: &'l Layout) -> Option<&'l str> {
    m.reference.map(|r| &*layout.objects[r].id)
}

pub(crate) fn position(target: &TargetPose) -> String {
    target.pose.position.map(|v| metres(v, 3)).join(", ")
}

pub(crate) fn target_json(target: &TargetPose) -> Value {
    json!({
        "position": target.pose.position, "orientation": target.pose.orientation,
        "turn": target.turn.name(),
    })
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

/// Finds the state of every object, and warns of objects that are equally near to two references.
pub(crate) fn look(classifier: &Classifier, domain: &RelationalDomain, scene: &Snapshot) -> Layout {
    let layout = classifier.classify(scene);
    for (index, located) in layout.located.iter().enumerate().filter(|(_, l)| l.ambiguous) {
        let Some(fact) = located.fact else { continue };
        let Some(reference) = fact.reference else { continue };
        // Without this reference, the object is found at the other one.
        let mut others = scene.clone();
        others.object = None;
        others.objects.remove(reference);
        let own = if reference < index { index - 1 } else { index };
        let other = classifier.classify_object(&others, own).fact.and_then(|fact| fact.reference);
        let id = |index: usize| layout.objects[index].id.to_string();
        let other =
            other.map_or_else(|| "another one".into(), |o| format!("`{}`", others.objects[o].id));
        let (object, state) = (id(index), &domain.states[fact.state].name);
        warn(&format!(
            "`{object}` is {state} of `{}` and of {other}, which are equally near; `{}` is taken",
            id(reference),
            id(reference)
        ));
    }
    layout
}

/// Returns a line with the objects in no state whose kind has states; `None` if there are none.
pub(crate) fn loose(domain: &RelationalDomain, layout: &Layout) -> Option<String> {
    let known = |kind: &str| domain.states.iter().any(|state| state.kind == kind);
    let all = layout.objects.iter().zip(&layout.located);
    let loose = all.filter(|(o, l)| l.fact.is_none() && known(&o.kind));
    let loose = loose.map(|(o, l)| match l.miss {
        None => o.id.to_string(),
        Some(miss) => {
            let nearest = &domain.states[miss.nearest.state].name;
            format!("{} (nearest {nearest}, {})", o.id, miss.offset.in_words())
        }
    });
    let loose: Vec<String> = loose.collect();
    (!loose.is_empty()).then(|| listed("In no state: ", &loose))
}
