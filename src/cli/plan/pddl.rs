//! `symbolt plan` of a problem in PDDL, planned and acted on.

use std::fmt::Write as _;

use anyhow::{Error, bail};
use serde_json::{Value, json};
use symbolt::files::Limit;
use symbolt::neurons::Population;
use symbolt::plan::goal_sets::{
    Begun, Course, Directions, GoalSetError, GoalSetSpec, SpikeCount, StripsWorld, pursue,
};
use symbolt::plan::strips::{Bodies, Domain, GroundFault, Grounded, Problem, shorten, validate};
use symbolt::sim::{Seed, SimDuration};
use symbolt::study::problems::{Distance, distance};
use symbolt::task::planner::PlannerKind;

use super::args::PlanArgs;
use crate::cli::end::{BadArgument, Outcome, sentence};
use crate::cli::kind::{Given, Kind, beginning, parsed};
use crate::cli::output::{Place, Progress, not_both_standard_input, warn};
use crate::cli::table::counted;

/// Time for which the motor is locked after an action has begun, in milliseconds.
const LOCK_MS: u64 = 100;

/// What is known of a run besides its answer, whatever its end.
#[derive(Default)]
struct Told {
    warnings: Vec<String>,
    /// Fluents and operators, once the problem is grounded.
    size: Option<[usize; 2]>,
}

/// Plans, or says why not. With `--json` one object is printed whatever happens, with the same keys.
pub(super) fn plan(args: &PlanArgs, out: &Place) -> Result<Outcome, Error> {
    let mut told = Told::default();
    let ended = planned_or_not(args, out, &mut told);
    let fault = match &ended {
        Ok(End::Answered(None)) => return Ok(Outcome::Done),
        Ok(End::Answered(Some(fault))) => return Ok(Outcome::Failed(fault.clone())),
        Ok(End::Unreachable(fault)) => fault.clone(),
        Err(error) => sentence(error),
    };
    if args.common.json {
        out.write(summary(args, &told, None, Some(&fault)).to_string())?;
    }
    ended.map(|_| Outcome::Failed(fault))
}

/// The object of `--json` for a command line that could not be read.
pub(super) fn unread(args: &PlanArgs, fault: &str) -> String {
    summary(args, &Told::default(), None, Some(fault)).to_string()
}

/// How planning ended.
enum End {
    /// The answer is printed, and valid if there is no fault.
    Answered(Option<String>),
    /// No plan can reach the goal, for this reason.
    Unreachable(String),
}

/// Refuses options that a problem in PDDL has no use for.
fn check(args: &PlanArgs) -> Result<(), Error> {
    if args.goal.is_some() {
        bail!(BadArgument("--goal is for a scene; a problem in PDDL has its own goal".into()));
    }
    if args.planner.kind == Some(PlannerKind::Chain) {
        let problem =
            "--planner chain plans in a scene of a learned domain, not in PDDL; leave it out";
        bail!(BadArgument(problem.into()));
    }
    args.planner.check_goal_sets("")?;
    let of_scenes = [
        ("--absent", args.planner.absent),
        ("--grounding", args.grounding.grounding.is_some()),
        ("--limit", args.grounding.limit.is_some()),
    ];
    if let Some((option, _)) = of_scenes.iter().find(|(_, given)| *given) {
        bail!(BadArgument(format!("{option} is for a scene; leave it out")));
    }
    Ok(())
}

/// Reads the domain and the problem, which may be in one file.
fn read(args: &PlanArgs, warnings: &mut Vec<String>) -> Result<(Domain, Problem), Error> {
    let bodies = if args.as_instant { Bodies::Instant } else { Bodies::Read };
    let first = Given { path: &args.domain, takes: &[Kind::PddlDomain, Kind::Pddl] };
    let problem = args.problem.as_deref().unwrap_or(&args.domain);
    let second = Given { path: problem, takes: &[Kind::PddlProblem, Kind::Pddl] };
    if args.problem.is_some() {
        not_both_standard_input(("domain", first.path), ("problem", problem))?;
    }
    let bytes = first.read(Limit::PDDL, &[second])?;
    let found = Kind::of(&bytes);
    // What is faulty is told by its reader, with its place.
    let whole = found.cut.is_none() || found.kind == Kind::Domain;
    if let Some(advice) = advice(args, found.kind).filter(|_| whole) {
        bail!(BadArgument(advice));
    }
    let parse = |bytes: &[u8], name: &str| Domain::parse(bytes, name, bodies);
    let domain = first.parsed(&bytes, &[second], parse)?;
    warnings.extend(domain.warnings.iter().cloned());
    if let Some(problem) = &args.problem
        && found.kind == Kind::Pddl
        && *problem != args.domain
    {
        let [own, other] = [&args.domain, problem].map(|path| path.display());
        warnings.push(format!("the problem in {own} is left out: that in {other} is planned"));
    }
    let parse = |bytes: &[u8], name: &str| Problem::parse(bytes, name, &domain);
    let problem = match &args.problem {
        Some(_) => parsed(second, Limit::PDDL, &[], parse)?,
        None => second.parsed(&bytes, &[], parse)?,
    };
    warnings.extend(problem.warnings.iter().filter(|w| !domain.warnings.contains(w)).cloned());
    Ok((domain, problem))
}

/// Says how files of this kind are planned with, if another option or file is needed.
fn advice(args: &PlanArgs, kind: Kind) -> Option<String> {
    let file = args.domain.display();
    let of_problem = || args.problem.as_deref().and_then(beginning).map(|b| Kind::of(&b).kind);
    let named = args.problem.as_deref().map_or_else(|| "FILE".into(), |p| p.display().to_string());
    Some(match (kind, &args.problem) {
        (Kind::Domain, None) => {
            format!(
                "{file} is a learned domain; name its scene: `symbolt plan {file} --scene FILE`"
            )
        }
        (Kind::Domain, Some(_)) if of_problem() == Some(Kind::PddlProblem) => return None,
        (Kind::Domain, Some(_)) => format!(
            "{file} is a learned domain, which plans in a scene: `symbolt plan {file} --scene {named}`"
        ),
        (Kind::Scene, Some(_)) if of_problem() == Some(Kind::Domain) => format!(
            "{file} is a scene, and {named} is a learned domain; write `symbolt plan {named} --scene {file}`"
        ),
        (Kind::PddlDomain, None) => format!(
            "{file} is a domain; name a problem in PDDL, or a scene with --scene FILE for a learned domain"
        ),
        (Kind::PddlProblem, None) => {
            format!("{file} is a problem in PDDL; name its domain before it")
        }
        _ => return None,
    })
}

fn planned_or_not(args: &PlanArgs, out: &Place, told: &mut Told) -> Result<End, Error> {
    check(args)?;
    let spec = spec(args)?;
    let progress = Progress::new(&args.common);
    let warnings = &mut told.warnings;
    let read = read(args, warnings);
    if let Ok((_, problem)) = &read
        && let Some(metric) = &problem.metric
    {
        warnings.push(format!("the cost {metric} of the plan is counted, but not minimised"));
    }
    warnings.iter().for_each(|warning| warn(warning));
    let (domain, problem) = read?;
    progress.say("grounding the problem");
    let grounded = match Grounded::new(&domain, &problem) {
        Err(fault @ GroundFault::Unreachable { .. }) => {
            return Ok(End::Unreachable(as_read(&domain, &fault.to_string())));
        }
        grounded => grounded?,
    };
    grounded.warnings.iter().for_each(|warning| warn(warning));
    warnings.extend(grounded.warnings.iter().cloned());
    let size = [grounded.fluents.len(), grounded.operators.len()];
    told.size = Some(size);
    let size = format!("{}, {}", counted(size[0], "fluent"), counted(size[1], "operator"));
    progress.say(format!("planning with {size}"));
    let world = StripsWorld::new(&grounded, SimDuration::from_millis(LOCK_MS));
    let course = match pursue(&grounded, world, &spec, Seed::new(args.common.seed)) {
        Err(fault @ GoalSetError::Unreachable { .. }) => {
            return Ok(End::Unreachable(as_read(&domain, &fault.to_string())));
        }
        course => course?,
    };
    let steps = grounded.steps(course.plan());
    let fault = validate(&domain, &problem, steps.iter().copied()).err();
    let fault = fault.map(|fault| fault.to_string());
    let never = course.begun.is_empty() && fault.is_some() && proved_unreachable(&grounded);
    drop(progress);
    let cost = problem.metric.is_some().then(|| {
        // Without actions the sum of floats is -0.
        course.plan().map(|operator| grounded.operators[operator].cost.value()).sum::<f64>() + 0.0
    });
    let done: Vec<usize> = course.plan().collect();
    let short = fault.is_none().then(|| shorten(&grounded, &done)).filter(|s| s.len() < done.len());
    let short =
        short.filter(|s| validate(&domain, &problem, grounded.steps(s.iter().copied())).is_ok());
    let answer = Answer { problem: &grounded, course: &course, cost, short };
    let proof = never.then(|| as_read(&domain, &answer.proof()));
    let fault = proof.or_else(|| fault.map(|fault| answer.failure(&spec, &fault)));
    let text = match args.common.json {
        true => summary(args, told, Some(&answer), fault.as_deref()).to_string(),
        false => answer.table(&size),
    };
    out.write(&text)?;
    Ok(End::Answered(fault))
}

/// Says of a proof that no plan exists what it is about, if the actions of the domain are not what was planned with.
fn as_read(domain: &Domain, fault: &str) -> String {
    match domain.instant {
        true => format!(
            "{fault}; this holds for instant actions: what goes on at the same time was lost in reading durative ones"
        ),
        false => fault.to_owned(),
    }
}

/// States that are looked at times operators: a few seconds at most.
const LOOKS: usize = 100_000_000;

/// Returns whether it is sure that no plan exists. A plain program looks at all states, if they are not too many; it decides on no
/// action.
fn proved_unreachable(problem: &Grounded) -> bool {
    let most = LOOKS / (problem.operators.len() * problem.fluents.len().div_ceil(64)).max(1);
    distance(problem, &problem.start.iter().copied().collect(), most.min(1_000_000))
        == Distance::Never
}

/// Checks and returns the settings.
fn spec(args: &PlanArgs) -> Result<GoalSetSpec, Error> {
    let population: Population = args.planner.mode.parse()?;
    if args.spikes && !matches!(population, Population::Lif(_)) {
        let mode = &args.planner.mode;
        bail!(BadArgument(format!("--spikes has nothing to count in mode {mode}; use --mode lif")));
    }
    if let Some(slots @ ..2) = args.slots {
        bail!(GoalSetError::Slots { slots });
    }
    Ok(GoalSetSpec {
        slots: args.slots,
        limit: args.limit()?,
        population,
        count_spikes: args.spikes,
        ..GoalSetSpec::default()
    })
}

/// Returns the object of `--json`. It has all keys, also where nothing was searched and there is no answer.
fn summary(args: &PlanArgs, told: &Told, answer: Option<&Answer>, fault: Option<&str>) -> Value {
    let course = answer.map(|answer| answer.course);
    let count = |of: fn(&Course) -> usize| course.map_or(0, of);
    let nothing = args.spikes.then(SpikeCount::default);
    let spikes = course.map_or(nothing, |course| course.spikes);
    let decision = course.map_or(nothing, |course| course.decision);
    let begun = answer.into_iter().flat_map(Answer::begun);
    let actions = begun.map(|(b, name)| json!({ "action": name, "time_ms": b.ms, "ready": b.met }));
    let plan = answer.map(|answer| answer.problem.steps(answer.course.plan()));
    let short = answer
        .and_then(|answer| Some(answer.problem.steps(answer.short.as_ref()?.iter().copied())));
    json!({
        "planner": PlannerKind::GoalSets.name(),
        "mode": args.planner.mode,
        "fluents": told.size.map(|[fluents, _]| fluents),
        "operators": told.size.map(|[_, operators]| operators),
        "units": course.map(|course| course.units),
        "plan": plan.unwrap_or_default(),
        "without_detours": short,
        "cost": answer.and_then(|answer| answer.cost),
        "valid": fault.is_none(),
        "fault": fault,
        "actions": actions.collect::<Vec<_>>(),
        "planned_ms": answer.and_then(Answer::planned),
        "time_ms": course.map_or(0, |course| course.ms),
        "goal_sets": count(Course::goal_sets),
        "dead_ends": count(Course::dead_ends),
        "starts": count(Course::starts),
        "spikes": spikes.map(|c| c.spikes),
        "synaptic_events": spikes.map(|c| c.synaptic_events),
        "decision_spikes": decision.map(|c| c.spikes),
        "decision_synaptic_events": decision.map(|c| c.synaptic_events),
        "warnings": told.warnings,
    })
}

/// A plan with everything that is printed about it.
struct Answer<'p> {
    problem: &'p Grounded,
    course: &'p Course,
    /// The cost of the plan, if the problem has costs.
    cost: Option<f64>,
    /// The plan without its detours, if it has any.
    short: Option<Vec<usize>>,
}

impl Answer<'_> {
    /// Returns the actions that were begun, each with its name.
    fn begun(&self) -> impl Iterator<Item = (&Begun, &str)> {
        let begun = self.course.begun.iter();
        let named = begun.map(|begun| (begun, &self.problem.operators[begun.operator]));
        named.filter(|(_, o)| !o.is_hidden()).map(|(begun, o)| (begun, o.name.as_str()))
    }

    /// Returns the time at which an action begins first.
    fn planned(&self) -> Option<u64> {
        self.begun().next().map(|(begun, _)| begun.ms)
    }

    /// Counts what was searched.
    fn searched(&self) -> String {
        let course = self.course;
        let sets = match course.directions {
            Directions::Backward => counted(course.goal_sets(), "goal set"),
            Directions::Forward => counted(course.goal_sets(), "state"),
            Directions::Both => format!("{} goal sets and states", course.goal_sets()),
        };
        format!("{sets}, {}", counted(course.dead_ends(), "dead end"))
    }

    /// Says that no state has the goal, and how that is known.
    fn proof(&self) -> String {
        let searched = self.searched();
        format!(
            "the goal cannot be reached: a program looked at all states that can be reached, after a search in vain ({searched})"
        )
    }

    /// Says how far the planner got within its time, what ran out, and what to try.
    fn failure(&self, spec: &GoalSetSpec, fault: &str) -> String {
        let course = self.course;
        let limit_s = spec.limit.as_micros() as f64 / 1e6;
        let what = format!("no plan within {limit_s} s: {fault}");
        if let Some(planned) = self.planned() {
            let actions = counted(self.begun().count(), "action");
            return format!(
                "{what}; a plan was found after {planned} ms, and {actions} began in time; try a longer `--time`"
            );
        }
        let searched = self.searched();
        match course.starts() {
            0 | 1 => format!("{what}; searched {searched}; try a longer `--time`"),
            starts => format!(
                "{what}; searched {searched}, and began anew {}; try a longer `--time` or more `--slots`",
                if starts == 2 { "once".into() } else { format!("{} times", starts - 1) }
            ),
        }
    }

    fn table(&self, size: &str) -> String {
        let course = self.course;
        let mut text = format!("Problem: {size}\n");
        if let Some(ms) = self.planned() {
            let _ = writeln!(text, "Planned: {ms} ms, {}", self.searched());
        }
        if self.planned().is_none() && course.reached {
            text.push_str("The goal holds already.\n");
        }
        for (begun, name) in self.begun() {
            let note = if begun.met { "" } else { "  (a precondition did not hold)" };
            let _ = writeln!(text, "{:>7} ms  {name}{note}", begun.ms);
        }
        if let Some(cost) = self.cost.filter(|_| course.reached) {
            let _ = writeln!(text, "Cost:    {cost}");
        }
        if let (Some(all), Some(decision)) = (course.spikes, course.decision) {
            let [sets, actions] = [course.goal_sets(), self.begun().count()];
            for (name, all, decision) in [
                ("Spikes:", all.spikes, decision.spikes),
                ("Synaptic events:", all.synaptic_events, decision.synaptic_events),
            ] {
                let _ = write!(text, "{name:<8} {all}, {decision} of the first decision");
                for (what, count) in [("goal set or state", sets), ("action", actions)] {
                    if let Some(each) = all.checked_div(count as u64) {
                        let _ = write!(text, ", {each} for each {what}");
                    }
                }
                text.push('\n');
            }
        }
        if let Some(short) = &self.short {
            let steps = self.problem.steps(short.iter().copied());
            let count = counted(steps.len(), "action");
            let _ = writeln!(text, "Without detours, which a program took out: {count}");
            steps.iter().for_each(|step| {
                let _ = writeln!(text, "            {step}");
            });
        }
        text
    }
}
