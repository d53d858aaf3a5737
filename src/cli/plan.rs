//! `symbolt plan`: the next action in a scene, the whole plan, and the time of each milestone.

use std::fmt::Write as _;

use anyhow::Error;
use serde_json::{Map, Value, json};
use symbolt::neurons::{Population, PopulationPlan};
use symbolt::sim::Seed;
use symbolt::task::planner::{Choice, Decision, PlanEnd, Planner, PlannerKind, RolledOut, Why};
use symbolt::task::{
    ActionId, Classifier, Domain, Obstacle, Snapshot, StateId, Verdict, WorldState,
};

use super::Outcome;
use super::args::{BadArgument, PlanArgs, PlannerArgs};
use super::domain::AnyDomain;
use super::framed;
use super::goal_sets;
use super::output::{Grid, Progress, counted, unbroken, use_threads, wrapped};
use super::ranks;

pub(crate) fn plan(args: &PlanArgs) -> Result<Outcome, Error> {
    let out = args.out.place()?;
    args.planner.check()?;
    use_threads(&args.common)?;
    let Some(scene) = &args.scene else {
        return goal_sets::plan(args, &out);
    };
    let given = [("--slots", args.slots.is_some()), ("--time", args.time.is_some())];
    if let (PlannerKind::Chain, Some((option, _))) =
        (args.planner.kind(), given.iter().find(|(_, given)| *given))
    {
        let problem = format!("{option} is for the planner goal-sets; add --planner goal-sets");
        return Err(BadArgument(problem).into());
    }
    if args.domain.as_os_str() == "-" && scene.as_os_str() == "-" {
        let problem = "the domain and the scene cannot both come from standard input (-)";
        return Err(BadArgument(problem.into()).into());
    }
    let domain = match AnyDomain::read(&args.domain)? {
        AnyDomain::Relational(domain) => return framed::plan(args, &domain, scene, &out),
        AnyDomain::Plain(domain) => domain,
    };
    let progress = Progress::new(&args.common);
    let scene = Snapshot::read(scene)?;
    let classifier = Classifier::new(&domain, args.grounding.rule())?;
    let goal = wanted_state(&domain, args.goal.as_deref())?;
    let (counts, loose) = count(&classifier, &domain, &scene);
    if args.planner.kind() == PlannerKind::GoalSets {
        drop(progress);
        let present: WorldState = counts.iter().map(|count| *count > 0).collect();
        return goal_sets::plan_in(args, &domain, &present, &[goal], &out);
    }
    progress.say("building the planner graph");
    let planner = build(&domain, &args.planner, args.common.seed)?;
    progress.say(format!("planning towards {}", domain[goal].name));
    let plan = planner.plan(&counts, goal)?;
    drop(progress);
    let text = if args.common.json {
        summary(&planner, &plan, goal, &args.planner.mode).to_string()
    } else {
        let mut text = table(&planner, &plan, &counts, goal);
        if !loose.is_empty() {
            let _ = writeln!(text, "{}", listed("In no state: ", &loose));
        }
        text
    };
    out.write(&text)?;
    Ok(outcome(&planner, &plan))
}

/// Returns the state with a name, or the goal of the domain.
pub(crate) fn wanted_state(domain: &Domain, name: Option<&str>) -> Result<StateId, Error> {
    match (name, domain.goal()) {
        (Some(goal), _) => Ok(domain.state(goal)?),
        (None, Some(goal)) => Ok(goal),
        (None, None) => Err(no_goal()),
    }
}

/// Returns the error for a domain without a goal.
pub(crate) fn no_goal() -> Error {
    BadArgument("the domain has no goal; name one with --goal STATE".into()).into()
}

/// Builds the planner graph with the given options.
pub(crate) fn build(domain: &Domain, args: &PlannerArgs, seed: u64) -> Result<Planner, Error> {
    let mode: Population = args.mode.parse()?;
    let plan = ranks::shared(PopulationPlan::all(mode));
    Ok(Planner::with_plan(domain, args.spec(), &plan, Seed::new(seed))?)
}

/// Returns the number of objects in each state, and the ids of objects in no state whose kind has states, each with the
/// nearest state.
pub(crate) fn count(
    classifier: &Classifier,
    domain: &Domain,
    scene: &Snapshot,
) -> (Vec<usize>, Vec<String>) {
    let mut counts = vec![0; domain.states().len()];
    let mut loose = Vec::new();
    for (object, grounded) in scene.objects.iter().zip(classifier.classify_all(scene)) {
        match grounded.state {
            Some(state) => counts[state.index()] += 1,
            None => {
                let nearest = classifier.nearest(&object.kind, &object.pose);
                loose.extend(nearest.map(|(state, offset)| {
                    let nearest = &domain[state].name;
                    format!("{} (nearest {nearest}, {})", object.id, offset.in_words())
                }));
            }
        }
    }
    (counts, loose)
}

/// Returns success if there is an action or the goal is met, otherwise the reason why the planner is stuck.
pub(crate) fn outcome(planner: &Planner, plan: &RolledOut) -> Outcome {
    match (plan.steps.is_empty(), plan.end) {
        (true, PlanEnd::Stuck(obstacle)) => {
            Outcome::Failed(format!("stuck: {}", obstacle_text(planner.domain(), obstacle)))
        }
        // Only the next action counts: the robot looks and plans again after each action.
        _ => Outcome::Done,
    }
}

/// Returns an obstacle in words. `assets/report/words.js` has the same sentences.
pub(crate) fn obstacle_text(domain: &Domain, obstacle: Obstacle) -> String {
    let state = |state: StateId| domain[state].name.as_str();
    let action = |action: ActionId| domain[action].name.as_str();
    match obstacle {
        Obstacle::NothingCauses { state: s } => {
            format!("{} does not hold and no action causes it", state(s))
        }
        Obstacle::MustBeAbsent { action: a, state: s } => {
            format!("{} holds, but must be absent before {}", state(s), action(a))
        }
        Obstacle::NeedsItself { state: s } => {
            format!("every way to reach {} requires {} itself", state(s), state(s))
        }
        _ => "the goal cannot be reached".into(),
    }
}

/// Returns the reason why a cause was chosen, in words.
fn why_text(choice: &Choice) -> String {
    let unmet = |unmet: usize| match unmet {
        0 => "all its preconditions hold".to_owned(),
        _ => format!("it has {}", counted(unmet, "unmet precondition")),
    };
    match choice.why {
        Why::OnlyOneLeft => "every other cause is impossible".into(),
        Why::FewestUnmet { unmet: 0 } => "only this cause has all its preconditions met".into(),
        Why::FewestUnmet { unmet: n } => format!("{}, fewer than every other cause", unmet(n)),
        Why::Preferred { unmet: n } => format!("{}, and it is preferred among equals", unmet(n)),
        Why::Imprecision => "the neurons were too imprecise to choose the best cause".into(),
        _ => "unknown".into(),
    }
}

/// Returns the decision about the scene itself. The other decisions are about predicted world states.
fn first(plan: &RolledOut) -> &Decision {
    plan.steps.first().map_or(&plan.last, |step| &step.decision)
}

/// Returns the plan as one JSON object.
pub(crate) fn summary(planner: &Planner, plan: &RolledOut, goal: StateId, mode: &str) -> Value {
    let domain = planner.domain();
    let name = |action: ActionId| domain[action].name.as_str();
    let decision = first(plan);
    let (status, action, reason) = match decision.verdict {
        Verdict::Act(action) => ("act", Some(name(action)), None),
        Verdict::Met => ("met", None, None),
        Verdict::Stuck(obstacle) => ("stuck", None, Some(obstacle_text(domain, obstacle))),
    };
    let end = match plan.end {
        PlanEnd::Met => json!("met"),
        PlanEnd::Circle => json!("circle"),
        PlanEnd::Stuck(obstacle) => json!(format!("stuck: {}", obstacle_text(domain, obstacle))),
    };
    json!({
        "status": status,
        "action": action,
        "plan": plan.steps.iter().map(|s| name(s.action)).collect::<Vec<_>>(),
        "plan_end": end,
        "reason": reason,
        "goal": domain[goal].name,
        "mode": mode,
        "decision_ms": decision.time_ms,
        "questions": decision.questions,
        "planner": "graph",
        "milestones_ms": milestones_json(decision),
        "choices": choices_json(domain, decision),
    })
}

/// Returns the time of each milestone of a decision.
pub(crate) fn milestones_json(decision: &Decision) -> Value {
    let mut milestones = Map::new();
    for m in &decision.milestones {
        let key = format!("{:02} {} {}", m.question, m.stage, m.subject);
        milestones.insert(key, json!(m.time_ms));
    }
    Value::Object(milestones)
}

/// Returns the choices among several causes.
pub(crate) fn choices_json(domain: &Domain, decision: &Decision) -> Value {
    let choice = |c: &Choice| {
        json!({
            "question": c.question, "state": domain[c.state].name,
            "action": domain[c.action].name, "among": c.among, "why": why_text(c),
        })
    };
    decision.choices.iter().map(choice).collect()
}

/// Returns the plan as tables.
pub(crate) fn table(
    planner: &Planner,
    plan: &RolledOut,
    counts: &[usize],
    goal: StateId,
) -> String {
    let domain = planner.domain();
    let mut text = String::new();
    let holds: Vec<String> = domain
        .states()
        .iter()
        .zip(counts)
        .filter(|(_, count)| **count > 0)
        .map(|(s, count)| if *count > 1 { format!("{} x{count}", s.name) } else { s.name.clone() })
        .collect();
    let holds = if holds.is_empty() { vec!["nothing".into()] } else { holds };
    let _ = writeln!(text, "{}\nGoal:  {}", listed("Holds: ", &holds), domain[goal].name);
    let decision = first(plan);
    let answer = match decision.verdict {
        Verdict::Act(action) => format!("do {}", domain[action].name),
        Verdict::Met => "the goal is met".into(),
        Verdict::Stuck(obstacle) => format!("stuck: {}", obstacle_text(domain, obstacle)),
    };
    let next = format!(
        "{} {answer} (decided in {:.0} simulated ms after {})",
        unbroken("Next: "),
        decision.time_ms,
        counted(decision.questions as usize, "question"),
    );
    let _ = writeln!(text, "{}\n", wrapped(&next, 7));
    if !plan.steps.is_empty() {
        let mut grid = Grid::new(&[">step", "action", ">decided in ms"]);
        for (index, step) in plan.steps.iter().enumerate() {
            let action = domain[step.action].name.clone();
            grid.row([(index + 1).to_string(), action, format!("{:.0}", step.decision.time_ms)]);
        }
        let end = match plan.end {
            PlanEnd::Met => "then the goal is met".into(),
            PlanEnd::Circle => "then the plan would repeat itself".into(),
            PlanEnd::Stuck(obstacle) => format!("then stuck: {}", obstacle_text(domain, obstacle)),
        };
        let title = wrapped(&format!("Whole plan, {end}:"), 0);
        let _ = writeln!(text, "{title}\n\n{grid}");
    }
    text + &choices_table(domain, decision) + &milestones_table(decision)
}

/// Returns the choices among several causes as a table; empty if there were none.
pub(crate) fn choices_table(domain: &Domain, decision: &Decision) -> String {
    if decision.choices.is_empty() {
        return String::new();
    }
    let mut grid = Grid::new(&[">question", "about", "chosen", ">among", "because"]);
    for c in &decision.choices {
        let (state, action) = (domain[c.state].name.clone(), domain[c.action].name.clone());
        grid.row([c.question.to_string(), state, action, c.among.to_string(), why_text(c)]);
    }
    format!("Choices among several causes:\n\n{grid}\n")
}

/// Returns the milestones of a decision as a table.
pub(crate) fn milestones_table(decision: &Decision) -> String {
    let mut grid = Grid::new(&[">question", "about", "reached", ">at ms"]);
    for m in &decision.milestones {
        let question = m.question.to_string();
        grid.row([question, m.subject.clone(), m.stage.to_string(), format!("{:.0}", m.time_ms)]);
    }
    format!("{}\n\n{grid}\n", wrapped(MILESTONES, 0))
}

/// The title of the milestones. It names the moment from which all times of a plan count.
const MILESTONES: &str = "Milestones of the next decision. All times count from the moment at which the planner \
                          is given the goal and the scene:";

/// Lists names after a title, broken between names.
pub(crate) fn listed(title: &str, names: &[String]) -> String {
    let names: Vec<String> = names.iter().map(|name| unbroken(name)).collect();
    wrapped(&(unbroken(title) + &names.join(", ")), title.len())
}
