//! `ablation`: decisions of the planner graph with a part removed or changed.

use rand::RngExt;
use serde_json::json;

use crate::neurons::{LifSpec, Population, PopulationPlan, Tuning};
use crate::sim::{Seed, SimDuration};
use crate::study::experiment::{
    About, Axis, Cell, Experiment, Figure, Measure, Reading, Results, Row, Series, Style,
    TrialOutcome, outcome,
};
use crate::task::TaskError;
use crate::task::planner::{Decider, Part, Planner, PlannerSpec, Unbinding};
use crate::task::propositional::{DomainBuilder, Verdict, WorldState, acceptable_answers};

pub(super) const GOAL: &str = "BOLT_ASSEMBLED";
/// States that hold at the start of the task.
pub(super) const TABLE: [&str; 2] = ["NUT_ON_TABLE", "BOLT_ON_TABLE"];

pub(super) fn lif() -> Population {
    Population::Lif(LifSpec::default())
}

/// A variant of the planner.
struct Variant {
    name: &'static str,
    value: String,
    spec: PlannerSpec,
    plan: PopulationPlan,
}

/// Number of world states in a trial. The planner makes one decision for each.
const WORLDS: usize = 4;

/// The experiment: the planner with parts removed, weakened, or computed in another mode.
pub(super) struct Ablation {
    variants: Vec<Variant>,
}

impl Ablation {
    pub fn new() -> Self {
        let spec = PlannerSpec::default();
        let spiking = PopulationPlan::all(lif());
        let small = |scale| {
            PopulationPlan::all(Population::Lif(LifSpec::tuned(Tuning {
                scale,
                ..Tuning::default()
            })))
        };
        let mut variants = Vec::new();
        let mut add = |name, value: String, spec, plan: &PopulationPlan| {
            variants.push(Variant { name, value, spec, plan: plan.clone() });
        };
        let modes = [
            ("direct", PopulationPlan::direct()),
            ("lif", spiking.clone()),
            ("lif, 15 neurons a dimension", small(0.3)),
        ];
        for (mode, plan) in modes {
            let parts =
                [("nothing", None), ("cleanup", Some(Part::Cleanup)), ("gate", Some(Part::Gate))];
            for (part, without) in parts {
                add("without", format!("{part} ({mode})"), PlannerSpec { without, ..spec }, &plan);
            }
        }
        for retention in [0.9, 0.5, 0.0] {
            for (mode, plan) in [("direct", &PopulationPlan::direct()), ("lif", &spiking)] {
                let spec = PlannerSpec { retention, ..spec };
                add("memory fed back", format!("{retention} ({mode})"), spec, plan);
            }
        }
        for per_dimension in [5, 10, 20, 35] {
            let plan = small(f64::from(per_dimension) / 50.0);
            add("neurons a dimension", per_dimension.to_string(), spec, &plan);
        }
        for ms in [2, 10, 20, 40] {
            let synapse = SimDuration::from_millis(ms);
            add("synapse (ms)", ms.to_string(), PlannerSpec { synapse, ..spec }, &spiking);
        }
        for dimensions in [64, 128, 512] {
            let max_similarity = if dimensions < 128 { 0.3 } else { spec.max_similarity };
            let spec = PlannerSpec { dimensions, max_similarity, ..spec };
            add("dimensions", dimensions.to_string(), spec, &spiking);
        }
        for module in ["goal_buffer", "focus", "cause", "deep", "required", "motor_gate", "motor"] {
            // The pattern always parses.
            if let Ok(pattern) = format!("planner/{module}/**").parse() {
                let plan = spiking.clone().with(pattern, Population::Direct);
                add("exact module", module.into(), spec, &plan);
            }
        }
        let products = PlannerSpec { unbinding: Unbinding::Products, ..spec };
        add("unbinding", "products (direct)".into(), products, &PopulationPlan::direct());
        Self { variants }
    }
}

/// Lets the planner decide once for each world state. Returns how many decisions the reference planner accepts, and
/// their mean duration in simulated ms.
fn decide(planner: &Planner, worlds: &[WorldState]) -> Result<(f64, f64), TaskError> {
    let domain = planner.domain();
    let goal = domain.state(GOAL)?;
    let (mut right, mut ms, mut decided) = (0.0, 0.0, 0.0);
    for world in worlds {
        let wanted = acceptable_answers(domain, world, goal, planner.spec().rules());
        let (verdict, time_ms) = match planner.decide(world, goal) {
            Ok(decision) => (Some(decision.verdict), decision.time_ms),
            Err(TaskError::Undecided { limit_ms, .. }) => (None, limit_ms),
            Err(error) => return Err(error),
        };
        let said = verdict.is_some_and(|verdict| wanted.accepts(verdict));
        // An action that the motor shows before the decision would already be executed.
        let span = SimDuration::from_millis(time_ms.ceil() as u64);
        let done = planner.first_shown(world, goal, span)?.map(|(action, _)| action);
        let acted = match (verdict, done) {
            (Some(Verdict::Act(_)), done) => done.is_none_or(|a| wanted.actions.contains(&a)),
            (_, done) => done.is_none(),
        };
        if said && acted {
            right += 1.0;
        }
        if verdict.is_some() {
            ms += time_ms;
            decided += 1.0;
        }
    }
    Ok((right, if decided > 0.0 { ms / decided } else { f64::NAN }))
}

impl Experiment for Ablation {
    fn about(&self) -> About {
        let question = "How often does the reference planner accept the planner's decisions if a part is removed or changed, and how long do they take?";
        let settings = json!({"worlds_a_trial": WORLDS, "goal": GOAL});
        About { name: "ablation", question, revision: 3, settings }
    }

    fn cells(&self) -> Vec<Cell> {
        let readings = || {
            vec![
                Reading::what(Measure::Share(1), "accepted"),
                Reading::count(),
                Reading::what(Measure::Mean, "ms a decision"),
            ]
        };
        let cell =
            |v: &Variant| Cell::new(json!({"change": v.name, "to": v.value}), 10, readings());
        self.variants.iter().map(cell).collect()
    }

    fn trial(&self, cell: &Cell, seed: Seed) -> Result<TrialOutcome, TaskError> {
        let of_change = self.variants.iter().filter(|v| cell.is("change", v.name));
        let choices: Vec<_> = of_change.map(|v| (v.value.as_str(), v)).collect();
        let variant = cell.choice("to", &choices)?;
        let domain = DomainBuilder::of_the_paper().build()?;
        let mut rng = seed.derive("", "worlds").rng();
        let states = domain.states().len();
        // The first world state is the start of the task; the others are random.
        let mut worlds: Vec<WorldState> = vec![domain.world(TABLE)?];
        worlds.resize_with(WORLDS, || (0..states).map(|_| rng.random()).collect());
        let (right, ms) = match Planner::with_plan(&domain, variant.spec, &variant.plan, seed) {
            Ok(planner) => decide(&planner, &worlds)?,
            // Without dissimilar pointers there is no planner, and no decision counts as right.
            Err(TaskError::TooFewDimensions { .. } | TaskError::Vocabulary(_)) => (0.0, f64::NAN),
            Err(error) => return Err(error),
        };
        Ok(outcome([right, WORLDS as f64, ms]))
    }

    fn figure(&self, results: &Results) -> Option<Figure> {
        // The first row of the table is at the top.
        let accepted = results.rows.iter().rev().filter(|row| row.is("what", &json!("accepted")));
        let name = |row: &Row| format!("{}: {}", row.text("change"), row.text("to"));
        let names = accepted.clone().map(name).collect();
        let marks = accepted.enumerate().map(|(at, row)| row.percent(at as f64).across());
        Some(Figure {
            title: "Decisions that the reference planner accepts, with 95% intervals".into(),
            x: Axis::from_to("accepted (%)", 0.0, 102.0),
            y: Axis::named(names),
            series: vec![Series::new("", marks.collect(), Style::Points)],
        })
    }
}
