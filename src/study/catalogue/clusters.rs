//! `figure-3` and `figure-4`: states found in demonstrations of the simulated scene.
//!
//! The true state of a part follows from the geometry of the scene: the part is over the jig's pocket, over its hole,
//! or elsewhere. A bolt over the pocket is assembled. The learner and the classifiers are not given the true state.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock};

use serde_json::json;

use crate::robot::Pose;
use crate::sim::Seed;
use crate::study::experiment::{
    About, Axis, Cell, Experiment, Figure, MAX_READINGS, Mark, Measure, Reading, Results, Series,
    Style, TrialOutcome, outcome,
};
use crate::task::TaskError;
use crate::task::classify::{Classifier, ClassifierRule};
use crate::task::domain::RelationalDomain;
use crate::task::execute::demonstrate;
use crate::task::learn::{PAPER_EXPONENT, Settings, learn};
use crate::task::recording::Recording;
use crate::task::tasks::nuts_and_bolts::NutsAndBolts;

/// The true states of parts.
const TRUTHS: [&str; 5] =
    ["NUT_ON_TABLE", "NUT_IN_JIG", "BOLT_ON_TABLE", "BOLT_IN_JIG", "BOLT_ASSEMBLED"];

/// Greatest distance of a part from the middle of the pocket or hole that holds it, in metres.
const NEAR_M: f64 = 0.01;

/// Returns the true state of a part of the simulated scene, as an index into [`TRUTHS`].
pub(super) fn truth(spec: &NutsAndBolts, kind: &str, position: [f64; 3]) -> usize {
    let over = |[x, y]: [f64; 2]| (position[0] - x).hypot(position[1] - y) < NEAR_M;
    match (kind == spec.nut_kind, over(spec.jig.pocket), over(spec.jig.hole)) {
        (true, true, _) => 1,
        (true, ..) => 0,
        (false, true, _) => 4,
        (false, _, true) => 3,
        (false, ..) => 2,
    }
}

pub(super) fn scene(parts: usize) -> NutsAndBolts {
    NutsAndBolts { nuts: parts, bolts: parts, ..NutsAndBolts::default() }
}

/// Records demonstrations in the simulated scene with `parts` nuts and as many bolts.
pub(super) fn shown(parts: usize, demos: usize, seed: Seed) -> Result<Recording, TaskError> {
    Ok(demonstrate(&scene(parts), demos, seed)?.recording)
}

/// Returns all poses of a recording with their kinds.
pub(super) fn poses(recording: &Recording) -> impl Iterator<Item = (&str, &Pose)> {
    let snapshots = recording.demos.iter().flat_map(|demo| &demo.snapshots);
    snapshots.flat_map(|s| &s.objects).map(|object| (&*object.kind, &object.pose))
}

/// Returns the poses of the nuts and bolts of the simulated scene, without pocket and hole.
pub(super) fn part_poses<'r>(
    recording: &'r Recording,
    spec: &'r NutsAndBolts,
) -> impl Iterator<Item = (&'r str, &'r Pose)> {
    poses(recording).filter(|(kind, _)| *kind == spec.nut_kind || *kind == spec.bolt_kind)
}

type Made<T> = Arc<OnceLock<Result<Arc<T>, String>>>;

/// A cache of costly values that several cells of a trial share. If several threads ask for the same value, one thread
/// computes it and the others wait.
pub(super) struct Once<T>(Mutex<HashMap<u64, Made<T>>>);

impl<T> Once<T> {
    pub fn new() -> Self {
        Self(Mutex::new(HashMap::new()))
    }

    pub fn get(
        &self,
        key: u64,
        make: impl FnOnce() -> Result<T, TaskError>,
    ) -> Result<Arc<T>, TaskError> {
        let slot = {
            let mut slots = self.0.lock().unwrap_or_else(|e| e.into_inner());
            slots.entry(key).or_default().clone()
        };
        let made = slot.get_or_init(|| make().map(Arc::new).map_err(|e| e.to_string()));
        made.clone().map_err(|reason| TaskError::NothingToLearn { reason })
    }
}

/// Number of demonstrations from which states are learned, as in the paper.
pub(super) const DEMOS: usize = 5;

/// Figure 3: the number of states found in five demonstrations.
pub(super) struct Clusters;

impl Clusters {
    fn domain(seed: Seed) -> Result<(Recording, RelationalDomain), TaskError> {
        let recording = shown(1, DEMOS, seed)?;
        let domain = learn(&recording, &Settings::paper())?.domain;
        Ok((recording, domain))
    }
}

impl Experiment for Clusters {
    fn about(&self) -> About {
        let question =
            "How many states of nut and bolt are found in five demonstrations with one of each?";
        let settings = json!({"demonstrations": DEMOS, "p": PAPER_EXPONENT});
        About { name: "figure-3", question, revision: 1, settings }
    }

    fn cells(&self) -> Vec<Cell> {
        let readings = [
            (Measure::Mean, "states of the nut"),
            (Measure::Mean, "states of the bolt"),
            (Measure::Rate, "two and three, each true to the scene"),
        ];
        let readings = readings.map(|(m, what)| Reading::what(m, what));
        vec![Cell::new(json!({}), 10, readings.into())]
    }

    fn trial(&self, _cell: &Cell, seed: Seed) -> Result<TrialOutcome, TaskError> {
        let (recording, domain) = Self::domain(seed)?;
        let spec = scene(1);
        let of = |kind: &str| domain.states.iter().filter(|s| s.kind == kind).count();
        let classifier = Classifier::new(&domain).with_rule(ClassifierRule::paper())?;
        // The true state of each pose must equal the true state at the mean of its learned state.
        let agrees = |(kind, pose): (&str, &Pose)| {
            let mean = mean(&domain, &classifier, kind, pose);
            mean.is_some_and(|mean| truth(&spec, kind, mean) == truth(&spec, kind, pose.position))
        };
        let right = of("nut") == 2 && of("bolt") == 3 && part_poses(&recording, &spec).all(agrees);
        Ok(outcome([of("nut") as f64, of("bolt") as f64, if right { 1.0 } else { 0.0 }]))
    }

    fn figure(&self, results: &Results) -> Option<Figure> {
        let seed = Seed::new(results.settings["seed"].as_u64()?).derive_index("trial", 0);
        let (recording, domain) = Self::domain(seed).ok()?;
        let classifier = Classifier::new(&domain).with_rule(ClassifierRule::paper()).ok()?;
        let mut series: Vec<Series> = domain
            .states
            .iter()
            .map(|state| Series::new(state.name.clone(), Vec::new(), Style::Points))
            .collect();
        for (kind, pose) in poses(&recording) {
            if let Some(fact) = classifier.classify_alone(kind, pose).fact {
                let [x, _, z] = pose.position;
                series[fact.state].marks.push(Mark { x, y: 1e3 * z, bar: None });
            }
        }
        Some(Figure {
            title: "States found in five demonstrations".into(),
            x: Axis::new("x (m)"),
            y: Axis::new("height of the part's origin (mm)"),
            series,
        })
    }
}

/// Returns the mean position of the state that a pose is in.
fn mean(
    domain: &RelationalDomain,
    classifier: &Classifier,
    kind: &str,
    pose: &Pose,
) -> Option<[f64; 3]> {
    let fact = classifier.classify_alone(kind, pose).fact?;
    Some(domain.states[fact.state].places[fact.place].pose().position)
}

/// Number of demonstrations whose poses are classified. Each has three of each part, which gives 96 poses in a trial.
const UNSEEN: usize = 2;

/// Number of poses, indexed by rule, true state, and the state that the rule gives. The last column is for no state.
type Confusion = [[[f64; TRUTHS.len() + 1]; TRUTHS.len()]; 2];

/// Figure 4: unseen poses, classified by the paper's rule and by ours.
pub(super) struct Classification {
    made: Once<Confusion>,
}

const RULES: [&str; 2] = ["paper", "ours"];

/// Returns each name with its index.
fn numbered<const N: usize>(names: [&str; N]) -> [(&str, usize); N] {
    std::array::from_fn(|index| (names[index], index))
}

impl Classification {
    pub fn new() -> Self {
        Self { made: Once::new() }
    }

    fn confusion(seed: Seed) -> Result<Confusion, TaskError> {
        let (_, domain) = Clusters::domain(seed)?;
        let unseen = shown(3, UNSEEN, seed.derive("", "unseen"))?;
        let spec = scene(3);
        let mut counts = [[[0.0; TRUTHS.len() + 1]; TRUTHS.len()]; 2];
        let rules = [ClassifierRule::paper(), ClassifierRule::default()];
        for (rule, counts) in rules.into_iter().zip(&mut counts) {
            let classifier = Classifier::new(&domain).with_rule(rule)?;
            for (kind, pose) in part_poses(&unseen, &spec) {
                let said = mean(&domain, &classifier, kind, pose);
                let said = said.map_or(TRUTHS.len(), |mean| truth(&spec, kind, mean));
                counts[truth(&spec, kind, pose.position)][said] += 1.0;
            }
        }
        Ok(counts)
    }
}

impl Experiment for Classification {
    fn about(&self) -> About {
        let question = "Which state is an unseen pose in, by the paper's rule and by ours?";
        let settings = json!({"demonstrations": DEMOS, "unseen_demonstrations_of_three": UNSEEN});
        About { name: "figure-4", question, revision: 2, settings }
    }

    fn cells(&self) -> Vec<Cell> {
        let mut cells = Vec::new();
        for rule in RULES {
            for truth in TRUTHS {
                let total = TRUTHS.len() + 1;
                let said = TRUTHS.into_iter().chain(["none"]);
                let mut readings: Vec<Reading> = said
                    .map(|said| Reading::new(Measure::Share(total), json!({"said": said})))
                    .collect();
                readings.push(Reading::count());
                cells.push(Cell::new(json!({"rule": rule, "truth": truth}), 20, readings));
            }
        }
        cells
    }

    fn trial(&self, cell: &Cell, seed: Seed) -> Result<TrialOutcome, TaskError> {
        let made = self.made.get(seed.value(), || Self::confusion(seed))?;
        let (rule, truth) = (numbered(RULES), numbered(TRUTHS));
        let row = made[cell.choice("rule", &rule)?][cell.choice("truth", &truth)?];
        let mut out = [f64::NAN; MAX_READINGS];
        out[..row.len()].copy_from_slice(&row);
        out[row.len()] = row.iter().sum();
        Ok(out)
    }

    fn figure(&self, results: &Results) -> Option<Figure> {
        let series = RULES.map(|rule| {
            let name = if rule == RULES[0] { "the paper's rule" } else { "our rule" };
            let marks = TRUTHS
                .iter()
                .rev()
                .enumerate()
                .flat_map(|(at, truth)| {
                    let shift = if rule == RULES[0] { 0.12 } else { -0.12 };
                    let wanted = json!({"rule": rule, "truth": truth, "said": truth});
                    results.marks(&wanted, |row| Some(row.percent(at as f64 + shift).across()))
                })
                .collect();
            Series::new(name, marks, Style::Points)
        });
        Some(Figure {
            title: "Unseen poses put into their state, with 95% intervals".into(),
            x: Axis::new("right (%)"),
            y: Axis::named(TRUTHS.iter().rev().map(|truth| (*truth).to_owned()).collect()),
            series: series.into(),
        })
    }
}
