//! `symbolt plan` of a problem in PDDL, planned and acted on.

use std::fmt::Write as _;

use anyhow::{Error, bail};
use serde_json::{Value, json};
use symbolt::files::{Limit, read_file};
use symbolt::plan::goal_sets::{Course, GoalSetError, GoalSetSpec, StripsWorld, pursue};
use symbolt::plan::strips::{self, Bodies, GroundFault, Grounded, Problem, validate};
use symbolt::sim::{Seed, SimDuration};
use symbolt::task::planner::PlannerKind;

use super::args::PlanArgs;
use crate::cli::end::{BadArgument, Outcome};
use crate::cli::output::{Place, Progress, not_both_standard_input};
use crate::cli::table::counted;

/// Time for which the motor is locked after an action has begun, in milliseconds.
const LOCK_MS: u64 = 100;

pub(super) fn plan(args: &PlanArgs, out: &Place) -> Result<Outcome, Error> {
    let Some(file) = &args.problem else {
        bail!(BadArgument("name a problem in PDDL, or a scene with --scene FILE".into()));
    };
    not_both_standard_input(("domain", &args.domain), ("problem", file))?;
    if args.goal.is_some() {
        bail!(BadArgument("--goal is for a scene; a problem in PDDL has its own goal".into()));
    }
    if args.planner.kind == Some(PlannerKind::Chain) {
        let problem =
            "--planner chain plans in a scene of a learned domain, not in PDDL; leave it out";
        bail!(BadArgument(problem.into()));
    }
    args.planner.check_goal_sets("")?;
    if args.planner.absent {
        bail!(BadArgument("--absent is for a scene; leave it out".into()));
    }
    let spec = spec(args)?;
    let progress = Progress::new(&args.common);
    let domain = read_file(&args.domain, Limit::PDDL)?;
    let domain = strips::Domain::parse(&domain, &args.domain.display().to_string(), Bodies::Read)?;
    let problem = read_file(file, Limit::PDDL)?;
    let problem = Problem::parse(&problem, &file.display().to_string(), &domain)?;
    progress.say("grounding the problem");
    let grounded = match Grounded::new(&domain, &problem) {
        Err(fault @ GroundFault::Unreachable { .. }) => {
            return unreachable(args, out, &fault.to_string());
        }
        grounded => grounded?,
    };
    let size = format!(
        "{}, {}",
        counted(grounded.fluents.len(), "fluent"),
        counted(grounded.operators.len(), "operator")
    );
    progress.say(format!("planning with {size}"));
    let world = StripsWorld::new(&grounded, SimDuration::from_millis(LOCK_MS));
    let course = match pursue(&grounded, world, &spec, Seed::new(args.common.seed)) {
        Err(fault @ (GoalSetError::NeverHolds { .. } | GoalSetError::Unreachable { .. })) => {
            return unreachable(args, out, &fault.to_string());
        }
        course => course?,
    };
    drop(progress);
    let steps: Vec<&str> = course.plan().map(|a| grounded.operators[a].name.as_str()).collect();
    let checked = validate(&domain, &problem, steps.iter().copied()).map(|_| ());
    let text = if args.common.json {
        let fault = checked.as_ref().err().map(ToString::to_string);
        summary(&grounded, &course, fault, &args.planner.mode).to_string()
    } else {
        table(&grounded, &course, &size)
    };
    out.write(&text)?;
    Ok(match checked {
        Ok(()) => Outcome::Done,
        Err(fault) => {
            let limit_s = spec.limit.as_micros() as f64 / 1e6;
            Outcome::Failed(format!("no plan within {limit_s} s: {fault}"))
        }
    })
}

/// Says that no plan can reach the goal.
fn unreachable(args: &PlanArgs, out: &Place, fault: &str) -> Result<Outcome, Error> {
    if args.common.json {
        let nothing: [&str; 0] = [];
        let said = json!({
            "planner": PlannerKind::GoalSets.name(), "mode": args.planner.mode,
            "plan": nothing, "valid": false, "fault": fault, "actions": nothing,
        });
        out.write(said.to_string())?;
    }
    Ok(Outcome::Failed(fault.to_owned()))
}

/// Checks and returns the settings.
fn spec(args: &PlanArgs) -> Result<GoalSetSpec, Error> {
    let default = GoalSetSpec::default();
    Ok(GoalSetSpec {
        slots: args.slots,
        limit: args.limit()?,
        population: args.planner.mode.parse()?,
        ..default
    })
}

/// Returns the time at which an action begins first.
fn planned(course: &Course) -> Option<u64> {
    course.begun.first().map(|begun| begun.ms)
}

fn summary(problem: &Grounded, course: &Course, fault: Option<String>, mode: &str) -> Value {
    let step = |a: usize| problem.operators[a].name.as_str();
    let actions = course
        .begun
        .iter()
        .map(|b| json!({ "action": step(b.operator), "time_ms": b.ms, "ready": b.met }));
    json!({
        "planner": "goal-sets",
        "mode": mode,
        "fluents": problem.fluents.len(),
        "operators": problem.operators.len(),
        "units": course.units,
        "plan": course.plan().map(step).collect::<Vec<_>>(),
        "valid": fault.is_none(),
        "fault": fault,
        "actions": actions.collect::<Vec<_>>(),
        "planned_ms": planned(course),
        "time_ms": course.ms,
        "goal_sets": course.goal_sets(),
        "dead_ends": course.dead_ends(),
        "starts": course.starts(),
    })
}

fn table(problem: &Grounded, course: &Course, size: &str) -> String {
    let mut text = format!("Problem: {size}\n");
    if let Some(ms) = planned(course) {
        let steps = counted(course.goal_sets(), "goal set");
        let _ = writeln!(
            text,
            "Planned: {ms} ms, {steps}, {}",
            counted(course.dead_ends(), "dead end")
        );
    }
    if course.begun.is_empty() && course.reached {
        text.push_str("The goal holds already.\n");
    }
    for begun in &course.begun {
        let name = &problem.operators[begun.operator].name;
        let note = if begun.met { "" } else { "  (a precondition did not hold)" };
        let _ = writeln!(text, "{:>7} ms  {name}{note}", begun.ms);
    }
    text
}
