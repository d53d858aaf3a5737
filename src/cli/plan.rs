//! `symbolt plan`: the next action in a scene, the whole plan, and the time of each milestone.

use std::fmt::Write as _;

use anyhow::Error;
use serde_json::{Map, Value, json};
use symbolt::task::classify::Layout;
use symbolt::task::compile::{GroundProblem, Problem, ProblemError};
use symbolt::task::domain::{GoalTerm, RelationalDomain};
use symbolt::task::planner::{Choice, Decision, PlannerKind, SceneEnd, SceneMove, ScenePlan, Why};
use symbolt::task::{Domain, Snapshot, TaskError};

use super::Outcome;
use super::actions::{look, loose, position, target_json};
use super::args::{BadArgument, PlanArgs, PlannerArgs};
use super::goal_sets;
use super::output::{Grid, Progress, counted, listed, unbroken, use_threads, wrapped};

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
    let domain = RelationalDomain::read(&args.domain)?;
    let progress = Progress::new(&args.common);
    let scene = Snapshot::read(scene)?;
    let classifier = args.grounding.classifier(&domain)?;
    let goals = wanted(&domain, args.goal.as_deref())?;
    let words: Vec<String> = goals.iter().map(|goal| domain.goal_in_words(goal)).collect();
    let layout = look(&classifier, &domain, &scene);
    progress.say(format!("planning towards {}", words.join(", ")));
    let planned = args.planner.domain(&domain);
    let plan = match Problem::with_goals(&planned, &layout, goals) {
        Ok(problem) => args.planner.build(args.common.seed)?.plan(&problem, &layout, limit)?,
        Err(error @ ProblemError::TooLarge { .. }) => return Err(TaskError::from(error).into()),
        Err(error) => ScenePlan::impossible(&error),
    };
    drop(progress);
    let planner = &args.planner;
    let first = first(&plan, &planned);
    let shown = Shown { domain: &planned, layout: &layout, plan: &plan, words, planner, first };
    let text = if args.common.json { shown.json().to_string() } else { shown.table() };
    out.write(&text)?;
    Ok(match (&plan.end, plan.moves.is_empty()) {
        // Only the next action counts: the robot looks and plans again after each action.
        (SceneEnd::Stuck(reason), true) => Outcome::Failed(format!("stuck: {reason}")),
        _ => Outcome::Done,
    })
}

/// Returns the goal with a name, or the goal of the demonstrations.
pub(crate) fn wanted(
    domain: &RelationalDomain,
    name: Option<&str>,
) -> Result<Vec<GoalTerm>, Error> {
    match name {
        Some(goal) => Ok(vec![domain.goal(goal)?]),
        None if domain.goals.is_empty() => {
            let problem = "the domain has no goal; name one with --goal STATE";
            Err(BadArgument(problem.into()).into())
        }
        None => Ok(domain.goals.clone()),
    }
}

/// Returns the first decision with the domain that it is about.
fn first<'p>(plan: &'p ScenePlan, of: &RelationalDomain) -> Option<(&'p Domain, Decision)> {
    let (ground, mut decision) = (plan.ground.as_ref()?, plan.first()?.clone());
    let domain = ground.domain();
    // The names of ground actions grow too long for a table.
    for milestone in &mut decision.milestones {
        let action = domain.action_ids().find(|id| domain[*id].name == milestone.subject);
        if let Some(action) = action {
            milestone.subject = of.operators[ground.operator(action)].name.clone();
        }
    }
    Some((domain, decision))
}

/// Returns the end of a plan as a part of a sentence.
fn end_text(end: &SceneEnd) -> String {
    match end {
        SceneEnd::Met => "the goal is met".into(),
        SceneEnd::Circle => "the plan would repeat itself".into(),
        SceneEnd::Stuck(reason) => format!("stuck: {reason}"),
    }
}

/// Returns the value of the key `plan_end`.
fn end_key(end: &SceneEnd) -> String {
    match end {
        SceneEnd::Met => "met".into(),
        SceneEnd::Circle => "circle".into(),
        SceneEnd::Stuck(_) => end_text(end),
    }
}

/// A plan with everything that is printed about it.
struct Shown<'p> {
    domain: &'p RelationalDomain,
    layout: &'p Layout,
    plan: &'p ScenePlan,
    /// The terms of the goal.
    words: Vec<String>,
    planner: &'p PlannerArgs,
    /// The first decision, with the ground domain that it is about. Its milestones name operators.
    first: Option<(&'p Domain, Decision)>,
}

impl Shown<'_> {
    /// Returns the undecided needs that the planner does without: the action and the condition.
    fn dropped(&self) -> Vec<(&str, String)> {
        let dropped = self.plan.ground.iter().flat_map(GroundProblem::dropped);
        let dropped = dropped.filter_map(|(operator, need)| {
            let operator = self.domain.operators.get(*operator)?;
            let need = operator.needs.get(*need)?;
            Some((operator.name.as_str(), self.domain.need_in_words(operator, need)))
        });
        dropped.collect()
    }

    fn json(&self) -> Value {
        let first = self.plan.moves.first();
        let (status, reason) = match (&self.plan.end, first) {
            (_, Some(_)) => ("act", None),
            (SceneEnd::Met, None) => ("met", None),
            (SceneEnd::Stuck(reason), None) => ("stuck", Some(reason.as_str())),
            (SceneEnd::Circle, None) => ("stuck", None),
        };
        let step = |step: &SceneMove| {
            json!({
                "action": step.action, "object": *step.object,
                "onto": step.onto.as_deref(), "place": step.chosen.place,
                "decided": step.decided, "ground_action": step.ground_action,
                "decision_ms": step.decision.time_ms, "target": target_json(&step.target),
            })
        };
        let steps: Vec<Value> = self.plan.moves.iter().map(step).collect();
        let dropped: Vec<Value> = self
            .dropped()
            .iter()
            .map(|(action, condition)| json!({"action": action, "condition": condition}))
            .collect();
        let plan: Vec<&str> = self.plan.moves.iter().map(|step| &*step.action).collect();
        let keys = [
            ("status", json!(status)),
            ("action", json!(first.map(|step| &step.action))),
            ("object", json!(first.map(|step| &*step.object))),
            ("onto", json!(first.and_then(|step| step.onto.as_deref()))),
            ("target", json!(first.map(|step| target_json(&step.target)))),
            ("plan", json!(plan)),
            ("steps", json!(steps)),
            ("plan_end", json!(end_key(&self.plan.end))),
            ("reason", json!(reason)),
            ("goal", json!(self.words.join(", "))),
            ("goals", json!(self.words)),
            ("dropped", json!(dropped)),
        ];
        let first = self.first.as_ref().map(|(domain, decision)| (*domain, decision));
        let keys = keys.into_iter().chain(decision_keys(first, self.planner));
        let keys = keys.map(|(name, value)| (name.to_owned(), value));
        Value::Object(keys.collect::<Map<String, Value>>())
    }

    /// Returns the number of objects in each state that holds.
    fn holds(&self) -> Vec<String> {
        let facts: Vec<usize> =
            self.layout.located.iter().filter_map(|l| Some(l.fact?.state)).collect();
        let states = self.domain.states.iter().enumerate();
        let holds = states.filter_map(|(index, state)| {
            match facts.iter().filter(|fact| **fact == index).count() {
                0 => None,
                1 => Some(state.name.clone()),
                count => Some(format!("{} x{count}", state.name)),
            }
        });
        let holds: Vec<String> = holds.collect();
        if holds.is_empty() { vec!["nothing".into()] } else { holds }
    }

    fn next(&self) -> String {
        let mut next = match self.plan.moves.first() {
            Some(step) => {
                let mut text = format!("do {} with {}", step.action, step.object);
                if let Some(onto) = &step.onto {
                    let _ = write!(text, ", onto {onto}");
                }
                let at = unbroken(&format!("({})", position(&step.target)));
                let _ = write!(text, ", at {at}");
                text
            }
            None => end_text(&self.plan.end),
        };
        let decision = self.first.as_ref().map(|(_, decision)| decision);
        next += &decided(decision, self.planner.counts()[0]);
        next
    }

    fn table(&self) -> String {
        let mut text = String::new();
        let _ = writeln!(text, "{}", listed("Holds: ", &self.holds()));
        let _ = writeln!(text, "{}", listed("Goal:  ", &self.words));
        let _ = writeln!(text, "{}\n", wrapped(&(unbroken("Next:  ") + &self.next()), 7));
        if !self.plan.moves.is_empty() {
            let mut grid = Grid::new(&[">step", "action", "object", "onto", ">decided in ms"]);
            for (index, step) in self.plan.moves.iter().enumerate() {
                let onto = step.onto.as_deref().unwrap_or("-").to_owned();
                let ms = format!("{:.0}", step.decision.time_ms);
                let number = (index + 1).to_string();
                grid.row([number, step.action.clone(), step.object.to_string(), onto, ms]);
            }
            text += &whole(&end_text(&self.plan.end), &grid);
        }
        let dropped = self.dropped();
        if !dropped.is_empty() {
            let mut grid = Grid::new(&["action", "undecided condition that is done without"]);
            for (action, condition) in dropped {
                grid.row([action.to_owned(), condition]);
            }
            let _ = writeln!(text, "Conditions that cannot be met in this scene:\n\n{grid}");
        }
        if let Some((domain, decision)) = &self.first {
            text += &decision_tables(domain, decision, self.planner.counts()[1]);
        }
        if let Some(loose) = loose(self.domain, self.layout) {
            let _ = writeln!(text, "{loose}");
        }
        text
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

/// Returns the keys that are about the first decision.
fn decision_keys(
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

/// Returns the table of a whole plan under its title.
fn whole(end: &str, grid: &Grid) -> String {
    format!("{}\n\n{grid}\n", wrapped(&format!("Whole plan, then {end}:"), 0))
}

/// Returns how long a decision took, in brackets.
fn decided(decision: Option<&Decision>, noun: &str) -> String {
    let Some(decision) = decision else { return String::new() };
    let after = counted(decision.questions as usize, noun);
    format!(" (decided in {:.0} simulated ms after {after})", decision.time_ms)
}

/// Returns the tables about the first decision.
fn decision_tables(domain: &Domain, decision: &Decision, number: &str) -> String {
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
