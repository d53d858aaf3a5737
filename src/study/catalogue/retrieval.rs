//! `retrieval`: objects by place and goal, and actions by object and effect, from 25,000 objects and 10,000 actions.
//!
//! A trial draws a world and its pointers. The methods in exact maths answer 500 queries each on objects and on actions;
//! the network in spikes answers 50 of each, one after another, and is read at the end of a query's 40 ms or earlier.
//! Precision and recall are pooled over all queries; the intervals take the queries of a trial as a cluster.

use serde_json::json;

use crate::sim::{Real, Seed, SimDuration};
use crate::study::experiment::{About, Cell, Experiment, Measure, Reading, TrialOutcome};
use crate::study::retrieval::{
    Method, Network, NetworkSpec, Query, Reach, Roles, Score, World, WorldSpec, exact, predicted,
};
use crate::task::TaskError;

/// The experiment.
pub(super) struct Retrieval;

/// Number of queries of a trial in exact maths, and in spikes.
const QUERIES: [usize; 2] = [500, 50];
/// Dimensions, mean number of places and of goals of an object, and the similarity at which an object meets a condition.
const SIZES: [(usize, f64, f64); 3] = [(500, 5.0, 0.65), (500, 10.0, 0.6), (256, 5.0, 0.63)];
/// Standard deviation of the noise on each component of a condition.
const NOISE: Real = 0.02;

/// How a cell retrieves.
#[derive(Clone, Copy)]
enum CellMethod {
    Sum(Roles),
    Joint(Roles, Real),
    Spikes { cleaned: bool },
}

const METHODS: [(&str, CellMethod); 8] = [
    ("sum, Gaussian roles", CellMethod::Sum(Roles::Gaussian)),
    ("sum, unitary roles", CellMethod::Sum(Roles::Unitary)),
    ("sum, tight frame", CellMethod::Sum(Roles::Frame)),
    ("each, unitary roles", CellMethod::Joint(Roles::Unitary, 0.0)),
    ("each, tight frame", CellMethod::Joint(Roles::Frame, 0.0)),
    ("each, tight frame, noise", CellMethod::Joint(Roles::Frame, NOISE)),
    ("in spikes", CellMethod::Spikes { cleaned: false }),
    ("in spikes, cleaned", CellMethod::Spikes { cleaned: true }),
];

impl CellMethod {
    /// Returns the method in exact maths.
    fn method(self, level: Real) -> Option<Method> {
        match self {
            Self::Sum(roles) => Some(Method::Sum(roles)),
            Self::Joint(roles, noise) => Some(Method::Joint { roles, level, noise }),
            Self::Spikes { .. } => None,
        }
    }
}

/// Returns the counts of a score in the order of the readings.
fn counts(score: &Score) -> TrialOutcome {
    let of = |count: &crate::study::retrieval::Count| {
        [count.hits, count.found, count.hits, count.matches].map(|count| count as f64)
    };
    let (objects, actions) = (of(&score.objects), of(&score.actions));
    std::array::from_fn(|i| if i < 4 { objects[i] } else { actions[i - 4] })
}

/// Answers queries in spikes and reads the answers at `ms`.
fn in_spikes(
    world: &World,
    spec: &NetworkSpec,
    queries: &[Query],
    ms: f64,
    seed: Seed,
) -> Result<Score, TaskError> {
    let network = Network::build(world, spec, queries, seed)?;
    let at = SimDuration::from_micros((1e3 * ms) as u64);
    Ok(network.run(world, queries, &[at], seed)?.first().copied().unwrap_or_default())
}

impl Experiment for Retrieval {
    fn about(&self) -> About {
        let question =
            "How well are objects found by place and goal, and actions by object and effect?";
        let WorldSpec { places, goals, objects, actions, effects, .. } = WorldSpec::default();
        let settings = json!({
            "places": places, "goals": goals, "objects": objects, "actions": actions,
            "effects": effects, "queries": QUERIES, "noise": NOISE,
        });
        About { name: "retrieval", question, revision: 1, settings }
    }

    fn cells(&self) -> Vec<Cell> {
        let mut cells = Vec::new();
        for (at, (dimensions, each, level)) in SIZES.into_iter().enumerate() {
            for (name, how) in METHODS {
                let times: &[u64] = match how {
                    CellMethod::Spikes { .. } if at == 0 => &[20, 30, 40],
                    CellMethod::Spikes { .. } => &[40],
                    _ => &[0],
                };
                for ms in times {
                    let mut settings = json!({
                        "method": name, "dimensions": dimensions, "each": each, "level": level,
                    });
                    let world = WorldSpec { each, ..WorldSpec::default() };
                    match how.method(level as Real) {
                        Some(method) => {
                            let closed = predicted(&world, dimensions, method);
                            let rounded = [closed.precision, closed.recall]
                                .map(|share| (share * 1e3).round() / 1e3);
                            settings["predicted"] = json!(format!("{} {}", rounded[0], rounded[1]));
                        }
                        None => settings["ms"] = json!(ms),
                    }
                    let readings =
                        ["objects", "actions"].into_iter().enumerate().flat_map(|(i, what)| {
                            let share = |of: usize, rate| {
                                Reading::new(
                                    Measure::Share(4 * i + of),
                                    json!({"of": what, "rate": rate}),
                                )
                            };
                            let count = || Reading::count();
                            [share(1, "precision"), count(), share(3, "recall"), count()]
                        });
                    cells.push(Cell::new(settings, 10, readings.collect()));
                }
            }
        }
        cells
    }

    fn trial(&self, cell: &Cell, seed: Seed) -> Result<TrialOutcome, TaskError> {
        let how = cell.choice("method", &METHODS)?;
        let (dimensions, level) = (cell.number("dimensions")? as usize, cell.number("level")?);
        let world = WorldSpec { each: cell.number("each")?, ..WorldSpec::default() };
        let world = World::draw(&world, seed);
        let queries = |count| (world.queries(count, seed), world.queries_of_actions(count, seed));
        let [many, few] = QUERIES;
        let level = level as Real;
        let score = match (how, how.method(level)) {
            (CellMethod::Spikes { cleaned }, _) => {
                let ms = cell.number("ms")?;
                let (on_objects, on_actions) = queries(few);
                let spec = NetworkSpec { dimensions, level, cleaned, ..NetworkSpec::default() };
                let objects = in_spikes(&world, &spec, &on_objects, ms, seed)?.objects;
                let spec = NetworkSpec { reach: Reach::Actions, ..spec };
                let actions = in_spikes(&world, &spec, &on_actions, ms, seed)?.actions;
                Score { objects, actions }
            }
            (_, Some(method)) => {
                let (on_objects, on_actions) = queries(many);
                exact(&world, dimensions, method, [&on_objects, &on_actions], seed)?
            }
            (_, None) => Score::default(),
        };
        Ok(counts(&score))
    }
}
