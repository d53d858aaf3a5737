//! `symbolt plan`: the next action in a scene, the whole plan, and the time of each milestone.

use std::fmt::Write as _;

use anyhow::Error;
use serde_json::{Map, Value, json};
use symbolt::task::planner::{Choice, Counts, Decision, PlanEnd, PlannerKind, RolledOut, Why};
use symbolt::task::{ActionId, Classifier, Domain, Obstacle, Snapshot, StateId, Verdict};

use super::Outcome;
use super::args::{BadArgument, PlanArgs, PlannerArgs};
use super::domain::AnyDomain;
use super::framed;
use super::goal_sets;
use super::output::{Grid, Progress, counted, unbroken, use_threads, wrapped};

pub(crate) fn plan(args: &PlanArgs) -> Result<Outcome, Error> {
    let out = args.out.place()?;
    use_threads(&args.common)?;
    let Some(scene) = &args.scene else {
        return goal_sets::plan(args, &out);
    };
    args.planner.check()?;
    let limit = goal_sets::limit(args.time)?;
    if args.slots.is_some() {
        let problem = "--slots is for a problem in PDDL; leave it out";
        return Err(BadArgument(problem.into()).into());
    }
    if args.planner.kind() == PlannerKind::Chain && args.time.is_some() {
        let problem = "--time is for the planner goal-sets; leave it out";
        return Err(BadArgument(problem.into()).into());
    }
    if args.domain.as_os_str() == "-" && scene.as_os_str() == "-" {
        let problem = "the domain and the scene cannot both come from standard input (-)";
        return Err(BadArgument(problem.into()).into());
    }
    let domain = match AnyDomain::read(&args.domain)? {
        AnyDomain::Relational(domain) => return framed::plan(args, &domain, scene, limit, &out),
        AnyDomain::Plain(domain) => domain,
    };
    let progress = Progress::new(&args.common);
    let scene = Snapshot::read(scene)?;
    let classifier = Classifier::new(&domain, args.grounding.rule())?;
    let goal = wanted_state(&domain, args.goal.as_deref())?;
    let (counts, loose) = count(&classifier, &domain, &scene);
    progress.say("building the planner graph");
    let planner = args.planner.build(args.common.seed)?.over(&domain)?;
    progress.say(format!("planning towards {}", domain[goal].name));
    let mut prediction = Counts::new(&domain, &counts, goal);
    let plan = planner.roll_out(&mut prediction, limit)?;
    drop(progress);
    let text = if args.common.json {
        summary(&domain, &plan, goal, &args.planner).to_string()
    } else {
        let mut text = table(&domain, &plan, &counts, goal, args.planner.counts());
        if !loose.is_empty() {
            let _ = writeln!(text, "{}", listed("In no state: ", &loose));
        }
        text
    };
    out.write(&text)?;
    Ok(outcome(&domain, &plan))
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
fn outcome(domain: &Domain, plan: &RolledOut) -> Outcome {
    match (plan.steps.is_empty(), plan.end) {
        (true, PlanEnd::Stuck(obstacle)) => {
            Outcome::Failed(format!("stuck: {}", obstacle_text(domain, obstacle)))
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
        Obstacle::NoPlan { .. } => "no plan that reaches the goal was found".into(),
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
pub(crate) fn first(plan: &RolledOut) -> Option<&Decision> {
    plan.steps.first().map(|step| &step.decision).or(plan.last.as_ref())
}

/// How a plan ends, in words.
pub(crate) enum End {
    Met,
    /// The predicted situations repeat.
    Circle,
    Stuck(String),
}

impl End {
    pub fn of(domain: &Domain, end: PlanEnd) -> Self {
        match end {
            PlanEnd::Met => Self::Met,
            PlanEnd::Circle => Self::Circle,
            PlanEnd::Stuck(obstacle) => Self::Stuck(obstacle_text(domain, obstacle)),
            PlanEnd::Impossible(action) => {
                Self::Stuck(format!("no object in the scene can do {}", domain[action].name))
            }
        }
    }

    /// Returns the end as a part of a sentence.
    pub fn text(&self) -> String {
        match self {
            Self::Met => "the goal is met".into(),
            Self::Circle => "the plan would repeat itself".into(),
            Self::Stuck(reason) => format!("stuck: {reason}"),
        }
    }

    /// Returns the value of the key `plan_end`.
    pub fn key(&self) -> String {
        match self {
            Self::Met => "met".into(),
            Self::Circle => "circle".into(),
            Self::Stuck(_) => self.text(),
        }
    }
}

/// Returns the keys that are about the first decision.
pub(crate) fn decision_keys(
    first: Option<(&Domain, &Decision)>,
    planner: &PlannerArgs,
) -> [(&'static str, Value); 6] {
    let choices = first.map_or_else(|| json!([]), |(domain, d)| choices_json(domain, d));
    let decision = first.map(|(_, decision)| decision);
    let counted = match planner.kind() {
        PlannerKind::Chain => "questions",
        PlannerKind::GoalSets => "goal_sets",
    };
    [
        ("planner", json!(planner.kind().name())),
        ("mode", json!(planner.mode)),
        ("decision_ms", json!(decision.map(|d| d.time_ms))),
        (counted, json!(decision.map(|d| d.questions))),
        ("milestones_ms", decision.map_or_else(|| json!({}), milestones_json)),
        ("choices", choices),
    ]
}

/// Returns the plan as one JSON object.
fn summary(domain: &Domain, plan: &RolledOut, goal: StateId, planner: &PlannerArgs) -> Value {
    let name = |action: ActionId| domain[action].name.as_str();
    let decision = first(plan);
    let (status, action, reason) = match decision.map(|d| d.verdict) {
        Some(Verdict::Act(action)) => ("act", Some(name(action)), None),
        Some(Verdict::Stuck(obstacle)) => ("stuck", None, Some(obstacle_text(domain, obstacle))),
        Some(Verdict::Met) | None => ("met", None, None),
    };
    let end = End::of(domain, plan.end);
    let keys = [
        ("status", json!(status)),
        ("action", json!(action)),
        ("plan", plan.steps.iter().map(|s| name(s.action)).collect()),
        ("plan_end", json!(end.key())),
        ("reason", json!(reason)),
        ("goal", json!(domain[goal].name)),
    ];
    let first = decision.map(|decision| (domain, decision));
    let keys = keys.into_iter().chain(decision_keys(first, planner));
    Value::Object(keys.map(|(name, value)| (name.to_owned(), value)).collect())
}

/// Returns the time of each milestone of a decision.
fn milestones_json(decision: &Decision) -> Value {
    let mut milestones = Map::new();
    for m in &decision.milestones {
        let key = format!("{:02} {} {}", m.question, m.stage, m.subject);
        milestones.insert(key, json!(m.time_ms));
    }
    Value::Object(milestones)
}

/// Returns the choices among several causes.
fn choices_json(domain: &Domain, decision: &Decision) -> Value {
    let choice = |c: &Choice| {
        json!({
            "question": c.question, "state": domain[c.state].name,
            "action": domain[c.action].name, "among": c.among, "why": why_text(c),
        })
    };
    decision.choices.iter().map(choice).collect()
}

/// Returns the plan as tables, with the words of [`PlannerArgs::counts`].
fn table(
    domain: &Domain,
    plan: &RolledOut,
    counts: &[usize],
    goal: StateId,
    [noun, number]: [&str; 2],
) -> String {
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
    let (decision, end) = (first(plan), End::of(domain, plan.end).text());
    let mut next = match decision.map(|d| d.verdict) {
        Some(Verdict::Act(action)) => format!("do {}", domain[action].name),
        _ => end.clone(),
    };
    next += &decided(decision, noun);
    let _ = writeln!(text, "{}\n", wrapped(&(unbroken("Next:  ") + &next), 7));
    if !plan.steps.is_empty() {
        let mut grid = Grid::new(&[">step", "action", ">decided in ms"]);
        for (index, step) in plan.steps.iter().enumerate() {
            let action = domain[step.action].name.clone();
            grid.row([(index + 1).to_string(), action, format!("{:.0}", step.decision.time_ms)]);
        }
        text += &whole(&end, &grid);
    }
    text + &decision.map_or_else(String::new, |d| decision_tables(domain, d, number))
}

/// Returns the table of a whole plan under its title.
pub(crate) fn whole(end: &str, grid: &Grid) -> String {
    format!("{}\n\n{grid}\n", wrapped(&format!("Whole plan, then {end}:"), 0))
}

/// Returns how long a decision took, in brackets.
pub(crate) fn decided(decision: Option<&Decision>, noun: &str) -> String {
    let Some(decision) = decision else { return String::new() };
    let after = counted(decision.questions as usize, noun);
    format!(" (decided in {:.0} simulated ms after {after})", decision.time_ms)
}

/// Returns the tables about the first decision.
pub(crate) fn decision_tables(domain: &Domain, decision: &Decision, number: &str) -> String {
    choices_table(domain, decision) + &milestones_table(decision, number)
}

/// Returns the choices among several causes as a table; empty if there were none.
fn choices_table(domain: &Domain, decision: &Decision) -> String {
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
fn milestones_table(decision: &Decision, number: &str) -> String {
    let mut grid = Grid::new(&[&format!(">{number}"), "about", "reached", ">at ms"]);
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
