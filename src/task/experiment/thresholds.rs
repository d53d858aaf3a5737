//! `threshold`: which clustering thresholds find the true states, in our own scene and in recordings.

use rand::RngExt;
use rand::seq::SliceRandom;
use serde_json::{Value, json};

use super::clusters::{DEMOS, Once, part_poses, poses, scene, shown, truth};
use super::{
    Axis, Cell, Experiment, Figure, Mark, Measure, Options, Outcome, Reading, Results, Series,
    outcome,
};
use crate::sim::Seed;
use crate::task::domain::Domain;
use crate::task::error::TaskError;
use crate::task::files::read_file;
use crate::task::ground::{Classifier, Grounding};
use crate::task::learn::{Dendrogram, PAPER_EXPONENT, Settings, learn};
use crate::task::recording::Recording;

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
    seed: Seed,
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
            seed: options.seed,
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
                let seed = self.seed.derive_index("pool", pool);
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
