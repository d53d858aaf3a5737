//! A scene as a relational domain sees it: `symbolt actions`, and the plans of `symbolt plan`.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::Error;
use serde_json::{Map, Value, json};
use symbolt::sim::SimDuration;
use symbolt::task::planner::{Decision, PlanEnd, Prediction};
use symbolt::task::relational::{
    Fact, GoalTerm, GroundProblem, Grounder, Layout, Move, Problem, ProblemError, Quantity,
    RelationalDomain, Situation, TargetPose,
};
use symbolt::task::{ActionId, Domain, Snapshot, StateId, TaskError, WorldState};

use super::Outcome;
use super::args::{ActionsArgs, BadArgument, PlanArgs, PlannerArgs};
use super::output::{Grid, Place, Progress, unbroken, use_threads, warn, wrapped};
use super::plan::{End, decided, decision_keys, decision_tables, first, listed, no_goal, whole};
use super::relational::metres;

/// Number of moves after which a plan is cut short.
const MOST_MOVES: usize = 200;

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
    let grounder = args.grounding.grounder(&domain)?;
    let layout = look(&grounder, &domain, &scene);
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

fn position(target: &TargetPose) -> String {
    target.pose.position.map(|v| metres(v, 3)).join(", ")
}

fn target_json(target: &TargetPose) -> Value {
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
pub(crate) fn look(grounder: &Grounder, domain: &RelationalDomain, scene: &Snapshot) -> Layout {
    let layout = grounder.layout(scene);
    for (index, located) in layout.located.iter().enumerate().filter(|(_, l)| l.ambiguous) {
        let Some(fact) = located.fact else { continue };
        let Some(reference) = fact.reference else { continue };
        // Without this reference, the object is found at the other one.
        let mut others = scene.clone();
        others.object = None;
        others.objects.remove(reference);
        let own = if reference < index { index - 1 } else { index };
        let other = grounder.locate(&others, own).fact.and_then(|fact| fact.reference);
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
fn loose(domain: &RelationalDomain, layout: &Layout) -> Option<String> {
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

/// A move of a plan.
struct Step {
    chosen: Move,
    /// Name of the ground action.
    ground: String,
    decided: bool,
}

/// A plan over the ground problem.
struct Plan {
    moves: Vec<Step>,
    /// The decision for each move.
    times_ms: Vec<f64>,
    end: End,
    /// The first decision, with the domain that it is about; `None` if there was nothing to decide. Its milestones name
    /// operators.
    first: Option<(Domain, Decision)>,
    /// Undecided needs that the planner does without, as pairs of operator and need.
    dropped: Vec<(usize, usize)>,
}

impl Plan {
    fn without_decision(end: End) -> Self {
        Self { moves: Vec::new(), times_ms: Vec::new(), end, first: None, dropped: Vec::new() }
    }
}

/// A situation that changes as the relational operators predict.
struct Predicted<'p> {
    problem: &'p Problem<'p>,
    ground: &'p GroundProblem,
    situation: Situation,
    seen: Vec<Situation>,
    moves: Vec<Step>,
}

impl Prediction for Predicted<'_> {
    fn present(&self) -> WorldState {
        self.ground.present(&self.situation)
    }

    fn goals(&self) -> &[StateId] {
        self.ground.goals()
    }

    fn goal(&self) -> Option<StateId> {
        self.ground.goal(&self.situation)
    }

    fn act(&mut self, action: ActionId) -> Option<PlanEnd> {
        let moves = self.ground.moves_for(self.problem, action, &self.situation);
        let Some(chosen) = moves.first().copied() else {
            return Some(PlanEnd::Impossible(action));
        };
        let decided = self.problem.decided(&chosen, &self.situation);
        let ground = self.ground.domain()[action].name.clone();
        self.moves.push(Step { chosen, ground, decided });
        let after = self.problem.after(&chosen, &self.situation);
        let before = std::mem::replace(&mut self.situation, after);
        self.seen.push(before);
        let circle = self.seen.contains(&self.situation) || self.moves.len() >= MOST_MOVES;
        circle.then_some(PlanEnd::Circle)
    }
}

/// Returns the goal with a name, or the goal of the demonstrations.
pub(crate) fn wanted(
    domain: &RelationalDomain,
    name: Option<&str>,
) -> Result<Vec<GoalTerm>, Error> {
    match name {
        Some(goal) => {
            let (state, quantity) = (domain.state(goal)?, Quantity::AtLeast(1));
            let own = domain.goals.iter().find(|goal| goal.state == state);
            let reference = own.and_then(|goal| goal.reference);
            Ok(vec![GoalTerm { state, quantity, reference, held: 0, of: 0 }])
        }
        None if domain.goals.is_empty() => Err(no_goal()),
        None => Ok(domain.goals.clone()),
    }
}

/// Plans with a relational domain.
pub(crate) fn plan(
    args: &PlanArgs,
    domain: &RelationalDomain,
    scene: &Path,
    limit: SimDuration,
    out: &Place,
) -> Result<Outcome, Error> {
    args.planner.check_relational("use a domain of `symbolt learn --method paper`")?;
    let progress = Progress::new(&args.common);
    let scene = Snapshot::read(scene)?;
    let grounder = args.grounding.grounder(domain)?;
    let goals = wanted(domain, args.goal.as_deref())?;
    let words: Vec<String> = goals.iter().map(|goal| domain.goal_in_words(goal)).collect();
    let layout = look(&grounder, domain, &scene);
    progress.say(format!("planning towards {}", words.join(", ")));
    let (problem, plan) = match Problem::with_goals(domain, &layout, goals.clone()) {
        Ok(problem) => {
            let plan = roll_out(&problem, &layout, args, limit)?;
            (Some(problem), plan)
        }
        Err(error @ ProblemError::TooLarge { .. }) => return Err(TaskError::from(error).into()),
        Err(error) => (None, impossible(&error, &goals, &layout)),
    };
    drop(progress);
    let (problem, planner) = (problem.as_ref(), &args.planner);
    let shown = Shown { domain, layout: &layout, problem, plan: &plan, words, planner };
    let text = if args.common.json { shown.json().to_string() } else { shown.table() };
    out.write(&text)?;
    Ok(match (&plan.end, plan.moves.is_empty()) {
        // Only the next action counts: the robot looks and plans again after each action.
        (End::Stuck(reason), true) => Outcome::Failed(format!("stuck: {reason}")),
        _ => Outcome::Done,
    })
}

/// Returns the plan for a goal that cannot be asked for: nothing to do if it holds all the same.
fn impossible(error: &ProblemError, goals: &[GoalTerm], layout: &Layout) -> Plan {
    let holds = |goal: &GoalTerm| {
        let fact_of = |object: usize| layout.located.get(object)?.fact;
        let placed = |fact: &Fact| {
            let of = || fact.reference.and_then(fact_of).map(|fact| fact.state);
            goal.reference.is_none_or(|within| of() == Some(within))
        };
        let facts = layout.located.iter().filter_map(|located| located.fact);
        let count = facts.filter(|fact| fact.state == goal.state && placed(fact)).count();
        matches!(goal.quantity, Quantity::AtLeast(least) if count >= least)
    };
    Plan::without_decision(match goals.iter().all(holds) {
        true => End::Met,
        false => End::Stuck(error.to_string()),
    })
}

/// Asks the planner for one move after another, in situations predicted from the operators.
fn roll_out(
    problem: &Problem<'_>,
    layout: &Layout,
    args: &PlanArgs,
    limit: SimDuration,
) -> Result<Plan, Error> {
    let situation = layout.situation();
    if problem.lacking(&situation) == 0 {
        return Ok(Plan::without_decision(End::Met));
    }
    let ground = match problem.ground(&situation) {
        Ok(ground) => ground,
        Err(error @ ProblemError::Nothing { .. }) => {
            return Ok(Plan::without_decision(End::Stuck(error.to_string())));
        }
        Err(error) => return Err(TaskError::from(error).into()),
    };
    let planner = args.planner.build(args.common.seed)?.over_ground(&ground)?;
    let (seen, moves) = (Vec::new(), Vec::new());
    let mut predicted = Predicted { problem, ground: &ground, situation, seen, moves };
    let plan = planner.roll_out(&mut predicted, limit)?;
    let domain = ground.domain();
    let end = End::of(domain, plan.end);
    let times_ms = plan.steps.iter().map(|step| step.decision.time_ms).collect();
    let first = first(&plan).map(|decision| {
        let mut decision = decision.clone();
        // The names of ground actions grow too long for a table.
        for milestone in &mut decision.milestones {
            let action = domain.action_ids().find(|id| domain[*id].name == milestone.subject);
            if let Some(action) = action {
                milestone.subject =
                    problem.domain().operators[ground.operator(action)].name.clone();
            }
        }
        (domain.clone(), decision)
    });
    let dropped = ground.dropped().iter().copied().collect();
    Ok(Plan { moves: predicted.moves, times_ms, end, first, dropped })
}

/// A plan with everything that is printed about it.
struct Shown<'p> {
    domain: &'p RelationalDomain,
    layout: &'p Layout,
    problem: Option<&'p Problem<'p>>,
    plan: &'p Plan,
    /// The terms of the goal.
    words: Vec<String>,
    planner: &'p PlannerArgs,
}

impl Shown<'_> {
    fn action(&self, m: &Move) -> &str {
        &self.domain.operators[m.operator].name
    }

    /// Returns the undecided needs that the planner does without: the action and the condition.
    fn dropped(&self) -> Vec<(&str, String)> {
        let dropped = self.plan.dropped.iter().filter_map(|(operator, need)| {
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
            (End::Met, None) => ("met", None),
            (End::Stuck(reason), None) => ("stuck", Some(reason.as_str())),
            (End::Circle, None) => ("stuck", None),
        };
        let id = |index: usize| self.layout.objects[index].id.to_string();
        let steps: Vec<Value> = self
            .plan
            .moves
            .iter()
            .zip(&self.plan.times_ms)
            .map(|(step, ms)| {
                json!({
                    "action": self.action(&step.chosen), "object": id(step.chosen.object),
                    "onto": step.chosen.reference.map(id), "place": step.chosen.place,
                    "decided": step.decided, "ground_action": step.ground,
                    "decision_ms": ms,
                })
            })
            .collect();
        let target = first
            .zip(self.problem)
            .map(|(step, problem)| target_json(&problem.target(&step.chosen, self.layout)));
        let dropped: Vec<Value> = self
            .dropped()
            .iter()
            .map(|(action, condition)| json!({"action": action, "condition": condition}))
            .collect();
        let plan: Vec<&str> = self.plan.moves.iter().map(|s| self.action(&s.chosen)).collect();
        let keys = [
            ("status", json!(status)),
            ("action", json!(first.map(|step| self.action(&step.chosen)))),
            ("object", json!(first.map(|step| id(step.chosen.object)))),
            ("onto", json!(first.and_then(|step| step.chosen.reference.map(id)))),
            ("target", json!(target)),
            ("plan", json!(plan)),
            ("steps", json!(steps)),
            ("plan_end", json!(self.plan.end.key())),
            ("reason", json!(reason)),
            ("goal", json!(self.words.join(", "))),
            ("goals", json!(self.words)),
            ("dropped", json!(dropped)),
        ];
        let first = self.plan.first.as_ref().map(|(domain, decision)| (domain, decision));
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
        let mut next = match (self.plan.moves.first(), &self.plan.end) {
            (Some(step), _) => {
                let m = &step.chosen;
                let object = &self.layout.objects[m.object].id;
                let mut text = format!("do {} with {object}", self.action(m));
                if let Some(reference) = onto(m, self.layout) {
                    let _ = write!(text, ", onto {reference}");
                }
                if let Some(problem) = self.problem {
                    let at = position(&problem.target(m, self.layout));
                    let _ = write!(text, ", at {}", unbroken(&format!("({at})")));
                }
                text
            }
            (None, end) => end.text(),
        };
        let decision = self.plan.first.as_ref().map(|(_, decision)| decision);
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
            for (index, (step, ms)) in self.plan.moves.iter().zip(&self.plan.times_ms).enumerate() {
                let object = self.layout.objects[step.chosen.object].id.to_string();
                let onto = onto(&step.chosen, self.layout).unwrap_or("-").to_owned();
                let action = self.action(&step.chosen).to_owned();
                grid.row([(index + 1).to_string(), action, object, onto, format!("{ms:.0}")]);
            }
            text += &whole(&self.plan.end.text(), &grid);
        }
        let dropped = self.dropped();
        if !dropped.is_empty() {
            let mut grid = Grid::new(&["action", "undecided condition that is done without"]);
            for (action, condition) in dropped {
                grid.row([action.to_owned(), condition]);
            }
            let _ = writeln!(text, "Conditions that cannot be met in this scene:\n\n{grid}");
        }
        if let Some((domain, decision)) = &self.plan.first {
            text += &decision_tables(domain, decision, self.planner.counts()[1]);
        }
        if let Some(loose) = loose(self.domain, self.layout) {
            let _ = writeln!(text, "{loose}");
        }
        text
    }
}
