//! `threshold`: the clustering thresholds that find the true states, in the simulated scene and in a recording.

use rand::RngExt;
use rand::seq::SliceRandom;
use serde_json::json;

use super::Options;
use super::clusters::{DEMOS, Once, part_poses, poses, scene, shown, truth};
use crate::files::{Limit, read_file};
use crate::sim::Seed;
use crate::study::experiment::{
    About, Axis, Cell, Experiment, Figure, Measure, Reading, Results, Row, Series, Style,
    TrialOutcome, outcome,
};
use crate::task::TaskError;
use crate::task::classify::Classifier;
use crate::task::domain::RelationalDomain;
use crate::task::learn::{Dendrogram, PAPER_EXPONENT, Settings, learn};
use crate::task::recording::Recording;

/// Numbers of poses in a batch.
const BATCHES: [usize; 6] = [15, 30, 60, 120, 200, 300];
/// The threshold of the paper's scene, in metres.
const PAPER_M: f64 = 1.169e-3;

/// Poses of a kind, from which batches are drawn.
struct Kind {
    name: String,
    /// Positions with their true states.
    points: Vec<([f64; 3], usize)>,
    /// Threshold that the learner chooses from other demonstrations, in metres.
    automatic: f64,
}

/// The experiment: the thresholds that cluster batches perfectly, and whether the automatic threshold is among them.
pub(super) struct Thresholds {
    seed: Seed,
    recording: Option<std::path::PathBuf>,
    /// Kinds of the recording that have states.
    recorded: Vec<Kind>,
    made: Once<Vec<Kind>>,
}

/// Number of demonstrations in a pool from which batches are drawn. Each has three of each part.
const POOL_DEMOS: usize = 13;
/// Number of pools.
const POOLS: u64 = 12;

impl Thresholds {
    /// Prepares the experiment. Reads the recording, if there is one, and learns from it.
    pub fn new(options: &Options) -> Result<Self, TaskError> {
        Ok(Self {
            seed: options.seed,
            recorded: options.recording.as_deref().map_or(Ok(Vec::new()), Self::given)?,
            recording: options.recording.clone(),
            made: Once::new(),
        })
    }

    /// Draws poses of the simulated scene. The automatic threshold comes from demonstrations with one of each part.
    fn own(seed: Seed) -> Result<Vec<Kind>, TaskError> {
        let recording = shown(3, POOL_DEMOS, seed)?;
        let few = shown(1, DEMOS, seed.derive("", "few"))?;
        let chosen = learn(&few, &Settings::paper())?.domain;
        let spec = scene(3);
        let kind = |name: &String| Kind {
            name: name.clone(),
            points: part_poses(&recording, &spec)
                .filter(|(kind, _)| kind == name)
                .map(|(kind, pose)| (pose.position, truth(&spec, kind, pose.position)))
                .collect(),
            automatic: automatic(&chosen, name),
        };
        Ok([&spec.nut_kind, &spec.bolt_kind].map(kind).into())
    }

    /// Reads the poses of a recording. The classifier, after learning from the whole recording, defines their true
    /// states. Poses in no state, such as those of falling parts, are left out.
    fn given(path: &std::path::Path) -> Result<Vec<Kind>, TaskError> {
        let name = path.display().to_string();
        let (recording, _) = Recording::parse(&read_file(path, Limit::RECORDING)?, &name)?;
        let domain = learn(&recording, &Settings::paper())?.domain;
        let classifier = Classifier::new(&domain);
        let mut names: Vec<String> = domain.states.iter().map(|s| s.kind.clone()).collect();
        names.sort();
        names.dedup();
        let kind = |name: String| Kind {
            points: poses(&recording)
                .filter(|(kind, _)| *kind == name)
                .filter_map(|(kind, pose)| {
                    Some((pose.position, classifier.classify_alone(kind, pose).fact?.state))
                })
                .collect(),
            automatic: automatic(&domain, &name),
            name,
        };
        Ok(names.into_iter().map(kind).collect())
    }
}

fn automatic(domain: &RelationalDomain, kind: &str) -> f64 {
    let clusters = domain.provenance.clusters.iter().find(|c| c.kind == kind);
    clusters.and_then(|c| c.threshold_m).unwrap_or(f64::NAN)
}

/// Returns the range of perfect thresholds. Above the first value every true state is one cluster. Up to the second
/// value no cluster has poses of two states.
fn range(points: &[([f64; 3], usize)]) -> Result<[f64; 2], TaskError> {
    let positions: Vec<[f64; 3]> = points.iter().map(|p| p.0).collect();
    let tree = Dendrogram::new(&positions, PAPER_EXPONENT, "part")?;
    let (mut low, mut high) = (0.0f64, f64::INFINITY);
    // The true state of each cluster; `None` for a cluster with poses of several states.
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
    // With fewer merges within states than this, some state is never a single cluster.
    let whole = joins + states.len() == points.len();
    Ok([if whole { low } else { f64::INFINITY }, high])
}

impl Thresholds {
    /// Returns the source and the kind of the batches of each group of cells.
    fn sources(&self) -> Vec<(&'static str, String)> {
        let spec = scene(3);
        let mut sources = vec![("scene", spec.nut_kind), ("scene", spec.bolt_kind)];
        sources.extend(self.recorded.iter().map(|k| ("recording", k.name.clone())));
        sources
    }
}

impl Experiment for Thresholds {
    fn about(&self) -> About {
        let question = "Which clustering thresholds find the true states of a batch of poses, and does the automatic threshold?";
        let settings = json!({
            "p": PAPER_EXPONENT, "paper_mm": 1e3 * PAPER_M, "pool_demonstrations_of_three": POOL_DEMOS,
            "recording": self.recording.as_deref().and_then(|path| Some(path.file_name()?.display().to_string())),
            "recorded": self.recorded.iter().map(|k| (k.points.len(), 1e3 * k.automatic)).collect::<Vec<_>>(),
        });
        About { name: "threshold", question, revision: 3, settings }
    }

    fn cells(&self) -> Vec<Cell> {
        let mut cells = Vec::new();
        for (source, kind) in self.sources() {
            for batch in BATCHES {
                let pool = 5;
                let readings = [
                    (Measure::ClusteredRate(pool), "some threshold is perfect"),
                    (Measure::ClusteredMean(pool), "lowest perfect threshold (mm)"),
                    (Measure::ClusteredMean(pool), "highest perfect threshold (mm)"),
                    (Measure::ClusteredRate(pool), "the automatic choice is perfect"),
                    (Measure::ClusteredRate(pool), "the paper's 1.169 mm is perfect"),
                    (Measure::Auxiliary, "the set of demonstrations that it is drawn from"),
                ];
                let readings = readings.map(|(m, what)| Reading::what(m, what));
                let settings = json!({"source": source, "kind": kind, "batch": batch});
                cells.push(Cell::new(settings, 100, readings.into()));
            }
        }
        cells
    }

    fn trial(&self, cell: &Cell, seed: Seed) -> Result<TrialOutcome, TaskError> {
        let mut rng = seed.rng();
        let made;
        // Batches from the same pool are correlated. There is only one recording, so its batches count as independent.
        let mut set = seed.value() as f64;
        let kinds = match cell.is("source", "scene") {
            true => {
                let pool = rng.random_range(0..POOLS);
                set = pool as f64;
                let seed = self.seed.derive_index("pool", pool);
                made = self.made.get(pool, || Self::own(seed))?;
                &*made
            }
            false => &self.recorded,
        };
        let kind = kinds.iter().find(|kind| cell.is("kind", &kind.name));
        // A batch has at least one pose of each state of its kind.
        let Some(kind) = kind else { return Ok(outcome([])) };
        let mut points = kind.points.clone();
        points.shuffle(&mut rng);
        let mut states: Vec<usize> = points.iter().map(|p| p.1).collect();
        states.sort_unstable();
        states.dedup();
        for (at, state) in states.iter().enumerate() {
            if let Some(found) = points.iter().position(|p| p.1 == *state) {
                points.swap(at, found.max(at));
            }
        }
        points.truncate(cell.number("batch")? as usize);
        let [low, high] = range(&points)?;
        let perfect = |threshold: f64| if low < threshold && threshold <= high { 1.0 } else { 0.0 };
        let (automatic, there) = (kind.automatic, low < high);
        let mm = |metres: f64| if there { 1e3 * metres } else { f64::NAN };
        Ok(outcome([
            if there { 1.0 } else { 0.0 },
            mm(low),
            mm(high),
            perfect(automatic),
            perfect(PAPER_M),
            set,
        ]))
    }

    fn figure(&self, results: &Results) -> Option<Figure> {
        let mut series = Vec::new();
        let all = self.sources();
        for (source, kind) in all {
            for (what, name) in [
                ("lowest perfect threshold (mm)", "lowest"),
                ("highest perfect threshold (mm)", "highest"),
            ] {
                let wanted = json!({"what": what, "source": source, "kind": kind});
                let mark = |row: &Row| row.median(row.number("batch")?, |v| v.max(1e-6).log10());
                let marks = results.marks(&wanted, mark);
                let name = format!("{name} for a {kind}, {source}");
                series.push(Series::new(name, marks, Style::Line));
            }
        }
        Some(Figure {
            title: "Thresholds that find the true states (median, 5 to 95% of the batches)".into(),
            x: Axis::from_to("poses in the batch", 0.0, 315.0),
            y: Axis::logarithmic("threshold (mm)", 10.0),
            series,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_perfect_range_lies_between_the_last_merge_within_and_the_first_between() {
        // Two states that differ in every coordinate. The poses of a state have nearly the same height.
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
        assert_eq!(tree.cut(high), [0, 0, 0, 1, 1], "a merge at exactly the threshold is not made");
        assert_ne!(tree.cut(low), [0, 0, 0, 1, 1]);
        assert_ne!(tree.cut(1.001 * high), [0, 0, 0, 1, 1]);
        // A true state with a distant pose leaves no perfect range.
        let mut torn = points;
        torn[1].1 = 1;
        let [low, high] = range(&torn).expect("clusters");
        assert!(low >= high, "{low} {high}");
    }
}
