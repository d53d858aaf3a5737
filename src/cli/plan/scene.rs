//! `symbolt plan` in a scene: the next action, the whole plan, and the time of each milestone.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::{Error, bail};
use serde_json::{Value, json};
use symbolt::sim::few;
use symbolt::task::classify::Layout;
use symbolt::task::compile::{GroundProblem, Problem, ProblemError};
use symbolt::task::domain::{RelationalDomain, RelationalOperator};
use symbolt::task::planner::{Choice, Decision, PlannerKind, SceneEnd, SceneMove, ScenePlan, Why};
use symbolt::task::{Domain, TaskError};

use super::args::PlanArgs;
use crate::cli::end::{BadArgument, Outcome};
use crate::cli::look::{fewer, look, loose, misses, position, read, target_json, wanted};
use crate::cli::options::PlannerArgs;
use crate::cli::output::{Place, Progress, warn};
use crate::cli::table::{Grid, counted, listed, unbroken, wrapped};

pub(super) fn plan(args: &PlanArgs, scene: &Path, out: &Place) -> Result<Outcome, Error> {
    args.planner.check()?;
    let limit = args.limit()?;
    if args.spikes {
        bail!(BadArgument("--spikes is for a problem in PDDL; leave it out".into()));
    }
    if args.slots.is_some() {
        bail!(BadArgument("--slots is for a problem in PDDL; leave it out".into()));
    }
    if args.planner.kind() == PlannerKind::Chain && args.time.is_some() {
        bail!(BadArgument("--time is for the planner goal-sets; leave it out".into()));
    }
    let (domain, scene) = read(&args.domain, scene)?;
    let progress = Progress::new(&args.common);
    let goals = wanted(&domain, args.goal.as_deref())?;
    let words: Vec<String> = goals.iter().map(|goal| domain.goal_in_words(goal)).collect();
    let symbols = goals.iter().map(|goal| domain.goal_in_symbols(goal)).collect();
    let mut warnings = fewer(&domain, &scene, &goals);
    warnings.iter().for_each(|warning| warn(warning));
    let layout = look(&args.grounding, &domain, &scene)?;
    progress.say(format!("planning towards {}", words.join(", ")));
    let planned = args.planner.domain(&domain);
    let plan = match Problem::with_goals(&planned, &layout, goals) {
        Ok(problem) => args.planner.build(args.common.seed)?.plan(&problem, &layout, limit)?,
        Err(error @ ProblemError::TooLarge { .. }) => return Err(TaskError::from(error).into()),
        Err(error) => ScenePlan::impossible(&error),
    };
    drop(progress);
    for id in &plan.assumed {
        let warning = format!(
            "`{id}` is in no state; the plan takes it as if an action could take it from there"
        );
        warn(&warning);
        warnings.push(warning);
    }
    if plan.apart {
        let warning = "no way was found with the objects of a kind taken as one; the plan was made object by object";
        warn(warning);
        warnings.push(warning.into());
    }
    let planner = &args.planner;
    let first = first(&plan, &planned);
    let shown = Shown {
        domain: &planned,
        layout: &layout,
        plan: &plan,
        words,
        symbols,
        warnings,
        planner,
        first,
    };
    let text = if args.common.json { shown.json().to_string() } else { shown.table() };
    out.write(&text)?;
    Ok(match (&plan.end, plan.moves.is_empty()) {
        // Only the next action counts: the robot looks and plans again after each action.
        (SceneEnd::Stuck(reason), true) => {
            // What is in no state is what an action would need, more often than not.
            let loose = misses(&planned, &layout);
            let why = match loose.is_empty() {
                true => String::new(),
                false => format!("; in no state: {}", few(loose)),
            };
            Outcome::Failed(format!("stuck: {reason}{why}"))
        }
        _ => Outcome::Done,
    })
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
    /// The terms of the goal, as sentences and in symbols.
    words: Vec<String>,
    symbols: Vec<String>,
    warnings: Vec<String>,
    planner: &'p PlannerArgs,
    /// The first decision, with the ground domain that it is about. Its milestones name operators.
    first: Option<(&'p Domain, Decision)>,
}

impl Shown<'_> {
    /// Returns the undecided needs that the planner does without: the action and the condition.
    fn dropped(&self) -> Vec<(&RelationalOperator, String)> {
        let dropped = self.plan.ground.iter().flat_map(GroundProblem::dropped);
        let dropped = dropped.filter_map(|(operator, need)| {
            let operator = self.domain.operators.get(*operator)?;
            let need = operator.needs.get(*need)?;
            Some((operator, self.domain.need_in_words(operator, need)))
        });
        dropped.collect()
    }

    fn json(&self) -> Value {
        let moves = &self.plan.moves;
        let next = moves.first();
        let (status, reason) = match (&self.plan.end, next) {
            (_, Some(_)) => ("act", None),
            (SceneEnd::Met, None) => ("met", None),
            (SceneEnd::Stuck(reason), None) => ("stuck", Some(reason.as_str())),
            (SceneEnd::Circle, None) => ("stuck", None),
        };
        let step = |step: &SceneMove| {
            json!({
                "action": step.action, "words": step.words, "object": *step.object,
                "onto": step.onto.as_deref(), "place": step.chosen.place,
                "decided": step.decided, "ground_action": step.ground_action,
                "decision_ms": step.decision.time_ms, "target": target_json(&step.target),
            })
        };
        let dropped = self.dropped().into_iter();
        let dropped =
            dropped.map(|(o, condition)| json!({"action": o.name, "condition": condition}));
        let decision = self.first.as_ref().map(|(_, decision)| decision);
        let choices = self.first.as_ref().map(|(domain, d)| choices_json(domain, d));
        let counted = match self.planner.kind() {
            PlannerKind::Chain => "questions",
            PlannerKind::GoalSets => "goal_sets",
        };
        json!({
            "status": status,
            "action": next.map(|step| &step.action),
            "words": next.map(|step| &step.words),
            "object": next.map(|step| &*step.object),
            "onto": next.and_then(|step| step.onto.as_deref()),
            "target": next.map(|step| target_json(&step.target)),
            "plan": moves.iter().map(|step| &*step.action).collect::<Vec<_>>(),
            "steps": moves.iter().map(step).collect::<Vec<_>>(),
            "plan_end": end_key(&self.plan.end),
            "reason": reason,
            "goal": self.symbols.join(", "),
            "goals": self.symbols,
            "goal_words": self.words.join(", and "),
            "warnings": self.warnings,
            "dropped": dropped.collect::<Vec<_>>(),
            "planner": self.planner.kind().name(),
            "mode": self.planner.mode,
            "decision_ms": decision.map(|d| d.time_ms),
            counted: decision.map(|d| d.questions),
            "milestones_ms": decision.map_or_else(|| json!({}), milestones_json),
            "choices": choices.unwrap_or_else(|| json!([])),
        })
    }

    /// Returns the number of objects in each state that holds.
    fn holds(&self) -> Vec<String> {
        let facts: Vec<usize> =
            self.layout.located.iter().filter_map(|l| Some(l.fact?.state)).collect();
        let holds = (0..self.domain.states.len()).filter_map(|index| {
            match facts.iter().filter(|fact| **fact == index).count() {
                0 => None,
                count => Some(self.domain.count_in_words(index, count)),
            }
        });
        let holds: Vec<String> = holds.collect();
        if holds.is_empty() { vec!["nothing".into()] } else { holds }
    }

    /// Returns the sentence of a fact or an action of the planner, or of an operator; other text as it is.
    fn for_people(&self, symbol: &str) -> String {
        let ground = self.plan.ground.as_ref().and_then(|ground| ground.in_words(symbol));
        ground.map_or_else(|| self.domain.in_words(symbol).into_owned(), str::to_owned)
    }

    fn next(&self) -> String {
        let mut next = match self.plan.moves.first() {
            Some(step) => {
                let at = unbroken(&format!("({})", position(&step.target)));
                format!("{}, at {at}", step.words)
            }
            None => end_text(&self.plan.end),
        };
        if let Some((_, decision)) = &self.first {
            let after = counted(decision.questions as usize, self.planner.counts()[0]);
            let ms = decision.time_ms;
            let _ = write!(next, " (decided in {ms:.0} simulated ms after {after})");
        }
        next
    }

    fn table(&self) -> String {
        let mut text = String::new();
        let _ = writeln!(text, "{}", listed("Holds: ", &self.holds()));
        let _ = writeln!(text, "{}", listed("Goal:  ", &self.words));
        let _ = writeln!(text, "{}\n", wrapped(&(unbroken("Next:  ") + &self.next()), 7));
        if !self.plan.moves.is_empty() {
            let mut grid = Grid::new(&[">step", "action", ">decided in ms"]);
            for (index, step) in self.plan.moves.iter().enumerate() {
                let ms = format!("{:.0}", step.decision.time_ms);
                grid.row([(index + 1).to_string(), step.words.clone(), ms]);
            }
            let then = if self.plan.end == SceneEnd::Met { "until" } else { "then" };
            let title = format!("Whole plan, {then} {}:", end_text(&self.plan.end));
            let _ = writeln!(text, "{}\n\n{grid}", wrapped(&title, 0));
        }
        let dropped = self.dropped();
        if !dropped.is_empty() {
            let mut grid = Grid::new(&["action", "undecided condition that is done without"]);
            for (action, condition) in dropped {
                grid.row([self.domain.operator_in_words(action).into_owned(), condition]);
            }
            let _ = writeln!(text, "Conditions that cannot all be met in this scene:\n\n{grid}");
        }
        if let Some((domain, decision)) = &self.first {
            let people = |text: &str| self.for_people(text);
            text += &choices_table(domain, decision, people);
            text += &milestones_table(decision, self.planner.counts()[1], people);
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

/// Returns the time of each milestone of a decision.
fn milestones_json(decision: &Decision) -> Value {
    let milestones = decision.milestones.iter().map(|m| {
        let key = format!("{:02} {} {}", m.question, m.stage, m.subject);
        (key, json!(m.time_ms))
    });
    Value::Object(milestones.collect())
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

/// Returns the choices among several causes as a table; empty if there were none.
fn choices_table(domain: &Domain, decision: &Decision, people: impl Fn(&str) -> String) -> String {
    if decision.choices.is_empty() {
        return String::new();
    }
    let mut grid = Grid::new(&[">question", "about", "chosen", ">among", "because"]);
    for c in &decision.choices {
        let (state, action) = (people(&domain[c.state].name), people(&domain[c.action].name));
        grid.row([c.question.to_string(), state, action, c.among.to_string(), why_text(c)]);
    }
    format!("Choices among several causes:\n\n{grid}\n")
}

/// Returns the milestones of a decision as a table.
fn milestones_table(decision: &Decision, number: &str, people: impl Fn(&str) -> String) -> String {
    let mut grid = Grid::new(&[&format!(">{number}"), "about", "reached", ">at ms"]);
    for m in &decision.milestones {
        let question = m.question.to_string();
        grid.row([question, people(&m.subject), m.stage.to_string(), format!("{:.0}", m.time_ms)]);
    }
    format!("{}\n\n{grid}\n", wrapped(MILESTONES, 0))
}

/// The title of the milestones. It names the moment from which all times of a plan count.
const MILESTONES: &str = "Milestones of the next decision. All times count from the moment at which the planner \
                          is given the goal and the scene:";
