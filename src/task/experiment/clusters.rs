//! `figure-3`, `figure-4` and `threshold`: states found in demonstrations of our own scene.
//!
//! What is true of a part is read off the scene's own measures: over the jig's pocket or hole, or elsewhere.
//! A bolt over the pocket is assembled. Learner and classifiers know nothing of it.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock};

use rand::RngExt;
use rand::seq::SliceRandom;
use serde_json::{Value, json};

use super::{
    Axis, Cell, Experiment, Figure, Mark, Measure, Options, Outcome, Reading, Results, Series,
    outcome,
};
use crate::sim::Seed;
use crate::task::demonstrate;
use crate::task::domain::Domain;
use crate::task::error::TaskError;
use crate::task::files::read_file;
use crate::task::ground::{Classifier, Grounding};
use crate::task::learn::{Dendrogram, PAPER_EXPONENT, Settings, learn};
use crate::task::pose::Pose;
use crate::task::recording::Recording;
use crate::task::scene::SceneSpec;

/// What can be true of a part.
const TRUTHS: [&str; 5] =
    ["NUT_ON_TABLE", "NUT_IN_JIG", "BOLT_ON_TABLE", "BOLT_IN_JIG", "BOLT_ASSEMBLED"];

/// How far a part in its place can be from the place's middle, in metres.
const NEAR_M: f64 = 0.01;

/// Which of [`TRUTHS`] holds of a part of our own scene.
fn truth(spec: &SceneSpec, kind: &str, position: [f64; 3]) -> usize {
    let over = |[x, y]: [f64; 2]| (position[0] - x).hypot(position[1] - y) < NEAR_M;
    match (kind == spec.nut_kind, over(spec.jig.pocket), over(spec.jig.hole)) {
        (true, true, _) => 1,
        (true, ..) => 0,
        (false, true, _) => 4,
        (false, _, true) => 3,
        (false, ..) => 2,
    }
}

fn scene(parts: usize) -> SceneSpec {
    SceneSpec { nuts: parts, bolts: parts, ..SceneSpec::default() }
}

/// Demonstrations of our own scene with so many of each part.
fn shown(parts: usize, demos: usize, seed: Seed) -> Result<Recording, TaskError> {
    Ok(demonstrate(&scene(parts), demos, seed, &mut |_| {})?.recording)
}

/// All poses of a recording with their kinds.
fn poses(recording: &Recording) -> impl Iterator<Item = (&str, &Pose)> {
    let snapshots = recording.demos.iter().flat_map(|demo| &demo.snapshots);
    snapshots.flat_map(|s| &s.objects).map(|object| (&*object.kind, &object.pose))
}

/// The poses of parts of our own scene, without pocket and hole.
fn part_poses<'r>(
    recording: &'r Recording,
    spec: &'r SceneSpec,
) -> impl Iterator<Item = (&'r str, &'r Pose)> {
    poses(recording).filter(|(kind, _)| *kind == spec.nut_kind || *kind == spec.bolt_kind)
}

type Made<T> = Arc<OnceLock<Result<Arc<T>, String>>>;

/// Something dear that several cells need of the same trial: made once, whoever asks first.
struct Once<T>(Mutex<HashMap<u64, Made<T>>>);

impl<T> Once<T> {
    fn new() -> Self {
        Self(Mutex::new(HashMap::new()))
    }

    fn get(
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

/// Demonstrations that states are learned from, as in the paper.
const DEMOS: usize = 5;

/// `figure-3`: how many states are found in five demonstrations.
pub(super) struct Clusters {
    trials: u64,
}

impl Clusters {
    pub fn new(options: &Options) -> Self {
        Self { trials: options.trials.unwrap_or(10) }
    }

    fn domain(seed: Seed) -> Result<(Recording, Domain), TaskError> {
        let recording = shown(1, DEMOS, seed)?;
        let domain = learn(&recording, &Settings::default())?.domain;
        Ok((recording, domain))
    }
}

impl Experiment for Clusters {
    fn name(&self) -> &'static str {
        "figure-3"
    }

    fn question(&self) -> &'static str {
        "How many states of nut and bolt are found in five demonstrations with one of each?"
    }

    fn settings(&self) -> Value {
        json!({"demonstrations": DEMOS, "p": PAPER_EXPONENT})
    }

    fn cells(&self) -> Vec<Cell> {
        let readings = [
            (Measure::Mean, "states of the nut"),
            (Measure::Mean, "states of the bolt"),
            (Measure::Rate, "two and three, each true to the scene"),
        ];
        let readings = readings.map(|(m, what)| Reading::new(m, json!({"what": what})));
        vec![Cell::new(json!({}), self.trials, readings.into())]
    }

    fn trial(&self, _cell: usize, seed: Seed) -> Result<Outcome, TaskError> {
        let (recording, domain) = Self::domain(seed)?;
        let spec = scene(1);
        let of = |kind: &str| domain.states().iter().filter(|s| s.kind == kind).count();
        let classifier = Classifier::new(&domain, Grounding::paper())?;
        // Each pose lies nearest to a state whose own middle is true of the same.
        let agrees = |(kind, pose): (&str, &Pose)| {
            let state = classifier.classify(kind, pose).state.map(|s| &domain.states()[s]);
            state.is_some_and(|s| {
                truth(&spec, kind, s.mean.position) == truth(&spec, kind, pose.position)
            })
        };
        let sound = of("nut") == 2 && of("bolt") == 3 && part_poses(&recording, &spec).all(agrees);
        Ok(outcome([of("nut") as f64, of("bolt") as f64, if sound { 1.0 } else { 0.0 }]))
    }

    fn figure(&self, results: &Results) -> Option<Figure> {
        let seed = Seed::new(results.settings["seed"].as_u64()?).derive_index("trial", 0);
        let (recording, domain) = Self::domain(seed).ok()?;
        let classifier = Classifier::new(&domain, Grounding::paper()).ok()?;
        let mut series: Vec<Series> = domain
            .states()
            .iter()
            .map(|state| Series {
                name: state.name.clone(),
                marks: Vec::new(),
                joined: false,
                dashed: false,
            })
            .collect();
        for (kind, pose) in poses(&recording) {
            if let Some(state) = classifier.classify(kind, pose).state {
                let [x, _, z] = pose.position;
                series[state].marks.push(Mark { x, y: 1e3 * z, bar: None });
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

/// Demonstrations with three of each part, whose poses nobody has seen: above 602 of them.
const UNSEEN: usize = 13;

/// Poses of a trial: by truth, and by what each rule says of them; the last stands for no state.
type Confusion = [[[f64; TRUTHS.len() + 1]; TRUTHS.len()]; 2];

/// `figure-4`: unseen poses classified by the paper's rule and by ours.
pub(super) struct Classification {
    trials: u64,
    made: Once<Confusion>,
}

const RULES: [&str; 2] = ["paper", "ours"];

impl Classification {
    pub fn new(options: &Options) -> Self {
        Self { trials: options.trials.unwrap_or(3), made: Once::new() }
    }

    fn confusion(seed: Seed) -> Result<Confusion, TaskError> {
        let (_, domain) = Clusters::domain(seed)?;
        let unseen = shown(3, UNSEEN, seed.derive("", "unseen"))?;
        let spec = scene(3);
        let mut counts = [[[0.0; TRUTHS.len() + 1]; TRUTHS.len()]; 2];
        for (rule, counts) in
            [Grounding::paper(), Grounding::default()].into_iter().zip(&mut counts)
        {
            let classifier = Classifier::new(&domain, rule)?;
            for (kind, pose) in part_poses(&unseen, &spec) {
                let said = classifier.classify(kind, pose).state.map_or(TRUTHS.len(), |state| {
                    truth(&spec, kind, domain.states()[state].mean.position)
                });
                counts[truth(&spec, kind, pose.position)][said] += 1.0;
            }
        }
        Ok(counts)
    }
}

impl Experiment for Classification {
    fn name(&self) -> &'static str {
        "figure-4"
    }

    fn question(&self) -> &'static str {
        "Which state is an unseen pose in, by the paper's rule and by ours?"
    }

    fn settings(&self) -> Value {
        json!({"demonstrations": DEMOS, "unseen_demonstrations_of_three": UNSEEN})
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
                readings.push(Reading::new(Measure::Mean, json!({"said": "poses a trial"})));
                cells.push(Cell::new(json!({"rule": rule, "truth": truth}), self.trials, readings));
            }
        }
        cells
    }

    fn trial(&self, cell: usize, seed: Seed) -> Result<Outcome, TaskError> {
        let made = self.made.get(seed.value(), || Self::confusion(seed))?;
        let row = made[cell / TRUTHS.len()][cell % TRUTHS.len()];
        let mut out = [f64::NAN; super::WIDTH];
        out[..row.len()].copy_from_slice(&row);
        out[row.len()] = row.iter().sum();
        Ok(out)
    }

    fn figure(&self, results: &Results) -> Option<Figure> {
        let series = RULES.map(|rule| Series {
            name: format!("{rule} rule"),
            marks: TRUTHS
                .iter()
                .enumerate()
                .filter_map(|(at, truth)| {
                    let row = results.rows.iter().find(|row| {
                        row.is("rule", &json!(rule))
                            && row.is("truth", &json!(truth))
                            && row.is("said", &json!(truth))
                    })?;
                    let shift = if rule == RULES[0] { -0.08 } else { 0.08 };
                    let bar = Some(row.statistic.interval95().map(|v| 100.0 * v));
                    Some(Mark { x: at as f64 + 1.0 + shift, y: 100.0 * row.statistic.value(), bar })
                })
                .collect(),
            joined: false,
            dashed: false,
        });
        Some(Figure {
            title: "Unseen poses put into their state".into(),
            x: Axis::from_to(
                "1, 2: nut on table, in jig; 3, 4, 5: bolt on table, in jig, assembled",
                0.5,
                5.5,
            ),
            y: Axis::new("right (%)"),
            series: series.into(),
        })
    }
}

/// Sizes of batches.
const BATCHES: [usize; 6] = [15, 30, 60, 120, 200, 300];
/// The threshold of the paper's scene, in metres.
const PAPER_M: f64 = 1.169e-3;

/// Positions of one kind with what is true of each.
type Points = Vec<([f64; 3], usize)>;

/// What batches are drawn from.
struct Pool {
    kinds: Vec<Points>,
    /// What the learner takes of the demonstrations for each kind, in metres.
    automatic: Vec<f64>,
}

/// `threshold`: which thresholds cluster batches perfectly, and whether the automatic choice does.
pub(super) struct Thresholds {
    trials: u64,
    recording: Option<std::path::PathBuf>,
    made: Once<Pool>,
}

/// Demonstrations with three of each that batches are drawn from, and in how many sets.
const POOL_DEMOS: usize = 13;
const POOLS: u64 = 2;

impl Thresholds {
    pub fn new(options: &Options) -> Self {
        Self {
            trials: options.trials.unwrap_or(100),
            recording: options.recording.clone(),
            made: Once::new(),
        }
    }

    /// Poses of our own scene; what the learner chose comes from demonstrations with one of each.
    fn own(seed: Seed) -> Result<Pool, TaskError> {
        let recording = shown(3, POOL_DEMOS, seed)?;
        let few = shown(1, DEMOS, seed.derive("", "few"))?;
        let chosen = learn(&few, &Settings::default())?.domain;
        let spec = scene(3);
        let mut kinds = vec![Vec::new(), Vec::new()];
        for (kind, pose) in part_poses(&recording, &spec) {
            let at = usize::from(kind == spec.bolt_kind);
            kinds[at].push((pose.position, truth(&spec, kind, pose.position)));
        }
        let automatic = [&spec.nut_kind, &spec.bolt_kind].map(|kind| automatic(&chosen, kind));
        Ok(Pool { kinds, automatic: automatic.into() })
    }

    /// Poses of a recording; what is true of them is what our rule makes of them with all of it learned. Poses in
    /// no state, as of parts that fall, are left out.
    fn given(path: &std::path::Path) -> Result<Pool, TaskError> {
        let name = path.display().to_string();
        let (recording, _) = Recording::parse(&read_file(path)?, &name)?;
        let domain = learn(&recording, &Settings::default())?.domain;
        let classifier = Classifier::new(&domain, Grounding::default())?;
        let mut names: Vec<String> = domain.states().iter().map(|s| s.kind.clone()).collect();
        names.sort();
        names.dedup();
        let mut kinds = vec![Vec::new(); names.len()];
        for (kind, pose) in poses(&recording) {
            let at = names.iter().position(|n| n == kind);
            if let (Some(at), Some(state)) = (at, classifier.classify(kind, pose).state) {
                kinds[at].push((pose.position, state));
            }
        }
        let automatic = names.iter().map(|kind| automatic(&domain, kind)).collect();
        Ok(Pool { kinds, automatic })
    }
}

fn automatic(domain: &Domain, kind: &str) -> f64 {
    let clusters = domain.provenance().clusters.iter().find(|c| c.kind == kind);
    clusters.and_then(|c| c.threshold_m).unwrap_or(f64::NAN)
}

/// Above which threshold every true state is one cluster, and up to which no two are one: perfect in between.
fn range(points: &[([f64; 3], usize)]) -> Result<[f64; 2], TaskError> {
    let positions: Vec<[f64; 3]> = points.iter().map(|p| p.0).collect();
    let tree = Dendrogram::new(&positions, PAPER_EXPONENT, "part")?;
    let (mut low, mut high) = (0.0f64, f64::INFINITY);
    // The true state of each cluster, as long as it has one.
    let mut pure: Vec<Option<usize>> = points.iter().map(|p| Some(p.1)).collect();
    let mut joins = 0;
    for merge in tree.merges() {
        let same = match (pure[merge.first], pure[merge.second]) {
            (Some(a), Some(b)) if a == b => Some(a),
            _ => None,
        };
        match same {
            Some(_) => {
                low = low.max(merge.height);
                joins += 1;
            }
            None => high = high.min(merge.height),
        }
        pure.push(same);
    }
    let mut states: Vec<usize> = points.iter().map(|p| p.1).collect();
    states.sort_unstable();
    states.dedup();
    // A state whose poses never come together on their own is never one cluster.
    let whole = joins + states.len() == points.len();
    Ok([if whole { low } else { f64::INFINITY }, high])
}

impl Experiment for Thresholds {
    fn name(&self) -> &'static str {
        "threshold"
    }

    fn question(&self) -> &'static str {
        "Which clustering thresholds find the true states of a batch of poses, and does ours?"
    }

    fn settings(&self) -> Value {
        json!({
            "p": PAPER_EXPONENT, "paper_mm": 1e3 * PAPER_M, "pool_demonstrations_of_three": POOL_DEMOS,
            "recording": self.recording,
        })
    }

    fn cells(&self) -> Vec<Cell> {
        let sources =
            if self.recording.is_some() { vec!["scene", "recording"] } else { vec!["scene"] };
        let mut cells = Vec::new();
        for source in sources {
            for batch in BATCHES {
                let readings = [
                    (Measure::Rate, "some threshold is perfect"),
                    (Measure::Mean, "lowest perfect threshold (mm)"),
                    (Measure::Mean, "highest perfect threshold (mm)"),
                    (Measure::Rate, "the automatic choice is perfect"),
                    (Measure::Rate, "the paper's 1.169 mm is perfect"),
                ];
                let readings = readings.map(|(m, what)| Reading::new(m, json!({"what": what})));
                let settings = json!({"source": source, "batch": batch});
                cells.push(Cell::new(settings, self.trials, readings.into()));
            }
        }
        cells
    }

    fn trial(&self, cell: usize, seed: Seed) -> Result<Outcome, TaskError> {
        let mut rng = seed.rng();
        let pool = match &self.recording {
            Some(path) if cell >= BATCHES.len() => self.made.get(u64::MAX, || Self::given(path))?,
            _ => {
                let pool = rng.random_range(0..POOLS);
                let seed = Seed::new(pool).derive("threshold", "pool");
                self.made.get(pool, || Self::own(seed))?
            }
        };
        // A batch is of one kind; it holds at least one pose of each of the kind's states.
        let kind = rng.random_range(0..pool.kinds.len());
        let mut points = pool.kinds[kind].clone();
        points.shuffle(&mut rng);
        let mut states: Vec<usize> = points.iter().map(|p| p.1).collect();
        states.sort_unstable();
        states.dedup();
        for (at, state) in states.iter().enumerate() {
            if let Some(found) = points.iter().position(|p| p.1 == *state) {
                points.swap(at, found.max(at));
            }
        }
        points.truncate(BATCHES[cell % BATCHES.len()]);
        let [low, high] = range(&points)?;
        let perfect = |threshold: f64| if low < threshold && threshold <= high { 1.0 } else { 0.0 };
        let (automatic, there) = (pool.automatic[kind], low < high);
        let mm = |metres: f64| if there { 1e3 * metres } else { f64::NAN };
        Ok(outcome([
            if there { 1.0 } else { 0.0 },
            mm(low),
            mm(high),
            perfect(automatic),
            perfect(PAPER_M),
        ]))
    }

    fn figure(&self, results: &Results) -> Option<Figure> {
        let mut series = Vec::new();
        for (what, name) in [
            ("lowest perfect threshold (mm)", "lowest perfect"),
            ("highest perfect threshold (mm)", "highest perfect"),
        ] {
            let of = |row: &&super::Row| {
                row.is("what", &json!(what)) && row.is("source", &json!("scene"))
            };
            let mark = |row: &super::Row| {
                let bar = Some(row.statistic.interval95().map(|v| v.max(1e-6).log10()));
                let y = row.statistic.value().max(1e-6).log10();
                Some(Mark { x: row.number("batch")?, y, bar })
            };
            let marks = results.rows.iter().filter(of).filter_map(mark).collect();
            series.push(Series { name: name.into(), marks, joined: true, dashed: false });
        }
        Some(Figure {
            title: "Thresholds that find the true states (mean over batches)".into(),
            x: Axis::new("poses in the batch"),
            y: Axis::new("threshold (log10 of mm)"),
            series,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_perfect_range_lies_between_the_last_merge_within_and_the_first_between() {
        // Two states that differ in every coordinate, each of poses at one height.
        let at = |x: f64, y: f64, z: f64| [x, y, z];
        let points = vec![
            (at(0.0, 0.3, 0.001), 0),
            (at(0.5, 0.9, 0.0012), 0),
            (at(0.25, 0.55, 0.0011), 0),
            (at(0.7, 0.1, 0.05), 1),
            (at(0.71, 0.11, 0.0501), 1),
        ];
        let [low, high] = range(&points).expect("clusters");
        assert!(low > 0.0 && low < high, "{low} {high}");
        let positions: Vec<[f64; 3]> = points.iter().map(|p| p.0).collect();
        let tree = Dendrogram::new(&positions, PAPER_EXPONENT, "part").expect("clusters");
        assert_eq!(tree.cut((low * high).sqrt()), [0, 0, 0, 1, 1]);
        assert_eq!(tree.cut(high), [0, 0, 0, 1, 1], "merges at the threshold are not made");
        assert_ne!(tree.cut(low), [0, 0, 0, 1, 1]);
        assert_ne!(tree.cut(1.001 * high), [0, 0, 0, 1, 1]);
        // A true state that is torn apart leaves no perfect range.
        let mut torn = points;
        torn[1].1 = 1;
        let [low, high] = range(&torn).expect("clusters");
        assert!(low >= high, "{low} {high}");
    }
}
